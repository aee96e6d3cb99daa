"""Rays and cast discs where axes are periodic, and rays of some length: rays against exact arithmetic."""

import math
import random
from fractions import Fraction
from math import isqrt

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import box_scenes
import convex_scenes
import kinetile as kt
import torus_scenes
from lanes import examples, first

BITS = 3000

Entry = tuple[Fraction, Fraction]
"""(p, q) of p - sqrt(q): after what multiple of its direction a ray enters a disc."""


def root(value: Fraction) -> Fraction:
    return Fraction(isqrt((value.numerator << 2 * BITS) // value.denominator), 1 << BITS)


def entry(x: Fraction, y: Fraction, r: Fraction, direction: list[Fraction]) -> Entry | None:
    ux, uy = direction
    a, b, c = ux * ux + uy * uy, x * ux + y * uy, x * x + y * y - r * r
    if c <= 0:
        return Fraction(0), Fraction(0)
    if b <= 0 or b * b < a * c:
        return None
    return b / a, (b * b - a * c) / (a * a)


def length(at: Entry, n: Fraction) -> Fraction:
    """Returns the distance, to enough digits that equal lengths are equal; n is the direction's square."""
    far = root(at[0] * at[0] * n) - root(at[1] * n)
    return Fraction(round(far * (1 << BITS // 2)), 1 << BITS // 2)


def all_images(at: list[Fraction], r: Fraction, reach: Fraction, periods: tuple[float, float]):
    """Yields the places of a disc's images that a point within ``reach`` of (0, 0) can be in."""
    ranges = []
    for place, period in zip(at, periods, strict=True):
        p = Fraction(period)
        ends = [math.floor((end - place) / p) for end in (-reach - r, reach + r)] if p else [0, -1]
        ranges.append([place + i * p for i in range(ends[0], ends[1] + 2)])
    for x in ranges[0]:
        for y in ranges[1]:
            yield x, y


def expected(sim: kt.Simulation, origin, direction, within: float, wider: float) -> dict[int, Fraction]:
    start, u, reach = [*map(Fraction, origin)], [*map(Fraction, direction)], Fraction(within * wider)
    n = u[0] ** 2 + u[1] ** 2
    found = {}
    for body, place, radius in zip(sim.bodies.tolist(), sim.positions(), sim.radii(), strict=True):
        at, r = [Fraction(float(p)) - s for p, s in zip(place, start, strict=True)], Fraction(radius * wider)
        entries = (entry(x, y, r, u) for x, y in all_images(at, r, reach, sim.scene.periods))
        lengths = [length(each, n) for each in entries if each]
        if lengths and min(lengths) <= reach:
            found[body] = min(lengths)
    return found


def check(sim: kt.Simulation, origin, direction, within: float) -> list[kt.RayHit]:
    """Returns the hits of a ray, after a comparison with exact arithmetic, but for rounding."""
    hits = sim.ray(origin, direction, within=within)
    inner, outer = (expected(sim, origin, direction, within, 1.0 + side * 2.0**-30) for side in (-1, 1))
    assert {*inner} <= {hit.body for hit in hits} <= {*outer}
    assert [hit.distance for hit in hits] == sorted(hit.distance for hit in hits)
    for hit in hits:
        far, off = Fraction(hit.distance), Fraction(within * 2.0**-40)
        assert outer[hit.body] - off <= far <= inner.get(hit.body, Fraction(within)) + off
    for most in {0, 1, len(hits)}:
        assert sim.ray(origin, direction, within=within, most=most) == hits[:most]
    return hits


@pytest.mark.parametrize("seed", first(3, range(80)))
def test_a_ray_meets_what_exact_arithmetic_says(seed):
    """Along a lattice, where places tie, and along whatever line."""
    rng = random.Random(seed)
    sim = kt.Simulation(torus_scenes.drawn(seed, (1, 2, 3, 5, 8)), "naive")
    width, height = sim.scene.arena
    reach = rng.choice((0.25, 1.0, 3.0, 12.0)) * min(width, height)
    for _ in range(3):
        far = rng.choice((0, 0, -3, 10**6))
        origin = (rng.randrange(33) / 32 * width + far * width, rng.randrange(33) / 32 * height)
        check(sim, origin, rng.choice([(1, 0), (0, -1), (1, 1), (3, 4), (-8, 1), (-1, 40), (1, 40)]), reach)
        origin = (rng.uniform(-2 * width, 2 * width), rng.uniform(-height, height))
        check(sim, origin, (rng.gauss(0, 1), rng.gauss(0, 1)), rng.uniform(0.1, 2.0) * reach)


def lattice(periodic: str, places: list[tuple[float, float]], radius: float = 0.125, **more) -> kt.Simulation:
    at = [(x / 8, y / 8) for x, y in places]
    scene = kt.Scene(at, np.zeros((len(at), 2)), radius, arena=(1.0, 1.0), periodic=periodic, **more)
    return kt.Simulation(scene, "naive")


eighths = st.integers(-24, 24).map(lambda i: i / 8)
steps = st.tuples(st.integers(-3, 3), st.integers(-3, 3)).filter(any)


@settings(max_examples=examples(60))
@given(
    periodic=st.sampled_from(["x", "y", "xy"]),
    places=st.sets(st.tuples(st.sampled_from([1, 3, 5, 7]), st.sampled_from([1, 3, 5, 7])), min_size=1),
    origin=st.tuples(eighths, eighths),
    direction=steps,
    within=st.integers(1, 40).map(lambda i: i / 8),
    nudge=st.sampled_from([-1.0, 0.0, 0.0, 1.0]),
)
@example("xy", {(1, 1)}, (0.375, 0.0), (1, 0), 0.75, 0.0)  # a tangent, whose point is just within
@example("xy", {(1, 1)}, (0.375, 0.0), (1, 0), 0.75, -1.0)
@example("xy", {(1, 5)}, (0.375, 0.625), (-1, 0), 5.0, 0.0)  # its own image behind is further
@example("xy", {(7.75, 4)}, (1.03125, 0.8125), (1, 40), 1.0, 0.0)  # steeply between an edge and the border
@example("xy", {(4, 7.75)}, (0.8125, 1.03125), (40, 1), 1.0, 0.0)
@example("xy", {(1, 1), (5, 5)}, (0.5, 0.125), (1, 0), 0.5, 0.0)  # touched by its end
@example("xy", {(1, 1), (5, 5)}, (7.125, -2.875), (1, 0), 2.0**-60, 0.0)  # in an image
@example("xy", {(1, 1), (5, 5)}, (2.0**200, 0.625), (1, 0), 4.0, 0.0)
def test_ties_and_tangents_of_a_lattice(periodic, places, origin, direction, within, nudge):
    """All is dyadic, and touches: so grazes, ends at an edge and equal distances are frequent."""
    within = float(np.nextafter(within, within + nudge))
    check(lattice(periodic, sorted(places)), origin, direction, within)


@pytest.mark.parametrize("within", [6.0, pytest.param(64.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("slope", [1.0, 2.0**-30, 2.0**-52, 1e-17, 5e-324])
def test_a_ray_may_drift_from_row_to_row(slope, within):
    """Nearly along an axis: it leaves its row or not, by as little as it is inclined."""
    sim = lattice("xy", [(1, 1), (4, 5)])
    for y in (0.25, float(np.nextafter(0.25, 1.0)), 0.375):
        check(sim, (0.5, y), (1.0, slope), within)
        check(sim, (y, 0.5), (-slope, 1.0), within)


def test_kinds_are_left_out_in_images_too():
    sim = lattice("xy", [(1, 1), (5, 1)], kind=["ball", "sensor"], responses={("*", "*"): "elastic"})
    assert sim.ray((0.375, 0.125), (1, 0), within=2.0, kinds="ball") == [(0, 0.625)]
    assert sim.cast((0.25, 0.125, 0.0625), (-1.0, 0.0), kinds="sensor") == (0.4375, 0, 7 << 48, 1, 0.4375)


def test_only_periods_that_are_crossed_count():
    sim = lattice("x", [(1, 1)])
    assert sim.ray((0.125, 0.5), (0, -1), within=1e9) == [(0, 0.25)]
    assert sim.ray((0.125, 2.0**200), (0, -1), within=2.0**200) == [(0, 2.0**200)]
    assert sim.ray((0.125, 2.0**200), (1, 0), within=1e3) == []
    assert sim.cast((0.125, 0.5, 0.125), (0.0, -1e6)).body == 0
    assert sim.cast((0.125, 0.5, 0.125), (0.0, -(2.0**30))).body == 0
    assert sim.cast((0.125, 2.0**200, 0.125), (1.0, 0.0)) is None
    turned = lattice("y", [(1, 1)])
    assert turned.cast((0.5, 0.125, 0.125), (-(2.0**30), 0.0)).body == 0
    assert turned.cast((2.0**200, 0.125, 0.125), (-1.0, 1.0)) is None


@pytest.mark.parametrize("seed", first(5, range(60)))
def test_a_cast_shape_meets_whom_the_body_meets_whose_shape_it_is(seed):
    """A body that moves is taken out of its scene and cast into it instead."""
    scene = (convex_scenes if seed % 4 else box_scenes).drawn(seed, (4, 6, 8), ("x", "y", "xy"))
    moving = np.flatnonzero(np.isfinite(scene.mass))
    if not len(moving):
        pytest.skip("all bodies of this scene are immovable")
    body = int(moving[-1])
    coming = kt.Simulation(scene, "naive").next_contact_of(body, kinds=scene.kinds)
    rest = np.delete(np.arange(len(scene)), body)
    columns = {name: getattr(scene, name)[rest] for name in ("position", "velocity", "mass", "shape")}
    others = kt.Scene(
        **columns, shapes=scene.shapes, arena=scene.arena, periodic=scene.periodic, unit=scene.time_unit
    )
    shape = scene.shapes[scene.shape[body]]
    hit = kt.Simulation(others, "naive").cast((*scene.position[body], shape), scene.velocity[body])
    if coming is None:
        assert hit is None
    else:
        met = coming.a + coming.b - body
        assert hit[:4] == (*coming[:3], met - (met > body))


def test_a_shape_is_cast_among_discs():
    sim = lattice("x", [(1, 1)])
    assert sim.cast((0.5, 0.125, kt.box(0.125, 0.25)), (1.0, 0.0)) == (0.4375, 0, 7 << 48, 0, 0.4375)
    assert sim.cast((0.5, 0.125, kt.box(0.125, 0.25)), (-1.0, 0.0)) == (0.1875, 0, 3 << 48, 0, 0.1875)


def test_questions_see_the_images_of_shapes():
    """A box is right of its position by more than a fifth of the period."""
    aside = kt.polygon([(1.5, -0.25), (2.0, -0.25), (2.0, 0.25), (1.5, 0.25)])
    frame = {"arena": (9.0, 9.0), "periodic": "xy", "shapes": [aside, kt.disc(0.25)]}
    sim = kt.Simulation(kt.Scene([(8.0, 0.0), (3.5, 0.0)], [(0, 0)] * 2, shape=[0, 1], **frame), "naive")
    assert sim.bodies_near((3.75, 0.0), radius=0.0).tolist() == [1]
    assert sim.bodies_near((3.5, 9.0), radius=2.5).tolist() == [1, 0]
    assert sim.bodies_near((3.5, 9.0), radius=2.4).tolist() == [1]
    assert sim.bodies_near((2.25, 0.0), k=1).tolist() == [1]
    assert sim.bodies_near((2.0, 0.0), k=1).tolist() == [0]
    assert sim.bodies_in((0.0, 8.5, 0.5, 9.0)).tolist() == [0]
    assert sim.bodies_in((0.5, -0.25, 1.0, 0.25), whole=True).tolist() == [0]
    assert sim.ray((4.5, 0.125), (1.0, 0.0), within=6.0) == [(0, 5.0)]
    assert sim.ray((4.5, 8.875), (-1.0, 0.0), within=6.0)[1:] == [(0, 3.5)]


def test_a_cast_disc_sees_no_further_than_bodies_do():
    """A thousand units of the clock; an overlap is no fault of a cast."""
    sim = lattice("x", [(1, 1)])
    assert sim.cast((0.5, 0.125, 0.125), (1.0, 0.0)) == (0.375, 0, 3 << 49, 0, 0.375)
    assert sim.cast((0.375, 0.125, 0.125), (2.0**-10, 0.0)) == (512.0, 512, 0, 0, 0.5)
    assert sim.cast((0.375, 0.125, 0.125), (2.0**-12, 0.0)) is None, "met after 2,048"
    assert sim.cast((1.125 + 2.0**-5, 0.125, 0.125), (-1.0, 0.0)) == (0.0, 0, 0, 0, 0.0)
    assert sim.cast((1.125, 0.125, 0.125), (0.0, 0.0)) == (0.0, 0, 0, 0, 0.0)
    sim.run(until=1.0)
    assert sim.fault is None
