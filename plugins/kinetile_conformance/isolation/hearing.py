"""A hearing: a phase judged by a child with limits, and by the next one when that has died.

An installed phase is judged in a fresh interpreter. One that was added in this process exists nowhere else:
its child is a fork, which has everything that this process has registered and imported. (No other thread of
this process may be compiling meanwhile, and none is; kinetile starts no threads that hold locks.)
"""

from __future__ import annotations

import importlib.util
import json
import shutil
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from kinetile.errors import BadOption, MissingExtra, NotJudged, PhaseError, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject, not_saved, provided, save_case
from kinetile_conformance.checks import check_named
from kinetile_conformance.checks.views import without
from kinetile_conformance.court.court import Trial
from kinetile_conformance.court.limits import SILENCE
from kinetile_conformance.court.report import Result
from kinetile_conformance.isolation.child import FAILING, LAST, Order, read_scene, serve, write_scene
from kinetile_conformance.isolation.deaths import End, cause
from kinetile_conformance.isolation.processes import CAN_FORK, Child, afresh, forked

__all__ = ["DEATHS", "Hearing"]

DEATHS = 3
"""After so many deaths the checks that are left are not run."""

PROGRAM = "from kinetile_conformance.isolation.child import main; main()"
WORDS = "words"

Message = dict[str, Any]


class _Died(Exception):
    """The child has ended before it was done with a task."""

    def __init__(self, end: End) -> None:
        super().__init__()
        self.end = end


class Hearing:
    """The judging of one phase in child processes, check by check; a context, which ends them.

    Args:
        trial: who is on trial, and what was wished for.
        memory: how many bytes a child may take beyond what it begins with, where the system can tell.

    Raises:
        MissingExtra: Hypothesis is not installed.
        Refused: the phase was added in this process, and this system cannot fork.
    """

    def __init__(self, trial: Trial, memory: int) -> None:
        if importlib.util.find_spec("hypothesis") is None:
            raise MissingExtra("the conformance kit", "hypothesis", "conformance")
        self.deaths = 0
        self._forks = _must_fork(trial.subject)
        self._scratch = Path(tempfile.mkdtemp(prefix="kinetile-conformance-"))
        self._order = Order(
            name=trial.subject.name,
            options=trial.subject.options,
            narrow=trial.subject.narrow,
            examples=trial.examples,
            save_to=None if trial.save_to is None else str(trial.save_to.absolute()),
            shrink=trial.shrink,
            seed=trial.seed,
            seconds=trial.seconds,
            memory=memory,
            scratch=str(self._scratch),
            home=str(self._scratch / "hypothesis"),
        )
        self._trial = trial
        self._who = " with ".join(
            f"{each.kind} {each.spec.name!r} of {each.source}" for each in provided(trial.subject)
        )
        self._child: Child | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the child, and remove what it has written down."""
        if self._child is not None:
            self._child.end()
            self._child = None
        shutil.rmtree(self._scratch, ignore_errors=True)

    def rehearse(self) -> None:
        """Have the phase loaded, compiled and run once, and what all checks need compiled where they come.

        If the process does not survive that, the checks will tell of what.

        Raises:
            NotJudged: it does not load or compile.
            BadOption, Refused: as the phase says.
        """

        def hear(message: Message) -> None:
            if "error" in message:
                errors = {"BadOption": BadOption, "Refused": Refused}
                raise errors.get(message["error"], NotJudged)(message["said"])

        with suppress(_Died):
            self._do({"do": "rehearse"}, hear)
            if self._trial.whole and not self._forks and not INTERPRETED:
                self._compile()
        self.deaths = 0

    def _compile(self) -> None:
        """Compile the loops that are not yet, in two processes side by side."""
        found: Message = {}
        self._do({"do": "fresh"}, found.update)
        fresh = list(found.get("fresh", ()))
        if not fresh:
            return
        helper = self._start("words of a helper")
        try:
            helper.ask({"do": "compile", "samples": fresh[1::2]})
            self._do({"do": "compile", "samples": fresh[0::2]}, lambda message: None)
            with suppress(TimeoutError):
                helper.hear(SILENCE)
        finally:
            helper.end()

    def judge(self, name: str) -> Result:
        """Run the check of a name; the result says it if the child does not survive it.

        A check that has died is run no second time, but on ever fewer bodies, to find the fewest.
        """
        self._forget()
        expected = self._trial.expected.get(name)
        results: list[Result] = []
        seen: list[str] = []

        def hear(message: Message) -> None:
            if "seen" in message:
                seen.append(str(message["seen"]))
            elif "scene" in message:
                self._trial.on_scene(name, int(message["scene"]))
            elif "result" in message:
                results.append(_result(message["result"]))

        began = time.perf_counter()
        try:
            self._do({"do": "judge", "check": name, "expected": expected}, hear)
        except _Died as died:
            end = replace(died.end, seen=seen[-1] if seen else None)
            return replace(self._death(end, name, expected), seconds=time.perf_counter() - began)
        if not results:
            raise PhaseError(f"the child has sent no result of the check {name!r}")
        return results[0]

    def tightness(self) -> float | None:
        """Return how much the phase over-reports; None where it does not survive that."""
        found: Message = {}
        try:
            self._do({"do": "tightness"}, found.update)
        except _Died:
            return None
        return found.get("tightness")

    def _do(self, task: Message, hear: Callable[[Message], None], *, alone: bool = False) -> None:
        """Give the child a task, and pass on what it says until it is done; raise _Died if it ends before."""
        if self._child is None:
            self._child = self._start(WORDS)
        child = self._child
        child.ask(task)
        try:
            while True:
                message = child.hear(SILENCE)
                if message is None:
                    raise _Died(End(child.ended()))
                if "done" in message:
                    return
                hear(message)
        except TimeoutError:
            child.end(ask_where=True)
            raise _Died(End(None, silent=True)) from None
        except _Died:
            if not alone:
                self.deaths += 1
            raise
        finally:
            if child.ended_already() or alone:
                child.end()
                self._child = None

    def _start(self, words: str) -> Child:
        path = self._scratch / words
        if self._forks:
            return forked(lambda tasks, tell: serve(self._order, tasks, tell), path)
        return afresh(PROGRAM, self._order.as_dict(), path)

    def _words(self) -> str:
        """Return what the child has printed."""
        try:
            return (self._scratch / WORDS).read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""

    def _forget(self) -> None:
        """Remove what a check has written down."""
        for name in (LAST, FAILING):
            (self._scratch / name).unlink(missing_ok=True)

    def _death(self, end: End, name: str, expected: str | None) -> Result:
        """Return the result of a check whose child has died, or was ended."""
        check = check_named(name)
        scene, count = self._written(LAST if end.seen is None else FAILING)
        dying = cause(end, f"check {name!r}", self._words(), self._who, self._order.memory)
        result = Result(name, check.sentence, "died", count, 0.0, said=dying)
        if end.silent:
            return replace(result, status="not judged", said="", reason=dying)
        if not check.draws:
            scene = None
        if end.seen is not None:
            said = f"{end.seen}\n(and while a smaller scene was looked for, {dying})"
            result = replace(result, status="failed", said=said)
        elif scene is not None and self._order.shrink and expected is None and not end.looping:
            scene = self._fewest(name, scene)
        if expected is not None:
            result = replace(result, status="xfailed", reason=expected)
        elif result.status == "died" and scene is not None:
            result = replace(result, verdict=self._verdict(name))
            if end.looping and not result.verdict:
                slow = f"{dying}; and so it is under kinetile's other phases"
                return replace(result, status="not judged", said="", reason=slow)
        if scene is None:
            return result
        result = replace(result, bodies=len(scene))
        if self._order.save_to is not None and check.replay:
            path = Path(self._order.save_to) / f"{self._order.name}-{name}.toml"
            try:
                save_case(scene, path, check.replay, self._trial.subject, result.said)
                result = replace(result, case=path)
            except OSError as error:
                result = replace(result, said=f"{result.said}\n{not_saved('scene', error)}")
        return result

    def _fewest(self, check: str, scene: Scene) -> Scene:
        """Leave out one body after the other where the process dies without it too, for as long as a check
        may take."""
        until = time.perf_counter() + self._order.seconds
        body = 0
        while body < len(scene) and time.perf_counter() < until:
            fewer = without(scene, body)
            if self._dies(check, fewer):
                scene = fewer
            else:
                body += 1
        write_scene(self._scratch / LAST, scene, 1)
        return scene

    def _dies(self, check: str, scene: Scene) -> bool:
        """Whether a child dies of one check on one scene."""
        write_scene(self._scratch / LAST, scene, 1)
        try:
            self._do({"do": "alone", "check": check}, lambda message: None, alone=True)
        except _Died as died:
            return not died.end.silent
        return False

    def _verdict(self, check: str) -> str:
        """Return whom a death speaks against: the same scene under the other phases; "" where a process does
        not survive these, either."""
        found: Message = {}
        with suppress(_Died):
            self._do({"do": "verdict", "check": check}, found.update, alone=True)
        return str(found.get("verdict", ""))

    def _written(self, name: str) -> tuple[Scene | None, int]:
        """Return a scene that the child has written down, and how many there were until then."""
        try:
            return read_scene(self._scratch / name)
        except (OSError, ValueError):
            return None, 0


def _must_fork(subject: Subject) -> bool:
    """Whether the child has to be a fork; raise Refused where it would, and this system cannot."""
    options = [subject.options, subject.narrow]
    installed = all(each.distribution is not None for each in provided(subject))
    try:
        portable = json.loads(json.dumps(options)) == options
    except (TypeError, ValueError):
        portable = False
    if installed and portable:
        return False
    if not CAN_FORK:
        what = "options that are plain values" if installed else "a phase that is installed"
        raise Refused(f"on this system a process of its own is only for {what}: judge it in this process")
    return True


def _result(row: Message) -> Result:
    """Return a result as a child has sent it."""
    paths = {key: Path(row[key]) for key in ("case", "picture") if row[key] is not None}
    try:
        return Result(**row | paths)
    except TypeError as error:
        raise PhaseError(f"the child sent a result that is none: {error}") from error
