"""What the built-in phases draw is what they keep: pairs, bounds, boxes, tiles, cells, and when they fail."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from kinetile.kernel.clock import TICKS
from kinetile.plugin.drawing import At, Box, Link, Polygon, Segment, points_of
from kinetile.show.picture import corners_of, take_picture
from lanes import BUILT_IN, examples

PHASES = (*BUILT_IN, "sap-1d:y", "sap-1d:3:4")
WITH_PAIRS = tuple(phase for phase in BUILT_IN if phase != "sap-1d")
STILL, FALLING = ((0.0, 0.0),), ((0.0, 0.0), (2.0, -6.0))
EXAMPLES = settings(max_examples=examples(40))


@st.composite
def moments(draw, phases=PHASES, gravities=FALLING):
    """A simulation of a few discs, of one size or of several, somewhere in its run, perhaps after bodies have
    come and gone, perhaps in a frame that has fallen for up to a tenth of the arena."""
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


@EXAMPLES
@given(moments(("sap-1d", "sap-1d:y")))
def test_the_bounds_of_sap_1d_are_those_of_its_list(sim):
    axis = int(sim.state.span[0]) >> 1
    listed = [int(sim.tables.queue.number[bound >> 3]) for bound in sim.state.order if bound >= 0]
    bounds = [item for item in sim.drawing() if item.role == "bound"]
    edges = [bound.a[axis] for bound in bounds]
    assert [edge.body for edge in edges] == listed
    radius = {disc.number: disc.radius for disc in take_picture(sim).discs}
    for bound, edge in zip(bounds, edges, strict=True):
        side = -1.0 if bound.label == "L" else 1.0
        assert edge.offset == pytest.approx(side * radius[edge.body], abs=1e-9)
    place = dict(zip(sim.bodies.tolist(), sim.positions()[:, axis].tolist(), strict=True))
    assert (np.diff([place[edge.body] + edge.offset for edge in edges]) > -1e-9).all()


@pytest.mark.parametrize("gravity", FALLING)
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
@given(moments(("sap-2d",)))
def test_sap_2d_draws_the_box_of_each_body(sim):
    boxes = {box.low[0].body: box for box in sim.drawing() if isinstance(box, Box)}
    assert sorted(boxes) == sim.bodies.tolist()
    for disc in take_picture(sim).discs:
        (left, bottom), (right, top) = boxes[disc.number].low, boxes[disc.number].high
        assert {left.body, bottom.body, right.body, top.body} == {disc.number}
        found = [-left.offset, -bottom.offset, right.offset, top.offset]
        assert found == pytest.approx([disc.radius] * 4, abs=1e-9)


@EXAMPLES
@given(moments(("sap-k", "sap-1d:3:4")))
def test_slanted_bounds_touch_their_discs(sim):
    """Of sap-k they are the sides of a polygon around each body; alone they are pieces of tangents."""
    radius = {disc.number: disc.radius for disc in take_picture(sim).discs}
    bounds = [item for item in sim.drawing() if item.role == "bound" and isinstance(item, Polygon | Segment)]
    assert len(bounds) in (len(radius), 2 * len(radius))
    for bound in bounds:
        points = points_of(bound)
        (body,) = {at.body for point in points for at in point}
        corners = np.array([[at.offset for at in point] for point in points])
        sides = np.roll(corners, -1, axis=0) - corners
        away = np.abs(corners[:, 0] * sides[:, 1] - corners[:, 1] * sides[:, 0]) / np.hypot(*sides.T)
        assert away == pytest.approx(radius[body], abs=1e-9)


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
@given(moments(("sweep-tiling",)))
def test_tiles_cover_the_arena_and_do_not_overlap(sim):
    picture = take_picture(sim)
    tiles = np.array([[*shape.low, *shape.high] for shape in picture.shapes if shape.role == "tile"])
    left, low, right, high = tiles.T
    width, height = picture.high
    assert len(tiles) == 3 * len(picture.discs) + 1
    assert (right - left > -1e-9).all()
    assert (high - low > -1e-9).all()
    assert ((right - left) * (high - low)).sum() == pytest.approx(width * height, abs=1e-9)
    points = np.random.default_rng(1).uniform(0.0, picture.high, (200, 2))
    x, y = points[:, :1], points[:, 1:]
    inside = (left < x) & (x < right) & (low < y) & (y < high)
    assert (inside.sum(axis=1) == 1).all()
    for disc in picture.discs:  # no tile goes through a body: none has a piece of its diameter inside
        (x, y), r = disc.at, disc.radius
        through = (np.minimum(right, x + r) - np.maximum(left, x - r) > 1e-9) & (low < y) & (y < high)
        assert not through.any()


@EXAMPLES
@given(moments(("sweep-tiling",)))
def test_bounds_of_sweep_tiling_go_as_far_as_can_be_seen(sim):
    picture = take_picture(sim)
    bounds = [corners_of(shape) for shape in picture.shapes if shape.role == "bound"]
    assert len(bounds) == 2 * len(picture.discs)
    edges = sorted(x for (x, _), _ in bounds)
    assert edges == pytest.approx(
        sorted(disc.at[0] + side * disc.radius for disc in picture.discs for side in (-1, 1)), abs=1e-9
    )
    for (x, low), (_, high) in bounds:
        for disc in picture.discs:
            crossed = abs(disc.at[0] - x) < disc.radius - 1e-9
            assert not (crossed and low + 1e-9 < disc.at[1] < high - 1e-9)


@EXAMPLES
@given(moments(("cells",)))
def test_every_body_is_in_a_cell(sim):
    picture = take_picture(sim)
    room = float(sim.state.levels.slack.max()) + 1e-9
    boxes = [shape for shape in picture.shapes if shape.role == "cell"]
    for disc in picture.discs:
        level = int(sim.state.homes[sim.tables.slots[disc.number]].level)
        side = float(sim.state.levels[level].side)
        here = [box for box in boxes if box.high[0] - box.low[0] == pytest.approx(side)]
        assert any(
            all(box.low[axis] - room <= disc.at[axis] <= box.high[axis] + room for axis in (0, 1))
            for box in here
        )
    assert len({(box.low, box.high) for box in boxes}) == len(boxes)


@EXAMPLES
@given(st.integers(1, 30), st.sampled_from([1.0, 3.0, 40.0]), st.integers(0, 10**6), st.sampled_from(FALLING))
def test_sides_of_power_cells_have_equal_and_least_power_over_two_discs(bodies, ratio, seed, gravity):
    scene = kt.make_scene(
        "random", bodies=bodies, density=0.2, radius_ratio=ratio, seed=seed, gravity=gravity
    )
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
