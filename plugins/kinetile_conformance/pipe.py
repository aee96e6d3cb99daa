"""Engines in any language: a program that reads lines and answers each of them is judged over a pipe.

One line of JSON goes each way, and the next one is sent when the last one is answered: so a full pipe stops
neither side. What is asked is one of the ``QUESTIONS``; the scenes are those of the kit's checks that compare
contacts, and a case on which an answer is wrong is minimised as there. An engine that does not keep to the
protocol is not judged: ``EngineError`` says what it did, and on which line.
"""

from __future__ import annotations

import json
import os
import queue
import shlex
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, Self, cast

from kinetile.errors import KinetileError
from kinetile.scene import Scene
from kinetile.scene.files import dumps_scene
from kinetile_conformance.cases import CONTACTS
from kinetile_conformance.checks import CHECKS
from kinetile_conformance.checks.check import Check
from kinetile_conformance.deadline import cpu_seconds, spent
from kinetile_conformance.drawing import Drawing
from kinetile_conformance.questions import QUESTIONS, Exchange, Question
from kinetile_conformance.reporting import Report, Result
from kinetile_conformance.runner import EXAMPLES, REDUCING

SECONDS = 10.0
"""Seconds by the clock that an engine has for a line."""

LONGEST, AHEAD = 2**26, 16
"""Bytes of the longest answer, and lines that are read before they are asked for."""

FREE = {"", "-in-a-scaled-swarm", "-of-shapes"}
IN_PLACES = FREE | {"-on-lattices", "-as-bodies-come-and-go"}
IN_RUNS = {"-with-turns", "-on-a-torus", "-in-a-swarm-of-shapes-on-a-torus", "-with-responses"}

ASKED = {
    "contacts": ("It gives the reference's contacts", "same-contacts", IN_PLACES | IN_RUNS),
    "pairs": ("It names every pair that touches, and no false one", "pairs", IN_PLACES),
    "casts": ("Two bodies meet when they should, within the distance", "casts", FREE),
}
"""For each question what is said of an engine, what the names of its checks begin with, and what those of the
kit's checks of contacts end with that have the scenes."""


class Judging(NamedTuple):
    """A check of engines: the question, the kit's check that has its scenes, and what it says of an
    engine."""

    asked: str
    scenes: Check
    sentence: str


def _judging() -> dict[str, Judging]:
    """Return the checks of engines by name."""
    found = {}
    for asked, (says, prefix, wanted) in ASKED.items():
        for each in CHECKS:
            suffix, strategy = each.name.removeprefix("same-contacts"), each.strategy
            if strategy and each.observation.name == "same-contacts" and suffix in wanted:
                found[prefix + suffix] = Judging(asked, each, f"{says}, {strategy.where}.")
    return found


JUDGING = _judging()
"""The checks of engines, by name."""


class EngineError(KinetileError, RuntimeError):
    """An engine does not start, ends early, gives no answer in time, or one that is none."""


class Engine:
    """A program that answers lines, one for one; its stderr is passed on.

    Args:
        command: the program and its arguments, as a shell splits them; no shell runs it.
        seconds: the limit for a line, by the clock.
    """

    def __init__(self, command: str, seconds: float = SECONDS) -> None:
        self.command = command
        self._seconds = seconds
        self.start()

    def start(self) -> None:
        """Start the program. It has a process group of its own, so that what it starts ends with it."""
        try:
            words = shlex.split(self.command)
            if not words:
                raise ValueError("it names no program")
            self._child = subprocess.Popen(
                words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0
            )
            self._to = cast(Any, self._child.stdin)
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            raise EngineError(f"--command {self.command!r} does not start: {why}") from error
        self._answers: queue.Queue[bytes] = queue.Queue(AHEAD)
        self._writer = threading.Thread()
        threading.Thread(target=self._read, args=(self._child.stdout, self._answers), daemon=True).start()

    @staticmethod
    def _read(stream: Any, answers: queue.Queue[bytes]) -> None:
        """Put the lines of a stream into a queue, and an empty one at its end; then close it."""
        with stream:
            while line := stream.readline(LONGEST):
                answers.put(line)
        answers.put(b"")

    def _write(self, line: bytes) -> None:
        """Send a line; where the program has ended, its output says so."""
        with suppress(OSError):
            self._to.write(line)
            self._to.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.end()

    def end(self) -> None:
        """End the program and what it has started."""
        self._kill()
        self._child.wait()
        if not self._writer.is_alive():  # what it has started in another session may hold its end
            with suppress(OSError):
                self._to.close()

    def _kill(self) -> None:
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGKILL)
        self._child.kill()

    def cpu_seconds(self) -> float | None:
        """Return the CPU seconds of the program, without what it has started; None where the system does not
        tell."""
        return cpu_seconds(self._child.pid)

    def peak_bytes(self) -> int | None:
        """Return the most memory that the program has had; None where the system does not tell."""
        with suppress(OSError, ValueError, StopIteration):
            lines = Path(f"/proc/{self._child.pid}/status").read_text(encoding="utf-8").splitlines()
            return 1024 * int(next(line for line in lines if line.startswith("VmHWM:")).split()[1])
        return None

    def answer(self, exchange: Exchange) -> Any:
        """Return the value of an engine's answer to a line, or why it refuses it, as a string; raise
        EngineError for any other answer, and for none."""
        line = self._exchanged(exchange.line)
        form = exchange.form
        try:
            found = form.read(line)
        except ValueError as error:
            shown = f"the engine answered {line[:80].decode(errors='replace')!r} ({error})"
            wanted = f'{{"{form.key}": {form.shown}}} or {{"refused": "reason"}}'
            raise EngineError(f"{shown}; expected {wanted}") from None
        return found.refused if "refused" in found.model_fields_set else found.value

    def _exchanged(self, line: bytes) -> bytes:
        """Send a line and return the one that comes back.

        The program may write before it has read all, and ending it need not close a pipe, which what it has
        started in another session may hold. So threads read and write, and this one waits for so long.
        """
        self._writer = threading.Thread(target=self._write, args=(line,), daemon=True)
        self._writer.start()
        try:
            answer = self._answers.get(timeout=self._seconds)
        except queue.Empty:
            self._kill()
            said = f"the engine gave no answer within {self._seconds:g} s (--scene-seconds)"
            raise EngineError(said) from None
        if len(answer) >= LONGEST:
            raise EngineError(f"the engine's answer has no end after {LONGEST:,} bytes")
        return answer if answer.endswith(b"\n") else self._no_answer(answer)

    def _no_answer(self, answer: bytes) -> NoReturn:
        """Raise EngineError, with how the program has closed its output."""
        how = "closed its output"
        with suppress(subprocess.TimeoutExpired):
            code = self._child.wait(1.0)
            how = f"ended with exit code {code}" if code >= 0 else f"ended by {signal.Signals(-code).name}"
        raise EngineError(f"the engine {how} {'within a line' if answer else 'without an answer'}")


@dataclass(frozen=True)
class EngineReport(Report):
    """All results of an engine; ``name`` is its command, ``asked`` the question, ``within`` the relative
    distance of times allowed, None where nothing is compared within one."""

    asked: str = "contacts"
    within: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the report, fit for JSON."""
        of_phases = ("broad_phase", "options", "narrow_phases", "distribution")
        kept = {key: value for key, value in super().as_dict().items() if key not in of_phases}
        return {"command": self.name, "asked": self.asked, "within": self.within} | kept

    @property
    def refuses_all(self) -> bool:
        """Whether the engine has refused every scene that it was given: it cannot be judged then."""
        return bool(self.results) and all(result.status == "skipped" for result in self.results)

    @property
    def ok(self) -> bool:
        """Whether the engine conforms."""
        return super().ok and not self.refuses_all

    @property
    def not_judged(self) -> str:
        """Why it is not judged."""
        return "it refuses every scene" if self.refuses_all else super().not_judged

    @property
    def head(self) -> str:
        """The line above the results."""
        exact = "exact ticks" if self.asked == "contacts" else self.asked
        how = exact if self.within is None else f"{self.asked}, times within {self.within:g}"
        return f"conformance kit {self.kit}: command {self.name!r}, {how}"

    def replays(self, case: Path) -> str:
        """Return the command that shows a failure again."""
        lines = case.with_suffix(".jsonl")
        sent = len(lines.read_text(encoding="utf-8").splitlines()) - 2  # the others are the two answers
        return f"head -n {sent} {lines} | {self.name}"


class _Judged:
    """An engine under one check: what it was shown, and the last case on which it failed."""

    def __init__(
        self, engine: Engine, name: str, question: Question, shown: Callable[[str, int], None]
    ) -> None:
        self.engine = engine
        self.name = name
        self.question = question
        self.count = self.refused = 0
        self.refusal = self.said = ""
        self.exchange: Exchange | None = None
        self.found: Any = None
        self._shown = shown

    def holds(self, scene: Scene) -> bool:
        """Return whether the engine is right about all cases of a scene, or refuses them."""
        return all(map(self.case_holds, self.question.cases(scene)))

    def case_holds(self, case: Any) -> bool:
        """Return whether the engine's answers to the lines of a case are right, or it refuses one."""
        self.count += 1
        self._shown(self.name, self.count)
        for exchange in self.question.exchanges(case):
            try:
                found = self.engine.answer(exchange)
            except EngineError as error:
                self.said, self.exchange, self.found = str(error), exchange, error
                raise
            if isinstance(found, str):
                self.refused += 1
                self.refusal = found
                return True
            said = exchange.judge(found)
            if said is not None:
                self.said, self.exchange, self.found = said, exchange, found
                return False
        return True

    @property
    def case(self) -> Any:
        """The last case on which it failed."""
        return self.exchange and self.exchange.case

    def minimise(self) -> None:
        """Search for a smaller case. Then a fresh process is given it alone: what an engine keeps from one
        case to the next shows there."""
        end = time.monotonic() + 3.0 * REDUCING  # the CPU time of the engine is not this process's
        self.question.smaller(
            self.case, lambda fewer: time.monotonic() < end and not self.case_holds(fewer), REDUCING
        )
        said, case = self.said, self.case
        self.engine.end()
        self.engine.start()
        if self.case_holds(case):
            said += "\n(not in a fresh process: the engine keeps something from one scene to the next)"
        self.said = said

    def saved(self, folder: Path) -> Path:
        """Save the lines that the engine was sent, with its last answer and the reference's, where there are
        any, and a scene as a file beside it; return the path."""
        path = folder / f"engine-{self.name}.jsonl"
        folder.mkdir(parents=True, exist_ok=True)
        lines = [each.line.decode() for each in self.question.exchanges(self.case)]
        if self.exchange and not isinstance(self.found, EngineError):
            values = self.found, self.exchange.right
            lines += [json.dumps({self.exchange.form.key: value}) + "\n" for value in values]
        path.write_text("".join(lines), encoding="utf-8")
        if not isinstance(self.case, Scene):
            return path
        said = "".join(f"# said: {line}\n" for line in self.said.splitlines())
        path = path.with_suffix(".toml")
        path.write_text(f"# engine: {self.engine.command}\n{said}{dumps_scene(self.case)}", encoding="utf-8")
        return path

    def result(self, drawing: Drawing, shrink: bool, save_to: Path | None) -> Result:
        """Run the check; return its result."""
        began = spent()
        judging = JUDGING[self.name]
        try:
            if drawing.scenes_fail(judging.scenes, self.holds) and shrink:
                self.minimise()
        except EngineError as error:
            where = f"; the scene is saved: {self.saved(save_to)}" if save_to and self.exchange else ""
            raise EngineError(f"{error} ({self.name}, scene {self.count}{where})") from error
        result = Result(self.name, judging.sentence, "passed", self.count, spent() - began)
        if self.said:
            case = self.saved(save_to) if save_to else None
            return replace(result, status="failed", said=self.said, bodies=len(self.case), case=case)
        if self.refused:
            whole = self.refused == self.count
            reason = f"it refuses {self.refused} of {self.count} scenes, such as: {self.refusal}"
            result = replace(result, status="skipped" if whole else "passed", reason=reason)
        sums = self.question.sums
        return replace(result, said=self.question.told.format(*sums)) if any(sums) else result


def check_engine(
    command: str,
    *,
    asked: str = "contacts",
    within: float | None = None,
    seconds: float = SECONDS,
    examples: int = EXAMPLES,
    checks: Sequence[str] | None = None,
    save_to: Path | None = None,
    shrink: bool = True,
    seed: int = 0,
    on_result: Callable[[Result], None] = lambda result: None,
    on_scene: Callable[[str, int], None] = lambda check, count: None,
) -> EngineReport:
    """Judge an engine over a pipe; return the report.

    ``asked`` is one of ``QUESTIONS``, ``within`` the distance of times, which casts need; ``checks`` are
    names of ``JUDGING``, None: all that ask so.

    Raises:
        EngineError: it does not start, or does not keep to the protocol.
    """
    began = time.perf_counter()
    drawing = Drawing(examples, seed)
    results: list[Result] = []
    names = [name for name, each in JUDGING.items() if each.asked == asked and name in (checks or JUDGING)]
    with Engine(command, seconds) as engine:
        for name in names:
            strategy = JUDGING[name].scenes.strategy
            question = QUESTIONS[asked](within, strategy.contacts if strategy else CONTACTS)
            judged = _Judged(engine, name, question, on_scene)
            results.append(judged.result(drawing, shrink, save_to))
            on_result(results[-1])
    took = time.perf_counter() - began
    return EngineReport(command, {}, "", tuple(results), seconds=took, asked=asked, within=within)
