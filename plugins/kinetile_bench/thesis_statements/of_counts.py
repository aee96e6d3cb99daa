"""What the thesis says of numbers of events: each part of a statement held against the counts of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from kinetile_bench.thesis import Cell
from kinetile_bench.thesis_statements.evidence import Answer, Part, of_counts
from kinetile_bench.thesis_statements.facts import (
    NAIVE,
    SAP,
    SHORT,
    THREE,
    TILING,
    Case,
    Facts,
    most_discs,
    over,
)

__all__ = [
    "bound_events_prevail",
    "fewest_events",
    "largest_difference",
    "longest_queue",
    "same_contacts",
]

MANY = 3.0
"""Bound events for one of the others that count as many times over."""


def fewest_events(facts: Facts, cases: Sequence[Case]) -> Part:
    """Whether naive has the fewest events in all cases."""
    fewest = [case for case in cases if all(_more(facts, case, other, NAIVE, _events) for other in THREE[1:])]
    return Part(
        "naive has the fewest events", of_counts(len(fewest) == len(cases)), f"in {_of(fewest, cases)} scenes"
    )


def bound_events_prevail(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    """Whether bound events outnumber the others under sweep-and-prune and sweep-tiling."""
    times = {
        phase: [facts.mean(c, phase, _bound) / max(facts.mean(c, phase, _contacts), 1e-9) for c in cases]
        for phase in (SAP, TILING)
    }
    for phase, found in times.items():
        at = cases[found.index(min(found))]
        yield Part(
            f"more bound events than others in every scene under {SHORT[phase]}",
            of_counts(min(found) > 1.0),
            f"{min(found):.2f} (density/n {at}) to {max(found):.1f} for one of the others",
        )
    many = [each for found in times.values() for each in found if each >= MANY]
    yield Part(
        f"at least {MANY:g} times as many in more than half of the cases",
        of_counts(len(many) > len(cases)),
        f"in {len(many)} of {2 * len(cases)}",
    )


def largest_difference(facts: Facts, cases: Sequence[Case]) -> Part:
    """Whether the two differ most in the scene that the thesis names."""
    ratios = {case: facts.count_ratio(case, SAP, TILING, _bound) for case in cases}
    (most, ratio), (second, next_ratio) = sorted(ratios.items(), key=lambda item: -item[1])[:2]
    return Part(
        f"bound events {over(SAP, TILING)} are most at density/n .5/400",
        of_counts(most == (0.5, 400)),
        f"{ratio:.2f} at {most}, then {next_ratio:.2f} at {second}",
    )


def same_contacts(facts: Facts, cases: Sequence[Case]) -> Iterable[Part]:
    """Whether contacts do not depend on the method; nothing without a run of all three."""
    runs = [cells for case in cases for cells in facts.seed_by_seed(case, THREE)]
    if not runs:
        return
    counts = [[c.contacts_disc for c in cells] for cells in runs]
    counts += [[c.contacts_wall for c in cells] for cells in runs]
    furthest = max((max(each) - min(each)) / max(*each, 1) for each in counts)
    same = [cells for cells in runs if len({cell.fingerprint for cell in cells}) == 1]
    yield Part(
        "they differ by at most 1 %",
        of_counts(furthest <= 0.01),
        f"by at most {100 * furthest:.2g} %; the whole list of contacts is the same, bit for bit, in "
        f"{_of(same, runs)} runs",
    )


def longest_queue(facts: Facts, cases: Sequence[Case]) -> Part:
    """What the thesis says of naive's queue cannot be asked where a body has one entry under every method;
    instead, how many partners are looked at for one event."""
    last = most_discs(cases)
    lengths = ", ".join(f"{SHORT[p]} {facts.mean(last, p, _queue):,.0f}" for p in THREE)
    asked = ", ".join(f"{SHORT[p]} {facts.mean(last, p, _asked):,.1f}" for p in THREE)
    return Part(
        "naive's queue is longest in every scene",
        Answer.NOT_MEASURED,
        f"the queue has one entry a body and none a pair, under every method, at {last}: {lengths}. Partners "
        f"looked at for one event: {asked}",
    )


def _more(facts: Facts, case: Case, one: str, two: str, quantity: Callable[[Cell], float]) -> bool:
    """Whether a quantity is larger, on average, under one phase than under another."""
    return facts.mean(case, one, quantity) > facts.mean(case, two, quantity)


def _events(cell: Cell) -> float:
    return float(cell.events)


def _bound(cell: Cell) -> float:
    return float(cell.bound_events)


def _contacts(cell: Cell) -> float:
    return float(cell.contacts_disc + cell.contacts_wall)


def _queue(cell: Cell) -> float:
    return float(cell.queue_max)


def _asked(cell: Cell) -> float:
    return cell.partners_asked / max(cell.events, 1)


def _of(some: Sequence[object], all_of_them: Sequence[object]) -> str:
    return f"{len(some)} of {len(all_of_them)}"
