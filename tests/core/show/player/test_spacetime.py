"""The page's picture of space and time: its bands are ``kinetile draw --space-time``'s."""

import json

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import view_scene
from kinetile.show.space_time import take_space_time

pytestmark = needs_chromium

CHOOSE = """(() => {
    const axis = document.getElementById("axis");
    axis.value = AXIS;
    axis.dispatchEvent(new Event("change"));
})()"""

PIECES = """(() => {
    const { spaceTime } = kinetilePlayer;
    const { pieces, met } = spaceTime.pieces(spaceTime.sheet());
    const row = ({ body, since, until, from, to }) => [body, since, until, from, to];
    return JSON.stringify([pieces.map(row), met]);
})()"""

SHOWN = """(() => {
    const canvas = document.getElementById("spacetime");
    if (canvas.hidden) return 0;
    const seen = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return seen.some((value, at) => at % 4 === 3 && value > 0) ? canvas.clientHeight : -1;
})()"""


def scene():
    commands = [kt.Remove(3, 0.3), kt.Insert(0.5, (0.1, 0.1), (0.5, 0.25), 0.01)]
    return kt.make_scene("random", bodies=8, density=0.15, seed=3).replace(commands=commands)


@pytest.mark.parametrize(("axis", "width", "height"), [("x", 1280, 800), ("y", 390, 844)])
def test_bands_are_those_of_the_run_and_a_click_goes_to_its_time(axis, width, height, tmp_path):
    expected = take_space_time(kt.Simulation(scene(), "cells"), 1.0, axis)
    path = view_scene(scene(), [("cells", {})], until=1.0).save(tmp_path / "view.html")
    with Browser(width, height) as browser:
        browser.open(path)
        assert browser.value(SHOWN) == 0
        browser.value(CHOOSE.replace("AXIS", json.dumps(axis)))
        browser.settle()
        assert browser.value(SHOWN) > 100
        pieces, met = json.loads(browser.value(PIECES))
        assert len(pieces) == len(expected.pieces) > 20
        for mine, right in zip(sorted(pieces), sorted(map(list, expected.pieces)), strict=True):
            assert mine == pytest.approx(right, rel=1e-12, abs=1e-12)
        assert len(met) == len(expected.marks) > 3
        for mine, right in zip(met, expected.marks, strict=True):
            assert mine == pytest.approx(list(right), rel=1e-12, abs=1e-12)
        browser.value(
            """(() => {
                const canvas = document.getElementById("spacetime");
                canvas.scrollIntoView({ block: "center" });
                const { top, height } = canvas.getBoundingClientRect();
                canvas.dispatchEvent(new PointerEvent("pointerdown", { clientY: top + height / 4 }));
            })()"""
        )
        assert browser.value("kinetilePlayer.time()") == pytest.approx(0.75, abs=0.01)
        browser.value(CHOOSE.replace("AXIS", '""'))
        browser.settle()
        assert browser.value(SHOWN) == 0
        assert browser.said() == []


def test_a_long_run_is_drawn_a_sheet_at_a_time(tmp_path, browser):
    gas = kt.make_scene("grid", bodies=64, density=0.3, seed=1)
    path = view_scene(gas, [("cells", {})], until=3.0, steps=False).save(tmp_path / "view.html")
    browser.open(path)
    browser.value(CHOOSE.replace("AXIS", '"x"'))
    rows = browser.value("kinetilePlayer.runs[0].rows.count")
    assert rows > 1500
    browser.value("kinetilePlayer.seekFraction(1)")
    browser.settle()
    sheet = json.loads(browser.value("JSON.stringify(kinetilePlayer.spaceTime.sheet())"))
    assert sheet["first"] == 1500 * ((rows - 1) // 1500)
    assert sheet["last"] == rows
    times = "[0, 0.5, 1].map((part) => kinetilePlayer.spaceTime.timeAt(part))"
    end, middle, begin = json.loads(browser.value(f"JSON.stringify({times})"))
    assert end == 1.0
    assert 0.0 < begin < middle < end
    assert browser.said() == []
