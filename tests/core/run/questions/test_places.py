"""Bodies in a box, near a point, on a ray: against decimals of many digits."""

from dataclasses import replace
from decimal import Decimal, getcontext
from itertools import pairwise
from typing import cast

import numpy as np
from hypothesis import assume, example, given
from hypothesis import strategies as st

import kinetile as kt
from kinetile.kernel.clock import Clock
from kinetile.kernel.tables import allocate
from kinetile.run.compose import Composition
from kinetile.run.questions import places
from kinetile.run.questions.places import Query

Body = tuple[kt.Shape, float, float]
"""Its shape, x and y."""

ROUNDING = 2.0**-40
"""As a part of all lengths in question."""

getcontext().prec = 400  # of squares of lengths from 2^-200 to 2^200


def laid_out(bodies: list[Body], slots: list[int] | None = None) -> Query:
    """Returns a query at resting bodies, in the slots of their order; their numbers
    are in the opposite order, and one more shape is nobody's."""
    n = len(bodies)
    k = allocate(n, n, 1, shaped=True)
    for slot, (shape, x, y) in enumerate(bodies):
        k.bodies.x[slot], k.bodies.y[slot], k.bodies.radius[slot], k.radii[slot] = x, y, *[shape.reach] * 2
        k.queue.number[slot], k.bodies.form[slot] = n - 1 - slot, slot + 1
    k.clock[0].per_tick = 2.0**-52
    asked = np.arange(n) if slots is None else np.array(slots, dtype=np.int64)
    table = (kt.disc(1.0), *(shape for shape, _, _ in bodies))
    return Query(k, None, asked, Clock(0.0, 1.0), cast(Composition, None), table)


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
OCTAGON = [(2.0, 1.0), (1.0, 2.0), (-1.0, 2.0), (-2.0, 1.0)]
OCTAGON += [(-x, -y) for x, y in OCTAGON]
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


def minus(a, b):
    return a[0] - b[0], a[1] - b[1]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1]


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def decimal(*numbers):
    return tuple(Decimal(float(number)) for number in numbers)


def corners_of(body: Body):
    shape, *place = body
    (x, y), core = decimal(*place), [decimal(*corner) for corner in shape.core]
    return [(x + cx, y + cy) for cx, cy in core]


def depth_in(corners, place) -> Decimal:
    inside, squares = len(corners) > 2, []
    for k, corner in enumerate(corners):
        side, at = minus(corners[(k + 1) % len(corners)], corner), minus(place, corner)
        size = dot(side, side)
        along = min(max(dot(side, at) / size, Decimal(0)), Decimal(1)) if size else Decimal(0)
        foot = minus(at, (along * side[0], along * side[1]))
        squares.append(dot(foot, foot))
        inside = inside and cross(side, at) > 0
    return min(squares).sqrt() * (-1 if inside else 1)


def gap(body: Body, place) -> Decimal:
    return depth_in(corners_of(body), place) - Decimal(body[0].radius)


def gap_of_box(body: Body, box) -> Decimal:
    """Returns the distance of a body from a box, below 0 or 0 if they have a point in common."""
    left, bottom, right, top = decimal(*box)
    around, core = [(left, bottom), (right, bottom), (right, top), (left, top)], corners_of(body)
    ways = [(a, b) for shape in (around, core) for a, b in zip(shape, shape[1:] + shape[:1], strict=True)]
    ways += [(a, b) for a in around for b in core]
    for a, b in ways:  # a line along a side may part them, or one across the way between two corners
        way = minus(b, a)
        for normal in ((way[1], -way[0]), (-way[1], way[0]), way, (-way[0], -way[1])):
            if any(normal) and max(dot(normal, p) for p in around) < min(dot(normal, p) for p in core):
                apart = [depth_in(core, p) for p in around] + [depth_in(around, p) for p in core]
                return min(map(abs, apart)) - Decimal(body[0].radius)
    return -Decimal(body[0].radius)


def size_of(bodies: list[Body], *numbers: float) -> Decimal:
    reaches = [shape.reach + max(abs(x), abs(y)) for shape, x, y in bodies]
    return Decimal(ROUNDING) * Decimal(max([*reaches, *map(abs, numbers), 0.0]))


@given(bodies=bodies, box=boxes)
@example(bodies=[(kt.polygon(DIAMOND, 1.25), 1.75, 2.5)], box=(-1.0, -1.0, 0.0, 0.0))
@example(bodies=[(kt.polygon(OCTAGON), 0.0, 0.0)], box=(1.5, 1.5, 2.0, 2.0))  # at the middle of a side
@example(bodies=[(kt.polygon(OCTAGON), 0.0, 0.0)], box=(0.5, 0.5, 0.5, 0.5))  # a point in it
@example(bodies=[(kt.segment((-1, -1), (1, 1)), 0.0, 0.0)], box=(0.5, 0.25, 0.75, 0.5))
@example(bodies=[(kt.disc(0.5), 0.25, 0.5)], box=(0.0, 0.0, 1.0, 1.0))  # with its middle alone
def test_who_is_in_a_box(bodies, box):
    query, off = laid_out(bodies), size_of(bodies, *box)
    held, whole = (set(places.bodies_in(query, box, inside).tolist()) for inside in (False, True))
    left, bottom, right, top = decimal(*box)
    for number, body in enumerate(bodies):
        far, radius = gap_of_box(body, box), Decimal(body[0].radius)
        assert abs(far) <= off or (number in held) == (far < 0)
        out = max(max(left - x, x - right, bottom - y, y - top) for x, y in corners_of(body)) + radius
        assert abs(out) <= off or (number in whole) == (out < 0)


def test_what_touches_in_numbers_without_rounding_counts():
    for shape, x, y, box in (
        (kt.disc(0.5), 2.0, 2.0, (0.0, 0.0, 1.5, 2.0)),
        (kt.disc(1.25), 1.75, 2.0, (0.0, 0.0, 1.0, 1.0)),  # at the corner, 3 : 4 : 5
        (kt.capsule((0, 0), (1, 0), 1.25), 0.75, 1.0, (-1.0, -1.0, 0.0, 0.0)),
        (kt.box(1.0, 1.0), 1.5, 1.5, (0.0, 0.0, 1.0, 1.0)),
    ):
        assert places.bodies_in(laid_out([(shape, x, y)]), box).tolist() == [0]
        assert places.bodies_in(laid_out([(shape, x + 2.0**-30, y + 2.0**-30)]), box).tolist() == []
    query = laid_out([(kt.disc(0.5), 3.0, 4.0), (kt.disc(1.0), 2.0, 1.0), (kt.disc(1.0), 2.0, -1.0)])
    assert places.bodies_near(query, (0.0, 0.0), 4.5).tolist() == [1, 2, 0]
    assert places.ray(query, (0.0, 0.0), (3.0, 0.0)) == [(1, 2.0), (2, 2.0)]  # both graze
    assert places.ray(query, (2.5, 4.0), (-1.0, 0.0)) == [(0, 0.0)]  # it begins at the outline, and goes away


@given(bodies=bodies, point=points, count=st.none() | st.integers(0, 9), radius=st.none() | reaches)
@example(
    bodies=[(kt.box(2, 2), 0.0, 0.0), (kt.box(1, 1), 0.0, 0.0)], point=(0.0, 0.0), count=None, radius=None
)
@example(bodies=[(kt.segment((0, 0), (3, 4)), 0.0, 0.0)], point=(1.5, 2.0), count=None, radius=0.0)
@example(bodies=[(kt.polygon(DIAMOND[:3]), 0.0, 0.0)], point=(0.25, 0.0), count=None, radius=0.0)  # inside
def test_who_is_near(bodies, point, count, radius):
    found = places.bodies_near(laid_out(bodies), point, radius, count).tolist()
    off, far = size_of(bodies, *point, radius or 0.0), [gap(body, decimal(*point)) for body in bodies]
    assert len(set(found)) == len(found) <= (len(bodies) if count is None else count)
    assert all(far[one] <= far[other] + off for one, other in pairwise(found))
    full = count is not None and len(found) == count
    for number in range(len(bodies)):
        near = radius is None or far[number] <= Decimal(radius) + off
        if number in found:
            assert near
        else:
            beyond = radius is not None and far[number] > Decimal(radius) - off
            assert beyond or (full and all(far[each] <= far[number] + off for each in found))


def is_met_clearly(body: Body, origin, direction, off: Decimal) -> bool:
    """Whether a ray meets a body, and not by a rounding."""
    start, u, r = decimal(*origin), decimal(*direction), Decimal(body[0].radius) - off
    if gap(body, start) < -off:
        return True
    size, corners = dot(u, u).sqrt(), corners_of(body)
    for k, corner in enumerate(corners):
        at, side = minus(corner, start), minus(corners[(k + 1) % len(corners)], corner)
        if r > 0 and dot(at, u) > off * size and abs(cross(at, u)) < r * size:
            return True
        turn, length = cross(u, side), dot(side, side).sqrt()
        if abs(turn) * Decimal(2) ** 20 > size * length > 0:
            along, share = cross(at, side) / turn * size, cross(at, u) / turn
            edge = off / length * Decimal(2) ** 20
            if along > off * 2**20 and edge < share < 1 - edge:
                return True
    return False


@given(bodies=bodies, origin=points, direction=directions)
@example(bodies=[(kt.segment((1, 1), (1, -1)), 0.0, 0.0)], origin=(0.0, 0.0), direction=(1.0, 1.0))
@example(bodies=[(kt.segment((1, 0), (2, 0)), 0.0, 0.0)], origin=(3.0, 0.0), direction=(1.0, 0.0))
@example(bodies=[(kt.disc(0.25), 1.0, 1.0)], origin=(0.0, 0.0), direction=(5e-324, 5e-324))
@example(bodies=[(kt.disc(0.25), 1.0, 0.0)], origin=(0.0, 0.0), direction=(1e60, 5e-324))
@example(bodies=[(kt.box(1, 1), 0.0, 0.0)], origin=(0.0, -0.625), direction=(0.0, -1.0))  # it goes away
def test_who_stands_in_the_way(bodies, origin, direction):
    hits = {hit.body: hit.distance for hit in places.ray(laid_out(bodies), origin, direction)}
    assert list(hits.values()) == sorted(hits.values())
    off, start, u = size_of(bodies, *origin), decimal(*origin), decimal(*direction)
    size = dot(u, u).sqrt()
    for number, body in enumerate(bodies):
        if number not in hits:
            assert not is_met_clearly(body, origin, direction, off)
            continue
        length = Decimal(hits[number])
        for share in (0, 0.25, 0.5, 0.75, 1):  # at the outline, and outside before
            part = Decimal(share) * length / size
            far = gap(body, (start[0] + part * u[0], start[1] + part * u[1]))
            assert far >= -off or length == 0
            assert share < 1 or far <= off


def test_the_circles_around_bodies_leave_nobody_out():
    """A circle touches its body in a point that is nearest or farthest, or that a ray grazes: there rounding
    would decide who is compared at all."""
    random = np.random.default_rng(7)
    for _ in range(30):
        angle, size, far = random.uniform(0.5, 2.0, 3)
        u, v = (np.array(each) for each in ((np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))))
        tip = kt.segment(tuple(size * u - 2.0**-30 * v), tuple(size * u + 2.0**-30 * v))
        at = np.array([(0.0, 0.0), (far + size + 0.5) * v, random.uniform(0.5, 2.0, 2)])
        shapes = (tip, kt.disc(0.5), kt.Shape((tuple(size * u),), 0.25))
        query = laid_out([(shape, x, y) for shape, (x, y) in zip(shapes, at.tolist(), strict=True)])
        cores = query.cores(np.arange(3))
        for point in (-far * u, at[0] + (size + far) * u, at[2] + (size + far) * u):
            gaps = places.gaps_to(*cores, point - at)
            nearest = np.argsort(gaps, kind="stable").tolist()
            assert places.bodies_near(query, tuple(point), count=1).tolist() == nearest[:1]
            assert set(nearest[:2]) <= {*places.bodies_near(query, tuple(point), gaps[nearest[1]]).tolist()}
        for start in (at[0] + size * u - far * v, at[2] + (size + 0.25) * u - far * v):
            met = np.isfinite(places._entries(*cores, start - at, v))
            assert {hit.body for hit in places.ray(query, tuple(start), tuple(v))} == {*np.flatnonzero(met)}


def test_no_ray_goes_between_two_sides():
    query = laid_out([(kt.polygon(OCTAGON), 0.0, 0.0)])
    random = np.random.default_rng(1)
    for corner in np.array(OCTAGON * 40):
        way = corner + random.uniform(-0.25, 0.25, 2)
        assert places.ray(query, tuple(corner + random.uniform(0.1, 4.0) * way), tuple(-way))


@given(
    bodies=bodies, origin=points, direction=directions, most=st.integers(0, 8), within=reaches.filter(bool)
)
def test_the_first_are_the_first_of_all(bodies, origin, direction, most, within):
    query = laid_out(bodies)
    hits = places.ray(query, origin, direction)
    assert places.ray(query, origin, direction, most) == hits[:most]
    near = [hit for hit in hits if hit.distance <= within]
    assert places.ray(query, origin, direction, within=within) == near


@given(bodies=bodies, origin=points, direction=directions, power=st.integers(-60, 60))
def test_the_length_of_the_direction_does_not_matter(bodies, origin, direction, power):
    longer = tuple(float(np.ldexp(part, power)) for part in direction)
    assume(all(np.ldexp(part, -power) == was for part, was in zip(longer, direction, strict=True)))
    query = laid_out(bodies)
    assert places.ray(query, origin, direction) == places.ray(query, origin, longer)


@given(bodies=bodies, point=points, direction=directions, box=boxes, data=st.data())
def test_only_those_are_asked_about_who_are_named_in_their_order(bodies, point, direction, box, data):
    assume(bodies)
    slots = data.draw(st.permutations(range(len(bodies))))[: data.draw(st.integers(0, len(bodies)))]
    query, everybody = laid_out(bodies, slots), laid_out(bodies)
    held = set(places.bodies_in(everybody, box).tolist())
    assert places.bodies_in(query, box).tolist() == [i for i in slots if i in held]
    assert set(places.bodies_near(query, point, count=len(bodies)).tolist()) == set(slots)
    hits = {hit.body: hit.distance for hit in places.ray(everybody, point, direction)}
    met = sorted((i for i in slots if i in hits), key=lambda i: (hits[i], slots.index(i)))
    assert [hit.body for hit in places.ray(query, point, direction)] == met


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
    query = laid_out(bodies)
    bare = replace(query, shapes=())
    for inside in (False, True):
        one, other = (places.bodies_in(each, box, inside) for each in (query, bare))
        assert one.tolist() == other.tolist()
    for within in (None, radius):
        one, other = (places.bodies_near(each, point, within, count or 0) for each in (query, bare))
        assert one.tolist() == other.tolist()
    for most in (None, count):
        one, other = (places.ray(each, point, direction, most, radius or None) for each in (query, bare))
        assert one == other


def test_a_run_of_shapes_is_asked_by_the_numbers_of_its_bodies():
    """With boxes and discs of two kinds, two of them removed."""
    rng = np.random.default_rng(3)
    spots = [(x + 0.5, y + 0.5) for x in range(8) for y in range(8)]
    shapes = [kt.box(0.75, 0.25), kt.disc(0.25), kt.box(0.5, 0.5)]
    more = {"kind": ["even", "odd"] * 32, "commands": [kt.Remove(5, 0.25), kt.Remove(40, 0.5)]}
    flies, shape = rng.normal(size=(64, 2)), rng.integers(0, 3, 64)
    sim = kt.Simulation(kt.Scene(spots, flies, shape=shape, shapes=shapes, arena=(8.0, 8.0), **more), "cells")
    sim.run(until=1.0)
    there = dict(zip(sim.bodies.tolist(), sim.positions().tolist(), strict=True))
    assert len(there) == 62
    everybody = {i: (sim.scene.shapes[sim.scene.shape[i]], x, y) for i, (x, y) in there.items()}
    for x, y, w, h in np.random.default_rng(4).uniform(0.0, 8.0, (5, 4)).tolist():
        box, point = (x, y, x + w, y + h), decimal(x, y)
        far = {i: gap(body, point) for i, body in everybody.items()}
        for kinds, table in ((None, [*everybody]), ("odd", [i for i in everybody if i % 2])):
            held = [i for i in table if gap_of_box(everybody[i], box) <= 0]
            assert sim.bodies_in(box, kinds=kinds).tolist() == held
            near = sorted(table, key=lambda i: far[i])[:5]
            assert sim.bodies_near((x, y), k=5, kinds=kinds).tolist() == near
