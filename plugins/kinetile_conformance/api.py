"""The Python interface: judges a phase and returns a report, or replays one check on one scene."""

import os
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar, Unpack

from kinetile import Response
from kinetile.errors import BadOption, Refused, one_of
from kinetile.instruments import compiled_by_default
from kinetile_conformance.cases import Subject, load_case
from kinetile_conformance.checks import CHECKS, FIRST
from kinetile_conformance.checks.check import JUDGED
from kinetile_conformance.isolated import DEATHS, IsolatedRunner
from kinetile_conformance.pipe import JUDGING, EngineReport, EngineRunner
from kinetile_conformance.pipe import SECONDS as LINE_SECONDS
from kinetile_conformance.reporting import KIT_VERSION, Report, Result
from kinetile_conformance.runner import CheckRun, JudgingPlan, Options, Runner, applicable, unheard


def check_broad_phase(name: str, **options: Unpack[Options]) -> Report:
    """Judges the broad phase registered under a name, with options (``Options``); returns the report.

    A child process judges it, so this process survives any error of the phase. A check that ended the child
    has the status "died", with the cause and, if known, the place. The other checks are not run after three
    deaths, or after a failure on the scenes that run as Python first.

    Raises UnknownName and BadOption; NotJudged if it does not load, or its hooks do not compile (the message
    names the place); Refused if it refuses every sample of a scene, or cannot be sent to another process;
    ValueError for a check that does not exist; and MissingExtra without Hypothesis.
    """
    plan = JudgingPlan.of_phase(name, options)
    with closing(IsolatedRunner(plan, options.get("on_scene", unheard))) as runner:
        names = runner.begin(plan.checks)
        report = _judged(plan.report(), runner, names, options)
    left = len(plan.checks) > len(names)
    return replace(report, notes=("the others are not run until this error is gone",)) if left else report


def check_engine(
    command: str, *, asked: str = "contacts", within: float | None = None, **options: Unpack[Options]
) -> EngineReport:
    """Judges an engine over a pipe; returns the report. Raises EngineError if it does not start, or breaks
    the protocol. ``asked`` is one of ``QUESTIONS``, ``within`` the distance of times, which casts need. The
    ``options`` (``Options``) apply, except options of phases; ``seconds`` is the limit for a line, by the
    clock, and ``checks`` are names of ``JUDGING``. Wrong options raise as in ``check_broad_phase``."""
    plan = JudgingPlan.of(Subject(command, {}), options, "check_engine")
    if asked not in JUDGING:
        raise BadOption(f"asked is {asked!r}; expected {one_of(asked, JUDGING)}")
    wanted = plan.checks if options.get("checks") else (*JUDGING[asked],)
    for name in wanted:
        if name not in JUDGING[asked]:
            raise ValueError(f"there is no check {name!r}; expected {one_of(name, JUDGING[asked])}")
    seconds, on_scene = options.get("seconds") or LINE_SECONDS, options.get("on_scene", unheard)
    report = EngineReport(plan.subject, "", asked=asked, within=within)
    names = [name for name in JUDGING[asked] if name in wanted]
    with closing(EngineRunner(plan, asked, within, seconds, on_scene)) as runner:
        return _judged(report, runner, names, options)


SomeReport = TypeVar("SomeReport", bound=Report)


def _judged(
    report: SomeReport, runner: IsolatedRunner | EngineRunner, checks: Sequence[str], options: Options
) -> SomeReport:
    began, here, on_result = time.perf_counter(), Path.cwd(), options.get("on_result", unheard)
    for done, check in enumerate(checks):
        if runner.deaths >= DEATHS:
            note = f"not run, after {runner.deaths} deaths: {', '.join(checks[done:])}"
            report = replace(report, notes=(note,))
            break
        result = runner.run(check)
        if result.case is not None and result.case.is_relative_to(here):
            result = replace(result, case=result.case.relative_to(here))
        report = replace(report, results=(*report.results, result))
        on_result(result)
    return replace(report, seconds=time.perf_counter() - began)


def replay(
    name: str,
    path: str | os.PathLike[str],
    *,
    check: str | None = None,
    options: Mapping[str, Any] | None = None,
) -> Result:
    """Runs a check on the scene of a file; returns its result, with the verdict if it fails. Checks that the
    kit runs as Python first run as Python here.

    A file saved by the kit names the failed check, the narrow phases and the response under test, and the
    options of this broad phase: these are the defaults. For any other file the check is ``same-contacts``.
    Raises UnknownName and BadOption, also if the check takes no scene; OSError and SceneError if the file
    cannot be read, or has no scene; and Refused if the phase refuses this scene.
    """
    path = Path(path)
    case = load_case(path)
    scene = case.scene
    wanted = check or case.check or "same-contacts"
    known = {each.name: each for each in CHECKS if each.strategy}
    if wanted not in known:
        where = f"{str(path)!r} names the check {wanted!r}" if check is None else f"the check is {wanted!r}"
        expected = f"one that takes a scene (kit {KIT_VERSION}): {one_of(wanted, known)}"
        raise BadOption(f"{where}; expected {expected}")
    options = options or (case.options if name == case.name else {})
    answer = Response(case.response[0], **case.response[1]) if case.response else None
    subject = Subject(name, dict(options), case.narrow_phases, answer)
    subject.simulation(subject.dressed(scene))
    skipped = applicable(subject, known[wanted])
    if skipped is not None:
        raise BadOption(f"the check {wanted!r} does not apply to {name!r}: it is {skipped}")
    began = time.perf_counter()
    for compiled in (False, True) if wanted in FIRST and len(scene) <= JUDGED else (True,):
        run = CheckRun(known[wanted], subject)
        with compiled_by_default(compiled):
            holds, took = run.holds(scene), time.perf_counter() - began
            verdict = "" if holds else Runner(JudgingPlan(subject)).verdict(wanted, scene)
        if run.refused:
            raise Refused(run.refusal)
        if not holds:
            break
    text, sentence, status = run.message or "", run.each.sentence, "passed" if holds else "failed"
    return Result(wanted, sentence, status, 1, took, text, "", verdict, len(scene), path)
