"""Whether measured times decide a question, or leave it open.

Times are the machine's as much as the phases'. The same run, repeated, shows how much is the machine's: a
cell's *unrest* is how many times as long its slowest round took as its fastest. That rounds agree is not
enough: beside a process that fills the caches, naive with 400 discs, which has the most memory, took 2.8
times as long and sweep-tiling did not, in every round alike, with an unrest of 1.42. Of 96 comparisons of two
phases on a scene, on a machine with and without other processes, none was moved by more than the fourth power
of its unrest, and none whose unrest was at most ``QUIET`` by more than ``QUIET``.

A comparison is therefore decided where nine of ten pairs of runs, seed by seed and round by round, agree by
more than that margin. Otherwise it is open, and what is open is not counted for either side.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from enum import Enum
from typing import NamedTuple

__all__ = [
    "AGREEING",
    "POWER",
    "QUIET",
    "Answer",
    "Evidence",
    "Part",
    "all_of",
    "more_than_half",
    "of_counts",
]

QUIET = 1.05
"""Unrest up to which the machine counts as quiet, and the ratio that is level then."""

POWER = 4
"""Of a larger unrest, the power that is the ratio that is level."""

AGREEING = 0.9
"""The share of pairs that have to agree."""


class Answer(Enum):
    """What is to be said of a question: yes, no, or why neither."""

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


class Part(NamedTuple):
    """A part of a statement: what it says, whether that holds, and the numbers that decide it."""

    text: str
    answer: Answer
    numbers: str


def of_counts(holds: bool) -> Answer:
    """Return the answer of counts, which are the same on every machine."""
    return Answer.YES if holds else Answer.NO


def all_of(answers: Iterable[Answer]) -> Answer:
    """Return whether all answers are yes: one no is enough to deny it, what is open leaves it open."""
    given = list(answers)
    for decisive in (Answer.NO, Answer.NOT_QUIET, Answer.TOO_CLOSE, Answer.NOT_MEASURED):
        if decisive in given:
            return decisive
    return Answer.YES


def more_than_half(answers: Sequence[Answer]) -> Answer:
    """Return whether more than half of the answers are yes, whatever becomes of those that are open."""
    if 2 * answers.count(Answer.YES) > len(answers):
        return Answer.YES
    if 2 * answers.count(Answer.NO) >= len(answers):
        return Answer.NO
    return all_of(answer for answer in answers if answer not in (Answer.YES, Answer.NO))
