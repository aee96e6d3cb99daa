"""A judgement of a broad phase, or of a program, for its author: the kit's checks, the benchmark of a scene,
the reference's contacts, and the table of faults that the kit is known to find. An interrupted judgement
keeps its results so far."""

import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from kinetile import Scene, load_scene, make_scene
from kinetile.errors import KinetileError, NotJudged, PhaseError, Refused, printable
from kinetile.instruments import compiled_by_default
from kinetile_accuracy.environment import environment
from kinetile_bench.user_scene import SceneRow, bench_scene
from kinetile_conformance.cases import REFERENCE, Subject
from kinetile_conformance.deadline import begin_scene
from kinetile_conformance.isolated import IsolatedRunner
from kinetile_conformance.pipe import EngineError, EngineReport, PipedEngine
from kinetile_conformance.questions import Contacts
from kinetile_conformance.reporting import KIT_VERSION, Report, Result
from kinetile_conformance.runner import EXAMPLES, JudgingPlan, Runner, unheard
from kinetile_conformance.strategies.changes import ended_at

FAULTS = Path(__file__).with_name("faults.json")
"""The faults among the project's own mutants that the kit finds, as measured by ``tests/mutants``."""

BEGINNING, RUN = 200, 0.1
"""The most contacts of a scene for a program; CPU seconds of one measurement, about."""

SCENES = {path.stem: path for path in sorted(Path(__file__).with_name("scenes").glob("*.toml"))}


def faults() -> dict[str, list[int]]:
    """Returns the number of faults that the kit finds, and of all, for each family in ``FAULTS``."""
    rows = json.loads(FAULTS.read_text(encoding="utf-8"))["faults"].values()
    found = Counter(row["family"] for row in rows if row["killed_by"] is not None)
    return {family: [found[family], of] for family, of in Counter(row["family"] for row in rows).items()}


@dataclass(frozen=True)
class Measured(SceneRow):
    """A phase or a program on the scene named ``of``, and its first difference from the reference."""

    of: str = ""
    differs: str | None = None
    process_bytes: int | None = None


@dataclass
class Judged:
    """A phase or a program: its report so far, its judge, the reason why it cannot be judged, and the
    measurements. Raises BadOption; any other fault of a phase will be its verdict."""

    report: Report
    judge: Callable[..., Report]
    error: str = ""
    done: bool = False
    rows: list[Measured] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not isinstance(self.report, EngineReport):
            alone = Subject(self.report.subject.name, self.report.subject.options)
            with suppress(NotJudged, PhaseError, Refused):
                alone.composition(make_scene("two-discs"))

    def run(self, on_result: Callable[[Result], None] = unheard, **how: Any) -> None:
        """Runs the checks; each result is in the report before it is announced."""

        def hear(result: Result) -> None:
            self.report = replace(self.report, results=(*self.report.results, result))
            on_result(result)

        self.report = self.judge(on_result=hear, **how)
        self.done = True

    @property
    def verdict(self) -> str:
        """The verdict in a few words."""
        if self.error:
            return "cannot be judged"
        if self.report.failed:
            return "the reference is in doubt" if self.report.in_doubt else "does not conform"
        conforms = self.done and self.report.ok and self.report.results
        return f"conforms{self.report.limits}" if conforms else "not judged"


@dataclass
class Judgement:
    """All judged phases and programs, side by side, with the options, and the machine."""

    judged: list[Judged]
    examples: int = EXAMPLES
    seed: int = 0
    checks: Sequence[str] | None = None
    repeats: int = 3
    save_to: Path | None = None
    status: str = "interrupted"
    kit: str = KIT_VERSION
    faults: Mapping[str, Sequence[int]] = field(default_factory=faults)
    made: Mapping[str, Any] = field(
        default_factory=lambda: {"date": time.strftime("%Y-%m-%d")} | environment()
    )

    @property
    def beside(self) -> Subject:
        """The reference, with the parts that are judged with all."""
        return self.judged[0].report.subject.under(REFERENCE)

    @property
    def exit_code(self) -> int:
        """The exit code as of ``conform``; of several the first of 1, 3, 2 (it cannot be judged), 4 and 0."""
        codes = [2 if each.error else each.report.exit_code for each in self.judged]
        return next((code for code in (1, 3, 2, 4) if code in codes), 0)

    def as_dict(self) -> dict[str, Any]:
        """Returns everything, fit for JSON."""
        judged = [
            {"label": each.report.label, "verdict": each.verdict, "error": each.error or None}
            | {"report": each.report.as_dict(), "measured": [vars(row) for row in each.rows]}
            for each in self.judged
        ]
        return vars(self) | {"judged": judged, "beside": [*self.beside.beside]}

    def run(self, show: Callable[[float | None, str], None]) -> None:
        """Judges all, then measures all; calls ``show`` with the progress, and the place."""
        how = {name: vars(self)[name] for name in ("examples", "seed", "checks", "save_to")}
        for each in self.judged:
            label = each.report.label
            try:
                each.run(on_scene=lambda check, n, of=label: show(None, f"{of}: {check}, {n:,}"), **how)
            except KinetileError as error:
                each.error = str(error)
        with ExitStack() as children, compiled_by_default(True):
            measures: list[tuple[Judged, Callable[[Scene, Any], Measured]]] = []
            for each in (each for each in self.judged if not each.error):
                report = each.report
                if not isinstance(report, EngineReport):
                    runner = children.enter_context(closing(IsolatedRunner(JudgingPlan(report.subject))))
                    measures.append((each, partial(runner.attempt, "a measurement", _phase_measured)))
                elif report.asked == "contacts":
                    measures.append((each, partial(_program_measured, report)))
            for at, (name, path) in enumerate(SCENES.items()):
                scene = self.beside.dressed(load_scene(path))
                contacts, fingerprint = _reference(self.beside, scene)
                runs: list[list[Measured]] = [[] for _ in measures]
                for (each, measure), rows in [*zip(measures, runs, strict=True)] * self.repeats:
                    # in turns, so that a slower machine slows all
                    show(at / len(SCENES), f"measuring {each.report.label}: {name}")
                    if all(row.ended_by is None for row in rows):
                        try:
                            rows.append(measure(scene, contacts))
                        except (PhaseError, EngineError) as error:
                            rows.append(Measured(each.report.label, str(error)))
                for (each, _), rows in zip(measures, runs, strict=True):
                    row = sorted(rows, key=lambda row: row.cpu_seconds or 0.0)[len(rows) // 2]
                    if row.fingerprint not in (None, fingerprint) and row.ended_by is None:
                        row = replace(row, differs="its contacts are not the reference's")
                    each.rows.append(replace(row, of=name))
        self.status = "complete"


def _program_measured(report: EngineReport, scene: Scene, contacts: Any) -> Measured:
    scene = ended_at(scene, float(contacts["time"][:BEGINNING].max(initial=scene.start)))
    exchange = Contacts(report.within).exchange(scene, _reference(Subject(REFERENCE, {}), scene)[0])
    with PipedEngine(report.label) as engine:
        program = engine.program
        began, found, ended = program.cpu_seconds(), engine.answer(exchange), program.cpu_seconds()
        most = program.peak_bytes()
    if isinstance(found, str | tuple):
        return Measured(report.label, found if isinstance(found, str) else f"it has {' or '.join(found)}")
    spent = ended - began if ended and began else None
    row = Measured(report.label, None, spent, contacts=len(found), process_bytes=most)
    rate = spent and len(found) / spent
    return replace(row, differs=exchange.judge(found), contacts_per_cpu_second=rate)


def _reference(subject: Subject, scene: Scene) -> tuple[Any, str]:
    sim = subject.reference.simulation(scene)
    sim.run()
    return sim.contacts, sim.fingerprint


def _phase_measured(runner: Runner, scene: Scene, contacts: Any) -> Measured:
    begin_scene()
    subject = runner.subject
    narrow = subject.narrow_phases(scene) if subject.narrow else None
    try:
        phases = [(subject.name, subject.options)]
        found = bench_scene(scene, phases, narrow_phases=narrow, repeats=1, seconds=RUN)
        return Measured(**vars(found.rows[0]))
    except Exception as error:  # a foreign phase may raise anything: it is the result
        return Measured(subject.label, printable(f"{type(error).__name__}: {error}"))
