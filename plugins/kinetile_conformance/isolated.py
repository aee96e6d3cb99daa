"""The isolated runner: runs checks in a child process with limits, and starts another when it dies.

A phase can crash the interpreter, run for ever or take all memory; the calling process goes on. When a child
dies, the check that it was at gets the cause as its result, and a new child does the rest. A failure that was
seen before is the result in any case.

The child has a ``Runner``, and this one calls its functions there. What was added in this process, in a
notebook for instance, is sent to it: what another process cannot import goes by value.
"""

from __future__ import annotations

import importlib.util
import pickle
import re
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import kinetile
from kinetile.errors import MissingExtra, PhaseError, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.compiled.limits import out_of_time
from kinetile.plugin.calling import is_library
from kinetile.scene import Scene
from kinetile_conformance import deadline
from kinetile_conformance.cases import Subject, provided
from kinetile_conformance.checks import CHECKS, check_named
from kinetile_conformance.checks.check import Check, Reference
from kinetile_conformance.diagnosis import OFTEN, likely
from kinetile_conformance.processes import (
    IDLE,
    NO_MEMORY,
    Child,
    Gone,
    Limits,
    Message,
    Phases,
    Send,
    Silent,
    leave_without_memory,
)
from kinetile_conformance.reporting import Result, saved
from kinetile_conformance.runner import CheckRun, Plan, Runner, verdict
from kinetile_conformance.smoke_test import fresh
from kinetile_conformance.strategies.changes import without

DEATHS = 3
"""After this number of deaths the checks that are left are not run."""

COMPILING = 200.0
"""CPU seconds that a child may compile between two messages."""


FEW = 12
"""Scenes for each check that runs with interpreted hooks before anything is compiled."""

BRIEF = 3.0
"""CPU seconds for such a check."""

PRELIMINARY = "with interpreted hooks; it is run with compiled ones as well, and that counts"


class Ending(NamedTuple):
    """A way in which a child ends before it is done with a check: the status of the check, where it had not
    failed before, and a sentence."""

    status: str
    said: str


ENDINGS = {
    "endless": Ending("died", "an endless loop{place}, in {what}: {scene:g} CPU s, and no end of one scene"),
    "busy": Ending("died", "an endless loop in a process that {what} has started{place}"),
    "idle": Ending(
        "not judged",
        "nothing was heard and no CPU time used for {idle:g} s in {what}{place}: does it wait for something?",
    ),
    "memory": Ending("died", "out of memory in {what}: it asked for more than {memory:.3g} GiB"),
    "killed": Ending("not judged", "the process was ended from outside, by {signal}, in {what}"),
    "signal": Ending("died", "the process died of {signal} in {what}{place}"),
    "exit": Ending("died", "the process ended itself with status {code} in {what}{place}"),
    "closed": Ending("died", "the process fell silent in {what}"),
    "error": Ending("not judged", "an error of the kit itself, not of the phase, in {what}"),
}
"""The table of endings; ``ending_of`` finds the row."""


def ending_of(code: int | None, words: str) -> str:
    """Return the row of the table for a child with this exit code (None: it gave none) and output."""
    if out_of_time(code):
        return "endless"
    if code == NO_MEMORY or "out of memory" in words.lower() or "MemoryError" in words:
        return "memory"
    if code is None:
        return "closed"
    if -code in (getattr(signal, "SIGKILL", 0), signal.SIGTERM):
        return "killed"
    return "signal" if code < 0 else "exit"


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


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
                return "the compiler"
            return f"{frame['function']} ({path.name}, line {frame['line']})"
    return ""


class _Died(Exception):
    """The child has ended before it was done; ``how`` is the row of the table of endings, ``trace`` the
    traceback of an error of the kit, and ``words`` what it has printed."""

    def __init__(self, how: str, code: int | None, trace: str, words: str) -> None:
        super().__init__()
        self.how = how
        self.code = code
        self.trace = trace
        self.words = words


class IsolatedRunner:
    """Runs checks on one phase in child processes; a context, which ends them.

    Args:
        plan: the phases under test, and the options.
        environment: variables that a child has beside those of this process.

    Raises:
        MissingExtra: Hypothesis is not installed.
        Refused: the phase was added in this process, and cannot be sent to another.
    """

    def __init__(self, plan: Plan, environment: Mapping[str, str] | None = None) -> None:
        if importlib.util.find_spec("hypothesis") is None:
            raise MissingExtra("the conformance kit", "hypothesis", "conformance")
        self.deaths = 0
        self.notes: tuple[str, ...] = ()
        self._preliminary = ""
        self._plan = plan
        self._scene_seconds = deadline.SCENE_SECONDS
        self._who = " with ".join(
            f"{each.kind} {each.spec.name!r} of {each.source}" for each in provided(plan.subject)
        )
        self._environment = environment or {}
        self._phases = Phases.of(plan.subject)
        self._phases.pickled(None)
        self._scratch = Path(tempfile.mkdtemp(prefix="kinetile-conformance-"))
        self._child: Child | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the child, and remove what it has written."""
        if self._child is not None:
            self._child.end()
            self._child = None
        shutil.rmtree(self._scratch, ignore_errors=True)

    def smoke_test(self) -> None:
        """Load and compile the phase and run it once.

        Where all checks follow and loops are still to be compiled, which takes longer than all the rest, some
        checks see a few scenes with interpreted hooks first. What fails there is passed to ``on_result`` at
        once, as a preliminary result: its check is run with compiled hooks as well, and that result counts.

        If the process does not survive that, the checks will report the cause.

        Raises:
            NotJudged: it does not load or compile.
            BadOption, Refused: as the phase says.
        """
        with suppress(_Died):
            if self._plan.whole and not INTERPRETED and self._call(_is_fresh):
                self._run_interpreted()
            self._call(Runner.smoke_test)
        self.deaths = 0

    def _run_interpreted(self) -> None:
        """Run the checks that see an obvious fault on a few scenes with interpreted hooks until one fails."""
        plan = replace(self._plan, examples=FEW, seconds=BRIEF, shrink=False)
        # Of what has nothing to do with the compiler, the compiled hooks will die, too.
        with suppress(_Died), IsolatedRunner(plan, {"NUMBA_DISABLE_JIT": "1"}) as runner:
            runner._call(Runner.smoke_test)
            for each in CHECKS:
                if not each.obvious or each.name in plan.expected:
                    continue
                result = runner.run(each.name)
                if result.status == "failed" and " raised " not in result.said:  # compiled, nothing is raised
                    self._preliminary = each.name
                    plan.on_result(replace(result, reason=PRELIMINARY))
                if not result.ok:
                    return

    def run(self, name: str, expected: str | None = None) -> Result:
        """Run the check of a name; ``expected`` is why it is known to fail.

        The result has the status "died" if the child does not survive it. Then the check is run again on ever
        fewer bodies, to find the fewest on which it dies.
        """
        last: Message = {"count": 0}
        failed: Message = {}

        def hear(message: Message) -> None:
            if "seen" in message:
                failed.update(message)
            elif "count" in message:
                last.update(message)
                self._plan.on_scene(name, message["count"])

        began = time.perf_counter()
        try:
            result = self._call(Runner.run, name, expected, hear=hear)
        except _Died as died:
            result = self._death(died, name, expected, failed or last)
            return replace(result, seconds=time.perf_counter() - began)
        if not isinstance(result, Result):
            raise PhaseError(f"the child has sent no result of the check {name!r}")
        if name == self._preliminary and result.ok:
            self.notes = (f"{name} fails with interpreted hooks only: they do not mean the same compiled",)
        return result

    def tightness(self) -> float | None:
        """Return the phase's over-reporting; None where the child does not survive measuring it."""
        with suppress(_Died):
            found: float | None = self._call(Runner.tightness)
            return found
        return None

    def _call(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        hear: Callable[[Message], None] = lambda _: None,
        again: bool = False,
    ) -> Any:
        """Return what a function of the runner in the child returns, and pass on messages until then; raise
        _Died if the child ends before.

        ``again``: it repeats what a child has died of, so another death does not count.
        """
        child = self._child = self._child or self._start()
        code, trace = None, ""
        try:
            return child.call(function, *arguments, hear=hear)
        except Gone as gone:
            code, trace = child.exit_code(), gone.trace
            how = "error" if trace else ending_of(code, child.words)
        except Silent as silent:
            how = "busy" if silent.busy else "idle"
            child.end(ask_where=True)
        child.end()
        self._child = None
        self.deaths += not again
        raise _Died(how, code, trace, child.words)

    def _start(self) -> Child:
        silence = COMPILING + 2.0 * self._scene_seconds
        limits = Limits(self._scene_seconds, self._plan.memory, silence)
        child = Child(self._scratch / "words", self._environment, limits)
        child.begin(self._phases, partial(_watching_runner, self._plan.alone, str(self._scratch)))
        return child

    def _sentence(self, died: _Died, what: str) -> str:
        """Return what a child died of, in a sentence."""
        place = where(died.words)
        said = ENDINGS[died.how].said.format(
            what=what,
            place=f"{' in' if died.how == 'endless' else ', in'} {place}" if place else "",
            scene=self._scene_seconds,
            idle=IDLE,
            memory=self._plan.memory / (1 << 30),
            signal=_signal(-(died.code or 0)),
            code=died.code,
        )
        return f"{said} ({self._who})" + (f"\n{died.trace}" if died.trace else "")

    def _death(self, died: _Died, name: str, expected: str | None, last: Message) -> Result:
        """Return the result of a check whose child has died, or was ended; ``last`` is its last message: the
        last failure or, where it has seen none, the last scene."""
        check = check_named(name)
        dying = self._sentence(died, f"check {name!r}")
        status = ENDINGS[died.how].status
        seen = str(last.get("seen", ""))
        result = Result(name, check.sentence, status, int(last["count"]), 0.0, said=dying)
        scene: Scene | None = None
        if check.draws and "scene" in last:
            scene = pickle.loads(last["scene"])
        if seen:
            often = likely(name, seen) if self._plan.subject.pair is None and expected is None else ""
            said = f"{seen}\n(and while a smaller scene was looked for, {dying})"
            result = replace(result, status="failed", said=f"{said}\n{OFTEN}{often}" if often else said)
        elif status == "not judged":
            return replace(result, said="", reason=dying)
        elif scene is not None and self._plan.shrink and expected is None and died.how != "endless":
            scene = self._fewest(name, scene)
        if expected is not None:
            result = replace(result, status="xfailed", reason=expected)
        elif scene is not None and (check.compares or not seen):
            result = replace(result, verdict=self._verdict(check.replay or name, scene))
            if died.how == "endless" and not seen and not result.verdict:
                slow = f"{dying}; and so it is under kinetile's other phases"
                return replace(result, status="not judged", said="", reason=slow)
        if scene is None:
            return result
        return saved(replace(result, bodies=len(scene)), scene, self._plan.subject, self._plan.save_to)

    def _fewest(self, check: str, scene: Scene) -> Scene:
        """Leave out one body after the other where the process dies without it too, for as long as a check
        may take."""
        limit = deadline.Deadline(self._plan.seconds)
        body = 0
        with suppress(deadline.TimeIsUp):
            while body < len(scene):
                limit.check()
                fewer = without(scene, body)
                try:
                    self._call(_alone, check, fewer, again=True)
                    body += 1
                except _Died as died:
                    if ENDINGS[died.how].status == "not judged":
                        body += 1
                    else:
                        scene = fewer
        return scene

    def _verdict(self, check: str, scene: Scene) -> str:
        """Return which phase a death speaks against, by the same scene under the other phases; "" where a
        child does not survive these, either."""
        with suppress(_Died):
            return str(self._call(_verdict, check, scene, again=True))
        return ""


# In the child


def _watching_runner(plan: Plan, folder: str, subject: Subject, send: Send) -> Runner:
    """Return the runner of a plan, which sends what it sees; Hypothesis keeps its files in a folder, not in
    the working folder of the calling process."""
    from hypothesis.configuration import set_hypothesis_home_dir

    set_hypothesis_home_dir(str(Path(folder) / "hypothesis"))
    return Runner(replace(plan, subject=subject), watched=lambda each: _watched(each, subject, send))


def _watched(each: Check, subject: Subject, send: Send) -> Check:
    """Return a check that sends each scene before it runs on it, and again if it fails: so that the scene is
    known if the process does not survive it, and what was seen is not lost, however the process ends."""
    count = 0

    def run(tested: Subject, scene: Scene, reference: Reference) -> None:
        nonlocal count
        mine = tested.name == subject.name
        if mine:
            count += 1
            send({"count": count, "scene": pickle.dumps(scene)})
        try:
            each.run(tested, scene, reference)
        except Refused:
            raise
        except Exception as error:
            if mine:
                leave_without_memory(error)
                send({"seen": str(error), "count": count, "scene": pickle.dumps(scene)})
            raise

    return replace(each, run=run)


def _is_fresh(runner: Runner) -> bool:
    """Return whether there is something to compile."""
    return fresh(runner.subject)


def _alone(runner: Runner, check: str, scene: Scene) -> None:
    """Run a check on a scene, to see if the process survives."""
    CheckRun(check_named(check), runner.subject).holds(scene)


def _verdict(runner: Runner, check: str, scene: Scene) -> str:
    """Run a check under the other phases, to see which one its failure speaks against."""
    return verdict(check_named(check), runner.subject, scene)
