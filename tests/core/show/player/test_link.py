"""Links to a moment, and a moment as SVG, in a real browser. Skipped where there is no chromium."""

import time
from xml.etree import ElementTree

import pytest

import kinetile as kt
from chromium import needs_chromium
from kinetile.show.player import view_scene
from lanes import first
from player_pages import SCENES

pytestmark = needs_chromium

SAID = "document.getElementById('said').textContent"
STATE = "[...kinetilePlayer.playback.moment, kinetilePlayer.playback.runs[0].done, kinetilePlayer.selected]"
SVG = "{http://www.w3.org/2000/svg}"


def test_a_link_opens_the_moment_and_the_body(browser, saved):
    browser.open(saved)
    browser.press(*["ArrowRight"] * 7, "n", "n", "l")
    browser.settle()
    state = browser.value(STATE)
    link = browser.value("location.hash")
    assert link == f"#t={state[0]}:{state[1]}&body=1"
    assert "link" in browser.value(SAID)
    browser.open(saved, link)
    assert browser.value(STATE) == state
    browser.value(f"location.hash = '#t=0:{2**50}'")
    browser.settle()
    assert browser.value(STATE)[:2] == [0, 2**50]
    assert browser.value("kinetilePlayer.selected") is None
    assert browser.said() == []


def test_a_link_opens_with_try_it_on(browser, saved):
    browser.open(saved, "#try")
    assert browser.value("[kinetilePlayer.trial.on, ...kinetilePlayer.playback.moment]") == [True, 0, 0]
    assert browser.value(SAID).startswith("drag a disc to throw it")
    browser.value("location.hash = '#t=0:1'")
    browser.value("location.hash = '#try'")
    browser.settle()
    assert browser.value("kinetilePlayer.trial.on")
    assert browser.said() == []


def test_a_link_copied_while_time_runs_leads_nowhere(browser, saved):
    browser.open(saved)
    browser.press("ArrowDown", "ArrowDown", " ", "l")
    for _ in range(5):
        browser.settle()
    assert browser.value("[kinetilePlayer.playing > 0, kinetilePlayer.selected]") == [True, None]
    assert "link" in browser.value(SAID)


def test_an_event_of_another_moment_is_left_out(browser, saved):
    browser.open(saved, f"#t=0:{2**50}&event=2")
    assert browser.value(STATE)[:2] == [0, 2**50]


def test_a_link_between_two_events_of_one_tick(browser, tmp_path):
    apart = [(0.0, 0.0), (3.0, 0.0), (0.0, 9.0), (3.0, 9.0)]
    ties = kt.Scene(apart, [(1.0, 0.0), (-1.0, 0.0)] * 2, 0.5)
    path = view_scene(ties, [("naive", {})], until=2.0).save(tmp_path / "page.html")
    browser.open(path)
    browser.press("ArrowRight", "l")
    browser.settle()
    assert browser.value("location.hash") == "#t=1:0&event=1"
    browser.open(path, "#t=1:0&event=1")
    assert browser.value(STATE)[:3] == [1, 0, 1]
    browser.open(path, "#t=1:0")
    assert browser.value(STATE)[:3] == [1, 0, 2]


@pytest.mark.parametrize("link", first(2, ["#t=nonsense", "#t=7:0", "#t=0:-5", f"#t=0:{2**52}", "#body=3"]))
def test_a_link_to_no_moment_says_so(link, browser, saved):
    browser.open(saved, link)
    assert browser.value(SAID) == f"{link} is no moment of this page"
    assert browser.value(STATE) == [0, 0, 0, None]
    assert browser.said() == []


@pytest.mark.parametrize("name", first(1, ["cylinder", "grid"]))
def test_a_moment_is_saved_as_svg(name, browser, tmp_path):
    scene = SCENES["grid"] if name == "grid" else SCENES["grid"].replace(periodic="x")
    view = view_scene(scene, [("sweep-tiling", {}), ("sap-2d", {})], until=0.2)
    browser.ask("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    browser.open(view.save(tmp_path / "page.html"), f"#t=0:{2**49}&body=3")
    browser.press("v")
    target = tmp_path / f"moment-0-{2**49}.svg"
    for _ in range(100):
        if target.exists():
            break
        time.sleep(0.05)
    root = ElementTree.parse(target).getroot()
    assert "time 0.125" in root.findtext(f"{SVG}title", "")
    assert len(root.findall(f"{SVG}svg")) == 2
    words = [text.text for text in root.iter(f"{SVG}text")]
    assert "sap-2d" in words
    assert words.count("3") == 2  # the number of the body in each pane
    circles = sum(path.get("d", "").count("a") for path in root.iter(f"{SVG}path"))
    assert circles >= 2 * 2 * len(scene)
    drawing = target.read_text(encoding="utf-8")
    assert "NaN" not in drawing
    assert "undefined" not in drawing
    assert browser.said() == []
