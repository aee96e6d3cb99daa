"""Try it: a reader's throws, insertions and turns, or a time-stepped engine, in a real browser."""

import json

import numpy as np
import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import view_scene
from player_pages import PLACES_OF, SCENES

pytestmark = needs_chromium

UNTIL = 0.4
SAID = "document.getElementById('said').textContent"

CONTACTS = """(() => {
    const { events } = kinetilePlayer.playback.runs[0];
    const those = [...events.kind.keys()].filter((event) => [1, 2].includes(events.kind[event]));
    const names = ["epoch", "tick", "a", "b"];
    return JSON.stringify(those.map((event) => names.map((name) => events[name][event])));
})()"""

PLACE = """(() => {
    const player = kinetilePlayer;
    const { left, top, width, height } = player.panes[0].getBoundingClientRect();
    const [x, y] = player.playback.runs[0].motion.place(BODY, player.playback.moment);
    const [right, up] = player.camera.see(x, y);
    return [left + width / 2 + right, top + height / 2 - up];
})()"""

COMPUTED = """new Promise((done) => {
    const look = () => {
        const { run } = kinetilePlayer.trial;
        const end = kinetilePlayer.held.end;
        const isDone = run && run.now === (BigInt(end[0]) << 52n) + BigInt(end[1]);
        if (isDone) requestAnimationFrame(() => done(true));
        else requestAnimationFrame(look);
    };
    look();
})"""

COMMAND = """(() => {
    const { rows } = kinetilePlayer.trial.run;
    const row = rows.kind.findIndex((kind) => kind === 3 || kind === 4);
    return [rows.a[row], ...["x", "y", "vx", "vy"].map((name) => rows[name][2 * row])];
})()"""


def scene():
    return kt.make_scene("grid", bodies=12, density=0.2, seed=2)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    view = view_scene(scene(), [("sweep-tiling", {})], until=UNTIL)
    return view.save(tmp_path_factory.mktemp("trial") / "page.html")


@pytest.fixture
def desk(page):
    with Browser(1280, 800) as browser:
        browser.open(page)
        browser.value("kinetilePlayer.goTo('0.125')")
        yield browser
        assert browser.said() == []


def drag(browser, start, by, *, finger=False):
    (x, y), (right, down) = start, by
    for part, kind in ((0, "Pressed"), (0.5, "Moved"), (1, "Moved"), (1, "Released")):
        at = {"x": x + part * right, "y": y + part * down}
        if finger:
            kind = {"Pressed": "Start", "Moved": "Move", "Released": "End"}[kind]
            points = [] if kind == "End" else [{**at, "id": 1}]
            browser.ask("Input.dispatchTouchEvent", type=f"touch{kind}", touchPoints=points)
        else:
            browser.ask("Input.dispatchMouseEvent", type=f"mouse{kind}", button="left", buttons=1, **at)
        browser.settle()


def contacts(browser):
    return json.loads(browser.value(CONTACTS))


def wanted(command):
    """Returns the contacts of kinetile's own run with a command at time 0.125."""
    sim = kt.Simulation(scene(), "cells")
    sim.run(until=0.125)
    command(sim)
    sim.run(until=UNTIL)
    return [[int(each[name]) for name in ("epoch", "tick", "a", "b")] for each in sim.contacts]


@pytest.mark.parametrize("finger", [False, True])
def test_a_thrown_disc_meets_what_it_meets_in_kinetile(finger, page):
    with Browser(*((390, 844) if finger else (1280, 800))) as browser:
        browser.open(page)
        browser.value("kinetilePlayer.goTo('0.125')")
        browser.value("scrollTo(0, 0)")
        recorded = contacts(browser)
        browser.press("y")
        drag(browser, browser.value(PLACE.replace("BODY", "5")), (30, 20), finger=finger)
        browser.value(COMPUTED)
        body, _, _, *velocity = browser.value(COMMAND)
        assert body == 5
        flown = browser.value(
            "kinetilePlayer.camera.scale * kinetilePlayer.speed"
        )  # pixels in a second of playing
        assert [flown * each for each in velocity] == pytest.approx([30, -20])
        assert contacts(browser) == wanted(lambda sim: sim.set_velocity(5, velocity)) != recorded
        assert "is the first that differs: " in browser.value(SAID)
        assert browser.value("document.documentElement.scrollWidth <= innerWidth")
        browser.press("o")
        assert (contacts(browser), browser.value(SAID)) == (recorded, "the run as recorded")
        assert browser.said() == []


def test_a_disc_is_thrown_in_where_there_is_room(desk):
    desk.press("y")
    left, top = desk.value(
        "(({ left, top, width, height }) => [left + width / 2, top + height / 2])"
        "(kinetilePlayer.panes[0].getBoundingClientRect())"
    )
    sim, radius = kt.Simulation(scene(), "cells"), float(scene().radius[0])
    sim.run(until=0.125)
    places = np.random.default_rng(1).uniform(1.2 * radius, 1.0 - 1.2 * radius, (500, 2)) * scene().arena
    x, y = next(each for each in places if np.hypot(*(sim.positions() - each).T).min() > 2.4 * radius)
    free = desk.value(f"kinetilePlayer.camera.see({x}, {y})")
    drag(desk, (left + free[0], top - free[1]), (25, -10))
    desk.value(COMPUTED)
    body, x, y, *velocity = desk.value(COMMAND)
    assert body == 12
    assert contacts(desk) == wanted(lambda sim: sim.insert((x, y), velocity, radius=radius))
    desk.value("kinetilePlayer.goTo('0.4')")
    desk.value("kinetilePlayer.select(12)")
    desk.press("o")
    assert desk.value("kinetilePlayer.selected") is None
    desk.value("kinetilePlayer.goTo('0.125')")
    corner = desk.value("kinetilePlayer.camera.see(0, 0)")
    drag(desk, (left + corner[0] + 2, top - corner[1] - 2), (25, -10))
    assert desk.value(SAID) == "there is no room for a disc like 0"
    assert desk.value("kinetilePlayer.trial.recorded") is None


def test_a_body_is_turned_back(desk):
    desk.press("b")
    assert desk.value(SAID) == "select a body first"
    desk.press("n", "b")
    desk.value(COMPUTED)
    _, _, _, *velocity = desk.value(COMMAND)
    assert contacts(desk) == wanted(lambda sim: sim.set_velocity(0, velocity))
    assert desk.value("document.querySelector('#legend').textContent").count("commands") == 1


def test_a_second_finger_and_a_cancelled_one_throw_nothing(page):
    with Browser(390, 844) as phone:
        phone.open(page)
        phone.press("y")
        (x, y), more = phone.value(PLACE.replace("BODY", "5")), {"x": 300, "y": 300, "id": 2}
        first = [{"x": x, "y": y, "id": 1}]
        for kind, points in (
            ("Start", first),
            ("Start", [*first, more]),
            ("Move", [{"x": x + 40, "y": y, "id": 1}, more]),
            ("End", []),
            ("Start", first),
            ("Move", [{"x": x + 40, "y": y, "id": 1}]),
            ("Cancel", []),
        ):
            phone.ask("Input.dispatchTouchEvent", type=f"touch{kind}", touchPoints=points)
            phone.settle()
        assert phone.value("[kinetilePlayer.trial.recorded, kinetilePlayer.trial.pulled]") == [None, None]


def test_a_jam_is_computed_up_to_a_number_of_events(tmp_path, browser):
    jammed = kt.Scene(
        [[1.0, 0.5], [0.4, 0.5], [0.5, 1.5]],
        [[0.0, 0.0], [0.0, 0.0], [0.3, 0.1]],
        [0.2, 0.1, 0.1],
        [np.inf, 1.0, 1.0],
        arena=(2, 2),
    )
    path = view_scene(jammed, [("naive", {})], until=2.0).save(tmp_path / "page.html")
    browser.open(path)
    browser.value("kinetilePlayer.trial.fork((run) => run.turn(0, [-1, 0]))")
    browser.press("End")  # what is not computed yet is not shown
    assert browser.value("kinetilePlayer.time()") < 0.61
    while not browser.value("kinetilePlayer.trial.run.isCut"):
        browser.settle()
    browser.settle()
    assert browser.value(SAID).startswith("after 20000 events nothing more is computed here: ")
    browser.press("End")
    now = "(kinetilePlayer.playback.runs[0].motion, kinetilePlayer.playback.moment)"
    assert all(0.0 < x < 2.0 for place in browser.value(f"({PLACES_OF}){now}") for x in place)
    assert browser.said() == []


CHOOSE = """(() => {
    const engine = document.getElementById("engine");
    engine.value = "VALUE";
    engine.dispatchEvent(new Event("change"));
    return true;
})()"""


def test_engines_are_compared_with_the_recorded_run(desk):
    recorded = contacts(desk)
    desk.value(CHOOSE.replace("VALUE", "0"))
    desk.value(COMPUTED)
    assert desk.value(SAID) == f"the same {len(recorded)} contacts as recorded, to the last bit"
    assert contacts(desk) == recorded
    desk.value(CHOOSE.replace("VALUE", "1"))
    desk.value(COMPUTED)
    stepped = contacts(desk)
    first = next(at for at in range(len(stepped)) if stepped[at][2:] != recorded[at][2:])
    assert desk.value(SAID).startswith(f"contact {first + 1} is the first that differs: ")
    assert desk.value("kinetilePlayer.playback.moment") == stepped[first][:2]
    desk.press("o")
    assert desk.value("document.getElementById('engine').value") == "0"


@pytest.mark.parametrize(
    ("made", "window", "reason"),
    [
        (kt.make_scene("grid", bodies=61, density=0.2), {}, "the scene has 61 bodies, and the page computes"),
        (scene(), {"begin": 0.1}, "the page does not begin at the start of its scene"),
        (kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 0.1, arena=(1, 1)), {}, "the scene has 0 bodies"),
        (SCENES["slow"], {"until": 600.0}, "the page ends 600 units of the clock after the start"),
    ],
    ids=["many", "window", "nobody", "long"],
)
def test_it_is_offered_only_where_the_page_can_compute_the_run_and_says_why_not(
    made, window, reason, tmp_path
):
    window = {"until": 0.2, "steps": False} | window
    path = view_scene(made, [("naive", {})], **window).save(tmp_path / "page.html")
    with Browser() as browser:
        browser.open(path)
        browser.press("y", "n", "b", "o")
        found = browser.value("[document.getElementById('trial').hidden, kinetilePlayer.trial.recorded]")
        assert found == [True, None]
        shown = browser.value("document.getElementById('untried').innerText")
        assert shown.startswith(f"Try it is not offered here: {reason}")
        browser.press("y")
        assert browser.value("document.getElementById('said').textContent") == shown
        assert browser.said() == []
