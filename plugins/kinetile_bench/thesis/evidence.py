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
from kinetile_bench.thesis import Cell, ThesisBench, ThesisScene

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
    NOT_KNOWN = "not known: one round does not show how quiet the machine was"
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
            over the seeds; infinite where there was one round.
    """

    logs: tuple[float, ...]
    unrest: float

    def below(self, ratio: float = 1.0) -> Answer:
        """Whether the ratio is below another."""
        if self.unrest == math.inf:
            return Answer.NOT_KNOWN
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


def by_count(holds: bool) -> Answer:
    """Returns the answer of counts, which are the same on every machine."""
    return Answer.YES if holds else Answer.NO


def all_of(answers: Iterable[Answer]) -> Answer:
    """Returns whether all answers are yes: one no is enough to deny it, an open one leaves it open."""
    given = list(answers)
    for decisive in (Answer.NO, Answer.NOT_KNOWN, Answer.NOT_QUIET, Answer.TOO_CLOSE, Answer.NOT_MEASURED):
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


Times = Callable[[Cell], Sequence[float]]
"""A time that is taken from a cell, round by round."""


def costs(cell: Cell) -> list[float]:
    """Returns CPU seconds for one unit of simulated time, round by round."""
    return [seconds / cell.until for seconds in cell.cpu_seconds]


def costs_of_one(cell: Cell) -> list[float]:
    """Returns CPU seconds for one event, round by round."""
    return [seconds / max(cell.events, 1) for seconds in cell.cpu_seconds]


def ratio(bench: ThesisBench, scene: ThesisScene, one: str, two: str, times: Times = costs) -> Evidence:
    """Returns how many times as long one phase takes as another, seed by seed and round by round."""
    pairs = bench.seed_by_seed(scene, (one, two))
    logs = [
        math.log(a / b) for first, second in pairs for a, b in zip(times(first), times(second), strict=True)
    ]
    return Evidence(tuple(logs), _unrest(pairs))


def growth(bench: ThesisBench, density: float, one: str, two: str) -> Evidence:
    """Returns how many times as much one phase's time grows as another's, from few discs to many.

    That is the difference of their fitted exponents, as a ratio.
    """
    scenes = [scene for scene in bench.scenes(one, two) if scene.density == density]
    sizes = [scene.bodies for scene in scenes]
    found = [bench.seed_by_seed(scene, (one, two)) for scene in scenes]
    seeds = set.intersection(*({first.seed for first, _ in pairs} for pairs in found))
    found = [[pair for pair in pairs if pair[0].seed in seeds] for pairs in found]

    def slopes(cells: Iterable[Cell]) -> list[float]:
        """The exponents of one phase with one seed, round by round."""
        return [fit_exponent(sizes, times) for times in zip(*map(costs, cells), strict=True)]

    logs = [
        reach(bench, density) * (above - below)
        for pairs in zip(*found, strict=True)
        for above, below in zip(*map(slopes, zip(*pairs, strict=True)), strict=True)
    ]
    return Evidence(tuple(logs), max(map(_unrest, found)))


def reach(bench: ThesisBench, density: float) -> float:
    """Returns the logarithm of the most discs over the least: what an exponent is multiplied with."""
    sizes = {cell.bodies for cell in bench.rows if cell.density == density}
    return math.log(max(sizes) / min(sizes))


def _unrest(pairs: Sequence[Sequence[Cell]]) -> float:
    """Returns the unrest of the phase that was moved most, the median over the seeds."""
    return max(statistics.median(cells[k].unrest for cells in pairs) for k in (0, 1))
