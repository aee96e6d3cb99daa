"""Checks of claims: what a phase declares of itself, and what it must not depend on.

A phase declares that it is right while bodies pass through each other (``solid`` is False), up to a skin
(``skin_limit``), or that it has a feature. It must not depend on what ran before.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kinetile.errors import Refused
from kinetile.plugin.registry import registry
from kinetile.scene import Scene, Settings, with_commands
from kinetile_conformance.cases import SWARM_CONTACTS, Subject, horizon, run_summary
from kinetile_conformance.checks.check import (
    Disagreement,
    DoesNotApply,
    Reference,
    agree,
    check,
    near_fault,
)
from kinetile_conformance.strategies.changes import changed
from kinetile_conformance.strategies.living import ABSENT, SAME_LOOP
from kinetile_conformance.strategies.swarms import swarm, walled_scenes

LOOKS = 8
"""Tests of `near` while bodies pass through each other."""

FINEST = 45
"""Halvings of a scene within its arena; then its bodies are no larger than the rounding of their places."""

THICK = 2.0**-44
"""The size of a cluster at which the skin is some six times the radius of a body."""

EDGES = 6
"""Scenes at the limit of the skin."""


@check(scenes=walled_scenes, share=0.5, judges="broad")
def near_holds_while_bodies_pass(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Where it does not need solid bodies, bodies that touch are near while all pass through all."""
    if subject.composition(scene).broad.solid:
        raise DoesNotApply("it declares that bodies are solid")
    rules: dict[Any, Any] = {("*", "*"): "pass", **SAME_LOOP}
    sim = subject.simulation(with_commands(scene, scene.commands, rules, (*scene.kinds, *ABSENT)))
    step = (horizon(scene) - scene.start) / LOOKS
    for look in range(1, LOOKS + 1):
        sim.run(until=max(scene.start + look * step, sim.time), max_contacts=SWARM_CONTACTS)
        said = near_fault(sim)
        if said is not None:
            raise Disagreement(f"while bodies pass through each other, at time {sim.time!r} {said}")


def _cluster(seed: int, size: float) -> Scene:
    """Return twelve bodies in the far corner of a unit square, with size and speed in proportion to
    ``size``."""
    random = np.random.default_rng(seed)
    chosen = random.permutation(16)[:12]
    radius = random.uniform(0.35, 0.45, 12)
    slot = np.column_stack([chosen % 4, chosen // 4]) + 0.5
    place = slot + (0.49 - radius)[:, None] * random.uniform(-1.0, 1.0, (12, 2))
    velocity = random.normal(size=(12, 2)) + 0.5
    return Scene(
        1.0 - size * place, size * velocity, size * radius, arena=(1.0, 1.0), settings=Settings(until=30.0)
    )


@check(draws=False, replayed_by="same-contacts")
def skin_limit_holds_at_its_edge(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Just below the skin limit that it declares it gives the reference's contacts, and above, it refuses;
    without a limit it gives them where the skin is several times as thick as bodies are wide."""
    if subject.simulation(_cluster(0, 2.0**-4)).composition.broad.skin_limit is None:
        for seed in range(EDGES):
            thick = _cluster(seed, THICK)
            try:
                agree(subject, thick, reference, "with a skin far thicker than bodies are wide, ")
            except Disagreement as error:
                raise Disagreement(str(error), thick) from error
        return
    for seed in range(EDGES):
        accepted, refused = 2.0**-4, 2.0**-FINEST
        for _ in range(FINEST):
            size = float(np.sqrt(accepted * refused))
            try:
                sim = subject.simulation(_cluster(seed, size))
            except Refused:
                refused = size
                continue
            accepted = size
            limit = sim.composition.broad.skin_limit
            if limit is not None and limit < sim.tables.clock[0].limits.skin:
                raise Disagreement(
                    f"it declares a skin limit of {limit!r}, and runs with a skin of "
                    f"{float(sim.tables.clock[0].limits.skin)!r}",
                    _cluster(seed, size),
                )
        edge = _cluster(seed, accepted)
        try:
            agree(subject, edge, reference, "with a skin just below its limit, ")
        except Disagreement as error:
            raise Disagreement(str(error), edge) from error


@check(draws=False, judges="broad")
def its_features_are_known(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Every feature that it declares is one for which there is a check."""
    from kinetile_conformance.checks import CHECKS

    known = sorted({each.feature for each in CHECKS if each.feature is not None})
    declared = registry().spec("broad phase", subject.name).features
    for feature in sorted(declared.difference(known)):
        raise Disagreement(
            f"it declares the feature {feature!r}, which nothing can disprove; features that are put to the "
            f"test: {', '.join(known)}"
        )


@check(turns=True, share=0.5)
def state_is_not_kept(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It repeats itself, also after other simulations: it gives the same contacts."""
    first = run_summary(subject, scene)
    run_summary(subject, swarm("gas" if scene.arena is not None else "cloud", 16))
    run_summary(subject, changed(scene, velocity=-scene.velocity, radius=0.5 * scene.radius))
    again = run_summary(subject, scene)
    if again != first:
        raise Disagreement(
            f"the first run {first[0]}; after other simulations the same run {again[0]}"
            + ("" if again[1] == first[1] else ", and the contacts are others")
        )
    agree(subject, scene, reference, "after other simulations, ")
