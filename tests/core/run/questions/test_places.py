"""Bodies in a box, near a point, on a ray: against the exact reference of contacts, and long decimals.

Bodies are laid out bare: none of a scene's rules applies, they overlap and lie about as they like. Discs are
shapes of one corner.
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import product
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

import kinetile as kt
from kinetile.kernel.clock import Clock
from kinetile.kernel.tables import allocate
from kinetile.run.compose import Composition
from kinetile.run.questions import places
from kinetile.run.questions.places import Query
from kinetile_accuracy.specification.shapes import Difference, nearest

Body = tuple[kt.Shape, float, float]
"""Its shape, x and y."""


def laid_out(bodies: list[Body], slots: list[int] | None = None) -> Query:
    """Return a moment at which resting bodies are where they are, in the slots of their order; their numbers
    are in the opposite order, and one more shape is nobody's."""
    n = len(bodies)
    k = allocate(n, n, 1)
    for slot, (shape, x, y) in enumerate(bodies):
        k.bodies.x[slot], k.bodies.y[slot], k.bodies.radius[slot], k.radii[slot] = x, y, *[shape.reach] * 2
        k.queue.number[slot] = n - 1 - slot
    k.clock[0].tick = 2.0**-52
    asked = np.arange(n) if slots is None else np.array(slots, dtype=np.int64)
    table = (kt.disc(1.0), *(shape for shape, _, _ in bodies))
    return Query(k, asked, Clock(0.0, 1.0), cast(Composition, None), table, np.arange(n, 0, -1))


quarters = st.integers(-12, 12).map(lambda i: i / 4)
nudges = st.sampled_from([0.0, 0.0, 0.0, 1.0, -1.0])


@st.composite
def lengths(draw: st.DrawFn, some: st.SearchStrategy[float]) -> float:
    """A number of the lattice, or the double next to it."""
    value = draw(some)
    nudge = draw(nudges)
    return float(np.nextafter(value, value + nudge)) if nudge and value else value


coordinates = lengths(quarters)
DIAMOND = [(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]
OCTAGON = [
    (2.0, 1.0),
    (1.0, 2.0),
    (-1.0, 2.0),
    (-2.0, 1.0),
    (-2.0, -1.0),
    (-1.0, -2.0),
    (1.0, -2.0),
    (2.0, -1.0),
]
NEEDLE = [(0.0, 0.0), (3.0, 2.0**-40), (3.0, 2.0**-39)]
SHAPES = [
    kt.disc(0.5),
    kt.disc(1.25),
    kt.Shape(((0.5, -0.25),), 0.75),
    kt.box(1.0, 0.5),
    kt.box(2.0, 2.0),
    kt.box(0.3, 0.7),
    kt.capsule((-0.5, 0.0), (0.5, 0.0), 0.25),
    kt.capsule((0.0, 0.0), (0.75, 1.0), 1.25),
    kt.capsule((0.1, 0.2), (0.7, -0.3), 0.1),
    kt.segment((-0.75, -1.0), (0.75, 1.0)),
    kt.segment((0.0, 0.0), (1.0, 0.0)),
    kt.polygon([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]),
    kt.polygon([(0.0, 0.0), (0.75, 1.0), (0.0, 1.0)], 0.25),
    kt.polygon([(2.0, 2.0), (3.0, 2.0), (2.75, 3.0)], 0.5),  # beside its place
    kt.polygon(DIAMOND),
    kt.polygon(DIAMOND, 0.5),
    kt.polygon(OCTAGON),
    kt.polygon(OCTAGON, 0.25),
    kt.polygon(NEEDLE),
    kt.polygon(NEEDLE, 0.25),
]
wide = st.floats(-(2.0**200), 2.0**200).filter(lambda x: x == 0.0 or abs(x) >= 2.0**-200)
wide_shapes = st.one_of(
    st.builds(kt.disc, st.floats(2.0**-200, 2.0**200)),
    st.builds(kt.box, st.floats(2.0**-190, 2.0**190), st.floats(2.0**-190, 2.0**190)),
    st.builds(
        lambda a, b, r: kt.capsule(a, b, r),
        st.just((0.0, 0.0)),
        st.tuples(st.floats(1, 2.0**190), wide.map(lambda x: x / 4)),
        st.floats(2.0**-200, 2.0**190),
    ),
)
lattice = st.lists(st.tuples(st.sampled_from(SHAPES), coordinates, coordinates), max_size=8)
anywhere = st.floats(-4.0, 4.0)
bodies = st.one_of(
    lattice,
    lattice,
    lattice,
    st.lists(st.tuples(st.sampled_from(SHAPES), anywhere, anywhere), max_size=8),
    st.lists(st.tuples(wide_shapes, wide, wide), max_size=4),
)
points = st.one_of(
    st.tuples(coordinates, coordinates),
    st.tuples(coordinates, coordinates),
    st.tuples(anywhere, anywhere),
    st.tuples(wide, wide),
)
directions = points.filter(lambda u: u != (0.0, 0.0))
boxes = st.one_of(
    st.tuples(coordinates, coordinates, coordinates, coordinates), st.tuples(wide, wide, wide, wide)
).map(lambda b: (min(b[0], b[2]), min(b[1], b[3]), max(b[0], b[2]), max(b[1], b[3])))
reaches = st.one_of(st.just(0.0), lengths(st.sampled_from([0.25, 0.5, 0.75, 1.25, 2.5])))


def meets(core, radius: float, body: Body) -> bool:
    """Whether a body is within a radius of other corners."""
    shape, x, y = body
    return (
        nearest(Difference(SimpleNamespace(core=core, radius=radius), shape), (Fraction(x), Fraction(y)))
        is not None
    )


def in_box(body: Body, box) -> bool:
    left, bottom, right, top = box
    return meets([(left, bottom), (left, top), (right, bottom), (right, top)], 0.0, body)


def as_a_whole(body: Body, box) -> bool:
    shape, *place = body
    corners = [
        [Fraction(at) + Fraction(c) for at, c in zip(place, corner, strict=True)] for corner in shape.core
    ]
    r = Fraction(shape.radius)
    return all(box[i] <= each[i] - r and each[i] + r <= box[i + 2] for each in corners for i in (0, 1))


DIGITS, SAME = 1500, Decimal(10) ** -600


def decimals():
    """So many digits that what differs by less than ``SAME`` is the same."""
    return localcontext(prec=DIGITS)


def dot(a, b) -> Decimal:
    return a[0] * b[0] + a[1] * b[1]


def minus(a, b):
    return a[0] - b[0], a[1] - b[1]


def corners_of(body: Body):
    shape, x, y = body
    return [(Decimal(x) + Decimal(cx), Decimal(y) + Decimal(cy)) for cx, cy in shape.core]


def distance(body: Body, place) -> Decimal:
    """Return how far a place is from a body's outline, below 0 inside."""
    corners, inside, squares = corners_of(body), len(body[0].core) > 2, []
    for k, corner in enumerate(corners):
        side, at = minus(corners[(k + 1) % len(corners)], corner), minus(place, corner)
        length = dot(side, side)
        part = min(max(dot(side, at) / length, Decimal(0)), Decimal(1)) if length else Decimal(0)
        foot = minus(at, (part * side[0], part * side[1]))
        squares.append(dot(foot, foot))
        inside = inside and side[0] * at[1] - side[1] * at[0] > 0
    return min(squares).sqrt() * (-1 if inside else 1) - Decimal(body[0].radius)


def in_order(values: dict[int, Decimal], slots) -> list[int]:
    """Return the keys by their values, those with the same in the order of slots."""
    near = sorted(values, key=lambda i: values[i])
    rank, ranks = 0, {}
    for before, i in zip([None, *near], near, strict=False):
        if before is not None and values[i] - values[before] > SAME * max(1, abs(values[i])):
            rank += 1
        ranks[i] = rank
    return sorted(near, key=lambda i: (ranks[i], list(slots).index(i)))


@given(bodies=bodies, box=boxes)
@example(bodies=[(kt.polygon(DIAMOND, 1.25), 1.75, 2.5)], box=(-1.0, -1.0, 0.0, 0.0))
@example(bodies=[(kt.polygon(OCTAGON), 0.0, 0.0)], box=(1.5, 1.5, 2.0, 2.0))  # at the middle of a side
@example(bodies=[(kt.polygon(OCTAGON), 0.0, 0.0)], box=(float(np.nextafter(1.5, 2.0)), 1.5, 2.0, 2.0))
@example(bodies=[(kt.polygon(OCTAGON), 0.0, 0.0)], box=(0.5, 0.5, 0.5, 0.5))  # a point in it
@example(bodies=[(kt.segment((-1, -1), (1, 1)), 0.0, 0.0)], box=(0.5, 0.25, 0.75, 0.5))
@example(bodies=[(kt.capsule((0, 0), (1, 0), 1.25), 0.75, 1.0)], box=(-1.0, -1.0, 0.0, 0.0))
@example(bodies=[(kt.disc(1.25), 1.75, 2.0)], box=(0.0, 0.0, 1.0, 1.0))  # at the corner, 3 : 4 : 5
@example(bodies=[(kt.disc(1.25), 1.75, float(np.nextafter(2.0, 3.0)))], box=(0.0, 0.0, 1.0, 1.0))
@example(bodies=[(kt.disc(0.25), 0.25, 0.25)], box=(0.0, 0.0, 0.5, 0.5))
@example(bodies=[(kt.disc(float(np.nextafter(0.25, 1.0))), 0.25, 0.25)], box=(0.0, 0.0, 0.5, 0.5))
@example(bodies=[(kt.disc(1.0), 0.0, 0.0)], box=(1.0, 0.0, 1.0, 0.0))
def test_who_is_in_a_box(bodies, box):
    moment = laid_out(bodies)
    assert places.bodies_in(moment, box).tolist() == [i for i, body in enumerate(bodies) if in_box(body, box)]
    whole = [i for i, body in enumerate(bodies) if as_a_whole(body, box)]
    assert places.bodies_in(moment, box, inside=True).tolist() == whole


@given(bodies=bodies, point=points, count=st.none() | st.integers(0, 9), radius=st.none() | reaches)
@example(
    bodies=[(kt.box(2, 2), 0.0, 0.0), (kt.box(1, 1), 0.0, 0.0)], point=(0.0, 0.0), count=None, radius=None
)
@example(
    bodies=[
        (kt.disc(2.0), 1.0, 2.0),
        (kt.disc(1.0), 1.0, 1.0),
        (kt.polygon([(0, 0), (4, 0), (0, 4)]), 0.0, 0.0),
    ],
    point=(1.0, 1.0),
    count=2,
    radius=None,
)
@example(
    bodies=[(kt.box(2, 2), 1.0, 0.0), (kt.box(2, 2), float(np.nextafter(1.0, 2.0)), 0.0)],
    point=(2.0, 0.0),  # at the outline of one, a rounding inside the other
    count=None,
    radius=None,
)
@example(bodies=[(kt.capsule((0, 0), (3, 4), 0.5), 0.0, 0.0)], point=(-4.0, 3.0), count=None, radius=4.5)
@example(bodies=[(kt.segment((0, 0), (3, 4)), 0.0, 0.0)], point=(1.5, 2.0), count=None, radius=0.0)
@example(bodies=[(kt.disc(0.5), 3.0, 4.0)], point=(0.0, 0.0), count=None, radius=4.5)
@example(bodies=[(kt.disc(0.5), 3.0, 4.0)], point=(0.0, 0.0), count=None, radius=float(np.nextafter(4.5, 0)))
@example(
    bodies=[(kt.disc(2.0), 0.5, 0.0), (kt.disc(2.5), 1.0, 0.0), (kt.disc(1.0), 0.25, 0.0)],
    point=(0.0, 0.0),
    count=1,
    radius=None,
)
def test_who_is_near(bodies, point, count, radius):
    near = [i for i, body in enumerate(bodies) if radius is None or meets([point], radius, body)]
    with decimals():
        place = tuple(map(Decimal, point))
        expected = in_order({i: distance(bodies[i], place) for i in near}, range(len(bodies)))
    assert places.bodies_near(laid_out(bodies), point, radius, count).tolist() == expected[:count]


def on_lattice(rng: np.random.Generator, size: float) -> float:
    """Draw a number of the lattice, or the double next to it."""
    value = float(rng.integers(-4 * size, 4 * size + 1)) / 4
    return float(np.nextafter(value, value + rng.choice([0.0, 0.0, 0.0, 1.0, -1.0]))) if value else value


def test_distances_inside_and_outside_are_compared():
    roots = range(-4, 5)
    for one, other, more in product(roots, roots, range(-9, 10)):
        sign = (one - other > more) - (one - other < more)
        squares = (Fraction(one * abs(one)), Fraction(other * abs(other)))
        assert places._compare_distances(*squares, Fraction(more)) == sign


def test_the_order_of_all_shapes_around_a_point():
    """Most of them have the point inside, and many are as deep in or as far away as others."""
    rng = np.random.default_rng(8)
    place = (Decimal(0), Decimal(0))
    for _ in range(60):
        table = [
            (SHAPES[i], on_lattice(rng, 1), on_lattice(rng, 1)) for i in rng.integers(0, len(SHAPES), 24)
        ]
        with decimals():
            expected = in_order({i: distance(body, place) for i, body in enumerate(table)}, range(24))
        assert places.bodies_near(laid_out(table), (0.0, 0.0)).tolist() == expected
        assert places.bodies_near(laid_out(table), (0.0, 0.0), count=9).tolist() == expected[:9]


def crosses(a, b, start, u) -> bool:
    """Whether a ray meets a line from a to b; both exact."""
    way, at = minus(b, a), minus(a, start)
    turn = u[0] * way[1] - u[1] * way[0]
    if turn == 0:
        return False  # then it meets an end of it or begins on it, or not at all
    along, part = (at[0] * way[1] - at[1] * way[0]) / turn, (at[0] * u[1] - at[1] * u[0]) / turn
    return along >= 0 and 0 <= part <= 1


def is_met(body: Body, origin, direction) -> bool:
    """Whether a ray comes as near to a core as its radius."""
    if meets([origin], 0.0, body):
        return True
    shape, *place = body
    corners = [
        tuple(Fraction(at) + Fraction(c) for at, c in zip(place, corner, strict=True))
        for corner in shape.core
    ]
    start, u, r = tuple(map(Fraction, origin)), tuple(map(Fraction, direction)), Fraction(shape.radius)
    for k, corner in enumerate(corners):
        at = minus(corner, start)
        if dot(at, u) >= 0 and (at[0] * u[1] - at[1] * u[0]) ** 2 <= r * r * dot(u, u):
            return True
        if crosses(corner, corners[(k + 1) % len(corners)], start, u):
            return True
    return False


def entry(body: Body, origin, direction) -> Decimal | None:
    """Return after which length a ray enters a body: the first of all lengths at which it crosses a line
    beside a side or a circle around a corner, and is at the outline there; None: it never does."""
    if not is_met(body, origin, direction):
        return None
    if meets([origin], 0.0, body):
        return Decimal(0)
    start, u = tuple(map(Decimal, origin)), tuple(map(Decimal, direction))
    size = dot(u, u).sqrt()
    u = u[0] / size, u[1] / size
    corners, r, found = corners_of(body), Decimal(body[0].radius), []
    for k, corner in enumerate(corners):
        side, at = minus(corners[(k + 1) % len(corners)], corner), minus(corner, start)
        middle, off = dot(at, u), at[0] * u[1] - at[1] * u[0]
        half = max(r * r - off * off, Decimal(0)).sqrt()
        found += [middle - half, middle + half]
        turn = u[0] * side[1] - u[1] * side[0]
        if turn:
            for wide in (r, -r):
                found.append((at[0] * side[1] - at[1] * side[0] + wide * dot(side, side).sqrt()) / turn)
    scale = max(map(abs, [*start, *(part for corner in corners for part in corner), r]))
    at_outline = [
        t
        for t in found
        if t > 0
        and abs(distance(body, (start[0] + t * u[0], start[1] + t * u[1]))) < scale * Decimal(10) ** -700
    ]
    return min(at_outline)


DISCS = [(kt.disc(1.0), 2.0, 1.0), (kt.disc(1.0), 2.0, -1.0), (kt.disc(1.0), -1.0, 0.0)]
RAYS = [
    (kt.polygon(DIAMOND, 0.5), 3.0, 0.5),
    (kt.capsule((0, -1), (0, 1), 1.0), 4.0, 0.0),
    (kt.box(1, 1), 4.0, 1.5),
]


@given(
    bodies=bodies,
    origin=points,
    direction=directions,
    within=st.none() | reaches.filter(bool) | st.floats(0.1, 9.0),
)
@example(bodies=RAYS, origin=(0.0, 1.0), direction=(1.0, 0.0), within=None)  # along a side of the box
@example(bodies=RAYS, origin=(0.0, 0.0), direction=(1.0, 0.0), within=3.0)
@example(bodies=[(kt.segment((1, 0), (2, 0)), 0.0, 0.0)], origin=(0.0, 0.0), direction=(3.0, 0.0), within=1.0)
@example(
    bodies=[(kt.segment((1, 1), (1, -1)), 0.0, 0.0)], origin=(0.0, 0.0), direction=(1.0, 1.0), within=None
)
@example(
    bodies=[(kt.segment((1, 0), (2, 0)), 0.0, 0.0)], origin=(3.0, 0.0), direction=(1.0, 0.0), within=None
)
@example(
    bodies=[(kt.capsule((0, 0), (3, 4), 1.25), 3.0, 0.0)],
    origin=(0.0, 0.0),
    direction=(4.0, -3.0),
    within=None,
)
@example(bodies=DISCS, origin=(0.0, 0.0), direction=(1.0, 0.0), within=None)  # two tangents
@example(bodies=DISCS, origin=(0.0, 0.0), direction=(0.0, 1.0), within=None)
@example(
    bodies=[(kt.disc(1.0), 3.0, 2.0**-30), (kt.disc(1.0), 3.0, 0.0)],
    origin=(0.0, 0.0),
    direction=(1.0, 0.0),
    within=None,
)  # 2^-61 apart
@example(bodies=[(kt.disc(0.25), 1.0, 1.0)], origin=(0.0, 0.0), direction=(5e-324, 5e-324), within=None)
@example(bodies=[(kt.disc(0.25), 1.0, 0.0)], origin=(0.0, 0.0), direction=(1e60, 5e-324), within=None)
def test_who_stands_in_the_way(bodies, origin, direction, within):
    check_rays(bodies, origin, direction, within)


def check_rays(bodies, origin, direction, within) -> None:
    """Compare the hits of a ray, their order and their distances with those by the reference."""
    hits = places.ray(laid_out(bodies), origin, direction, within=within)
    with decimals():
        entries = {i: entry(body, origin, direction) for i, body in enumerate(bodies)}
        far = {
            i: t
            for i, t in entries.items()
            if t is not None and (within is None or t <= Decimal(within) * (1 + SAME))
        }
        assert [hit.body for hit in hits] == in_order(far, range(len(bodies)))
        for hit in hits:
            off = abs(Decimal(hit.distance) - far[hit.body])
            for to in (0.0, np.inf):
                other = Decimal(float(np.nextafter(hit.distance, to)))
                assert off <= abs(other - far[hit.body]) + SAME * off
            assert (hit.distance == 0.0) == (far[hit.body] == 0)


@pytest.mark.parametrize("which", range(len(SHAPES)))
def test_rays_from_all_sides(which):
    rng = np.random.default_rng(which)
    for _ in range(20):
        body = (SHAPES[which], on_lattice(rng, 1), on_lattice(rng, 1))
        origin, towards = [(on_lattice(rng, 4), on_lattice(rng, 4)) for _ in range(2)]
        direction = (float(towards[0] - origin[0]), float(towards[1] - origin[1]))
        if direction == (0.0, 0.0):
            continue
        check_rays([body], origin, direction, None)


@given(bodies=bodies, origin=points, direction=directions, most=st.integers(0, 8))
def test_the_first_are_the_first_of_all(bodies, origin, direction, most):
    moment = laid_out(bodies)
    assert places.ray(moment, origin, direction, most) == places.ray(moment, origin, direction)[:most]


@given(bodies=bodies, point=points, direction=directions, box=boxes, data=st.data())
def test_only_those_are_asked_about_who_are_named_in_their_order(bodies, point, direction, box, data):
    assume(bodies)
    slots = data.draw(st.permutations(range(len(bodies))))[: data.draw(st.integers(0, len(bodies)))]
    moment = laid_out(bodies, slots)
    assert places.bodies_in(moment, box).tolist() == [i for i in slots if in_box(bodies[i], box)]
    with decimals():
        place = tuple(map(Decimal, point))
        nearest_first = in_order({i: distance(bodies[i], place) for i in slots}, slots)
        entries = {i: entry(bodies[i], point, direction) for i in slots}
        entered = in_order({i: t for i, t in entries.items() if t is not None}, slots)
    assert places.bodies_near(moment, point, count=len(bodies)).tolist() == nearest_first
    assert [hit.body for hit in places.ray(moment, point, direction)] == entered


@given(bodies=bodies, origin=points, direction=directions, power=st.integers(-60, 60))
def test_the_length_of_the_direction_does_not_matter(bodies, origin, direction, power):
    longer = tuple(float(np.ldexp(part, power)) for part in direction)
    assume(all(np.ldexp(part, -power) == was for part, was in zip(longer, direction, strict=True)))
    moment = laid_out(bodies)
    assert places.ray(moment, origin, direction) == places.ray(moment, origin, longer)


discs = st.lists(
    st.tuples(st.sampled_from([0.25, 0.5, 1.25, 0.3]).map(kt.disc), coordinates, coordinates), max_size=9
)


@given(
    bodies=discs,
    point=points,
    direction=directions,
    box=boxes,
    count=st.none() | st.integers(0, 9),
    radius=reaches,
)
def test_discs_have_the_same_answers_as_without_shapes(bodies, point, direction, box, count, radius):
    moment = laid_out(bodies)
    bare = replace(moment, shapes=(), shape=np.zeros(0, dtype=np.int64))
    for inside in (False, True):
        one, other = (places.bodies_in(each, box, inside) for each in (moment, bare))
        assert one.tolist() == other.tolist()
    for within in (None, radius):
        one, other = (places.bodies_near(each, point, within, count or 0) for each in (moment, bare))
        assert one.tolist() == other.tolist()
    for most in (None, count):
        one, other = (places.ray(each, point, direction, most, radius or None) for each in (moment, bare))
        assert one == other


@pytest.mark.parametrize("far", [0.0, 1e3, 1e8])
@pytest.mark.parametrize("shape", [kt.disc(0.3), kt.polygon(OCTAGON, 0.3)], ids=["disc", "polygon"])
def test_what_nearly_touches_is_told_apart(far, shape):
    """Points all round a shape, at the distance at which they touch but for a rounding, and rays."""
    rng = np.random.default_rng(7)
    near = met = 0
    for angle in rng.uniform(0.0, 2.0 * np.pi, 200).tolist():
        c, s = np.cos(angle), np.sin(angle)
        x, y = max(shape.core, key=lambda corner: corner[0] * c + corner[1] * s)
        point = (float(x + 1.3 * c), float(y + 1.3 * s))
        body = (shape, far, 0.0)
        moment, point = laid_out([body]), (far + point[0], point[1])
        found = len(places.bodies_near(moment, point, radius=1.0)) > 0
        assert found == meets([point], 1.0, body)
        near += found
        side = (far + float(x + 0.3 * c - 5.0 * s), float(y + 0.3 * s + 5.0 * c))
        found = len(places.ray(moment, side, (float(s), float(-c)))) > 0
        assert found == is_met(body, side, (float(s), float(-c)))
        met += found
    assert 0 < near < 200
    assert 0 < met < 200


def rooms() -> kt.Simulation:
    """Return a run of boxes and discs of two kinds, from which a body has been removed."""
    rng = np.random.default_rng(3)
    spots = [(x + 0.5, y + 0.5) for x in range(8) for y in range(8)]
    shapes = [kt.box(0.75, 0.25), kt.disc(0.25), kt.box(0.5, 0.5)]
    scene = kt.Scene(
        spots,
        rng.normal(size=(64, 2)),
        shape=rng.integers(0, 3, 64),
        shapes=shapes,
        arena=(8.0, 8.0),
        kind=["odd" if i % 2 else "even" for i in range(64)],
        commands=[kt.Remove(5, 0.25), kt.Remove(40, 0.5)],
    )
    sim = kt.Simulation(scene, "cells")
    sim.run(until=1.0)
    return sim


def test_a_run_of_shapes_is_asked_by_the_numbers_of_its_bodies():
    sim = rooms()
    rng = np.random.default_rng(4)
    there = dict(zip(sim.bodies.tolist(), sim.positions().tolist(), strict=True))
    assert len(there) == 62
    everybody = {i: (sim.scene.shapes[sim.scene.shape[i]], x, y) for i, (x, y) in there.items()}
    for kinds in (None, "odd"):
        table = {i: body for i, body in everybody.items() if kinds is None or i % 2}
        for _ in range(8):
            x, y, w, h = rng.uniform(0.0, 8.0, 4).tolist()
            box, point, way = (x, y, x + w, y + h), (x, y), (w - 4.0, h - 4.0)
            assert sim.bodies_in(box, kinds=kinds).tolist() == [i for i in table if in_box(table[i], box)]
            whole = [i for i in table if as_a_whole(table[i], box)]
            assert sim.bodies_in(box, whole=True, kinds=kinds).tolist() == whole
            with decimals():
                place = tuple(map(Decimal, point))
                near = in_order({i: distance(body, place) for i, body in table.items()}, table)
                entries = {i: entry(body, point, way) for i, body in table.items()}
                met = in_order({i: t for i, t in entries.items() if t is not None}, table)
            assert sim.bodies_near(point, k=5, kinds=kinds).tolist() == near[:5]
            assert [hit.body for hit in sim.ray(point, way, kinds=kinds)] == met


def test_a_scene_of_discs_beside_a_shape_has_the_answers_of_one_without():
    table = kt.make_scene("grid", bodies=49, density=0.5, seed=2)
    radii = sorted(set(table.radius.tolist()))
    where = ([*table.position, (-50.0, 3.0)], [*table.velocity, (0.0, 0.0)])
    shape = [*map(radii.index, table.radius.tolist()), len(radii)]
    beside = kt.Scene(*where, shape=shape, shapes=[*map(kt.disc, radii), kt.box(1, 1)], unit=1.0)
    alone = kt.Scene(table.position, table.velocity, table.radius, unit=1.0)
    one, other = kt.Simulation(beside, "naive"), kt.Simulation(alone, "naive")
    rng = np.random.default_rng(5)
    for sim in (one, other):
        sim.run(until=0.25)
    assert one.positions()[:49].tolist() == other.positions().tolist()
    size = float(np.abs(table.position).max())
    for x, y, w, h in (size * rng.uniform(0.0, 1.0, (40, 4))).tolist():
        for whole in (False, True):
            box = (x, y, x + w, y + h)
            assert one.bodies_in(box, whole=whole).tolist() == other.bodies_in(box, whole=whole).tolist()
        assert one.bodies_near((x, y), k=7).tolist() == other.bodies_near((x, y), k=7).tolist()
        assert one.bodies_near((x, y), radius=w).tolist() == other.bodies_near((x, y), radius=w).tolist()
        assert one.ray((x, y), (w, h), within=size) == other.ray((x, y), (w, h), within=size)
