"""From answers to rows: each answer is judged by the exact truth, and the verdicts on a family summed up."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.accuracy.queries.families import Family
from kinetile.accuracy.queries.questions import Queries
from kinetile.accuracy.queries.truth import EPSILON, Encounter
from kinetile.kernel.tables import NEVER

__all__ = ["QUERY_HEADS", "TIE_HEADS", "QueryRow", "TieRow", "Verdict", "judge", "query_row", "tie_row"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class QueryRow:
    """One form on one family. R is the sum of the radii.

    Attributes:
        family, form: their names.
        anchors_apart: whether the two discs of a query are anchored at different ticks.
        queries, hits: how many, and how many of them meet in truth.
        prevalence: the share of hits.
        too_far: contacts not found, but more than 1,024 units of time off, as far as the kernel predicts.
        false_negatives: other contacts that were not found.
        outside_dead_zone: of these, such as the kernel does not document that it neglects.
        deepest_missed: by how much the discs of a false negative come too near, at most; in R.
        deepest_in_zones: the same in units of what the kernel documents that it neglects.
        false_positives: contacts that were found and are none.
        widest_false: the gap at which the discs of a false positive pass, at most; in R.
        error_median, error_p99, error_max: error of the time, the clock's rounding included, times closing
            speed, in R; None where no contact was found.
        exact: the share of times that are the last tick not after the contact: no better can be done.
        ticks_median, ticks_p99, ticks_max: ticks between the answer and that one: the formula's own error.
        late: the share of times that are after the contact.
        depth: by how much the discs have come too near by the computed time, at most; in R.
        depth_separation: the same in units of 2^-53 times the separation at the anchor.
        depth_extent: in units of 2^-53 times separation and largest coordinate together.
        ns_median, ns_p99: CPU nanoseconds a query, over batches.
        batches: how many batches were timed.
    """

    family: str
    form: str
    anchors_apart: bool
    queries: int
    hits: int
    prevalence: float
    too_far: int
    false_negatives: int
    outside_dead_zone: int
    deepest_missed: float
    deepest_in_zones: float
    false_positives: int
    widest_false: float
    error_median: float | None
    error_p99: float | None
    error_max: float | None
    exact: float | None
    ticks_median: float | None
    ticks_p99: float | None
    ticks_max: float | None
    late: float | None
    depth: float
    depth_separation: float
    depth_extent: float
    ns_median: float
    ns_p99: float
    batches: int


QUERY_HEADS = {
    "family": "family",
    "form": "form",
    "queries": "queries",
    "hits": "hits",
    "false_negatives": "missed",
    "outside_dead_zone": "outside dead zone",
    "deepest_missed": "deepest missed / R",
    "false_positives": "false",
    "widest_false": "widest false / R",
    "error_median": "error / R, median",
    "error_p99": "99 %",
    "error_max": "max",
    "exact": "exact tick",
    "ticks_p99": "ticks off, 99 %",
    "late": "late",
    "depth_separation": "depth / 2⁻⁵³ separation",
    "depth_extent": "/ 2⁻⁵³ (separation + coordinate)",
    "ns_median": "ns, median",
    "ns_p99": "99 %",
}


@dataclass(frozen=True)
class TieRow:
    """One form on groups of contacts that are simultaneous in truth.

    Attributes:
        family, form: their names.
        groups, size: how many groups, and of how many contacts each.
        same: the share of groups whose contacts are all given one tick.
        spread: the most ticks between two contacts of a group; None: not all contacts were found.
    """

    family: str
    form: str
    groups: int
    size: int
    same: float
    spread: int | None


TIE_HEADS = {
    "family": "family",
    "form": "form",
    "groups": "groups",
    "size": "contacts each",
    "same": "share with one tick",
    "spread": "ticks apart, at most",
}


class Verdict(NamedTuple):
    """What is true of one answer; lengths in R, ``late`` and ``off`` in ticks, 0 where there is none."""

    hit: bool
    found: bool
    too_far: bool = False
    missed: float = 0.0
    zones: float = 0.0
    passing: float = 0.0
    late: float = 0.0
    error: float = 0.0
    off: float = 0.0
    depth: float = 0.0
    depth_separation: float = 0.0
    depth_extent: float = 0.0


def judge(encounter: Encounter, tick: int) -> Verdict:
    """Compare one answer, a tick or NEVER, with the truth."""
    hit, found, reach = encounter.hit, tick != NEVER, encounter.reach
    if hit and not found and not encounter.foreseeable:
        return Verdict(hit, found, too_far=True)
    if hit and not found:
        overlap = encounter.overlap
        return Verdict(hit, found, missed=overlap / reach, zones=overlap / encounter.dead_zone)
    if not hit:
        return Verdict(hit, found, passing=max(-encounter.overlap, 0.0) / reach if found else 0.0)
    late = encounter.ticks_late(tick)
    depth = max(encounter.depth_by(tick), 0.0)
    return Verdict(
        hit,
        found,
        late=late,
        error=abs(late) * 2.0**-52 * encounter.closing / reach,
        off=abs(tick - encounter.tick),
        depth=depth / reach,
        depth_separation=depth / encounter.separation / EPSILON,
        depth_extent=depth / (encounter.separation + encounter.extent) / EPSILON,
    )


def query_row(
    family: Family, queries: Queries, form: str, verdicts: Iterable[Verdict], times: Floats
) -> QueryRow:
    """Return the row of these verdicts; ``times`` are nanoseconds a query, by batch."""
    table = dict(zip(Verdict._fields, np.array(list(verdicts), dtype=np.float64).T, strict=True))
    hit, found, too_far = (table[name] > 0.0 for name in ("hit", "found", "too_far"))
    right = hit & found

    def quantile(name: str, at: float) -> float | None:
        return float(np.quantile(table[name][right], at)) if right.any() else None

    def share(mask: npt.NDArray[np.bool_]) -> float | None:
        return float(mask[right].mean()) if right.any() else None

    return QueryRow(
        family=family.name,
        form=form,
        anchors_apart=bool((queries.anchor[:, 0] != queries.anchor[:, 1]).any()),
        queries=len(hit),
        hits=int(hit.sum()),
        prevalence=float(hit.mean()),
        too_far=int(too_far.sum()),
        false_negatives=int((hit & ~found & ~too_far).sum()),
        outside_dead_zone=int((table["zones"] > 1.0).sum()),
        deepest_missed=float(table["missed"].max()),
        deepest_in_zones=float(table["zones"].max()),
        false_positives=int((found & ~hit).sum()),
        widest_false=float(table["passing"].max()),
        error_median=quantile("error", 0.5),
        error_p99=quantile("error", 0.99),
        error_max=quantile("error", 1.0),
        exact=share(table["off"] == 0.0),
        ticks_median=quantile("off", 0.5),
        ticks_p99=quantile("off", 0.99),
        ticks_max=quantile("off", 1.0),
        late=share(table["late"] > 0.0),
        depth=float(table["depth"].max()),
        depth_separation=float(table["depth_separation"].max()),
        depth_extent=float(table["depth_extent"].max()),
        ns_median=float(np.median(times)),
        ns_p99=float(np.quantile(times, 0.99)),
        batches=len(times),
    )


def tie_row(family: Family, form: str, answers: npt.NDArray[np.int64], size: int) -> TieRow:
    """Return the row of answers (m,) to groups of ``size`` queries, one after the other; a last part of a
    group is left out."""
    groups = answers[: len(answers) // size * size].reshape(-1, size)
    spread = groups.max(axis=1) - groups.min(axis=1)
    found = bool((groups != NEVER).all())
    return TieRow(
        family=family.name,
        form=form,
        groups=len(groups),
        size=size,
        same=float((spread == 0).mean()),
        spread=int(spread.max()) if found else None,
    )
