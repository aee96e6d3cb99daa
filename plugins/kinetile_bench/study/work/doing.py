"""A task is done: the scene is made, run and read out, and what comes of it is a row, whatever it is.

What goes wrong in a run is a result too: the row has the error's sentence, and the readings up to there. Only
what is no result of the task raises: other versions than the study was begun with, and Ctrl-C.
"""

from __future__ import annotations

import math
import os
import platform
import statistics
import time
from collections.abc import Mapping
from functools import cache
from typing import Any

from kinetile.errors import KinetileError, Refused
from kinetile_accuracy.environment import processor
from kinetile_bench.choices import contacts_of
from kinetile_bench.study.file.tasks import scene_of
from kinetile_bench.study.work.identity import check_versions, versions_here
from kinetile_bench.study.work.limit import limited
from kinetile_bench.study.work.stages import stages_of

__all__ = ["DONE", "FAILED", "LOST", "OUT_OF_MEMORY", "OUT_OF_TIME", "REFUSED", "compile_for", "do_task"]

DONE, REFUSED, FAILED = "done", "refused", "failed"
OUT_OF_MEMORY, OUT_OF_TIME, LOST = "out of memory", "out of time", "lost"

ONCE = {"pairs", "construction", "certified"}
"""What is the same in every repeat, and so is measured in the first alone."""

MOMENTS = 17
"""Moments of a run, evenly apart from its start to its end, at which candidate pairs are counted."""

SHORTEST = 0.05
"""CPU seconds: a shorter run says little about a rate."""

MOST_RUNS = 40
"""Runs of one task whose timings are measured, at most."""


def do_task(order: Mapping[str, Any]) -> dict[str, Any]:
    """Do a task, given as the fields of a ``Task``; return what was found, in plain types.

    Raises VersionsDiffer where this process has not what the task was made with.
    """
    began, cpu_began = time.time(), time.thread_time()
    check_versions(order["versions"], versions_here(order["versions"]), f"the process {os.getpid()}")
    row: dict[str, Any] = {"status": DONE, "error": None}
    simulation = None
    try:
        with limited():
            simulation = _simulation(order)
        simulation.compile()
        with limited():
            row |= _run(simulation, order)
    except Refused as error:
        row |= {"status": REFUSED, "error": str(error)}
    except Exception as error:  # a plugin may raise anything, and that is what came of the task
        row |= _failure(error)
        if simulation is not None and isinstance(error, KinetileError):
            row |= _readings(simulation)
    return (
        row
        | _surroundings()
        | {"wall_seconds": time.time() - began, "task_cpu_seconds": time.thread_time() - cpu_began}
    )


def compile_for(order: Mapping[str, Any]) -> float:
    """Compile the loop that a task needs, so that it lies in the cache; return the seconds that took.

    What goes wrong is for the task to tell.
    """
    check_versions(order["versions"], versions_here(order["versions"]), f"the process {os.getpid()}")
    try:
        with limited():
            simulation = _simulation(order)
        return 0.0 if simulation.cached is not False else float(simulation.compile())
    except Exception:
        return 0.0


def _simulation(order: Mapping[str, Any]) -> Any:
    from kinetile.run.simulation import Simulation

    keep = "certified" in order["measure"]
    return Simulation(scene_of(order), order["broad_phase"], options=order["options"], keep_contacts=keep)


def _run(simulation: Any, order: Mapping[str, Any]) -> dict[str, Any]:
    """Run to the end, and measure what is to be measured."""
    measure, until, contacts = set(order["measure"]), order["until"], order["contacts"]
    if order["repeat"] > 1:
        measure -= ONCE
    found: dict[str, Any] = {}
    if "construction" in measure:
        simulation.build()
        built = simulation.readings
        found |= {
            "construction_updated": built.certificates_updated,
            "construction_asked": built.partners_asked,
            "construction_computed": built.contacts_computed,
        }
    if "pairs" in measure:
        found |= _run_counting(simulation, until, contacts)
    else:
        simulation.run(until, max_contacts=contacts)
    found |= _readings(simulation)
    if "certified" in measure:
        from kinetile_accuracy.answer.certify import certify_log

        said = certify_log(simulation.scene, simulation.contacts, until, max_contacts=contacts)
        found |= {"certified": said.right, "certified_contacts": said.lines, "certified_said": str(said)}
    if "timings" in measure:
        found |= _timings(found, order)
    if "rate" in measure:
        found |= _rate(simulation, order)
    if "stages" in measure:
        found |= stages_of(order)
    return found


def _failure(error: BaseException) -> dict[str, Any]:
    """Return status and sentence of a task that raised; a plugin's error may be that of its memory."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, MemoryError):
            said = f": {cause}" if str(cause) else ""
            return {"status": OUT_OF_MEMORY, "error": f"the worker's memory did not suffice{said}"}
        cause = cause.__cause__ or cause.__context__
    return {"status": FAILED, "error": f"{type(error).__name__}: {error}"}


def _readings(simulation: Any) -> dict[str, Any]:
    from kinetile.kernel.compiled import INTERPRETED

    found: dict[str, Any] = simulation.readings.as_dict()
    return found | {"time": simulation.time, "compiled": not INTERPRETED, "runs": 1}


def _run_counting(simulation: Any, until: float, contacts: int | None) -> dict[str, Any]:
    """Run to the end, and count the candidate pairs at its moments."""
    import numpy as np

    start, left = simulation.scene.start, contacts
    pairs = [simulation.candidate_pairs()]
    built = simulation.readings
    for moment in range(1, MOMENTS):
        before = contacts_of(simulation)
        simulation.run(start + (until - start) * moment / (MOMENTS - 1), max_contacts=left)
        if left is not None:
            left -= contacts_of(simulation) - before
        pairs.append(simulation.candidate_pairs())
    numbers = [len(each) for each in pairs]
    came = simulation.readings.newcomers - built.newcomers
    return {
        "pairs_mean": statistics.fmean(numbers),
        "pairs_most": max(numbers),
        "pairs_of_one_body": max(int(np.bincount(each.ravel(), minlength=1).max()) for each in pairs),
        "pair_changes": came + (numbers[0] + came - numbers[-1]),
    }


def _timings(found: Mapping[str, Any], order: Mapping[str, Any]) -> dict[str, Any]:
    """Do a run again until it has taken enough CPU time; return the median and the extremes."""
    seconds: list[float] = []
    while len(seconds) < MOST_RUNS and sum(seconds) < order["seconds"]:
        again = _simulation({**order, "measure": ()})
        again.compile()
        again.run(order["until"], max_contacts=order["contacts"])
        seconds.append(float(again.readings.cpu_seconds))
    median = statistics.median(seconds)
    contacts = found["contacts_disc"] + found["contacts_wall"]
    return {
        "runs": len(seconds),
        "cpu_seconds": median,
        "cpu_seconds_min": min(seconds),
        "cpu_seconds_max": max(seconds),
        "events_per_cpu_second": found["events"] / median if median > 0.0 else 0.0,
        "contacts_per_cpu_second": contacts / median if median > 0.0 else 0.0,
    }


def _rate(simulation: Any, order: Mapping[str, Any]) -> dict[str, Any]:
    """Run from the scene's start for so much CPU time, about; return what was done, and how fast.

    The run that has just been done says how many contacts that is; where it was too short for that, it first
    goes on.
    """
    while (spent := simulation.readings.cpu_seconds) < min(SHORTEST, order["seconds"]):
        contacts = contacts_of(simulation)
        if contacts == 0:
            return {}
        simulation.run(max_contacts=contacts * (3 if spent > 0 else 10))
    again = _simulation({**order, "measure": ()})
    again.compile()
    again.run(max_contacts=max(math.ceil(contacts_of(simulation) * order["seconds"] / spent), 1))
    now = again.readings
    return {
        "rate_cpu_seconds": now.cpu_seconds,
        "rate_events": now.events,
        "rate_contacts": contacts_of(again),
        "events_per_cpu_second": now.events_per_cpu_second,
        "contacts_per_cpu_second": now.contacts_per_cpu_second,
    }


def _surroundings() -> dict[str, Any]:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {**_machine(), "load": load}


@cache
def _machine() -> dict[str, Any]:
    from kinetile.records.versions import versions

    return versions() | {"processor": processor(), "host": platform.node()}
