"""The isolated runner: a ``Runner`` in a child process with limits, since a phase can crash the interpreter,
run for ever or use all memory. If a child dies, the result of its present check is the cause, or an earlier
failure, and a new child runs the other checks."""

import pickle
import re
import signal
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import kinetile
from kinetile import Scene
from kinetile.errors import PhaseError
from kinetile.instruments import NOTHING_IS_COMPILED, compiled_by_default, is_library
from kinetile_conformance import deadline
from kinetile_conformance.cases import Subject, provided
from kinetile_conformance.checks import FIRST, check_named
from kinetile_conformance.drawing import Search, by_number, leave_out
from kinetile_conformance.processes import IDLE, Child, Died, Hear, Message, leave_without_memory
from kinetile_conformance.reporting import Result, diagnosed, saved
from kinetile_conformance.runner import JudgingPlan, OnScene, Runner, unheard
from kinetile_conformance.strategies.changes import only_bodies
from kinetile_conformance.strategies.gallery import smallest

DEATHS = 3
"""The most deaths; after them no further checks are run."""

FEW = 12
"""Scenes of a check that run as Python first: they show beginners' errors within some seconds."""

ENDINGS = {
    "endless": ("died", "an endless loop{place}, in {what}: {scene:g} CPU s, and no end of one scene"),
    "idle": (
        "not judged",
        "nothing was heard and no CPU time used for {idle:g} s in {what}{place}: does it wait for something?",
    ),
    "memory": ("died", "out of memory in {what}: it asked for more than {memory:.3g} GiB"),
    "killed": ("not judged", "the process was ended from outside, by {signal}, in {what}"),
    "signal": ("died", "the process died of {signal} in {what}{place}"),
    "exit": ("died", "the process ended itself with status {code} in {what}{place}"),
    "closed": ("died", "the process fell silent in {what}"),
    "error": ("not judged", "an error of the kit itself, not of the phase, in {what}"),
}
"""By ``Died.how``: the status of a check that has not failed before, and a sentence."""

FRAME = re.compile(r'^  File "(?P<file>.*)", line (?P<line>\d+) in (?P<function>.*)$')
OWN = Path(str(kinetile.__file__)).parent
_SIGNALS = {int(each): each.name for each in signal.Signals}


def where(words: str) -> str:
    """Returns the place of a process's death by the stack that ``faulthandler`` has written: the innermost
    place outside of libraries, such as "arrange (my_phase.py, line 12)", or "a compiled hook"; or ""."""
    for thread in re.split(r"^(?:Current t|T)hread .*$", words, flags=re.MULTILINE)[1:]:
        frames = [found for line in thread.splitlines() if (found := FRAME.match(line))]
        if any(frame["function"] == "_listen" for frame in frames):
            continue
        for frame in frames:
            path = Path(frame["file"])
            if is_library(path):
                continue
            if path.parent == OWN / "kernel" / "compiled":
                compiled = frame["function"] in ("__call__", "run_bound")
                return "a compiled hook" if compiled else "the compiler"
            return f"{frame['function']} ({path.name}, line {frame['line']})"
    return ""


class IsolatedRunner:
    """Runs checks on one phase in child processes, or, if the plan says so, in this one; ``close`` ends
    them. ``on_scene`` is called with the name of a check and its number of scenes so far."""

    def __init__(self, plan: JudgingPlan, on_scene: OnScene = unheard) -> None:
        self.deaths = 0
        self._plan = plan
        self._on_scene = on_scene
        self._here = Runner(plan) if plan.in_process else None
        self._scene_seconds = deadline.SCENE_SECONDS
        self._child: Child | None = None
        self._known: dict[str, Result] = {}
        self._loaded: set[bool] = set()

    def close(self) -> None:
        """Ends the child."""
        if self._child is not None:
            self._child.end()
            self._child = None

    def begin(self, names: Sequence[str]) -> Sequence[str]:
        """Runs some checks, if in FIRST, as Python on few scenes; returns the one that fails; ``run`` then
        gives its result. If none fails, compiles the phase, and returns all."""
        self._load(compiled=False)
        for name in [name for name in FIRST if name in names]:
            with compiled_by_default(False):
                result = self._run(name, None if NOTHING_IS_COMPILED else FEW)
            fails = result.status in ("failed", "died")
            if fails or NOTHING_IS_COMPILED or check_named(name).strategy is None:
                self._known[name] = result
            if fails:
                return [name]
        self.deaths = 0
        self._load(compiled=True)
        return names

    def _load(self, compiled: bool) -> None:
        """Loads and runs the phase once; if the process dies, the checks report the cause."""
        with suppress(Died), compiled_by_default(compiled):
            if compiled not in self._loaded:
                self._call(Runner.smoke_test)
            self._loaded.add(compiled)

    def run(self, name: str) -> Result:
        """Runs the check of a name, compiled, unless ``begin`` has decided it."""
        with compiled_by_default(True):
            return self._known.pop(name, None) or self._run(name)

    def _run(self, name: str, most: int | None = None) -> Result:
        """Runs the check of a name; while the child dies, runs it again on fewer bodies."""
        last: Message = {"count": 0}
        failed: Message = {}

        def hear(message: Message) -> None:
            if "seen" in message:
                failed.update(message)
            elif "count" in message:
                last.update(message)
                self._on_scene(name, message["count"])

        began = time.perf_counter()
        try:
            return cast(Result, self._call(Runner.run, name, most, hear=hear))
        except Died as died:
            self.deaths += 1
            result = self._death(died, name, failed or last)
            return replace(result, seconds=time.perf_counter() - began)

    def attempt(self, what: str, function: Callable[..., Any], *arguments: Any) -> Any:
        """Returns the value of a function of the runner; raises PhaseError if the child dies."""
        try:
            return self._call(function, *arguments)
        except Died as died:
            raise PhaseError(self._sentence(died, what)) from died

    def _call(self, function: Callable[..., Any], *arguments: Any, hear: Hear = unheard) -> Any:
        if self._here is not None:
            return function(self._here, *arguments)
        if self._child is None:
            make = partial(_runner, self._plan, self._scene_seconds)
            self._child = Child(self._plan.subject, make)
        try:
            return self._child.call(function, *arguments, hear=hear)
        except Died:
            self._child = None
            raise

    def _sentence(self, died: Died, what: str) -> str:
        place = where(died.words)
        text = ENDINGS[died.how][1].format(
            what=what,
            place=f"{' in' if died.how == 'endless' else ', in'} {place}" if place else "",
            scene=self._scene_seconds,
            idle=IDLE,
            memory=self._plan.memory / (1 << 30),
            signal=_SIGNALS.get(-(died.code or 0), f"signal {-(died.code or 0)}"),
            code=died.code,
        )
        phases = (f"{each.kind} {each.spec.name!r} of {each.source}" for each in provided(self._plan.subject))
        return f"{text} ({' with '.join(phases)})" + (f"\n{died.trace}" if died.trace else "")

    def _death(self, died: Died, name: str, last: Message) -> Result:
        """Returns the result of a check whose child has died; ``last`` is its last failure, or scene."""
        check = check_named(name)
        dying = self._sentence(died, f"check {name!r}")
        status, _ = ENDINGS[died.how]
        seen = str(last.get("seen", ""))
        result = Result(name, check.sentence, status, int(last["count"]), 0.0, said=dying)
        scene = pickle.loads(last["scene"]) if check.strategy and "scene" in last else None
        if seen:
            lines = [seen, f"(and while a smaller scene was looked for, {dying})"]
            lines += diagnosed(name, seen, self._plan.subject)
            result = replace(result, status="failed", said="\n".join(lines))
        elif status == "not judged":
            return replace(result, said="", reason=dying)
        elif died.how == "endless":
            few = f"{self._scene_seconds:g} CPU s are too few for it, in check {name!r}"
            self._scene_seconds *= deadline.LONGER
            is_slow = self._survives(name, scene or smallest())
            self.close()  # this child has the longer limit
            self._scene_seconds /= deadline.LONGER
            if is_slow:
                return replace(result, status="not judged", said="", reason=f"{few}; it comes to an end")
        elif scene is not None and self._plan.shrink:
            search = Search(scene, lambda fewer: not self._survives(name, fewer), self._plan.seconds)
            leave_out(search, by_number, only_bodies, 1)
            scene = search.scene
        if scene is None:
            return result
        if self._plan.explains and (check.observation.compares or not seen):
            with suppress(Died):  # under the other phases, too
                verdict = self._call(Runner.verdict, check.replay or name, scene)
                result = replace(result, verdict=verdict)
            if died.how == "endless" and not seen and not result.verdict:
                slow = f"{dying}; and so it is under kinetile's other phases"
                return replace(result, status="not judged", said="", reason=slow)
        return saved(replace(result, bodies=len(scene)), scene, self._plan.subject, self._plan.save_to)

    def _survives(self, check: str, scene: Scene) -> bool:
        """Returns True if a child survives a check on a scene, or ends for another reason."""
        try:
            self._call(Runner.holds, check, scene)
        except Died as died:
            return ENDINGS[died.how][0] == "not judged"
        return True


def _runner(plan: JudgingPlan, scene_seconds: float, subject: Subject, send: Hear) -> Runner:
    """Sets the limits of a plan, and returns its runner. The runner sends each scene before it runs it, and
    again if it fails, so no failure is lost if the process dies."""
    deadline.keep_limits(scene_seconds, plan.memory)

    def observe(count: int, scene: Scene, error: Exception | None) -> None:
        message = {"count": count, "scene": pickle.dumps(scene)}
        if error is not None:
            leave_without_memory(error)
            message["seen"] = str(error)
        send(message)

    return Runner(replace(plan, subject=subject), observe)
