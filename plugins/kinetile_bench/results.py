"""Results of a study: means, paired ratios, exponents and crossovers, each with its 95 % interval.

All intervals are Student's, over seeds: the values of each seed (a mean, the logarithm of a
ratio, a slope, the logarithm of a crossing) are a sample of independent numbers, for each seed is another
scene. Ratios are paired: both of a ratio's numbers are of the same scene.
"""

from __future__ import annotations

import math
import statistics
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any, NamedTuple

from kinetile.errors import BadOption, one_of
from kinetile.plugin.choices import write_phase
from kinetile.scene.targets import replacing, writable_target
from kinetile_bench.plan import AXES, StudyPlan
from kinetile_bench.rows import FIXED, parameter_column

LEVEL = 0.95


class Estimate(NamedTuple):
    """A number, its 95 % interval (None where there are too few values), and the number of seeds."""

    value: float
    interval: tuple[float, float] | None
    seeds: int


def mean_of(values: Sequence[float]) -> Estimate:
    """Returns the mean of values, one a seed."""
    middle = statistics.fmean(values)
    if len(values) < 2:
        return Estimate(middle, None, len(values))
    half = student(len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values))
    return Estimate(middle, (middle - half, middle + half), len(values))


def ratio_of(values: Mapping[int, float], base: Mapping[int, float]) -> Estimate | None:
    """Returns the ratio of two quantities, the geometric mean of those of each seed; None without any."""
    logs = [math.log(values[s] / base[s]) for s in values if s in base and values[s] > 0.0 < base[s]]
    return _exp(mean_of(logs)) if logs else None


def fit_exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Returns the exponent of values that grow like a power: the slope over logarithmic axes."""
    return statistics.linear_regression(list(map(math.log, x)), list(map(math.log, y))).slope


def exponent(points: Mapping[int, Mapping[float, float]]) -> Estimate | None:
    """Returns the exponent of a quantity that grows like a power: ``points`` are x and y of each seed.

    It is the mean of the slopes of the seeds that have all x. With one seed the interval is that of a
    straight line through its points. None where there are fewer than two x above 0.
    """
    every = sorted({x for found in points.values() for x in found if x > 0.0})
    lines = [[found.get(x, 0.0) for x in every] for found in points.values()]
    whole = [line for line in lines if min(line, default=0.0) > 0.0]
    if len(every) < 2 or not whole:
        return None
    if len(whole) > 1:
        return mean_of([fit_exponent(every, line) for line in whole])
    slope, error = fit_exponent(every, whole[0]), _error_of_exponent(every, whole[0])
    half = None if error is None else student(len(every) - 2) * error
    return Estimate(slope, None if half is None else (slope - half, slope + half), 1)


def crossover(
    one: Mapping[int, Mapping[float, float]], other: Mapping[int, Mapping[float, float]]
) -> tuple[Estimate, bool] | None:
    """Returns the x at which two quantities are equal, and whether the first is the smaller one below it.

    Between two x the logarithm of the ratio is taken for a straight line over that of x. The interval is over
    the seeds that have one crossing each. None where the mean, or half of the seeds, has none, or several.
    """
    ratios: dict[int, dict[float, float]] = defaultdict(dict)
    by_x: dict[float, list[float]] = defaultdict(list)
    for seed in one.keys() & other.keys():
        for x in one[seed].keys() & other[seed].keys():
            if x > 0.0 and one[seed][x] > 0.0 < other[seed][x]:
                ratios[seed][x] = math.log(one[seed][x] / other[seed][x])
                by_x[x].append(ratios[seed][x])
    middle = {x: statistics.fmean(found) for x, found in by_x.items()}
    crossings = _crossings(middle)
    single = [each[0] for found in ratios.values() if len(each := _crossings(found)) == 1]
    if len(crossings) != 1 or 2 * len(single) <= len(ratios):
        return None
    estimate = Estimate(math.exp(crossings[0]), None, len(single))
    if len(single) > 1:
        estimate = estimate._replace(interval=_exp(mean_of(single)).interval)
    return estimate, middle[min(middle)] < 0.0


def student(freedom: int, level: float = LEVEL) -> float:
    """Returns the value that the absolute Student's t exceeds with probability 1 - level."""
    low, high = 0.0, 1.0
    while _within(high, freedom) < level:
        high *= 2.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _within(middle, freedom) < level else (low, middle)
    return high


def _within(t: float, freedom: int) -> float:
    """Returns the probability that Student's t lies between -t and t: a finite sum for whole numbers."""
    angle = math.atan2(t, math.sqrt(freedom))
    cosine, sine = math.cos(angle), math.sin(angle)
    odd = freedom % 2
    term, total = (cosine, 0.0) if odd else (1.0, 0.0)
    for k in range(1 + odd, freedom, 2):
        total += term
        term *= cosine * cosine * k / (k + 1)
    return 2.0 / math.pi * (angle + sine * total) if odd else sine * total


def _exp(estimate: Estimate) -> Estimate:
    low_high = estimate.interval and (math.exp(estimate.interval[0]), math.exp(estimate.interval[1]))
    return Estimate(math.exp(estimate.value), low_high, estimate.seeds)


def _error_of_exponent(x: Sequence[float], y: Sequence[float]) -> float | None:
    """Returns the standard error of a fitted exponent; None with two points, which any line goes through."""
    if len(x) < 3:
        return None
    logs_x, logs_y = list(map(math.log, x)), list(map(math.log, y))
    slope, height = statistics.linear_regression(logs_x, logs_y)
    rest = math.fsum((b - height - slope * a) ** 2 for a, b in zip(logs_x, logs_y, strict=True))
    return math.sqrt(rest / (len(x) - 2)) / (statistics.pstdev(logs_x) * math.sqrt(len(x)))


def _crossings(points: Mapping[float, float]) -> list[float]:
    """Returns the logarithms of the x at which a quantity, known at some x, goes through 0."""
    found = []
    line = [(math.log(x), points[x]) for x in sorted(points)]
    for (a, before), (b, after) in pairwise(line):
        if (before < 0.0) != (after < 0.0):
            found.append(a + (b - a) * before / (before - after))
    return found


SceneKey = tuple[Any, ...]
"""The values of the varied parameters, in their order."""


@dataclass(frozen=True)
class Quantity:
    """A quantity of a study's rows, by scene, phase and seed.

    Attributes:
        y: the column.
        parameters: the columns that vary, the seed apart.
        phases: the phases, in the order of the study.
        values: of each scene and phase, the values by their seeds; of repeats the mean.
        contacts: of each scene and phase, the contacts of all rows.
        odd: of each scene and phase, the statuses of the rows that are not done.
    """

    y: str
    parameters: tuple[str, ...]
    phases: tuple[str, ...]
    values: Mapping[tuple[SceneKey, str], Mapping[int, float]]
    contacts: Mapping[tuple[SceneKey, str], Sequence[int]]
    odd: Mapping[tuple[SceneKey, str], Sequence[str]]

    @property
    def scenes(self) -> list[SceneKey]:
        """All scenes, in the order of the study."""
        return list(dict.fromkeys(scene for scene, _ in self.values))

    def over(self, x: str) -> dict[tuple[SceneKey, str], dict[int, dict[float, float]]]:
        """Returns, for each choice of the other parameters and phase, x and y of each seed."""
        at = self.parameters.index(x)
        found: dict[tuple[SceneKey, str], dict[int, dict[float, float]]] = {}
        for (scene, phase), values in self.values.items():
            rest = scene[:at] + scene[at + 1 :]
            points = found.setdefault((rest, phase), {})
            for seed, y in values.items():
                points.setdefault(seed, {})[float(scene[at])] = y
        return found

    def numeric(self) -> list[str]:
        """Returns the parameters that vary and are numbers."""
        values = {name: [scene[k] for scene in self.scenes] for k, name in enumerate(self.parameters)}
        return [
            name
            for name, found in values.items()
            if len(set(found)) > 1
            and all(isinstance(each, int | float) and not isinstance(each, bool) for each in found)
        ]


def take_rows(plan: StudyPlan, rows: Any, y: str | None) -> Quantity:
    """Returns a column of the rows of a study, by default of CPU seconds. Raises BadOption for a column
    without numbers."""
    timed = any(scenes.until is not None for scenes in plan.scenes)
    y = y or ("cpu_seconds_per_time" if timed else "cpu_seconds")
    numbers = [f.name for f in rows.schema if str(f.type) in ("int64", "double", "bool")]
    if y not in numbers:
        raise BadOption(f"no column {y!r} of numbers: expected {one_of(y, numbers)}")
    parameters = _varied(plan, rows.column_names)
    found: dict[tuple[SceneKey, str], dict[int, list[float]]] = defaultdict(dict)
    contacts: dict[tuple[SceneKey, str], list[int]] = defaultdict(list)
    odd: dict[tuple[SceneKey, str], list[str]] = defaultdict(list)
    needed = dict.fromkeys((*parameters, "phase", "status", "contacts", y, "seed"))
    for row in rows.select([name for name in needed if name in rows.column_names]).to_pylist():
        group = tuple(row[name] for name in parameters), row["phase"]
        by_seed = found[group]  # also where nothing is done: the scene stands in the table
        if row["status"] != "done":
            odd[group].append(row["status"])
        elif row[y] is not None:
            by_seed.setdefault(row.get("seed") or 0, []).append(float(row[y]))
            contacts[group].append(row["contacts"])
    values = {
        group: {seed: sum(each) / len(each) for seed, each in by_seed.items()}
        for group, by_seed in found.items()
    }
    phases = tuple(write_phase(*each) for each in plan.phases)
    return Quantity(y, parameters, phases, values, contacts, odd)


def table(plan: StudyPlan, rows: Any, y: str | None, x: str | None) -> dict[str, Any]:
    """Returns all results of the rows of a study, in plain types. Raises BadOption."""
    quantity = take_rows(plan, rows, y)
    axis = choose_axis(quantity, x)
    return {
        "y": quantity.y,
        "x": axis,
        "base": quantity.phases[0],
        "parameters": list(quantity.parameters),
        "groups": list(_groups(quantity)),
        "exponents": list(_exponents(quantity, axis)) if axis is not None else [],
        "crossovers": [
            {"over": name, "found": found}
            for name in quantity.numeric()
            if (found := list(_crossovers(quantity, name)))
        ],
    }


def choose_axis(rows: Quantity, x: str | None) -> str | None:
    """Returns the parameter of the x axis: ``x``, or the likeliest one; None where there is none."""
    numeric = rows.numeric()
    if x is None:
        return next((name for name in (*AXES, *numeric) if name in numeric), None)
    if x not in numeric:
        raise BadOption(f"{x!r} is no parameter with several numbers: expected {one_of(x, numeric)}")
    return x


def _varied(plan: StudyPlan, columns: Sequence[str]) -> tuple[str, ...]:
    names = ["recipe"] if len({each.recipe for each in plan.scenes}) > 1 else []
    several = len(plan.scenes) > 1
    for scenes in plan.scenes:
        names += [name for name in (scenes.combinations[0] if several else scenes.varied) if name != "seed"]
    found = [name if name == "recipe" else parameter_column(name) for name in dict.fromkeys(names)]
    return tuple(name for name in found if name in columns and (name == "recipe" or name not in FIXED))


def _groups(rows: Quantity) -> Iterator[dict[str, Any]]:
    for scene in rows.scenes:
        base = rows.values.get((scene, rows.phases[0]), {})
        for phase in rows.phases:
            values, odd = rows.values.get((scene, phase), {}), rows.odd.get((scene, phase), [])
            if not values and not odd:
                continue
            contacts = rows.contacts.get((scene, phase), [])
            found = mean_of(list(values.values())) if values else None
            ratio = ratio_of(values, base) if phase != rows.phases[0] else None
            yield {
                "scene": dict(zip(rows.parameters, scene, strict=True)),
                "phase": phase,
                "rows": len(contacts) + len(odd),
                "odd": ", ".join(f"{odd.count(each)} {each}" for each in dict.fromkeys(odd)),
                "contacts": sum(contacts) / len(contacts) if contacts else None,
                **_in_plain_types(found, "mean", "interval"),
                **_in_plain_types(ratio, "ratio", "ratio_interval"),
            }


def _exponents(rows: Quantity, x: str) -> Iterator[dict[str, Any]]:
    for (rest, phase), points in rows.over(x).items():
        found = exponent(points)
        every = sorted({each for of_seed in points.values() for each in of_seed})
        if len(every) > 1:
            yield {
                "scene": _scene(rows, rest, x),
                "phase": phase,
                "range": [every[0], every[-1]],
                "seeds": found.seeds if found else 0,
                **_in_plain_types(found, "exponent", "interval"),
            }


def _crossovers(rows: Quantity, x: str) -> Iterator[dict[str, Any]]:
    points = rows.over(x)
    for rest in dict.fromkeys(rest for rest, _ in points):
        for one, other in combinations(rows.phases, 2):
            found = crossover(points.get((rest, one), {}), points.get((rest, other), {}))
            if found is not None:
                estimate, first_below = found
                below, above = (one, other) if first_below else (other, one)
                yield {
                    "scene": _scene(rows, rest, x),
                    "below": below,
                    "above": above,
                    "seeds": estimate.seeds,
                    **_in_plain_types(estimate, "at", "interval"),
                }


def _scene(rows: Quantity, rest: SceneKey, x: str) -> dict[str, Any]:
    return dict(zip([name for name in rows.parameters if name != x], rest, strict=True))


def _in_plain_types(estimate: Estimate | None, value: str, interval: str) -> dict[str, Any]:
    if estimate is None:
        return {value: None, interval: None}
    return {value: estimate.value, interval: estimate.interval}


def write_rows(table: Any, path: Path) -> int:
    """Writes an Arrow table to a .csv or .parquet file; returns how many rows it has.

    Raises BadOption for another ending, and OSError where it cannot be written.
    """
    from pyarrow import csv, parquet

    writers = {".csv": csv.write_csv, ".parquet": parquet.write_table}
    if path.suffix not in writers:
        raise BadOption(f"{path} is neither .csv nor .parquet: expected the name of one or the other")
    target = writable_target(path)
    with replacing(target) as file:
        writers[path.suffix](table, file)
    return int(table.num_rows)
