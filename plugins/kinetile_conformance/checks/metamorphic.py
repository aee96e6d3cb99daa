"""Metamorphic checks: a transformed scene must have the transformed contacts.

Scenes are mirrored, have their axes exchanged, are renumbered, enlarged, moved, slowed, or begun
later. All factors are powers of two and all shifts dyadic, so rounding does not make a transformed
scene another scene; where it does, the phase is compared with the reference on that scene too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinetile.scene import Scene, Turn
from kinetile_conformance.cases import Subject, outcome
from kinetile_conformance.checks.check import Disagreement, Reference, agree, check
from kinetile_conformance.strategies.changes import changed, enlarged, shifted_in_time, slowed


@check(turns=True)
def does_not_see_the_start(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It does not see when the clock starts."""
    late = shifted_in_time(scene, 2.0**40)
    here, there = outcome(subject, scene), outcome(subject, late)
    for name in ("epoch", "tick", "a", "b"):
        if here.contacts[name].tolist() != there.contacts[name].tolist():
            raise Disagreement(f"started at 2^40, its contacts have another {name}")


def other_views(scene: Scene) -> Iterator[tuple[str, Scene]]:
    """Yield (name of the transformation, transformed scene)."""
    arena = scene.arena
    flip = np.array([-1.0, 1.0])
    width = np.array([arena[0] if arena else 0.0, 0.0])
    yield (
        "mirrored",
        changed(
            scene,
            position=width + scene.position * flip,
            velocity=scene.velocity * flip,
            turns=[Turn(t.body, t.time, (-t.velocity[0], t.velocity[1])) for t in scene.turns],
        ),
    )
    yield (
        "with its axes exchanged",
        changed(
            scene,
            position=scene.position[:, ::-1],
            velocity=scene.velocity[:, ::-1],
            arena=None if arena is None else (arena[1], arena[0]),
            turns=[Turn(t.body, t.time, (t.velocity[1], t.velocity[0])) for t in scene.turns],
        ),
    )
    yield (
        "renumbered",
        changed(
            scene,
            position=scene.position[::-1],
            velocity=scene.velocity[::-1],
            radius=scene.radius[::-1],
            mass=scene.mass[::-1],
            turns=[Turn(len(scene) - 1 - t.body, t.time, t.velocity) for t in scene.turns],
        ),
    )
    yield "32 times as large", enlarged(scene, 32.0)
    yield "2^40 times as small", enlarged(scene, 2.0**-40)
    yield "256 times as slow", slowed(scene, 256.0)  # so long that the clock's base moves on
    if arena is None and len(scene):
        yield "moved", changed(scene, position=scene.position + np.array([2.0**12, -(2.0**9)]))
        yield (
            "moved to where all coordinates are negative",
            changed(scene, position=scene.position - np.ceil(scene.position.max(axis=0))),
        )


@check(turns=True, share=0.7)
def same_contacts_after_a_change_of_view(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts on the mirrored, turned, renumbered, enlarged, moved and slowed scene as
    well."""
    for how, view in other_views(scene):
        agree(subject, view, reference, f"{how}, ")
