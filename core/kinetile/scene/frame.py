"""Checks of the surroundings of a scene's bodies: arena, periods, gravity, start and end of its clock."""

from typing import Any

from kinetile.errors import Mistake
from kinetile.scene.checks import FARTHEST_START, is_finite, shown
from kinetile.scene.values import VALUES


def check_frame(arena: object, start: Any, until: Any) -> list[Mistake]:
    """Checks the arena (None, or width and height), the start and the end."""
    mistakes = [] if arena is None else VALUES["arena"].mistakes(arena, "arena")
    mistakes += VALUES["start"].mistakes(start, "start") or check_pace(start, 1.0)
    if until is not None:
        mistakes += VALUES["until"].mistakes(until, "until") or check_time(until, "until", start)
    return mistakes


def check_time(time: float, where: str, start: Any) -> list[Mistake]:
    """Checks a time against the start, if that is known and valid."""
    if not is_finite(start) or time >= start:
        return []
    return [Mistake(where, shown(time), f"a time not before the start, {shown(start)}")]


def check_periodic(periodic: object, arena: bool) -> list[Mistake]:
    """Checks the names of the periodic axes, in a scene with or without an arena."""
    wrong = VALUES["periodic"].mistakes(periodic, "periodic")
    if not wrong and periodic and not arena:
        wrong = [Mistake("periodic", shown(periodic), "an arena: its sides are the periods")]
    return wrong


def check_pull(where: str, given: Any, periodic: str) -> list[Mistake]:
    """Checks that an acceleration is along no periodic axis."""
    pulls = dict(zip("xy", map(float, given), strict=True))
    along = [axis for axis, pull in pulls.items() if pull and axis in periodic]
    wanted = f"none along {' and '.join(along)}, which is periodic: nothing stops a fall there"
    return [Mistake(where, shown(list(given)), wanted)] if along else []


def check_pace(start: float, unit: float) -> list[Mistake]:
    """Checks a scene's start against its time unit, which is less than 1 if bodies are fast."""
    if abs(start) <= FARTHEST_START * unit:
        return []
    least = f"a start at most {FARTHEST_START * unit:.6g} from 0"
    right = f"{least}, beyond which a time unit, {unit:.3g}, is lost in rounding"
    return [Mistake("start", shown(start), right)]
