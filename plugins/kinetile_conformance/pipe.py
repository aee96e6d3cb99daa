"""Engines in any language: a program that reads lines and answers each of them is judged over a pipe.

One line of JSON is sent each way, and the next one after the answer: so a full pipe stops neither side. The
question is one of the ``QUESTIONS``. An engine that breaks the protocol is not judged: ``EngineError`` names
the breach and the line.
"""

import json
import queue
import shlex
import signal
import time
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kinetile import Scene
from kinetile.errors import KinetileError, Refused
from kinetile.instruments import write_file
from kinetile_conformance.cases import CONTACTS, Subject, save_case
from kinetile_conformance.checks import CHECKS
from kinetile_conformance.checks.check import Check, Disagreement, Observation
from kinetile_conformance.deadline import spent
from kinetile_conformance.drawing import Drawing
from kinetile_conformance.processes import Program
from kinetile_conformance.questions import LEAST_SHARE, QUESTIONS, Exchange, Question, without
from kinetile_conformance.reporting import KIT_VERSION, Report, Result
from kinetile_conformance.runner import REDUCING, CheckRun, JudgingPlan, OnScene

SECONDS = 10.0
"""Seconds by the clock that an engine has for a line."""

LONGEST = 2**26
FREE = {"", "-in-a-scaled-swarm", "-of-shapes"}
IN_PLACES = FREE | {"-on-lattices", "-as-bodies-come-and-go"}
IN_RUNS = {"-with-turns", "-on-a-torus", "-in-a-swarm-of-shapes-on-a-torus", "-with-responses"}

ASKED = {
    "contacts": ("It gives the reference's contacts", "same-contacts", IN_PLACES | IN_RUNS),
    "pairs": ("It names every pair that touches, and no impossible one", "pairs", IN_PLACES),
    "casts": ("Two bodies meet when they should, within the distance", "casts", FREE),
}
"""For each question: its sentence, the prefix of the names of its checks, and suffixes of the kit's."""

SENT = {
    "": "arena mass discs",
    "-with-turns": "arena mass turns",
    "-as-bodies-come-and-go": "arena mass gravity commands discs",
    "-with-responses": "arena mass commands responses",
    "-on-lattices": "arena discs",
    "-in-a-scaled-swarm": "arena turns discs",
    "-on-a-torus": "arena periodic",
    "-of-shapes": "arena mass shapes turns boxes",
    "-in-a-swarm-of-shapes-on-a-torus": "arena mass periodic shapes responses",
}
"""The possible keys of ``Question.keys`` in lines of checks, by suffix."""


def _judging(says: str, prefix: str, wanted: set[str]) -> dict[str, Check]:
    asked = Observation(prefix, says, lambda case: None)
    of_contacts = [each for each in CHECKS if each.observation.name == "same-contacts"]
    drawn = [each for each in of_contacts if each.strategy and each.strategy.suffix in wanted]
    return {each.name: each for each in (replace(each, observation=asked, at_home=False) for each in drawn)}


JUDGING = {asked: _judging(*row) for asked, row in ASKED.items()}
"""The checks of engines by question and name; their observations are the question's."""


class EngineError(KinetileError, RuntimeError):
    """An engine does not start, ends early, gives no answer in time, or an invalid one."""


class PipedEngine(AbstractContextManager["PipedEngine"]):
    """A program that answers lines, one for one; its stderr is passed on. A command is split as by a shell,
    and no shell runs it; ``seconds`` is the limit for a line, by the clock."""

    def __init__(self, command: str, seconds: float = SECONDS) -> None:
        self.command = command
        self.refused: set[str] = set()
        self._seconds = seconds
        self.start()

    def start(self) -> None:
        """Starts the program."""
        try:
            words = shlex.split(self.command)
            if not words:
                raise ValueError("it names no program")
            self.program = Program(words, lambda stream: stream.readline(LONGEST))
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            raise EngineError(f"--command {self.command!r} does not start: {why}") from error

    def __exit__(self, *error: object) -> None:
        self.program.end()

    def answer(self, exchange: Exchange) -> Any:
        """Returns the value of an engine's answer to a line, or its reason to refuse it, as ``Form.read``."""
        self.program.send(exchange.line)
        try:
            line: bytes = self.program.came.get(timeout=self._seconds) or b""
        except queue.Empty:
            self.program.end()
            text = f"the engine gave no answer within {self._seconds:g} s (--scene-seconds)"
            raise EngineError(text) from None
        if len(line) >= LONGEST:
            raise EngineError(f"the engine's answer has no end after {LONGEST:,} bytes")
        if not line.endswith(b"\n"):
            code, how = self.program.exit_code(), "closed its output"
            if code is not None:
                how = f"ended {f'with exit code {code}' if code >= 0 else f'by {signal.Signals(-code).name}'}"
            raise EngineError(f"the engine {how} {'within a line' if line else 'without an answer'}")
        form = exchange.form
        try:
            return form.read(line)
        except ValueError as error:
            shown = f"the engine answered {line[:80].decode(errors='replace')!r} ({error})"
            wanted = f'{{"{form.key}": {form.shown}}} or {{"refused": "reason"}}'
            raise EngineError(f"{shown}; expected {wanted}") from None


@dataclass(frozen=True)
class EngineReport(Report):
    """All results of an engine; the ``subject`` has its command as the name. ``asked`` is the question,
    ``within`` the allowed relative distance of times, None for exact comparisons."""

    asked: str = "contacts"
    within: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Returns the report, fit for JSON."""
        of_phases = ("broad_phase", "options", "narrow_phases", "response", "distribution")
        kept = {key: value for key, value in super().as_dict().items() if key not in of_phases}
        how = {"asked": self.asked, "within": self.within, "untried": self.untried}
        return {"command": self.subject.name} | how | kept

    @property
    def not_judged(self) -> str:
        """Why it is not judged: an engine that has refused every scene cannot be."""
        if self.results and all(result.status == "skipped" for result in self.results):
            return "it refuses every scene"
        return super().not_judged

    @property
    def untried(self) -> list[str]:
        """The keys of its checks' scenes, or lines, without any answer of the engine."""
        suffixes = [each.check.removeprefix(ASKED[self.asked][1]) for each in self.results]
        sent = {key for suffix in suffixes for key in SENT[suffix].split()}
        tried = {key for result in self.results for key in result.asked}
        return [key for key in QUESTIONS[self.asked].keys if key in sent - tried]

    @property
    def limits(self) -> str:
        """The part that the verdict does not cover."""
        done, of = len(self.results), len(JUDGING[self.asked])
        some = f", by {done} of {of} checks" if done < of else ""
        untried = f", but for {', '.join(self.untried)}: no such line was answered" if self.untried else ""
        return some + untried

    @property
    def head(self) -> str:
        """The line above the results."""
        exact = "exact ticks" if self.asked == "contacts" else self.asked
        how = exact if self.within is None else f"{self.asked}, times within {self.within:g}"
        return f"conformance kit {KIT_VERSION}: command {self.label!r}, {how}"

    def replays(self, case: Path) -> str:
        """Returns the command that shows a failure again."""
        lines = case.with_suffix(".jsonl")
        sent = len(lines.read_text(encoding="utf-8").splitlines()) - 2  # the others are the two answers
        return f"head -n {sent} {lines} | {self.label}"


class _EngineRun(CheckRun):
    """An engine under one check, on cases of a question. ``asked`` has the keys of lines that it answered."""

    failures = (Disagreement,)  # any other error is of the engine's protocol, or of the kit

    def __init__(self, each: Check, engine: PipedEngine, question: Question, on_scene: OnScene) -> None:
        super().__init__(
            each, Subject(engine.command, {}), observe=lambda count, *_: on_scene(each.name, count)
        )
        self.engine = engine
        self.question = question
        self.wrong: Any = None
        self.found: Any = None
        self.asked: dict[str, None] = {}

    def look(self, case: Any) -> None:
        """Raises Disagreement unless the answers to a case, without keys that are refused, are right."""
        case = without(case, self.engine.refused)
        for exchange in self.question.exchanges(case):
            try:
                found = self.engine.answer(exchange)
            except EngineError:
                self.wrong, self.found = exchange, None
                raise
            there = [key for key in self.question.keys if f'"{key}":'.encode() in exchange.line]
            if isinstance(found, tuple):
                if not found or not {*found}.issubset(there):
                    self.wrong, self.found = exchange, None
                    what = f"refuses {[*found]}; expected keys that the line has, of {there}"
                    raise EngineError(f'the engine {what}, or {{"refused": "reason"}}')
                self.engine.refused |= {*found}
                if without(case, found) != case:
                    return self.look(case)
                found = f"it has {' or '.join(found)}"
            if isinstance(found, str):
                raise Refused(found)
            self.asked |= dict.fromkeys(there)
            text = exchange.judge(found)
            if text is not None:
                self.wrong, self.found = exchange, {exchange.form.key: found}
                raise Disagreement(text)

    def minimise(self) -> None:
        """Searches for a smaller case, and gives it to a fresh process, without state from before."""
        end = time.monotonic() + 3.0 * REDUCING  # this process does not have the engine's CPU time

        def fails(case: Any) -> bool:
            return time.monotonic() < end and not self.holds(case)

        self.question.smaller(self.wrong.case, fails, REDUCING)
        text = self.message
        self.engine.program.end()
        self.engine.start()
        if self.holds(self.wrong.case):
            text = f"{text}\n(not in a fresh process: the engine keeps something from one scene to the next)"
        self.message = text

    def saved(self, text: str, folder: Path) -> Path:
        """Saves the lines sent to the engine, both answers, and a scene; returns the path."""
        path, case = folder / f"engine-{self.each.name}.jsonl", self.wrong.case
        folder.mkdir(parents=True, exist_ok=True)
        lines = [each.line.decode() for each in self.question.exchanges(case)]
        if self.found is not None:
            right = {self.wrong.form.key: self.wrong.right}
            lines += [json.dumps(value) + "\n" for value in (self.found, right)]
        write_file(path, "".join(lines))
        if isinstance(case, Scene):
            path = path.with_suffix(".toml")
            save_case(case, path, text, self.subject)
        return path


class EngineRunner:
    """Runs checks on an engine: ``asked`` is one of ``QUESTIONS``, ``within`` the distance of times, and
    ``seconds`` the limit for a line, by the clock."""

    deaths = 0

    def __init__(
        self, plan: JudgingPlan, asked: str, within: float | None, seconds: float, on_scene: OnScene
    ) -> None:
        self._plan = plan
        self._on_scene = on_scene
        self._asked, self._within = asked, within
        self._drawing = Drawing(plan.examples, plan.seed)
        self._engine = PipedEngine(plan.subject.name, seconds)

    def close(self) -> None:
        """Ends the program."""
        self._engine.program.end()

    def run(self, name: str) -> Result:
        """Runs the check of a name and returns its result."""
        began, plan, each = spent(), self._plan, JUDGING[self._asked][name]
        most = each.strategy.contacts if each.strategy else CONTACTS
        question = QUESTIONS[self._asked](self._within, most)
        run = _EngineRun(each, self._engine, question, self._on_scene)
        scenes = (scene for scene in self._drawing.scenes(each) if isinstance(scene, Scene))
        try:
            if not all(run.holds(case) for scene in scenes for case in question.cases(scene)) and plan.shrink:
                run.minimise()
        except EngineError as error:
            folder = plan.save_to if run.wrong else None
            where = f"; the scene is saved: {run.saved(str(error), folder)}" if folder else ""
            raise EngineError(f"{error} ({name}, scene {run.count}{where})") from error
        result = Result(name, each.sentence, "passed", run.count, spent() - began, asked=(*run.asked,))
        if run.message is not None:
            case = run.saved(run.message, plan.save_to) if plan.save_to else None
            return replace(result, status="failed", said=run.message, bodies=len(run.wrong.case), case=case)
        if run.refused:
            whole = run.refused == run.count
            reason = f"it refuses {run.refused} of {run.count} scenes, such as: {run.refusal}"
            result = replace(result, status="skipped" if whole else "passed", reason=reason)
        some, of = question.sums
        share = some / of if some and self._asked == "contacts" else float(some > 0)
        early = ", before errors have grown" if some < of else ""
        result = replace(result, said=question.told.format(some, of, share, early)) if of else result
        if run.refused < run.count and share < LEAST_SHARE:
            reason = "nothing in its scenes is compared: draw more (--examples)"
            if of and self._asked == "contacts":
                reason = f"less than {LEAST_SHARE:.0%} of its contacts could be compared"
            result = replace(result, status="not judged", reason=reason)
        return result
