"""Judging a phase in processes of their own: whatever it does, the one that asked goes on.

A phase can crash the interpreter, run for ever or take all memory. So the checks run in a child with limits;
when it dies, the check that it was at is told what it died of, and a new child does the rest, up to
``DEATHS``.

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
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from kinetile.conformance.cases import not_saved, save_case
from kinetile.conformance.checks import check_named
from kinetile.conformance.checks.views import without
from kinetile.conformance.engine import EXAMPLES, Trial, Wishes
from kinetile.conformance.isolation.child import FAILING, LAST, Order, read_scene, work, write_scene
from kinetile.conformance.isolation.deaths import GIB, End, cause
from kinetile.conformance.isolation.processes import CAN_FORK, Child, afresh, forked
from kinetile.conformance.report import Report, Result
from kinetile.errors import BadOption, MissingExtra, PhaseError, Refused
from kinetile.plugin.registry import Provided
from kinetile.scene import Scene

__all__ = ["DEATHS", "GIB", "SECONDS", "check_isolated"]

DEATHS = 3
"""After so many deaths the checks that are left are not run."""

SECONDS = 120.0
"""How long a check of ``EXAMPLES`` scenes may take, cold compilation on a busy machine included."""

PROGRAM = "from kinetile.conformance.isolation.child import main; main()"
WORDS = "words"


def check_isolated(
    name: str, *, seconds: float = SECONDS, memory: int = 4 * GIB, **wishes: Unpack[Wishes]
) -> Report:
    """Judge a broad phase in child processes; return the report.

    As ``check_broad_phase``, and in addition:

    Args:
        name: the name under which it is registered.
        seconds: a check of up to ``EXAMPLES`` scenes that takes longer is ended; one of more has so much more
            time. If a scene that fails was found before, that is the result.
        memory: how many bytes a child may take beyond what it begins with, where the system can tell.
        wishes: what else can be wished for (``Wishes``).

    A check that the child did not survive has the status "died", and says in which check, of what, and as far
    as can be seen where. After ``DEATHS`` of these the rest is not run; the report's notes say so.

    Raises:
        UnknownName, BadOption: there is no such phase, or it has no such option.
        Refused: the phase cannot even do one resting body; or it was added in this process, and this system
            cannot fork.
        ValueError: a check is named that does not exist.
        MissingExtra: Hypothesis is not installed.
    """
    trial = Trial.of(name, wishes)
    if importlib.util.find_spec("hypothesis") is None:
        raise MissingExtra("the conformance kit", "hypothesis", "conformance")
    scratch = Path(tempfile.mkdtemp(prefix="kinetile-conformance-"))
    order = Order(
        name=name,
        options=trial.subject.options,
        checks=trial.checks,
        examples=trial.examples,
        expected=trial.expected,
        save_to=None if trial.save_to is None else str(trial.save_to.absolute()),
        shrink=trial.shrink,
        seed=trial.seed,
        memory=memory,
        scratch=str(scratch),
        tightness=trial.whole,
    )
    hearing = _Hearing(order, trial, seconds * max(1.0, trial.examples / EXAMPLES))
    try:
        hearing.run()
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return trial.report(hearing.results, hearing.tightness, hearing.notes)


class _Hearing:
    """A trial under way: what has come of which checks, and which are left."""

    def __init__(self, order: Order, trial: Trial, seconds: float) -> None:
        self.order = order
        self.results: list[Result] = []
        self.tightness: float | None = None
        self.notes: tuple[str, ...] = ()
        self._provided = trial.provided
        self._seconds = seconds
        self._on_result = trial.on_result
        self._left = list(order.checks)
        self._scratch = Path(order.scratch)
        self._forks = _must_fork(order, trial.provided)

    def run(self) -> None:
        """Run all checks, in one child after the other."""
        deaths = 0
        while self._left:
            self._forget()
            end = self._serve()
            if end is None:
                return
            deaths += 1
            result = self._death(end)
            if result.status == "died" and check_named(result.check).draws:
                result = replace(result, verdict=self._verdict(result))
            self._add(result)
            if deaths == DEATHS and self._left:
                self.notes = (f"not run, after {deaths} deaths: {', '.join(self._left)}",)
                return

    def _serve(self) -> End | None:
        """Listen to a child until it has done its checks (None) or has died."""
        fine = all(result.ok for result in self.results)
        order = replace(
            self.order,
            checks=tuple(self._left),
            tightness=self.order.tightness and fine,
            first=not self.results,
        )
        child = self._start(order)
        began = time.perf_counter()
        seen: str | None = None
        try:
            while True:
                left = began + self._seconds - time.perf_counter()
                message = child.hear(max(left, 0.0))
                if message is None:
                    return self._ended(End(child.ended(), time.perf_counter() - began, seen))
                if "error" in message:
                    raise (BadOption if message["error"] == "BadOption" else Refused)(message["said"])
                if "begin" in message:
                    began, seen = time.perf_counter(), None
                elif "seen" in message:
                    seen = str(message["seen"])
                elif "result" in message:
                    self._add(_result(message["result"]))
                    began, seen = time.perf_counter(), None
                elif "end" in message:
                    self.tightness = message["tightness"]
                    return self._ended(End(child.ended(), 0.0, None))
        except TimeoutError:
            child.end(ask_where=True)
            return self._ended(End(None, time.perf_counter() - began, seen, late=True))
        finally:
            child.end()

    def _ended(self, end: End) -> End | None:
        """Return an end where it is before its time."""
        return end if self._left else None

    def _verdict(self, result: Result) -> str:
        """Return whom a death speaks against: the same scene under the other phases, in one more child."""
        if not (self._scratch / LAST).exists():
            return ""
        child = self._start(replace(self.order, verdict=result.check))
        try:
            message = child.hear(self._seconds)
        except TimeoutError:
            return ""
        finally:
            child.end()
        return str(message["verdict"]) if message and "verdict" in message else ""

    def _fewest(self, check: str, scene: Scene) -> Scene:
        """Leave out one body after the other where the process dies without it too, for as long as a check
        may take."""
        until = time.perf_counter() + self._seconds
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
        child = self._start(replace(self.order, alone=check))
        try:
            return child.hear(self._seconds) is None
        except TimeoutError:
            return False
        finally:
            child.end()

    def _start(self, order: Order) -> Child:
        words = self._scratch / WORDS
        if self._forks:
            return forked(lambda tell: work(order, tell), words)
        return afresh(PROGRAM, order.as_dict(), words)

    def _add(self, result: Result) -> None:
        """Take in the result of the first check that is left."""
        self._left.remove(result.check)
        self.results.append(result)
        self._on_result(result)
        self._forget()

    def _forget(self) -> None:
        """Remove what a check has written down."""
        for name in (LAST, FAILING):
            (self._scratch / name).unlink(missing_ok=True)

    def _death(self, end: End) -> Result:
        """Return the result of a check whose child has died, or was ended."""
        check = check_named(self._left[0])
        failing = end.seen is not None
        scene, count = self._written(FAILING if failing else LAST)
        expected = self.order.expected.get(check.name)
        words = (self._scratch / WORDS).read_text(encoding="utf-8", errors="replace")
        who = f"broad phase {self.order.name!r} of {self._provided.source}"
        dying = cause(end, check.name, words, who, self.order.memory, self._seconds)
        shrink = self.order.shrink and expected is None and not (failing or end.late)
        if scene is not None and check.draws and shrink:
            scene = self._fewest(check.name, scene)
        said = dying
        if end.seen is not None:
            said = f"{end.seen}\n(and while a smaller scene was looked for, {dying})"
        case = None
        if self.order.save_to is not None and scene is not None and check.draws:
            path = Path(self.order.save_to) / f"{self.order.name}-{check.name}.toml"
            try:
                save_case(scene, path, check.name, self.order.name, said)
                case = path
            except OSError as error:
                said = f"{said}\n{not_saved('scene', error)}"
        status = "failed" if failing else "died"
        return Result(
            check.name,
            check.sentence,
            status if expected is None else "xfailed",
            count,
            end.seconds,
            said=said,
            reason=expected or "",
            bodies=len(scene) if scene is not None and check.draws else None,
            case=case,
        )

    def _written(self, name: str) -> tuple[Scene | None, int]:
        """Return a scene that the child has written down, and how many there were until then."""
        try:
            return read_scene(self._scratch / name)
        except (OSError, ValueError):
            return None, 0


def _must_fork(order: Order, provided: Provided) -> bool:
    """Whether the child has to be a fork; raise Refused where it would, and this system cannot."""
    try:
        portable = json.loads(json.dumps(order.options)) == order.options
    except (TypeError, ValueError):
        portable = False
    if provided.distribution is not None and portable:
        return False
    if not CAN_FORK:
        what = "options that are plain values" if provided.distribution else "a phase that is installed"
        raise Refused(f"on this system a process of its own is only for {what}: judge it in this process")
    return True


def _result(row: dict[str, Any]) -> Result:
    """Return a result as a child has sent it."""
    paths = {key: Path(row[key]) for key in ("case", "picture") if row[key] is not None}
    try:
        return Result(**row | paths)
    except TypeError as error:
        raise PhaseError(f"the child sent a result that is none: {error}") from error
