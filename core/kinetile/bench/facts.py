"""The cells of the thesis's benchmark as its statements ask for them: by scene, as ratios, in short words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from kinetile.bench.measures import Fit, Spread, fits, mean, spread
from kinetile.bench.thesis import Cell, ThesisBench

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
    "over",
    "plain",
    "shown",
    "shown_exponent",
    "sizes",
]

NAIVE, SAP, SAP2, TILING = "naive", "sap-1d", "sap-2d", "sweep-tiling"
THREE = (NAIVE, SAP, TILING)
"""The phases of the thesis's figures."""

SHORT = {NAIVE: "naive", SAP: "sap", SAP2: "sap-2d", TILING: "tiling"}


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

    def mean(self, case: Case, phase: str, quantity: Callable[[Cell], float]) -> float:
        """Return the mean of a quantity over the seeds."""
        return mean([quantity(cell) for cell in self._cells[(*case, phase)].values()]).mean

    def ratio(self, case: Case, one: str, two: str, quantity: Callable[[Cell], float]) -> Spread:
        """Return how many times a quantity of one phase is that of another, over the seeds of both."""
        first, second = self._cells[(*case, one)], self._cells[(*case, two)]
        shared = [(quantity(first[seed]), quantity(second[seed])) for seed in first if seed in second]
        return spread([a / b if b else 1.0 for a, b in shared] or [1.0])

    def faster(self, case: Case, one: str, two: str) -> bool:
        """Whether one phase takes less time than another."""
        return self.ratio(case, one, two, lambda cell: cell.cost).median < 1.0

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


def over(one: str, two: str) -> str:
    """Return how a ratio of two phases is written."""
    return f"{SHORT[one]}/{SHORT[two]}"


def shown(ratios: Iterable[Spread]) -> str:
    """Return ratios, with their extremes where those lie on both sides of 1."""
    return ", ".join(
        f"{each.median:.2f}" + (f" ({each.low:.2f} to {each.high:.2f})" if each.low < 1.0 < each.high else "")
        for each in ratios
    )


def shown_exponent(fit: Fit) -> str:
    """Return an exponent with its standard error."""
    if fit.exponent is None:
        return "-"
    return f"{fit.exponent:.2f}" + (f" ± {fit.error:.2f}" if fit.error is not None else "")
