"""Bodies in a box, near a point, on a ray: against exact arithmetic.

Discs are laid out bare: none of a scene's rules applies, they overlap and lie about as they like.
"""

from __future__ import annotations

from fractions import Fraction
from math import isqrt
from typing import cast

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from kinetile.kernel.clock import Clock
from kinetile.kernel.tables import allocate
from kinetile.run.compose import Composition
from kinetile.run.questions.places import Query, bodies_in, bodies_near, ray

Disc = tuple[float, float, float]
"""x, y, radius."""


def laid_out(discs: list[Disc], slots: list[int] | None = None) -> Query:
    """Return a moment at which resting discs are where they are, in the slots of their order."""
    k = allocate(len(discs), len(discs), 1)
    table = np.array(discs, dtype=float).reshape(-1, 3)
    k.bodies.x, k.bodies.y, k.bodies.radius = table.T
    k.radii[:] = table[:, 2]
    k.clock[0].tick = 2.0**-52
    asked = np.arange(len(discs)) if slots is None else np.array(slots, dtype=np.int64)
    return Query(k, asked, Clock(0.0, 1.0), cast(Composition, None))


quarters = st.integers(-12, 12).map(lambda i: i / 4)
"""Coordinates of a lattice: whatever can tie, does."""

nudges = st.sampled_from([0.0, 0.0, 0.0, 1.0, -1.0])


@st.composite
def lengths(draw: st.DrawFn, some: st.SearchStrategy[float]) -> float:
    """A number of the lattice, or the double next to it."""
    value = draw(some)
    nudge = draw(nudges)
    return float(np.nextafter(value, value + nudge)) if nudge and value else value


coordinates = lengths(quarters)
radii = lengths(st.sampled_from([0.25, 0.5, 0.75, 1.25, 2.5]))
wide = st.floats(-(2.0**200), 2.0**200).filter(lambda x: x == 0.0 or abs(x) >= 2.0**-200)
wide_radii = st.floats(2.0**-200, 2.0**200)

small_discs = st.lists(st.tuples(coordinates, coordinates, radii), max_size=12)
discs = st.one_of(
    small_discs,
    small_discs,
    st.lists(st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(0.01, 2.0)), max_size=12),
    st.lists(st.tuples(wide, wide, wide_radii), max_size=6),
)
points = st.one_of(
    st.tuples(coordinates, coordinates),
    st.tuples(coordinates, coordinates),
    st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)),
    st.tuples(wide, wide),
)

BITS = 3000


def in_box(disc, box) -> bool:
    x, y, r = map(Fraction, disc)
    left, bottom, right, top = map(Fraction, box)
    dx, dy = x - min(max(x, left), right), y - min(max(y, bottom), top)
    return dx * dx + dy * dy <= r * r


def as_a_whole(disc, box) -> bool:
    x, y, r = map(Fraction, disc)
    left, bottom, right, top = map(Fraction, box)
    return left <= x - r and x + r <= right and bottom <= y - r and y + r <= top


def within(disc, point, radius) -> bool:
    x, y, r = map(Fraction, disc)
    dx, dy = x - Fraction(point[0]), y - Fraction(point[1])
    return dx * dx + dy * dy <= (Fraction(radius) + r) ** 2


def distance(disc, point) -> int:
    """Return how far a disc is from a point to so many digits that equal ones are equal."""
    x, y, r = map(Fraction, disc)
    dx, dy = x - Fraction(point[0]), y - Fraction(point[1])
    square = (dx * dx + dy * dy) * 4**BITS
    assert square.denominator == 1
    return isqrt(square.numerator << 200) - int(r * 2 ** (BITS + 100))


boxes = st.one_of(
    st.tuples(coordinates, coordinates, coordinates, coordinates), st.tuples(wide, wide, wide, wide)
).map(lambda b: (min(b[0], b[2]), min(b[1], b[3]), max(b[0], b[2]), max(b[1], b[3])))


@given(discs=discs, box=boxes)
@example(discs=[(2.0, 2.0, 0.5)], box=(0.0, 0.0, 1.5, 2.0))
@example(discs=[(1.75, 2.0, 1.25)], box=(0.0, 0.0, 1.0, 1.0))  # at the corner, 3 : 4 : 5
@example(discs=[(1.75, np.nextafter(2.0, 3.0), 1.25)], box=(0.0, 0.0, 1.0, 1.0))
@example(discs=[(0.25, 0.25, 0.25)], box=(0.0, 0.0, 0.5, 0.5))
@example(discs=[(0.25, 0.25, float(np.nextafter(0.25, 1.0)))], box=(0.0, 0.0, 0.5, 0.5))
@example(discs=[(0.0, 0.0, 1.0)], box=(1.0, 0.0, 1.0, 0.0))
def test_who_is_in_a_box(discs, box):
    moment = laid_out(discs)
    assert bodies_in(moment, box).tolist() == [i for i, disc in enumerate(discs) if in_box(disc, box)]
    inside = [i for i, disc in enumerate(discs) if as_a_whole(disc, box)]
    assert bodies_in(moment, box, inside=True).tolist() == inside


@given(discs=discs, point=points, radius=st.one_of(st.just(0.0), radii))
@example(discs=[(3.0, 4.0, 0.5)], point=(0.0, 0.0), radius=4.5)
@example(discs=[(3.0, 4.0, 0.5)], point=(0.0, 0.0), radius=float(np.nextafter(4.5, 0.0)))
def test_who_is_within_a_distance(discs, point, radius):
    near = [i for i, disc in enumerate(discs) if within(disc, point, radius)]
    near.sort(key=lambda i: (distance(discs[i], point), i))
    assert bodies_near(laid_out(discs), point, radius=radius).tolist() == near


@given(discs=discs, point=points, count=st.integers(0, 14), radius=st.none() | radii)
@example(discs=[(1.0, 0.0, 0.5), (0.0, 1.0, 0.5), (-1.0, 0.0, 0.5)], point=(0.0, 0.0), count=2, radius=None)
@example(discs=[(0.5, 0.0, 2.0), (1.0, 0.0, 2.5), (0.25, 0.0, 1.0)], point=(0.0, 0.0), count=1, radius=None)
def test_who_is_nearest(discs, point, count, radius):
    nearest = sorted(range(len(discs)), key=lambda i: (distance(discs[i], point), i))
    if radius is not None:
        nearest = [i for i in nearest if within(discs[i], point, radius)]
    assert bodies_near(laid_out(discs), point, radius=radius, count=count).tolist() == nearest[:count]


@given(discs=discs, point=points, box=boxes, data=st.data())
def test_only_those_are_asked_about_who_are_named_in_their_order(discs, point, box, data):
    assume(discs)
    slots = data.draw(st.permutations(range(len(discs))))[: data.draw(st.integers(0, len(discs)))]
    moment = laid_out(discs, slots)
    assert bodies_in(moment, box).tolist() == [i for i in slots if in_box(discs[i], box)]
    nearest = sorted(slots, key=lambda i: distance(discs[i], point))  # ties stay in the order of slots
    assert bodies_near(moment, point, count=len(discs)).tolist() == nearest


@pytest.mark.parametrize("far", [0.0, 1e3, 1e8])
def test_what_nearly_touches_is_told_apart(far):
    """Discs all round a point, at the distance at which they touch but for a rounding."""
    rng = np.random.default_rng(5)
    angle, r = rng.uniform(0.0, 2.0 * np.pi, 400), rng.uniform(0.1, 1.0, 400)
    reach = 2.5
    x, y = far + (r + reach) * np.cos(angle), (r + reach) * np.sin(angle)
    table = list(zip(x.tolist(), y.tolist(), r.tolist(), strict=True))
    near = {i for i, disc in enumerate(table) if within(disc, (far, 0.0), reach)}
    assert set(bodies_near(laid_out(table), (far, 0.0), radius=reach).tolist()) == near
    assert 0 < len(near) < 400


RAY_BITS = 6000


def entry(disc, origin, direction) -> tuple[Fraction, Fraction] | None:
    """Return (p, q) of p - sqrt(q), the multiple of the direction after which the ray enters; None: never."""
    x, y, r = map(Fraction, disc)
    ux, uy = map(Fraction, direction)
    dx, dy = x - Fraction(origin[0]), y - Fraction(origin[1])
    a, b, c = ux * ux + uy * uy, dx * ux + dy * uy, dx * dx + dy * dy - r * r
    if c <= 0:
        return Fraction(0), Fraction(0)
    if b <= 0 or b * b < a * c:
        return None
    return b / a, (b * b - a * c) / (a * a)


def root(value: Fraction) -> int:
    """Return the root of a number to so many digits that equal differences of such are equal, but for 2."""
    return isqrt((value.numerator << 2 * RAY_BITS) // value.denominator)


def order(hit) -> int:
    p, q = hit
    return ((p.numerator << RAY_BITS) // p.denominator - root(q) + (1 << 400)) >> 500


def expected(table, origin, direction) -> list[int]:
    hits = {i: entry(disc, origin, direction) for i, disc in enumerate(table)}
    return sorted((i for i, hit in hits.items() if hit), key=lambda i: (order(hits[i]), i))


directions = points.filter(lambda u: u != (0.0, 0.0))


@given(discs=discs, origin=points, direction=directions)
@example(discs=[(2.0, 1.0, 1.0), (2.0, -1.0, 1.0)], origin=(0.0, 0.0), direction=(1.0, 0.0))
@example(discs=[(2.0, float(np.nextafter(1.0, 2.0)), 1.0)], origin=(0.0, 0.0), direction=(1.0, 0.0))
@example(discs=[(1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)], origin=(0.0, 0.0), direction=(0.0, 1.0))
@example(discs=[(3.0, 0.0, 0.5), (4.0, 0.0, 1.5)], origin=(0.0, 0.0), direction=(3.0, 0.0))
@example(discs=[(3.0, 2.0**-30, 1.0), (3.0, 0.0, 1.0)], origin=(0.0, 0.0), direction=(1.0, 0.0))  # 2^-61
@example(discs=[(1.0, 1.0, 0.25)], origin=(0.0, 0.0), direction=(5e-324, 5e-324))
@example(discs=[(1.0, 0.0, 0.25)], origin=(0.0, 0.0), direction=(1e60, 5e-324))
def test_who_stands_in_the_way(discs, origin, direction):
    hits = ray(laid_out(discs), origin, direction)
    assert [hit.body for hit in hits] == expected(discs, origin, direction)
    n = sum(Fraction(part) ** 2 for part in direction)
    for hit in hits:
        p, q = entry(discs[hit.body], origin, direction)
        true = Fraction(root(p * p * n) - root(q * n), 1 << RAY_BITS)
        off = abs(Fraction(hit.distance) - true)
        assert all(
            off <= abs(Fraction(float(np.nextafter(hit.distance, to))) - true) + Fraction(1, 1 << 2000)
            for to in (0.0, np.inf)
        )
        assert (hit.distance == 0.0) == (p == q == 0)


@given(discs=discs, origin=points, direction=directions, most=st.integers(0, 12))
def test_the_first_are_the_first_of_all(discs, origin, direction, most):
    moment = laid_out(discs)
    assert ray(moment, origin, direction, most) == ray(moment, origin, direction)[:most]


@given(discs=discs, origin=points, direction=directions, power=st.integers(-60, 60))
def test_the_length_of_the_direction_does_not_matter(discs, origin, direction, power):
    longer = tuple(float(np.ldexp(part, power)) for part in direction)
    assume(all(np.ldexp(part, -power) == was for part, was in zip(longer, direction, strict=True)))
    moment = laid_out(discs)
    assert ray(moment, origin, direction) == ray(moment, origin, longer)


@given(discs=discs, origin=points, direction=directions, data=st.data())
def test_ties_go_by_the_order_of_the_slots(discs, origin, direction, data):
    assume(discs)
    slots = data.draw(st.permutations(range(len(discs))))
    hits = [hit.body for hit in ray(laid_out(discs, slots), origin, direction)]
    swapped = [discs[i] for i in slots]
    assert hits == [slots[i] for i in expected(swapped, origin, direction)]


@pytest.mark.parametrize("far", [0.0, 1e3, 1e8])
def test_grazes_are_told_apart(far):
    """A ray that passes discs at the distance at which it touches them but for a rounding."""
    rng = np.random.default_rng(6)
    angle, r = rng.uniform(0.0, 2.0 * np.pi, 300), rng.uniform(0.1, 1.0, 300)
    met = 0
    for a, radius, ahead in zip(
        angle.tolist(), r.tolist(), rng.uniform(1.0, 50.0, 300).tolist(), strict=True
    ):
        ux, uy = float(np.cos(a)), float(np.sin(a))
        disc = (far + ahead * ux - radius * uy, far + ahead * uy + radius * ux, radius)
        hits = ray(laid_out([disc]), (far, far), (ux, uy))
        assert bool(hits) == (entry(disc, (far, far), (ux, uy)) is not None)
        met += bool(hits)
    assert 0 < met < 300
