"""How near discs come, and how deep they overlap at a tick, in exact integers.

When they meet is ``arithmetic.pair_tick``, which the test vectors decide (``test_arithmetic.py``).
"""

from __future__ import annotations

import math
from decimal import Decimal, localcontext
from fractions import Fraction

import pytest

from kinetile_accuracy.contact_times.encounter import Encounter
from kinetile_accuracy.contact_times.families import FAMILIES, UNIT
from kinetile_accuracy.specification.arithmetic import UNIT_TICKS, FlightPlan, pair_tick

Plan = tuple[float, float, float, float]
REST = (0.0, 0.0, 0.0, 0.0)


def encounter(one: Plan, two: Plan, radii: tuple[float, float] = (1.0, 1.0)) -> Encounter:
    """Two discs, as (x, y, vx, vy)."""
    return Encounter(FlightPlan(*one, 0, radii[0], UNIT), FlightPlan(*two, 0, radii[1], UNIT))


def distance(one: tuple[Fraction, Fraction], two: tuple[Fraction, Fraction]) -> Decimal:
    square = sum((q - p) ** 2 for p, q in zip(one, two, strict=True))
    return (Decimal(square.numerator) / Decimal(square.denominator)).sqrt()


def test_head_on() -> None:
    met = encounter((0.0, 0.0, 0.5, 0.0), (5.0, 0.0, -0.5, 0.0))
    assert met.contact == 3 * UNIT_TICKS
    assert (met.reach_length, met.closing, met.overlap) == (2.0, 1.0, 2.0)
    assert met.depth_at(3 * UNIT_TICKS) == 0.0
    assert met.depth_at(3 * UNIT_TICKS + UNIT_TICKS // 4) == 0.25
    assert met.depth_at(2 * UNIT_TICKS) == -1.0
    assert met.rho(3 * UNIT_TICKS) == 16 * 2.0**-53 * 5.0


def test_what_discs_overlap_already_is_no_fault_of_an_answer() -> None:
    met = encounter(REST, (1.5, 0.0, -1.0, 0.0))
    assert met.depth_at(0) == 0.0
    assert met.depth_at(UNIT_TICKS // 4) == 0.25


def test_depths_are_those_of_places_in_doubles() -> None:
    (family,) = (family for family in FAMILIES if family.name == "anchors apart")
    for number, plans in enumerate(family.draw(200).plans()):
        met = Encounter(*plans)
        assert met.contact == pair_tick(*plans)
        tick = met.since + UNIT_TICKS * number // 200
        start, end = [], []
        for plan in plans:
            time = (tick - plan.anchor) / UNIT_TICKS
            place = plan.rounded_place(tick, 1.0 / UNIT_TICKS)
            assert place == (plan.x + plan.vx * time, plan.y + plan.vy * time)
            end.append((Fraction(place[0]), Fraction(place[1])))
            x, y = plan.exact_place(met.since, plan.bits)
            start.append((Fraction(x, 1 << plan.bits), Fraction(y, 1 << plan.bits)))
            assert met.rho(tick) >= 16 * 2.0**-53 * max(abs(plan.x), abs(plan.y))
        with localcontext(prec=60):
            allowed = min(distance(*start), Decimal(met.reach) / (1 << met.bits))
            assert met.depth_at(tick) == pytest.approx(float(allowed - distance(*end)), rel=1e-14)


@pytest.mark.parametrize(
    ("vx", "radii", "overlap"),
    [
        (-0.75, (1.0, 1.0), 0.5),
        (-0.75, (0.25, 0.75), -0.5),
        (0.75, (1.0, 1.0), 2.0 - math.hypot(10.0, 1.5)),
        (0.25, (1.0, 1.0), 2.0 - math.hypot(10.0, 1.5)),
    ],
)
def test_the_overlap_is_how_near_they_would_pass(
    vx: float, radii: tuple[float, float], overlap: float
) -> None:
    """Passing at distance 1.5, or parting at once."""
    assert encounter((0.0, 0.0, 0.25, 0.0), (10.0, 1.5, vx, 0.0), radii).overlap == pytest.approx(overlap)


def test_an_ulp_inside_tangency_is_an_overlap() -> None:
    assert encounter(REST, (10.0, 2.0, -1.0, 0.0)).overlap == 0.0
    below = encounter(REST, (10.0, math.nextafter(2.0, 0.0), -1.0, 0.0))
    assert below.contact is not None
    assert below.overlap == 2.0**-52
