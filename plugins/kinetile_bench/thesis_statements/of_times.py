"""What the thesis says of times: each part of a statement held against the times of a run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

from kinetile_bench.thesis import Cell
from kinetile_bench.thesis_statements.evidence import Answer, Evidence, Part, all_of, more_than_half
from kinetile_bench.thesis_statements.facts import (
    NAIVE,
    SAP,
    SAP2,
    SHORT,
    THREE,
    TILING,
    Case,
    Facts,
    by_density,
    costs,
    costs_of_one,
    listed,
    most_discs,
    over,
    plain,
    shown_exponent,
    sizes,
)

__all__ = [
    "dearer_event",
    "dearest_event",
    "lead",
    "naive_first",
    "slopes",
    "slowest",
    "tiling_first",
    "two_axes_slower",
]

NEGLIGIBLE = 0.1
"""A difference of exponents that counts as almost negligible."""


def tiling_first(facts: Facts, cases: Sequence[Case]) -> Part:
    """Whether sweep-tiling is faster than sweep-and-prune, and that than naive."""
    return _in_order(facts, cases, "tiling < sap < naive", ((TILING, SAP), (SAP, NAIVE)))


def naive_first(facts: Facts, cases: Sequence[Case]) -> Part:
    """Whether naive is faster than both others."""
    return _in_order(facts, cases, "naive is fastest", ((NAIVE, SAP), (NAIVE, TILING)))


def slopes(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    """Whether time grows fastest under naive, then sweep-and-prune, then sweep-tiling, at each density."""
    for group in by_density(cases):
        density = group[0].density
        fits = {phase: facts.slope(density, phase) for phase in THREE}
        if len(group) > 1 and all(fits.values()):
            numbers = ", ".join(f"{SHORT[phase]} {shown_exponent(fit)}" for phase, fit in fits.items() if fit)
            falling = all_of(facts.growth(density, *pair).below() for pair in ((SAP, NAIVE), (TILING, SAP)))
            yield Part(f"at density {plain(density)}", falling, f"exponents {numbers}")


def lead(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    """How sweep-tiling's lead over sweep-and-prune changes with the density."""
    found = {
        group[0].density: facts.growth(group[0].density, SAP, TILING)
        for group in by_density(cases)
        if len(group) > 1
    }
    if len(found) > 1:
        differences = listed(_difference(facts, *each) for each in found.items())
        yield Part(
            "the difference in slope shrinks at each step",
            _falling(list(found.values())),
            f"exponents sap - tiling {differences} at {listed(map(plain, found))}",
        )
    n = max((case.bodies for case in cases), default=0)
    largest = [case for case in cases if case.bodies == n]
    if len(largest) > 1:
        heights = [facts.ratio(case, SAP, TILING, costs) for case in largest]
        densities = listed(plain(case.density) for case in largest)
        yield Part(
            f"the difference in height shrinks at each step, with n = {n}",
            _falling(heights),
            f"time {over(SAP, TILING)} {listed(heights)} at {densities}",
        )
    if 0.01 in found:
        distance = found[0.01]._replace(logs=tuple(map(abs, found[0.01].logs)))
        yield Part(
            f"at .01 the slopes differ by at most {NEGLIGIBLE:g}",
            distance.below(math.exp(NEGLIGIBLE * facts.reach(0.01))),
            f"exponents sap - tiling {_difference(facts, 0.01, found[0.01])}",
        )
        sparse = [case for case in cases if case.density == 0.01]
        yield _in_order(facts, sparse, "tiling is faster", ((TILING, SAP),))


def slowest(facts: Facts, cases: Sequence[Case]) -> Part:
    """Whether naive takes the most time in most cases."""
    answers = [
        all_of(facts.ratio(case, other, NAIVE, costs).below() for other in THREE[1:]) for case in cases
    ]
    found = [case for case, answer in zip(cases, answers, strict=True) if answer is Answer.YES]
    unclear = len(cases) - len(found) - answers.count(Answer.NO)
    return Part(
        "it takes the most time in more than half of the scenes",
        more_than_half(answers),
        f"in {len(found)} of {len(cases)}"
        + (f", density/n {listed(found)}" if found else "")
        + (f"; {unclear} undecided" if unclear else ""),
    )


def dearest_event(facts: Facts, cases: Sequence[Case]) -> Part:
    """Whether an event costs most under naive."""
    last = most_discs(cases)
    micro = ", ".join(f"{SHORT[p]} {facts.mean(last, p, _microseconds):.3g}" for p in THREE)
    cheaper = [facts.ratio(case, p, NAIVE, costs_of_one) for p in THREE[1:] for case in cases]
    return Part(
        "naive's is dearest in every scene",
        all_of(ratio.below() for ratio in cheaper),
        f"the others' are {_range(cheaper)} of it; microseconds at {last}: {micro}",
    )


def dearer_event(facts: Facts, cases: Sequence[Case]) -> Part:
    """Whether an event costs more under sweep-tiling than under sweep-and-prune."""
    ratios = [facts.ratio(case, SAP, TILING, costs_of_one) for case in cases]
    return Part(
        "tiling's is dearer than sap's in every scene",
        all_of(ratio.below() for ratio in ratios),
        f"sap's are {_range(ratios)} of it",
    )


def two_axes_slower(facts: Facts, cases: Sequence[Case]) -> Part:
    """Whether sweep-and-prune on two axes is slower than on one."""
    ratios = [facts.ratio(case, SAP, SAP2, costs) for case in cases]
    answers = [ratio.below() for ratio in ratios]
    faster = [case for case, answer in zip(cases, answers, strict=True) if answer is Answer.NO]
    unclear = len(answers) - answers.count(Answer.YES) - len(faster)
    return Part(
        "in every scene",
        all_of(answers),
        f"time {over(SAP, SAP2)} {_range(ratios)}"
        + (f"; not slower at density/n {listed(faster)}" if faster else "")
        + (f"; {unclear} of {len(cases)} scenes undecided" if unclear else ""),
    )


def _in_order(facts: Facts, cases: Sequence[Case], text: str, pairs: Sequence[tuple[str, str]]) -> Part:
    """Return whether in all cases the first of each pair of phases is faster than the second."""
    found = {pair: [facts.ratio(case, *pair, costs) for case in cases] for pair in pairs}
    ratios = [f"{over(*pair)} {listed(ratios)}" for pair, ratios in found.items()]
    return Part(
        f"{text} at density {plain(cases[0].density)}, n = {sizes(cases)}",
        all_of(ratio.below() for ratios in found.values() for ratio in ratios),
        f"time {'; '.join(ratios)}",
    )


def _falling(values: Sequence[Evidence]) -> Answer:
    """Return whether each value is less than the one before, pair by pair."""
    steps = [
        Evidence(
            tuple(later - earlier for earlier, later in zip(one.logs, two.logs, strict=False)),
            max(one.unrest, two.unrest),
        )
        for one, two in pairwise(values)
    ]
    return all_of(step.below() for step in steps)


def _difference(facts: Facts, density: float, found: Evidence) -> str:
    """Return a difference of exponents: the median, and what nine of ten pairs are above and below."""
    reach = facts.reach(density)
    return "{:.2f} ({:.2f} to {:.2f})".format(*(each / reach for each in found.span))


def _range(ratios: Sequence[Evidence]) -> str:
    """Return the smallest and the largest of ratios, by their medians."""
    medians = [math.exp(ratio.span[0]) for ratio in ratios]
    return f"{min(medians):.2g} to {max(medians):.2g}"


def _microseconds(cell: Cell) -> float:
    return 1e6 * cell.cost * cell.until / max(cell.events, 1)
