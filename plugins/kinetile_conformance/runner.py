"""The runner: runs checks on scenes, one check after the other, minimises failures, and gives a verdict.

``Runner`` works in this process; ``kinetile_conformance.isolated`` runs one in a child process. ``Options``
are the choices of a caller; a ``JudgingPlan`` has them checked and completed.
"""

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import count, islice
from pathlib import Path
from typing import Any, ClassVar, TypedDict

from kinetile import Response, Scene, Settings, box, capsule, registry
from kinetile.errors import BadOption, KinetileError, MissingExtra, NotJudged, Refused, UnknownName, one_of
from kinetile.instruments import as_python, check_options, composition_of, place_of, read_narrow_phases
from kinetile_conformance.cases import CONTACTS, REFERENCE, RunOutcome, Subject, outcome, provided
from kinetile_conformance.checks import CHECKS, check_named
from kinetile_conformance.checks.check import Check, Disagreement, DoesNotApply, Reference
from kinetile_conformance.deadline import SECONDS, TimeIsUp, begin_scene, spent
from kinetile_conformance.drawing import Drawing, reduced
from kinetile_conformance.reporting import Report, Result, diagnosed, saved
from kinetile_conformance.strategies.kinds import acceptable
from kinetile_conformance.watched_hooks import unmarked

EXAMPLES = 100
"""Scenes drawn for each check by default."""

MEMORY, REDUCING, QUICKLY = 4 << 30, 20.0, 3.0
"""Bytes that a child may take by default, and CPU seconds for minimising a scene of hundreds of bodies, and
as Python."""

KEPT, AGAIN = 400, 5
"""Kept outcomes of the reference, for checks that share scenes; repetitions of a failed check."""


OnScene = Callable[[str, int], None]
"""Called with the name of a check and its number of scenes so far."""


def unheard(*_: object) -> None:
    """Default callback: does nothing."""


BOX = (4.0, 4.0)
_TWO = Scene(
    [[1.0, 1.0], [3.0, 1.25]], [[1.0, 0.5], [-1.0, 0.0]], 0.5, arena=BOX, settings=Settings(until=2.0)
)
_STILL = _TWO.replace(velocity=[[1.0, 0.5], [0.0, 0.0]], mass=[1.0, math.inf])
SAMPLES = (
    *(_TWO.replace(radius=[0.5, least], arena=arena) for arena in (BOX, None) for least in (0.5, 2**-6)),
    *(_STILL.replace(shape=each) for each in (capsule((-0.25, 0.0), (0.25, 0.0), 0.25), box(1.0, 1.0))),
)
"""Scenes of two bodies before all checks: discs, capsules, and squares."""


SLIPS = NameError, AttributeError, TypeError
"""Errors of a hook that the compiler raises, and the interpreter at the line."""


class Options(TypedDict, total=False):
    """Options of a conformance run, common to Python, command line and pytest.

    Attributes:
        options: the phase's options.
        narrow_phases: narrow phases that are judged with it, by name, perhaps with options; each replaces the
            usual one of its role.
        response: a response that is judged with it: for all contacts without a response in the scene.
        examples: scenes drawn for each check; ``EXAMPLES``.
        checks: names of the checks to run; None: all that apply.
        save_to: a folder for failing scenes, as TOML; None: they are not saved.
        shrink: True to search for the smallest failing scene; True.
        seed: the seed of the drawing; the same seed draws the same scenes; 0.
        seconds: CPU seconds, without compiling, for a check of up to ``EXAMPLES`` scenes, in proportion for
            more; ``SECONDS``.
        in_process: judge in the calling process, for a debugger: then nothing ends an endless loop in a hook,
            and a crash is one of this process; False.
        memory: bytes that a child may add to its memory at the start, if the system can limit it; ``MEMORY``.
        on_result: called after each check, with its result.
        on_scene: called for each scene that a child or a program judges (``OnScene``).
    """

    options: Mapping[str, Any] | None
    narrow_phases: Mapping[str, Mapping[str, Any]] | Sequence[str] | None
    response: Response | str | None
    examples: int
    checks: Sequence[str] | None
    save_to: str | os.PathLike[str] | None
    shrink: bool
    seed: int
    seconds: float | None
    in_process: bool
    memory: int
    on_result: Callable[[Result], None]
    on_scene: OnScene


OF_OTHERS = {"options", "narrow_phases", "response", "on_result", "on_scene"}
"""The options that make the phases under test, and the options that are called."""


@dataclass(frozen=True)
class JudgingPlan:
    """The options of a conformance run, checked and completed, and the phases under test. ``seconds`` are for
    one check; if ``explains`` is true, a failure is repeated, and tried under other phases."""

    subject: Subject
    checks: tuple[str, ...] = ()
    examples: int = EXAMPLES
    save_to: Path | None = None
    shrink: bool = True
    explains: bool = True
    seed: int = 0
    seconds: float = SECONDS
    in_process: bool = False
    memory: int = MEMORY

    @classmethod
    def of(
        cls, subject: Subject, options: Mapping[str, Any], call: str = "check_broad_phase"
    ) -> "JudgingPlan":
        """Returns the plan for phases with these ``Options``, except those in ``OF_OTHERS``. Raises BadOption
        for an unknown option of the ``call``, or no examples."""
        known = [*Options.__annotations__, "explains"]
        for odd in options.keys() - {*known}:
            raise BadOption(f"{call} has no argument {odd!r}; expected {one_of(odd, known)}")
        given = {key: value for key, value in options.items() if value is not None and key not in OF_OTHERS}
        checks = given.get("checks", [each.name for each in CHECKS])
        given["checks"] = tuple(dict.fromkeys([checks] if isinstance(checks, str) else checks))
        if "save_to" in given:
            given["save_to"] = Path(given["save_to"]).absolute()
        plan = cls(subject, **given)
        if plan.examples < 1:
            raise BadOption(f"examples is {plan.examples}; expected 1 or more")
        return replace(plan, seconds=plan.seconds * max(1.0, plan.examples / EXAMPLES))

    @classmethod
    def of_phase(
        cls, name: str, options: Mapping[str, Any], call: str = "check_broad_phase"
    ) -> "JudgingPlan":
        """Returns the plan for a phase. Raises UnknownName, BadOption, ValueError for an unknown check."""
        narrow: dict[str, Mapping[str, Any]] = {}
        for each, chosen in read_narrow_phases(options.get("narrow_phases") or ()).items():
            check_options("narrow phase", each, registry().target("narrow phase", each), chosen)
            narrow[registry().spec("narrow phase", each).name] = dict(chosen)
        response = options.get("response")
        response = Response(response) if isinstance(response, str) else response
        if response is not None:
            target = registry().target("response", response.name)
            check_options("response", response.name, target, response.options)
        subject = Subject(name, dict(options.get("options") or {}), narrow, response)
        provided(subject)  # the smoke test checks the options of the broad phase
        alone = (None, "broad") if not subject.beside else (None, "broad", "pair", "wall", "response")
        names = [each.name for each in CHECKS if each.observation.judges in alone]
        plan = cls.of(subject, {**options, "checks": options.get("checks") or names}, call)
        for name in plan.checks:
            check_named(name)
        return plan

    def report(self, *results: Result) -> Report:
        """Returns the report on these results."""
        first, *_ = provided(self.subject)
        source = f"{first.distribution or 'this process'} {first.version or ''}".strip()
        return Report(self.subject, source, results)


def reference_of(subject: Subject) -> Reference:
    """Returns a function that runs scenes under the reference, with the narrow phases under test. It keeps
    the last outcomes, for checks that share a scene: by identity, for a phase may have written to it."""
    kept: dict[tuple[int, int], tuple[Scene, RunOutcome]] = {}

    def reference(scene: Scene, contacts: int = CONTACTS) -> RunOutcome:
        key = id(scene), contacts
        if key not in kept:
            if len(kept) >= KEPT:
                del kept[next(iter(kept))]
            kept[key] = scene, outcome(subject.reference, scene, contacts)
        return kept[key][1]

    return reference


def applicable(subject: Subject, each: Check) -> str | None:
    """Returns the reason why a check does not apply to phases; None if it does."""
    if each.judges == "broad" and subject.beside:
        return f"for a broad phase alone: judge it without a {next(iter(subject.beside.values()))} named"
    if not each.strategy and subject.response is not None:
        return "its scenes have no responses"
    if each.judges == "response" and subject.response is None:
        return "for a response that is named"
    if each.judges in ("wall", "pair") and not subject.of_role(each.judges):
        return f"for a narrow phase for {each.judges}s that is named"
    features = registry().spec("broad phase", subject.name).features
    if each.observation.feature is not None and each.observation.feature not in features:
        return f"for phases that declare the feature {each.observation.feature!r}"
    return None


@dataclass
class CheckRun:
    """One check on one phase, scene after scene: counts, refusals, and the last failure, the smallest;
    ``number`` is the number of the scene as drawn."""

    failures: ClassVar[tuple[type[Exception], ...]] = (Exception,)
    """Errors that are a failure of the check, as any error of a foreign phase; others end the run."""

    each: Check
    subject: Subject
    reference: Reference | None = None
    observe: Callable[[int, Any, Exception | None], None] = unheard
    seconds: float = math.inf

    def __post_init__(self) -> None:
        self.count = self.refused = 0
        self.refusal = self.inapplicable = ""
        self.message: str | None = None
        self.scene: Scene | None = None
        self.end = spent() + self.seconds
        self.number: int | None = None
        self._reference = self.reference or reference_of(self.subject)

    def look(self, scene: Any) -> None:
        """Runs the check on a scene; raises Disagreement, or Refused if the phase refuses it."""
        self.each.run(self.subject, scene, self._reference, self.number)

    def holds(self, scene: Any) -> bool:
        """Runs the check on a scene; returns False if it fails. A scene that the phase refuses passes."""
        if spent() > self.end:
            raise TimeIsUp  # before the scene counts
        self.count += 1
        begin_scene()
        try:
            if isinstance(scene, Refused):
                raise scene
            self.observe(self.count, scene, None)
            self.look(scene)
        except Refused as error:
            self.refused += 1
            self.refusal = str(error)
            if isinstance(error, DoesNotApply):
                self.inapplicable = str(error)
        except self.failures as error:
            self.observe(self.count, scene, error)
            is_own = type(error).__module__ == "kinetile.errors"  # with the place in its message
            place = "" if is_own else place_of(error)
            self.message, self.scene = f"{type(error).__name__}: {error}{place}", scene
            if isinstance(error, Disagreement):
                self.message, self.scene = str(error), scene if self.each.strategy else error.scene
            return False
        return True


class Runner:
    """Runs checks in this process. ``observe`` is called with the number of scenes so far, a scene, and None
    before a check runs on it, and with the error if it fails."""

    def __init__(
        self, plan: JudgingPlan, observe: Callable[[int, Scene, Exception | None], None] = unheard
    ) -> None:
        self.plan = plan
        self.subject = plan.subject
        self._drawing = Drawing(plan.examples, plan.seed, partial(acceptable, plan.subject, known={}))
        self._reference = reference_of(plan.subject)
        self._observe = observe

    def smoke_test(self) -> None:
        """Loads a phase, compiles it, unless it is to run as Python, for the first sample that it does not
        refuse, and runs it on that sample, with any result. Raises NotJudged, with the place, if it does not
        load, a part of it raises, or its hooks are plain functions, do not compile or have a mistake;
        UnknownName, BadOption; and Refused if it refuses all samples."""
        refusals = []
        for scene in SAMPLES:
            try:
                sim = self.subject.simulation(scene)
                for text in unmarked(composition_of(sim).broad) if as_python() else ():
                    raise NotJudged(text)
                if not as_python():
                    sim.compile()
                try:
                    sim.run()
                    sim.audit()
                except KinetileError as error:
                    if isinstance(error.__cause__, SLIPS):
                        raise
                return
            except Refused as error:
                refusals.append(error)
            except (UnknownName, BadOption, MissingExtra):
                raise
            except KinetileError as error:
                text = str(error)
                raise NotJudged("\n".join([text, *diagnosed("", text, self.subject)])) from error
        raise refusals[0]

    def holds(self, name: str, scene: Scene) -> bool:
        """Runs the check of a name on a scene, once."""
        return CheckRun(check_named(name), self.subject).holds(scene)

    def verdict(self, name: str, scene: Scene) -> str:
        """Runs a failing check under kinetile's own other phases; returns the phase that the failure is
        against. Phases of other distributions would have to be compiled, and could hang or crash."""
        each, subject = check_named(name), self.subject
        named, kinds = ", ".join(subject.beside), [*subject.beside.values()]
        suspect = f"suspect the {kinds[0]}, {named}" if kinds else "the reference is in doubt"
        found: dict[bool, list[str]] = {True: [], False: []}
        for other in registry().names("broad phase"):
            own = registry().provided("broad phase", other).distribution == "kinetile"
            run = CheckRun(each, subject.under(other))
            if own and other not in (subject.name, REFERENCE) and applicable(run.subject, each) is None:
                holds = run.holds(acceptable(run.subject, scene))
                if not run.refused:
                    found[holds].append(other)
        also, fine = ", ".join(found[False]), ", ".join(found[True])
        if also:
            return f"also {also}, but not {fine}" if fine else f"also {also}: {suspect}"
        return f"only {subject.name}" + (f"; {fine} agree with the reference" if fine else "")

    def run(self, name: str, most: int | None = None) -> Result:
        """Runs the check of a name on its scenes, or on a number of them, and returns its result."""
        each = check_named(name)
        skipped = applicable(self.subject, each)
        if skipped is not None:
            return Result(each.name, each.sentence, "skipped", 0, 0.0, reason=skipped)
        began, late = spent(), False
        run = CheckRun(each, self.subject, self._reference, self._observe, self.plan.seconds)
        try:
            fails = not all(map(run.holds, islice(self._scenes(run), most)))
            if fails and self.plan.shrink and each.strategy and run.scene is not None:
                run.end = math.inf
                seconds = QUICKLY if as_python() else REDUCING
                reduced(run.scene, lambda fewer: not run.holds(fewer), seconds)
        except TimeIsUp:
            late = run.message is None
        status, reason = "passed", ""
        if late:
            status = "not judged"
            reason = f"{self.plan.seconds:g} CPU s were not enough; no fault in the scenes seen until then"
        elif run.count and run.refused == run.count:
            status = "skipped"
            reason = run.inapplicable or f"it refuses all scenes of this check: {run.refusal}"
        result = Result(each.name, each.sentence, status, run.count, 0.0, reason=reason)
        result = result if run.message is None else self._failed(run, result)
        return replace(result, seconds=spent() - began)

    def _scenes(self, run: CheckRun) -> Iterator[Scene | Refused]:
        """Yields the scenes of a check; drawing them does not count as its time."""
        scenes = self._drawing.scenes(run.each)
        for run.number in count(1):
            began = spent()
            scene = next(scenes, None)
            run.end += spent() - began
            if scene is None:
                return
            yield scene

    def _failed(self, run: CheckRun, result: Result) -> Result:
        each, scene = run.each, run.scene
        result = replace(result, status="failed", said=str(run.message))
        if scene is not None:
            result = replace(result, bodies=len(scene) if each.replay else None)
            result = saved(result, scene, self.subject, self.plan.save_to)
        if not self.plan.explains:
            return result
        lines = [result.said, *self._how_often(run), *diagnosed(each.name, result.said, self.subject)]
        result = replace(result, said="\n".join(lines))
        if not each.observation.compares or scene is None:
            return result
        return replace(result, verdict=self.verdict(each.replay or each.name, scene))

    def _how_often(self, run: CheckRun) -> Iterator[str]:
        """Repeats the check on the failing scene; yields a line if it does not always fail."""
        if run.scene is None or not run.each.strategy:
            return
        again, times = CheckRun(run.each, self.subject, seconds=self.plan.seconds), 0
        with suppress(TimeIsUp):
            for _ in range(AGAIN):
                times += not again.holds(run.scene)
        if times != again.count:
            yield f"(not every time: of {again.count} times more on this scene it failed {times})"
