"""The families of queries are what they say, in exact fractions."""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest

from kinetile_accuracy.hard_cases.families import FAMILIES, LATER, TIED, Queries
from kinetile_accuracy.specification.arithmetic import SPAN, FlightPlan, pair_tick

NAMES = [family.name for family in FAMILIES]
COUNT = 240


def queries(name: str, count: int = COUNT) -> Queries:
    return next(family for family in FAMILIES if family.name == name).draw(count)


def radius(plan: FlightPlan) -> Fraction:
    return Fraction(plan.radius, 1 << plan.bits)


def squares(one: FlightPlan, two: FlightPlan) -> tuple[Fraction, Fraction, Fraction]:
    """Exact squares of: separation, passing distance, sum of the radii. For discs of one anchor."""
    assert one.anchor == two.anchor
    dx, dy = Fraction(two.x) - Fraction(one.x), Fraction(two.y) - Fraction(one.y)
    vx, vy = Fraction(two.vx) - Fraction(one.vx), Fraction(two.vy) - Fraction(one.vy)
    reach = radius(one) + radius(two)
    return dx**2 + dy**2, (dx * vy - dy * vx) ** 2 / (vx**2 + vy**2), reach**2


def relative_speeds(asked: Queries) -> np.ndarray:
    return np.hypot(*(asked.velocity[:, 1] - asked.velocity[:, 0]).T)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_drawn_the_same_each_time_and_has_what_it_takes(name: str) -> None:
    asked, again = queries(name), queries(name)
    for field in ("position", "velocity", "radius", "anchor"):
        assert getattr(asked, field).tobytes() == getattr(again, field).tobytes()
    assert asked.position.shape == asked.velocity.shape == (COUNT, 2, 2)
    assert asked.radius.shape == asked.anchor.shape == (COUNT, 2)
    assert (asked.radius > 0.0).all()
    assert np.isfinite(asked.position).all()
    hits = sum(pair_tick(*plans) is not None for plans in asked.plans())
    assert hits > 0.25 * COUNT
    if name not in ("far apart", "simultaneous"):
        assert hits < 0.75 * COUNT


def test_names_are_not_used_twice() -> None:
    assert len(set(NAMES)) == len(NAMES)


@pytest.mark.parametrize(("name", "off"), [("grazing, 1e-12", 1.1e-12), ("grazing, ulps", 16 * 2.0**-53)])
def test_grazes_pass_within_their_bound(name: str, off: float) -> None:
    beyond = [
        passing / reach - 1 for _, passing, reach in (squares(*plans) for plans in queries(name).plans())
    ]
    assert max(abs(each) for each in beyond) <= 3.0 * off
    assert max(abs(each) for each in beyond) >= 0.2 * off
    assert min(beyond) < 0 < max(beyond)


def test_a_quarter_is_tangent_and_the_others_are_within_an_ulp() -> None:
    asked = queries("tangent", 1_000)
    beyond = np.array(
        [float(passing / reach - 1) for _, passing, reach in (squares(*plans) for plans in asked.plans())]
    )
    assert 0.2 < (beyond == 0.0).mean() < 0.3
    assert 0.2 < (beyond > 0.0).mean() < 0.3
    assert 0.0 < np.abs(beyond).max() < 4.5 * 2.0**-53
    assert all(
        (pair_tick(*plans) is None) == (off >= 0.0) for plans, off in zip(asked.plans(), beyond, strict=True)
    )


def test_touching_discs_touch_within_rounding_on_both_sides_and_some_along_the_tangent() -> None:
    asked = queries("touching", 1_000)
    gaps = [distance / reach - 1 for distance, _, reach in (squares(*plans) for plans in asked.plans())]
    assert max(abs(gap) for gap in gaps) < 2.0 * 2.0**-47
    assert min(gaps) < 0 < max(gaps)
    apart = asked.position[:, 1] - asked.position[:, 0]
    moving = asked.velocity[:, 1] - asked.velocity[:, 0]
    along = np.abs((apart * moving).sum(axis=1)) / np.hypot(*apart.T) / np.hypot(*moving.T)
    assert 0.1 < (along < 1e-7).mean() < 0.6


def test_velocities_are_almost_equal() -> None:
    speeds = relative_speeds(queries("almost equal velocities"))
    assert speeds.max() < 2e-3
    assert 0.0 < speeds.min() < 1e-13


def test_sizes_reach_their_ratio() -> None:
    radius = queries("size ratio to 1e6").radius
    ratio = radius.max(axis=1) / radius.min(axis=1)
    assert 1e5 < ratio.max() < 1.001e6
    assert ratio.min() < 10.0


def test_distances_are_what_they_say() -> None:
    asked = queries("far apart")
    ratio = np.hypot(*(asked.position[:, 1] - asked.position[:, 0]).T) / asked.radius.sum(axis=1)
    assert 0.9e4 < ratio.min() < 1e5 < ratio.max() < 1.1e6
    for name in ("far out", "far out, anchors apart"):
        out = np.abs(queries(name).position).max(axis=(1, 2))
        assert 5e5 < out.max() < 1.1e6


def test_anchors_differ_where_they_should_and_those_of_the_late_clock_are_late() -> None:
    for name in ("anchors apart", "late clock", "far out, anchors apart"):
        asked = queries(name)
        assert (asked.anchor[:, 0] != asked.anchor[:, 1]).all()
        assert (asked.anchor.max() > LATER) == (name == "late clock")
        assert asked.anchor.max() <= SPAN


def test_simultaneous_contacts_have_exactly_one_time() -> None:
    asked = queries("simultaneous")
    times = [exact_time(*plans) for plans in asked.plans()]
    groups = [times[first : first + TIED] for first in range(0, len(times), TIED)]
    assert all(len(set(group)) == 1 for group in groups)
    assert len(set(times)) > 0.8 * len(groups)
    assert len(set(asked.radius.sum(axis=1))) > 0.8 * len(asked)


def place(plan: FlightPlan, tick: int) -> tuple[Fraction, Fraction]:
    elapsed = Fraction(tick - plan.anchor, 1 << 52)
    return Fraction(plan.x) + Fraction(plan.vx) * elapsed, Fraction(plan.y) + Fraction(plan.vy) * elapsed


def exact_time(one: FlightPlan, two: FlightPlan) -> Decimal:
    """The time of contact in ticks, in 100 digits of 150."""
    since = max(one.anchor, two.anchor)
    (x, y), (x2, y2) = place(one, since), place(two, since)
    dx, dy = x2 - x, y2 - y
    vx, vy = Fraction(two.vx) - Fraction(one.vx), Fraction(two.vy) - Fraction(one.vy)
    a, b = vx * vx + vy * vy, dx * vx + dy * vy
    c = dx * dx + dy * dy - (radius(one) + radius(two)) ** 2
    with localcontext(prec=150) as digits:
        root, b_, a_ = (Decimal(each.numerator) / each.denominator for each in (b * b - a * c, -b, a))
        time = since + (b_ - root.sqrt()) / a_ * (1 << 52)
        digits.prec = 100
        return +time
