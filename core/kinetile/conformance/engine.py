"""The engine behind all doors: draws scenes, runs checks on them, and shrinks what fails."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from kinetile.conformance.cases import Subject, not_saved, save_case
from kinetile.conformance.checks import CHECKS, check_named
from kinetile.conformance.checks.check import Check, Disagreement
from kinetile.conformance.checks.gallery import smallest
from kinetile.conformance.checks.tightness import tightness
from kinetile.conformance.checks.verdicts import Seen, applicable, verdict
from kinetile.conformance.report import Report, Result
from kinetile.errors import MissingExtra
from kinetile.plugin.registry import registry
from kinetile.scene import Scene

__all__ = ["EXAMPLES", "check_broad_phase", "run_check"]

EXAMPLES = 100
"""Scenes drawn for each check by default."""

FEW = 3
"""Bodies in a scene that one can think through."""


def check_broad_phase(
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
) -> Report:
    """Judge a broad phase; return the report.

    Args:
        name: the name under which it is registered.
        options: its options.
        examples: scenes drawn for each check.
        checks: names of the checks to run; None: all that apply.
        expected_failures: checks that are known to fail, each with the reason. They are run but not
            shrunk; one that passes makes the report not ok.
        save_to: a folder for the scenes that fail, as TOML, and their pictures.
        shrink: whether to look for the smallest scene that fails.
        seed: what the drawing begins with; the same seed draws the same scenes.
        on_result: called after each check.

    Raises:
        UnknownName, BadOption: there is no such phase, or it has no such option.
        ValueError: a check is named that does not exist.
        MissingExtra: Hypothesis is not installed.
    """
    began = time.perf_counter()
    expected = dict(expected_failures or {})
    for known in [*expected, *(checks or ())]:
        check_named(known)
    subject = Subject(name, dict(options or {}))
    provided = registry().provided("broad phase", name)
    subject.simulation(smallest())  # unknown options and refusals speak up here, not in each check
    results = []
    for each in CHECKS if checks is None else [check_named(c) for c in checks]:
        result = run_check(each, subject, examples, expected.get(each.name), save_to, shrink, seed)
        results.append(result)
        if on_result is not None:
            on_result(result)
    return Report(
        name=name,
        options=subject.options,
        distribution=f"{provided.distribution or 'this process'} {provided.version or ''}".strip(),
        results=tuple(results),
        tightness=tightness(subject) if checks is None and all(r.ok for r in results) else None,
        seconds=time.perf_counter() - began,
    )


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
    if shrink and seen.scene is not None and len(seen.scene) > FEW:
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
        max_examples=examples,
        database=None,
        deadline=None,
        phases=phases,
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    @given(scenes(turns=seen.each.turns, most=most or MOST))
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
