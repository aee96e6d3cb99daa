"""The page is whole: one file that loads nothing, and its script runs, key by key."""

import json
import re
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import BadOption
from kinetile.show.player import recording, view_scene
from kinetile.show.player.page import MODULES, encode, script
from kinetile_conformance.cases import Subject, save_case
from kinetile_conformance.view import view_saved
from lanes import GENERAL
from player_pages import SCENES, UNTIL, ask_node, decode, needs_node
from programs import program

DOM = Path(__file__).parents[3] / "player_dom.mjs"


def run_page(path: Path) -> dict[str, object]:
    done = subprocess.run(
        [program("node"), str(DOM), str(path)], capture_output=True, text=True, timeout=600, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    found: dict[str, object] = json.loads(done.stdout)
    return found


def test_steps_are_reported_while_a_page_is_recorded():
    told = []
    scene = kt.make_scene("grid", bodies=4, seed=1)
    phases = [("naive", {}), ("cells", {})]
    view_scene(scene, phases, until=0.5, progress=lambda share, text: told.append((share, text)))
    assert {text.partition(":")[0] for _, text in told} == {"naive", "cells"}
    assert all(0.0 < share <= 1.0 for share, _ in told)


def test_columns_come_back_as_they_were():
    rng = np.random.default_rng(1)
    columns = {
        "f": np.array([0.0, -0.0, np.nan, np.inf, 5e-324, *rng.normal(size=100)]),
        "u": rng.integers(0, 2**63, 77).astype(np.uint64),
        "i": np.arange(-5, 5, dtype=np.int32),
        "b": np.arange(256).astype(np.uint8),
        "none": np.zeros(0),
    }
    again = decode(json.loads(json.dumps(encode(columns))))
    assert list(again) == list(columns)
    for name, column in columns.items():
        assert again[name].dtype == column.dtype
        assert again[name].tobytes() == column.tobytes()
    with pytest.raises(TypeError, match="column 'x' is int64"):
        encode({"x": np.zeros(3, np.int64)})


def test_the_page_loads_nothing():
    text = str(view_scene(SCENES["grid"], until=0.3)).replace("http://www.w3.org/2000/svg", "")  # a name only
    assert not re.findall(
        r"""\\b(?:src|href|action)\s*=|@import|url\((?!#)|fetch\(|XMLHttp|WebSocket|https?:""", text
    )
    assert "default-src 'none'" in text
    assert text.count("<script") == 2
    assert "@@" not in text


@pytest.mark.compiled
def test_pages_are_small():
    few = kt.make_scene("random", bodies=24, density=0.3, radius_ratio=4, seed=4)
    many = kt.make_scene("grid", bodies=1024, density=0.5)
    race = [(phase, {}) for phase in (*GENERAL, "sweep-tiling")]
    assert len(str(view_scene(few, race, until=0.3))) < 300_000
    assert len(str(view_scene(many, [("sweep-tiling", {})], until=0.2, steps=False))) < 1_500_000


def test_no_name_is_given_twice_in_the_script():
    names = re.findall(r"^(?:async )?(?:function|class|const|let) (\w+|\[.*?\])", script(), re.MULTILINE)
    assert len(names) > 60
    assert [name for name, count in Counter(names).items() if count > 1] == []
    assert not re.search(r"^(import|export)\b", script(), re.MULTILINE)


def test_every_module_comes_after_those_it_imports():
    from kinetile.show.player import page

    folder = Path(page.__file__).parent / "script"
    paths = [folder / f"{name}.mjs" for name in MODULES]
    assert {*folder.rglob("*.mjs")} == {*paths}
    for at, path in enumerate(paths):
        imports = re.findall(r'from "(.+)"', path.read_text())
        assert {(path.parent / name).resolve() for name in imports} <= {*paths[:at]}, path


@needs_node
def test_a_page_without_bodies_or_events(tmp_path):
    empty = kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 1.0)
    found = run_page(view_scene(empty, until=1.0).save(tmp_path / "page.html"))
    assert found["tapped"] is None


@pytest.mark.parametrize("name", SCENES)
def test_windows_with_few_rows_of_any_kind_are_together_the_run(name, monkeypatch):
    scene, naive = SCENES[name], [("naive", {})]
    until = scene.start + (0.3 if name == "grid" else UNTIL.get(name, 1.5))
    whole = view_scene(scene, naive, until=until, steps=False).page
    assert whole.all_notes == []
    monkeypatch.setattr(recording, "MOST_ROWS", 6)
    begin, rows, windows = scene.start, [], 0
    while begin is not None:
        page = view_scene(scene, naive, begin=begin, until=until, steps=False).page
        assert len(page.recordings[0].rows) <= 6
        rows += page.recordings[0].rows.tolist()
        begin, windows = following(page, begin, until, "6 events are as many as a page takes"), windows + 1
    assert str(rows) == str(whole.recordings[0].rows.tolist())
    assert windows >= len(rows) / 6


def following(page, begin, until, many):
    """The beginning of the window after a page, by its note, if it has one."""
    if not page.all_notes:
        assert page.title.endswith(f" to {until:.6g}")
        return None
    (note,) = page.all_notes
    found = re.fullmatch(rf".* up to (\S+)( of .*)?: {many}.* The next window: --from \1, .*", note)
    assert float(found[1]) > begin
    return float(found[1])


def test_windows_with_few_steps_have_together_all_structural_events(monkeypatch):
    scene, until = SCENES["grid"], 0.2
    whole = view_scene(scene, [("sap-1d", {})], until=until).page
    assert whole.all_notes == []
    stepped = whole.recordings[0].stepped
    events = {*zip(stepped.epoch.tolist(), stepped.tick.tolist(), stepped.body.tolist(), strict=True)}
    monkeypatch.setattr(recording, "MOST_STEPS", 40)
    begin, seen = scene.start, set()
    while begin is not None:
        page = view_scene(scene, [("sap-1d", {})], begin=begin, until=until).page
        (found,) = page.recordings
        stepped = found.stepped
        assert len(stepped.epoch) <= 40
        seen |= {*zip(stepped.epoch.tolist(), stepped.tick.tolist(), stepped.body.tolist(), strict=True)}
        begin = following(page, begin, until, "a page has those of 40 steps")
    assert {(epoch, tick) for epoch, tick, _ in events} == {(epoch, tick) for epoch, tick, _ in seen}


def test_what_happens_at_once_is_in_one_window_if_it_fits(monkeypatch):
    """Five of eight discs that met walls at once were shown, and the next window had none of the rest."""
    places = [[0.3, 0.3 + gap] for gap in range(8)]
    scene = kt.Scene([*places, [4.0, 4.0]], [*[[-1.0, 0.0]] * 8, [1.0, 0.0]], 0.25, arena=(4.5, 8.0))
    monkeypatch.setattr(recording, "MOST_ROWS", 8)
    walls = view_scene(scene, until=1.0, steps=False).page
    assert len(walls.recordings[0].rows) == 8
    monkeypatch.setattr(recording, "MOST_ROWS", 5)
    (note,) = view_scene(scene, until=1.0, steps=False).page.all_notes
    assert re.match(r"Shown up to 0\.0\d+ \(where more happens\) of 0\.0 to 1\.0: 5 events", note)


def test_a_window_of_some_contacts_and_a_time_that_is_far_away():
    scene = SCENES["grid"]
    page = view_scene(scene, until=1.0, steps=False, max_contacts=5).page
    (note,) = page.all_notes
    assert re.fullmatch(r"Shown up to 0\.\d+ of 0\.0 to 1\.0: 5 contacts are as many as were .*", note)
    with pytest.raises(BadOption, match="expected two times from the start on"):
        view_scene(scene, begin=2.0, until=1.0)


def test_plans_that_the_clock_anchors_again_counted_towards_no_limit(monkeypatch):
    """A page of two slow bodies took 2.5 GB in seven minutes, without a contact; and so did its beginning. A
    time that is further away was called a fault of the run."""
    monkeypatch.setattr(recording, "MOST_ROWS", 50)
    slow = kt.Scene([[0.3, 0.3], [0.7, 0.7]], [[1e-9, 0.0], [0.0, 1e-9]], 0.1, arena=(1.0, 1.0))
    for until in (1e6, 1e14):
        page = view_scene(slow, until=until, steps=False).page
        assert len(page.recordings[0].rows) == 50
        (note,) = page.all_notes
        assert note.startswith(f"Shown up to 25600.0 of 0.0 to {until!r}: 50 events are as many as a page")
    later = view_scene(slow, begin=25600.0, until=25600.0 + 2048.0, steps=False).page.recordings[0]
    assert 2 <= len(later.rows) <= 4
    sim = kt.Simulation(slow, "naive")
    sim.run(25600.0)
    assert later.plans.x.tolist() == sim.tables.bodies.x.tolist()


def test_a_simulation_shows_what_it_has_done_and_stays_as_it_is():
    scene = SCENES["come and go"]
    sim = kt.Simulation(scene, "sap-1d", live=True)
    sim.run(0.5)
    sim.set_velocity(1, (0.1, 0.7))
    sim.run(0.75)
    before = (sim.time, sim.fingerprint, sim.positions().tobytes(), sim.readings.events)
    view = kt.view(sim)
    assert (sim.time, sim.fingerprint, sim.positions().tobytes(), sim.readings.events) == before
    (found,) = view.page.recordings
    assert found.label == "sap-1d"
    rows = found.rows[found.rows["b"] >= -4]
    assert [tuple(row)[1:5] for row in rows.tolist()] == [tuple(row)[1:] for row in sim.contacts.tolist()]
    assert (-5 in found.rows["b"], -7 in found.rows["b"]) == (True, True)
    shown = view._repr_html_()
    assert shown.startswith(
        '<iframe title="2 discs under sap-1d, time 0 to 0.75" sandbox="allow-scripts allow-downloads" '
    )
    assert 'srcdoc="&lt;!DOCTYPE html&gt;' in shown
    assert "<script" not in shown
    assert kt.view(kt.Simulation(scene, "naive"), 0.25).page.recordings[0].end == 2**50


@needs_node
def test_a_saved_case_opens_at_the_moment_of_disagreement(blind, tmp_path):
    pair = kt.Scene([[0.3, 0.5], [0.7, 0.5]], [[1.0, 0.0], [-1.0, 0.0]], 0.1, arena=(1.0, 1.0))
    save_case(pair, tmp_path / "case.toml", "contact 0 is missing", Subject(blind, {}), "same-contacts")
    found = run_page(view_saved(tmp_path / "case.toml", until=0.3).save(tmp_path / "page.html"))
    right = kt.Simulation(pair, "naive")
    right.run(0.3)
    assert found["opened"] == [int(right.contacts[0][name]) for name in ("epoch", "tick")]
    assert ["now", "bodies 0 and 1 meet", "between events"] in found["readings"]


def test_the_first_view_is_around_the_shapes_and_not_around_their_circles():
    floor = kt.Scene(
        [(0.0, 0.0), (1.0, 1.0)],
        [(0.0, 0.0), (0.0, 0.0)],
        mass=[np.inf, 1.0],
        shape=[0, 1],
        shapes=[kt.segment((0.0, 0.0), (4.0, 0.0)), kt.box(1.0, 0.5)],
    )
    held = view_scene(floor, until=1.0, steps=False).page.held
    assert held["box"] == (-1.0, -0.3125, 5.0, 1.5625)  # a quarter more on each side of 4 by 1.25
    assert [shape["room"] for shape in held["shapes"]] == [0.0, 0.25]  # for numbers


@needs_node
@pytest.mark.parametrize(
    ("steps", "phase"), [(True, "sweep-tiling"), (False, "sweep-tiling"), (False, "cells")]
)
def test_pairs_of_many_bodies_are_recorded_and_computed_when_they_are_asked_for(steps, phase, tmp_path):
    count = """
        const { structure, present, motion } = play.runs[0];
        const places = { x: bodies.x, y: bodies.y };
        const drawn = structure ?? present.at(play.moment, 0, motion, places);
        return drawn ? drawn.partners(0, 100).length : 0;
    """
    scene = kt.make_scene("grid", bodies=441, seed=1)
    for pairs in (None, True, False):
        page = view_scene(scene, [(phase, {})], until=1e-4, steps=steps, pairs=pairs).page
        is_drawn = steps or phase == "sweep-tiling"
        said = any("--pairs (pairs=True) draws them" in note for note in page.all_notes)
        assert (ask_node(tmp_path, page, count) > 0) == (is_drawn and pairs is True)
        assert said == (is_drawn and pairs is None)
