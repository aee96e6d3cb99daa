"""What hands do to a page in a real browser: wheel, fingers, clicks, Space; and the page's words then."""

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import view_scene

pytestmark = needs_chromium

SAID = "document.getElementById('said').textContent"
PACE = "document.getElementById('pace').textContent"
SCALE = "kinetilePlayer.camera.scale"
CTRL = 2


@pytest.fixture(scope="module")
def browser():
    with Browser(1280, 500) as opened:
        yield opened


def middle(browser: Browser, selector: str) -> tuple[float, float]:
    x, y = browser.value(f"""(() => {{
        const box = document.querySelector({selector!r}).getBoundingClientRect();
        return [box.x + box.width / 2, box.y + box.height / 2];
    }})()""")
    return x, y


def mouse(browser: Browser, kind: str, selector: str, **more: object) -> None:
    x, y = middle(browser, selector)
    browser.ask("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, **more)
    browser.settle()


def click(browser: Browser, selector: str) -> None:
    browser.value(f"document.querySelector({selector!r}).scrollIntoView({{ block: 'nearest' }})")
    browser.click(*middle(browser, selector))


def turn_wheel(browser: Browser, modifiers: int = 0) -> tuple[bool, float]:
    """Turns the wheel a notch over the picture; whether the page has scrolled, and how far one has zoomed."""
    browser.value("scrollTo(0, 0)")
    before = browser.value(SCALE)
    mouse(browser, "Wheel", ".stage", deltaX=0, deltaY=100, modifiers=modifiers)
    for _ in range(20):
        browser.settle()
        if browser.value("scrollY > 0") or browser.value(SCALE) != before:
            break
    return browser.value("scrollY > 0"), browser.value(SCALE) / before


def fingers(browser: Browser, *tracks: list[tuple[float, float]], on: str = ".stage") -> None:
    """Puts fingers down, moves each along its track, and lifts them; places from the middle of an element."""
    x, y = middle(browser, on)
    for at in range(len(tracks[0])):
        points = [{"x": x + track[at][0], "y": y + track[at][1], "id": k} for k, track in enumerate(tracks)]
        kind = "touchMove" if at else "touchStart"
        browser.ask("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        browser.settle()
    browser.ask("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    browser.settle()


def test_the_wheel_scrolls_the_page_and_zooms_only_where_it_is_meant_to(browser, saved):
    browser.open(saved)
    assert turn_wheel(browser) == (True, 1.0)
    scrolled, zoomed = turn_wheel(browser, CTRL)
    assert (scrolled, zoomed) == (False, pytest.approx(0.5**0.5))
    browser.value("scrollTo(0, 0)")
    click(browser, ".stage")
    scrolled, zoomed = turn_wheel(browser)
    assert (scrolled, zoomed) == (False, pytest.approx(0.5**0.5))
    browser.press("Escape")
    assert turn_wheel(browser) == (True, 1.0)
    browser.value("scrollTo(0, 0)")
    click(browser, ".stage")
    mouse(browser, "Moved", "h1")  # the mouse has left: it scrolls again
    assert turn_wheel(browser) == (True, 1.0)


def test_a_finger_scrolls_the_page_and_two_zoom_and_move_the_view(saved):
    with Browser(390, 844) as phone:
        phone.ask("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        phone.open(saved)
        before, camera = phone.value(SCALE), phone.value("JSON.stringify(kinetilePlayer.camera)")
        fingers(phone, [(0, -8.0 * k) for k in range(20)])
        assert phone.value("scrollY") > 50
        assert phone.value("JSON.stringify(kinetilePlayer.camera)") == camera
        assert phone.value(SAID) == ""
        phone.value("scrollTo(0, 0)")
        phone.settle()
        x = phone.value("kinetilePlayer.camera.x")
        fingers(phone, [(-8.0 * k, 0) for k in range(10)])  # sideways it moves the view
        assert phone.value("kinetilePlayer.camera.x") > x
        phone.press("r")
        phone.settle()
        still = phone.value("scrollY")  # after the first finger it may go on for a pixel
        fingers(phone, *[[(0, way * (40.0 + 8 * k)) for k in range(9)] for way in (1, -1)])
        assert phone.value("scrollY") == still
        assert phone.value(SCALE) == pytest.approx(104 / 40 * before, rel=0.15)
        phone.press("r")
        phone.settle()
        y = phone.value("kinetilePlayer.camera.y")
        fingers(phone, *[[(way * 40.0, 8.0 * k) for k in range(9)] for way in (1, -1)])
        assert phone.value("scrollY") == still
        assert phone.value(SCALE) == pytest.approx(before, rel=0.01)
        assert phone.value("kinetilePlayer.camera.y") - y == pytest.approx(64 / before, rel=0.15)


def test_the_scene_fits_the_window_again_after_it_is_turned(saved):
    with Browser(390, 844) as phone:
        phone.open(saved)
        size = {"deviceScaleFactor": 1, "mobile": True}
        upright = phone.value(SCALE)
        phone.ask("Emulation.setDeviceMetricsOverride", width=320, height=844, **size)
        phone.settle()
        assert phone.value(SCALE) < 0.9 * upright
        phone.press("z")  # what one has chosen to see stays
        chosen = phone.value(SCALE)
        phone.ask("Emulation.setDeviceMetricsOverride", width=390, height=844, **size)
        phone.settle()
        assert phone.value(SCALE) == chosen
        phone.press("r")
        phone.settle()
        assert phone.value(SCALE) == upright


def test_a_swipe_from_the_timeline_scrolled_the_page_and_changed_the_moment(saved):
    with Browser(390, 700) as phone:
        phone.ask("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=1)
        phone.open(saved)
        phone.value("more.click(), axis.value = 'x', axis.dispatchEvent(new Event('change'))")
        for on in ("#timeline", "#spacetime"):
            phone.value("kinetilePlayer.goTo('0.25')")
            phone.value(f"document.querySelector('{on}').scrollIntoView({{ block: 'center' }})")
            phone.settle()
            here = phone.value("[scrollY, kinetilePlayer.playback.moment, said.textContent]")
            fingers(phone, [(5.0, -8.0 * k) for k in range(15)], on=on)
            scrolled, *after = phone.value("[scrollY, kinetilePlayer.playback.moment, said.textContent]")
            assert scrolled > here[0] + 50
            assert after == here[1:]
            fingers(phone, [(60.0, -30.0)], on=on)  # a tap
            assert phone.value("kinetilePlayer.playback.moment") != here[1]
        for _ in range(20):  # until the page stands still
            phone.settle()
        there = phone.value("scrollY")
        fingers(phone, [(-60.0 - 8.0 * k, 0.0) for k in range(8)], on="#timeline")
        assert phone.value("scrollY") == there
        assert phone.value("kinetilePlayer.playback.moment") < [0, 0.25 * 2**52]


def test_a_page_that_was_saved_as_complete_logged_an_error(browser, saved, tmp_path):
    browser.open(saved)
    browser.press("ArrowRight")
    browser.settle()
    copy = tmp_path / "saved as.html"
    copy.write_text(browser.value("document.documentElement.outerHTML"), encoding="utf-8")
    listed = browser.value("document.querySelectorAll('#contacts button').length")
    del browser.events[:]
    browser.open(copy)
    browser.settle()
    assert browser.said() == []
    browser.press("ArrowRight")
    browser.settle()
    assert browser.value("kinetilePlayer.playback.runs[0].done") == 1
    assert browser.value("document.querySelectorAll('#contacts button').length") == listed


def test_the_status_line_says_where_one_is(browser, saved):
    browser.open(saved)
    browser.press("ArrowRight")
    event = browser.value(SAID)
    assert "time" in event
    click(browser, "#timeline")
    browser.settle()
    assert browser.value(SAID).startswith("between events, time 0.2")
    browser.press("PageDown")
    assert browser.value(SAID).startswith("between events, time 0.2")
    browser.press("Home")
    assert browser.value(SAID) == "the beginning"
    browser.press("ArrowRight")
    assert browser.value(SAID) == event
    browser.press(*["ArrowUp"] * 9, " ")
    assert browser.value(SAID) == "playing"
    while browser.value("kinetilePlayer.playing"):
        browser.settle()
    assert browser.value(SAID) == "the end, time 0.5"


def test_speed_has_bounds(browser, saved):
    browser.open(saved)
    usual = browser.value("kinetilePlayer.held.speed")
    browser.press(*["ArrowUp"] * 60)
    browser.settle()
    assert browser.value("kinetilePlayer.speed") == 2**12 * usual
    assert browser.value(PACE) == "68 time units a second, the fastest"
    browser.press("ArrowDown")
    browser.settle()
    assert browser.value("kinetilePlayer.speed") == 2**11 * usual
    assert browser.value(PACE) == "34 time units a second"
    browser.press(*["ArrowDown"] * 60)
    browser.settle()
    assert browser.value("kinetilePlayer.speed") == 2**-40 * usual
    assert browser.value(PACE).endswith(" time units a second, the slowest")


def test_a_time_stays_as_it_was_typed(browser, saved):
    browser.open(saved)
    click(browser, "#more")
    browser.value("document.getElementById('goto').focus()")
    browser.press("0", ".", "2", "Enter")
    browser.settle()
    assert browser.value("document.getElementById('time').textContent") == "0.2"
    assert browser.value(SAID) == "between events, time 0.2"
    assert browser.value("kinetilePlayer.playback.moment") == [0, int(0.2 * 2**52)]
    browser.press("Tab", "ArrowRight")
    browser.settle()
    moment = browser.value("kinetilePlayer.playback.moment")
    exact = browser.value("document.getElementById('exact').textContent")
    assert exact == f"{moment[1] / 2**52}: 0 units and {moment[1]} ticks of 2^-52"
    short = browser.value("document.getElementById('time').textContent")
    assert (float(short), len(short) < 7) == (pytest.approx(moment[1] / 2**52, rel=1e-3), True)


def test_several_of_a_role_have_their_plural(browser, tmp_path):
    scene = kt.make_scene("grid", bodies=9, density=0.5, seed=3)
    browser.open(view_scene(scene, [("sap-1d", {})], until=0.1).save(tmp_path / "page.html"))
    names = browser.value("[...document.querySelectorAll('#readings th')].map((cell) => cell.textContent)")
    drawn = [name.removesuffix(" drawn") for name in names if name.endswith(" drawn")]
    assert drawn == ["axes", "bounds", "certificates"]


def test_the_help_opens_on_its_close_button(browser, saved):
    browser.open(saved)
    browser.press("?")
    assert browser.value("document.activeElement.textContent") == "Close"
    browser.press("Escape")


def test_without_javascript_the_page_does_not_say_that_it_decodes(saved):
    with Browser() as plain:
        plain.ask("Emulation.setScriptExecutionDisabled", value=True)
        plain.visit(saved)
        text = plain.value("document.body.innerText")
    assert "JavaScript, which is switched off" in text
    assert "Decoding" not in text
    assert "Faster" not in text


def test_space_plays_after_a_click_on_a_button(browser, saved):
    browser.open(saved)
    click(browser, "#more")
    click(browser, "button[data-key=ArrowUp]")
    speed = browser.value("kinetilePlayer.speed")
    browser.press(" ")
    assert browser.value("kinetilePlayer.playing") > 0
    assert browser.value("kinetilePlayer.speed") == speed
    browser.press(" ")
    browser.value("document.querySelector('button[data-key=ArrowUp]').focus()")  # as the tab key does
    browser.press(" ")
    assert browser.value("kinetilePlayer.playing") == 0
    assert browser.value("kinetilePlayer.speed") == 2 * speed
