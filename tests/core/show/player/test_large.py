"""Large scenes: a lane of many events is a density, and a selected body has the structure around it alone."""

from __future__ import annotations

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import view_scene

pytestmark = needs_chromium

HEIGHTS = """(() => {
    const { timeline } = kinetilePlayer;
    const [lane] = timeline.lanes.keys();
    const { width, height } = timeline.canvas;
    const pen = timeline.picture.getContext("2d");
    const tall = Math.floor(height / timeline.lanes.length);
    const { data } = pen.getImageData(0, 0, width, tall);
    const heights = new Set();
    for (let x = Math.ceil(timeline.gutter); x < width; x += 1) {
        let filled = 0;
        for (let y = 0; y < tall; y += 1) filled += data[4 * (y * width + x) + 3] > 128 ? 1 : 0;
        heights.add(filled);
    }
    return [timeline.lanes[lane], [...heights].filter((each) => each > 0).length];
})()"""


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """The page of 1,024 discs, whose structure is computed, and its number of contacts."""
    scene = kt.make_scene("grid", bodies=1024, density=0.5)
    view = view_scene(scene, [("sweep-tiling", {})], until=0.03, steps=False)
    return view.save(tmp_path_factory.mktemp("large") / "page.html"), len(view.page.recordings[0].rows)


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_more_than_a_thousand_events_are_a_density(width, height, large):
    path, events = large
    assert events > 2000
    with Browser(width, height) as browser:
        browser.open(path)
        lane, heights = browser.value(HEIGHTS)
        assert lane == "contacts"
        assert heights > 3  # bars of several heights; marks would have one
        assert browser.value("document.documentElement.scrollWidth <= innerWidth")


def test_of_a_crowded_structure_only_what_is_around_a_selected_body_is_drawn(large):
    with Browser() as browser:
        browser.open(large[0])
        counted = """(() => {
            const pen = kinetilePlayer.panes[0].getContext("2d");
            const own = pen.lineTo;
            let lines = 0;
            pen.lineTo = function (...at) { lines += 1; return own.apply(this, at); };
            kinetilePlayer.drawPane(kinetilePlayer.panes[0], 0);
            delete pen.lineTo;
            return lines;
        })()"""
        whole = browser.value(counted)
        browser.value("kinetilePlayer.select(500)")
        browser.settle()
        around = browser.value(counted)
        assert whole > 2000
        assert 4 < around < 100
        assert (
            browser.value("kinetilePlayer.structureOf(kinetilePlayer.playback.runs[0]).at(0).length") > 6000
        )
        assert browser.said() == []
