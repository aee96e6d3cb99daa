"""The thesis's statements about its benchmark (section 5.3), each held against the cells of a run.

B1 to B6 and B11 are about time, B7 to B9 about numbers of events, B10 is what the thesis says of the method
that it left out. A statement is cut into parts that a number decides. Where the thesis gives no number
("almost negligible", "many times over") the part says what was taken.

What is said of numbers of events is decided by counts. What is said of times is decided by the rules of
``kinetile_bench.thesis_statements.evidence``, or not decided. A statement holds if all its parts do, does not
if one does not, and is open otherwise.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from kinetile_bench.thesis import ThesisBench
from kinetile_bench.thesis_statements.evidence import Answer, Part, all_of
from kinetile_bench.thesis_statements.facts import SAP, SAP2, THREE, TILING, Facts, by_density
from kinetile_bench.thesis_statements.of_counts import (
    bound_events_prevail,
    fewest_events,
    largest_difference,
    longest_queue,
    same_contacts,
)
from kinetile_bench.thesis_statements.of_times import (
    dearer_event,
    dearest_event,
    lead,
    naive_first,
    slopes,
    slowest,
    tiling_first,
    two_axes_slower,
)

__all__ = ["Statement", "statements"]


class Statement(NamedTuple):
    """A statement of the thesis, and its parts: none where the run has not measured what it is about."""

    name: str
    text: str
    parts: tuple[Part, ...]

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        if not self.parts:
            return "not measured"
        answer = all_of(part.answer for part in self.parts)
        return {Answer.YES: "holds", Answer.NO: "does not hold"}.get(answer, answer.value)

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types."""
        parts = [part._asdict() | {"answer": part.answer.value} for part in self.parts]
        return {"name": self.name, "text": self.text, "verdict": self.verdict, "parts": parts}


def statements(bench: ThesisBench) -> list[Statement]:
    """Return B1 to B11, decided by the cells of a run."""
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
