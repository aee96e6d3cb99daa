"""Scenes made from scenes: with other fields, enlarged, slowed, begun later.

All factors are powers of two, so rounding does not make a scene another one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.scene import Insert, Scene, Turn
from kinetile_conformance.cases import horizon

COLUMNS = ("position", "velocity", "mass")


def changed(scene: Scene, **fields: Any) -> Scene:
    """Return a scene with some fields changed."""
    return scene.replace(**fields)


def only_bodies(scene: Scene, kept: npt.NDArray[np.integer]) -> Scene:
    """Return a scene with some of its bodies at the start, under new numbers, with their commands."""
    kept = np.sort(kept)
    new = {int(old): number for number, old in enumerate(kept)}
    coming = {command.body for command in scene.commands if isinstance(command, Insert)}
    new |= {body: body - len(scene) + len(kept) for body in coming}
    columns = (*COLUMNS, "shape" if scene.shapes else "radius")
    fields: dict[str, Any] = {name: getattr(scene, name)[kept] for name in columns}
    commands = [each._replace(body=new[each.body]) for each in scene.commands if each.body in new]
    return changed(scene, **fields, kind=[scene.kind[body] for body in kept], commands=commands)


def only_commands(scene: Scene, kept: npt.NDArray[np.integer]) -> Scene:
    """Return a scene with some of its commands, without those for a body that never comes."""
    commands = [scene.commands[at] for at in np.sort(kept)]
    there = {*range(len(scene)), *(command.body for command in commands if isinstance(command, Insert))}
    return changed(scene, commands=[command for command in commands if command.body in there])


def ended_at(scene: Scene, until: float) -> Scene:
    """Return a scene that runs until another time, without the commands after it."""
    left = [command for command in scene.commands if command.time <= until]
    return changed(scene, settings=replace(scene.settings, until=until), commands=left)


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
