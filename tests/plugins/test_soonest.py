"""The bounds of ``soonest``: never later than the contact that ``meet`` finds, and close to it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import kinetile as kt
from inside import engine_of
from kinetile.errors import KinetileError
from kinetile.kernel.clock import SPAN
from kinetile.kernel.flight import note_place
from kinetile.kernel.tables import NEVER, NOBODY, Kernel
from kinetile.run.engine.engine import Engine
from kinetile_plugins.disc import Disc, collide, collide_equals, meet, soonest, soonest_of_equals
from kinetile_plugins.lower_bounds import LEAST
from lanes import examples

CLOSE = 2.0**-30
"""A part of the time to cross the discs' extent: how far an ordinary bound may be from the contact."""


def tables(scene: kt.Scene, ahead: int = 0) -> Kernel:
    """Returns a scene's tables, with its skin; the common clock stands ``ahead`` ticks after the start."""
    engine = engine_of(kt.Simulation(scene, "naive"))
    move_clock(engine, ahead)
    return for_both_forms(engine.k)


def for_both_forms(k: Kernel) -> Kernel:
    """Returns tables that also the form for bodies of any radius reads: a column of radii, not one number."""
    return k._replace(radii=np.array(k.radii))


def move_clock(engine: Engine, ahead: int) -> None:
    clock = engine.k.clock[0]
    clock.origin = min(ahead, int(clock.limits.span))
    for body in range(len(engine.k.bodies)):
        note_place(engine.k, body)


def asked(k: Kernel, body: int, others: list[int], at: int) -> tuple[float, float, int]:
    k.near[: len(others)] = others
    arguments = k, body, len(others), NOBODY, at
    first, second, who = soonest(*arguments)
    if len(set(np.asarray(k.radii).tolist())) == 1:
        assert soonest_of_equals(*arguments) == (first, second, who)
    return float(first), float(second), int(who)


def exactly(k: Kernel, a: int, b: int) -> int:
    return int(meet(k, min(a, b), max(a, b)))


def assert_bounds(k: Kernel, at: int) -> None:
    """Asserts that no contact after a tick comes before the bounds, for every body against all others."""
    n = len(k.bodies)
    slack = 1.0 - 2.0**-50
    for body in range(n):
        others = [other for other in range(n) if other != body]
        first, second, who = asked(k, body, others, at)
        assert first <= second
        assert (who == NOBODY) == (first == math.inf)
        for other in others:
            tick = exactly(k, body, other)
            if tick != NEVER and tick >= at:
                bound = first if other == who else second
                delay = bound * float(k.clock[0].per_time)
                assert bound <= LEAST or delay * slack <= tick - at, (
                    f"bodies {body} and {other}: {tick - at} after {at}, {delay}"
                )


coordinates = st.floats(-1.0, 1.0, width=32)
small = st.integers(-8, 8).map(lambda number: number / 8)
scales = st.sampled_from([1.0, 2.0**-40, 2.0**-20, 1e-3, 7.0, 1e6, 2.0**30])


@st.composite
def hard_scenes(draw: st.DrawFn) -> kt.Scene:
    """Discs that do not overlap, on a lattice or anywhere, of all sizes and speeds, of one scale each."""
    n = draw(st.integers(2, 12))
    extent, speed = draw(scales), draw(scales)
    numbers = small if draw(st.booleans()) else coordinates
    position = np.array(draw(st.lists(st.tuples(numbers, numbers), min_size=n, max_size=n)), dtype=float)
    velocity = np.array(draw(st.lists(st.tuples(numbers, numbers), min_size=n, max_size=n)), dtype=float)
    if draw(st.booleans()):
        slow = draw(st.lists(st.sampled_from([1.0, 1e-3, 1e-9, 0.0]), min_size=n, max_size=n))
        velocity *= np.array(slow)[:, None]
    apart = np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    assume(apart.min() > 2.0**-12)
    part = draw(st.sampled_from([0.5, 0.4999, 0.25, 1e-3, 1e-6]))  # .5: the two nearest touch
    radius = np.full(n, part * apart.min())
    if draw(st.booleans()):
        radius *= np.array(draw(st.lists(st.sampled_from([1.0, 0.5, 1e-3]), min_size=n, max_size=n)))
    try:
        return kt.Scene(position * extent, velocity * speed, radius * extent)
    except KinetileError:
        assume(False)
        raise


@settings(deadline=None, max_examples=examples(60))
@given(hard_scenes(), st.sampled_from([0, 1, 2**20, 2**51, 2**52, 2**56, SPAN // 2]), st.floats(0.0, 1.0))
def test_no_bound_is_later_than_the_contact(scene, ahead, part):
    """Touching, grazing, at rest, far away, and at any tick within a span of the common clock's origin."""
    k = tables(scene, ahead)
    origin, span = int(k.clock[0].origin), int(k.clock[0].limits.span)
    for at in (origin, origin + int(part * span), max(origin - int(part * span), 0)):
        assert_bounds(k, at)


@settings(deadline=None, max_examples=examples(100))
@given(
    st.floats(0.0, 2.0 * math.pi),
    st.floats(0.99, 1.0),
    st.integers(-60, 60),
    st.sampled_from([1e-6, 0.01, 0.4]),
)
def test_a_graze_has_a_bound(angle, depth, ulps, radius):
    """Two discs pass at a distance of ``depth`` times the sum of their radii, and some ulps."""
    ahead, aside = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    sideways = 2.0 * radius * (depth if ulps % 2 else 1.0 + ulps * 2.0**-52)
    scene = kt.Scene([(0.0, 0.0), 3.0 * ahead + sideways * aside], [ahead, -ahead], radius)
    k = tables(scene)
    for at in (0, 2**51):
        assert_bounds(k, at)


def test_the_one_that_is_barred_is_left_out():
    scene = kt.Scene([(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (8.0, 0.0)], [(1.0, 0.0), *[(0.0, 0.0)] * 3], 0.5)
    k = tables(scene)
    k.near[:3] = (3, 1, 1)
    first, second, who = soonest(k, 0, 3, 1, 0)
    assert int(who) == 3
    assert first < second
    assert first == pytest.approx(7.0, rel=1e-9)
    k.near[:4] = (3, 1, 2, 1)
    assert soonest(k, 0, 4, 1, 0)[2] == 2
    assert asked(k, 0, [0], 0) == (math.inf, math.inf, NOBODY)
    assert asked(k, 0, [], 0) == (math.inf, math.inf, NOBODY)


@pytest.mark.parametrize("count", [1, 2, 3, 8, 9, 20, 64, 65, 130, 200])
def test_the_first_and_the_second_of_any_number(count):
    """Wherever in the list they stand, and where six bits of a bound cannot number all."""
    close = 1e-9 if count <= 20 else 1e-7  # far away discs are fattened by more
    rng = np.random.default_rng(count)
    distance = 2.0 + 3.0 * rng.permutation(count)
    angle = np.linspace(0.0, 1.5 * np.pi, count)
    position = [(0.0, 0.0), *np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])]
    velocity = [(0.0, 0.0), *np.column_stack([-np.cos(angle), -np.sin(angle)])]
    k = tables(kt.Scene(position, velocity, 0.05))
    first, second, who = asked(k, 0, list(range(1, count + 1)), 0)
    ordered = np.argsort(distance)
    assert who == ordered[0] + 1
    assert first == pytest.approx(distance[ordered[0]] - 0.1, rel=close)
    assert second > first
    if count > 1:
        assert second < distance[ordered[1]] - 0.1


@pytest.mark.parametrize(("gap", "doubtful"), [(0.0, True), (2.0**-40, True), (2.0**-20, False)])
@pytest.mark.parametrize("place", [1, 9, 70])
def test_a_second_that_is_near_the_first_makes_its_bound_doubtful(gap, doubtful, place):
    """In the same lane, another one, or another 64."""
    position = [(0.0, 0.0), (3.0, 0.0), *[(90.0 + 3 * i, 90.0) for i in range(70)]]
    position[1 + place] = (0.0, 3.0 + gap)
    velocity = [(0.0, 0.0), (-1.0, 0.0), *[(0.0, 0.0)] * 70]
    velocity[1 + place] = (0.0, -1.0)
    k = tables(kt.Scene(position, velocity, 0.5))
    first, second, who = asked(k, 0, list(range(1, 72)), 0)
    assert int(who) in (1, 1 + place)
    ticks = (second - first) * float(k.clock[0].per_time)
    assert 0.0 <= ticks < 2.0**24
    assert (ticks < 2.0**14) == doubtful


@pytest.mark.parametrize("different", [{"radius": 0.02}, {"mass": 2.0}])
def test_bodies_of_one_radius_and_mass_that_stay_so_have_hooks_without_them(different):
    scene = kt.make_scene("grid", bodies=9)
    parts = Disc().prepare(scene)
    assert (parts.soonest, parts.collide) == (soonest_of_equals, collide_equals)
    others = {name: [getattr(scene, name)[0]] * 8 + [number] for name, number in different.items()}
    parts = Disc().prepare(replace(scene, **others))
    assert (parts.soonest, parts.collide) == (soonest, collide)
    assert engine_of(kt.Simulation(scene, live=True)).composition.pair.soonest is soonest


@pytest.mark.parametrize("density", [0.5, 0.01])
def test_ordinary_bounds_are_close_to_the_contact(density):
    """Else every contact would be computed twice."""
    sim = kt.Simulation(kt.make_scene("grid", bodies=49, density=density, seed=2), "naive")
    sim.run(max_contacts=25)
    sim.build()
    k = for_both_forms(engine_of(sim).k)
    now = int(k.clock[0].now)
    bounded = 0
    for body in range(49):
        others = [other for other in range(49) if other not in (body, int(k.bodies[body].last))]
        first, _, who = asked(k, body, others, now)
        if who != NOBODY:
            bounded += 1
            tick = exactly(k, body, who)
            assert tick != NEVER
            assert first * float(k.clock[0].per_time) <= tick - now + 1.0
            assert (tick - now) * float(k.clock[0].per_tick) - first <= CLOSE
    assert bounded > 15
