"""What decides a query: the filter in double, the closer look, or integers; and what each of them costs.

The kernel's functions are composed anew, as they are, but for the call by which each hands on what it leaves
open: in its place is a mark. So what counts how often a stage decides is the code that decides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import FunctionType
from typing import Annotated, Any, cast

import numpy as np
import numpy.typing as npt

from kinetile.kernel.certificates.closer import look_closer
from kinetile.kernel.certificates.pair import first_touch
from kinetile.kernel.compiled import hook
from kinetile_accuracy.parts import Column
from kinetile_accuracy.queries.families import Family
from kinetile_accuracy.queries.forms import KERNEL, Form, ask, batch_times, forms
from kinetile_accuracy.queries.questions import Queries
from kinetile_accuracy.wording import number

__all__ = ["STAGES", "StageRow", "deciding", "stage_finding", "stage_row"]

STAGES = ("filter", "closer look", "integers")

FEWEST = 20
"""A stage that decides fewer queries of a family is not timed on it."""

OPEN = -1
"""What stands for an answer that is left to the next stage."""


@dataclass(frozen=True)
class StageRow:
    """What decides the queries of one family in the kernel's form. CPU times, medians over batches."""

    family: Annotated[str, Column("the family's name", "family")]
    queries: Annotated[int, Column("how many", "queries")]
    by_filter: Annotated[float, Column("percent of them that the filter in double decides", "filter %")]
    by_closer: Annotated[float, Column("percent that the closer look decides", "closer %")]
    by_integers: Annotated[float, Column("percent that integers decide", "integers %")]
    ns: Annotated[float, Column("CPU nanoseconds a query, as they come", "ns")]
    ns_filter: Annotated[float | None, Column("of those the filter decides", "filter ns")]
    ns_closer: Annotated[float | None, Column("of those the closer look decides", "closer ns")]
    ns_integers: Annotated[float | None, Column("of those that integers decide", "integers ns")]


@hook
def left_by_filter(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    radius: float,
    radius2: float,
    tick: float,
    per_time: float,
) -> int:
    """Stand in for the closer look."""
    return OPEN


@hook
def left_by_closer(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    radius: float,
    radius2: float,
    tick: float,
    guess: int,
) -> int:
    """Stand in for the integers."""
    return OPEN


def _with(function: Callable[..., Any], **parts: Any) -> Any:
    """Return a hook of a function of the kernel with parts in place of its global names."""
    source = cast(FunctionType, getattr(function, "py_func", function))
    names = {**source.__globals__, **parts}
    made = FunctionType(source.__code__, names, source.__name__, source.__defaults__)
    made.__module__, made.__qualname__ = source.__module__, source.__qualname__
    return hook(made)


filter_alone = _with(first_touch, look_closer=left_by_filter)
closer_alone = _with(look_closer, first_touch_of_integers=left_by_closer)


@hook
def stage(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    radius: float,
    radius2: float,
    tick: float,
    per_time: float,
) -> int:
    """Return 1 if the filter decides, 2 if the closer look does, 3 if integers do."""
    if filter_alone(x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, per_time) != OPEN:
        return 1
    if closer_alone(x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, per_time) != OPEN:
        return 2
    return 3


@cache
def _staged() -> Form:
    """Return the narrow phase's own form, with ``stage`` in place of the tick after the later anchor."""
    return cast(Form, _with(forms()[KERNEL], first_touch=stage))


def deciding(queries: Queries) -> npt.NDArray[np.int64]:
    """Return (m,) the place in ``STAGES`` of what decides each query."""
    stages: npt.NDArray[np.int64] = ask(_staged(), queries) - queries.anchor.max(axis=1)
    return stages - 1


def stage_row(family: Family, queries: Queries, batch: int, batches: int) -> StageRow:
    """Return what decides the queries of a family, and what that costs, timed in so many batches."""
    by_filter, by_closer, by_integers = (deciding(queries) == each for each in range(len(STAGES)))

    def cost(some: Queries) -> float | None:
        if len(some) < FEWEST:
            return None
        times = batch_times({KERNEL: forms()[KERNEL]}, some, min(batch, len(some)), batches)
        return float(np.median(times[KERNEL]))

    return StageRow(
        family=family.name,
        queries=len(queries),
        by_filter=100.0 * float(by_filter.mean()),
        by_closer=100.0 * float(by_closer.mean()),
        by_integers=100.0 * float(by_integers.mean()),
        ns=cost(queries) or 0.0,
        ns_filter=cost(queries.some(by_filter)),
        ns_closer=cost(queries.some(by_closer)),
        ns_integers=cost(queries.some(by_integers)),
    )


def stage_finding(rows: list[StageRow]) -> str:
    """Say what decides, and where that is dear."""
    usual = [row for row in rows if row.by_filter >= 99.0]
    said = f"The filter decides 99 % or more of the queries in {len(usual)} of {len(rows)} families"
    if usual:
        low, high = min(row.ns for row in usual), max(row.ns for row in usual)
        said += f", at {low:.0f} to {high:.0f} ns a query"
    if len(usual) == len(rows):
        return f"{said}."
    dear = max(rows, key=lambda row: row.ns)
    return (
        f"{said}. The dearest family is {dear.family}: the filter decides {number(dear.by_filter)} %, the "
        f"closer look {number(dear.by_closer)} % and integers {number(dear.by_integers)} %, at "
        f"{dear.ns:,.0f} ns a query."
    )
