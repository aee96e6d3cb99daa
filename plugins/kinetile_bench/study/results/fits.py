"""Means, ratios, exponents and crossovers, each with the interval in which it lies with 95 %.

All intervals are Student's, over seeds: what is computed for each seed by itself (a value, the logarithm of a
ratio, a slope, the logarithm of a crossing) is taken for a sample of independent numbers, which it is, for
each seed is another scene. Ratios are paired: both of a ratio's numbers are of the same scene.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

__all__ = ["Estimate", "crossover", "exponent", "mean_of", "ratio_of", "student"]

LEVEL = 0.95


class Estimate(NamedTuple):
    """A number, the interval in which it lies with 95 % (None: it cannot be said), from so many seeds."""

    value: float
    interval: tuple[float, float] | None
    seeds: int


def mean_of(values: Sequence[float]) -> Estimate:
    """Return the mean of values, one a seed."""
    middle = statistics.fmean(values)
    if len(values) < 2:
        return Estimate(middle, None, len(values))
    half = student(len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values))
    return Estimate(middle, (middle - half, middle + half), len(values))


def ratio_of(values: Mapping[int, float], base: Mapping[int, float]) -> Estimate | None:
    """Return the ratio of two quantities, the geometric mean of those of each seed; None without any."""
    logs = [math.log(values[s] / base[s]) for s in values if s in base and values[s] > 0.0 < base[s]]
    return _exp(mean_of(logs)) if logs else None


def exponent(points: Mapping[int, Mapping[float, float]]) -> Estimate | None:
    """Return the exponent of a quantity that grows like a power: ``points`` are x and y of each seed.

    It is the mean of the slopes of the seeds that have all x. With one seed the interval is that of a
    straight line through its points. None where there are fewer than two x above 0.
    """
    every = {x for found in points.values() for x in found if x > 0.0}
    whole = [
        [(math.log(x), math.log(found[x])) for x in sorted(every)]
        for found in points.values()
        if every <= found.keys() and min(found[x] for x in every) > 0.0
    ]
    if len(every) < 2 or not whole:
        return None
    if len(whole) > 1:
        return mean_of([_slope(line) for line in whole])
    slope, error = _slope(whole[0]), _error_of_slope(whole[0])
    half = None if error is None else student(len(every) - 2) * error
    return Estimate(slope, None if half is None else (slope - half, slope + half), 1)


def crossover(
    one: Mapping[int, Mapping[float, float]], other: Mapping[int, Mapping[float, float]]
) -> tuple[Estimate, bool] | None:
    """Return the x at which two quantities are equal, and whether the first is the smaller one below it.

    Between two x the logarithm of the ratio is taken for a straight line over that of x. The interval is over
    the seeds that have one crossing each. None where the mean, or half of the seeds, has none, or several.
    """
    ratios: dict[int, dict[float, float]] = {}
    for seed in one.keys() & other.keys():
        for x in one[seed].keys() & other[seed].keys():
            if x > 0.0 and one[seed][x] > 0.0 < other[seed][x]:
                ratios.setdefault(seed, {})[x] = math.log(one[seed][x] / other[seed][x])
    by_x: dict[float, list[float]] = {}
    for found in ratios.values():
        for x, ratio in found.items():
            by_x.setdefault(x, []).append(ratio)
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
    """Return what Student's t of so many degrees of freedom exceeds, up or down, with 1 - level."""
    low, high = 0.0, 1.0
    while _within(high, freedom) < level:
        high *= 2.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _within(middle, freedom) < level else (low, middle)
    return high


def _within(t: float, freedom: int) -> float:
    """Return the probability that Student's t lies between -t and t: a finite sum for whole numbers."""
    angle = math.atan2(t, math.sqrt(freedom))
    cosine, sine = math.cos(angle), math.sin(angle)
    odd = freedom % 2
    term, total = (cosine, 0.0) if odd else (1.0, 0.0)
    for k in range(1 + odd, freedom, 2):
        total += term
        term *= cosine * cosine * k / (k + 1)
    return 2.0 / math.pi * (angle + sine * total) if odd else sine * total


def _exp(estimate: Estimate) -> Estimate:
    interval = estimate.interval
    return Estimate(
        math.exp(estimate.value),
        None if interval is None else (math.exp(interval[0]), math.exp(interval[1])),
        estimate.seeds,
    )


def _slope(line: Sequence[tuple[float, float]]) -> float:
    return statistics.linear_regression(*zip(*line, strict=True)).slope


def _error_of_slope(line: Sequence[tuple[float, float]]) -> float | None:
    """Return the standard error of a line's slope; None with two points, which any line goes through."""
    if len(line) < 3:
        return None
    x, y = zip(*line, strict=True)
    slope, height = statistics.linear_regression(x, y)
    rest = math.fsum((b - height - slope * a) ** 2 for a, b in line)
    middle = statistics.fmean(x)
    return math.sqrt(rest / (len(line) - 2) / math.fsum((a - middle) ** 2 for a in x))


def _crossings(points: Mapping[float, float]) -> list[float]:
    """Return the logarithms of the x at which what is given at some x goes through 0."""
    found = []
    line = [(math.log(x), points[x]) for x in sorted(points)]
    for (a, before), (b, after) in pairwise(line):
        if (before < 0.0) != (after < 0.0):
            found.append(a + (b - a) * before / (before - after))
    return found
