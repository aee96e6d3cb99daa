"""The campaign: mutants handed to children, in three rounds.

In the first, interpreted, each mutant is shown few scenes by the checks that kill most: nearly all of those
that can be killed die there, most in a tenth of a second. What survives is shown few scenes by the other
checks in the second, interpreted too. The third is compiled: the first round's checks see many scenes there,
and those whose runs are too long to be interpreted are run. Each mutant has loops of its own to be compiled,
which takes longer than all the rest.
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
from kinetile_conformance.isolation.processes import CAN_FORK, Child, afresh
from kinetile_conformance.mutation.judging import FIRST, LONG, STOPPED, SURE, Task, Work, order_of_checks
from kinetile_conformance.mutation.mutants import Mutant
from kinetile_conformance.mutation.report import CRASHED, HANGS, KILLED, SURVIVED, Finding
from kinetile_conformance.mutation.sources import PhaseSource

__all__ = ["FEW", "Round", "campaign", "rounds_of"]

FEW = 10
"""Scenes a check in the rounds that are interpreted."""

COMPILING = 120.0
"""CPU seconds more, where loops are compiled."""

HEAD = "import os; os.environ['NUMBA_DISABLE_JIT'] = {!r}; os.environ['NUMBA_CACHE_DIR'] = {!r}; "
PROGRAM = HEAD + "from kinetile_conformance.mutation.judging import main; main()"


@dataclass(frozen=True)
class Round:
    """One round: which checks, with how many scenes, compiled or not.

    A check may take ``at_least`` CPU seconds, however fast the phase itself is; ``whole`` is whether to see
    how much a survivor over-reports.
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
class _Told:
    """What has been told of one mutant."""

    task: int
    at: str = ""
    cpu: float = 0.0
    results: list[dict[str, Any]] = field(default_factory=list)
    crashed: str = ""
    ended: bool = False
    tightness: float | None = None


class _Server:
    """A child and what it has told."""

    def __init__(self, work: Work, compiled: bool) -> None:
        self.left = list(work.tasks)
        self._work = work
        self._compiled = compiled
        self._told: _Told | None = None
        self._words = Path(work.scratch) / f"server-{id(self)}"
        self._child = self._start()

    def _start(self) -> Child:
        cache = Path(self._work.scratch) / "cache"
        program = PROGRAM.format("0" if self._compiled else "1", str(cache))
        return afresh(program, replace(self._work, tasks=tuple(self.left)).as_dict(), self._words)

    def hear(self, seconds: float) -> tuple[_Told, int | None] | None:
        """Return what was told of a mutant that is done with, and how its process ended; None where there is
        none yet. Raise TimeoutError after so many seconds."""
        message = self._child.hear(seconds)
        if message is None:
            self._child.end()
            words = self._words.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            raise Refused(f"the process that judges mutants has died: {(words or ['without a word'])[-1]}")
        if "task" in message:
            self._told = _Told(int(message["task"]))
            return None
        told = self._told
        assert told is not None
        if "begin" in message:
            told.at = str(message["begin"])
        elif "check" in message:
            told.results.append(message)
            told.cpu += float(message["cpu"])
        elif "crashed" in message:
            told.crashed = str(message["crashed"])
        elif "end" in message:
            told.ended, told.tightness = True, message["tightness"]
        elif "over" in message:
            self.left.pop(0)
            return told, message["code"]
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
    """Judge mutants in one round, each found told as it comes; return how much the phase itself over-reports.

    The phase as it is is judged first, in the same way.

    Raises:
        BadOption: the phase as it is does not pass.
        Refused: this system cannot fork, or has no limits on the time of a process.
    """
    if not CAN_FORK or os.name != "posix":
        raise Refused("mutants are judged in processes that are forked, which this system cannot do")
    scratch = tempfile.mkdtemp(prefix="kinetile-mutants-")
    begin = COMPILING if how.compiled else 0.0
    work = Work(
        phase=phase,
        features=tuple(features),
        options=dict(options),
        tasks=(Task(0),),
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


def _original(work: Work, how: Round) -> _Told:
    """Judge the phase as it is; raise BadOption where it does not pass."""
    server = _Server(work, how.compiled)
    try:
        while (heard := server.hear(3600.0)) is None:
            pass
    finally:
        server.end()
    told, code = heard
    wrong = [row for row in told.results if row["status"] in STOPPED]
    if wrong or not told.ended:
        said = (
            f"{wrong[0]['check']}: {wrong[0]['said']}" if wrong else told.crashed or f"it ended with {code}"
        )
        raise BadOption(f"the phase as it is does not pass, so its mutants say nothing: {said}")
    return told


def _all(
    work: Work, how: Round, mutants: Sequence[Mutant], jobs: int, on_finding: Callable[[Finding], None]
) -> None:
    """Hand the mutants out to so many children, and listen to them."""
    tasks = [Task(each.number, each.place, each.change) for each in mutants]
    known = {each.number: each for each in mutants}
    shares = [tuple(tasks[first::jobs]) for first in range(jobs)]
    servers = [_Server(replace(work, tasks=share), how.compiled) for share in shares if share]
    try:
        while servers:
            for server in list(servers):
                try:
                    heard = server.hear(0.2 / len(servers))
                except TimeoutError:
                    continue
                if heard is not None:
                    on_finding(_finding(known[heard[0].task], *heard, work.skips))
                if not server.left:
                    servers.remove(server)
                    server.end()
    finally:
        for server in servers:
            server.end()


def _finding(mutant: Mutant, told: _Told, code: int | None, skips: Sequence[str]) -> Finding:
    """Return what came of a mutant, from what was told of it."""
    if told.ended:
        return Finding(mutant, SURVIVED, cpu=told.cpu, tightness=told.tightness)
    if told.crashed:
        return Finding(mutant, CRASHED, said=told.crashed)
    last = told.results[-1] if told.results else {"check": "", "status": "", "said": ""}
    refused = last["status"] == "skipped" and last["check"] not in skips
    if last["check"] == told.at and (last["status"] in STOPPED or refused):
        return Finding(mutant, KILLED, told.at, last["said"], told.cpu)
    import signal

    if code in (None, -signal.SIGXCPU, -signal.SIGKILL):
        return Finding(mutant, HANGS, told.at, "it took too long", told.cpu)
    return Finding(mutant, CRASHED, told.at, f"its process ended with {code}", told.cpu)
