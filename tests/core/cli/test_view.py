"""``kinetile view`` and ``kinetile draw``: scenes, event files, saved cases, pictures; and refusals."""

import json
import re
from pathlib import Path

import pytest

import kinetile as kt
from command_line import kinetile, refused
from kinetile.show.picture import take_picture
from kinetile.show.player import view, view_scene
from kinetile.show.svg import as_svg
from kinetile_conformance.cases import Subject, save_case

SCENE = "view grid -s bodies=9"


def held(path) -> dict:
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script type="application/json" id="recording">(.*?)</script>', text)[1])


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_two_phases_beside_each_other(tmp_path):
    phases = "--broad-phase sap-1d:axis=y --beside cells"
    result = kinetile(f"{SCENE} {phases} --until 0.3 --out page.html", code=0)
    assert re.fullmatch(r"page\.html: 0\.\d\d MB\n", result.stdout)
    found = held(tmp_path / "page.html")
    assert [run["label"] for run in found["runs"]] == ["sap-1d:axis=y", "cells"]
    assert found["runs"][0]["rows"] is not None
    assert found["runs"][1]["rows"] is None  # the same contacts are not written twice
    assert found["begin"] == [0, 0]


def test_a_view_without_a_scene_takes_parameters(tmp_path):
    for given, bodies in {"": 60, "-s bodies=9 ": 9}.items():
        kinetile(f"view {given}--until 0.01 --out page.html --overwrite", code=0)
        assert held(tmp_path / "page.html")["bodies"]["columns"][0] == ["radius", "f8", bodies]


def test_an_event_file_plays_as_it_was_recorded(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    kinetile("run grid -s bodies=9 --until 1 --events e.parquet", code=0)
    assert "structural events" in kinetile("view e.parquet").stderr
    rows = kt.read_events("e.parquet").rows
    found = held(tmp_path / "view.html")
    assert (found["begin"], found["end"]) == ([0, 0], [1, 0])
    assert found["runs"][0]["rows"]["columns"][0][2] == len(rows)
    assert "--broad-phase" in refused("view e.parquet --broad-phase naive --out c.html")
    assert "--from" in refused("view e.parquet --from 0.5 --out c.html")
    monkeypatch.setattr(view, "MOST_ROWS", 20)
    assert (
        f"Shown up to {rows['time'][19].item()!r}: 20 events"
        in kinetile("view e.parquet --out b.html").stderr
    )
    assert held(tmp_path / "b.html")["runs"][0]["rows"]["columns"][0][2] == 20


def test_overwrite_replaces_a_page(tmp_path):
    (tmp_path / "there.html").write_text("mine")
    kinetile(f"{SCENE} --until 0.1 --out there.html --overwrite", code=0)
    assert held(tmp_path / "there.html")["end"][0] == 0


@pytest.fixture
def scene(blind):
    scene = kt.Scene([[0.3, 0.5], [0.7, 0.5]], [[1.0, 0.0], [-1.0, 0.0]], 0.1, arena=(1.0, 1.0))
    save_case(scene, Path("case.toml"), "contact 0 is missing", Subject(blind, {}), "same-contacts")
    return scene


def test_a_saved_case_opens_where_the_phase_is_wrong(scene, tmp_path):
    result = kinetile("view case.toml --until 0.15", code=0)
    found = held(tmp_path / "view.html")
    assert [run["label"] for run in found["runs"]] == ["naive", "blind"]
    right = kt.Simulation(scene, "naive")
    right.run(0.15)
    assert found["open"] == [int(right.contacts[0]["epoch"]), int(right.contacts[0]["tick"])]
    assert found["select"] == 0
    said = f"They part at event 0: under naive it is body 0 with body 1 at time {right.contacts[0]['time']!r}"
    assert said.replace("np.float64(", "").replace(")", "") in result.stderr
    assert "under blind there is none" in result.stderr
    assert "The check that failed: same-contacts." in result.stderr


def test_a_case_under_a_phase_that_is_right(scene, tmp_path):
    result = kinetile("view case.toml --broad-phase sap-1d --until 0.15")
    assert "All 1 events are the same under naive and sap-1d." in result.stderr
    assert held(tmp_path / "view.html")["open"] is None
    assert "no --from" in refused("view case.toml --from 0.1 --out b.html")


def test_a_title_kept_a_raw_escape_and_a_kind_reversed_its_sentence():
    made = kt.make_scene("two-discs")
    scene = made.replace(
        kind=["one\u202e", "two\x1b"], responses={("one\u202e", "two\x1b"): kt.Response("pass")}
    )
    page = view_scene(scene, [("naive", {})], until=0.1, title="a\x1b[31m<b>").page
    assert r"<title>a\x1b[31m&lt;b&gt;</title>" in page.html()
    assert page.held["kinds"] == [r"one\u202e", r"two\x1b"]
    assert not re.search("[\x1b\u202e]", page.html())


DRAWN = "draw random -s bodies=6 -s seed=2"


def test_it_writes_the_picture_of_the_moment(tmp_path):
    out = tmp_path / "a.svg"
    kinetile(f"{DRAWN} --at 0.3 --broad-phase sap-1d:axis=y --roles bound,axis --out", out, code=0)
    sim = kt.Simulation(kt.make_scene("random", bodies=6, seed=2), "sap-1d", options={"axis": "y"})
    sim.run(until=0.3)
    assert out.read_bytes() == as_svg(take_picture(sim, ["axis", "bound"]))


def test_without_a_time_it_is_the_start(tmp_path):
    out = tmp_path / "a.svg"
    kinetile(f"{DRAWN} --out", out, code=0)
    assert "under cells at time 0<" in out.read_text(encoding="utf-8")


@pytest.mark.parametrize(("option", "lines"), [("", 512), ("--pairs", 1070), ("--no-pairs", 512)])
def test_the_command_says_that_pairs_are_left_out_and_how_to_draw_them(tmp_path, option, lines):
    out = tmp_path / "a.svg"
    result = kinetile(f"draw grid -s bodies=256 --broad-phase sweep-tiling {option} --out", out)
    assert ("--pairs draws them" in result.stderr) == (option == "")
    assert out.read_text(encoding="utf-8").count("<line") == lines
