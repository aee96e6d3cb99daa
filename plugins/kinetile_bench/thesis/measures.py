"""Measures of the thesis's benchmark: spreads over seeds, fitted exponents, and the four measures of a
kinetic data structure (thesis, section 2.1) beside their values in theory.

Theory is that of n discs of radius r at density d in the unit square, in equilibrium with mean square speed
1:

* two bounds on one axis pass 2n(n-1) sqrt(2/pi) / (1-2r) times a unit of time, so sweep-and-prune
  has as many bound events on one axis, and twice as many on two;
* sweep-tiling does the part f(l) = 2l - 2l^2 (1 - exp(-1/l)) of it, with l = (1-d) / (2rn) the length over
  which a bound is in sight: nearly all where discs are few and small, and c n^1.5 where they are many;
* discs meet sqrt(2) g sqrt(d) n^1.5 times, with g = (1 - 7d/16) / (1-d)^2 (Enskog, with Henderson's contact
  value).

The readings give totals and maxima of a whole run. ``NOT_MEASURED`` names what they cannot give.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from typing import Any, NamedTuple

from kinetile_bench.results import fit_exponent
from kinetile_bench.thesis import Cell, ThesisBench

NOT_MEASURED = (
    "responsiveness by kind of event, and its worst case: updates are counted over the whole run",
    "the bounds and tiles that a body's certificate stands for, of which the first to fail is awaited: by "
    "construction 4 under sap-1d, 8 under sap-2d, and 6 tiles under sweep-tiling",
    "a certificate for each candidate pair, as in the thesis: there is none; a body looks at its partners",
    "queue operations inside an update",
)


class Spread(NamedTuple):
    """A median over seeds, and the extremes."""

    median: float
    low: float
    high: float


class Mean(NamedTuple):
    """A mean over seeds and its standard error (None where there is one seed)."""

    mean: float
    error: float | None


class Fit(NamedTuple):
    """An exponent over numbers of discs (None where there is nothing to fit), the mean over seeds, its
    error."""

    first: int
    last: int
    exponent: float | None
    error: float | None

    def __str__(self) -> str:
        if self.exponent is None:
            return "-"
        return f"{self.exponent:.2f}" + (f" ± {self.error:.2f}" if self.error is not None else "")


class Measures(NamedTuple):
    """The measures of one phase on one scene, means over seeds; ``in_theory`` None where there is no theory.

    Attributes:
        updates_per_event: new certificates, for one event (responsiveness).
        updates_in_theory: an upper bound of that, from the numbers of bound events and of new plans.
        asked_per_contact: candidate checks, for one contact (responsiveness).
        computed_per_contact: exact solves, for one contact (responsiveness).
        bound_per_contact: bound events for one contact of discs or with a wall (efficiency).
        bound_per_pair_change: bound events for one candidate pair that comes or goes (efficiency).
        pair_change_in_theory: 2 for sap-1d, since every other swap is of two left or two right bounds.
        queue_per_body: the most bodies queued, over n (compactness); at most 1, by construction.
        pairs_per_body: candidate pairs that a body is in, on average (locality).
        pairs_of_one_body: the most at one of the moments at which pairs were counted.
        pairs_in_theory: the mean: n-1, 4rn for sap-1d, below 6 for sweep-tiling.
    """

    updates_per_event: float | None
    updates_in_theory: float | None
    asked_per_contact: float | None
    computed_per_contact: float | None
    bound_per_contact: float | None
    bound_per_pair_change: float | None
    pair_change_in_theory: float | None
    queue_per_body: float
    pairs_per_body: float
    pairs_of_one_body: int
    pairs_in_theory: float | None


def spread(values: Sequence[float]) -> Spread:
    """Returns median and extremes."""
    return Spread(statistics.median(values), min(values), max(values))


def mean(values: Sequence[float]) -> Mean:
    """Returns mean and standard error."""
    several = len(values) > 1
    return Mean(
        statistics.fmean(values), statistics.stdev(values) / math.sqrt(len(values)) if several else None
    )


def ranges(bodies: Sequence[int]) -> list[tuple[int, ...]]:
    """Returns the numbers of discs over which exponents are fitted: all, and the largest two."""
    return [each for each in dict.fromkeys((tuple(bodies), tuple(bodies[-2:]))) if len(each) > 1]


def fits(bench: ThesisBench, density: float, phase: str, quantity: str) -> tuple[Fit, ...]:
    """Returns the exponents of an attribute of the cells over the numbers of discs, fitted seed by seed."""
    found = []
    for bodies in ranges(bench.bodies):
        by_seed: dict[int, list[float]] = {}
        for n in bodies:
            for cell in bench.of(density, n, phase):
                by_seed.setdefault(cell.seed, []).append(getattr(cell, quantity))
        whole = [values for values in by_seed.values() if len(values) == len(bodies) and min(values) > 0.0]
        slopes = [fit_exponent(bodies, values) for values in whole]
        exponent, error = mean(slopes) if slopes else (None, None)
        found.append(Fit(bodies[0], bodies[-1], exponent, error))
    return tuple(found)


def radius(density: float, bodies: int) -> float:
    """Returns the radius of the discs of a scene."""
    return math.sqrt(density / (bodies * math.pi))


def contacts_in_theory(density: float, bodies: int) -> float:
    """Returns the contacts of discs in a unit of time."""
    crowding = (1.0 - 7.0 * density / 16.0) / (1.0 - density) ** 2
    return math.sqrt(2.0 * density) * crowding * math.pow(bodies, 1.5)


def bound_events_in_theory(phase: str, density: float, bodies: int) -> float | None:
    """Returns the bound events in a unit of time, or None for a phase without a theory."""
    r = radius(density, bodies)
    swaps = 2.0 * bodies * (bodies - 1) * math.sqrt(2.0 / math.pi) / (1.0 - 2.0 * r)
    sight = (1.0 - density) / (2.0 * r * bodies)
    seen = 2.0 * sight - 2.0 * sight**2 * (1.0 - math.exp(-1.0 / sight))
    known = {"naive": 0.0, "sap-1d": swaps, "sap-2d": 2.0 * swaps, "sweep-tiling": swaps * seen}
    return known.get(_name(phase))


def measures(cells: Sequence[Cell]) -> Measures:
    """Returns the four measures of the cells of one phase on one scene."""
    first = cells[0]
    name, n, r = _name(first.phase), first.bodies, radius(first.density, first.bodies)
    kinds = (
        *("events", "bound_events", "plan_changes", "pair_changes"),
        *("certificates_updated", "partners_asked", "contacts_computed"),
    )
    total = {kind: sum(getattr(cell, kind) for cell in cells) for kind in kinds}
    pairs = 2.0 * statistics.fmean(cell.pairs_mean for cell in cells) / n
    contacts = total["events"] - total["bound_events"]
    # Of each phase: new certificates for a bound event, and for a new flight plan, at most; pairs of a body.
    theory: dict[str, tuple[float, float, float | None]] = {
        "naive": (0.0, 0.0, n - 1.0),
        "sap-1d": (3.0, 4.0, 4.0 * r * n),
        "sap-2d": (3.0, 8.0, None),
        "sweep-tiling": (3.0, 4.0, 6.0),
    }
    by_bound, by_plan, near = theory.get(name, (math.nan, math.nan, None))
    updates = by_bound * total["bound_events"] + by_plan * total["plan_changes"]
    known = name in theory
    return Measures(
        updates_per_event=_over(total["certificates_updated"], total["events"]),
        updates_in_theory=_over(updates, total["events"]) if known else None,
        asked_per_contact=_over(total["partners_asked"], contacts),
        computed_per_contact=_over(total["contacts_computed"], contacts),
        bound_per_contact=_over(total["bound_events"], contacts),
        bound_per_pair_change=_over(total["bound_events"], total["pair_changes"]),
        pair_change_in_theory={"sap-1d": 2.0}.get(name),
        queue_per_body=max(cell.queue_max for cell in cells) / n,
        pairs_per_body=pairs,
        pairs_of_one_body=max(cell.pairs_of_one_body for cell in cells),
        pairs_in_theory=near,
    )


def summaries(bench: ThesisBench) -> list[dict[str, Any]]:
    """Returns, for each scene and phase, everything that is computed from its cells, in plain types."""
    found = []
    for density in bench.densities:
        for n in bench.bodies:
            for phase in bench.phases:
                cells = bench.of(density, n, phase)
                if not cells:
                    continue
                row: dict[str, Any] = {"density": density, "bodies": n, "phase": phase}
                row["seeds"] = [cell.seed for cell in cells]
                row["cpu_seconds_per_time"] = spread([cell.cost for cell in cells])._asdict()
                row["unrest"] = statistics.median(cell.unrest for cell in cells)
                row["microseconds_per_event"] = spread(
                    [cell.microseconds_per_event for cell in cells]
                )._asdict()
                for kind in ("bound_events", "contacts_disc", "contacts_wall"):
                    rates = [getattr(cell, kind) / cell.until for cell in cells]
                    row[f"{kind}_per_time"] = mean(rates)._asdict()
                    shares = [getattr(cell, kind) / max(cell.events, 1) for cell in cells]
                    row[f"share_{kind}"] = mean(shares)._asdict()
                row["bound_events_in_theory"] = bound_events_in_theory(phase, density, n)
                row["contacts_in_theory"] = contacts_in_theory(density, n)
                row["queue_max"] = max(cell.queue_max for cell in cells)
                row["pairs_mean"] = statistics.fmean(cell.pairs_mean for cell in cells)
                row["pairs_max"] = max(cell.pairs_max for cell in cells)
                row["measures"] = measures(cells)._asdict()
                found.append(row)
    return found


def exponents(bench: ThesisBench) -> list[dict[str, Any]]:
    """Returns the fitted exponents of each phase at each density, in plain types."""
    return [
        {
            "density": density,
            "phase": phase,
            "cpu_seconds": [fit._asdict() for fit in fits(bench, density, phase, "cost")],
            "bound_events": [fit._asdict() for fit in fits(bench, density, phase, "bound_events")],
            "bound_events_in_theory": [_theory(phase, density, bodies) for bodies in ranges(bench.bodies)],
        }
        for density in bench.densities
        for phase in bench.phases
    ]


def _theory(phase: str, density: float, bodies: Sequence[int]) -> float | None:
    """Returns the exponent of the bound events that theory expects."""
    expected = [bound_events_in_theory(phase, density, n) for n in bodies]
    known = [each for each in expected if each]
    return fit_exponent(bodies, known) if len(known) == len(bodies) else None


def _name(phase: str) -> str:
    """Returns a phase's name without its options."""
    return phase.partition(":")[0]


def _over(numerator: float, denominator: float) -> float | None:
    return numerator / denominator if denominator else None
