"""Several phases on one page: what each has had to do so far, and that their contacts are the same."""

import json

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import view_scene
from lanes import BUILT_IN
from player_pages import FILES, SCENES

TOLD = """(() => {
    const rows = [...document.querySelectorAll("#race tr")].slice(1);
    const said = document.querySelector("#race p").textContent;
    return JSON.stringify([rows.map((row) => [...row.children].map((cell) => cell.textContent)), said]);
})()"""


def scene():
    return kt.make_scene("random", bodies=10, density=0.3, seed=4)


@needs_chromium
@pytest.mark.parametrize(
    ("width", "height", "made"),
    [(1280, 800, scene()), (390, 844, scene()), (390, 844, SCENES["accelerated"])],
)
def test_counts_are_those_of_runs_and_contacts_are_the_same(width, height, made, tmp_path):
    path = view_scene(made, [(name, {}) for name in BUILT_IN], until=0.3).save(tmp_path / "race.html")
    with Browser(width, height) as browser:
        browser.open(path)
        for until in (0.0, 0.1, 0.3):
            browser.value(f"kinetilePlayer.goTo('{until}')")
            browser.settle()
            rows, said = json.loads(browser.value(TOLD))
            sims = [kt.Simulation(made, name) for name in BUILT_IN]
            for sim in sims:
                sim.run(until=until)
            met = str(len(sims[0].contacts))
            assert [row[0] for row in rows] == [*BUILT_IN]
            assert [row[1] for row in rows] == [str(sim.readings.structural_events) for sim in sims]
            assert [row[3] for row in rows] == [met] * len(BUILT_IN)
            assert len({row[4] for row in rows}) == 1
            assert said.startswith(f"The same {met} contacts under all {len(BUILT_IN)} phases.")
            assert ("Latest:" in said) == (met != "0")
        assert browser.value("document.documentElement.scrollWidth") <= width
        assert browser.said() == []


@needs_chromium
def test_a_list_that_differs_is_reported(tmp_path, browser):
    path = view_scene(scene(), [("naive", {}), ("cells", {})], until=0.3).save(tmp_path / "race.html")
    forge = """(() => {
        const { playback: { runs: [, { events }] }, race } = kinetilePlayer;
        const at = events.b.findIndex((b) => b >= 0);
        events.tick[at] += 1;
        race.lists[1] = digests(events);
        kinetilePlayer.goTo("0.3");
    })()"""
    shown = "window.digests = digests;\nbegin();\n</script>"
    text = path.read_text(encoding="utf-8").replace("begin();\n</script>", shown)
    path.write_text(text, encoding="utf-8")
    browser.open(path)
    browser.value(forge)
    browser.settle()
    rows, said = json.loads(browser.value(TOLD))
    naive, cells = said.split(". Under ")[1:]
    assert said.startswith("Contact ")
    assert naive.startswith("naive: bod")
    assert cells.startswith("cells: bod")
    assert naive.removeprefix("naive") != cells.removeprefix("cells").rstrip(".")
    assert rows[0][4] != rows[1][4]


@needs_chromium
def test_events_of_one_tick_are_stepped_without_a_difference(tmp_path, browser):
    ties = kt.load_scene(FILES / "H14.toml")
    path = view_scene(ties, [("naive", {}), ("sap-1d", {})], until=2.0).save(tmp_path / "race.html")
    browser.open(path)
    sentences = set()
    for _ in range(12):
        browser.press("ArrowRight")
        browser.settle()
        sentences.add(json.loads(browser.value(TOLD))[1].split(".")[0].split(":")[0])
    assert any(each.startswith("Events of one tick") for each in sentences)
    assert not any("differs" in each for each in sentences)
    assert browser.said() == []
