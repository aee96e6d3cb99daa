"""Settings of a run that a scene may have: its phases by name, their options, and its end."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from kinetile.errors import Mistake, constructed
from kinetile.kernel.clock import Clock
from kinetile.scene.checks import is_finite, name_alone, plain, shown
from kinetile.scene.values import VALUES


@constructed
@dataclass(frozen=True)
class Settings:
    """Settings of a run in a scene: its phases by name, their options, and its end.

    ``broad_phase`` and ``narrow_phases`` are None if the scene leaves the choice open; ``options`` maps a
    phase's name to its options; ``until`` is a time. ``end`` is the exact end, as (epoch, tick, contacts):
    the run ends after this number of contacts of that tick, as recordings do, and ``until`` is that time,
    rounded. None: the run ends after all events up to and at ``until``.
    """

    broad_phase: str | None = None
    narrow_phases: tuple[str, ...] | None = None
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    until: float | None = None
    end: tuple[int, int, int] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.end, list):
            object.__setattr__(self, "end", tuple(self.end))
        if isinstance(self.narrow_phases, list):
            object.__setattr__(self, "narrow_phases", tuple(self.narrow_phases))
        if self.until is not None and is_finite(self.until):
            object.__setattr__(self, "until", float(self.until))
        object.__setattr__(self, "options", plain(self.options))

    def __hash__(self) -> int:
        return hash((self.broad_phase, self.narrow_phases, self.until, self.end))


def check_settings(settings: Settings) -> list[Mistake]:
    """Checks the types of the settings; the existence of phases is checked when they are selected."""
    mistakes = []
    for where in ("broad-phase", "narrow-phases", "options"):
        given = getattr(settings, where.replace("-", "_"))
        open_choice = given is None and where != "options"
        wrong = [] if open_choice else VALUES[where].mistakes(given, where)
        names = () if wrong or where == "options" else (given,) if isinstance(given, str) else given or ()
        odd = [each for each in names if ":" in each]
        mistakes += wrong + [Mistake(where, shown(each), name_alone(each, "options")) for each in odd]
    return mistakes


def check_end(settings: Settings, clock: Clock) -> list[Mistake]:
    """Checks the exact end of a scene with this clock: it has to equal ``until``, up to its rounding."""
    if settings.end is None:
        return []
    wrong = VALUES["end"].mistakes(settings.end, "end")
    if wrong:
        return wrong
    ticks = clock.tick_of(0.0, settings.end)
    time = clock.time(ticks)
    near = (math.nextafter(time, -math.inf), time, math.nextafter(time, math.inf))
    if settings.until is not None and (settings.until in near or clock.ticks(settings.until) == ticks):
        return []
    return [Mistake("end", f"{settings.end}, which is at {time!r}", f"an end at until = {settings.until!r}")]
