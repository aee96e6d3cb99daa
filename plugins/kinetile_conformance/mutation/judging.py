"""The child that judges mutants: one after the other, each in a fork with limits.

The child has imported what all of them need, so a fork begins without delay; and whatever a mutant does to
its process, the next one begins afresh.
"""

from __future__ import annotations

import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import kinetile as kt
from kinetile.kernel.compiled.limits import end_after, limit_memory
from kinetile_conformance.cases import PhasePlugin, Subject
from kinetile_conformance.checks import CHECKS
from kinetile_conformance.drawing import Drawing
from kinetile_conformance.isolated import GIB
from kinetile_conformance.mutation.operators import Edit
from kinetile_conformance.mutation.processes import as_a_child, forked, news_apart
from kinetile_conformance.mutation.sources import PhaseSource, Source
from kinetile_conformance.mutation.writing import write
from kinetile_conformance.runner import References, Runner
from kinetile_conformance.smoke_test import tightness

FIRST = (
    "same-contacts",
    "same-contacts-with-turns",
    "never-misses-a-pair",
    "its-structure-is-true",
    "same-contacts-as-bodies-come-and-go",
    "its-structure-is-true-as-bodies-come-and-go",
)
"""The checks that kill most for their time; they run first."""

LONG = (
    "same-contacts-in-a-swarm",
    "stays-within-its-arrays",
    "same-contacts-in-the-gallery",
    "same-contacts-beside-giants",
    "same-contacts-on-lattices",
    "same-contacts-in-a-marathon",
    "near-holds-while-bodies-pass",
    "same-contacts-when-turned-by-hand",
    "does-not-see-who-asks",
)
"""The checks with too many events for interpreted hooks; they run last."""

SURE = 5.0
"""How many times as long as the phase itself a mutant may take for a check."""

MEMORY = 4 * GIB
"""Bytes that a mutant may take beyond what its process begins with."""

STOPPED = {"failed", "xfailed", "died"}

Send = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class MutantTask:
    """One mutant: its number (0: the phase as it is), and its change in a file of the package."""

    number: int
    place: str = ""
    change: Edit | None = None


@dataclass(frozen=True)
class Assignment:
    """The mutants that a child judges, and how.

    Attributes:
        phase: the phase's source.
        features, options: what it declares, and is made with.
        tasks: the mutants.
        checks: the checks, in this order, until one fails.
        examples, seed: scenes for each check, and the seed of their drawing.
        limits: CPU seconds for each check, and for loading.
        skips: checks that do not apply to the phase as it is.
        scratch: a folder.
        whole: whether to measure the over-reporting of a mutant that no check has killed.
    """

    phase: PhaseSource
    features: tuple[str, ...]
    options: dict[str, Any]
    tasks: tuple[MutantTask, ...]
    checks: tuple[str, ...]
    examples: int
    seed: int
    limits: dict[str, float]
    skips: tuple[str, ...]
    scratch: str
    whole: bool

    def as_dict(self) -> dict[str, Any]:
        """Return it, fit for JSON."""
        found = asdict(self)
        for module in found["phase"]["modules"]:
            module["path"] = str(module["path"])
        return found

    @classmethod
    def of(cls, found: dict[str, Any]) -> Assignment:
        """Return what ``as_dict`` was made of."""
        phase = found["phase"]
        modules = tuple(Source(**each | {"path": Path(each["path"])}) for each in phase["modules"])
        tasks = tuple(
            MutantTask(each["number"], each["place"], each["change"] and Edit(**each["change"]))
            for each in found["tasks"]
        )
        phase = PhaseSource(phase["package"], phase["class_name"], modules)
        return cls(**found | {"phase": phase, "tasks": tasks})


def order_of_checks() -> tuple[str, ...]:
    """Return the names of all checks: those first that kill most for their time, those last that are long."""
    return (*FIRST, *(each.name for each in CHECKS if each.name not in (*FIRST, *LONG)), *LONG)


@dataclass(frozen=True)
class SharedScenes:
    """The scenes for all mutants of a child, drawn once, and their outcomes under the reference."""

    drawing: Drawing
    references: References

    @classmethod
    def of(cls, work: Assignment) -> SharedScenes:
        """Draw the small scenes, and compute the reference's outcomes."""
        shared = cls(Drawing(work.examples, work.seed), References())
        for turns in (False, True):
            scenes = shared.drawing.small(turns)
            shared.references.keep(scenes)
            for scene in scenes:
                shared.references(scene)
        return shared


def try_one(work: Assignment, task: MutantTask, shared: SharedScenes, send: Send) -> None:
    """Load a mutant and run checks on it until one fails; send each result."""
    limit_memory(MEMORY)
    end_after(work.limits["load"])
    name = f"mutant_{task.number}"
    folder = Path(work.scratch)
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    try:
        target = write(work.phase, folder, name, task.place, task.change)
        spec = kt.BroadPhaseSpec(name.replace("_", "-"), target, features=frozenset(work.features))
        kt.registry().add(PhasePlugin(spec))
        kt.registry().broad_phase(spec.name)(**work.options)
    except Exception as error:
        send({"crashed": f"{type(error).__name__}: {error}"})
        return
    runner = Runner(
        Subject(spec.name, work.options),
        seconds=float("inf"),
        shrink=False,
        drawing=shared.drawing,
        references=shared.references,
    )
    for check in work.checks:
        send({"begin": check})
        began = time.process_time()
        end_after(work.limits.get(check, work.limits["load"]))
        result = runner.run(check, "a mutant")  # as if expected to fail: no verdict is needed
        refused = result.status == "skipped" and check not in work.skips
        spent = time.process_time() - began
        send({"check": check, "status": result.status, "said": result.said or result.reason, "cpu": spent})
        if result.status in STOPPED or (refused and task.number):
            return
    send({"end": True, "tightness": tightness(Subject(spec.name, work.options)) if work.whole else None})


def serve(work: Assignment, send: Send) -> None:
    """Runner all mutants, each in a fork; pass on its messages, and send how it ended."""
    sys.dont_write_bytecode = True
    words = Path(work.scratch) / f"words-{os.getpid()}"
    patience = 60.0 + 10.0 * max(work.limits.values())
    shared = SharedScenes.of(work)
    for task in work.tasks:
        send({"task": task.number})

        def attempt(tasks: Iterator[dict[str, Any]], forward: Send, task: MutantTask = task) -> None:
            try_one(work, task, shared, forward)

        child = forked(attempt, words)
        late = False
        try:
            while (message := child.hear(patience)) is not None:
                send(message)
        except TimeoutError:
            late = True
        code = None if late else child.ended()
        child.end()
        send({"over": task.number, "code": code})


def main() -> None:
    """Carry out the assignment on the first line of the standard input; messages go to the standard
    output."""
    news = news_apart()
    try:
        as_a_child(lambda tasks, tell: serve(Assignment.of(next(tasks)), tell), news, 0)
    except Exception:
        os.write(2, traceback.format_exc().encode())
        raise
