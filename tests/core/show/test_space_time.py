"""Pictures of a run in space and time."""

from xml.etree import ElementTree

import numpy as np
import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import BadOption
from kinetile.show import space_time
from kinetile.show.space_time import Mark, Piece, space_time_svg, take_space_time

SVG = "{http://www.w3.org/2000/svg}"


def two_discs(**more):
    return kt.Scene([(1.5, 1.0), (4.5, 1.0)], [(1.0, 0.0), (-1.0, 0.0)], 0.5, arena=(6.0, 2.0), **more)


def test_bands_are_the_plans_of_a_run():
    run = take_space_time(kt.Simulation(two_discs(), "naive"), 2.5)
    assert run.marks == (Mark(1.0, 2.5, 3.5, 0.5),)
    assert sorted(run.pieces) == [
        Piece(0, 0.0, 1.0, 1.5, 2.5),
        Piece(0, 1.0, 2.5, 2.5, 1.0),
        Piece(1, 0.0, 1.0, 4.5, 3.5),
        Piece(1, 1.0, 2.5, 3.5, 5.0),
    ]
    assert (run.low, run.high, run.reaches) == (0.0, 6.0, ((0.5, 0.5), (0.5, 0.5)))
    up = take_space_time(kt.Simulation(two_discs(), "naive"), 2.5, "y")
    assert {piece.place for piece in up.pieces} == {1.0}


def test_a_body_that_falls_is_drawn_along_its_parabola():
    """From the wall that it meets on as well, and where a command gives another acceleration."""
    fall = kt.Scene([(1.0, 1.5)], [(0.0, 0.0)], 0.5, arena=(2.0, 2.0), gravity=(0.0, -2.0))
    fall = fall.replace(commands=[kt.Accelerate(0, 1.5, (0.0, 0.0))])
    pieces = take_space_time(kt.Simulation(fall, "naive"), 2.0, "y").pieces
    falls = [(k / 16, 1.5 - (k / 16) ** 2) for k in range(1, 17)]
    rises = [(1.0 + k / 32, 0.5 + k / 16 - (k / 32) ** 2) for k in range(1, 17)]
    ends = np.array([(piece.end, piece.last) for piece in pieces])
    assert ends == pytest.approx(np.array([*falls, *rises, (1.75, 1.5), (2.0, 1.25)]))
    assert len(take_space_time(kt.Simulation(fall, "naive"), 2.0, "x").pieces) == 4


def test_a_contact_is_marked_where_discs_touch():
    pair = kt.Scene([(1.0, 1.0), (4.0, 1.0)], [(1.0, 0.0), (0.0, 0.0)], [0.25, 0.75], arena=(6.0, 2.0))
    run = take_space_time(kt.Simulation(pair, "naive"), 2.5)
    assert run.marks == (Mark(2.0, 3.0, 4.0, 0.25),)


def test_bodies_come_and_go_within_their_times():
    commands = [kt.Remove(1, 0.5), kt.Insert(0.75, (5.0, 1.0), (0.25, 0.0), 0.25)]
    run = take_space_time(kt.Simulation(two_discs(commands=commands), "naive"), 1.0)
    assert Piece(1, 0.0, 0.5, 4.5, 4.0) in run.pieces
    assert Piece(2, 0.75, 1.0, 5.0, 5.0625) in run.pieces
    assert run.reaches[2] == (0.25, 0.25)


def test_a_contact_through_an_image_is_marked_where_it_is():
    scene = kt.Scene(
        [(0.6, 1.0), (5.6, 1.0)], [(-0.3, 0.0), (0.3, 0.0)], 0.25, arena=(6.0, 2.0), periodic="x"
    )
    drawn = space_time_svg(take_space_time(kt.Simulation(scene, "naive"), 2.0))
    root = ElementTree.fromstring(drawn)
    dots = [each for each in root.iter(f"{SVG}circle") if float(each.get("cy")) < 492.0]
    assert len(dots) == 1
    assert float(dots[0].get("cx")) == pytest.approx(
        12.0 + space_time.LEFT_MARGIN + 640.0 * 0.1 / 6.0, abs=0.1
    )
    texts = {each.text: each for each in root.iter(f"{SVG}text")}
    assert {"x", "time", *"0246", "0.5", "1.5"} <= {*texts}
    assert float(texts["4"].get("x")) == pytest.approx(
        12.0 + space_time.LEFT_MARGIN + 640.0 * 4.0 / 6.0, abs=0.1
    )
    assert float(texts["0.5"].get("y")) == pytest.approx(12.0 + 480.0 * 0.75, abs=0.1)


def test_the_command_draws_it(tmp_path):
    out = tmp_path / "run.svg"
    kinetile("draw cradle --space-time x --until 3 --out", out, code=0)
    root = ElementTree.fromstring(out.read_bytes())
    assert "x to the right, time upwards from 0 to 3" in root.find(f"{SVG}title").text


def test_a_picture_of_too_many_events_is_refused(monkeypatch):
    monkeypatch.setattr(space_time, "MOST_PIECES", 3)
    with pytest.raises(BadOption, match=r"too many events .* more than 3 events and plans .* up to time 3.0"):
        take_space_time(kt.Simulation(two_discs(), "naive"), 7.5)
