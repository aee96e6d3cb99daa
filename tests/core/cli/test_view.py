"""``kinetile view`` as people meet it: scenes, event files, saved cases; what it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import kinetile as kt
from command_line import kinetile, refused
from kinetile.scene.files import dumps_scene
from kinetile.show.player import view, view_scene
from kinetile_conformance.cases import Subject, save_case

SCENE = "view grid -s bodies=9"


def held(path) -> dict:
    """What a page holds."""
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script type="application/json" id="recording">(.*?)</script>', text)[1])


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_two_phases_beside_each_other(tmp_path):
    phases = "--broad-phase sap-1d:axis=y --beside cells"
    result = kinetile(f"{SCENE} {phases} --until 0.3 --out page.html")
    assert result.exit_code == 0, result.stderr
    assert re.fullmatch(r"page\.html: 0\.\d\d MB\n", result.stdout)
    found = held(tmp_path / "page.html")
    assert [run["label"] for run in found["runs"]] == ["sap-1d:axis=y", "cells"]
    assert found["runs"][0]["rows"] is not None
    assert found["runs"][1]["rows"] is None  # the same contacts are not written twice
    assert found["begin"] == [0, 0]


def test_an_event_file_plays_as_it_was_recorded(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    assert kinetile("run grid -s bodies=9 --until 1 --events e.parquet").exit_code == 0
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


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (f"{SCENE} --out there.html", "there.html is there already"),
        (f"{SCENE} --out page.txt", "ends in .html"),
        (f"{SCENE} --out nowhere/page.html", "there is no folder"),
        ("view no.toml", "there is no scene file 'no.toml'"),
        ("view no.parquet", "no.parquet cannot be read"),
        (f"{SCENE} --broad-phase naiv", "naive"),
        (f"{SCENE} --beside naive", "name the first with --broad-phase"),
        (f"{SCENE} --from 3 --until 1", "expected two times"),
    ],
)
def test_what_is_refused(line, said, tmp_path):
    (tmp_path / "there.html").write_text("mine")
    assert said in refused(line)
    assert [path.name for path in tmp_path.iterdir()] == ["there.html"]
    assert (tmp_path / "there.html").read_text() == "mine"


def test_overwrite_replaces_a_page(tmp_path):
    (tmp_path / "there.html").write_text("mine")
    assert kinetile(f"{SCENE} --until 0.1 --out there.html --overwrite").exit_code == 0
    assert held(tmp_path / "there.html")["end"][0] == 0


@pytest.mark.small
def test_a_saved_case_opens_where_the_phase_is_wrong(blind, tmp_path):
    scene = kt.Scene([[0.3, 0.5], [0.7, 0.5]], [[1.0, 0.0], [-1.0, 0.0]], 0.1, arena=(1.0, 1.0))
    save_case(scene, tmp_path / "case.toml", "contact 0 is missing", Subject(blind, {}), "same-contacts")
    result = kinetile("view case.toml --until 0.15")
    assert result.exit_code == 0, result.stderr
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


@pytest.mark.small
def test_a_case_under_a_phase_that_is_right(blind, tmp_path):
    scene = kt.Scene([[0.3, 0.5], [0.7, 0.5]], [[1.0, 0.0], [-1.0, 0.0]], 0.1, arena=(1.0, 1.0))
    save_case(scene, tmp_path / "case.toml", "contact 0 is missing", Subject(blind, {}), "same-contacts")
    result = kinetile("view case.toml --broad-phase sap-1d --until 0.15")
    assert "All 1 events are the same under naive and sap-1d." in result.stderr
    assert held(tmp_path / "view.html")["open"] is None
    assert "no --from" in refused("view case.toml --from 0.1 --out b.html")


def test_one_byte_that_is_not_utf_8_was_a_traceback():
    Path("s.toml").write_bytes(b"# \xff\n" + dumps_scene(kt.make_scene("two-discs")).encode())
    assert "bytes that are not UTF-8" in refused("view s.toml")


@pytest.mark.small
def test_a_title_kept_a_raw_escape_and_a_kind_reversed_its_sentence():
    made = kt.make_scene("two-discs")
    scene = made.replace(
        kind=["one\u202e", "two\x1b"], responses={("one\u202e", "two\x1b"): kt.Response("pass")}
    )
    page = view_scene(scene, [("naive", {})], until=0.1, title="a\x1b[31m<b>").page
    assert r"<title>a\x1b[31m&lt;b&gt;</title>" in page.html()
    assert page.held["kinds"] == [r"one\u202e", r"two\x1b"]
    assert not re.search("[\x1b\u202e]", page.html())
