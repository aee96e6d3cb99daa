"""From answers to rows: each answer is judged by the exact truth, and the verdicts on a family summed up."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.accuracy.parts import Column
from kinetile.accuracy.queries.families import Family
from kinetile.accuracy.queries.questions import Queries
from kinetile.accuracy.queries.truth import EPSILON, Encounter
from kinetile.kernel.tables import NEVER

__all__ = ["QueryRow", "TieRow", "Verdict", "judge", "query_row", "tie_row"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class QueryRow:
    """One form on one family. R is the sum of the radii; errors are None where no contact was found."""

    family: Annotated[str, Column("the family's name", "family")]
    form: Annotated[str, Column("the form's name", "form")]
    anchors_apart: Annotated[bool, Column("whether the discs of a query are anchored at different ticks")]
    queries: Annotated[int, Column("how many", "queries")]
    hits: Annotated[int, Column("how many of them meet in truth", "hits")]
    prevalence: Annotated[float, Column("the share of hits")]
    too_far: Annotated[int, Column("not found, but later than the kernel predicts: 1,024 units of time")]
    false_negatives: Annotated[int, Column("other contacts that were not found", "missed")]
    outside_dead_zone: Annotated[
        int, Column("of these, such as the kernel does not say it neglects", "outside dead zone")
    ]
    deepest_missed: Annotated[float, Column("how much too near discs come unseen", "deepest missed / R")]
    deepest_in_zones: Annotated[float, Column("the same in units of what the kernel says it neglects")]
    false_positives: Annotated[int, Column("contacts that were found and are none", "false")]
    widest_false: Annotated[float, Column("the widest gap at which such discs pass", "widest false / R")]
    error_median: Annotated[
        float | None, Column("error of the time x closing speed / R", "error / R, median")
    ]
    error_p99: Annotated[float | None, Column("the same: 99 % are no larger", "99 %")]
    error_max: Annotated[float | None, Column("the same: the largest", "max")]
    exact: Annotated[float | None, Column("share of times that are the last tick before", "exact tick")]
    ticks_median: Annotated[float | None, Column("ticks between the answer and that one: median")]
    ticks_p99: Annotated[float | None, Column("the same: 99 % are no more", "ticks off, 99 %")]
    ticks_max: Annotated[float | None, Column("the same: the most")]
    late: Annotated[float | None, Column("the share of times that are after the contact", "late")]
    depth: Annotated[float, Column("how much too near discs are by the computed time, at most, in R")]
    depth_separation: Annotated[float, Column("the same by the separation", "depth / 2^-53 separation")]
    depth_extent: Annotated[
        float, Column("by separation and largest coordinate", "/ 2^-53 (separation + coordinate)")
    ]
    depth_proved: Annotated[float, Column("by eta, the proved bound of each query", "/ eta")]
    ns_median: Annotated[float, Column("CPU time of a query over batches: median", "ns, median")]
    ns_p99: Annotated[float, Column("the same: 99 % take no longer", "99 %")]
    batches: Annotated[int, Column("how many batches were timed")]


@dataclass(frozen=True)
class TieRow:
    """One form on groups of contacts that are simultaneous in truth."""

    family: Annotated[str, Column("the family's name", "family")]
    form: Annotated[str, Column("the form's name", "form")]
    groups: Annotated[int, Column("how many groups", "groups")]
    size: Annotated[int, Column("how many contacts in each", "contacts each")]
    same: Annotated[float, Column("groups whose contacts all get one tick", "share with one tick")]
    spread: Annotated[
        int | None,
        Column("between two contacts of a group; none: not all were found", "ticks apart, at most"),
    ]


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
    depth_proved: float = 0.0


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
        depth_proved=depth / encounter.proved,
    )


def query_row(
    family: Family, queries: Queries, form: str, verdicts: Iterable[Verdict], times: Floats
) -> QueryRow:
    """Return the row of these verdicts; ``times`` are nanoseconds a query, by batch."""
    table = dict(zip(Verdict._fields, np.array(list(verdicts), dtype=np.float64).T, strict=True))
    hit, found, too_far = (table[name] > 0.0 for name in ("hit", "found", "too_far"))
    right = hit & found

    def quantiles(name: str, called: str) -> dict[str, Any]:
        levels = {"median": 0.5, "p99": 0.99, "max": 1.0}
        values = table[name][right]
        return {
            f"{called}_{level}": float(np.quantile(values, at)) if right.any() else None
            for level, at in levels.items()
        }

    def share(mask: npt.NDArray[np.bool_]) -> float | None:
        return float(mask[right].mean()) if right.any() else None

    def most(*names: str) -> dict[str, float]:
        return {name: float(table[name].max()) for name in names}

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
        exact=share(table["off"] == 0.0),
        late=share(table["late"] > 0.0),
        ns_median=float(np.median(times)),
        ns_p99=float(np.quantile(times, 0.99)),
        batches=len(times),
        **quantiles("error", "error"),
        **quantiles("off", "ticks"),
        **most("depth", "depth_separation", "depth_extent", "depth_proved"),
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
