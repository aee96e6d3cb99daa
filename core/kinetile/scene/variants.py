"""The same scene with something else about it: a label, commands, room, or the bodies of a later moment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy.typing as npt

from kinetile.errors import Mistake, Refused, SceneError
from kinetile.kernel.clock import Clock
from kinetile.scene.checks import check_frame, shown
from kinetile.scene.commands import Command, Turn
from kinetile.scene.responses import Kind, Pair, Response
from kinetile.scene.scene import Scene, Settings, check_end, check_settings

__all__ = ["LEAST", "only_turns", "relabelled", "spacious", "standing", "with_commands"]

LEAST = 64
"""Bodies for which there is room at least where they come and go."""


def relabelled(
    scene: Scene, *, settings: Settings | None = None, origin: Mapping[str, Any] | None = None
) -> Scene:
    """Return the same scene with other settings or another origin, without checking its bodies again.

    Raises SceneError for settings that the scene cannot have.
    """
    mistakes = []
    if settings is not None and not isinstance(settings, Settings):
        mistakes = [Mistake("settings", shown(settings), "kinetile.Settings(...), or None")]
    elif settings is not None:
        mistakes = [*check_frame(None, scene.start, settings.until), *check_settings(settings)]
        mistakes += check_end(settings, Clock(scene.start, scene.time_unit))
    if mistakes:
        raise SceneError(mistakes)
    copy = object.__new__(Scene)
    copy.__dict__.update(scene.__dict__)
    if settings is not None:
        copy.__dict__["settings"] = settings
    if origin is not None:
        copy.__dict__["origin"] = dict(origin)
    return copy


def standing(scene: Scene, columns: Mapping[str, npt.NDArray[Any]], capacity: int) -> Scene:
    """Return the same scene with other bodies, and no commands: as it stands in the middle of a run.

    ``columns`` are position, velocity, radius, mass and kind of the bodies; ``capacity`` is for how many at
    once a phase is to make room. Nothing is checked: a run has led here.
    """
    copy = relabelled(scene)
    for name, column in columns.items():
        column.flags.writeable = False
        copy.__dict__[name] = column
    copy.__dict__["commands"] = ()
    copy.__dict__["_capacity"] = capacity
    copy.__dict__["_ruled"] = scene.ruled
    return copy


def spacious(scene: Scene, capacity: int | None = None) -> Scene:
    """Return the same scene, in which phases make room for so many bodies, or for as many more as there
    are."""
    copy = relabelled(scene)
    copy.__dict__["_capacity"] = max(2 * len(scene), LEAST) if capacity is None else capacity
    return copy


def only_turns(scene: Scene, who: str) -> None:
    """Raise Refused where a scene asks for more than elastic contacts and turns at times of their own, on the
    clock that its speeds ask for: ``who`` knows nothing else."""
    odd = [each for each in scene.commands if not isinstance(each, Turn) or each.at is not None]
    what = "a unit of its own" if scene.unit is not None else None
    what = "bodies that come or go, or commands at exact ticks" if odd else what
    what = "responses, or bodies that nothing can move" if scene.ruled else what
    if what is not None:
        raise Refused(f"{who} follows scenes whose bodies turn at most, and this scene has {what}")


def with_commands(
    scene: Scene,
    commands: Sequence[Command],
    responses: Mapping[Pair, Response] | None = None,
    kinds: Iterable[Kind] | None = None,
) -> Scene:
    """Return the same scene, on the same clock, with these commands, and with more responses. Its kinds are
    these, or as ``Scene.replace`` has them. Raises SceneError where they do not fit."""
    more = {} if kinds is None else {"kinds": kinds}
    rules = {**dict(scene.responses), **(responses or {})}
    unit, origin = scene.time_unit, scene.origin
    return scene.replace(commands=commands, responses=rules, unit=unit, origin=origin, **more)
