"""At first there are the picture, the timeline and how to play; the rest is behind a button."""

import html
import json

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.errors import BadOption
from kinetile.show.player import view_scene

pytestmark = needs_chromium

SEEN = """(() => {
    const page = document.querySelector("iframe").contentDocument;
    const ids = ["play", "more", "timeline", "goto", "readings", "group"];
    const seen = ids.map((id) => page.getElementById(id).checkVisibility());
    return JSON.stringify([...seen, page.querySelector("h1").checkVisibility()]);
})()"""


@pytest.mark.parametrize("width", [1280, 390])
def test_most_is_behind_a_button(width, tmp_path):
    scene = kt.make_scene("grid", bodies=9, density=0.3, seed=1)
    page = html.escape(str(view_scene(scene, [("cells", {})], until=0.1, at=0.05)))
    path = tmp_path / "around.html"
    path.write_text(f'<iframe srcdoc="{page}" style="width: 100%; height: 40rem"></iframe>', encoding="utf-8")
    with Browser(width, 800) as browser:
        browser.visit(path)
        ready = "document.querySelector('iframe').contentDocument.documentElement.dataset.ready"
        while not browser.value(f"{ready} ?? ''"):
            browser.settle()
        assert json.loads(browser.value(SEEN)) == [True, True, True, False, False, False, False]
        inside = "document.querySelector('iframe').contentWindow"
        assert browser.value(f"{inside}.kinetilePlayer.time()") == pytest.approx(0.05, abs=1e-9)
        browser.value(f"{inside}.document.getElementById('more').click()")
        assert json.loads(browser.value(SEEN)) == [True] * 7
        assert (
            browser.value(f"{inside}.document.getElementById('more').getAttribute('aria-expanded')") == "true"
        )
        assert browser.said() == []


CONTROLS = """[...document.querySelectorAll("button, select, input, [tabindex]")]
    .filter((each) => each.checkVisibility())
    .map((each) => each.id || each.dataset.key || each.className || "event")"""


def test_on_a_page_of_its_own_the_first_event_comes_after_a_few_controls(browser, saved):
    browser.open(saved)
    few = ["stage", "timeline", "ArrowLeft", "play", "ArrowRight", "more", "event"]
    assert browser.value(CONTROLS)[: len(few)] == few
    browser.value("document.getElementById('more').click()")
    assert browser.value(CONTROLS).index("event") > 20


def test_a_page_opens_at_a_time_of_its_window():
    scene = kt.make_scene("grid", bodies=4, seed=1)
    with pytest.raises(BadOption, match=r"open at 0\.5; expected a time from 0\.0 to 0\.1"):
        view_scene(scene, until=0.1, at=0.5)
