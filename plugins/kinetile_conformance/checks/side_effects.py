"""Observations of what a phase does to its process.

A phase is a guest in a user's program. What it prints breaks ``--json``, a seed that it sets makes a study
repeat itself, and what each simulation leaves behind ends a long one. What it reads, and a cache that is
full some day, are its own business (sentences 25 to 28 of the contract).
"""

from __future__ import annotations

import asyncio
import gc
import locale
import os
import random
import signal
import sys
import tempfile
import threading
import tracemalloc
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any

import numpy as np

from kinetile.errors import KinetileError
from kinetile.scene import Scene
from kinetile_conformance.cases import CONTACTS, Subject, horizon
from kinetile_conformance.checks.check import Case, Disagreement, observation
from kinetile_conformance.strategies.swarms import swarm

try:
    import resource
except ImportError:  # Windows has none
    resource = None  # type: ignore[assignment]

SIMULATIONS = 30
"""Simulations between two looks at the memory that is taken."""

LOOKS = 40
"""Looks within which memory must have ceased to grow: a cache may be full by then."""

GROWTH = 16 * 1024
"""Bytes a simulation by which memory may grow."""

MOST = 64 * 2**20
"""Bytes by which it may grow in all."""

FILES = 1_100
"""Files that the process has open while a phase runs, where the system lets it: ``select`` takes no number
above 1,023."""

ROOM = 64
"""Files that it may open beside them, where the system sets a limit."""

AT_FIRST = dict(os.environ)
"""The environment before a phase is loaded."""


def _open_files() -> list[str]:
    """Return what the open files of this process are, where the system can tell."""
    found = []
    for each in Path("/proc/self/fd").glob("*"):
        with suppress(OSError):  # the one that lists them is closed by now
            found.append(f"{each.name} {each.readlink()}")
    return sorted(found)


def _mapped_files() -> list[str]:
    """Return the files that are mapped into memory, but for libraries, where the system can tell."""
    maps = Path("/proc/self/maps")
    lines = maps.read_text(encoding="utf-8", errors="replace").splitlines() if maps.exists() else []
    return sorted(each.partition("/")[2] for each in lines if "/" in each and ".so" not in each)


PARTS: dict[str, Callable[[], Any]] = {
    "the random numbers of NumPy": lambda: repr(np.random.get_state()),
    "the random numbers of Python": random.getstate,
    "the environment": lambda: dict(os.environ),
    "the working folder": os.getcwd,
    "the locale": lambda: locale.setlocale(locale.LC_ALL),
    "how NumPy treats floating-point errors": np.geterr,
    "how NumPy prints": np.get_printoptions,
    "the filters of warnings": lambda: list(warnings.filters),
    "the handlers of signals": lambda: [signal.getsignal(each) for each in signal.valid_signals()],
    "the standard streams": lambda: (sys.stdin, sys.stdout, sys.stderr),
    "the limit of recursion": sys.getrecursionlimit,
    "the number of threads": threading.active_count,
    "whether garbage is collected": gc.isenabled,
    "the event loop": lambda: id(asyncio.get_running_loop()),
    "the open files": _open_files,
    "the files that are mapped into memory": _mapped_files,
}
"""What belongs to the process, and how it is read."""


@contextmanager
def _as_at_first() -> Iterator[None]:
    """Sets what a phase may have set already, so that it would show if it sets it again; the process has many
    open files."""
    environment, collects = dict(os.environ), gc.isenabled()
    limits = resource and resource.getrlimit(resource.RLIMIT_NOFILE)
    opened: list[int] = []
    try:
        os.environ.clear()
        os.environ.update(AT_FIRST)
        gc.enable()
        if resource and limits:
            resource.setrlimit(resource.RLIMIT_NOFILE, (limits[1], limits[1]))
        with suppress(OSError), tempfile.TemporaryFile() as file:
            opened.extend(os.dup(file.fileno()) for _ in range(FILES))
        for each in opened[-ROOM:]:
            os.close(each)
        del opened[-ROOM:]
        with np.errstate(divide="warn", over="warn", under="ignore", invalid="warn"):
            yield
    finally:
        for each in opened:
            os.close(each)
        if resource and limits:
            resource.setrlimit(resource.RLIMIT_NOFILE, limits)
        os.environ.clear()
        os.environ.update(environment)
        (gc.enable if collects else gc.disable)()


@contextmanager
def _written() -> Iterator[Callable[[], str]]:
    """Keeps what is written to the standard output and error within this context, by Python or beside it;
    yields a function that returns it."""
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as file:
        kept = {stream: os.dup(stream) for stream in (1, 2)}
        sys.stdout.flush()
        sys.stderr.flush()

        def text() -> str:
            file.flush()
            file.seek(0)
            return file.read()

        for stream in kept:
            os.dup2(file.fileno(), stream)
        try:
            with redirect_stdout(file), redirect_stderr(file):
                yield text
        finally:
            for stream, old in kept.items():
                os.dup2(old, stream)
                os.close(old)


def _run(subject: Subject, scene: Scene) -> None:
    sim = subject.simulation(scene)
    try:
        sim.run(until=horizon(scene), max_contacts=CONTACTS)
        sim.drawing()
    except KinetileError:
        pass  # whether a run may end so, other checks compare


@observation(compares=False)
def leaves_the_process_alone(case: Case) -> None:
    """It prints nothing, and changes nothing that belongs to the process: random numbers, environment,
    locale, warnings, signals, open files. It runs where an event loop does"""
    shown = swarm("gas", 12)
    case.subject.simulation(shown).compile()  # a compiler may warn
    random.random(), np.random.random()  # a seed that has been set already would change nothing

    async def run() -> str:
        before = {what: read() for what, read in PARTS.items()}
        with _written() as written:
            _run(case.subject, shown)
            said = written()
        changed = [what for what, read in PARTS.items() if read() != before[what]]
        if said:
            return f"it writes to the standard output or error: {said.splitlines()[0][:100]!r}"
        return f"a run changes {changed[0]}" if changed else ""

    with _as_at_first():
        said = asyncio.run(run())
    if said:
        raise Disagreement(said)


@observation(compares=False)
def memory_does_not_grow(case: Case) -> None:
    """What a simulation took is free when it is gone, and a cache has an end"""
    shown = swarm("gas", 12)

    def simulate() -> int:
        for _ in range(SIMULATIONS):
            case.subject.simulation(shown).build()
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start(1)
    try:
        first = taken = simulate()
        for _ in range(LOOKS):
            before, taken = taken, simulate()
            grown = (taken - before) / SIMULATIONS
            if grown <= GROWTH:
                return
            if taken - first > MOST:
                break
    finally:
        tracemalloc.stop()
    mib = (taken - first) / 2**20
    raise Disagreement(f"each simulation leaves {grown / 1024:.0f} KiB behind, all together {mib:.0f} MiB")
