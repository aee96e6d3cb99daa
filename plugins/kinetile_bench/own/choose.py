"""Which broad phase for a scene: the candidates are tried on the scene itself, and the fastest is named.

First each runs for a few hundred contacts. Those that are not hopelessly slow then run for some thousands, in
turns, several times, as in ``bench.scene``; the median counts. That is a fraction of a second of CPU time a
phase, compiling apart, and it says something of the beginning of a run only: where a scene becomes another
one later, as when all that was spread out lies on one heap, measure it whole (``kinetile bench FILE.toml``).

Among phases that differ by less than the repeats of one do, the one that takes the least memory is named.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinetile.errors import KinetileError
from kinetile_bench.choices import Choice, phase_label, phases_with_options, simulation_of
from kinetile_bench.own.scene import SceneRow, bench_scene
from kinetile_bench.study.work.stages import arrays_of

__all__ = ["CLOSE", "CONTACTS", "REPEATS", "SECONDS", "Candidate", "Chosen", "choose"]

PILOT = 300
"""Contacts after which it is seen who is hopeless."""

HOPELESS = 0.25
"""Phases with less than this part of the fastest one's rate are not measured further."""

CONTACTS = 4000
"""Contacts of a measured run, at least: more, where they take less than SECONDS."""

SECONDS, REPEATS, MOST = 0.1, 5, 50_000
"""CPU seconds of a measured run of the fastest, about; how often each is run; contacts of a run, at most."""

CLOSE = 0.05
"""Rates that differ by less than this are taken for the same."""


@dataclass(frozen=True)
class Candidate:
    """What is known of one broad phase on the scene.

    Attributes:
        row: as it was measured; of the pilot alone where ``hopeless``.
        hopeless: it was not measured further, being slow from the beginning.
        memory: bytes of the arrays of scene, kernel and phase, the log apart; None: it refuses the scene.
    """

    row: SceneRow
    hopeless: bool
    memory: int | None

    @property
    def rate(self) -> float:
        """Contacts a CPU second; 0 where it cannot do the scene."""
        return self.row.contacts_per_cpu_second or 0.0


@dataclass(frozen=True)
class Chosen:
    """The recommendation.

    Attributes:
        phase: the broad phase to take, with its options as ``NAME:KEY=VALUE``; None: none can do the scene.
        reason: why, in a sentence.
        candidates: the fastest first.
        identical: whether all gave the same contacts.
        conditions: where and with what it was measured.
    """

    phase: str | None
    reason: str
    candidates: tuple[Candidate, ...]
    identical: bool
    conditions: Mapping[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types, fit for JSON."""
        rows = [
            vars(each.row) | {"hopeless": each.hopeless, "memory": each.memory} for each in self.candidates
        ]
        said = {"phase": self.phase, "reason": self.reason, "identical": self.identical}
        return said | {"conditions": dict(self.conditions), "candidates": rows}


def choose(
    scene: Any,
    phases: Sequence[Choice] | None = None,
    *,
    until: float | None = None,
    seconds: float = SECONDS,
    repeats: int = REPEATS,
    start: Callable[[str, Any], Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Chosen:
    """Try broad phases (all that are registered, if None) on a scene, and recommend one.

    No run goes beyond ``until``; None: the scene's own end, or, where it has neither that nor walls, when the
    fastest body could have crossed it twice: by then they have flown apart.

    ``seconds`` is the CPU time of a measured run of the fastest, about; ``repeats`` is how often each is run.

    ``start`` is called with a label and a simulation before a phase first runs, ``progress`` with the runs
    done and their total. Raises what ``Simulation`` raises, but for Refused, which is a row.
    """
    from kinetile.plugin.registry import registry

    named = registry().names("broad phase") if phases is None else phases
    choices = {phase_label(*choice): choice for choice in phases_with_options(named)}
    until = _end_of(scene) if until is None else until
    pilot = bench_scene(scene, [*choices.values()], until, max_contacts=PILOT, repeats=1, start=start)
    best = max((row.contacts_per_cpu_second or 0.0 for row in pilot.rows), default=0.0)
    good = [
        choices[row.phase]
        for row in pilot.rows
        if row.cpu_seconds is not None and (row.contacts_per_cpu_second or 0.0) >= HOPELESS * best
    ]
    contacts = min(max(int(best * seconds), CONTACTS), MOST)
    measured = bench_scene(scene, good, until, max_contacts=contacts, repeats=repeats, progress=progress)
    rows = {row.phase: row for row in measured.rows}
    candidates = sorted(
        (
            Candidate(rows.get(row.phase, row), row.phase not in rows, _memory(scene, choices[row.phase]))
            for row in pilot.rows
        ),
        key=lambda each: (each.hopeless, -each.rate, each.row.phase),
    )
    phase, reason = _recommendation(candidates)
    rated = tuple(_of_fastest(each, candidates[0].rate) for each in candidates)
    identical = pilot.identical and measured.identical
    return Chosen(phase, reason, rated, identical, dict(measured.conditions))


def _end_of(scene: Any) -> float | None:
    if not len(scene):
        return float(scene.start)
    if scene.settings.until is not None or scene.arena is not None:
        return None
    widest = float(np.ptp(scene.position, axis=0).max() + 2.0 * scene.radius.max())
    fastest = float(np.hypot(*scene.velocity.T).max())
    return float(scene.start + (2.0 * widest / fastest if fastest else 1.0))


def _of_fastest(candidate: Candidate, most: float) -> Candidate:
    ratio = candidate.rate / most if most and candidate.rate else None
    return replace(candidate, row=replace(candidate.row, of_fastest=ratio))


def _memory(scene: Any, choice: tuple[str, Mapping[str, Any]]) -> int | None:
    try:
        return sum(arrays_of(simulation_of(scene, (choice[0], choice[1]))).values())
    except KinetileError:
        return None


def _recommendation(candidates: Sequence[Candidate]) -> tuple[str | None, str]:
    """Return the phase to take, and why; the candidates come with the fastest first."""
    able = [each for each in candidates if each.memory is not None]
    if not able:
        return None, "no phase can do this scene; each says why"
    if not able[0].rate:
        return able[0].row.phase, "nothing collides here within reach: any phase that does the scene will do"
    fastest = able[0]
    alike = [each for each in able if not each.hopeless and each.rate >= (1.0 - CLOSE) * fastest.rate]
    taken = min(alike, key=lambda each: each.memory or 0)
    name = taken.row.phase
    if len(alike) > 1:
        others = ", ".join(each.row.phase for each in alike if each is not taken)
        return name, f"{name} and {others} differ by less than {CLOSE:.0%}; {name} takes the least memory"
    rest = [each for each in able if each is not taken and each.rate]
    if not rest:
        return name, f"{name} is the only one that can do this scene"
    times, behind = taken.rate / rest[0].rate, rest[0].row.phase
    return name, f"{name} has {times:.2g} times the contacts a CPU second of {behind}, which comes next"
