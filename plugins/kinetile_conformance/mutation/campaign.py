"""The campaign: mutants distributed to children, in three rounds.

In the first, interpreted, the checks that kill most see few scenes of each mutant: nearly all of those that
can be killed die there, most in a tenth of a second. In the second, interpreted too, the other checks see few
scenes of what survives. The third is compiled: the first round's checks see many scenes there, and those
whose runs are too long to be interpreted are run. Each mutant has loops of its own to be compiled, which
takes longer than all the rest.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption, Refused
from kinetile_conformance.mutation.findings import CRASHED, HANGS, KILLED, SURVIVED, Finding
from kinetile_conformance.mutation.judging import (
    FIRST,
    LONG,
    STOPPED,
    SURE,
    Assignment,
    MutantTask,
    order_of_checks,
)
from kinetile_conformance.mutation.mutants import Mutant
from kinetile_conformance.mutation.processes import CAN_FORK, Child, afresh
from kinetile_conformance.mutation.sources import PhaseSource

FEW = 10
"""Scenes a check in the rounds that are interpreted."""

COMPILING = 120.0
"""CPU seconds more, where loops are compiled."""

HEAD = "import os; os.environ['NUMBA_DISABLE_JIT'] = {!r}; os.environ['NUMBA_CACHE_DIR'] = {!r}; "
PROGRAM = HEAD + "from kinetile_conformance.mutation.judging import main; main()"


@dataclass(frozen=True)
class Round:
    """One round: its checks, the number of scenes for each, compiled or not.

    A check may take ``at_least`` CPU seconds, however fast the phase itself is; ``whole`` is whether to
    measure the over-reporting of a survivor.
    """

    checks: tuple[str, ...]
    examples: int
    compiled: bool
    whole: bool = False
    at_least: float = 10.0


def rounds_of(examples: int, compiled: bool = False) -> tuple[Round, ...]:
    """Return the rounds: by the checks that kill most, by the other ones whose runs are short, and, unless
    ``examples`` is 0, by those that kill most and the long ones with so many scenes a check.

    The first two are interpreted, or ``compiled``.
    """
    short = tuple(name for name in order_of_checks() if name not in (*FIRST, *LONG))
    first, second = Round(FIRST, FEW, compiled), Round(short, FEW, compiled, whole=not examples)
    third = Round((*FIRST, *LONG), examples, compiled=True, whole=True)
    return (first, second, *([third] if examples else []))


@dataclass
class _Messages:
    """The messages about one mutant so far."""

    task: int
    at: str = ""
    cpu: float = 0.0
    results: list[dict[str, Any]] = field(default_factory=list)
    crashed: str = ""
    ended: bool = False
    tightness: float | None = None


class _Worker:
    """A child, and its messages."""

    def __init__(self, work: Assignment, compiled: bool) -> None:
        self.left = list(work.tasks)
        self._work = work
        self._compiled = compiled
        self._messages: _Messages | None = None
        self._words = Path(work.scratch) / f"worker-{id(self)}"
        self._child = self._start()

    def _start(self) -> Child:
        cache = Path(self._work.scratch) / "cache"
        program = PROGRAM.format("0" if self._compiled else "1", str(cache))
        return afresh(program, replace(self._work, tasks=tuple(self.left)).as_dict(), self._words)

    def hear(self, seconds: float) -> tuple[_Messages, int | None] | None:
        """Return the messages of a mutant that is done, and how its process ended; None where none is done
        yet. Raise TimeoutError after so many seconds."""
        message = self._child.hear(seconds)
        if message is None:
            self._child.end()
            words = self._words.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            raise Refused(f"the process that judges mutants has died: {(words or ['without a word'])[-1]}")
        if "task" in message:
            self._messages = _Messages(int(message["task"]))
            return None
        messages = self._messages
        assert messages is not None
        if "begin" in message:
            messages.at = str(message["begin"])
        elif "check" in message:
            messages.results.append(message)
            messages.cpu += float(message["cpu"])
        elif "crashed" in message:
            messages.crashed = str(message["crashed"])
        elif "end" in message:
            messages.ended, messages.tightness = True, message["tightness"]
        elif "over" in message:
            self.left.pop(0)
            return messages, message["code"]
        return None

    def end(self) -> None:
        """End the child."""
        self._child.end()


def campaign(
    phase: PhaseSource,
    features: Sequence[str],
    options: Mapping[str, Any],
    mutants: Sequence[Mutant],
    how: Round,
    *,
    seed: int = 0,
    jobs: int = 1,
    on_finding: Callable[[Finding], None] = lambda finding: None,
) -> float | None:
    """Judge mutants in one round, and call ``on_finding`` for each; return the phase's own over-reporting.

    The phase as it is is judged first, in the same way.

    Raises:
        BadOption: the phase as it is does not pass.
        Refused: this system cannot fork, or has no limits on the time of a process.
    """
    if not CAN_FORK or os.name != "posix":
        raise Refused("mutants are judged in processes that are forked, which this system cannot do")
    scratch = tempfile.mkdtemp(prefix="kinetile-mutants-")
    begin = COMPILING if how.compiled else 0.0
    work = Assignment(
        phase=phase,
        features=tuple(features),
        options=dict(options),
        tasks=(MutantTask(0),),
        checks=how.checks,
        examples=how.examples,
        seed=seed,
        limits={"load": 600.0 + begin},
        skips=(),
        scratch=scratch,
        whole=how.whole,
    )
    try:
        original = _original(work, how)
        skips = tuple(row["check"] for row in original.results if row["status"] == "skipped")
        limits = {row["check"]: begin + how.at_least + SURE * row["cpu"] for row in original.results}
        work = replace(work, skips=skips, limits=limits | {"load": begin + how.at_least})
        _all(work, how, mutants, jobs, on_finding)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return original.tightness


def _original(work: Assignment, how: Round) -> _Messages:
    """Judge the phase as it is; raise BadOption where it does not pass."""
    worker = _Worker(work, how.compiled)
    try:
        while (heard := worker.hear(3600.0)) is None:
            pass
    finally:
        worker.end()
    messages, code = heard
    wrong = [row for row in messages.results if row["status"] in STOPPED]
    if wrong or not messages.ended:
        said = (
            f"{wrong[0]['check']}: {wrong[0]['said']}"
            if wrong
            else messages.crashed or f"it ended with {code}"
        )
        raise BadOption(f"the phase as it is does not pass, so its mutants say nothing: {said}")
    return messages


def _all(
    work: Assignment, how: Round, mutants: Sequence[Mutant], jobs: int, on_finding: Callable[[Finding], None]
) -> None:
    """Distribute the mutants to so many children, and receive their messages."""
    tasks = [MutantTask(each.number, each.place, each.change) for each in mutants]
    known = {each.number: each for each in mutants}
    shares = [tuple(tasks[first::jobs]) for first in range(jobs)]
    workers = [_Worker(replace(work, tasks=share), how.compiled) for share in shares if share]
    try:
        while workers:
            for worker in list(workers):
                try:
                    heard = worker.hear(0.2 / len(workers))
                except TimeoutError:
                    continue
                if heard is not None:
                    on_finding(_finding(known[heard[0].task], *heard, work.skips))
                if not worker.left:
                    workers.remove(worker)
                    worker.end()
    finally:
        for worker in workers:
            worker.end()


def _finding(mutant: Mutant, messages: _Messages, code: int | None, skips: Sequence[str]) -> Finding:
    """Return the finding on a mutant, from its messages."""
    if messages.ended:
        return Finding(mutant, SURVIVED, cpu=messages.cpu, tightness=messages.tightness)
    if messages.crashed:
        return Finding(mutant, CRASHED, said=messages.crashed)
    last = messages.results[-1] if messages.results else {"check": "", "status": "", "said": ""}
    refused = last["status"] == "skipped" and last["check"] not in skips
    if last["check"] == messages.at and (last["status"] in STOPPED or refused):
        return Finding(mutant, KILLED, messages.at, last["said"], messages.cpu)
    import signal

    if code in (None, -signal.SIGXCPU, -signal.SIGKILL):
        return Finding(mutant, HANGS, messages.at, "it took too long", messages.cpu)
    return Finding(mutant, CRASHED, messages.at, f"its process ended with {code}", messages.cpu)
