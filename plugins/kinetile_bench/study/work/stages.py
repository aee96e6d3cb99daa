"""Time and memory of a run stage by stage, in a process of its own.

A process remembers its peak of memory for ever: so each run that is to tell it has one of its own. From that
peak whoever reads it takes off that of the same process with a few bodies: the interpreter, the libraries,
the loop's machine code and the log.

A scene's start is often not typical of what follows (in a grid nobody has met anybody), so the clock starts
after ``WARM_UP`` contacts a body. Then three stretches are timed, and the median counts.
"""

from __future__ import annotations

import json
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping
from typing import Any

from kinetile.errors import KinetileError, PhaseError, Refused
from kinetile_bench.choices import contacts_of, simulation_of
from kinetile_bench.study.file.tasks import scene_of

__all__ = ["WARM_UP", "arrays_of", "stages_of"]

WARM_UP = 10
"""Contacts a body before the clock starts; a contact of two bodies is one for each."""

_STRETCHES = 3


def stages_of(order: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of a task's row that its run in a new process gives.

    Raises Refused as the run does, and PhaseError where the process failed.
    """
    names = ("recipe", "parameters", "content", "broad_phase", "options", "seconds")
    wish = json.dumps({name: order[name] for name in names})
    command = [sys.executable, "-m", __name__]
    done = subprocess.run(command, input=wish, capture_output=True, text=True, check=False)
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


def _measured(wish: Mapping[str, Any]) -> dict[str, Any]:
    """Run one scene in this process, and note time and memory stage by stage."""
    peaks: dict[str, int | None] = {}
    began = time.perf_counter()
    scene = scene_of(wish)
    peaks["scene"] = _peak_memory()
    sim = simulation_of(scene, (wish["broad_phase"], wish["options"]))
    setup = time.perf_counter() - began
    peaks["tables"] = _peak_memory()
    sim.compile()
    began = time.perf_counter()
    sim.build()
    setup += time.perf_counter() - began
    peaks["construction"] = _peak_memory()
    sim.run(max_contacts=WARM_UP * len(scene) // 2)
    stretches = [_stretch(sim, wish["seconds"] / _STRETCHES) for _ in range(_STRETCHES)]
    peaks["run"] = _peak_memory()
    return {
        "setup_seconds": setup,
        "stretches": stretches,
        "peaks": peaks,
        "arrays": arrays_of(sim),
    }


def _stretch(sim: Any, seconds: float) -> dict[str, float]:
    """Run on for so many CPU seconds, at least. Raises Refused where nobody meets anybody any more."""
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
    """Return the bytes of the arrays that grow with the number of discs."""
    scene, tables = sim.scene, sim.tables
    found = {"scene": sum(each.nbytes for each in (scene.position, scene.velocity, scene.radius, scene.mass))}
    for name in ("bodies", "mass", "radii", "places", "queue", "links", "marks", "near"):
        found[name] = getattr(tables, name).nbytes
    found["pair set"] = sum(each.nbytes for each in (tables.pairs, tables.lookup, tables.firsts))
    return found | {sim.broad_phase: sum(each.nbytes for each in sim.state)}


def _peak_memory() -> int | None:
    """Return the most memory that this process has had, in bytes; None where the system does not tell.

    Linux tells it for the program that runs now. What ``getrusage`` gives begins, in a new process, with the
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
        answer = _measured(json.load(sys.stdin))
    except KinetileError as error:
        answer = {"refused": str(error)}
    print(json.dumps(answer))
