"""Hardware counters: instructions, mispredicted branches and cache misses a contact, by broad phase.

Times depend on the other processes of a machine; these counts repeat to a few per cent, so they show what a
change of code costs. Linux's ``perf stat`` counts ``kinetile run``, in user mode, in two fresh processes that
differ in their number of contacts only. The difference of the counts, over that of the contacts, is free of
start-up, set-up and the first contacts, which are not typical. Loops are compiled before, into the cache.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from kinetile import Simulation, make_scene
from kinetile.errors import BadOption, KinetileError, PhaseError, Refused
from kinetile.plugin.choices import write_phase
from kinetile_accuracy.environment import environment
from kinetile_bench.benchmark import Choice, PhasesMeasured, phases_with_options
from kinetile_bench.growth import square_at_least
from kinetile_bench.runner import WARM_UP

EVENTS = {
    "instructions": "instructions",
    "branches": "branches",
    "mispredicted": "branch-misses",
    "first_cache_misses": "L1-dcache-load-misses",
    "last_cache_misses": "cache-misses",
}
"""What is counted, by its name for ``perf``: five events, because with more than a processor counts at once
they would take turns, and ``perf`` would extrapolate."""

_PARANOID = Path("/proc/sys/kernel/perf_event_paranoid")
_SEED = 1


class NoCounters(KinetileError, RuntimeError):
    """Hardware counters cannot be read here; the message says what is missing, and what to do about it."""


@dataclass(frozen=True)
class CountersRow:
    """One phase on one scene.

    Attributes:
        bodies, density: the scene.
        phase: the broad phase, with its options.
        refused: why the phase cannot run it; then there are no counts.
        counts: of each of ``EVENTS``, a contact; None where the processor does not have that counter.
        counted: least share of the time that a counter was in use; below 1 its count is extrapolated.
        fingerprint: of all contacts of the longer run.
    """

    bodies: int
    density: float
    phase: str
    refused: str | None = None
    counts: Mapping[str, float | None] = field(default_factory=dict)
    counted: float | None = None
    fingerprint: str | None = None


@dataclass(frozen=True)
class CountersBench(PhasesMeasured):
    """All rows, and where and with what they were measured."""

    rows: tuple[CountersRow, ...]
    conditions: Mapping[str, Any]

    @property
    def identical(self) -> bool:
        """Whether on each scene all phases that ran gave the same contacts."""
        ran = [row for row in self.rows if row.fingerprint is not None]
        scenes = {(row.bodies, row.density) for row in ran}
        return len({(row.bodies, row.density, row.fingerprint) for row in ran}) == len(scenes)


def bench_counters(
    phases: Sequence[Choice],
    bodies: Sequence[int],
    densities: Sequence[float],
    contacts: int = 1_000_000,
    *,
    start: Callable[[Any], Any] = Simulation.compile,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[CountersBench]:
    """Counts each phase on scenes of the recipe ``grid``; yields what there is after each row.

    ``bodies`` are raised to the next square numbers. ``contacts`` are counted, after ``WARM_UP`` a disc.
    ``start`` compiles a simulation, ``progress`` is called with the runs done and their total. A phase must
    be one that another process finds.

    Raises NoCounters where there are none, BadOption for less than one contact, PhaseError where a run fails,
    and what ``Simulation`` and ``make_scene`` raise, but for Refused, which is a row.
    """
    if contacts < 1:
        raise BadOption(f"there are {contacts} contacts to count; expected at least 1")
    check_counters()
    sizes, chosen = [square_at_least(n) for n in bodies], phases_with_options(phases)
    plan = [(density, n, each) for density in densities for n in sizes for each in chosen]
    where = environment() | {"contacts": contacts, "contacts_before": WARM_UP, "seed": _SEED}
    rows: list[CountersRow] = []
    for density, n, (name, options) in plan:
        label = write_phase(name, options)
        scene = make_scene("grid", bodies=n, density=density, seed=_SEED)
        before = WARM_UP * n // 2  # a contact of two discs is one for each
        try:
            start(Simulation(scene, name, options=options))
            short = _run_grid(label, n, density, before)
            long = _run_grid(label, n, density, before + contacts)
            both = short.counts.keys() & long.counts.keys()
            counts = {
                name: (long.counts[name] - short.counts[name]) / contacts if name in both else None
                for name in EVENTS
            }
            counted = min(short.counted, long.counted)
            fingerprint = json.loads(long.done.stdout)["readings"]["fingerprint"]
            rows.append(CountersRow(n, density, label, None, counts, counted, fingerprint))
        except Refused as refused:
            rows.append(CountersRow(n, density, label, str(refused)))
        if progress is not None:
            progress(len(rows), len(plan))
        yield CountersBench(tuple(rows), where)


def check_counters() -> None:
    """Raises NoCounters unless ``perf`` is installed, may count, and finds hardware counters."""
    if shutil.which("perf") is None:
        raise NoCounters(
            "hardware counters are read by Linux's perf, which is not installed; install it with: "
            "apt install linux-perf (Debian), linux-tools-generic (Ubuntu), or dnf install perf (Fedora)"
        )
    run = _run([sys.executable, "-c", ""])
    if "instructions" in run.counts:
        return
    if "<not supported>" in run.written:
        reason = (
            "the processor, or the virtual machine that this system runs in, does not offer them; "
            "measure on another machine, or let the host of this one pass them on"
        )
    elif "<not counted>" in run.written:
        reason = "another program holds them, such as the watchdog, `sudo sysctl kernel.nmi_watchdog=0`"
    else:
        level = _PARANOID.read_text().strip() if _PARANOID.exists() else "unknown"
        reason = (
            f"perf gives no counts (exit code {run.done.returncode}); kernel.perf_event_paranoid is {level}, "
            "expected at most 2, `sudo sysctl kernel.perf_event_paranoid=2`; in a container perf_event_open "
            "must be allowed as well"
        )
    raise NoCounters(f"hardware counters cannot be read here: {reason}")


def _run_grid(phase: str, n: int, density: float, contacts: int) -> _Run:
    """Runs a scene in a fresh process, and counts. Raises PhaseError where that process fails."""
    scene = ["-s", f"bodies={n}", "-s", f"density={density!r}", "-s", f"seed={_SEED}"]
    command = [sys.executable, "-m", "kinetile", "run", "grid", *scene, "--broad-phase", phase]
    run = _run([*command, "--max-contacts", str(contacts), "--json"])
    if run.done.returncode != 0:
        reason = run.done.stderr.strip().splitlines()[-1:] or [f"exit code {run.done.returncode}"]
        raise PhaseError(f"{phase}: the counted process failed: {reason[0]}")
    return run


class _Run(NamedTuple):
    """A command that ran under ``perf``, what perf wrote, and the counts therein with their least share of
    the time. An event that was not counted has no entry."""

    done: subprocess.CompletedProcess[str]
    written: str
    counts: Mapping[str, int]
    counted: float


def _run(command: Sequence[str]) -> _Run:
    """Runs a command under ``perf stat``, in user mode."""
    events = ",".join(f"{event}:u" for event in EVENTS.values())
    # Numbers in C's form; and one order of sets, so that equal start-ups do equal work.
    settings = os.environ | {"LC_ALL": "C", "PYTHONHASHSEED": "0"}
    with TemporaryDirectory() as folder:
        file = Path(folder, "counts")
        counting = ["perf", "stat", "-x", ",", "-o", str(file), "-e", events, "--", *command]
        done = subprocess.run(counting, env=settings, capture_output=True, text=True, check=False)
        written = file.read_text() if file.exists() else ""
    return _Run(done, written, *_read_counts(written))


def _read_counts(written: str) -> tuple[dict[str, int], float]:
    """Returns counts, and their least share of time, from perf's lines ``value,unit,event,time,share,...``.

    A processor with two kinds of cores has a line for each: ``cpu_core/branches/u``, ``cpu_atom/branches/u``.
    """
    counts: Counter[str] = Counter()
    shares = [100.0]
    for line in written.splitlines():
        value, _, event, _, share, *_ = f"{line},,,,".split(",")
        for name, called in EVENTS.items():
            if value.isdigit() and called in re.split("[/:]", event):  # else <not supported>, <not counted>
                counts[name] += int(value)
                shares.append(float(share))
    return dict(counts), min(shares) / 100.0
