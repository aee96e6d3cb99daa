"""How a broad phase grows: CPU time for a unit of simulated time, and memory, against the number of discs.

Each number of discs has a process of its own, because a process remembers its peak of memory for ever. From
that peak the peak of the same process with four discs is taken off: the interpreter, the libraries, the
loop's machine code and the log. What is left is the discs'.

The grid's start is not typical of what follows (nobody has met anybody), so the clock starts after
``WARM_UP`` contacts a disc. Then three stretches are timed, and the median counts.
"""

from __future__ import annotations

import json
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from kinetile.bench.choices import Choice, phase_label, phases_with_options, simulation_of
from kinetile.bench.display import Displayed
from kinetile.bench.measures import fit_exponent
from kinetile.bench.surroundings import surroundings
from kinetile.errors import KinetileError, PhaseError, Refused

__all__ = ["BODIES", "Growth", "GrowthRow", "bench_growth", "square_at_least"]

BODIES = (100, 1000, 10_000, 100_000)
WARM_UP = 10
"""Contacts a disc before the clock starts; a contact of two discs is one for each."""

TINY = 4
"""Discs of the process whose memory is taken off."""

_TINY_SECONDS = 0.1  # long enough to fill the log, which is as long for a few discs as for many
_NOTICEABLE = 4 << 20  # bytes: less than this is within what two equal processes differ by
_STRETCHES = 3


@dataclass(frozen=True)
class GrowthRow:
    """One number of discs.

    Attributes:
        bodies: how many: the smallest square number that is at least what was asked for.
        setup_seconds: time to make scene and tables, construct and predict, compilation and loading apart.
        cpu_seconds_per_time: CPU seconds in the loop for one unit of simulated time; median of the stretches.
        slowest, fastest: of the stretches.
        contacts_per_cpu_second: contacts of discs and with walls; median of the stretches.
        events_per_contact: structural and all other events, over contacts.
        simulated: how much time was simulated in the stretches together.
        peak_bytes_per_body: most memory, less that of the same process with four discs; None where that is
            too little to be told apart, or the system does not tell.
        stage_bytes_per_body: the same at the end of each stage: scene, tables, construction, run.
        table_bytes_per_body: what scene, kernel and broad phase keep in arrays, the log apart.
        arrays: those arrays, in bytes a body.
    """

    bodies: int
    setup_seconds: float
    cpu_seconds_per_time: float
    slowest: float
    fastest: float
    contacts_per_cpu_second: float
    events_per_contact: float
    simulated: float
    peak_bytes_per_body: float | None
    stage_bytes_per_body: Mapping[str, float]
    table_bytes_per_body: float
    arrays: Mapping[str, float]


@dataclass(frozen=True)
class Growth(Displayed):
    """All rows, and where and with what they were measured."""

    phase: str
    density: float
    rows: tuple[GrowthRow, ...]
    conditions: Mapping[str, Any]

    @property
    def exponent(self) -> float | None:
        """The exponent of the CPU time over n, fitted to all rows; None for fewer than two."""
        return self._fit(self.rows) if len(self.rows) > 1 else None

    @property
    def steps(self) -> tuple[float, ...]:
        """The exponents from each row to the next."""
        return tuple(self._fit(self.rows[k : k + 2]) for k in range(len(self.rows) - 1))

    def _fit(self, rows: Sequence[GrowthRow]) -> float:
        return fit_exponent([row.bodies for row in rows], [row.cpu_seconds_per_time for row in rows])

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types, fit for JSON."""
        found = {"phase": self.phase, "density": self.density, "exponent": self.exponent}
        rows = [asdict(row) for row in self.rows]
        return (
            found | {"exponents_of_steps": list(self.steps), "rows": rows} | {"conditions": self.conditions}
        )


def bench_growth(
    phase: Choice,
    bodies: Sequence[int] = BODIES,
    density: float = 0.5,
    *,
    seconds: float = 2.0,
    seed: int = 1,
    start: Callable[[str, Any], Any] | None = None,
    finish: Callable[[Growth], Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Growth:
    """Measure a broad phase on scenes of the recipe ``grid``, each in a process of its own.

    ``seconds`` is the CPU time of the stretches together, at least. ``start`` is called with a label and a
    small simulation before anything is measured, ``finish`` with what there is after each number of discs,
    ``progress`` with the processes done and their total.

    Raises what ``Simulation`` and ``make_scene`` raise; the phase must be one that another process finds.
    """
    from kinetile.plugin.by_name import make_scene

    ((name, options),) = phases_with_options([phase])
    wish = {"phase": name, "options": options, "density": density, "seed": seed, "seconds": seconds}
    small = simulation_of(make_scene("grid", bodies=TINY, density=density), (name, options))
    if start is not None:
        start(name, small)
    small.compile()  # so that the processes load the loop and none of them has the compiler's peak
    sizes = sorted({square_at_least(n) for n in bodies})
    conditions = surroundings() | {"seconds": seconds, "seed": seed, "contacts_before": WARM_UP}
    growth = Growth(phase_label(name, options), density, (), conditions)
    tiny = _in_a_process(wish | {"bodies": TINY, "seconds": _TINY_SECONDS})
    for done, n in enumerate(sizes, start=1):
        if progress is not None:
            progress(done, len(sizes) + 1)
        row = _row(_in_a_process(wish | {"bodies": n}), tiny)
        growth = Growth(growth.phase, density, (*growth.rows, row), conditions)
        if finish is not None:
            finish(growth)
    return growth


def square_at_least(n: int) -> int:
    """Return the smallest square number that is at least ``n``: what the recipe ``grid`` can make."""
    return (math.isqrt(max(n, 1) - 1) + 1) ** 2


def _in_a_process(wish: Mapping[str, Any]) -> dict[str, Any]:
    """Return what ``_measured`` finds in a new process."""
    command = [sys.executable, "-m", __name__, json.dumps(wish)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        reason = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        raise PhaseError(f"the process for {wish['bodies']} discs under {wish['phase']} failed: {reason[0]}")
    found: dict[str, Any] = json.loads(done.stdout)
    if "refused" in found:
        raise Refused(found["refused"])
    return found


def _row(found: Mapping[str, Any], tiny: Mapping[str, Any]) -> GrowthRow:
    n = found["bodies"]
    stretches = found["stretches"]
    costs = [each["cpu_seconds"] / each["simulated"] for each in stretches]
    known = [name for name, peak in found["peaks"].items() if peak is not None]
    stages = {name: (found["peaks"][name] - tiny["peaks"][name]) / n for name in known}
    arrays = {name: size / n for name, size in found["arrays"].items()}
    return GrowthRow(
        bodies=n,
        setup_seconds=found["setup_seconds"],
        cpu_seconds_per_time=statistics.median(costs),
        slowest=max(costs),
        fastest=min(costs),
        contacts_per_cpu_second=statistics.median(e["contacts"] / e["cpu_seconds"] for e in stretches),
        events_per_contact=sum(e["events"] for e in stretches) / sum(e["contacts"] for e in stretches),
        simulated=sum(each["simulated"] for each in stretches),
        peak_bytes_per_body=stages["run"] if stages.get("run", 0.0) * n >= _NOTICEABLE else None,
        stage_bytes_per_body=stages,
        table_bytes_per_body=sum(arrays.values()),
        arrays=arrays,
    )


def _measured(wish: Mapping[str, Any]) -> dict[str, Any]:
    """Run one scene in this process, and note time and memory stage by stage."""
    from kinetile.plugin.by_name import make_scene

    peaks: dict[str, int | None] = {}
    began = time.perf_counter()
    scene = make_scene("grid", bodies=wish["bodies"], density=wish["density"], seed=wish["seed"])
    peaks["scene"] = _peak_memory()
    sim = simulation_of(scene, (wish["phase"], wish["options"]))
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
        "bodies": len(scene),
        "setup_seconds": setup,
        "stretches": stretches,
        "peaks": peaks,
        "arrays": arrays_of(sim),
    }


def _stretch(sim: Any, seconds: float) -> dict[str, float]:
    """Run on for so many CPU seconds, at least."""
    before, since = sim.readings, sim.time
    contacts = len(sim.scene)
    while True:
        sim.run(max_contacts=contacts)
        now = sim.readings
        spent = now.cpu_seconds - before.cpu_seconds
        if spent >= seconds:
            break
        contacts = math.ceil(contacts * min(max((seconds - spent) / max(spent, 1e-9), 0.1), 4.0))
    made = now.contacts_disc + now.contacts_wall - before.contacts_disc - before.contacts_wall
    events = now.events - before.events
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
        answer = _measured(json.loads(sys.argv[1]))
    except KinetileError as error:
        answer = {"refused": str(error)}
    print(json.dumps(answer))
