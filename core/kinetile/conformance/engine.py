"""The engine behind all doors: draws scenes, runs checks on them, and shrinks what fails."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict, Unpack

from kinetile.conformance.cases import Subject, not_saved, save_case
from kinetile.conformance.checks import CHECKS, check_named
from kinetile.conformance.checks.check import Check, Disagreement
from kinetile.conformance.checks.gallery import smallest
from kinetile.conformance.checks.tightness import tightness
from kinetile.conformance.checks.verdicts import Seen, applicable, verdict
from kinetile.conformance.report import Report, Result
from kinetile.errors import MissingExtra
from kinetile.plugin.registry import Provided, registry
from kinetile.scene import Scene

__all__ = ["EXAMPLES", "Trial", "Wishes", "check_broad_phase", "run_check"]

EXAMPLES = 100
"""Scenes drawn for each check by default."""

FEW = 3
"""Bodies in a scene that one can think through."""


class Wishes(TypedDict, total=False):
    """What can be wished for when a broad phase is judged, at whichever door.

    Attributes:
        options: the phase's options.
        examples: scenes drawn for each check; ``EXAMPLES``.
        checks: names of the checks to run; None: all that apply.
        expected_failures: checks that are known to fail, each with the reason. They are run but not
            shrunk; one that passes makes the report not ok.
        save_to: a folder for the scenes that fail, as TOML, and their pictures; None: they are not saved.
        shrink: whether to look for the smallest scene that fails; it is.
        seed: what the drawing begins with; the same seed draws the same scenes; 0.
        on_result: called after each check.
    """

    options: Mapping[str, Any] | None
    examples: int
    checks: Sequence[str] | None
    expected_failures: Mapping[str, str] | None
    save_to: Path | None
    shrink: bool
    seed: int
    on_result: Callable[[Result], None] | None


@dataclass(frozen=True)
class Trial:
    """A trial of one broad phase: what was wished for, checked, and who is on trial."""

    subject: Subject
    provided: Provided
    checks: tuple[str, ...]
    whole: bool
    expected: Mapping[str, str]
    examples: int
    save_to: Path | None
    shrink: bool
    seed: int
    on_result: Callable[[Result], None]
    began: float

    @classmethod
    def of(cls, name: str, wishes: Wishes) -> Trial:
        """Return the trial of a phase; UnknownName, or ValueError for a check that does not exist."""
        expected = dict(wishes.get("expected_failures") or {})
        chosen = wishes.get("checks")
        for known in [*expected, *(chosen or ())]:
            check_named(known)
        return cls(
            subject=Subject(name, dict(wishes.get("options") or {})),
            provided=registry().provided("broad phase", name),
            checks=tuple([each.name for each in CHECKS] if chosen is None else chosen),
            whole=chosen is None,
            expected=expected,
            examples=wishes.get("examples", EXAMPLES),
            save_to=wishes.get("save_to"),
            shrink=wishes.get("shrink", True),
            seed=wishes.get("seed", 0),
            on_result=wishes.get("on_result") or (lambda result: None),
            began=time.perf_counter(),
        )

    def report(self, results: Sequence[Result], tight: float | None, notes: tuple[str, ...] = ()) -> Report:
        """Return the report on what came of it."""
        provided = self.provided
        return Report(
            name=self.subject.name,
            options=self.subject.options,
            distribution=f"{provided.distribution or 'this process'} {provided.version or ''}".strip(),
            results=tuple(results),
            tightness=tight,
            seconds=time.perf_counter() - self.began,
            notes=notes,
        )


def check_broad_phase(name: str, **wishes: Unpack[Wishes]) -> Report:
    """Judge the broad phase registered under a name, in this process; return the report.

    Keyword arguments are ``Wishes``.

    Raises:
        UnknownName, BadOption: there is no such phase, or it has no such option.
        ValueError: a check is named that does not exist.
        MissingExtra: Hypothesis is not installed.
    """
    trial = Trial.of(name, wishes)
    subject = trial.subject
    subject.simulation(smallest())  # unknown options and refusals speak up here, not in each check
    results = []
    for each in trial.checks:
        expected = trial.expected.get(each)
        result = run_check(
            check_named(each), subject, trial.examples, expected, trial.save_to, trial.shrink, trial.seed
        )
        results.append(result)
        trial.on_result(result)
    fine = trial.whole and all(result.ok for result in results)
    return trial.report(results, tightness(subject) if fine else None)


def run_check(
    each: Check,
    subject: Subject,
    examples: int,
    expected: str | None,
    save_to: Path | None,
    shrink: bool,
    seed: int,
) -> Result:
    """Run one check and say what came of it."""
    began = time.perf_counter()
    skipped = applicable(subject, each)
    if skipped is not None:
        return Result(each.name, each.sentence, "skipped", 0, 0.0, reason=skipped)
    seen = Seen(each, subject)
    if each.draws:
        _draw(seen, examples, shrink and expected is None, seed)
    else:
        seen.look(smallest())
    seconds = time.perf_counter() - began
    if seen.said is None:
        if seen.count and seen.refused == seen.count:
            reason = f"it refuses all scenes of this check: {seen.refusal}"
            return Result(each.name, each.sentence, "skipped", seen.count, seconds, reason=reason)
        status = "passed" if expected is None else "xpassed"
        reason = "" if expected is None else f"was expected to fail ({expected}), and does not"
        return Result(each.name, each.sentence, status, seen.count, seconds, reason=reason)
    scene, said = seen.scene, seen.said
    case = picture = None
    if save_to is not None and scene is not None and each.draws:
        path = save_to / f"{subject.name}-{each.name}.toml"
        try:
            save_case(scene, path, each.name, subject.name, seen.said)
            case = path
            picture = _draw_picture(subject, scene, path, seen.said)
        except OSError as error:
            said = f"{said}\n{not_saved('scene' if case is None else 'picture', error)}"
    return Result(
        each.name,
        each.sentence,
        "failed" if expected is None else "xfailed",
        seen.count,
        seconds,
        said=said,
        reason=expected or "",
        verdict=verdict(each, subject, scene) if expected is None and scene is not None else "",
        bodies=len(scene) if scene is not None and each.draws else None,
        case=case,
        picture=picture,
    )


def _draw(seen: Seen, examples: int, shrink: bool, seed: int) -> None:
    """Draw scenes until one fails or there have been enough; then look for the smallest.

    Leaving out bodies can end where no single one can be left out, and yet fewer would do. So where more than
    a few are left, scenes of a few are drawn as well.
    """
    _search(seen, examples, shrink, seed)
    if shrink and seen.scene is not None and len(seen.scene) > FEW and seen.each.scenes is None:
        few = Seen(seen.each, seen.subject)
        _search(few, 8 * examples, shrink, seed, most=FEW)
        seen.count += few.count
        if few.said is not None:
            seen.said, seen.scene = few.said, few.scene


def _search(seen: Seen, examples: int, shrink: bool, seed: int, most: int | None = None) -> None:
    """Draw scenes, of so many bodies at most, until one fails; then make it smaller."""
    try:
        from hypothesis import HealthCheck, Phase, given, settings
        from hypothesis import seed as seeded
    except ImportError as error:
        raise MissingExtra("the conformance kit", "hypothesis", "conformance") from error

    from kinetile.conformance.strategies import MOST, scenes

    phases = [Phase.generate, *([Phase.shrink] if shrink else [])]

    @seeded(seed)
    @settings(
        max_examples=max(1, round(seen.each.share * examples)),
        database=None,
        deadline=None,
        phases=phases,
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    @given(seen.each.scenes() if seen.each.scenes else scenes(turns=seen.each.turns, most=most or MOST))
    def look(scene: Scene) -> None:
        if not seen.look(scene):
            raise Disagreement(seen.said or "")

    try:
        look()
    except Disagreement:
        pass
    except Exception as error:  # Hypothesis: the failure does not come back when it is tried again
        if seen.said is None:
            raise
        seen.said = f"{seen.said}\n(not every time: {type(error).__name__})"


def _draw_picture(subject: Subject, scene: Scene, case: Path, said: str) -> Path:
    """Draw the moment of disagreement beside the saved case."""
    from kinetile.conformance.picture import draw

    path = case.with_suffix(".svg")
    path.write_text(draw(subject, scene, said), encoding="utf-8")
    return path
