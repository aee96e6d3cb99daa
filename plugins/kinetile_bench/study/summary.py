"""The summary of a study's rows: means over seeds with standard errors, and ratios paired by seed."""

import math
import statistics
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

from kinetile.errors import BadOption, one_of
from kinetile_bench.study.plan import StudyPlan
from kinetile_bench.study.task import DONE, Row


def summary_of(plan: StudyPlan, rows: Sequence[Row], y: str | None) -> dict[str, Any]:
    """Returns the results of a column, in plain types: a group for each scene and phase. A value of a seed is
    the mean of its repeats. A ratio is the geometric mean over the seeds, with the error of its logarithm."""
    y = y or "cpu_seconds"
    numbers = {key for row in rows for key, value in row.items() if isinstance(value, int | float)}
    if rows and y not in numbers:
        raise BadOption(f"no column {y!r} of numbers: expected {one_of(y, sorted(numbers))}")
    found: dict[str, tuple[dict[str, Any], dict[str, list[Row]]]] = {}
    for row in rows:
        scene = {"recipe": row["recipe"], **row["parameters"]}
        scene |= {"until": row["until"], "contacts_asked": row["contacts_asked"]}
        scene.pop("seed", None)
        _, of_phases = found.setdefault(repr(scene), (scene, {phase: [] for phase in plan.phases}))
        of_phases[row["phase"]].append(row)
    scenes = [scene for scene, _ in found.values()]
    groups = [{"scene": scene, **group} for scene, rows in found.values() for group in _groups(rows, y)]
    names = dict.fromkeys(name for scene in scenes for name in scene)
    varied = [name for name in names if len({repr(scene.get(name)) for scene in scenes}) > 1]
    return {"y": y, "base": plan.phases[0], "varied": varied, "groups": groups}


def _groups(of_phases: dict[str, list[Row]], y: str) -> Iterator[dict[str, Any]]:
    base: dict[int, float] | None = None
    for phase, rows in of_phases.items():
        by_seed: dict[int, list[float]] = {}
        for row in rows:
            if (value := _number(row, y)) is not None:
                by_seed.setdefault(row["parameters"].get("seed", 0), []).append(value)
        means = {seed: _mean(each)[0] for seed, each in by_seed.items()}
        values = {seed: mean for seed, mean in means.items() if mean is not None}
        pairs = [(value, base.get(seed, 0.0)) for seed, value in values.items()] if base else []
        mean, error = _mean(list(values.values()))
        ratios = (one / other for one, other in pairs if other > 0.0)
        ratio, ratio_error = _mean([math.log(each) for each in ratios if 0.0 < each < math.inf])
        odd = Counter(row["status"] for row in rows if row["status"] != DONE)
        base = values if base is None else base
        yield {
            "phase": phase,
            "rows": len(rows),
            "odd": ", ".join(f"{count} {status}" for status, count in odd.items()),
            "contacts": _mean([each for row in rows if (each := _number(row, "contacts")) is not None])[0],
            "mean": mean,
            "error": error,
            "ratio": None if ratio is None else math.exp(ratio),
            "ratio_error": None if ratio_error is None or ratio is None else math.exp(ratio) * ratio_error,
        }


def _number(row: Row, y: str) -> float | None:
    value = row.get(y) if row["status"] == DONE else None
    with suppress(OverflowError):
        if isinstance(value, int | float) and math.isfinite(value):
            return float(value)
    return None


def _mean(values: Sequence[float]) -> tuple[float | None, float | None]:
    """Returns the mean and its standard error; None for too few or too large values."""
    if not values:
        return None, None
    try:
        error = statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else None
        return statistics.fmean(values), error
    except OverflowError:
        return None, None
