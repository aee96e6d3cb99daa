"""Scenes made from scenes: some bodies or commands of one, or all of it in another view.

All factors are powers of two, so rounding does not make a scene another one.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile import Insert, Scene, Turn
from kinetile_conformance.cases import horizon


def only_bodies(scene: Scene, kept: npt.NDArray[np.integer]) -> Scene:
    """Returns a scene with some of its bodies at the start, under new numbers, with their commands."""
    kept = np.sort(kept)
    new = {int(old): number for number, old in enumerate(kept)}
    coming = {command.body for command in scene.commands if isinstance(command, Insert)}
    new |= {body: body - len(scene) + len(kept) for body in coming}
    columns = ("position", "velocity", "mass", "shape" if scene.shapes else "radius")
    fields: dict[str, Any] = {name: getattr(scene, name)[kept] for name in columns}
    commands = [each._replace(body=new[each.body]) for each in scene.commands if each.body in new]
    return scene.replace(**fields, kind=[scene.kind[body] for body in kept], commands=commands)


def only_commands(scene: Scene, kept: npt.NDArray[np.integer]) -> Scene:
    """Returns a scene with some of its commands, without commands for a body that is never inserted."""
    commands = [scene.commands[at] for at in np.sort(kept)]
    there = {*range(len(scene)), *(command.body for command in commands if isinstance(command, Insert))}
    return scene.replace(commands=[command for command in commands if command.body in there])


def ended_at(scene: Scene, until: float) -> Scene:
    """Returns a scene that runs until another time, without the commands after it."""
    left = [command for command in scene.commands if command.time <= until]
    return scene.replace(settings=replace(scene.settings, until=until), commands=left)


def viewed(scene: Scene, larger: float = 1.0, slower: float = 1.0, later: float = 0.0) -> Scene:
    """Returns a scene with all lengths and all durations multiplied, and a later start."""

    def when(time: float) -> float:
        return scene.start + later + slower * (time - scene.start)

    arena, faster = scene.arena, larger / slower
    return scene.replace(
        position=larger * scene.position,
        velocity=faster * scene.velocity,
        radius=larger * scene.radius,
        arena=None if arena is None else (larger * arena[0], larger * arena[1]),
        turns=[
            Turn(body, when(time), (faster * vx, faster * vy)) for body, time, (vx, vy), *_ in scene.turns
        ],
        start=scene.start + later,
        settings=replace(scene.settings, until=when(horizon(scene))),
    )
