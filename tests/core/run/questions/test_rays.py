"""Who stands in the way of a ray, against exact arithmetic about every body."""

from __future__ import annotations

from fractions import Fraction
from math import isqrt

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from asked import discs, laid_out, points
from kinetile.run.questions.rays import ray

BITS = 6000


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
    return isqrt((value.numerator << 2 * BITS) // value.denominator)


def order(hit) -> int:
    p, q = hit
    return ((p.numerator << BITS) // p.denominator - root(q) + (1 << 400)) >> 500


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
        true = Fraction(root(p * p * n) - root(q * n), 1 << BITS)
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
