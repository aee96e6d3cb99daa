"""Stepping by event: forward and back ends where it began, by kind and by body, in one run and in two."""

import math
from fractions import Fraction

import numpy as np
import pytest

import kinetile as kt
from kinetile.show.player import recording, view_scene
from player_pages import SCENES, ask_node, needs_node, record


@pytest.fixture(autouse=True)
def no_structure(monkeypatch):
    """Drawing is tested in another file: it takes its time."""
    monkeypatch.setattr(recording, "MOST_LOOKS", 0)


STATE = """
    const state = () => JSON.stringify([play.moment, ...play.runs.map((run) =>
        [run.done, run.motion.done, ...placesOf(run.motion, play.moment), ...run.motion.plans.vx])]);
"""


@needs_node
def test_time_waits_where_a_run_is_still_being_computed(tmp_path):
    page = view_scene(SCENES["grid"], [("naive", {})], until=0.5, steps=False).page
    body = """
        const { events } = play.runs[0];
        const last = events.count - 1;
        play.jump(0, last - 1);
        events.count = last; // of the last one nothing is known yet
        play.known = play.moment;
        return [play.playEvenly(5), play.moment, play.known, play.playEvenly(0.5), play.moment];
    """
    more, moment, known, again, still = ask_node(tmp_path, page, body)
    assert (more, again) == (True, True)
    assert moment == still == known


@needs_node
@pytest.mark.parametrize("phases", [("sap-1d",), ("sweep-tiling", "sap-2d")])
def test_forward_and_back_ends_where_it_began(phases, tmp_path):
    scene = kt.make_scene("grid", bodies=16, density=0.5, seed=3)
    page = view_scene(scene, [(phase, {}) for phase in phases], until=1.0).page
    body = (
        STATE
        + """
        const states = [];
        for (let step = 0; step < 500; step += 1) {
            play.step(1);
            states.push(state());
        }
        const equal = [];
        for (let step = 498; step >= 0; step -= 1) {
            play.step(-1);
            equal.push(state() === states[step]);
        }
        return [new Set(states).size, equal];
    """
    )
    different, equal = ask_node(tmp_path, page, body)
    assert equal == [True] * 499
    # In two runs several events may have one tick and leave one state; in one, each step counts.
    assert different == 500 or len(phases) == 2


@needs_node
def test_by_kind_and_by_body(tmp_path):
    scene = SCENES["grid"]
    rows = record(kt.Simulation(scene, "naive"), 1.0)
    page = view_scene(scene, [("sap-1d", {})], until=1.0).page
    body = """
        const list = [];
        while (play.step(1, given.group, given.whose)) list.push(play.moment);
        const back = [play.moment];
        while (play.step(-1, given.group, given.whose)) back.push(play.moment);
        return [list, back.reverse()];
    """
    moments = [[int(row["epoch"]), int(row["tick"])] for row in rows]
    wanted = [m for m, row in zip(moments, rows, strict=True) if row["b"] >= 0]
    assert ask_node(tmp_path, page, body, group="contacts", whose=None) == [wanted, wanted]
    wanted = [m for m, row in zip(moments, rows, strict=True) if -4 <= row["b"] < 0 and row["a"] == 3]
    assert len(wanted) > 2
    assert ask_node(tmp_path, page, body, group="walls", whose=3) == [wanted, wanted]


@needs_node
def test_time_passes_evenly_between_events(tmp_path):
    page = view_scene(SCENES["grid"], [("cells", {})], until=0.5).page
    body = """
        const done = [], moments = [];
        let more = true;
        while (more) {
            more = play.playEvenly(0.25);
            done.push(play.runs[0].done);
            moments.push(play.moment);
        }
        return [done, moments, play.runs[0].events.count, held.end];
    """
    done, moments, count, end = ask_node(tmp_path, page, body)
    assert done[:8] == [0, 0, 0, 1, 1, 1, 1, 2]
    assert moments == sorted(moments)
    assert (done[-1], moments[-1], len(done)) == (count, end, 4 * count + 4)


@needs_node
def test_the_gap_of_two_discs_is_right_to_the_last_digits(tmp_path):
    rng = np.random.default_rng(2)
    cases = []
    for _ in range(300):
        r, s = rng.uniform(0.01, 1.0, 2)
        way, (x, y) = rng.uniform(0, 2 * math.pi), rng.uniform(-2, 2, 2)
        far = (r + s) * (1 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-17, 0))
        cases.append([[x, y], r, [x + far * math.cos(way), y + far * math.sin(way)], s])
    page = view_scene(SCENES["no walls"], steps=False).page
    found = ask_node(tmp_path, page, "return given.cases.map((c) => camera.gapOf(...c));", cases=cases)
    for ((ax, ay), r, (bx, by), s), gap in zip(cases, found, strict=True):
        square = (Fraction(bx) - Fraction(ax)) ** 2 + (Fraction(by) - Fraction(ay)) ** 2
        total = Fraction(r) + Fraction(s)
        exact = (square - total**2) / (Fraction(math.sqrt(square)) + total)
        assert abs(Fraction(gap) - exact) <= abs(exact) * Fraction(1, 2**45) + Fraction(1, 2**100)


@needs_node
def test_one_can_pan_in_the_rounding_of_a_coordinate(tmp_path):
    body = """
        const view = new camera.Camera();
        view.look(0.3, 0.7);
        view.zoom(2 ** 80);
        const seen = [view.see(0.3, 0.7)];
        view.pan(300, -200);
        seen.push(view.see(0.3, 0.7));
        view.zoom(4, 50, 60);
        seen.push(view.see(0.3, 0.7));
        view.look(0.75, 0.5);
        const points = camera.edge(view, 0.5, 0.5, 0.25, 500);
        return [seen, points.length, points.flat().every(Number.isFinite)];
    """
    seen, points, finite = ask_node(tmp_path, view_scene(SCENES["no walls"], steps=False).page, body)
    assert seen == [[0, 0], [-300, 200], [-300 * 4 - 50 * 3, 200 * 4 - 60 * 3]]
    assert (points, finite) == (65, True)


@needs_node
def test_a_line_is_cut_to_what_is_near(tmp_path):
    lines = [
        ([0, 0], [3, 4], [[0, 0], [3, 4]]),
        ([-20, 0], [20, 0], [[-10, 0], [10, 0]]),
        ([-20, -20], [20, 20], [[-10, -10], [10, 10]]),
        ([0, 5], [40, 5], [[0, 5], [10, 5]]),
        ([-30, 11], [30, 11], []),
        ([12, 0], [0, 30], [[10, 5], [8, 10]]),
        ([4, 4], [4, 4], [[4, 4], [4, 4]]),
        ([50, 50], [50, 50], []),
    ]
    body = "return given.lines.map(([a, b]) => camera.clip(a, b, 10));"
    page = view_scene(SCENES["no walls"], steps=False).page
    assert ask_node(tmp_path, page, body, lines=lines) == [near for *_, near in lines]
