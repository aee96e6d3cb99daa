"""Observations of side effects of a phase: in its process, and in the kernel's tables. Reads and writes of
hooks are watched on fixed scenes, interpreted (``watched_hooks``): a breach, named with hook, field and line,
often has no effect on any contact there."""

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
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from kinetile import Scene
from kinetile.errors import KinetileError, Refused
from kinetile.instruments import as_python, compiled_by_default
from kinetile_conformance.cases import CONTACTS, Subject, horizon
from kinetile_conformance.checks.check import Case, Disagreement, observation
from kinetile_conformance.strategies.gallery import small_ones
from kinetile_conformance.strategies.swarms import swarm
from kinetile_conformance.watched_hooks import watch_hooks

try:
    import resource
except ImportError:  # Windows has none
    resource = None  # type: ignore[assignment]

SIMULATIONS = 30
"""Simulations between two measurements of the used memory."""

LOOKS = 40
"""The most measurements until memory must stop growing: a cache may be full by then."""

GROWTH = 16 * 1024
"""The allowed growth of memory, in bytes a simulation."""

MOST = 64 * 2**20
"""The allowed growth in all, in bytes."""

FILES = 1_100
"""Files that the process has open while a phase runs: ``select`` takes no number above 1,023."""

ROOM = 64
"""Files that it may open beside them, if the system sets a limit."""

AT_FIRST = dict(os.environ)
"""The environment before a phase is loaded."""


def _open_files() -> list[str]:
    found = []
    for each in Path("/proc/self/fd").glob("*"):
        with suppress(OSError):  # the one that lists them is closed by now
            found.append(f"{each.name} {each.readlink()}")
    return sorted(found)


def _mapped_files() -> list[str]:
    """Returns the files mapped into memory, except libraries; none if the system does not list them."""
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
"""Properties of the process, and the functions that read them."""


@contextmanager
def _as_at_first() -> Iterator[None]:
    """Changes settings that a phase may have set already, to see them set again; opens many files."""
    with ExitStack() as after, patch.dict(os.environ, AT_FIRST, clear=True):
        after.callback(gc.enable if gc.isenabled() else gc.disable)
        gc.enable()
        if resource:
            limits = resource.getrlimit(resource.RLIMIT_NOFILE)
            after.callback(resource.setrlimit, resource.RLIMIT_NOFILE, limits)
            resource.setrlimit(resource.RLIMIT_NOFILE, (limits[1], limits[1]))
        opened: list[int] = []
        with suppress(OSError), tempfile.TemporaryFile() as file:
            opened.extend(os.dup(file.fileno()) for _ in range(FILES))
        for at, each in enumerate(reversed(opened)):
            os.close(each) if at < ROOM else after.callback(os.close, each)
        with np.errstate(divide="warn", over="warn", under="ignore", invalid="warn"):
            yield


@contextmanager
def _written() -> Iterator[Callable[[], str]]:
    """Keeps the standard output and error; yields a function that returns the text."""
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as file, ExitStack() as after:

        def text() -> str:
            file.flush()
            file.seek(0)
            return file.read()

        sys.stdout.flush()
        sys.stderr.flush()
        for stream in (1, 2):
            kept = os.dup(stream)
            after.callback(os.close, kept)
            after.callback(os.dup2, kept, stream)
            os.dup2(file.fileno(), stream)
        with redirect_stdout(file), redirect_stderr(file):
            yield text


@observation(compares=False)
def leaves_the_process_alone(case: Case) -> None:
    """It prints nothing, and changes nothing that belongs to the process: random numbers, environment,
    locale, warnings, signals, open files. It runs where an event loop does"""
    scenes = [swarm("gas", number) for number in ((12,) if as_python() else (12, 200))]
    for shown in scenes:
        case.subject.simulation(shown).compile()  # a compiler may warn
    random.random(), np.random.random()  # a seed that has been set already would change nothing

    async def run() -> str:
        before = {what: read() for what, read in PARTS.items()}
        with _written() as written:
            for shown in scenes:
                sim = case.subject.simulation(shown)
                with suppress(KinetileError):  # other checks judge the end of a run
                    sim.run(until=horizon(shown), max_contacts=CONTACTS)
                    sim.audit()
                    sim.drawing()
                    case.subject.simulation(shown).restore(sim.snapshot())
            if text := written():
                return f"it writes to the standard output or error: {text.splitlines()[0][:100]!r}"
        return next((f"a run changes {what}" for what, read in PARTS.items() if read() != before[what]), "")

    with _as_at_first():
        text = asyncio.run(run())
    if text:
        raise Disagreement(text)


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


def interpreted(look: Callable[..., str | None], subject: Subject, scenes: Sequence[Any]) -> None:
    """Raises Disagreement for the breaches of a phase whose hooks run as Python, on some scenes."""
    with compiled_by_default(False):
        text = look(subject, scenes)
    if text is not None:
        raise Disagreement(text)


def first_breach(subject: Subject, scenes: Sequence[tuple[str, Scene]]) -> str | None:
    """Returns the first breach of a phase, interpreted with all hooks watched, and the title of its scene, or
    None. Skips scenes that the phase refuses; raises Refused if it refuses all."""
    refused = []
    for title, scene in scenes:
        try:
            text = watch_hooks(subject, scene)
        except Refused as refusal:
            refused.append(refusal)
            continue
        if text is not None:
            return f"{text}, on {title}"
    if len(refused) == len(scenes):
        raise refused[0]
    return None


@observation(compares=False)
def writes_only_where_it_may(case: Case) -> None:
    """Interpreted, its hooks change nothing that is not theirs, use no index outside of an array, and raise
    nothing"""
    interpreted(first_breach, case.subject, small_ones())
