"""The page in a real browser: no message, no request, exact, and all of it by keyboard."""

import json
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from accessibility import install_axe, violations
from chromium import SHIFT, Browser, needs_chromium
from kinetile.kernel.clock import TICKS, Clock
from kinetile.show.player import view_scene
from lanes import first
from player_pages import PLACES_OF, SCENES

pytestmark = needs_chromium

ROOT = Path(__file__).parents[4]

FOCUS = """(() => {
    const here = document.activeElement;
    const style = getComputedStyle(here);
    const seen = here.getBoundingClientRect();
    const bar = document.querySelector(".transport");
    const inBar = bar.contains(here);
    const over = bar.getBoundingClientRect();
    return [
        [...document.querySelectorAll("*")].indexOf(here),
        style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2,
        seen.bottom > 0 && seen.top < innerHeight,
        inBar || seen.bottom <= over.top || seen.top >= over.bottom,
    ];
})()"""

FOCUSABLE = """[...document.querySelectorAll("button, select, input, canvas[tabindex]")]
    .filter((each) => each.checkVisibility()).length"""


@pytest.fixture(scope="module")
def axe(tmp_path_factory):
    return install_axe(tmp_path_factory.mktemp("axe"))


@pytest.mark.parametrize(("width", "height"), [(390, 844), pytest.param(1280, 800, marks=pytest.mark.slow)])
def test_it_plays_without_a_message_or_a_request(width, height, tmp_path):
    view = view_scene(SCENES["grid"], [("sweep-tiling", {}), ("cells", {})], until=1.0)
    path = view.save(tmp_path / "page.html")
    with Browser(width, height) as browser:
        browser.open(path)
        browser.press(*["ArrowRight"] * 5)
        assert browser.value("kinetilePlayer.playback.runs[0].done") == 5
        browser.press(" ")
        browser.settle()
        assert browser.value("document.getElementById('play').textContent") == "Pause"
        assert browser.value("document.documentElement.scrollWidth <= innerWidth")
        assert len(browser.photograph()) > 5000
        assert browser.said() == []
        assert browser.asked_for() == {path.as_uri()}


def test_the_keyboard_reaches_everything_and_shows_where_it_is(browser, saved):
    browser.open(saved)
    browser.value("document.getElementById('more').click()")
    browser.press("n", "ArrowRight")
    browser.settle()
    count = browser.value(FOCUSABLE)
    assert count > 25
    reached = []
    for _ in range(count):
        browser.press("Tab")
        reached.append(tuple(browser.value(FOCUS)))
    assert len({element for element, *_ in reached}) == count
    for element, has_outline, in_window, uncovered in reached:
        assert (has_outline, in_window, uncovered) == (True, True, True), element


def test_keys_do_what_they_say(browser, saved):
    browser.open(saved)

    def state(*names: str) -> list[object]:
        return [browser.value(f"kinetilePlayer.{name}") for name in names]

    browser.press("3", "ArrowRight", "ArrowRight")
    assert state("group", "playback.runs[0].done > 1") == ["structural", True]
    browser.press("ArrowLeft", "1", "Home")
    assert state("playback.runs[0].done", "group") == [0, "all"]
    browser.press("n", "n", "f")
    assert state("selected", "follows") == [1, True]
    browser.press("ArrowRight", modifiers=SHIFT)
    assert browser.value("document.getElementById('said').textContent").split(",")[0].count("1") > 0
    scale = browser.value("kinetilePlayer.camera.scale")
    browser.press("z", "z")
    assert state("camera.scale") == [4 * scale]
    browser.press("t", "e", "Escape")
    assert state("structured", "evenly", "selected") == [False, True, None]
    browser.press("?")
    assert browser.value("document.getElementById('help').open")
    browser.press("Escape")
    assert not browser.value("document.getElementById('help').open")
    browser.value("document.getElementById('more').click()")
    browser.value("document.getElementById('goto').focus()")
    browser.press("0", ".", "2", "5", "Enter")
    assert state("playback.moment") == [[0, 2**50]]
    assert browser.said() == []


PULLED = {
    "traffic": 8.0,
    "robots": 8.0,
    "pinball": 30.0,
    "galton": 10.0,
    "sedimentation": 40.0,
    "hopper": 3.0,
}
"""Scenes of docs/scenes with accelerations, and until when they are played."""


@pytest.mark.parametrize("name", PULLED)
def test_scenes_with_accelerations_are_where_the_library_has_them(name, browser, tmp_path):
    scene, until = kt.load_scene(ROOT / "docs" / "scenes" / f"{name}.toml"), PULLED[name]
    sim, clock, wanted = kt.Simulation(scene, "naive"), Clock(scene.start, scene.time_unit), []
    times = np.sort(np.random.default_rng(1).uniform(0.0, until, 300)).tolist()
    for time in times:
        sim.run(time)
        wanted.append(sim.positions().tolist())
    browser.open(view_scene(scene, [("cells", {})], until=until).save(tmp_path / "page.html"))
    moments = json.dumps([divmod(clock.ticks(time), TICKS) for time in times])
    seek = f"{moments}.map((each) => (play.seek(each), placesOf(play.runs[0].motion, play.moment)))"
    given = f"const play = kinetilePlayer.playback, placesOf = {PLACES_OF};"
    assert browser.value(f"(() => {{ {given} return {seek}; }})()") == wanted
    browser.press(" ")
    browser.settle()
    assert browser.said() == []


AT = "kinetilePlayer.bodyAt(kinetilePlayer.panes[0], kinetilePlayer.camera.see({}, {}))"
SEEN = """(() => {
    const canvas = kinetilePlayer.panes[0];
    const { width, data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return PLACES.map((place) => {
        const [right, up] = kinetilePlayer.camera.see(...place);
        const [x, y] = [canvas.clientWidth / 2 + right, canvas.clientHeight / 2 - up].map(Math.round);
        return [...data.slice(4 * (y * width + x), 4 * (y * width + x) + 4)];
    });
})()"""


def test_boxes_are_drawn_and_found_as_boxes(browser, tmp_path):
    scene = kt.Scene(
        [(3.0, 1.0), (3.0, 3.0), (6.0, 3.0)],
        [(0.0, 0.25), (0.0, 0.0), (-0.25, 0.0)],
        shape=[0, 0, 1],
        shapes=[kt.box(4.0, 0.5), kt.disc(0.5)],
        arena=(8.0, 6.0),
    )
    browser.open(view_scene(scene, [("naive", {})], until=7.0).save(tmp_path / "page.html"))
    browser.press("t")
    browser.settle()

    filled = [(1.5, 1.0), (4.9, 1.2), (1.1, 0.8), (6.3, 3.0)]
    empty = [(3.5, 2.0), (3.5, 1.5), (3.5, 0.5), (6.45, 3.45)]
    body, *rest = browser.value(SEEN.replace("PLACES", json.dumps(filled + empty)))
    assert rest[:3] == [body] * 3
    assert rest[3:] == rest[3:4] * 4 != [body] * 4
    places = [(1.2, 1.2), (3.5, 1.5), (4.5, 3.1), (6.2, 3.2), (6.45, 3.45)]
    assert [browser.value(AT.format(*place)) for place in places] == [0, None, 1, 2, None]
    browser.press("n", "ArrowRight", "c")  # the disc meets the end of the box beside it
    assert browser.value("[kinetilePlayer.camera.x, kinetilePlayer.camera.y]") == [5.0, 3.0]
    browser.settle()
    assert "box 4.0 x 0.5" in browser.value("document.getElementById('plan').textContent")
    assert "gap" not in browser.value("document.getElementById('readings').textContent")
    assert browser.said() == []


@pytest.mark.slow
@pytest.mark.parametrize("dark", first(1, [False, True]))
@pytest.mark.parametrize(("width", "phases"), [(1280, ("sweep-tiling",)), (390, ("sap-2d", "cells"))])
def test_a_checker_of_accessibility_finds_nothing(width, phases, dark, axe, tmp_path):
    view = view_scene(SCENES["grid"], [(phase, {}) for phase in phases], until=0.3)
    with Browser(width, dark=dark) as browser:
        browser.open(view.save(tmp_path / "page.html"))
        assert violations(browser, axe) == []
        browser.press("n", "ArrowRight")
        assert violations(browser, axe) == []
        browser.press("?")
        assert violations(browser, axe) == []
