"""The cells of the thesis's benchmark as its statements ask for them: by scene, as ratios, in short words."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from kinetile_bench.measures import Fit, fit_exponent, fits, mean
from kinetile_bench.thesis import Cell, ThesisBench
from kinetile_bench.thesis_statements.evidence import Evidence

__all__ = [
    "NAIVE",
    "SAP",
    "SAP2",
    "SHORT",
    "THREE",
    "TILING",
    "Case",
    "Facts",
    "by_density",
    "costs",
    "costs_of_one",
    "listed",
    "most_discs",
    "over",
    "plain",
    "shown_exponent",
    "sizes",
]

NAIVE, SAP, SAP2, TILING = "naive", "sap-1d", "sap-2d", "sweep-tiling"
THREE = (NAIVE, SAP, TILING)
"""The phases of the thesis's figures."""

SHORT = {NAIVE: "naive", SAP: "sap", SAP2: "sap-2d", TILING: "tiling"}


Times = Callable[[Cell], Sequence[float]]
"""A time that is taken from a cell, round by round."""


class Case(NamedTuple):
    """A scene of the benchmark, whatever the seed."""

    density: float
    bodies: int

    def __str__(self) -> str:
        return f"{plain(self.density)}/{self.bodies}"


class Facts:
    """The cells of a run, by scene and phase."""

    def __init__(self, bench: ThesisBench) -> None:
        self.bench = bench
        self._cells: dict[tuple[float, int, str], dict[int, Cell]] = {}
        for cell in bench.cells:
            of_seeds = self._cells.setdefault((cell.density, cell.bodies, cell.phase), {})
            of_seeds[cell.seed] = cell

    def cases(self, *phases: str) -> list[Case]:
        """Return the scenes that all these phases have run, by density from the highest, then by size."""
        return [
            Case(density, n)
            for density in self.bench.densities
            for n in self.bench.bodies
            if all((density, n, phase) in self._cells for phase in phases)
        ]

    def mean(self, case: Case, phase: str, count: Callable[[Cell], float]) -> float:
        """Return the mean of a count over the seeds."""
        return mean([count(cell) for cell in self._cells[(*case, phase)].values()]).mean

    def count_ratio(self, case: Case, one: str, two: str, count: Callable[[Cell], float]) -> float:
        """Return how many times a count under one phase is that under another, the median over the seeds."""
        pairs = [(count(first), count(second)) for first, second in self.seed_by_seed(case, (one, two))]
        return statistics.median([a / b if b else 1.0 for a, b in pairs] or [1.0])

    def ratio(self, case: Case, one: str, two: str, times: Times) -> Evidence:
        """Return how many times as long one phase takes as another, seed by seed and round by round."""
        pairs = self.seed_by_seed(case, (one, two))
        logs = [
            math.log(a / b)
            for first, second in pairs
            for a, b in zip(times(first), times(second), strict=True)
        ]
        return Evidence(tuple(logs), _unrest(pairs))

    def growth(self, density: float, one: str, two: str) -> Evidence:
        """Return how many times as much one phase's time grows as another's, from few discs to many.

        That is the difference of their fitted exponents, as a ratio.
        """
        sizes = [case.bodies for case in self.cases(one, two) if case.density == density]
        scenes = [self.seed_by_seed(Case(density, n), (one, two)) for n in sizes]
        seeds = set.intersection(*({first.seed for first, _ in pairs} for pairs in scenes))
        scenes = [[pair for pair in pairs if pair[0].seed in seeds] for pairs in scenes]
        reach = self.reach(density)
        logs = [
            reach * (fit_exponent(sizes, above) - fit_exponent(sizes, below))
            for cells in zip(*scenes, strict=True)
            for above, below in zip(
                zip(*(costs(first) for first, _ in cells), strict=True),
                zip(*(costs(second) for _, second in cells), strict=True),
                strict=True,
            )
        ]
        return Evidence(tuple(logs), max(map(_unrest, scenes)))

    def reach(self, density: float) -> float:
        """Return the logarithm of the most discs over the least: what an exponent is multiplied with."""
        sizes = {n for each, n, _ in self._cells if each == density}
        return math.log(max(sizes) / min(sizes))

    def seed_by_seed(self, case: Case, phases: Sequence[str]) -> list[list[Cell]]:
        """Return the cells of the phases on a scene, one list for each seed that all of them have run."""
        found = [self._cells[(*case, phase)] for phase in phases]
        return [
            [cells[seed] for cells in found] for seed in found[0] if all(seed in cells for cells in found)
        ]

    def slope(self, density: float, phase: str) -> Fit | None:
        """Return the exponent of the CPU time over all numbers of discs."""
        found = fits(self.bench, density, phase, lambda cell: cell.cost)
        return found[0] if found and found[0].exponent is not None else None


def costs(cell: Cell) -> list[float]:
    """Return CPU seconds for one unit of simulated time, round by round."""
    return [seconds / cell.until for seconds in cell.cpu_seconds]


def costs_of_one(cell: Cell) -> list[float]:
    """Return CPU seconds for one event, round by round."""
    return [seconds / max(cell.events, 1) for seconds in cell.cpu_seconds]


def _unrest(pairs: Sequence[Sequence[Cell]]) -> float:
    """Return the unrest of the phase that was moved most, the median over the seeds."""
    return max(statistics.median([cells[k].unrest for cells in pairs]) for k in (0, 1))


def by_density(cases: Iterable[Case]) -> list[list[Case]]:
    """Return the cases in groups of one density each."""
    groups: dict[float, list[Case]] = {}
    for case in cases:
        groups.setdefault(case.density, []).append(case)
    return list(groups.values())


def plain(density: float) -> str:
    """Return a density as the thesis's readers write it: .5."""
    return f"{density:g}".removeprefix("0")


def sizes(cases: Sequence[Case]) -> str:
    """Return the numbers of discs of cases."""
    return ", ".join(str(case.bodies) for case in cases)


def most_discs(cases: Sequence[Case]) -> Case:
    """Return the case with the most discs at the density of the first."""
    return max((case for case in cases if case.density == cases[0].density), key=lambda case: case.bodies)


def listed(found: Iterable[object]) -> str:
    """Return things as a list with commas."""
    return ", ".join(map(str, found))


def over(one: str, two: str) -> str:
    """Return how a ratio of two phases is written."""
    return f"{SHORT[one]}/{SHORT[two]}"


def shown_exponent(fit: Fit) -> str:
    """Return an exponent with its standard error."""
    if fit.exponent is None:
        return "-"
    return f"{fit.exponent:.2f}" + (f" ± {fit.error:.2f}" if fit.error is not None else "")
