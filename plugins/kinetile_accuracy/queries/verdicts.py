"""From answers to rows: each answer is judged by the exact truth, and the verdicts on a family summed up."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import TICKS
from kinetile.kernel.tables import NEVER
from kinetile_accuracy.parts import Column
from kinetile_accuracy.queries.families import Family
from kinetile_accuracy.queries.truth import Encounter

__all__ = ["QueryRow", "TieRow", "Verdict", "judge", "query_row", "tie_row"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class QueryRow:
    """One form on one family. R is the sum of the radii; errors are None where no contact was found."""

    family: Annotated[str, Column("the family's name", "family")]
    form: Annotated[str, Column("the form's name", "form")]
    queries: Annotated[int, Column("how many", "queries")]
    hits: Annotated[int, Column("how many of them meet in truth", "hits")]
    wrong: Annotated[int, Column("answers that are not the exact tick, or not the exact none", "wrong")]
    missed: Annotated[int, Column("contacts that were not found", "missed")]
    deepest_missed: Annotated[float, Column("how much too near discs come unseen", "deepest missed / R")]
    false: Annotated[int, Column("contacts that were found and are none", "false")]
    widest_false: Annotated[float, Column("the widest gap at which such discs pass", "widest false / R")]
    late: Annotated[float | None, Column("the share of times that are after the contact", "late")]
    ticks_p99: Annotated[float | None, Column("off the exact tick: 99 % are no more", "ticks off, 99 %")]
    ticks_max: Annotated[float | None, Column("the same: the most", "max")]
    error_p99: Annotated[float | None, Column("the same x closing speed / R", "error / R, 99 %")]
    error_max: Annotated[float | None, Column("the same: the largest", "max")]
    depth: Annotated[float, Column("the deepest overlap once both are anchored at the tick", "depth / R")]
    depth_rho: Annotated[float, Column("the same by rho, the bound of that rounding", "depth / rho")]
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
    """What is true of one answer; lengths in R, ``off`` in ticks after the exact one; else 0."""

    hit: bool
    found: bool
    missed: float = 0.0
    passing: float = 0.0
    off: float = 0.0
    error: float = 0.0
    depth: float = 0.0
    depth_rho: float = 0.0


def judge(encounter: Encounter, tick: int) -> Verdict:
    """Compare one answer, a tick or NEVER, with the truth."""
    true, found = encounter.tick, tick != NEVER
    if true is None:
        passing = max(-encounter.overlap, 0.0) / encounter.reach if found else 0.0
        return Verdict(False, found, passing=passing)
    if not found:
        return Verdict(True, False, missed=encounter.overlap / encounter.reach)
    depth = max(encounter.depth_at(tick), 0.0)
    return Verdict(
        True,
        True,
        off=tick - true,
        error=abs(tick - true) / TICKS * encounter.closing / encounter.reach if tick != true else 0.0,
        depth=depth / encounter.reach,
        depth_rho=depth / encounter.rho(tick),
    )


def query_row(family: Family, form: str, verdicts: Iterable[Verdict], times: Floats) -> QueryRow:
    """Return the row of these verdicts; ``times`` are nanoseconds a query, by batch."""
    table = dict(zip(Verdict._fields, np.array(list(verdicts), dtype=np.float64).T, strict=True))
    hit, found = table["hit"] > 0.0, table["found"] > 0.0
    both = hit & found
    off = np.abs(table["off"][both])

    def quantile(values: Floats, at: float) -> float | None:
        return float(np.quantile(values, at)) if both.any() else None

    return QueryRow(
        family=family.name,
        form=form,
        queries=len(hit),
        hits=int(hit.sum()),
        wrong=int((hit != found).sum() + (off > 0.0).sum()),
        missed=int((hit & ~found).sum()),
        deepest_missed=float(table["missed"].max()),
        false=int((found & ~hit).sum()),
        widest_false=float(table["passing"].max()),
        late=float((table["off"][both] > 0.0).mean()) if both.any() else None,
        ticks_p99=quantile(off, 0.99),
        ticks_max=quantile(off, 1.0),
        error_p99=quantile(table["error"][both], 0.99),
        error_max=quantile(table["error"][both], 1.0),
        depth=float(table["depth"].max()),
        depth_rho=float(table["depth_rho"].max()),
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
