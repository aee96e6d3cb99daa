"""Scenes made from scenes: with other fields, enlarged, slowed, begun later.

All factors are powers of two, so rounding does not make a scene another one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from kinetile.scene import Scene, Turn
from kinetile_conformance.cases import horizon


def changed(scene: Scene, **fields: Any) -> Scene:
    """Return a scene with some fields changed."""
    return scene.replace(**fields)


def without(scene: Scene, body: int) -> Scene:
    """Return a scene without one of its bodies."""
    left = np.arange(len(scene)) != body
    return changed(
        scene,
        **{name: getattr(scene, name)[left] for name in ("position", "velocity", "radius", "mass")},
        turns=[t._replace(body=t.body - (t.body > body)) for t in scene.turns if t.body != body],
    )


def enlarged(scene: Scene, by: float) -> Scene:
    """Return a scene in which all lengths, and so all speeds, are multiplied."""
    arena = scene.arena
    return changed(
        scene,
        position=scene.position * by,
        velocity=scene.velocity * by,
        radius=scene.radius * by,
        arena=None if arena is None else (arena[0] * by, arena[1] * by),
        turns=[Turn(t.body, t.time, (t.velocity[0] * by, t.velocity[1] * by)) for t in scene.turns],
    )


def slowed(scene: Scene, by: float) -> Scene:
    """Return a scene in which all durations are multiplied."""
    turns = [
        Turn(t.body, scene.start + by * (t.time - scene.start), (t.velocity[0] / by, t.velocity[1] / by))
        for t in scene.turns
    ]
    settings = replace(scene.settings, until=scene.start + by * (horizon(scene) - scene.start))
    return changed(scene, velocity=scene.velocity / by, turns=turns, settings=settings)


def shifted_in_time(scene: Scene, by: float) -> Scene:
    """Return a scene that starts later."""
    turns = [Turn(t.body, t.time + by, t.velocity) for t in scene.turns]
    settings = replace(scene.settings, until=horizon(scene) + by)
    return changed(scene, start=scene.start + by, turns=turns, settings=settings)
