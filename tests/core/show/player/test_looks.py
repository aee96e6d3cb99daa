"""What a page looks like: it plays at once, the picture is near the top, and texts can be read."""

import time

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import view_scene

pytestmark = needs_chromium

LABELS = """(() => {
    const { bodies, camera, panes } = kinetilePlayer;
    const pen = panes[0].getContext("2d");
    const texts = [];
    const fill = pen.fillText.bind(pen);
    pen.fillText = (text, ...place) => {
        const across = 2 * bodies.radius[text] * camera.scale;
        texts.push([pen.measureText(text).width, across, parseFloat(pen.font)]);
        fill(text, ...place);
    };
    kinetilePlayer.drawPane(panes[0], 0);
    return texts;
})()"""

SMALL = """[...document.querySelectorAll("body *")]
    .filter((each) => each.checkVisibility())
    .filter((each) => [...each.childNodes].some((node) => node.nodeType === 3 && node.data.trim()))
    .map((each) => parseFloat(getComputedStyle(each).fontSize)).filter((size) => size < 12)"""

BOX = "document.querySelector('canvas.stage').getBoundingClientRect()"


@pytest.fixture(scope="module")
def default(tmp_path_factory):
    scene = kt.make_scene("grid", bodies=60)
    return view_scene(scene, [("cells", {})]).save(tmp_path_factory.mktemp("looks") / "page.html")


def test_numbers_are_in_their_discs_and_no_text_is_small(default):
    with Browser(1280, 900) as browser:
        browser.open(default)
        labels = browser.value(LABELS)
        assert len(labels) == 60
        assert all(2.2 * width <= across and size >= 12 for width, across, size in labels)
        assert browser.value(SMALL) == []


def test_on_a_phone_the_picture_is_within_the_first_480_pixels(default):
    with Browser(390, 844) as browser:
        browser.open(default)
        assert browser.value(f"{BOX}.top") < 160
        assert browser.value(f"{BOX}.bottom") <= 480
        assert browser.value(SMALL) == []


def test_a_page_plays_at_once_unless_motion_is_unwanted_or_it_opens_at_a_moment(default):
    for still, link, plays in ((False, "", True), (True, "", False), (False, "#t=0:1", False)):
        with Browser(still=still) as browser:
            browser.open(default, link)
            end = time.monotonic() + 20.0
            while plays and not browser.value("kinetilePlayer.time()") and time.monotonic() < end:
                browser.settle()
            assert (browser.value("kinetilePlayer.playing") > 0) is plays
