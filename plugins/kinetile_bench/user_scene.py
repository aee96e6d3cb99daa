"""Benchmarks of a user's scene: every broad phase on it (``bench_scene``), and a choice (``choose``).

The measured value is the CPU time of the whole run from the scene's start to its end: the loop, the work
between its chunks, and the growth of tables at an insertion, without compilation and the first structure.
``choose`` first runs each phase for a few hundred contacts, and the faster ones for some thousands. It
recommends the fastest, with the phases that differ from it by less than 5 %. It recommends no phase after one
repeat, unless it is the only one, and no phase if contacts differ.
"""

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from kinetile import Simulation
from kinetile.errors import AuditError, MissedContactError, PhaseError, Refused, ZenoError
from kinetile.instruments import write_phase
from kinetile_accuracy.environment import environment
from kinetile_bench.benchmark import Choice, PhasesMeasured, phases_with_options

MOST_RUNS = 1000
"""Runs of one repeat, at most."""

_ENDS = (Refused, ZenoError, MissedContactError, PhaseError, AuditError)


@dataclass(frozen=True)
class SceneRow:
    """One phase on the scene.

    Attributes:
        ended_by: the error that ended its run, or that refused the scene; None: it reached its end.
        cpu_seconds: of the run, median of the repeats; None if the phase refused the scene.
        slowest, fastest: of the repeats.
        contacts_per_cpu_second, of_fastest: contacts over the median, and its ratio to the fastest phase's.
        asked_per_contact, computed_per_contact: candidate checks, and exact contact times, for each contact.
        structure_bytes: the phase's state and its pair set at the end.
    """

    phase: str
    ended_by: str | None = None
    cpu_seconds: float | None = None
    slowest: float | None = None
    fastest: float | None = None
    contacts_per_cpu_second: float | None = None
    of_fastest: float | None = None
    structural_per_contact: float | None = None
    contacts: int | None = None
    commands: int | None = None
    fingerprint: str | None = None
    asked_per_contact: float | None = None
    computed_per_contact: float | None = None
    structure_bytes: int | None = None

    @property
    def scene(self) -> None:
        """The scene: one for all rows."""

    @property
    def rate(self) -> float:
        """Contacts a CPU second; 0 if it does not accept the scene."""
        return self.contacts_per_cpu_second or 0.0


Row = TypeVar("Row", bound=SceneRow)


class SceneBench(PhasesMeasured):
    """The result: a ``SceneRow`` for each phase."""


def bench_scene(
    scene: Any,
    phases: Sequence[Choice] | None = None,
    until: float | None = None,
    *,
    max_contacts: int | None = None,
    narrow_phases: Mapping[str, Mapping[str, Any]] | None = None,
    repeats: int = 3,
    seconds: float = 0.0,
    start: Callable[[Any], Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> SceneBench:
    """Measures broad phases (None: all registered) on a scene, up to a time or a number of contacts, as in
    ``Simulation.run``. Each of the ``repeats`` is the median of runs that take ``seconds`` of CPU time
    together. Calls ``start`` with a simulation before a phase first runs, ``progress`` with the finished runs
    and their total. Raises the errors of ``Simulation``, but Refused becomes a row."""
    chosen = phases_with_options(phases)
    runs: list[list[tuple[float, Any]]] = [[] for _ in chosen]
    ended: list[str | None] = [None for _ in chosen]
    how: Any = {"narrow_phases": narrow_phases, "keep_contacts": False}
    for repeat in range(repeats):
        for k, (name, options) in enumerate(chosen):
            try:
                spent: list[float] = []
                refuses = ended[k] is not None and not runs[k]  # such a phase does not run again
                while not refuses and (not spent or (sum(spent) < seconds and len(spent) < MOST_RUNS)):
                    sim = Simulation(scene, name, options=options, **how)
                    if start is not None and repeat == 0 and not spent:
                        start(sim)
                    sim.build()
                    taken, ended[k] = _timed(sim, until, max_contacts)
                    spent.append(taken)
                if spent:
                    held = (*sim.state, sim.tables.pairs, sim.tables.lookup, sim.tables.firsts)
                    size = {"structure_bytes": sum(each.nbytes for each in held)}
                    runs[k].append((statistics.median(spent), sim.readings.as_dict() | size))
            except Refused as refused:
                ended[k] = str(refused)
            if progress is not None:
                progress(repeat * len(chosen) + k + 1, repeats * len(chosen))
    rows = [_row(write_phase(*choice), runs[k], ended[k]) for k, choice in enumerate(chosen)]
    conditions = environment() | {"repeats": repeats, "seconds": seconds}
    conditions |= {"until": until, "max_contacts": max_contacts}
    return SceneBench(_rated(rows), conditions)


def _timed(sim: Any, until: float | None, max_contacts: int | None) -> tuple[float, str | None]:
    error = None
    began = time.thread_time()
    try:
        sim.run(until, max_contacts=max_contacts)
    except _ENDS as fault:
        error = f"{type(fault).__name__}: {fault}"
    return time.thread_time() - began, error


def _row(phase: str, runs: Sequence[tuple[float, dict[str, Any]]], ended_by: str | None) -> SceneRow:
    if not runs:
        return SceneRow(phase, ended_by)
    seconds = [spent for spent, _ in runs]
    found, median = runs[0][1], statistics.median(seconds)
    contacts = found["contacts"]

    def per_contact(count: str) -> float | None:
        return found[count] / contacts if contacts else None

    return SceneRow(
        phase=phase,
        ended_by=ended_by,
        cpu_seconds=median,
        slowest=max(seconds),
        fastest=min(seconds),
        contacts_per_cpu_second=contacts / median if median > 0.0 else None,
        structural_per_contact=per_contact("structural_events"),
        asked_per_contact=per_contact("partners_asked"),
        computed_per_contact=per_contact("contacts_computed"),
        commands=found["turns"] + found["inserted"] + found["removed"],
        **{name: found[name] for name in ("contacts", "fingerprint", "structure_bytes")},
    )


def _rated(rows: Sequence[Row]) -> tuple[Row, ...]:
    most = max((row.rate for row in rows), default=0.0)
    return tuple(
        replace(row, of_fastest=row.rate / most) if most and row.contacts_per_cpu_second is not None else row
        for row in rows
    )


PILOT = 300
"""Contacts of the first, short run of each phase."""

HOPELESS = 0.25
"""The share of the fastest rate below which a phase is not measured further."""

CONTACTS = 4000
"""The least number of contacts of a measured run: more, if they take less than SECONDS."""

SECONDS, REPEATS, MOST = 0.1, 5, 50_000
"""Approximate CPU seconds of a measured run of the fastest; runs of each; the most contacts of a run."""

CLOSE = 0.05
"""The relative difference below which two rates count as the same."""


@dataclass(frozen=True)
class Candidate(SceneRow):
    """One measured broad phase on the scene; only by the pilot if it is ``hopeless``: too slow."""

    hopeless: bool = False


@dataclass(frozen=True)
class Chosen:
    """The recommendation: the broad phase to take, as ``NAME:KEY=VALUE``, or None if no phase can do the
    scene or the right one is unknown; the candidates, fastest first; True if all gave the same contacts."""

    phase: str | None
    reason: str
    candidates: tuple[Candidate, ...]
    identical: bool
    conditions: Mapping[str, Any]

    @property
    def rows(self) -> tuple[Candidate, ...]:
        """The candidates."""
        return self.candidates

    def as_dict(self) -> dict[str, Any]:
        """Returns all fields in plain types, fit for JSON."""
        return vars(self) | {"candidates": [vars(each) for each in self.candidates]}


def choose(
    scene: Any,
    phases: Sequence[Choice] | None = None,
    *,
    until: float | None = None,
    seconds: float = SECONDS,
    repeats: int = REPEATS,
    start: Callable[[Any], Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Chosen:
    """Tries broad phases (None: all registered) on a scene, and recommends one. No run goes beyond ``until``;
    None: the scene's own end, or, without an end and walls, the time of two crossings by the fastest body.
    ``seconds``: the CPU time of a measured run of the fastest, about; the rest is as in ``bench_scene``."""
    choices = {write_phase(*choice): choice for choice in phases_with_options(phases)}
    until = _end_of(scene) if until is None else until
    pilot = bench_scene(scene, [*choices.values()], until, max_contacts=PILOT, repeats=1, start=start)
    best = max((row.rate for row in pilot.rows), default=0.0)
    able = [row for row in pilot.rows if row.cpu_seconds is not None]
    good = [choices[row.phase] for row in able if row.rate >= HOPELESS * best]
    contacts = min(max(int(best * seconds), CONTACTS), MOST)
    measured = bench_scene(scene, good, until, max_contacts=contacts, repeats=repeats, progress=progress)
    new = {row.phase: row for row in measured.rows}
    found = [Candidate(**vars(new.get(row.phase, row)), hopeless=row.phase not in new) for row in pilot.rows]
    found.sort(key=lambda each: (each.hopeless, -each.rate, each.phase))
    identical = pilot.identical and measured.identical
    phase, reason = _recommendation(found, repeats, identical)
    return Chosen(phase, reason, _rated(found), identical, measured.conditions)


def _end_of(scene: Any) -> float | None:
    if not len(scene):
        return float(scene.start)
    if scene.settings.until is not None or scene.arena is not None:
        return None
    widest = float(np.ptp(scene.position, axis=0).max() + 2.0 * scene.radius.max())
    fastest = float(np.hypot(*scene.velocity.T).max())
    return float(scene.start + (2.0 * widest / fastest if fastest else 1.0))


def _recommendation(candidates: Sequence[Candidate], repeats: int, identical: bool) -> tuple[str | None, str]:
    able = [each for each in candidates if each.cpu_seconds is not None]
    if not able:
        return None, "no phase can do this scene; each says why"
    if not identical:
        return None, "no phase is recommended: one of them gives wrong contacts, and it is not known which"
    name, most = able[0].phase, able[0].rate
    if not most:
        return name, "nothing collides here within reach: any phase that does the scene will do"
    rest = [each for each in able[1:] if each.rate]
    if not rest:
        return name, f"{name} is the only one that can do this scene"
    if repeats == 1:
        why = f"{name} was the fastest, perhaps by chance"
        return None, f"no phase is recommended after one run of each: {why}"
    alike = ", ".join(each.phase for each in rest if not each.hopeless and each.rate >= (1.0 - CLOSE) * most)
    if alike:
        return name, f"{name} is the fastest, and {alike} within {CLOSE:.0%} of it"
    times, behind = most / rest[0].rate, rest[0].phase
    return name, f"{name} has {times:.2g} times the contacts a CPU second of {behind}, which comes next"
