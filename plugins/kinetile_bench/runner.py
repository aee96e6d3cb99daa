"""One task in a worker process: its scene is made, run and measured, and every outcome is a row.

An error of a run is a result too: the row has its sentence, and the readings up to there. Only two things
raise: other versions than at the start of the study, and Ctrl-C.

No compiled loop can be interrupted. So a limit of CPU seconds is kept by the system, which ends the process,
and the process that runs the study writes the row.

Run as a program, this module measures time and memory of one run stage by stage. That takes a process of its
own, because a process keeps its peak of memory for ever. Readers subtract the peak of the same process with a
few bodies: the interpreter, the libraries, the loop's machine code and the log. A scene's start is often not
typical (in a grid no two discs have met), so the clock starts after ``WARM_UP`` contacts a body; then three
stretches are timed, and the median counts.
"""

from __future__ import annotations

import json
import math
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

from kinetile import Simulation
from kinetile.errors import KinetileError, PhaseError, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.compiled.limits import end_after
from kinetile_accuracy.environment import environment
from kinetile_bench.rows import observed_columns
from kinetile_bench.task import DONE, FAILED, OUT_OF_MEMORY, REFUSED, check_versions, scene_of, versions_here

_limit = math.inf


def limit_tasks(seconds: float) -> None:
    """Limits the CPU seconds of every task in this process; a task that takes more ends the process."""
    global _limit
    _limit = seconds


@contextmanager
def limited() -> Iterator[None]:
    """Applies the limit of a task to what runs within this context: compiling stays outside."""
    if math.isfinite(_limit):
        end_after(_limit)
    try:
        yield
    finally:
        if math.isfinite(_limit):
            end_after(math.inf)


ONCE = {"pairs", "construction", "certified"}
"""Measures that are the same in every repeat, and so are taken in the first alone."""

MOMENTS = 17
"""Moments of a run, evenly apart from its start to its end, at which candidate pairs are counted."""

SHORTEST = 0.05
"""CPU seconds: a shorter run says little about a rate."""

MOST_RUNS = 40
"""Runs of one task whose timings are measured, at most."""


def run_task(order: Mapping[str, Any]) -> dict[str, Any]:
    """Runs a task, given as the fields of a ``Task``; returns its result in plain types.

    Raises VersionsDiffer where this process has other versions than the task.
    """
    began, cpu_began = time.time(), time.thread_time()
    check_versions(order["versions"], versions_here(order["versions"]), f"the process {os.getpid()}")
    row: dict[str, Any] = {"status": DONE, "error": None}
    simulation = None
    try:
        with limited():
            simulation = _simulation(order, "certified" in order["measure"])
        simulation.compile()
        with limited():
            row |= _measured(simulation, order)
    except Refused as error:
        row |= {"status": REFUSED, "error": str(error)}
    except Exception as error:  # a plugin may raise anything, and that is the task's result
        row |= _failure(error)
        if simulation is not None and isinstance(error, KinetileError):
            row |= _readings(simulation)
    row |= _environment()
    return row | {"wall_seconds": time.time() - began, "task_cpu_seconds": time.thread_time() - cpu_began}


def compile_task(order: Mapping[str, Any]) -> float:
    """Compiles the loop of a task into the cache; returns the seconds that took. Errors are left to the task,
    whose row has them."""
    check_versions(order["versions"], versions_here(order["versions"]), f"the process {os.getpid()}")
    try:
        with limited():
            simulation = _simulation(order)
        return 0.0 if simulation.cached is not False else float(simulation.compile())
    except Exception:
        return 0.0


def contacts_of(simulation: Any) -> int:
    """Returns how many contacts a simulation has had, of discs and with walls."""
    readings = simulation.readings
    return int(readings.contacts_disc + readings.contacts_wall)


def _simulation(order: Mapping[str, Any], keep_contacts: bool = False) -> Any:
    scene, name = scene_of(order), order["broad_phase"]
    return Simulation(scene, name, options=order["options"], keep_contacts=keep_contacts)


def _compiled(order: Mapping[str, Any]) -> Any:
    simulation = _simulation(order)
    simulation.compile()
    return simulation


def _measured(simulation: Any, order: Mapping[str, Any]) -> dict[str, Any]:
    """Runs to the end, and measures what the task names."""
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
        found |= _counted_pairs(simulation, until, contacts)
    else:
        simulation.run(until, max_contacts=contacts, observe=order.get("observe", ()))
    found |= _readings(simulation) | observed_columns(simulation.observed)
    if "certified" in measure:
        from kinetile_accuracy import certify_log  # heavy, and few studies need it

        log = certify_log(simulation.scene, simulation.contacts, until, max_contacts=contacts)
        found |= {"certified": log.right, "certified_contacts": log.lines, "certified_said": str(log)}
    if "timings" in measure:
        found |= _timings(found, order)
    if "rate" in measure:
        found |= _rate(simulation, order)
    if "stages" in measure:
        found |= stages_of(order)
    return found


def _failure(error: BaseException) -> dict[str, Any]:
    """Returns status and sentence of a task that raised; the cause of a plugin's error may be its memory."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, MemoryError):
            reason = f": {cause}" if str(cause) else ""
            return {"status": OUT_OF_MEMORY, "error": f"the worker's memory did not suffice{reason}"}
        cause = cause.__cause__ or cause.__context__
    return {"status": FAILED, "error": f"{type(error).__name__}: {error}"}


def _readings(simulation: Any) -> dict[str, Any]:
    found: dict[str, Any] = simulation.readings.as_dict()
    return found | {"time": simulation.time, "compiled": not INTERPRETED, "runs": 1}


def _counted_pairs(simulation: Any, until: float, contacts: int | None) -> dict[str, Any]:
    """Runs to the end, and count the candidate pairs at its moments."""
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
    """Repeats a run until the runs have taken enough CPU time; returns the median and the extremes."""
    seconds: list[float] = []
    while len(seconds) < MOST_RUNS and sum(seconds) < order["seconds"]:
        again = _compiled(order)
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
    """Runs from the scene's start for about the given CPU time; returns the counts and the rates.

    The number of contacts for that time is estimated from the run before, which first goes on where it was
    too short for an estimate.
    """
    while (spent := simulation.readings.cpu_seconds) < min(SHORTEST, order["seconds"]):
        contacts = contacts_of(simulation)
        if contacts == 0:
            return {}
        simulation.run(max_contacts=contacts * (3 if spent > 0 else 10))
    again = _compiled(order)
    again.run(max_contacts=max(math.ceil(contacts_of(simulation) * order["seconds"] / spent), 1))
    now = again.readings
    return {
        "rate_cpu_seconds": now.cpu_seconds,
        "rate_events": now.events,
        "rate_contacts": contacts_of(again),
        "events_per_cpu_second": now.events_per_cpu_second,
        "contacts_per_cpu_second": now.contacts_per_cpu_second,
    }


def _environment() -> dict[str, Any]:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {**_machine(), "load": load}


@cache
def _machine() -> dict[str, Any]:
    found = environment()
    return {**found["versions"], "processor": found["processor"], "host": platform.node()}


WARM_UP = 10
"""Contacts a body before the clock starts; a contact of two bodies is one for each."""

_STRETCHES = 3


def stages_of(order: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the columns of a task's row that its run in a new process gives.

    Raises Refused as the run does, and PhaseError where the process failed.
    """
    names = ("recipe", "parameters", "content", "broad_phase", "options", "seconds")
    wanted = json.dumps({name: order[name] for name in names})
    command = [sys.executable, "-m", __name__]
    done = subprocess.run(command, input=wanted, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        reason = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        raise PhaseError(f"the process that notes the stages failed: {reason[0]}")
    found: dict[str, Any] = json.loads(done.stdout)
    if "refused" in found:
        raise Refused(found["refused"])
    stretches = found["stretches"]
    rates = [each["contacts"] / each["cpu_seconds"] for each in stretches]
    return {
        "stages": done.stdout.strip(),
        "setup_seconds": found["setup_seconds"],
        "cpu_seconds_per_time": statistics.median(e["cpu_seconds"] / e["simulated"] for e in stretches),
        "contacts_per_cpu_second": statistics.median(rates),
        "peak_bytes": found["peaks"]["run"],
        "table_bytes": sum(found["arrays"].values()),
    }


def _stages_here(order: Mapping[str, Any]) -> dict[str, Any]:
    """Runs one scene in this process, and measures time and memory stage by stage."""
    peaks: dict[str, int | None] = {}
    began = time.perf_counter()
    scene = scene_of(order)
    peaks["scene"] = _peak_memory()
    sim = Simulation(scene, order["broad_phase"], options=order["options"], keep_contacts=False)
    setup = time.perf_counter() - began
    peaks["tables"] = _peak_memory()
    sim.compile()
    began = time.perf_counter()
    sim.build()
    setup += time.perf_counter() - began
    peaks["construction"] = _peak_memory()
    sim.run(max_contacts=WARM_UP * len(scene) // 2)
    stretches = [_stretch(sim, order["seconds"] / _STRETCHES) for _ in range(_STRETCHES)]
    peaks["run"] = _peak_memory()
    return {
        "setup_seconds": setup,
        "stretches": stretches,
        "peaks": peaks,
        "arrays": arrays_of(sim),
    }


def _stretch(sim: Any, seconds: float) -> dict[str, float]:
    """Continues for at least this many CPU seconds. Raises Refused if no two bodies meet any more."""
    before, since, had = sim.readings, sim.time, contacts_of(sim)
    contacts, made, spent = len(sim.scene), 0, 0.0
    while spent < seconds:
        sim.run(max_contacts=contacts)
        if contacts_of(sim) - had == made:
            raise Refused("nobody meets anybody any more: there is nothing left to time")
        made = contacts_of(sim) - had
        spent = sim.readings.cpu_seconds - before.cpu_seconds
        contacts = math.ceil(contacts * min(max((seconds - spent) / max(spent, 1e-9), 0.1), 4.0))
    events = sim.readings.events - before.events
    return {"cpu_seconds": spent, "simulated": sim.time - since, "contacts": made, "events": events}


def arrays_of(sim: Any) -> dict[str, int]:
    """Returns the bytes of the arrays that grow with the number of discs."""
    scene, tables = sim.scene, sim.tables
    found = {"scene": sum(each.nbytes for each in (scene.position, scene.velocity, scene.radius, scene.mass))}
    for name in ("bodies", "mass", "radii", "places", "queue", "links", "marks", "near"):
        table = getattr(tables, name)
        found[name] = table.nbytes if table.strides != (0,) else table.itemsize  # one number for all bodies
    found["pair set"] = sum(each.nbytes for each in (tables.pairs, tables.lookup, tables.firsts))
    return found | {sim.broad_phase: sum(each.nbytes for each in sim.state)}


def _peak_memory() -> int | None:
    """Returns the most memory that this process has had, in bytes; None where the system gives none.

    Linux has it for the program that runs now. What ``getrusage`` gives begins, in a new process, with the
    peak of the one that started it.
    """
    try:
        with open("/proc/self/status", encoding="ascii", errors="replace") as lines:
            for line in lines:
                if line.startswith("VmHWM:"):
                    return int(line.split()[1]) * 1024
    except OSError:
        pass
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    try:
        answer = _stages_here(json.load(sys.stdin))
    except KinetileError as error:
        answer = {"refused": str(error)}
    print(json.dumps(answer))
