"""Growth of a broad phase: CPU time for a unit of simulated time, and memory, over the number of discs.

It is a built-in study: each number of discs has a process of its own, which measures time and memory stage
by stage (``kinetile_bench.runner``). The peak of memory of the same process with four discs is subtracted
from its own; the rest belongs to the discs.
"""

from __future__ import annotations

import json
import math
import os
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from kinetile.plugin.choices import write_phase
from kinetile_accuracy.environment import environment
from kinetile_bench.benchmark import Choice, Measured, phases_with_options
from kinetile_bench.results import fit_exponent
from kinetile_bench.runner import WARM_UP
from kinetile_bench.study import Study, shipped_tables

TINY = 4
"""Discs of the process whose memory is subtracted."""

_NOTICEABLE = 4 << 20  # bytes: less than this is within what two equal processes differ by


@dataclass(frozen=True)
class GrowthRow:
    """One number of discs.

    Attributes:
        bodies: their number: the smallest square number that is at least the one that was given.
        setup_seconds: time to make scene and tables, construct and predict, compilation and loading apart.
        cpu_seconds_per_time: CPU seconds in the loop for one unit of simulated time; median of the stretches.
        slowest, fastest: of the stretches.
        contacts_per_cpu_second: contacts of discs and with walls; median of the stretches.
        events_per_contact: structural and all other events, over contacts.
        simulated: how much time was simulated in the stretches together.
        peak_bytes_per_body: most memory, less that of the same process with four discs; None where that is
            too little to be significant, or the system gives no peak.
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
class Growth(Measured):
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
        """Returns everything in plain types, fit for JSON."""
        found = {"phase": self.phase, "density": self.density, "exponent": self.exponent}
        rows = [asdict(row) for row in self.rows]
        return (
            found | {"exponents_of_steps": list(self.steps), "rows": rows} | {"conditions": self.conditions}
        )


def growth_study(
    results: str | os.PathLike[str],
    phase: Choice,
    bodies: Sequence[int],
    density: float = 0.5,
    *,
    seconds: float = 2.0,
    repeats: int = 1,
    seed: int = 1,
) -> Study:
    """Returns the study ``growth`` of one broad phase; its rows are in the folder ``results``.

    ``seconds`` is the measured CPU time for each number of discs in each of this many processes
    (``repeats``), at least. The phase must be one that another process finds.

    Raises StudyError for what cannot be run.
    """
    ((name, options),) = phases_with_options([phase])
    tables = shipped_tables("growth") | {"phases": [write_phase(name, options)], "seconds": seconds}
    sizes = sorted({TINY} | {square_at_least(n) for n in bodies})
    tables |= {"seeds": [seed], "repeats": repeats}
    tables["scenes"] = [{"recipe": "grid", "parameters": {"density": density, "bodies": sizes}}]
    return Study(tables, results)


def square_at_least(n: int) -> int:
    """Returns the smallest square number that is at least ``n``: what the recipe ``grid`` can make."""
    return (math.isqrt(max(n, 1) - 1) + 1) ** 2


def read_growth(study: Study) -> Growth:
    """Returns the results of the rows of ``growth_study``, and the conditions of the measurement."""
    plan = study.plan
    seed, density = (plan.scenes[0].combinations[0][name] for name in ("seed", "density"))
    rows: dict[int, list[Mapping[str, Any]]] = {}
    for row in study.rows().to_pylist():
        if row["status"] == "done":
            rows.setdefault(row["bodies"], []).append(json.loads(row["stages"]))
    tiny = rows.pop(TINY)[0]["peaks"] if TINY in rows else {}
    found = tuple(_row(n, runs, tiny) for n, runs in rows.items())
    conditions = environment() | {"seconds": plan.file.seconds, "repeats": plan.file.repeats, "seed": seed}
    conditions |= {"contacts_before": WARM_UP}
    return Growth(write_phase(*plan.phases[0]), density, found, conditions)


def _row(n: int, runs: Sequence[Mapping[str, Any]], tiny: Mapping[str, Any]) -> GrowthRow:
    """Returns the row of ``n`` discs: times of the stretches of all processes, memory of the first."""
    found, stretches = runs[0], [each for run in runs for each in run["stretches"]]
    costs = [each["cpu_seconds"] / each["simulated"] for each in stretches]
    known = [name for name, peak in found["peaks"].items() if peak is not None and name in tiny]
    stages = {name: (found["peaks"][name] - tiny[name]) / n for name in known}
    arrays = {name: size / n for name, size in found["arrays"].items()}
    return GrowthRow(
        bodies=n,
        setup_seconds=statistics.median(run["setup_seconds"] for run in runs),
        cpu_seconds_per_time=statistics.median(costs),
        slowest=max(costs),
        fastest=min(costs),
        contacts_per_cpu_second=statistics.median(e["contacts"] / e["cpu_seconds"] for e in stretches),
        events_per_contact=sum(e["events"] for e in stretches) / sum(e["contacts"] for e in stretches),
        simulated=sum(each["simulated"] for each in stretches),
        peak_bytes_per_body=stages["run"] if stages.get("run", 0.0) * n >= _NOTICEABLE else None,
        stage_bytes_per_body=stages,
        table_bytes_per_body=sum(found["arrays"].values()) / n,
        arrays=arrays,
    )
