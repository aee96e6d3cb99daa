"""The encounter of two discs in integers, and answers to "when do they meet?" compared with it.

Doubles, and ticks of 2^-52, are integers over a power of two; so is all that is made of them by addition and
multiplication. Whether two discs meet is then the sign of an integer, and the tick of their contact a whole
square root and a whole quotient (``specification.arithmetic.PairQuadratic``). The error of an answer is a
length: how near discs come whose contact was missed, and how deep they overlap at a tick. These are roots of
integers, rounded once.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isqrt
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import NEVER
from kinetile_accuracy.sections import Column
from kinetile_accuracy.specification.arithmetic import UNIT_BITS, UNIT_TICKS, FlightPlan, PairQuadratic

Floats = npt.NDArray[np.float64]

EPSILON = 2.0**-53
"""Half the distance from 1 to the next double."""


class Encounter(PairQuadratic):
    """Two discs from the later of their anchors on, where a unit of time is 1.

    Attributes:
        contact: the tick of their contact; None: there is none.
    """

    __slots__ = ("_plans", "contact")

    def __init__(self, one: FlightPlan, two: FlightPlan) -> None:
        super().__init__(one, two)
        self._plans = one, two
        self.contact = self.tick()

    @property
    def reach_length(self) -> float:
        """The sum of the radii, R."""
        return self.reach / (1 << self.bits)

    @property
    def overlap(self) -> float:
        """By how much the paths bring the discs nearer than R from ``since`` on; negative: the gap at which
        they pass."""
        if self.b >= 0:
            return _difference(self.reach**2, self.c + self.reach**2, 1, self.bits)
        cross = self.dx * self.vy - self.dy * self.vx
        return _difference(self.reach**2 * self.a, cross**2, self.a, self.bits)

    @property
    def closing(self) -> float:
        """The speed along the line of centres at the contact; only where there is one."""
        if self.c > 0:
            push, distance = self.b**2 - self.a * self.c, self.reach**2
        else:
            push, distance = self.b**2, self.c + self.reach**2
        return _root(push, 2 * self.bits - UNIT_BITS) / _root(distance, self.bits)

    def depth_at(self, tick: int) -> float:
        """Returns how far the discs overlap once both are anchored at a tick.

        What they overlap at ``since`` does not count; negative: the gap.
        """
        (x, y), (x2, y2) = (plan.rounded_place(tick, 1.0 / UNIT_TICKS) for plan in self._plans)
        bits = max(self.bits, *(_bits(value) for value in (x, y, x2, y2)))
        dx, dy = (_whole(far, bits) - _whole(near, bits) for far, near in ((x2, x), (y2, y)))
        allowed = min(self.c, 0) + self.reach**2 << 2 * (bits - self.bits)
        return _difference(allowed, dx**2 + dy**2, 1, bits)

    def rho(self, tick: int) -> float:
        """Returns the bound of the rounding of both places anchored at a tick: 16 u X, X the largest
        coordinate."""
        return (
            16.0
            * EPSILON
            * max(
                abs(place)
                for plan in self._plans
                for place in (plan.x, plan.y, *plan.rounded_place(tick, 1.0 / UNIT_TICKS))
            )
        )


@dataclass(frozen=True)
class QueryRow:
    """One form on one family. R is the sum of the radii; errors are None where no contact was found."""

    family: Annotated[str, Column("the family's name", "family")]
    form: Annotated[str, Column("the form's name", "form")]
    queries: Annotated[int, Column("how many", "queries")]
    hits: Annotated[int, Column("how many of them meet", "hits")]
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


class Deviation(NamedTuple):
    """One answer beside the exact one; lengths in R, ``off`` in ticks after the exact one; else 0."""

    hit: bool
    found: bool
    missed: float = 0.0
    passing: float = 0.0
    off: float = 0.0
    error: float = 0.0
    depth: float = 0.0
    depth_rho: float = 0.0


def deviation(encounter: Encounter, tick: int) -> Deviation:
    """Compares one answer, a tick or NEVER, with the exact one."""
    exact, found, reach = encounter.contact, tick != NEVER, encounter.reach_length
    if exact is None:
        return Deviation(False, found, passing=max(-encounter.overlap, 0.0) / reach if found else 0.0)
    if not found:
        return Deviation(True, False, missed=encounter.overlap / reach)
    depth = max(encounter.depth_at(tick), 0.0)
    return Deviation(
        True,
        True,
        off=tick - exact,
        error=abs(tick - exact) / UNIT_TICKS * encounter.closing / reach if tick != exact else 0.0,
        depth=depth / reach,
        depth_rho=depth / encounter.rho(tick),
    )


def query_row(family: str, form: str, deviations: Iterable[Deviation], times: Floats) -> QueryRow:
    """Returns the row of the answers of a form to a family; ``times`` are nanoseconds a query, by batch."""
    table = dict(zip(Deviation._fields, np.array(list(deviations), dtype=np.float64).T, strict=True))
    hit, found = table["hit"] > 0.0, table["found"] > 0.0
    both = hit & found
    off = np.abs(table["off"][both])

    def quantile(values: Floats, at: float) -> float | None:
        return float(np.quantile(values, at)) if both.any() else None

    return QueryRow(
        family=family,
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


def _bits(value: float) -> int:
    """Returns the number of binary places of a double."""
    return value.as_integer_ratio()[1].bit_length() - 1


def _whole(value: float, bits: int) -> int:
    """Returns a double times 2^bits, which must be an integer."""
    top, bottom = value.as_integer_ratio()
    return top << (bits - bottom.bit_length() + 1)


def _root(square: int, bits: int) -> float:
    """Returns the square root of an integer, over 2^bits."""
    return isqrt(square << 256) / (1 << (bits + 128))


def _difference(more: int, less: int, over: int, bits: int) -> float:
    """Returns (sqrt(more) - sqrt(less)) / sqrt(over) / 2^bits, without cancellation."""
    if over == 0 or more == less:
        return 0.0
    sum_of_roots = isqrt(more << 256) + isqrt(less << 256)
    return ((more - less) << 256) / (sum_of_roots * isqrt(over << 256) << bits)
