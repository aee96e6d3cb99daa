"""The exact truth about two discs, against closed forms in fractions and decimals of their own."""

from __future__ import annotations

import math
import random
from decimal import Decimal, localcontext
from fractions import Fraction

import pytest

from kinetile.accuracy.queries.truth import DEAD_ZONE, HORIZON, Encounter, Plan, chain_of_three, line_contacts

UNIT = 1 << 52


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


def test_head_on_the_time_is_exact() -> None:
    met = Encounter(plan(0.0, 0.0, 0.5, 0.0), plan(5.0, 0.0, -0.5, 0.0))
    assert met.hit
    assert met.tick == 3 * UNIT
    assert met.ticks_late(3 * UNIT) == 0.0
    assert met.ticks_late(3 * UNIT + 2) == 2.0
    assert (met.separation, met.reach, met.closing, met.extent) == (5.0, 2.0, 1.0, 5.0)
    assert met.depth_by(3 * UNIT) == 0.0
    assert met.depth_by(3 * UNIT + UNIT // 4) == 0.25
    assert met.depth_by(2 * UNIT) == -1.0


def test_at_random_it_is_what_the_textbook_says_in_120_digits() -> None:
    hits = 0
    for one, two in drawn(500):
        met = Encounter(one, two)
        with localcontext(prec=120):
            wanted = closed_form(one, two)
            assert met.hit == (wanted is not None)
            if wanted is not None:
                assert abs(Decimal(met.contact) / (1 << 160) - wanted) < Decimal("1e-40")
                hits += 1
    assert 100 < hits < 400


def test_its_tick_is_the_last_one_before_the_contact() -> None:
    for one, two in drawn(200, seed=2):
        met = Encounter(one, two)
        if met.hit and met.contact > 0:
            reach = Fraction(one.radius) + Fraction(two.radius)
            before, after = (apart(one, two, met.tick + step) for step in (0, 1))
            assert before[0] ** 2 + before[1] ** 2 >= reach**2
            assert after[0] ** 2 + after[1] ** 2 < reach**2
            assert met.ticks_late(met.tick) <= 0.0 < met.ticks_late(met.tick + 1)


def test_depths_are_those_of_fractions() -> None:
    for one, two in drawn(200, seed=3):
        met = Encounter(one, two)
        reach = Fraction(one.radius) + Fraction(two.radius)
        tick = met.since + random.Random(one.x).randrange(UNIT)
        x, y = apart(one, two, tick)
        along = x * (Fraction(two.vx) - Fraction(one.vx)) + y * (Fraction(two.vy) - Fraction(one.vy))
        if along >= 0:
            continue
        with localcontext(prec=60):
            now, then = (
                decimal(x * x + y * y).sqrt() for x, y in (apart(one, two, t) for t in (met.since, tick))
            )
            allowed = min(now, decimal(reach))
            assert met.depth_by(tick) == pytest.approx(float(allowed - then), rel=1e-14)
            assert met.separation == pytest.approx(float(now), rel=1e-15)


def test_the_overlap_is_how_near_they_would_pass() -> None:
    """Passing at distance 1.5 with radii that sum to 2, then to 1."""
    one, two = plan(0.0, 0.0, 0.25, 0.0), plan(10.0, 1.5, -0.75, 0.0)
    assert Encounter(one, two).overlap == 0.5
    assert Encounter(one._replace(radius=0.25), two._replace(radius=0.75)).overlap == -0.5
    assert Encounter(one, two._replace(vx=0.75)).overlap == pytest.approx(2.0 - math.hypot(10.0, 1.5))
    assert Encounter(one, two._replace(vx=0.25)).overlap == pytest.approx(2.0 - math.hypot(10.0, 1.5))


def test_tangency_is_no_contact_and_an_ulp_less_is() -> None:
    one, two = plan(0.0, 0.0, 0.0, 0.0), plan(10.0, 2.0, -1.0, 0.0)
    assert not Encounter(one, two).hit
    assert Encounter(one, two).overlap == 0.0
    below = Encounter(one, two._replace(y=math.nextafter(2.0, 0.0)))
    assert below.hit
    assert below.overlap == 2.0**-52
    assert below.overlap < below.dead_zone == pytest.approx(DEAD_ZONE * (2.0 + math.hypot(10.0, 2.0)))
    assert not Encounter(one, two._replace(y=math.nextafter(2.0, 3.0))).hit


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
    met = Encounter(plan(0.0, 0.0, 0.0, 0.0), plan(distance, 0.0, *velocity))
    assert met.hit is hit
    if hit:
        assert (met.contact, met.tick) == (0, 0)


def test_discs_that_have_passed_through_each_other_have_overlapped() -> None:
    """Passing at distance 1.5 with radii that sum to 2, nearest after 2 units of time."""
    met = Encounter(plan(0.0, 0.0, 0.0, 0.0), plan(2.0, 1.5, -1.0, 0.0))
    assert met.depth_by(2 * UNIT) == met.depth_by(3 * UNIT) == met.depth_by(100 * UNIT) == 0.5
    assert 0.49 < met.depth_by(2 * UNIT - (UNIT >> 6)) < 0.5


def test_what_discs_overlap_already_is_no_fault_of_an_answer() -> None:
    met = Encounter(plan(0.0, 0.0, 0.0, 0.0), plan(1.5, 0.0, -1.0, 0.0))
    assert met.depth_by(0) == 0.0
    assert met.depth_by(UNIT // 4) == 0.25
    assert met.overlap == 1.5


def test_a_late_clock_changes_nothing() -> None:
    for one, two in drawn(50, seed=4):
        met = Encounter(one, two)
        later = Encounter(*(each._replace(anchor=each.anchor + (1 << 61)) for each in (one, two)))
        assert met.hit == later.hit
        if met.hit:
            assert (met.contact, met.tick + (1 << 61)) == (later.contact, later.tick)


def test_what_is_too_far_off_is_not_to_be_foreseen() -> None:
    near = Encounter(plan(0.0, 0.0, 0.0, 0.0), plan(1000.0, 0.0, -1.0, 0.0))
    far = Encounter(plan(0.0, 0.0, 0.0, 0.0), plan(1026.0, 0.0, -1.0, 0.0))
    assert near.hit
    assert near.foreseeable
    assert far.tick == HORIZON
    assert far.hit
    assert not far.foreseeable


def test_a_disc_between_walls_takes_the_same_time_each_way() -> None:
    contacts = line_contacts([0.5], [0.25], [0.125], [3.0], 1.0, 4)
    assert [contact.time for contact in contacts] == [
        Decimal("1.5"),
        Decimal("4.5"),
        Decimal("7.5"),
        Decimal("10.5"),
    ]
    assert [(contact.a, contact.b) for contact in contacts] == [(0, -2), (0, -1), (0, -2), (0, -1)]
    assert contacts[0].closing == 0.25
    assert contacts[0].ticks_off(UNIT) == UNIT / 2


def test_equal_discs_on_a_line_are_points_that_pass_through_each_other() -> None:
    x, v, radius, width = [0.25, 0.6875], [0.7, -0.4], [0.0625, 0.0625], 1.0
    found = [float(c.time) for c in line_contacts(x, v, radius, [1.0, 1.0], width, 200) if c.b == 1]

    def point(start: float, speed: float, time: float) -> float:
        room = width - 0.25
        place = (start + speed * time) % (2.0 * room)
        return place if place <= room else 2.0 * room - place

    assert len(found) > 50
    for time in found:
        assert point(x[0] - 0.0625, v[0], time) == pytest.approx(point(x[1] - 0.1875, v[1], time), abs=1e-12)


@pytest.mark.parametrize(("power", "pi"), [(0, 3), (1, 31), (2, 314)])
def test_a_heavy_disc_and_a_light_one_at_a_wall_count_the_digits_of_pi(power: int, pi: int) -> None:
    contacts = line_contacts([1.0, 3.0], [0.0, -1.0], [0.1, 0.1], [1.0, 100.0**power], 1e6, 400)
    assert next(n for n, contact in enumerate(contacts) if contact.b == -2) == pi


def test_a_struck_disc_goes_on_along_the_line_of_centres() -> None:
    """Equal masses: at an angle of 45 degrees the one that is struck leaves at right angles to the other."""
    half = math.sqrt(0.5)
    one, two = plan(-4.0, 0.0, 1.0, 0.0, 0.5), plan(half, half, 0.0, 0.0, 0.5)
    third = plan(half + 3.0 * half, half + 3.0 * half, 0.0, 0.0, 0.5)
    chain = chain_of_three((one, two, third), (1.0, 1.0))
    assert chain is not None
    assert float(chain.time) == pytest.approx(4.0 + 2.0 / half, rel=1e-14)
    assert chain.closing == pytest.approx(half, rel=1e-14)
    heavy = chain_of_three((one, two, third), (1e12, 1.0))
    assert heavy is not None
    assert heavy.closing == pytest.approx(2.0 * half, rel=1e-11)
    assert chain_of_three((one._replace(y=-3.0), two, third), (1.0, 1.0)) is None
    assert chain_of_three((one, two, third._replace(x=-8.0)), (1.0, 1.0)) is None
