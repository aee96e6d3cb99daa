"""``kinetile draw``: a picture in a file, and what it refuses."""

from __future__ import annotations

import sys

import pytest

import kinetile as kt
from command_line import kinetile, refused
from kinetile.show.picture import take_picture
from kinetile.show.svg import as_svg

SCENE = "draw random -s bodies=6 -s seed=2"


def test_it_writes_the_picture_of_the_moment(tmp_path):
    out = tmp_path / "a.svg"
    result = kinetile(f"{SCENE} --at 0.3 --broad-phase sap-1d:axis=y --roles bound,axis --out", out)
    assert result.exit_code == 0, result.stderr
    sim = kt.Simulation(kt.make_scene("random", bodies=6, seed=2), "sap-1d", options={"axis": "y"})
    sim.run(until=0.3)
    assert out.read_bytes() == as_svg(take_picture(sim, ["axis", "bound"]))


def test_without_a_time_it_is_the_start(tmp_path):
    out = tmp_path / "a.svg"
    assert kinetile(f"{SCENE} --out", out).exit_code == 0
    assert "under cells at time 0<" in out.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--out picture.gif", "expected a name that ends in .svg, .png or .pdf"),
        ("--out there.svg", "is there already: choose another name, or say --overwrite"),
        ("--out nowhere/a.svg", "there is no folder"),
        ("--out a.svg --at -1", "expected a time from the scene's start on"),
        ("--out a.svg --roles tiles", "'tiles' is no role"),
        ("--out a.svg --broad-phase nought", "no broad phase"),
    ],
)
def test_what_cannot_be_drawn_is_refused(tmp_path, monkeypatch, line, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.svg").write_text("mine", encoding="utf-8")
    assert said in " ".join(refused(f"{SCENE} {line}").split())
    assert (tmp_path / "there.svg").read_text(encoding="utf-8") == "mine"
    assert {path.name for path in tmp_path.iterdir()} == {"there.svg"}


def test_overwrite_replaces_a_file(tmp_path):
    out = tmp_path / "there.svg"
    out.write_text("old", encoding="utf-8")
    assert kinetile(f"{SCENE} --overwrite --out", out).exit_code == 0
    assert out.read_text(encoding="utf-8").startswith("<svg")


def test_without_matplotlib_png_names_the_extra_before_anything_runs(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert "kinetile[figures]" in refused("draw no-such-scene --out", tmp_path / "a.png")


@pytest.mark.parametrize(("option", "lines"), [("", 512), ("--pairs", 1070), ("--no-pairs", 512)])
def test_the_command_says_that_pairs_are_left_out_and_how_to_draw_them(tmp_path, option, lines):
    out = tmp_path / "a.svg"
    result = kinetile(f"draw grid -s bodies=256 --broad-phase sweep-tiling {option} --out", out)
    assert ("--pairs draws them" in result.stderr) == (option == "")
    assert out.read_text(encoding="utf-8").count("<line") == lines
