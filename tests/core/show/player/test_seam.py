"""Periodic axes in the page and in pictures: what crosses the border is whole, on the right side, found."""

import json
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import kinetile as kt
from chromium import needs_chromium
from kinetile.plugin.drawing import points_of
from kinetile.show.picture import take_picture
from kinetile.show.player import view_scene
from kinetile.show.space_time import take_space_time
from player_pages import SCENES, ask_node, needs_node, torus

CASES = [
    *((periodic, False, phase) for periodic in ("x", "xy") for phase in ("sap-1d", "sap-2d")),
    ("xy", False, "cells"),
    ("xy", True, "sap-2d"),
    ("x", False, "sweep-tiling"),
    ("y", True, "sap-2d"),
]

SHOWN = """
const n = bodies.x.length;
const [x, y, kx, ky] = [0, 1, 2, 3].map(() => new Float64Array(n));
const places = { x, y, kx, ky, periods: held.periods };
return given.times.map((time) => {
    play.seek(clock.momentAt(time, held.start, held.unit));
    const { motion, structure, done } = play.runs[0];
    motion.places(play.moment, places);
    return structure.at(done).filter((shape) => structure.shape[shape] !== 4).flatMap((shape) => {
        const points = structure.points(shape, places);
        return structure.images(shape, places).map(([right, up]) => [
            right !== 0 || up !== 0,
            structure.roles[structure.role[shape]],
            points.flatMap(([px, py]) => [px + right, py + up]),
        ]);
    });
});
"""


def rounded(role: str, coordinates: list[float]) -> tuple[str, ...]:
    return (role, *(f"{each:.6f}".replace("-0.000000", "0.000000") for each in coordinates))


@needs_node
@pytest.mark.parametrize(("periodic", "shaped", "phase"), CASES)
def test_the_page_and_the_picture_show_the_same_shapes_and_images(periodic, shaped, phase, tmp_path):
    assert_same(torus(periodic, shaped), phase, 0.0, tmp_path)


@needs_node
@pytest.mark.parametrize("begin", [0.0, 0.4])
@pytest.mark.parametrize("phase", ["sap-1d", "sap-2d"])
def test_so_they_do_when_bodies_are_inserted_beyond_the_border_and_leave(phase, begin, tmp_path):
    insert = kt.Insert(0.01, (1 / 3 - 1.0, 1 / 3 + 2.0), (0.9, -0.7), 0.02)
    commands = [insert, kt.Turn(2, 0.5, (3.0, -2.0)), kt.Remove(0, 0.6)]
    assert_same(replace(torus("xy"), commands=commands), phase, begin, tmp_path)


def assert_same(scene, phase, begin, tmp_path):
    sim, times = kt.Simulation(scene, phase), np.random.default_rng(4).uniform(begin, 0.8, 20)
    times.sort()
    page = view_scene(scene, [(phase, {})], begin=begin, until=0.8).page
    seen = ask_node(tmp_path, page, SHOWN, times=times.tolist())
    moved = 0
    for time, found in zip(times.tolist(), seen, strict=True):
        sim.run(time)
        wanted = [(each.role, sum(points_of(each), ())) for each in take_picture(sim).shapes]
        assert Counter(rounded(*each) for each in wanted) == Counter(rounded(*each[1:]) for each in found)
        moved += sum(each[0] for each in found)
    assert (moved > 0) == (phase != "cells")  # cells stand still


FLIGHT = """(() => {
    const player = kinetilePlayer;
    const { camera, playback: { moment, runs: [run] } } = player;
    const [width, height] = [800, 600];
    let [from, lines] = [null, []];
    const place = (x, y) => [camera.x + camera.dx + (x - width / 2) / camera.scale, camera.y + camera.dy + (height / 2 - y) / camera.scale];
    const pen = {
        setLineDash() {}, beginPath() {}, stroke() {}, arc() {},
        moveTo(x, y) { from = place(x, y); },
        lineTo(x, y) { lines.push([...from, ...(from = place(x, y))]); },
    };
    return [...run.motion.plans.there.keys()].map((body) => {
        lines = [];
        player.drawPlan({ pen, camera, width, height }, run, body);
        return [lines, player.plan(run, body), run.motion.place(body, moment)];
    });
})()"""  # noqa: E501


def seen_length(line: list[float]) -> float:
    (x, y, to_x, to_y), (first, last) = line, (0.0, 1.0)
    for at, way in ((x, to_x - x), (y, to_y - y)):
        ends = sorted((-at / way, (1.0 - at) / way)) if way else [0.0, 1.0]
        first, last = max(first, ends[0]), min(last, ends[1])
    return max(last - first, 0.0) * math.hypot(to_x - x, to_y - y)


@needs_chromium
def test_a_plan_is_drawn_once_through_every_border_that_it_crosses(browser, tmp_path):
    """A disc of speed 7 crosses several borders between two events: each part of its flight is in the box."""
    scene = kt.Scene([(0.2, 0.2), (0.7, 0.6)], [(7.0, 4.0), (0.1, -0.3)], 0.05, arena=(1, 1), periodic="xy")
    browser.open(view_scene(scene, [("cells", {})], until=3.0).save(tmp_path / "page.html"))
    longest = 0.0
    for time in (0.0, 0.3, 0.7, 1.1, 1.9):
        browser.value(f"kinetilePlayer.goTo('{time}')")
        for lines, (anchor, now, then), place in browser.value(FLIGHT):
            length = math.dist(anchor, then)
            assert sum(map(seen_length, lines)) == pytest.approx(length, abs=1e-6)
            assert now == pytest.approx(place)
            longest = max(longest, length)
    assert longest > 3.0
    assert browser.said() == []


PIXELS = """(() => {
    const canvas = kinetilePlayer.panes[0];
    const { width, data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const box = canvas.getBoundingClientRect();
    return PLACES.map((place) => {
        const [right, up] = kinetilePlayer.camera.see(...place);
        const [x, y] = [canvas.clientWidth / 2 + right, canvas.clientHeight / 2 - up].map(Math.round);
        return [[...data.slice(4 * (y * width + x), 4 * (y * width + x) + 4)], box.left + x, box.top + y];
    });
})()"""


@needs_chromium
def test_copies_at_the_border_are_drawn_hovered_and_clicked_as_the_body_itself(browser, tmp_path):
    scene = kt.Scene(
        [(0.1, 3.9), (2.0, 2.0), (3.9, 1.0)],
        [(0.0, 0.0), (0.1, 0.0), (0.0, 0.0)],
        shape=[0, 0, 1],
        shapes=[kt.disc(0.4), kt.box(1.2, 0.5)],
        arena=(4, 4),
        periodic="xy",
    )
    browser.open(view_scene(scene, [("sap-2d", {})], until=1.0).save(tmp_path / "page.html"))
    browser.press("t")
    browser.settle()
    copies = {(3.8, 3.8): 0, (0.2, 0.1): 0, (3.85, 0.15): 0, (0.3, 1.1): 2, (1.8, 2.1): 1, (0.6, 1.1): None}
    copies |= {(1.0, 1.0): None, (-0.1, 3.9): None, (4.2, 1.0): None}  # beyond the border nothing is drawn
    places = browser.value(PIXELS.replace("PLACES", json.dumps(list(copies))))
    bare = [colour for (colour, *_), body in zip(places, copies.values(), strict=True) if body is None]
    for (colour, *place), body in zip(places, copies.values(), strict=True):
        browser.click(*place)
        assert (browser.value("kinetilePlayer.selected"), colour in bare) == (body, body is None)
        assert browser.value("kinetilePlayer.panes[0].title") == ("" if body is None else f"body {body}")
    assert browser.said() == []


@needs_chromium
def test_a_contact_beyond_the_border_is_looked_at_where_it_is_drawn(browser, tmp_path):
    scene = kt.Scene([(3.5, 2.0), (0.8, 2.0)], [(0.5, 0.0), (-0.3, 0.0)], 0.3, arena=(4, 4), periodic="x")
    browser.open(view_scene(scene, [("sap-1d", {})], until=3.0).save(tmp_path / "page.html"))
    browser.press("2", "ArrowRight", "c")
    x = browser.value("kinetilePlayer.camera.x")
    assert 0 < x < 0.5  # drawn there, and not beyond 4
    assert browser.said() == []


@needs_chromium
def test_an_accelerated_body_has_a_parabola_for_its_plan_and_the_structure_is_shown(browser, tmp_path):
    view = view_scene(SCENES["accelerated"], [("sweep-tiling", {})], until=1.5)
    (note,) = view.page.all_notes
    assert "off their chords by 0.00156 at most" in note
    browser.open(view.save(tmp_path / "page.html"))
    browser.value("more.click()")
    shown = "[kinetilePlayer.lanes, ...[structure, even].map((each) => each.checkVisibility())]"
    assert browser.value(shown) == [["contacts", "structural", "walls", "commands"], True, True]
    browser.value("kinetilePlayer.goTo('0.7')")
    plans, pulls = browser.value(FLIGHT), [(0.3, -2.0), (0.3, -2.0), (0.0, 1.5), None, (-1.0, 0.5)]
    for (lines, points, place), pull in zip(plans, pulls, strict=True):
        many = 48 if pull else 1  # the fourth does not move
        assert points[many] == pytest.approx(place)
        if not pull:
            continue
        assert len(lines) == 48 + 24  # of what is to come every second piece
        for half in (points[:49], points[48:]):
            bends = np.diff(half, 2, axis=0)
            assert bends == pytest.approx(np.broadcast_to(bends[0], bends.shape), abs=1e-9)
            assert bends[0] == pytest.approx(bends[0][1] / pull[1] * np.array(pull), abs=1e-9)
            assert bends[0][1] / pull[1] > 1e-8
    browser.value(
        "(() => { const axis = document.getElementById('axis'); axis.value = 'y'; "
        "axis.dispatchEvent(new Event('change')); kinetilePlayer.goTo('0.0'); })()"
    )
    pieces = browser.value("kinetilePlayer.spaceTime.pieces(kinetilePlayer.spaceTime.sheet()).pieces")
    wanted = take_space_time(kt.Simulation(SCENES["accelerated"], "naive"), 1.5, "y").pieces
    assert not browser.value("spacetime.hidden")
    drawn = sorted(
        (each["body"], *(each[end] for end in ("since", "until", "from", "to"))) for each in pieces
    )
    assert np.array(drawn) == pytest.approx(np.array(sorted(wanted)), abs=1e-8)
