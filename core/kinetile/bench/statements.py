"""The thesis's statements about its benchmark (section 5.3), each held against the cells of a run.

B1 to B6 and B11 are about time, B7 to B9 about numbers of events, B10 is what the thesis says of the method
that it left out. A statement is cut into parts that a number decides. Where the thesis gives no number
("almost negligible", "many times over") the part says what was taken.

Times are compared seed by seed: a phase is faster on a scene if the median of the ratios is below 1. Ratios
whose extremes lie on both sides of 1 are shown with those extremes: there the seeds do not agree, or the
machine was not quiet.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from kinetile.bench.facts import (
    NAIVE,
    SAP,
    SAP2,
    SHORT,
    THREE,
    TILING,
    Case,
    Facts,
    by_density,
    over,
    plain,
    shown,
    shown_exponent,
    sizes,
)
from kinetile.bench.thesis import Cell, ThesisBench

__all__ = ["Part", "Statement", "statements"]

NEGLIGIBLE = 0.1
"""A difference of exponents that counts as almost negligible."""

MANY = 3.0
"""Bound events for one of the others that count as many times over."""


class Part(NamedTuple):
    """A part of a statement: what it says, whether that holds, and the numbers that decide it."""

    text: str
    holds: bool
    numbers: str


class Statement(NamedTuple):
    """A statement of the thesis, and its parts: none where the run has not measured what it is about."""

    name: str
    text: str
    parts: tuple[Part, ...]

    @property
    def holds(self) -> bool | None:
        """Whether all parts hold; None without parts."""
        return all(part.holds for part in self.parts) if self.parts else None

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        return {True: "holds", False: "does not hold", None: "not measured"}[self.holds]

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types."""
        parts = [part._asdict() for part in self.parts]
        return {"name": self.name, "text": self.text, "verdict": self.verdict, "parts": parts}


def statements(bench: ThesisBench) -> list[Statement]:
    """Return B1 to B11, decided by the cells of a run."""
    facts = Facts(bench)
    three = facts.cases(*THREE)
    two = facts.cases(SAP, TILING)
    dense = [case for case in three if case.density >= 0.25]
    middle = [case for case in three if case.density == 0.125]
    sparse = [case for case in three if case.density == 0.01]
    small = [case for case in middle if case.bodies == 25]
    large = [case for case in middle if case.bodies > 25]
    found = (
        (
            "At densities .5 and .25 sweep-tiling is fastest, then sweep-and-prune, then naive.",
            [_tiling_first(facts, group) for group in by_density(dense)],
        ),
        (
            "At density .125 naive is fastest with 25 discs; with more it is sweep-tiling, then "
            "sweep-and-prune, then naive.",
            [_naive_first(facts, small), _tiling_first(facts, large)] if small and large else [],
        ),
        ("At density .01 naive is fastest.", [_naive_first(facts, sparse)] if sparse else []),
        (
            "Time grows fastest with n under naive, then sweep-and-prune, then sweep-tiling, "
            "at every density.",
            _slopes(facts, three),
        ),
        (
            "Sweep-tiling's lead over sweep-and-prune, in slope and in height, shrinks with the density; at "
            ".01 the slopes are almost the same, and sweep-tiling is a constant factor faster.",
            _lead(facts, three),
        ),
        (
            "Naive has the fewest events and yet takes the most time in most cases.",
            _fewest_and_slowest(facts, three) if three else [],
        ),
        (
            "Under sweep-and-prune and sweep-tiling bound events outnumber the others, often many "
            "times over.",
            _bound_events_prevail(facts, two) if two else [],
        ),
        (
            "The two differ most in bound events with 400 discs at density .5.",
            _largest_difference(facts, two) if len(two) > 1 and (0.5, 400) in two else [],
        ),
        (
            "The numbers of collisions and of wall contacts hardly depend on the method.",
            _same_contacts(facts, three),
        ),
        (
            "Sweep-and-prune on two axes is slower than on one.",
            _two_axes_slower(facts, facts.cases(SAP, SAP2)),
        ),
        (
            "An event costs most under naive, because of its queue; under sweep-tiling it costs more than "
            "under sweep-and-prune.",
            _cost_of_an_event(facts, three) if three else [],
        ),
    )
    return [Statement(f"B{k}", text, tuple(parts)) for k, (text, parts) in enumerate(found, start=1)]


def _tiling_first(facts: Facts, cases: Sequence[Case]) -> Part:
    return _in_order(facts, cases, "tiling < sap < naive", ((TILING, SAP), (SAP, NAIVE)))


def _naive_first(facts: Facts, cases: Sequence[Case]) -> Part:
    return _in_order(facts, cases, "naive is fastest", ((NAIVE, SAP), (NAIVE, TILING)))


def _in_order(facts: Facts, cases: Sequence[Case], text: str, pairs: Sequence[tuple[str, str]]) -> Part:
    """Return whether in all cases the first of each pair of phases is faster than the second."""
    ratios = [f"{over(*pair)} {shown(facts.ratio(case, *pair, _cost) for case in cases)}" for pair in pairs]
    return Part(
        f"{text} at density {plain(cases[0].density)}, n = {sizes(cases)}",
        all(facts.faster(case, *pair) for case in cases for pair in pairs),
        f"time {'; '.join(ratios)}",
    )


def _slopes(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    for group in by_density(cases):
        fits = {phase: facts.slope(group[0].density, phase) for phase in THREE}
        found = [fit.exponent for fit in fits.values() if fit and fit.exponent is not None]
        if len(found) == len(THREE):
            numbers = ", ".join(f"{SHORT[phase]} {shown_exponent(fit)}" for phase, fit in fits.items() if fit)
            falling = found[0] > found[1] > found[2]
            yield Part(f"at density {plain(group[0].density)}", falling, f"exponents {numbers}")


def _lead(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    slopes: dict[float, float] = {}
    listed = []
    for group in by_density(cases):
        sap, tiling = facts.slope(group[0].density, SAP), facts.slope(group[0].density, TILING)
        if sap and tiling and sap.exponent is not None and tiling.exponent is not None:
            slopes[group[0].density] = sap.exponent - tiling.exponent
            error = math.hypot(sap.error, tiling.error) if sap.error and tiling.error else None
            listed.append(f"{sap.exponent - tiling.exponent:.2f}" + (f" ± {error:.2f}" if error else ""))
    at = "at " + ", ".join(map(plain, slopes))
    if len(slopes) > 1:
        yield Part(
            "the difference in slope shrinks at each step",
            _falling(list(slopes.values())),
            f"exponents sap - tiling {', '.join(listed)} {at}",
        )
        n = max(case.bodies for case in cases)
        heights = [facts.ratio(Case(density, n), SAP, TILING, _cost) for density in slopes]
        yield Part(
            f"the difference in height shrinks at each step, with n = {n}",
            _falling([ratio.median for ratio in heights]),
            f"time {over(SAP, TILING)} {shown(heights)} {at}",
        )
    if 0.01 in slopes:
        difference = slopes[0.01]
        text = f"at .01 the slopes differ by at most {NEGLIGIBLE:g}"
        yield Part(text, abs(difference) <= NEGLIGIBLE, f"exponents sap - tiling {difference:.2f}")
        sparse = [case for case in cases if case.density == 0.01]
        yield _in_order(facts, sparse, "tiling is faster", ((TILING, SAP),))


def _fewest_and_slowest(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    fewest = [case for case in cases if all(_more(facts, case, other, NAIVE, _events) for other in THREE[1:])]
    yield Part("naive has the fewest events", len(fewest) == len(cases), f"in {_of(fewest, cases)} scenes")
    slowest = [case for case in cases if all(facts.faster(case, other, NAIVE) for other in THREE[1:])]
    yield Part(
        "it takes the most time in more than half of the scenes",
        2 * len(slowest) > len(cases),
        f"in {_of(slowest, cases)}" + (f", density/n {_listed(slowest)}" if slowest else ""),
    )


def _bound_events_prevail(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    times = {
        phase: [facts.mean(c, phase, _bound) / max(facts.mean(c, phase, _contacts), 1e-9) for c in cases]
        for phase in (SAP, TILING)
    }
    for phase, found in times.items():
        at = cases[found.index(min(found))]
        yield Part(
            f"more bound events than others in every scene under {SHORT[phase]}",
            min(found) > 1.0,
            f"{min(found):.2f} (density/n {at}) to {max(found):.1f} for one of the others",
        )
    many = [each for found in times.values() for each in found if each >= MANY]
    yield Part(
        f"at least {MANY:g} times as many in more than half of the cases",
        len(many) > len(cases),
        f"in {len(many)} of {2 * len(cases)}",
    )


def _largest_difference(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    ratios = {case: facts.ratio(case, SAP, TILING, _bound).median for case in cases}
    (most, ratio), (second, next_ratio) = sorted(ratios.items(), key=lambda item: -item[1])[:2]
    yield Part(
        f"bound events {over(SAP, TILING)} are most at density/n .5/400",
        most == (0.5, 400),
        f"{ratio:.2f} at {most}, then {next_ratio:.2f} at {second}",
    )


def _same_contacts(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    runs = [cells for case in cases for cells in facts.seed_by_seed(case, THREE)]
    if not runs:
        return
    counts = [[c.contacts_disc for c in cells] for cells in runs]
    counts += [[c.contacts_wall for c in cells] for cells in runs]
    furthest = max((max(each) - min(each)) / max(*each, 1) for each in counts)
    same = [cells for cells in runs if len({cell.fingerprint for cell in cells}) == 1]
    yield Part(
        "they differ by at most 1 %",
        furthest <= 0.01,
        f"by at most {100 * furthest:.2g} %; the whole list of contacts is the same, bit for bit, in "
        f"{_of(same, runs)} runs",
    )


def _two_axes_slower(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    if cases:
        ratios = [facts.ratio(case, SAP2, SAP, _cost).median for case in cases]
        faster = [case for case, ratio in zip(cases, ratios, strict=True) if ratio <= 1.0]
        yield Part(
            "in every scene",
            not faster,
            f"time {over(SAP2, SAP)} {min(ratios):.2f} to {max(ratios):.2f}"
            + (f"; not slower at density/n {_listed(faster)}" if faster else ""),
        )


def _cost_of_an_event(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    last = cases[0]._replace(bodies=max(case.bodies for case in cases if case.density == cases[0].density))
    costs = ", ".join(f"{SHORT[p]} {1e6 * facts.mean(last, p, _cost_of_one):.3g}" for p in THREE)
    dearer = [facts.ratio(case, NAIVE, p, _cost_of_one).median for p in THREE[1:] for case in cases]
    yield Part(
        "naive's is dearest in every scene",
        min(dearer) > 1.0,
        f"{min(dearer):.1f} to {max(dearer):.0f} times the others'; microseconds at {last}: {costs}",
    )
    longest = [case for case in cases if all(_more(facts, case, NAIVE, p, _queue) for p in THREE[1:])]
    lengths = ", ".join(f"{SHORT[p]} {facts.mean(last, p, _queue):,.0f}" for p in THREE)
    updates = ", ".join(f"{SHORT[p]} {facts.mean(last, p, _updates):,.0f}" for p in THREE)
    yield Part(
        "naive's queue is longest in every scene",
        len(longest) == len(cases),
        f"in {_of(longest, cases)}; at {last}: {lengths}. Failure times set anew for one event: {updates}",
    )
    ratios = [facts.ratio(case, TILING, SAP, _cost_of_one).median for case in cases]
    yield Part(
        "tiling's is dearer than sap's in every scene",
        min(ratios) > 1.0,
        f"{min(ratios):.2f} to {max(ratios):.2f} times",
    )


def _falling(values: Sequence[float]) -> bool:
    return all(one > two for one, two in pairwise(values))


def _more(facts: Facts, case: Case, one: str, two: str, quantity: Any) -> bool:
    """Whether a quantity is larger, on average, under one phase than under another."""
    return facts.mean(case, one, quantity) > facts.mean(case, two, quantity)


def _cost(cell: Cell) -> float:
    return cell.cost


def _cost_of_one(cell: Cell) -> float:
    return cell.cost * cell.until / max(cell.events, 1)


def _events(cell: Cell) -> float:
    return float(cell.events)


def _bound(cell: Cell) -> float:
    return float(cell.bound_events)


def _contacts(cell: Cell) -> float:
    return float(cell.contacts_disc + cell.contacts_wall)


def _queue(cell: Cell) -> float:
    return float(cell.queue_max)


def _updates(cell: Cell) -> float:
    return cell.certificates_updated / max(cell.events, 1)


def _of(some: Sequence[Any], all_of_them: Sequence[Any]) -> str:
    return f"{len(some)} of {len(all_of_them)}"


def _listed(cases: Iterable[Case]) -> str:
    return ", ".join(map(str, cases))
