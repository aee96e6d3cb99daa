"""The sandbox: runs checks in a child process with limits, and starts another when it dies.

A phase can crash the interpreter, run for ever or take all memory; the calling process goes on. When a child
dies, the check that it was at gets the cause as its result, and a new child does the rest.

An installed phase is judged in a fresh interpreter. A phase that was added in this process exists nowhere
else: its child is a fork, which has everything that this process has registered and imported. (No other
thread of this process may be compiling meanwhile, and none is; kinetile starts no threads that hold locks.)
"""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import signal
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import kinetile
from kinetile.errors import BadOption, MissingExtra, NotJudged, PhaseError, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.compiled.limits import out_of_time
from kinetile.plugin.calling import is_library
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject, not_saved, provided, save_case
from kinetile_conformance.checks import check_named
from kinetile_conformance.checks.metamorphic import without
from kinetile_conformance.deadline import SCENE_SECONDS, SILENCE
from kinetile_conformance.judge import Request
from kinetile_conformance.processes import CAN_FORK, Child, afresh, forked
from kinetile_conformance.report import Result
from kinetile_conformance.sandbox_child import (
    FAILING,
    LAST,
    NO_MEMORY,
    ChildJob,
    read_scene,
    serve,
    write_scene,
)

COMPILER = "the compiler"

FRAME = re.compile(r'^  File "(?P<file>.*)", line (?P<line>\d+) in (?P<function>.*)$')
OWN = Path(str(kinetile.__file__)).parent


def where(words: str) -> str:
    """Return where a process died by the stack that ``faulthandler`` has written: the innermost place that is
    no library's, such as "arrange (my_phase.py, line 12)"; "" if there is none.

    Compiled hooks have no stack of their own: a death in one is "in a compiled hook".
    """
    for thread in re.split(r"^(?:Current t|T)hread .*$", words, flags=re.MULTILINE)[1:]:
        frames = [found for line in thread.splitlines() if (found := FRAME.match(line))]
        if any(frame["function"] == "_listen" for frame in frames):
            continue
        for frame in frames:
            path = Path(frame["file"])
            if is_library(path):
                continue
            if path == OWN / "run" / "engine" / "engine.py" and frame["function"] == "_run_loop":
                return "a compiled hook"
            if path.parent == OWN / "kernel" / "compiled":
                return COMPILER
            return f"{frame['function']} ({path.name}, line {frame['line']})"
    return ""


GIB = 1 << 30


@dataclass(frozen=True)
class Death:
    """How a child ended.

    Attributes:
        code: its exit code, negative for a signal; None where it gave none.
        seen: what had failed in its last check before.
        silent: whether it was ended because it sent no message any more.
    """

    code: int | None
    seen: str | None = None
    silent: bool = False

    @property
    def looping(self) -> bool:
        """Whether it was ended because one scene took too long."""
        return out_of_time(self.code)


def cause(end: Death, what: str, words: str, who: str, memory: int) -> str:
    """Return what a child died of, in a sentence.

    Args:
        end: how it ended.
        what: what it was doing, such as "check 'same-contacts'".
        words: its output, with the stack that was written when it died.
        who: the broad phase and its distribution.
        memory: the bytes that it was allowed to take.
    """
    place = where(words)
    if end.looping:
        there = f" in {place}" if place else ""
        return f"an endless loop{there}, in {what}: {SCENE_SECONDS:g} CPU s, and no end of one scene ({who})"
    if end.silent:
        there = f", in {place}" if place else ""
        return f"nothing was heard for {SILENCE:g} s in {what}{there}: does it wait for something? ({who})"
    if end.code == NO_MEMORY or "out of memory" in words.lower() or "MemoryError" in words:
        return f"out of memory in {what}: it asked for more than {memory / GIB:.3g} GiB ({who})"
    if end.code is None:
        return f"the process fell silent in {what} ({who})"
    near = f", in {place}" if place else ""
    if end.code < 0:
        return f"the process died of {_signal(-end.code)} in {what}{near} ({who})"
    return f"the process ended itself with status {end.code} in {what}{near} ({who})"


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


DEATHS = 3
"""After so many deaths the checks that are left are not run."""

PROGRAM = "from kinetile_conformance.sandbox_child import main; main()"
WORDS = "words"

Message = dict[str, Any]


class _Died(Exception):
    """The child has ended before it was done with a task."""

    def __init__(self, end: Death) -> None:
        super().__init__()
        self.end = end


class Sandbox:
    """Judges one phase in child processes, check by check; a context, which ends them.

    Args:
        request: the phases under test, and the options.
        memory: how many bytes a child may take beyond what it begins with, where the system can tell.

    Raises:
        MissingExtra: Hypothesis is not installed.
        Refused: the phase was added in this process, and this system cannot fork.
    """

    def __init__(self, request: Request, memory: int) -> None:
        if importlib.util.find_spec("hypothesis") is None:
            raise MissingExtra("the conformance kit", "hypothesis", "conformance")
        self.deaths = 0
        self._forks = _must_fork(request.subject)
        self._scratch = Path(tempfile.mkdtemp(prefix="kinetile-conformance-"))
        self._job = ChildJob(
            name=request.subject.name,
            options=request.subject.options,
            narrow=request.subject.narrow,
            examples=request.examples,
            save_to=None if request.save_to is None else str(request.save_to.absolute()),
            shrink=request.shrink,
            seed=request.seed,
            seconds=request.seconds,
            memory=memory,
            scratch=str(self._scratch),
            home=str(self._scratch / "hypothesis"),
        )
        self._request = request
        self._who = " with ".join(
            f"{each.kind} {each.spec.name!r} of {each.source}" for each in provided(request.subject)
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
        """Load and compile the phase and run it once; where all checks follow, compile what they need.

        If the process does not survive that, the checks will report the cause.

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
            if self._request.whole and not self._forks and not INTERPRETED:
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
        """Run the check of a name; the result has the status "died" if the child does not survive it.

        Then the check is run again on ever fewer bodies, to find the fewest on which it dies.
        """
        self._forget()
        expected = self._request.expected.get(name)
        results: list[Result] = []
        seen: list[str] = []

        def hear(message: Message) -> None:
            if "seen" in message:
                seen.append(str(message["seen"]))
            elif "scene" in message:
                self._request.on_scene(name, int(message["scene"]))
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
        """Return the phase's over-reporting; None where the child does not survive measuring it."""
        found: Message = {}
        try:
            self._do({"do": "tightness"}, found.update)
        except _Died:
            return None
        return found.get("tightness")

    def _do(self, task: Message, hear: Callable[[Message], None], *, alone: bool = False) -> None:
        """Give the child a task, and pass on its messages until it is done; raise _Died if it ends before."""
        if self._child is None:
            self._child = self._start(WORDS)
        child = self._child
        child.ask(task)
        try:
            while True:
                message = child.hear(SILENCE)
                if message is None:
                    raise _Died(Death(child.ended()))
                if "done" in message:
                    return
                hear(message)
        except TimeoutError:
            child.end(ask_where=True)
            raise _Died(Death(None, silent=True)) from None
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
            return forked(lambda tasks, tell: serve(self._job, tasks, tell), path)
        return afresh(PROGRAM, self._job.as_dict(), path)

    def _words(self) -> str:
        """Return the child's output."""
        try:
            return (self._scratch / WORDS).read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""

    def _forget(self) -> None:
        """Remove the scenes that a check has written."""
        for name in (LAST, FAILING):
            (self._scratch / name).unlink(missing_ok=True)

    def _death(self, end: Death, name: str, expected: str | None) -> Result:
        """Return the result of a check whose child has died, or was ended."""
        check = check_named(name)
        scene, count = self._written(LAST if end.seen is None else FAILING)
        dying = cause(end, f"check {name!r}", self._words(), self._who, self._job.memory)
        result = Result(name, check.sentence, "died", count, 0.0, said=dying)
        if end.silent and end.seen is None:
            return replace(result, status="not judged", said="", reason=dying)
        if not check.draws:
            scene = None
        if end.seen is not None:
            said = f"{end.seen}\n(and while a smaller scene was looked for, {dying})"
            result = replace(result, status="failed", said=said)
        elif scene is not None and self._job.shrink and expected is None and not end.looping:
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
        if self._job.save_to is not None and check.replay:
            path = Path(self._job.save_to) / f"{self._job.name}-{name}.toml"
            try:
                save_case(scene, path, check.replay, self._request.subject, result.said)
                result = replace(result, case=path)
            except OSError as error:
                result = replace(result, said=f"{result.said}\n{not_saved('scene', error)}")
        return result

    def _fewest(self, check: str, scene: Scene) -> Scene:
        """Leave out one body after the other where the process dies without it too, for as long as a check
        may take."""
        until = time.perf_counter() + self._job.seconds
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
        """Return which phase a death speaks against, by the same scene under the other phases; "" where a
        child does not survive these, either."""
        found: Message = {}
        with suppress(_Died):
            self._do({"do": "verdict", "check": check}, found.update, alone=True)
        return str(found.get("verdict", ""))

    def _written(self, name: str) -> tuple[Scene | None, int]:
        """Return a scene that the child has written, and the number of scenes until then."""
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
