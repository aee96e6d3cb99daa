"""``kinetile draw``: a picture in a file, and what it refuses."""

from __future__ import annotations

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.show.picture import take_picture
from kinetile.show.svg import as_svg

SCENE = "draw random -s bodies=6 -s seed=2"


def test_it_writes_the_picture_of_the_moment(tmp_path):
    out = tmp_path / "a.svg"
    kinetile(f"{SCENE} --at 0.3 --broad-phase sap-1d:axis=y --roles bound,axis --out", out, code=0)
    sim = kt.Simulation(kt.make_scene("random", bodies=6, seed=2), "sap-1d", options={"axis": "y"})
    sim.run(until=0.3)
    assert out.read_bytes() == as_svg(take_picture(sim, ["axis", "bound"]))


def test_without_a_time_it_is_the_start(tmp_path):
    out = tmp_path / "a.svg"
    kinetile(f"{SCENE} --out", out, code=0)
    assert "under cells at time 0<" in out.read_text(encoding="utf-8")


def test_overwrite_replaces_a_file(tmp_path):
    out = tmp_path / "there.svg"
    out.write_text("old", encoding="utf-8")
    kinetile(f"{SCENE} --overwrite --out", out, code=0)
    assert out.read_text(encoding="utf-8").startswith("<svg")


@pytest.mark.parametrize(("option", "lines"), [("", 512), ("--pairs", 1070), ("--no-pairs", 512)])
def test_the_command_says_that_pairs_are_left_out_and_how_to_draw_them(tmp_path, option, lines):
    out = tmp_path / "a.svg"
    result = kinetile(f"draw grid -s bodies=256 --broad-phase sweep-tiling {option} --out", out)
    assert ("--pairs draws them" in result.stderr) == (option == "")
    assert out.read_text(encoding="utf-8").count("<line") == lines
