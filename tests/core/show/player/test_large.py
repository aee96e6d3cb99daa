"""Large scenes: densities for lanes of many events, rectangles for small discs, structure that is hidden."""

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import view_scene
from lanes import first

pytestmark = [needs_chromium, pytest.mark.compiled]

HEIGHTS = """(() => {
    const { timeline } = kinetilePlayer;
    const [lane] = timeline.lanes.keys();
    const { width, height } = timeline.canvas;
    const pen = timeline.backdrop.picture.getContext("2d");
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

COMPARED = """(() => {
    const player = kinetilePlayer;
    const [canvas] = player.panes;
    const pen = canvas.getContext("2d");
    const own = pen.fillRect;
    player.structured = false;
    player.camera.scale = RADIUS / player.bodies.radius[0];
    let filled = 0;
    pen.fillRect = function (...box) { filled += 1; return own.apply(this, box); };
    const [exact, quick] = [true, false].map((isVector) => {
        pen.isVector = isVector;
        player.drawPane(canvas, 0);
        const { data } = pen.getImageData(0, 0, canvas.width, canvas.height);
        return data.map((value, at) => 255 + (value - 255) * data[at | 3] / 255); // on white
    });
    let [total, most, covered] = [0, 0, 0];
    exact.forEach((value, at) => {
        if (at % 4) return; // red is enough
        const apart = Math.abs(value - quick[at]);
        total += apart;
        covered += value < 255;
        most = Math.max(most, apart);
    });
    return [filled, total / covered, most];
})()"""


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    scene = kt.make_scene("grid", bodies=1024, density=0.5)
    view = view_scene(scene, [("sweep-tiling", {})], until=0.03, steps=False, pairs=True)
    return view.save(tmp_path_factory.mktemp("large") / "page.html"), len(view.page.recordings[0].rows)


@pytest.mark.parametrize(("width", "height"), [(1280, 800), pytest.param(390, 844, marks=pytest.mark.slow)])
def test_more_than_a_thousand_events_are_a_density(width, height, large):
    path, events = large
    assert events > 2000
    with Browser(width, height) as browser:
        browser.open(path)
        lane, heights = browser.value(HEIGHTS)
        assert lane == "contacts"
        assert heights > 3  # bars of several heights; marks would have one
        assert browser.value("document.documentElement.scrollWidth <= innerWidth")


def test_of_a_crowded_structure_only_what_is_around_a_selected_body_is_drawn(large, browser):
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
    corner = "[-0.3, -0.3].map((part) => part * kinetilePlayer.camera.scale)"
    found = f"kinetilePlayer.lens.shapeAt(0, {corner}) !== null"
    assert browser.value(found)
    whole = browser.value(counted)
    browser.value("kinetilePlayer.select(500)")
    assert not browser.value(found)  # what is not drawn is not found
    browser.settle()
    around = browser.value(counted)
    assert whole > 2000
    assert 4 < around < 100
    assert browser.value("kinetilePlayer.structureOf(kinetilePlayer.playback.runs[0]).at(0).length") > 6000
    assert browser.said() == []


@pytest.mark.parametrize("ratio", first(1, [1, 2]))
@pytest.mark.parametrize(("radius", "rectangles"), [(2.0, 1), (2.6, 1), (3.7, 2), (4.8, 2), (5.0, 0)])
def test_small_discs_that_are_filled_by_rectangles_look_as_those_of_a_path(radius, rectangles, ratio, large):
    with Browser() as browser:
        size = {"width": 1280, "height": 800, "deviceScaleFactor": ratio, "mobile": False}
        browser.ask("Emulation.setDeviceMetricsOverride", **size)
        browser.open(large[0])
        filled, apart, most = browser.value(COMPARED.replace("RADIUS", str(radius)))
        assert filled == 1024 * rectangles
        assert apart < 3  # of 255
        assert most < 32


def test_a_crowd_is_saved_as_whole_circles(large, browser):
    browser.open(large[0])
    browser.press("t")
    browser.value("void (kinetilePlayer.camera.scale = 3 / kinetilePlayer.bodies.radius[0])")
    browser.value("void (URL.createObjectURL = (blob) => { globalThis.saved = blob; return '#'; })")
    browser.press("v")
    text = browser.value("saved.text()")
    assert text.count("a3 3 0 1 1 -6 0") == 2048  # their areas, and their edges
    assert text.count("<path") < 10


def test_a_hidden_structure_is_not_computed_while_time_runs(large, browser):
    browser.open(large[0])
    browser.value("""(() => {
        const { present } = kinetilePlayer.playback.runs[0];
        const own = present.draw;
        globalThis.computed = 0;
        present.draw = (...scene) => { computed += 1; own(...scene); };
    })()""")
    readings = "document.getElementById('readings').textContent"
    browser.press("t", "e", " ")
    browser.value("globalThis.computed = 0")
    browser.value("new Promise((done) => setTimeout(done, 400))")
    assert browser.value("[kinetilePlayer.playing > 0, computed]") == [True, 0]
    browser.press(" ")
    browser.settle()
    assert "tiles drawn3073" in browser.value(readings)
    browser.press(" ", "n")
    for _ in range(200):  # on a busy machine no time has passed yet, and what was computed still holds
        browser.settle()
        if browser.value("computed") > 1:
            break
    assert browser.value("computed") > 1  # the table of a selected body names its pairs
    assert browser.said() == []
