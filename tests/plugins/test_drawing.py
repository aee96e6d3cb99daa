"""What the built-in phases draw is what they keep: pairs, slanted bounds, power cells, and when they fail; of
the others ``tests/test_figures.py`` has the pictures."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from kinetile.kernel.clock import TICKS
from kinetile.plugin.drawing import At, Link, Polygon, Segment, points_of
from kinetile.show.picture import take_picture
from lanes import BUILT_IN, examples

PHASES = (*BUILT_IN, "sap-1d:y", "sap-1d:3:4")
WITH_PAIRS = tuple(phase for phase in BUILT_IN if phase != "sap-1d")
STILL, PULLS = ((0.0, 0.0),), ((0.0, 0.0), (2.0, -6.0))
EXAMPLES = settings(max_examples=examples(25))


@st.composite
def moments(draw, phases=PHASES, gravities=PULLS):
    """A simulation of a few discs, of one size or of several, somewhere in its run, perhaps after bodies have
    come and gone, perhaps with accelerations."""
    bodies = draw(st.integers(1, 9))
    ratio = draw(st.sampled_from([1.0, 3.0, 40.0]))
    seed = draw(st.integers(0, 10**6))
    gravity = draw(st.sampled_from(gravities))
    scene = kt.make_scene(
        "random", bodies=bodies, density=0.2, radius_ratio=ratio, seed=seed, gravity=gravity
    )
    name, _, axis = draw(st.sampled_from(phases)).partition(":")
    sim = kt.Simulation(scene, name, options={"axis": axis} if axis else None)
    sim.run(until=draw(st.sampled_from([0.0, 0.1, 0.25])))
    if bodies > 2 and draw(st.booleans()):
        place, radius = sim.positions()[1], float(scene.radius[1])
        sim.remove(1)
        sim.insert(tuple(place), (0.1, -0.2), 0.5 * radius)
        sim.remove(0)
        sim.run(until=sim.time + 0.05)
    return sim


def pairs_drawn(sim):
    links = [item for item in sim.drawing() if isinstance(item, Link)]
    assert all(link.role == "pair" for link in links)
    pairs = [(min(link.a, link.b), max(link.a, link.b)) for link in links]
    assert len(set(pairs)) == len(pairs)
    return sorted(pairs)


def off(sim):
    """By how much at most drawn shapes are off the bodies: both are within the skin, with chords' margin."""
    return 1e-9 + 2.0 * float(sim.tables.clock[0].limits.skin)


def next_to_fail(sim):
    return min((item.fails for item in sim.drawing() if item.fails is not None), default=None)


@EXAMPLES
@given(moments(WITH_PAIRS))
def test_the_links_are_the_candidate_pairs(sim):
    assert pairs_drawn(sim) == list(map(tuple, sim.candidate_pairs().tolist()))


@EXAMPLES
@given(moments(gravities=STILL))
def test_what_fails_next_is_the_next_structural_event(sim):
    drawn = next_to_fail(sim)
    event = sim.next_event
    if event is not None and event.kind == "structural":
        assert drawn == event.epoch * TICKS + event.tick
    elif drawn is not None and event is not None:
        assert drawn >= event.epoch * TICKS + event.tick


@EXAMPLES
@given(moments(gravities=STILL))
def test_it_holds_until_the_next_event(sim):
    before, event = sim.drawing(), sim.next_event
    if event is None:
        return
    sim.run(until=0.5 * (sim.time + event.time))
    if sim.next_event == event:
        assert sim.drawing() == before


@pytest.mark.parametrize("gravity", PULLS)
@pytest.mark.parametrize("axis", ["x", "y", "3:4"])
def test_the_axis_of_sap_1d_goes_through_the_arena_of_the_room(axis, gravity):
    scene = kt.make_scene("random", bodies=5, density=0.2, gravity=gravity)
    sim = kt.Simulation(scene, "sap-1d", options={"axis": axis})
    sim.run(until=0.1)
    (line,) = [item for item in sim.drawing() if item.role == "axis"]
    (x, y), (p, q) = line.a, line.b
    wanted = {"x": [0.0, 0.0, 1.0, 0.0], "y": [0.0, 0.0, 0.0, 1.0], "3:4": [0.08, -0.06, 0.92, 1.06]}
    assert [x, y, p, q] == pytest.approx(wanted[axis])


@EXAMPLES
@given(moments(("sap-k", "sap-1d:3:4")))
def test_slanted_bounds_touch_their_discs(sim):
    """For sap-k they are the sides of a polygon around each body; alone they are pieces of tangents."""
    radius = {disc.number: disc.radius for disc in take_picture(sim).discs}
    bounds = [item for item in sim.drawing() if item.role == "bound" and isinstance(item, Polygon | Segment)]
    assert len(bounds) in (len(radius), 2 * len(radius))
    for bound in bounds:
        points = points_of(bound)
        (body,) = {at.body for point in points for at in point}
        corners = np.array([[at.offset for at in point] for point in points])
        sides = np.roll(corners, -1, axis=0) - corners
        away = np.abs(corners[:, 0] * sides[:, 1] - corners[:, 1] * sides[:, 0]) / np.hypot(*sides.T)
        assert away == pytest.approx(radius[body], abs=off(sim))


@EXAMPLES
@given(moments(("sap-1d", "sap-1d:y", "sap-1d:-1:2", "sap-2d", "sap-k")))
def test_the_certificate_is_between_two_bounds_of_which_one_fails_then(sim):
    found = [item for item in sim.drawing() if item.role == "certificate"]
    if next_to_fail(sim) is None:
        return
    (certificate,) = found
    assert isinstance(certificate, Segment)
    assert certificate.fails == next_to_fail(sim)
    (first, *_) = [value for value in certificate.a if isinstance(value, At) and value.offset]
    failing = [item for item in sim.drawing() if item.role == "bound" and item.fails == certificate.fails]
    corners = [points_of(item)[0] for item in failing]
    assert first.body in {value.body for corner in corners for value in corner if isinstance(value, At)}


@EXAMPLES
@given(st.integers(1, 30), st.sampled_from([1.0, 3.0, 40.0]), st.integers(0, 10**6))
def test_sides_of_power_cells_have_equal_and_least_power_over_two_discs(bodies, ratio, seed):
    scene = kt.make_scene("random", bodies=bodies, density=0.2, radius_ratio=ratio, seed=seed)
    sim = kt.Simulation(scene, "power", options={"cells": True})
    sim.run(until=0.05)
    sides = [item for item in sim.drawing() if item.role == "cell"]
    assert len(sides) == len(sim.candidate_pairs())
    for side in sides:
        for at in (side.a, 0.5 * (np.array(side.a) + side.b), side.b):
            powers = np.sort(((sim.positions() - at) ** 2).sum(axis=1) - sim.radii() ** 2)
            assert powers[1] == pytest.approx(powers[0], rel=1e-6, abs=0.003 * sim.radii().min() ** 2)


@pytest.mark.parametrize("phase", ["sap-1d", "sap-2d", "sweep-tiling", "power"])
def test_times_hold_when_the_base_of_the_clock_has_moved_on(phase):
    scene = kt.Scene([(0.2, 0.3), (0.7, 0.6)], [(0.011, 0.0), (-0.007, 0.005)], 0.1, arena=(1.0, 1.0))
    sim = kt.Simulation(scene, phase)
    sim.run(until=1300.0)
    seen = 0
    for _ in range(30):
        drawn, event = next_to_fail(sim), sim.next_event
        if event.kind == "structural":
            assert drawn == event.epoch * TICKS + event.tick
            seen += 1
        sim.step()
    assert seen > 3
