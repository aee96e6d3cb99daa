"""Encounters in exact integers, against closed forms in fractions and decimals of their own."""

from __future__ import annotations

import math
import random
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import NamedTuple

import pytest

from kinetile_accuracy.contact_times.encounter import Encounter
from kinetile_accuracy.contact_times.families import UNIT as FRAME
from kinetile_accuracy.specification.arithmetic import HORIZON, FlightPlan

UNIT = 1 << 52


class Plan(NamedTuple):
    x: float
    y: float
    vx: float
    vy: float
    anchor: int
    radius: float


def encounter(one: Plan, two: Plan) -> Encounter:
    return Encounter(FlightPlan(*one, FRAME), FlightPlan(*two, FRAME))


def plan(x: float, y: float, vx: float, vy: float, radius: float = 1.0, anchor: int = 0) -> Plan:
    return Plan(x, y, vx, vy, anchor, radius)


def drawn(count: int, seed: int = 1) -> list[tuple[Plan, Plan]]:
    """Discs at random, anchored anywhere within a unit, one in two of them aimed at the other."""
    draw = random.Random(seed)
    pairs = []
    for _ in range(count):
        one = Plan(*(draw.uniform(-1, 1) for _ in range(4)), draw.randrange(UNIT), draw.uniform(0.01, 0.2))
        two = Plan(*(draw.uniform(-3, 3) for _ in range(4)), draw.randrange(UNIT), draw.uniform(0.01, 0.2))
        if draw.random() < 0.5:
            two = two._replace(vx=one.vx + (one.x - two.x) * 0.3, vy=one.vy + (one.y - two.y) * 0.3)
        pairs.append((one, two))
    return pairs


def apart(one: Plan, two: Plan, tick: int | Fraction) -> tuple[Fraction, Fraction]:
    """The separation at a tick, as fractions."""
    places = []
    for each in (one, two):
        since = (tick - each.anchor) / Fraction(UNIT)
        places.append(
            (Fraction(each.x) + Fraction(each.vx) * since, Fraction(each.y) + Fraction(each.vy) * since)
        )
    return places[1][0] - places[0][0], places[1][1] - places[0][1]


def decimal(value: Fraction) -> Decimal:
    return Decimal(value.numerator) / Decimal(value.denominator)


def closed_form(one: Plan, two: Plan) -> Decimal | None:
    """The contact in ticks after the later anchor, by the textbook, in 120 digits."""
    dx, dy = apart(one, two, max(one.anchor, two.anchor))
    vx, vy = Fraction(two.vx) - Fraction(one.vx), Fraction(two.vy) - Fraction(one.vy)
    reach = Fraction(one.radius) + Fraction(two.radius)
    a, b, c = vx * vx + vy * vy, dx * vx + dy * vy, dx * dx + dy * dy - reach * reach
    if b >= 0 or b * b <= a * c:
        return None
    return max((decimal(-b) - decimal(b * b - a * c).sqrt()) / decimal(a), Decimal(0)) * UNIT


def test_head_on() -> None:
    met = encounter(plan(0.0, 0.0, 0.5, 0.0), plan(5.0, 0.0, -0.5, 0.0))
    assert met.contact == 3 * UNIT
    assert (met.reach_length, met.closing, met.overlap) == (2.0, 1.0, 2.0)
    assert met.depth_at(3 * UNIT) == 0.0
    assert met.depth_at(3 * UNIT + UNIT // 4) == 0.25
    assert met.depth_at(2 * UNIT) == -1.0
    assert met.rho(3 * UNIT) == 16 * 2.0**-53 * 5.0


def test_at_random_it_is_what_the_textbook_says_in_120_digits() -> None:
    hits = 0
    for one, two in drawn(500):
        met = encounter(one, two)
        with localcontext(prec=120):
            wanted = closed_form(one, two)
            assert met.contact == (None if wanted is None else met.since + int(wanted))
            hits += wanted is not None
    assert 100 < hits < 400


def test_its_tick_is_the_last_one_before_the_contact() -> None:
    for one, two in drawn(200, seed=2):
        met = encounter(one, two)
        if met.contact is not None and met.contact > met.since:
            reach = Fraction(one.radius) + Fraction(two.radius)
            before, after = (apart(one, two, met.contact + step) for step in (0, 1))
            assert before[0] ** 2 + before[1] ** 2 >= reach**2
            assert after[0] ** 2 + after[1] ** 2 < reach**2


def test_a_contact_at_a_tick_has_that_tick_and_one_a_hair_before_has_the_one_before() -> None:
    """After 256 units; a hair is 2^-1000 of a length."""
    hair = 2.0**-1000
    one, two = plan(0.0, 0.0, 0.0, 0.0), plan(770.0, 0.0, -3.0, 0.0)
    assert encounter(one, two).contact == 256 * UNIT
    assert encounter(one._replace(x=hair), two).contact == 256 * UNIT - 1
    assert encounter(one._replace(x=-hair), two).contact == 256 * UNIT


def test_depths_are_those_of_places_in_doubles() -> None:
    for one, two in drawn(200, seed=3):
        met = encounter(one, two)
        tick = met.since + random.Random(one.x).randrange(UNIT)
        places = [FlightPlan(*each, FRAME).rounded_place(tick, 2.0**-52) for each in (one, two)]
        for each, place in zip((one, two), places, strict=True):
            time = (tick - each.anchor) / UNIT
            assert place == (each.x + each.vx * time, each.y + each.vy * time)
        with localcontext(prec=60):
            reach = decimal(Fraction(one.radius) + Fraction(two.radius))
            far, near = (
                decimal(x * x + y * y).sqrt() for x, y in (apart(one, two, met.since), between(places))
            )
            assert met.depth_at(tick) == pytest.approx(float(min(far, reach) - near), rel=1e-14)
        size = max(abs(value) for value in (one.x, one.y, two.x, two.y))
        assert met.rho(tick) >= 16 * 2.0**-53 * size


def between(places: list[tuple[float, float]]) -> tuple[Fraction, Fraction]:
    (x, y), (x2, y2) = places
    return Fraction(x2) - Fraction(x), Fraction(y2) - Fraction(y)


def test_the_overlap_is_how_near_they_would_pass() -> None:
    """Passing at distance 1.5 with radii that sum to 2, then to 1."""
    one, two = plan(0.0, 0.0, 0.25, 0.0), plan(10.0, 1.5, -0.75, 0.0)
    assert encounter(one, two).overlap == 0.5
    assert encounter(one._replace(radius=0.25), two._replace(radius=0.75)).overlap == -0.5
    assert encounter(one, two._replace(vx=0.75)).overlap == pytest.approx(2.0 - math.hypot(10.0, 1.5))
    assert encounter(one, two._replace(vx=0.25)).overlap == pytest.approx(2.0 - math.hypot(10.0, 1.5))


def test_tangency_is_no_contact_and_an_ulp_less_is() -> None:
    one, two = plan(0.0, 0.0, 0.0, 0.0), plan(10.0, 2.0, -1.0, 0.0)
    assert encounter(one, two).contact is None
    assert encounter(one, two).overlap == 0.0
    below = encounter(one, two._replace(y=math.nextafter(2.0, 0.0)))
    assert below.contact is not None
    assert below.overlap == 2.0**-52
    assert encounter(one, two._replace(y=math.nextafter(2.0, 3.0))).contact is None


@pytest.mark.parametrize(
    ("distance", "velocity", "hit"),
    [
        (2.0, (-1.0, 0.0), True),
        (2.0, (1.0, 0.0), False),
        (2.0, (0.0, 1.0), False),
        (2.0, (0.0, 0.0), False),
        (1.5, (-1.0, 3.0), True),
        (1.5, (1.0, 3.0), False),
        (2.5, (1.0, 0.0), False),
        (2.5, (0.0, 0.0), False),
    ],
)
def test_touching_discs_meet_at_once_if_they_approach(
    distance: float, velocity: tuple[float, float], hit: bool
) -> None:
    met = encounter(plan(0.0, 0.0, 0.0, 0.0), plan(distance, 0.0, *velocity))
    assert met.contact == (0 if hit else None)


def test_what_discs_overlap_already_is_no_fault_of_an_answer() -> None:
    met = encounter(plan(0.0, 0.0, 0.0, 0.0), plan(1.5, 0.0, -1.0, 0.0))
    assert met.depth_at(0) == 0.0
    assert met.depth_at(UNIT // 4) == 0.25


def test_a_late_clock_changes_nothing() -> None:
    for one, two in drawn(50, seed=4):
        met = encounter(one, two)
        later = encounter(*(each._replace(anchor=each.anchor + (1 << 61)) for each in (one, two)))
        assert later.contact == (None if met.contact is None else met.contact + (1 << 61))


def test_from_two_to_the_62_ticks_on_there_is_no_contact() -> None:
    one, two = plan(0.0, 0.0, 0.0, 0.0), plan(1026.0, 0.0, -1.0, 0.0)
    assert encounter(one, two).contact is None
    assert encounter(one, two._replace(x=math.nextafter(1026.0, 0.0))).contact == HORIZON - 1024
