"""A structure that is computed from positions in the page is that which the phase draws, at any moment."""

from itertools import product

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import recording, view_scene
from player_pages import SCENES, ask_node, needs_node

SCENES_TOO = {
    "sizes": kt.make_scene("random", bodies=30, density=0.3, radius_ratio=4, seed=4),
    "crowd": kt.make_scene("grid", bodies=66, density=0.4, seed=2),
}
WHERE = ["grid", "masses", "come and go", "sizes", "crowd"]

COMPARED = """
const [run] = play.runs;
const { events, structure, present, motion } = run;
const places = { x: bodies.x.slice(), y: bodies.y.slice() };
const side = ([body, offset]) => (body < 0 ? offset : [body, Math.sign(offset)].join(" "));
const bare = (from, done) => from.at(done).map((shape) => from.plain(shape))
    .filter(({ role }) => role !== "certificate")
    .map(({ shape, role, label, coordinates }) => {
        const text = [shape, role, label === "corner" ? "" : label, ...coordinates.map(side)];
        return text.join(", ");
    }).sort();
const found = [];
for (let event = 1; event < events.count && event < structure.seen; event += 1) {
    const moment = clock.between(momentOf(event - 1), momentOf(event), 0.5);
    if (clock.compare(moment, momentOf(event - 1)) <= 0) continue;
    play.seek(moment);
    motion.places(play.moment, places);
    const drawn = bare(structure, run.done);
    const computed = bare(present.at(play.moment, run.done, motion, places), 0);
    const missing = drawn.filter((each) => !computed.includes(each));
    const wrong = computed.filter((each) => !drawn.includes(each));
    found.push([drawn.length, missing, wrong]);
}
function momentOf(event) { return [events.epoch[event], events.tick[event]]; }
return found;
"""


@needs_node
@pytest.mark.parametrize("name", WHERE)
@pytest.mark.parametrize("phase", ["sweep-tiling", "sap-1d", "sap-1d:axis=y", "sap-2d"])
def test_what_is_computed_is_what_the_phase_draws(phase, name, tmp_path):
    scene, until = (SCENES | SCENES_TOO)[name], 0.08 if name in SCENES_TOO else 0.4
    name, _, option = phase.partition(":")
    options = dict([option.split("=")]) if option else {}
    page = view_scene(scene, [(name, options)], until=scene.start + until).page
    found = ask_node(tmp_path, page, COMPARED)
    assert found
    for drawn, missing, wrong in found:
        assert drawn > 0
        assert (missing, wrong) == ([], [])


@needs_node
@pytest.mark.parametrize("phase", ["naive", "cells"])
def test_what_does_not_follow_from_positions_is_not_computed(phase, tmp_path):
    page = view_scene(SCENES["grid"], [(phase, {})], until=0.2).page
    body = "return play.runs[0].present.at(play.moment, 0, play.runs[0].motion, bodies);"
    assert ask_node(tmp_path, page, body) is None


@needs_chromium
@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_structure_is_there_to_the_end_where_recording_it_has_stopped(width, height, tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "MOST_LOOKS", 1000)
    view = view_scene(SCENES["grid"], [("sweep-tiling", {})], until=0.6)
    assert "it is computed from the positions" in view.notes[0]
    seen = view.page.recordings[0].stepped.structure.seen
    with Browser(width, height) as browser:
        browser.open(view.save(tmp_path / "page.html"))
        browser.press("End")
        browser.settle()
        assert browser.value("kinetilePlayer.playback.runs[0].done") > seen
        readings = browser.value("document.getElementById('readings').textContent")
        assert "tiles drawn49" in readings
        assert f"recorded up to event {seen}, computed since" in readings
        assert browser.said() == []


TIES = {
    "cradle": kt.make_scene("cradle"),
    "break": kt.make_scene("break"),
    "touching lattice": kt.make_scene("lattice", bodies=16, seed=5, touching=0.5),
    "lattice": kt.make_scene("lattice", bodies=16, seed=1),
}


@needs_node
@pytest.mark.parametrize(
    ("phase", "name"),
    # In the last one bounds tie for good behind a body that hides them from each other, until it has passed
    # both at one tick: the order of these two events is in no plan.
    [
        pair
        for pair in product(["sap-1d", "sap-2d", "sweep-tiling"], TIES)
        if pair != ("sweep-tiling", "lattice")
    ],
)
def test_where_bounds_tie_they_are_in_the_order_in_which_they_came_there(phase, name, tmp_path):
    page = view_scene(TIES[name], [(phase, {})], until=None, max_contacts=25).page
    found = ask_node(tmp_path, page, COMPARED)
    assert found
    assert [(missing, wrong) for _, missing, wrong in found if missing or wrong] == []


@needs_node
@pytest.mark.parametrize(("phase", "has"), [("sap-2d", True), ("sap-1d", False)])
def test_a_matrix_is_shown_without_a_recorded_structure(phase, has, tmp_path):
    page = view_scene(SCENES["grid"], [(phase, {})], until=0.1, steps=False).page
    assert ask_node(tmp_path, page, "return play.runs[0].present.hasMatrix;") == has
