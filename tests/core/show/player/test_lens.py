"""The proof lens: the item under the pointer is named, and a certificate has its root where it fails."""

import pytest

import kinetile as kt
from chromium import Browser, needs_chromium
from kinetile.show.player import view_scene
from player_pages import SCENES, ask_node, needs_node

PROOFS = """
const found = [];
for (let done = 0; done < play.runs[0].events.count; done += given.every) {
    if (done) play.jump(0, done - 1);
    const run = play.runs[0];
    for (const shape of run.structure.at(done)) {
        if (Number.isNaN(run.structure.epoch[shape])) continue;
        const { gap, fails } = proof.proofOf(run, shape, play.moment, held);
        const since = fails && clock.elapsed(fails, ...play.moment, held.unit);
        found.push(gap && [run.structure.roles[run.structure.role[shape]], since, gap(since), gap(since / 2),
            fails[0] === run.structure.epoch[shape] && fails[1] === run.structure.tick[shape]]);
    }
}
return found;
"""


@needs_node
@pytest.mark.parametrize("phase", ["sweep-tiling", "sap-1d", "sap-2d"])
def test_the_gap_of_a_certificate_is_0_at_the_tick_at_which_it_fails(phase, tmp_path):
    page = view_scene(SCENES["grid"], [(phase, {})], until=0.6).page
    found = ask_node(tmp_path, page, PROOFS, every=7)
    assert len(found) > 100
    known = [each for each in found if each is not None]
    assert len(known) == len(found)  # each shows what it watches
    for role, since, at_root, before, is_tick in known:
        assert is_tick, role
        assert abs(at_root) < 1e-9, role
        assert before > 0 or since < 1e-9, role


PAIRS = """
const { events } = play.runs[0];
const found = [];
for (let event = 0; event < events.count; event += 1) {
    if (events.b[event] < 0) continue;
    if (event) play.jump(0, event - 1);
    const pair = [events.a[event], events.b[event]];
    const { gap, fails } = proof.proofOfPair(play.runs[0], pair, play.moment, held);
    const since = clock.elapsed(fails, ...play.moment, held.unit);
    found.push([gap(since), fails, [events.epoch[event], events.tick[event]]]);
}
return found;
"""


@needs_node
@pytest.mark.parametrize("name", ["grid", "masses", "come and go", "accelerated"])
def test_the_gap_of_a_pair_is_0_at_its_contact(name, tmp_path):
    page = view_scene(SCENES[name], [("naive", {})], until=1.5).page
    found = ask_node(tmp_path, page, PAIRS)
    assert found
    for at_root, fails, met in found:
        assert fails == met
        assert abs(at_root) < 1e-9


THROUGH = """
const [run] = play.runs;
return [...Array(run.events.count).keys()].map((event) => {
    play.jump(0, event);
    const { formula, gap, fails } = proof.proofOfPair(run, [1, 0], play.moment, held);
    const since = fails && clock.elapsed(fails, ...play.moment, held.unit);
    const own = run.passing.imageOf(event);
    const { apart } = run.motion.images(0, 1, play.moment).find(({ image }) => image === own);
    return [[run.events.epoch[event], run.events.tick[event]], [...run.passing.lasting.keys()].sort(), [...run.passing.at(run.done)], formula, fails && gap(since), Math.hypot(...apart)];
});
"""  # noqa: E501


@needs_node
@pytest.mark.parametrize("begin", [0.0, 0.9])
def test_the_page_forgot_all_images_of_a_pair_but_one_when_one_passing_ended(begin, tmp_path):
    """Radii .4 and .45 on a torus of period 1: up to four images of the one overlap with the other."""
    scene = kt.Scene(
        [(0.5, 0.5), (0.53, 0.9)],
        [(0.0, 0.0), (0.31, 0.1)],
        [0.4, 0.45],
        arena=(1, 1),
        periodic="xy",
        kind=["a", "b"],
        responses={("a", "b"): "pass"},
    )
    sim, lasting = kt.Simulation(scene, "naive"), {}
    for event in sim.steps(5.0):
        rows = sim.tables.passings[sim.tables.passings["a"] >= 0]
        images = sorted(f"0,1 {m},{n}" for m, n in zip(rows["m"].tolist(), rows["n"].tolist(), strict=True))
        lasting[event.epoch, event.tick] = images  # of several events of a tick, after the last
    found = ask_node(tmp_path, view_scene(scene, [("naive", {})], begin=begin, until=5.0).page, THROUGH)
    seen = {tuple(moment): rest for moment, *rest in found}
    assert [*seen] == [*lasting][-len(seen) :]
    for moment, (images, bodies, formula, at_root, apart) in seen.items():
        assert images == lasting[moment]
        assert bodies == ([0, 1] if images else [])
        assert ("passing through each other" in formula) == bool(images)
        assert (f"through {len(images)} images" in formula) == (len(images) > 1)
        assert at_root is None or abs(at_root) < 1e-9
        assert moment == (0, 0) or abs(apart - 0.85) < 1e-9  # what begins or ends touches through its image
    assert max(map(len, lasting.values())) == 4
    assert any(at_root is not None for *_, at_root, _ in seen.values())


@needs_node
def test_sides_beyond_a_period_have_their_names(tmp_path):
    torus = kt.make_scene("grid", bodies=9, density=0.4, seed=3, periodic="x")
    page = view_scene(torus, [("sap-1d", {})], until=0.5).page
    body = """
        const { events, structure } = play.runs[0];
        const said = new sentences.Sentences({ rows: runs[0].rows, structure }, events, bodies, held);
        return [...Array(events.count).keys()].map((event) => said.of(event));
    """
    passes = [each for each in ask_node(tmp_path, page, body) if " passes " in each]
    assert len(passes) > 20
    for each in passes:
        one, other = each.split(":")[0].split(" (")[0].split(" passes ")
        assert {one[:5], other[:5]} <= {"L of ", "R of "}, each
        assert (one[0] == other[0]) == ("(pass)" in each), each


MIDDLE = """(() => {
    const player = kinetilePlayer;
    const { structure, done } = player.playback.runs[0];
    const places = player.placesOf(player.playback.runs[0]);
    const bare = structure.at(done).flatMap((shape) => {
        if (structure.roles[structure.role[shape]] !== ROLE) return [];
        const points = structure.points(shape, places);
        const mean = (axis) => points.reduce((sum, each) => sum + each[axis], 0) / points.length;
        const seen = player.camera.see(mean(0), mean(1));
        return player.bodyAt(player.panes[0], seen) === null ? [seen] : [];
    });
    const box = player.panes[0].getBoundingClientRect();
    if (!bare.length) return null;
    return [box.left + box.width / 2 + bare[0][0], box.top + box.height / 2 - bare[0][1]];
})()"""


def text(browser, name):
    return browser.value(f"document.getElementById('{name}').textContent")


@pytest.fixture(scope="module", params=[(1280, 900), (390, 844)], ids=["desk", "phone"])
def browser(request):
    with Browser(*request.param) as opened:
        yield opened


@needs_chromium
@pytest.mark.parametrize(
    ("phase", "role"), [("sweep-tiling", "tile"), ("sap-1d", "bound"), ("sweep-tiling", "pair")]
)
def test_a_tap_shows_the_certificate_and_hovering_names_it(browser, phase, role, tmp_path):
    browser.open(view_scene(SCENES["grid"], [(phase, {})], until=0.6).save(tmp_path / "page.html"))
    browser.press(*["ArrowRight"] * 3)
    browser.settle()
    place = browser.value(MIDDLE.replace("ROLE", f'"{role}"'))
    assert place is not None
    browser.click(*place)
    title = browser.value("kinetilePlayer.panes[0].title")
    assert title.startswith(role)
    assert text(browser, "proof-name") == f"Certificate: {title.split(':')[0]}"
    assert browser.value("document.getElementById('proof').checkVisibility()")
    assert text(browser, "formula") in title
    if role != "pair":
        assert "fails at" in title or "nothing is scheduled" in title
    assert browser.value("document.documentElement.scrollWidth <= innerWidth")
    assert browser.said() == []


@needs_chromium
def test_a_selected_disc_shows_what_fails_first(browser, tmp_path):
    browser.open(view_scene(SCENES["grid"], [("sweep-tiling", {})], until=0.6).save(tmp_path / "page.html"))
    browser.press("n", "ArrowRight")
    browser.settle()
    assert "fails at" in text(browser, "formula")
    assert browser.value("document.getElementById('lens').checkVisibility()")
    browser.press("Escape")
    browser.settle()
    assert not browser.value("document.getElementById('proof').checkVisibility()")


@needs_chromium
def test_the_legend_switches_layers(browser, tmp_path):
    browser.open(view_scene(SCENES["grid"], [("sweep-tiling", {})], until=0.6).save(tmp_path / "page.html"))
    before = browser.value("kinetilePlayer.panes[0].toDataURL()")
    browser.value("document.querySelector('#legend-structure button').click()")
    browser.settle()
    assert browser.value("kinetilePlayer.hidden.size") == 1
    assert (
        browser.value("document.querySelector('#legend-structure button').getAttribute('aria-pressed')")
        == "false"
    )
    assert browser.value("kinetilePlayer.panes[0].toDataURL()") != before
    browser.value("document.querySelector('#legend-structure button').click()")
    browser.settle()
    assert browser.value("kinetilePlayer.panes[0].toDataURL()") == before


@needs_chromium
def test_kinds_have_colours_and_passings_show(browser, tmp_path):
    browser.open(view_scene(SCENES["sensors"], [("cells", {})], until=1.5).save(tmp_path / "page.html"))
    legend = text(browser, "legend")
    assert "kind ball" in legend
    assert "ball and sensor: pass" in legend
    browser.press("6", "ArrowRight")
    browser.settle()
    assert sorted(
        browser.value("[...kinetilePlayer.playback.runs[0].passing.at(kinetilePlayer.playback.runs[0].done)]")
    ) == [1, 2]
    assert browser.said() == []


BESIDE = """(() => {
    const { lens, camera, panes, playback: { runs: [{ structure }] } } = kinetilePlayer;
    const [right, up] = camera.see(4.0, 0.5);
    return [-40, -3, 0, 1, 40].map((pixels) => {
        const shape = lens.shapeAt(0, [right + pixels, up]);
        return shape === null ? null : [structure.labels[structure.label[shape]], ...structure.plain(shape).coordinates[2]];
    });
})()"""  # noqa: E501


@needs_chromium
def test_what_fails_next_is_found_before_a_line_that_is_nearer(browser, tmp_path):
    """R of body 0 fails next, a few pixels left of L of body 1: that line hid it from the pointer."""
    scene = kt.Scene(
        [(3.0, 2.0), (5.0, 2.0), (9.0, 3.0)],
        [(0.01, 0.0), (0.0, 0.0), (0.0, 0.0)],
        [0.97, 1.0, 0.5],
        arena=(10, 4),
    )
    browser.open(view_scene(scene, [("sap-1d", {})], until=5.0).save(tmp_path / "page.html"))
    scale = browser.value("kinetilePlayer.camera.scale")
    assert 1.0 < 0.03 * scale < 4.0  # pixels
    far, *near, beyond = browser.value(BESIDE)
    assert far is None
    assert [each[:2] for each in near] == [["R", 0]] * 3
    assert beyond is None
