"""One's own scene as a benchmark: the broad phases on a scene file, a program's recording among them.

What counts is the CPU time of the whole run as a program would call it, from the scene's start to its end:
the loop, what is done between its chunks, and tables that are laid out anew where a body comes. Compiling and
the structure at the start are outside. The repeats of the phases take turns, so that a machine that slows
down slows all of them; the median counts.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kinetile.errors import AuditError, MissedContactError, PhaseError, Refused, ZenoError
from kinetile_accuracy.environment import environment
from kinetile_bench.choices import Choice, phase_label, phases_with_options
from kinetile_bench.display import Displayed

__all__ = ["SceneBench", "SceneRow", "bench_scene"]

MOST_RUNS = 1000
"""Runs of one repeat, at most."""

_ENDS = (Refused, ZenoError, MissedContactError, PhaseError, AuditError)


@dataclass(frozen=True)
class SceneRow:
    """One phase on the scene.

    Attributes:
        phase: the broad phase, with its options.
        ended_by: the error that ended its run, or that refused the scene; None: it came to its end.
        cpu_seconds: of the run, median of the repeats; None where the phase refused the scene.
        slowest, fastest: of the repeats.
        contacts_per_cpu_second: contacts over the median.
        of_fastest: its rate, over that of the fastest phase.
        structural_per_contact: structural events for each contact.
        contacts, commands: how many there were.
        fingerprint: of the contacts.
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


@dataclass(frozen=True)
class SceneBench(Displayed):
    """All rows, and where and with what they were measured."""

    rows: tuple[SceneRow, ...]
    conditions: Mapping[str, Any]

    @property
    def identical(self) -> bool:
        """Whether all phases that ran gave the same contacts."""
        return len({row.fingerprint for row in self.rows if row.fingerprint is not None}) <= 1

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types, fit for JSON."""
        rows = [vars(row) for row in self.rows]
        return {"conditions": dict(self.conditions), "identical": self.identical, "rows": rows}


def bench_scene(
    scene: Any,
    phases: Sequence[Choice] | None = None,
    until: float | None = None,
    *,
    max_contacts: int | None = None,
    narrow_phases: Mapping[str, Mapping[str, Any]] | None = None,
    repeats: int = 3,
    seconds: float = 0.0,
    start: Callable[[str, Any], Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> SceneBench:
    """Measure broad phases (all that are registered, if None) on a scene, up to a time or for so many
    contacts, as ``Simulation.run`` has them. A run is done again until it has taken so many CPU ``seconds``,
    and the median of those runs is one of so many ``repeats``.

    ``start`` is called with a label and a simulation before a phase first runs, ``progress`` with the runs
    done and their total. Raises what ``Simulation`` raises, but for Refused, which is a row.
    """
    from kinetile.plugin.registry import registry
    from kinetile.run.simulation import Simulation

    chosen = phases_with_options(registry().names("broad phase") if phases is None else phases)
    runs: list[list[tuple[float, Any]]] = [[] for _ in chosen]
    ended: list[str | None] = [None for _ in chosen]
    for repeat in range(repeats):
        for k, (name, options) in enumerate(chosen):
            try:
                spent: list[float] = []
                refuses = ended[k] is not None and not runs[k]  # and is asked once
                while not refuses and (not spent or (sum(spent) < seconds and len(spent) < MOST_RUNS)):
                    sim = Simulation(
                        scene, name, options=options, narrow_phases=narrow_phases, keep_contacts=False
                    )
                    if start is not None and repeat == 0 and not spent:
                        start(phase_label(name, options), sim)
                    sim.build()
                    taken, ended[k] = _timed(sim, until, max_contacts)
                    spent.append(taken)
                if spent:
                    runs[k].append((statistics.median(spent), sim.readings.as_dict()))
            except Refused as refused:
                ended[k] = str(refused)
            if progress is not None:
                progress(repeat * len(chosen) + k + 1, repeats * len(chosen))
    rows = [_row(phase_label(*choice), runs[k], ended[k]) for k, choice in enumerate(chosen)]
    most = max((row.contacts_per_cpu_second or 0.0 for row in rows), default=0.0)
    conditions = environment() | {"repeats": repeats, "seconds": seconds}
    conditions |= {"until": until, "max_contacts": max_contacts}
    return SceneBench(tuple(_beside(row, most) for row in rows), conditions)


def _timed(sim: Any, until: float | None, max_contacts: int | None) -> tuple[float, str | None]:
    """Return the CPU seconds of a run, and the error that ended it."""
    error: str | None = None
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
    contacts = found["contacts_disc"] + found["contacts_wall"]
    return SceneRow(
        phase=phase,
        ended_by=ended_by,
        cpu_seconds=median,
        slowest=max(seconds),
        fastest=min(seconds),
        contacts_per_cpu_second=contacts / median if median > 0.0 else None,
        structural_per_contact=found["structural_events"] / contacts if contacts else None,
        contacts=contacts,
        commands=found["turns"] + found["inserted"] + found["removed"],
        fingerprint=found["fingerprint"],
    )


def _beside(row: SceneRow, most: float) -> SceneRow:
    """Return a row with its rate over that of the fastest."""
    rate = row.contacts_per_cpu_second
    return row if rate is None or most == 0.0 else SceneRow(**(vars(row) | {"of_fastest": rate / most}))
