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
import signal
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from kinetile._registry import Provided, registry
from kinetile.conformance.cases import save_case
from kinetile.conformance.checks import CHECKS, check_named
from kinetile.conformance.child import FAILING, LAST, NO_MEMORY, Order, read_scene, work
from kinetile.conformance.engine import EXAMPLES
from kinetile.conformance.processes import CAN_FORK, Child, afresh, forked
from kinetile.conformance.report import Report, Result
from kinetile.conformance.stacks import COMPILER, where
from kinetile.errors import BadOption, MissingExtra, PhaseError, Refused
from kinetile.scene import Scene

__all__ = ["DEATHS", "GIB", "SECONDS", "check_isolated"]

DEATHS = 3
"""After so many deaths the checks that are left are not run."""

GIB = 1 << 30
SECONDS = 120.0
PROGRAM = "from kinetile.conformance.child import main; main()"
WORDS = "words"


def check_isolated(
    name: str,
    *,
    options: Mapping[str, Any] | None = None,
    examples: int = EXAMPLES,
    checks: Sequence[str] | None = None,
    expected_failures: Mapping[str, str] | None = None,
    save_to: Path | None = None,
    shrink: bool = True,
    seed: int = 0,
    on_result: Callable[[Result], None] | None = None,
    seconds: float = SECONDS,
    memory: int = 4 * GIB,
) -> Report:
    """Judge a broad phase in child processes; return the report.

    As ``check_broad_phase``, and in addition:

    Args:
        seconds: a check that takes longer is ended. If a scene that fails was found before, that is the
            result.
        memory: how many bytes a child may take beyond what it begins with, where the system can tell.

    A check that the child did not survive has the status "died", and says in which check, of what, and as far
    as can be seen where. After ``DEATHS`` of these the rest is not run; the report's notes say so.

    Raises:
        UnknownName, BadOption: there is no such phase, or it has no such option.
        Refused: the phase cannot even do one resting body; or it was added in this process, and this system
            cannot fork.
        ValueError: a check is named that does not exist.
        MissingExtra: Hypothesis is not installed.
    """
    began = time.perf_counter()
    expected = dict(expected_failures or {})
    for known in [*expected, *(checks or ())]:
        check_named(known)
    if importlib.util.find_spec("hypothesis") is None:
        raise MissingExtra("the conformance kit", "hypothesis", "conformance")
    provided = registry().provided("broad phase", name)
    scratch = Path(tempfile.mkdtemp(prefix="kinetile-conformance-"))
    order = Order(
        name=name,
        options=dict(options or {}),
        checks=tuple([each.name for each in CHECKS] if checks is None else checks),
        examples=examples,
        expected=expected,
        save_to=None if save_to is None else str(save_to.absolute()),
        shrink=shrink,
        seed=seed,
        memory=memory,
        scratch=str(scratch),
        tightness=checks is None,
    )
    trial = _Trial(order, provided, seconds, on_result or (lambda result: None))
    try:
        trial.run()
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return Report(
        name=name,
        options=order.options,
        distribution=f"{provided.distribution or 'this process'} {provided.version or ''}".strip(),
        results=tuple(trial.results),
        tightness=trial.tightness,
        seconds=time.perf_counter() - began,
        notes=trial.notes,
    )


class _Trial:
    """A trial under way: what has come of which checks, and which are left."""

    def __init__(
        self, order: Order, provided: Provided, seconds: float, on_result: Callable[[Result], None]
    ) -> None:
        self.order = order
        self.results: list[Result] = []
        self.tightness: float | None = None
        self.notes: tuple[str, ...] = ()
        self._provided = provided
        self._seconds = seconds
        self._on_result = on_result
        self._left = list(order.checks)
        self._scratch = Path(order.scratch)
        self._forks = _must_fork(order, provided)

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

    def _serve(self) -> _End | None:
        """Listen to a child until it has done its checks (None) or has died."""
        fine = all(result.ok for result in self.results)
        order = replace(self.order, checks=tuple(self._left), tightness=self.order.tightness and fine)
        child = self._start(order)
        began = time.perf_counter()
        seen: str | None = None
        try:
            while True:
                left = began + self._seconds - time.perf_counter()
                message = child.hear(max(left, 0.0))
                if message is None:
                    return self._ended(_End(child.ended(), time.perf_counter() - began, seen))
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
                    return self._ended(_End(child.ended(), 0.0, None))
        except TimeoutError:
            child.end(ask_where=True)
            return self._ended(_End(None, time.perf_counter() - began, seen, late=True))
        finally:
            child.end()

    def _ended(self, end: _End) -> _End | None:
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

    def _death(self, end: _End) -> Result:
        """Return the result of a check whose child has died, or was ended."""
        check = check_named(self._left[0])
        failing = end.seen is not None
        scene, count = self._written(FAILING if failing else LAST)
        expected = self.order.expected.get(check.name)
        words = (self._scratch / WORDS).read_text(encoding="utf-8", errors="replace")
        dying = self._dying(end, check.name, words)
        said = dying
        if end.seen is not None:
            said = f"{end.seen}\n(and while a smaller scene was looked for, {dying})"
        case = None
        if self.order.save_to is not None and scene is not None and check.draws:
            case = Path(self.order.save_to) / f"{self.order.name}-{check.name}.toml"
            save_case(scene, case, check.name, self.order.name, said)
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

    def _dying(self, end: _End, check: str, words: str) -> str:
        """Return in a sentence what a child died of."""
        who = f"broad phase {self.order.name!r} of {self._provided.source}"
        place = where(words)
        limit = f"it asked for more than {self.order.memory / GIB:.3g} GiB"
        if end.late:
            guess = f": an endless loop in {place}?" if place else ""
            if place == COMPILER:
                guess = ": it was still being compiled"
            return f"no answer within {self._seconds:g} s in check {check!r}{guess} ({who})"
        if end.code == NO_MEMORY or "out of memory" in words.lower() or "MemoryError" in words:
            return f"out of memory in check {check!r}: {limit} ({who})"
        if end.code is None:
            return f"the process fell silent in check {check!r} ({who})"
        near = f", in {place}" if place else ""
        if end.code < 0:
            return f"the process died of {_signal(-end.code)} in check {check!r}{near} ({who})"
        return f"the process ended itself with status {end.code} in check {check!r}{near} ({who})"


class _End:
    """How a child ended: its exit code, the seconds of its last check, and what had failed in that."""

    def __init__(self, code: int | None, seconds: float, seen: str | None, late: bool = False) -> None:
        self.code = code
        self.seconds = seconds
        self.seen = seen
        self.late = late


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


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
