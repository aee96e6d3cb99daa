"""The thesis's statements about its benchmark (section 5.3), each compared with the cells of a run.

B1 to B6 and B11 are about time, B7 to B9 about numbers of events, B10 about the method that the thesis left
out. A statement is cut into parts that a number decides. Where the thesis gives no number ("almost
negligible", "many times over") the part says which one was taken.

Counts decide statements about numbers of events. Those about times are decided by the rules of
``kinetile_bench.thesis.evidence``, or not decided. A statement holds if all its parts do, does not if one
does not, and is open otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from kinetile_bench.thesis import ThesisBench
from kinetile_bench.thesis.evidence import (
    NAIVE,
    SAP,
    SAP2,
    SHORT,
    THREE,
    TILING,
    Answer,
    Evidence,
    Facts,
    StatementPart,
    ThesisScene,
    all_of,
    by_count,
    by_density,
    costs,
    costs_of_one,
    listed,
    more_than_half,
    most_discs,
    over,
    plain,
    sizes,
)

MANY = 3.0
"""Bound events for one of the others that count as many times over."""


NEGLIGIBLE = 0.1
"""A difference of exponents that counts as almost negligible."""


def fewest_events(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """Whether naive has the fewest events in all cases."""
    fewest = [
        case for case in cases if all(_more(facts, case, other, NAIVE, "events") for other in THREE[1:])
    ]
    return StatementPart(
        "naive has the fewest events", by_count(len(fewest) == len(cases)), f"in {_of(fewest, cases)} scenes"
    )


def bound_events_prevail(facts: Facts, cases: Sequence[ThesisScene]) -> Iterable[StatementPart]:
    """Whether bound events outnumber the others under sweep-and-prune and sweep-tiling."""
    times = {
        phase: [
            facts.mean(c, phase, "bound_events") / max(facts.mean(c, phase, "contacts"), 1e-9) for c in cases
        ]
        for phase in (SAP, TILING)
    }
    for phase, found in times.items():
        at = cases[found.index(min(found))]
        yield StatementPart(
            f"more bound events than others in every scene under {SHORT[phase]}",
            by_count(min(found) > 1.0),
            f"{min(found):.2f} (density/n {at}) to {max(found):.1f} for one of the others",
        )
    many = [each for found in times.values() for each in found if each >= MANY]
    yield StatementPart(
        f"at least {MANY:g} times as many in more than half of the cases",
        by_count(len(many) > len(cases)),
        f"in {len(many)} of {2 * len(cases)}",
    )


def largest_difference(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """Whether the two differ most in the scene that the thesis names."""
    ratios = {case: facts.count_ratio(case, SAP, TILING, "bound_events") for case in cases}
    (most, ratio), (second, next_ratio) = sorted(ratios.items(), key=lambda item: -item[1])[:2]
    return StatementPart(
        f"bound events {over(SAP, TILING)} are most at density/n .5/400",
        by_count(most == (0.5, 400)),
        f"{ratio:.2f} at {most}, then {next_ratio:.2f} at {second}",
    )


def same_contacts(facts: Facts, cases: Sequence[ThesisScene]) -> Iterable[StatementPart]:
    """Whether contacts do not depend on the method; nothing without a run of all three."""
    runs = [cells for case in cases for cells in facts.seed_by_seed(case, THREE)]
    if not runs:
        return
    counts = [[c.contacts_disc for c in cells] for cells in runs]
    counts += [[c.contacts_wall for c in cells] for cells in runs]
    furthest = max((max(each) - min(each)) / max(*each, 1) for each in counts)
    same = [cells for cells in runs if len({cell.fingerprint for cell in cells}) == 1]
    yield StatementPart(
        "they differ by at most 1 %",
        by_count(furthest <= 0.01),
        f"by at most {100 * furthest:.2g} %; the whole list of contacts is the same, bit for bit, in "
        f"{_of(same, runs)} runs",
    )


def longest_queue(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """The length of naive's queue, which cannot be compared here: a body has one entry under every method.
    Instead, how many partners are looked at for one event."""
    last = most_discs(cases)
    lengths = ", ".join(f"{SHORT[p]} {facts.mean(last, p, 'queue_max'):,.0f}" for p in THREE)
    asked = ", ".join(f"{SHORT[p]} {facts.mean(last, p, 'partners_per_event'):,.1f}" for p in THREE)
    return StatementPart(
        "naive's queue is longest in every scene",
        Answer.NOT_MEASURED,
        f"the queue has one entry a body and none a pair, under every method, at {last}: {lengths}. Partners "
        f"looked at for one event: {asked}",
    )


def _more(facts: Facts, case: ThesisScene, one: str, two: str, quantity: str) -> bool:
    """Whether a quantity is larger, on average, under one phase than under another."""
    return facts.mean(case, one, quantity) > facts.mean(case, two, quantity)


def _of(some: Sequence[object], all_of_them: Sequence[object]) -> str:
    return f"{len(some)} of {len(all_of_them)}"


def tiling_first(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """Whether sweep-tiling is faster than sweep-and-prune, and that than naive."""
    return _in_order(facts, cases, "tiling < sap < naive", ((TILING, SAP), (SAP, NAIVE)))


def naive_first(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """Whether naive is faster than both others."""
    return _in_order(facts, cases, "naive is fastest", ((NAIVE, SAP), (NAIVE, TILING)))


def slopes(facts: Facts, cases: Sequence[ThesisScene]) -> Iterable[StatementPart]:
    """Whether time grows fastest under naive, then sweep-and-prune, then sweep-tiling, at each density."""
    for group in by_density(cases):
        density = group[0].density
        fits = {phase: facts.slope(density, phase) for phase in THREE}
        if len(group) > 1 and all(fits.values()):
            numbers = ", ".join(f"{SHORT[phase]} {fit}" for phase, fit in fits.items() if fit)
            falling = all_of(facts.growth(density, *pair).below() for pair in ((SAP, NAIVE), (TILING, SAP)))
            yield StatementPart(f"at density {plain(density)}", falling, f"exponents {numbers}")


def lead(facts: Facts, cases: Sequence[ThesisScene]) -> Iterable[StatementPart]:
    """Whether sweep-tiling's lead over sweep-and-prune shrinks with the density."""
    found = {
        group[0].density: facts.growth(group[0].density, SAP, TILING)
        for group in by_density(cases)
        if len(group) > 1
    }
    if len(found) > 1:
        differences = listed(_difference(facts, *each) for each in found.items())
        yield StatementPart(
            "the difference in slope shrinks at each step",
            _falling(list(found.values())),
            f"exponents sap - tiling {differences} at {listed(map(plain, found))}",
        )
    n = max((case.bodies for case in cases), default=0)
    largest = [case for case in cases if case.bodies == n]
    if len(largest) > 1:
        heights = [facts.ratio(case, SAP, TILING, costs) for case in largest]
        densities = listed(plain(case.density) for case in largest)
        yield StatementPart(
            f"the difference in height shrinks at each step, with n = {n}",
            _falling(heights),
            f"time {over(SAP, TILING)} {listed(heights)} at {densities}",
        )
    if 0.01 in found:
        distance = found[0.01]._replace(logs=tuple(map(abs, found[0.01].logs)))
        yield StatementPart(
            f"at .01 the slopes differ by at most {NEGLIGIBLE:g}",
            distance.below(math.exp(NEGLIGIBLE * facts.reach(0.01))),
            f"exponents sap - tiling {_difference(facts, 0.01, found[0.01])}",
        )
        sparse = [case for case in cases if case.density == 0.01]
        yield _in_order(facts, sparse, "tiling is faster", ((TILING, SAP),))


def slowest(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """Whether naive takes the most time in most cases."""
    answers = [
        all_of(facts.ratio(case, other, NAIVE, costs).below() for other in THREE[1:]) for case in cases
    ]
    found = [case for case, answer in zip(cases, answers, strict=True) if answer is Answer.YES]
    unclear = len(cases) - len(found) - answers.count(Answer.NO)
    return StatementPart(
        "it takes the most time in more than half of the scenes",
        more_than_half(answers),
        f"in {len(found)} of {len(cases)}"
        + (f", density/n {listed(found)}" if found else "")
        + (f"; {unclear} undecided" if unclear else ""),
    )


def dearest_event(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """Whether an event costs most under naive."""
    last = most_discs(cases)
    micro = ", ".join(f"{SHORT[p]} {facts.mean(last, p, 'microseconds_per_event'):.3g}" for p in THREE)
    cheaper = [facts.ratio(case, p, NAIVE, costs_of_one) for p in THREE[1:] for case in cases]
    return StatementPart(
        "naive's is dearest in every scene",
        all_of(ratio.below() for ratio in cheaper),
        f"the others' are {_range(cheaper)} of it; microseconds at {last}: {micro}",
    )


def dearer_event(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """Whether an event costs more under sweep-tiling than under sweep-and-prune."""
    ratios = [facts.ratio(case, SAP, TILING, costs_of_one) for case in cases]
    return StatementPart(
        "tiling's is dearer than sap's in every scene",
        all_of(ratio.below() for ratio in ratios),
        f"sap's are {_range(ratios)} of it",
    )


def two_axes_slower(facts: Facts, cases: Sequence[ThesisScene]) -> StatementPart:
    """Whether sweep-and-prune on two axes is slower than on one."""
    ratios = [facts.ratio(case, SAP, SAP2, costs) for case in cases]
    answers = [ratio.below() for ratio in ratios]
    faster = [case for case, answer in zip(cases, answers, strict=True) if answer is Answer.NO]
    unclear = len(answers) - answers.count(Answer.YES) - len(faster)
    return StatementPart(
        "in every scene",
        all_of(answers),
        f"time {over(SAP, SAP2)} {_range(ratios)}"
        + (f"; not slower at density/n {listed(faster)}" if faster else "")
        + (f"; {unclear} of {len(cases)} scenes undecided" if unclear else ""),
    )


def _in_order(
    facts: Facts, cases: Sequence[ThesisScene], text: str, pairs: Sequence[tuple[str, str]]
) -> StatementPart:
    """Returns whether in all cases the first of each pair of phases is faster than the second."""
    found = {pair: [facts.ratio(case, *pair, costs) for case in cases] for pair in pairs}
    ratios = [f"{over(*pair)} {listed(ratios)}" for pair, ratios in found.items()]
    return StatementPart(
        f"{text} at density {plain(cases[0].density)}, n = {sizes(cases)}",
        all_of(ratio.below() for ratios in found.values() for ratio in ratios),
        f"time {'; '.join(ratios)}",
    )


def _falling(values: Sequence[Evidence]) -> Answer:
    """Returns whether each value is less than the one before, pair by pair."""
    steps = [
        Evidence(
            tuple(later - earlier for earlier, later in zip(one.logs, two.logs, strict=False)),
            max(one.unrest, two.unrest),
        )
        for one, two in pairwise(values)
    ]
    return all_of(step.below() for step in steps)


def _difference(facts: Facts, density: float, found: Evidence) -> str:
    """Returns a difference of exponents: the median, and what nine of ten pairs are above and below."""
    reach = facts.reach(density)
    return "{:.2f} ({:.2f} to {:.2f})".format(*(each / reach for each in found.span))


def _range(ratios: Sequence[Evidence]) -> str:
    """Returns the smallest and the largest of ratios, by their medians."""
    medians = [math.exp(ratio.span[0]) for ratio in ratios]
    return f"{min(medians):.2g} to {max(medians):.2g}"


class Statement(NamedTuple):
    """A statement of the thesis, and its parts: none where the run has not measured what it is about."""

    name: str
    text: str
    parts: tuple[StatementPart, ...]

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        if not self.parts:
            return "not measured"
        answer = all_of(part.answer for part in self.parts)
        return {Answer.YES: "holds", Answer.NO: "does not hold"}.get(answer, answer.value)

    def as_dict(self) -> dict[str, Any]:
        """Returns everything in plain types."""
        parts = [part._asdict() | {"answer": part.answer.value} for part in self.parts]
        return {"name": self.name, "text": self.text, "verdict": self.verdict, "parts": parts}


def statements(bench: ThesisBench) -> list[Statement]:
    """Returns B1 to B11, decided by the cells of a run."""
    facts = Facts(bench)
    three = facts.cases(*THREE)
    two = facts.cases(SAP, TILING)
    axes = facts.cases(SAP, SAP2)
    dense = [case for case in three if case.density >= 0.25]
    middle = [case for case in three if case.density == 0.125]
    sparse = [case for case in three if case.density == 0.01]
    small = [case for case in middle if case.bodies == 25]
    large = [case for case in middle if case.bodies > 25]
    found = (
        (
            "At densities .5 and .25 sweep-tiling is fastest, then sweep-and-prune, then naive.",
            [tiling_first(facts, group) for group in by_density(dense)],
        ),
        (
            "At density .125 naive is fastest with 25 discs; with more it is sweep-tiling, then "
            "sweep-and-prune, then naive.",
            [naive_first(facts, small), tiling_first(facts, large)] if small and large else [],
        ),
        ("At density .01 naive is fastest.", [naive_first(facts, sparse)] if sparse else []),
        (
            "Time grows fastest with n under naive, then sweep-and-prune, then sweep-tiling, "
            "at every density.",
            slopes(facts, three),
        ),
        (
            "Sweep-tiling's lead over sweep-and-prune, in slope and in height, shrinks with the density; at "
            ".01 the slopes are almost the same, and sweep-tiling is a constant factor faster.",
            lead(facts, three),
        ),
        (
            "Naive has the fewest events and yet takes the most time in most cases.",
            [fewest_events(facts, three), slowest(facts, three)] if three else [],
        ),
        (
            "Under sweep-and-prune and sweep-tiling bound events outnumber the others, often many "
            "times over.",
            bound_events_prevail(facts, two) if two else [],
        ),
        (
            "The two differ most in bound events with 400 discs at density .5.",
            [largest_difference(facts, two)] if len(two) > 1 and (0.5, 400) in two else [],
        ),
        (
            "The numbers of collisions and of wall contacts hardly depend on the method.",
            same_contacts(facts, three),
        ),
        (
            "Sweep-and-prune on two axes is slower than on one.",
            [two_axes_slower(facts, axes)] if axes else [],
        ),
        (
            "An event costs most under naive, because of its queue; under sweep-tiling it costs more than "
            "under sweep-and-prune.",
            [dearest_event(facts, three), longest_queue(facts, three), dearer_event(facts, three)]
            if three
            else [],
        ),
    )
    return [Statement(f"B{k}", text, tuple(parts)) for k, (text, parts) in enumerate(found, start=1)]
