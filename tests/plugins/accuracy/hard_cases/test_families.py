"""The families of queries have their stated properties, in exact fractions."""

from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest

from kinetile_accuracy.hard_cases.families import FAMILIES, LATER, TIED, Queries
from kinetile_accuracy.specification.arithmetic import SPAN, FlightPlan, Separation
from kinetile_accuracy.specification.touching import touching_tick

NAMES = [family.name for family in FAMILIES]
COUNT = 240


def queries(name: str, count: int = COUNT) -> Queries:
    return next(family for family in FAMILIES if family.name == name).draw(count)


def misses(asked: Queries) -> list[Fraction]:
    """Returns the square of the passing distance of each pair over the square of the sum of radii, less 1."""
    found = []
    for flight in (Separation(*plans) for plans in asked.plans()):
        (dx, dy), (vx, vy), _ = flight.ways
        found.append(Fraction((dx * vy - dy * vx) ** 2, (vx * vx + vy * vy) * flight.reach**2) - 1)
    return found


@pytest.mark.parametrize("name", NAMES)
def test_it_is_drawn_the_same_each_time_and_has_what_it_takes(name: str) -> None:
    asked, again = queries(name), queries(name)
    for field in ("position", "velocity", "radius", "anchor"):
        assert getattr(asked, field).tobytes() == getattr(again, field).tobytes()
    assert NAMES.count(name) == 1
    assert asked.position.shape == asked.velocity.shape == (COUNT, 2, 2)
    assert asked.radius.shape == asked.anchor.shape == (COUNT, 2)
    assert (asked.radius > 0.0).all()
    assert np.isfinite(asked.position).all()
    hits = sum(touching_tick(None, Separation(*plans)) is not None for plans in asked.plans())
    assert hits > 0.25 * COUNT
    if name not in ("far apart", "simultaneous"):
        assert hits < 0.75 * COUNT


@pytest.mark.parametrize(("name", "off"), [("grazing, 1e-12", 1.1e-12), ("grazing, ulps", 16 * 2.0**-53)])
def test_grazes_pass_within_their_bound(name: str, off: float) -> None:
    beyond = misses(queries(name))
    assert 0.2 * off <= max(abs(each) for each in beyond) <= 3.0 * off
    assert min(beyond) < 0 < max(beyond)


def test_a_quarter_is_tangent_and_the_others_are_within_an_ulp() -> None:
    asked = queries("tangent", 1_000)
    beyond = np.array(list(map(float, misses(asked))))
    assert 0.2 < (beyond == 0.0).mean() < 0.3
    assert 0.2 < (beyond > 0.0).mean() < 0.3
    assert 0.0 < np.abs(beyond).max() < 4.5 * 2.0**-53
    met = [touching_tick(None, Separation(*plans)) is not None for plans in asked.plans()]
    assert met == (beyond < 0.0).tolist()


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


def exact_time(one: FlightPlan, two: FlightPlan) -> Decimal:
    """The time of contact in ticks, in 100 digits of 150."""
    flight = Separation(one, two)
    (dx, dy), (vx, vy), _ = flight.ways
    a, b, c = vx * vx + vy * vy, dx * vx + dy * vy, dx * dx + dy * dy - flight.reach**2
    with localcontext(prec=150) as digits:
        time = flight.since + (-b - Decimal(b * b - a * c).sqrt()) / a
        digits.prec = 100
        return +time
