"""Settings of a run that a scene may have: its phases by name, their options, and its end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from kinetile.errors import Mistake
from kinetile.kernel.clock import Clock
from kinetile.scene.checks import is_finite, name_alone, plain, shown
from kinetile.scene.commands import EXACT, is_exact


@dataclass(frozen=True)
class Settings:
    """Settings of a run in a scene: its phases by name, their options, and its end.

    ``broad_phase`` and ``narrow_phases`` are None where the scene leaves the choice open; ``options`` maps a
    phase's name to its options; ``until`` is a time, not a length of time. ``end`` is the same exactly, as
    (epoch, tick, contacts): the run ends after this number of contacts of that tick, as recordings do, and
    ``until`` is that time rounded. None: after all events up to and at ``until``.
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
    if not isinstance(settings.broad_phase, (str, type(None))):
        mistakes.append(Mistake("broad-phase", shown(settings.broad_phase), "the name of a broad phase"))
    narrow = settings.narrow_phases
    named = {"broad-phase": (settings.broad_phase,), "narrow-phases": narrow}
    for where, names in named.items():
        for each in names if isinstance(names, tuple) else ():
            if isinstance(each, str) and ":" in each:
                mistakes.append(Mistake(where, shown(each), name_alone(each, "options")))
    if narrow is not None and not (
        isinstance(narrow, tuple) and all(isinstance(name, str) for name in narrow)
    ):
        mistakes.append(Mistake("narrow-phases", shown(narrow), "a list of names of narrow phases"))
    options = settings.options
    if not isinstance(options, Mapping) or not all(isinstance(table, Mapping) for table in options.values()):
        mistakes.append(
            Mistake(
                "options",
                shown(options),
                "a table of options for each phase's name, such as {'sap-1d': {'axis': 'y'}}",
            )
        )
    return mistakes


def check_end(settings: Settings, clock: Clock) -> list[Mistake]:
    """Checks the exact end of a scene with this clock: it has to equal ``until``, up to its rounding."""
    if settings.end is None:
        return []
    if not is_exact(settings.end):
        return [Mistake("end", shown(settings.end), EXACT)]
    ticks = clock.tick_of(0.0, settings.end)
    time = clock.time(ticks)
    near = (math.nextafter(time, -math.inf), time, math.nextafter(time, math.inf))
    if settings.until is not None and (settings.until in near or clock.ticks(settings.until) == ticks):
        return []
    return [Mistake("end", f"{settings.end}, which is at {time!r}", f"an end at until = {settings.until!r}")]
