"""Evidence for the thesis's statements: when measured times decide a question, and ratios of a run's cells.

Times depend on the machine as much as on the phases. The same run, repeated, shows how much is the machine's:
a cell's *unrest* is how many times as long its slowest round took as its fastest. That rounds agree is not
enough: beside a process that fills the caches, naive with 400 discs, which has the most memory, took 2.8
times as long and sweep-tiling did not, in every round alike, with an unrest of 1.42. Of 96 comparisons of two
phases on a scene, on a machine with and without other processes, none was moved by more than the fourth power
of its unrest, and none whose unrest was at most ``QUIET`` by more than ``QUIET``.

A comparison is therefore decided where nine of ten pairs of runs, seed by seed and round by round, agree by
more than that margin. Otherwise it is open, and an open one counts for neither side.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from typing import NamedTuple

from kinetile_bench.results import fit_exponent
from kinetile_bench.thesis import Cell, ThesisBench
from kinetile_bench.thesis.measures import Fit, fits

QUIET = 1.05
"""Unrest up to which the machine counts as quiet, and the ratio that is level then."""

POWER = 4
"""Of a larger unrest, the power that is the ratio that is level."""

AGREEING = 0.9
"""The share of pairs that have to agree."""


class Answer(Enum):
    """The answer to a question: yes, no, or why neither."""

    YES = "yes"
    NO = "no"
    NOT_QUIET = "undecided: the machine was not quiet"
    TOO_CLOSE = "undecided: too close to tell"
    NOT_MEASURED = "undecided: a part is not measured"

    @property
    def mark(self) -> str:
        """The answer in three columns."""
        return {Answer.YES: "yes", Answer.NO: "no ", Answer.NOT_MEASURED: "-  "}.get(self, "?  ")


class Evidence(NamedTuple):
    """Pairs of times, each pair of one seed and one round.

    Attributes:
        logs: natural logarithm of each ratio, or of the ratio of two ratios.
        unrest: slowest over fastest round of one and the same run: of the phase that was moved most, median
            over the seeds.
    """

    logs: tuple[float, ...]
    unrest: float

    def below(self, ratio: float = 1.0) -> Answer:
        """Whether the ratio is below another."""
        quiet = self.unrest <= QUIET
        margin = math.log(QUIET if quiet else self.unrest**POWER)
        differences = [each - math.log(ratio) for each in self.logs]
        enough = AGREEING * len(differences)
        if sum(each < -margin for each in differences) >= enough:
            return Answer.YES
        if sum(each > margin for each in differences) >= enough:
            return Answer.NO
        return Answer.TOO_CLOSE if quiet else Answer.NOT_QUIET

    @property
    def span(self) -> tuple[float, float, float]:
        """The median of the logarithms, and what nine of ten of them are above and below."""
        ordered = sorted(self.logs)
        outside = int((1.0 - AGREEING) * len(ordered) + 1e-9)
        return statistics.median(ordered), ordered[outside], ordered[-1 - outside]

    def __str__(self) -> str:
        return "{:.3g} ({:.3g}-{:.3g})".format(*map(math.exp, self.span))


class StatementPart(NamedTuple):
    """A part of a statement: what it says, whether that holds, and the numbers that decide it."""

    text: str
    answer: Answer
    numbers: str


def by_count(holds: bool) -> Answer:
    """Returns the answer of counts, which are the same on every machine."""
    return Answer.YES if holds else Answer.NO


def all_of(answers: Iterable[Answer]) -> Answer:
    """Returns whether all answers are yes: one no is enough to deny it, an open one leaves it open."""
    given = list(answers)
    for decisive in (Answer.NO, Answer.NOT_QUIET, Answer.TOO_CLOSE, Answer.NOT_MEASURED):
        if decisive in given:
            return decisive
    return Answer.YES


def more_than_half(answers: Sequence[Answer]) -> Answer:
    """Returns whether more than half of the answers are yes, however the open ones are decided."""
    if 2 * answers.count(Answer.YES) > len(answers):
        return Answer.YES
    if 2 * answers.count(Answer.NO) >= len(answers):
        return Answer.NO
    return all_of(answer for answer in answers if answer not in (Answer.YES, Answer.NO))


NAIVE, SAP, SAP2, TILING = "naive", "sap-1d", "sap-2d", "sweep-tiling"
THREE = (NAIVE, SAP, TILING)
"""The phases of the thesis's figures."""

SHORT = {NAIVE: "naive", SAP: "sap", SAP2: "sap-2d", TILING: "tiling"}


Times = Callable[[Cell], Sequence[float]]
"""A time that is taken from a cell, round by round."""


class ThesisScene(NamedTuple):
    """A scene of the benchmark, with all seeds."""

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

    def cases(self, *phases: str) -> list[ThesisScene]:
        """Returns the scenes that all these phases have run, by density from the highest, then by size."""
        return [
            ThesisScene(density, n)
            for density in self.bench.densities
            for n in self.bench.bodies
            if all((density, n, phase) in self._cells for phase in phases)
        ]

    def mean(self, case: ThesisScene, phase: str, count: str) -> float:
        """Returns the mean of a count over the seeds."""
        return statistics.fmean([getattr(cell, count) for cell in self._cells[(*case, phase)].values()])

    def count_ratio(self, case: ThesisScene, one: str, two: str, count: str) -> float:
        """Returns how many times a count under one phase is that under another, the median over the seeds."""
        pairs = [
            (getattr(first, count), getattr(second, count))
            for first, second in self.seed_by_seed(case, (one, two))
        ]
        return statistics.median([a / b if b else 1.0 for a, b in pairs] or [1.0])

    def ratio(self, case: ThesisScene, one: str, two: str, times: Times) -> Evidence:
        """Returns how many times as long one phase takes as another, seed by seed and round by round."""
        pairs = self.seed_by_seed(case, (one, two))
        logs = [
            math.log(a / b)
            for first, second in pairs
            for a, b in zip(times(first), times(second), strict=True)
        ]
        return Evidence(tuple(logs), _unrest(pairs))

    def growth(self, density: float, one: str, two: str) -> Evidence:
        """Returns how many times as much one phase's time grows as another's, from few discs to many.

        That is the difference of their fitted exponents, as a ratio.
        """
        sizes = [case.bodies for case in self.cases(one, two) if case.density == density]
        scenes = [self.seed_by_seed(ThesisScene(density, n), (one, two)) for n in sizes]
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
        """Returns the logarithm of the most discs over the least: what an exponent is multiplied with."""
        sizes = {n for each, n, _ in self._cells if each == density}
        return math.log(max(sizes) / min(sizes))

    def seed_by_seed(self, case: ThesisScene, phases: Sequence[str]) -> list[list[Cell]]:
        """Returns the cells of the phases on a scene, one list for each seed that all of them have run."""
        found = [self._cells[(*case, phase)] for phase in phases]
        return [
            [cells[seed] for cells in found] for seed in found[0] if all(seed in cells for cells in found)
        ]

    def slope(self, density: float, phase: str) -> Fit | None:
        """Returns the exponent of the CPU time over all numbers of discs."""
        found = fits(self.bench, density, phase, "cost")
        return found[0] if found and found[0].exponent is not None else None


def costs(cell: Cell) -> list[float]:
    """Returns CPU seconds for one unit of simulated time, round by round."""
    return [seconds / cell.until for seconds in cell.cpu_seconds]


def costs_of_one(cell: Cell) -> list[float]:
    """Returns CPU seconds for one event, round by round."""
    return [seconds / max(cell.events, 1) for seconds in cell.cpu_seconds]


def _unrest(pairs: Sequence[Sequence[Cell]]) -> float:
    """Returns the unrest of the phase that was moved most, the median over the seeds."""
    return max(statistics.median([cells[k].unrest for cells in pairs]) for k in (0, 1))


def by_density(cases: Iterable[ThesisScene]) -> list[list[ThesisScene]]:
    """Returns the cases in groups of one density each."""
    groups: dict[float, list[ThesisScene]] = {}
    for case in cases:
        groups.setdefault(case.density, []).append(case)
    return list(groups.values())


def plain(density: float) -> str:
    """Returns a density as the thesis's readers write it: .5."""
    return f"{density:g}".removeprefix("0")


def sizes(cases: Sequence[ThesisScene]) -> str:
    """Returns the numbers of discs of cases."""
    return ", ".join(str(case.bodies) for case in cases)


def most_discs(cases: Sequence[ThesisScene]) -> ThesisScene:
    """Returns the case with the most discs at the density of the first."""
    return max((case for case in cases if case.density == cases[0].density), key=lambda case: case.bodies)


def listed(found: Iterable[object]) -> str:
    """Returns things as a list with commas."""
    return ", ".join(map(str, found))


def over(one: str, two: str) -> str:
    """Returns how a ratio of two phases is written."""
    return f"{SHORT[one]}/{SHORT[two]}"
