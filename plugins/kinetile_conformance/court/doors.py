"""The door for programs: one function that judges a phase and returns a report."""

from __future__ import annotations

from collections.abc import Callable
from typing import Unpack

from kinetile_conformance.court.court import Court, Trial, Wishes
from kinetile_conformance.court.rehearsal import rehearse
from kinetile_conformance.court.report import Report, Result
from kinetile_conformance.court.tightness import tightness
from kinetile_conformance.isolation.deaths import GIB
from kinetile_conformance.isolation.hearing import DEATHS, Hearing

__all__ = ["MEMORY", "check_broad_phase"]

MEMORY = 4 * GIB


def check_broad_phase(
    name: str, *, in_process: bool = False, memory: int = MEMORY, **wishes: Unpack[Wishes]
) -> Report:
    """Judge the broad phase registered under a name; return the report.

    It is judged in a child process, and this one goes on whatever the phase does. A check that the child did
    not survive has the status "died", and says of what, and as far as can be seen where; after three of these
    the rest is not run, and the report's notes say so.

    Args:
        name: the name under which it is registered.
        in_process: judge in this process, for a debugger: then nothing ends an endless loop in a hook, and a
            crash is one of this process.
        memory: how many bytes a child may take beyond what it begins with, where the system can tell.
        wishes: what else can be wished for (``Wishes``).

    Raises:
        UnknownName, BadOption: there is no such phase, or it has no such option.
        NotJudged: it does not load, or its hooks do not compile; the message says where.
        Refused: it refuses every sample of a scene; or it was added in this process, which cannot fork.
        ValueError: a check is named that does not exist.
        MissingExtra: Hypothesis is not installed.
    """
    trial = Trial.of(name, wishes)
    if in_process:
        return _judged_here(trial)
    notes: tuple[str, ...] = ()
    with Hearing(trial, memory) as hearing:
        hearing.rehearse()
        results: list[Result] = []
        for check in trial.checks:
            if hearing.deaths >= DEATHS:
                left = ", ".join(trial.checks[len(results) :])
                notes = (f"not run, after {hearing.deaths} deaths: {left}",)
                break
            results.append(_told(trial, hearing.judge(check)))
        return trial.report(results, _tightness(trial, results, hearing.tightness), notes)


def _judged_here(trial: Trial) -> Report:
    """Judge in this process."""
    rehearse(trial.subject)
    court = Court(
        trial.subject,
        examples=trial.examples,
        seed=trial.seed,
        seconds=trial.seconds,
        shrink=trial.shrink,
        save_to=trial.save_to,
    )
    results = [_told(trial, court.judge(check, trial.expected.get(check))) for check in trial.checks]
    return trial.report(results, _tightness(trial, results, lambda: tightness(trial.subject)))


def _told(trial: Trial, result: Result) -> Result:
    """Tell whoever listens of a result, and return it."""
    trial.on_result(result)
    return result


def _tightness(trial: Trial, results: list[Result], measured: Callable[[], float | None]) -> float | None:
    """Return how much a phase over-reports where all checks were run and passed; else None."""
    whole = trial.whole and len(results) == len(trial.checks)
    return measured() if whole and all(result.ok for result in results) else None
