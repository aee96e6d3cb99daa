"""The judging of mutants, each in a fork with limits, so that the next one begins afresh whatever a mutant
does to its process. All that they need is imported before, so a fork begins without delay.

Interpreted, nearly all mutants that can be killed die within seconds. Compiled, a mutant has loops of its
own to be compiled, which takes longer than all the rest.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kinetile as kt
from kinetile.errors import BadOption
from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.compiled.limits import end_after, limit_memory
from kinetile_conformance import CHECKS, Result, check_broad_phase
from kinetile_conformance.cases import PhasePlugin
from kinetile_conformance.mutation.importing import ChangedFinder
from kinetile_conformance.mutation.mutants import Mutant, PhaseSource

KILLED, HANGS, CRASHED, SURVIVED = "killed", "hangs", "crashed", "survived"

SECONDS = 5.0 if INTERPRETED else 180.0
"""CPU seconds for a check of the phase itself. Interpreted, a check that takes longer is left out."""

SLOWER = 5.0
"""How many times as long as the phase itself a mutant may take for a check, beside these seconds."""

MEMORY = 4 << 30
"""Bytes that a mutant may take beyond what its process begins with."""

ALIAS = "mutant"
"""The name under which a phase's package is imported with a change, so that the phase itself stays."""

Task = tuple[str, str, Mapping[str, float]]
"""A module, the text in place of its own, and CPU seconds for each check."""


@dataclass(frozen=True)
class Campaign:
    """Judges a phase's mutants.

    Args:
        phase: its source.
        features, options: what it declares, and is made with.
        checks, examples, seed: the checks, scenes for each, and the seed of their drawing.
        jobs: mutants at a time.
    """

    phase: PhaseSource
    features: Sequence[str] = ()
    options: Mapping[str, Any] = field(default_factory=dict)
    checks: Sequence[str] = tuple(each.name for each in CHECKS)
    examples: int = 10
    seed: int = 0
    jobs: int = 1

    def judge(self, mutants: Sequence[Mutant]) -> Iterator[dict[str, Any]]:
        """Yields for each mutant, as it is done: its ``number``; its ``fate``: killed (by ``check``, which
        ``said`` something), hangs (in ``check``), crashed, or survived; and its CPU seconds.

        Raises BadOption where the phase as it is does not pass.
        """
        limits = {}
        alone = [("", "", {check: SECONDS}) for check in self.checks]  # so that a long one ends no other
        for number, code, rows in self._forked(alone):
            fate, check, said = _fate(code, rows, self.checks[number:])
            if fate == SURVIVED:
                limits[self.checks[number]] = SECONDS + SLOWER * rows[0]["cpu"]
            elif said != "skipped" and (fate != HANGS or not INTERPRETED):
                said = f"{check}: {said}" if fate == KILLED else said
                raise BadOption(f"the phase as it is does not pass, so its mutants say nothing: {said}")
        known = {check: limits[check] for check in self.checks if check in limits}
        tasks = [(each.source.module, each.text, known) for each in mutants]
        for number, code, rows in self._forked(tasks):
            fate, check, said = _fate(code, rows, tuple(known))
            spent = sum(each.get("cpu", 0.0) for each in rows)
            came = {"fate": fate, "check": check, "said": said, "cpu_seconds": spent}
            yield {"number": mutants[number].number} | came

    def _forked(
        self, tasks: Sequence[tuple[str, str, Mapping[str, float]]]
    ) -> Iterator[tuple[int, int, Any]]:
        """Does each task in a fork; yields its number, the exit code, and the rows that the fork has
        written."""
        running: dict[int, tuple[int, Path]] = {}
        left = list(enumerate(tasks))
        with tempfile.TemporaryDirectory(prefix="kinetile-mutants-") as folder:
            try:
                while left or running:
                    if left and len(running) < self.jobs:
                        number, task = left.pop(0)
                        told = Path(folder) / str(number)
                        told.touch()
                        sys.stdout.flush()
                        if (pid := os.fork()) == 0:
                            self._fork(told, *task)
                        running[pid] = number, told
                        continue
                    pid, status = os.wait()
                    if pid in running:
                        number, told = running.pop(pid)
                        _end(pid)
                        lines = told.read_text(encoding="utf-8").splitlines()
                        yield number, os.waitstatus_to_exitcode(status), [json.loads(line) for line in lines]
            finally:
                for pid in running:
                    os.kill(pid, signal.SIGKILL)
                    os.waitpid(pid, 0)
                    _end(pid)

    def _fork(self, told: Path, *task: Any) -> None:
        """Does a task in this process, and ends it."""
        code = 70
        with suppress(BaseException):
            os.setsid()  # with whatever it starts
            for stream in (1, 2):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
            self._try(told, *task)
            code = 0
        os._exit(code)

    def _try(self, told: Path, module: str, text: str, limits: Mapping[str, float]) -> None:
        """Loads a mutant, runs checks on it until one does not pass, and tells what came of each."""
        left = [*limits.values(), SECONDS]
        began = time.process_time()

        def tell(**row: Any) -> None:
            with told.open("a", encoding="utf-8") as file:
                file.write(f"{json.dumps(row)}\n")

        def limit() -> None:
            end_after(left[0])
            signal.alarm(math.ceil(60.0 + 10.0 * left.pop(0)))  # it may only wait

        def judged(result: Result) -> None:
            nonlocal began
            said = "skipped" if result.status == "skipped" else result.said or result.reason
            tell(check=result.check, status=result.status, said=said, cpu=time.process_time() - began)
            if result.status != "xpassed":
                os._exit(0)
            began = time.process_time()
            limit()

        limit_memory(MEMORY)
        limit()
        root = self.phase.target.partition(":")[0].partition(".")[0]
        target = ALIAS + self.phase.target.removeprefix(root)
        ChangedFinder(root, ALIAS, module, text)
        kt.registry().add(PhasePlugin(kt.BroadPhaseSpec(ALIAS, target, features=frozenset(self.features))))
        try:
            check_broad_phase(
                ALIAS,
                in_process=True,
                checks=list(limits),
                expected_failures=dict.fromkeys(limits, "a mutant"),  # then nothing is made of a failure
                options=self.options,
                examples=self.examples,
                seed=self.seed,
                seconds=math.inf,
                shrink=False,
                on_result=judged,
            )
        except Exception as error:
            tell(crashed=f"{type(error).__name__}: {error}")
        else:
            tell(survived=True)


def _end(pid: int) -> None:
    """Ends what a process has started, or has left behind."""
    with suppress(OSError):
        os.killpg(pid, signal.SIGKILL)


def _fate(code: int, rows: Sequence[dict[str, Any]], checks: Sequence[str]) -> tuple[str, str, str]:
    """Returns a mutant's fate, the check of it, and what was said, from how its process ended, what it told,
    and the checks that it was to run."""
    last = rows[-1] if rows else {}
    if "survived" in last:
        return SURVIVED, "", ""
    if "crashed" in last:
        return CRASHED, "", last["crashed"]
    if last.get("status", "xpassed") != "xpassed":
        return KILLED, last["check"], last["said"]
    check = checks[len(rows)] if len(rows) < len(checks) else ""
    if code in (-signal.SIGXCPU, -signal.SIGKILL, -signal.SIGALRM):
        return HANGS, check, "it took too long"
    return CRASHED, check, f"its process ended with {code}"


def passes(mutant: Mutant | None, command: str, seconds: float | None = None) -> bool:
    """Returns whether an author's own tests end with exit code 0, within ``seconds``, on a mutant or, where
    there is none, on the phase as it is.

    They run in the installed package itself: a ``sitecustomize`` on the path of the command makes every
    interpreter that it starts compile the changed text in place of the file's.
    """
    with tempfile.TemporaryDirectory(prefix="kinetile-mutant-") as folder:
        path = [os.environ.get("PYTHONPATH", "")]
        if mutant is not None:
            module, text = mutant.source.module, mutant.text
            root = module.partition(".")[0]
            importing = Path(__file__).with_name("importing.py").read_text(encoding="utf-8")
            install = f"\n\nChangedFinder({root!r}, {root!r}, {module!r}, {text!r})\n"
            (Path(folder) / "sitecustomize.py").write_text(importing + install, encoding="utf-8")
            path.insert(0, folder)
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, path))}
        environment.pop("NUMBA_DISABLE_JIT", None)
        with subprocess.Popen(
            ["sh", "-c", command],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        ) as process:
            try:
                return process.wait(seconds) == 0
            except subprocess.TimeoutExpired:
                return False
            finally:
                _end(process.pid)
