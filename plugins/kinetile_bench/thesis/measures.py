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
from kinetile_bench.thesis import Cell, ThesisBench, ThesisScene

NOT_MEASURED = (
    "responsiveness by kind of event, and its worst case: updates are counted over the whole run",
    "the bounds and tiles that a body's certificate stands for, of which the first to fail is awaited: by "
    "construction 4 under sap-1d, 8 under sap-2d, and 6 tiles under sweep-tiling",
    "a certificate for each candidate pair, as in the thesis: there is none; a body looks at its partners",
    "queue operations inside an update",
)


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


def spread(values: Sequence[float]) -> dict[str, float]:
    """Returns median and extremes."""
    return {"median": statistics.median(values), "low": min(values), "high": max(values)}


def mean(values: Sequence[float]) -> dict[str, float | None]:
    """Returns the mean and its standard error, None where there is one value."""
    error = statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else None
    return {"mean": statistics.fmean(values), "error": error}


def ranges(bodies: Sequence[int]) -> list[tuple[int, ...]]:
    """Returns the numbers of discs over which exponents are fitted: all, and the largest two."""
    return [each for each in dict.fromkeys((tuple(bodies), tuple(bodies[-2:]))) if len(each) > 1]


def fits(bench: ThesisBench, density: float, phase: str, quantity: str) -> tuple[Fit, ...]:
    """Returns the exponents of an attribute of the cells over the numbers of discs, fitted seed by seed."""
    found = []
    for bodies in ranges(bench.bodies):
        by_seed: dict[int, list[float]] = {}
        for n in bodies:
            for cell in bench.of(ThesisScene(density, n), phase):
                by_seed.setdefault(cell.seed, []).append(getattr(cell, quantity))
        whole = [values for values in by_seed.values() if len(values) == len(bodies) and min(values) > 0.0]
        slopes = [fit_exponent(bodies, values) for values in whole]
        exponent, error = mean(slopes).values() if slopes else (None, None)
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


def measures(cells: Sequence[Cell]) -> dict[str, float | None]:
    """Returns the four measures of one phase on one scene, means over seeds.

    A value is None where nothing was counted, or where there is no theory.
    """
    first = cells[0]
    name, n, r = _name(first.phase), first.bodies, radius(first.density, first.bodies)

    def total(count: str) -> int:
        return sum(getattr(cell, count) for cell in cells)

    events, bound = total("events"), total("bound_events")
    contacts = events - bound
    # Of each phase: new certificates for a bound event, and for a new flight plan, at most; pairs of a body.
    theory: dict[str, tuple[float, float, float | None]] = {
        "naive": (0.0, 0.0, n - 1.0),
        "sap-1d": (3.0, 4.0, 4.0 * r * n),
        "sap-2d": (3.0, 8.0, None),
        "sweep-tiling": (3.0, 4.0, 6.0),
    }
    by_bound, by_plan, near = theory.get(name, (math.nan, math.nan, None))
    updates = by_bound * bound + by_plan * total("plan_changes")
    return {
        # Responsiveness: new certificates for one event; candidate checks and exact solves for one contact.
        "updates_per_event": _over(total("certificates_updated"), events),
        "updates_in_theory": _over(updates, events) if name in theory else None,  # an upper bound
        "asked_per_contact": _over(total("partners_asked"), contacts),
        "computed_per_contact": _over(total("contacts_computed"), contacts),
        # Efficiency: bound events for one contact, and for one candidate pair that comes or goes: 2 for
        # sap-1d, in theory, since every other swap is of two left or two right bounds.
        "bound_per_contact": _over(bound, contacts),
        "bound_per_pair_change": _over(bound, total("pair_changes")),
        "pair_change_in_theory": {"sap-1d": 2.0}.get(name),
        # Compactness: the most bodies queued, over n; at most 1, by construction.
        "queue_per_body": max(cell.queue_max for cell in cells) / n,
        # Locality: candidate pairs that a body is in, on average, and the most at one of the moments at which
        # pairs were counted. In theory the mean is n-1, 4rn for sap-1d, below 6 for sweep-tiling.
        "pairs_per_body": 2.0 * statistics.fmean(cell.pairs_mean for cell in cells) / n,
        "pairs_of_one_body": max(cell.pairs_of_one_body for cell in cells),
        "pairs_in_theory": near,
    }


def summaries(bench: ThesisBench) -> list[dict[str, Any]]:
    """Returns, for each scene and phase, everything that is computed from its cells, in plain types."""
    return [
        _summary(cells)
        for scene in bench.scenes()
        for phase in bench.phases
        if (cells := bench.of(scene, phase))
    ]


def _summary(cells: Sequence[Cell]) -> dict[str, Any]:
    density, n, phase = cells[0].density, cells[0].bodies, cells[0].phase
    row: dict[str, Any] = {"density": density, "bodies": n, "phase": phase}
    row["seeds"] = [cell.seed for cell in cells]
    row["cpu_seconds_per_time"] = spread([cell.cost for cell in cells])
    row["unrest"] = statistics.median(cell.unrest for cell in cells)
    row["microseconds_per_event"] = spread([cell.microseconds_per_event for cell in cells])
    for kind in ("bound_events", "contacts_disc", "contacts_wall"):
        row[f"{kind}_per_time"] = mean([getattr(cell, kind) / cell.until for cell in cells])
        row[f"share_{kind}"] = mean([getattr(cell, kind) / max(cell.events, 1) for cell in cells])
    return row | {
        "bound_events_in_theory": bound_events_in_theory(phase, density, n),
        "contacts_in_theory": contacts_in_theory(density, n),
        "queue_max": max(cell.queue_max for cell in cells),
        "pairs_mean": statistics.fmean(cell.pairs_mean for cell in cells),
        "pairs_max": max(cell.pairs_max for cell in cells),
        "measures": measures(cells),
    }


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
