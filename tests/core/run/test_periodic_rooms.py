"""Commands and responses in scenes with periodic axes: the room of an inserted body, and refusals."""

import json
import math
from contextlib import chdir
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from command_line import printed
from kinetile.errors import Refused
from kinetile.run.saving.files import MAGIC

STILL = (0.0, 0.0)


def scene(periodic: str, *places: tuple[float, float], insert: tuple[float, float]) -> kt.Scene:
    """Discs of radius 1/4 in a box of 2 x 1, the first one flies; another one is inserted at time 1."""
    velocities = [(0.25, 0.0), *[STILL] * (len(places) - 1)]
    comes = kt.Insert(1.0, insert, STILL, 0.25)
    return kt.Scene(places, velocities, 0.25, arena=(2.0, 1.0), periodic=periodic, commands=[comes])


@pytest.mark.parametrize(
    ("periodic", "place", "who"),
    [
        ("x", (0.375, 0.5), "body 0"),  # which is at 2 by then: 0
        ("x", (-1.625, 0.5), "body 0"),
        ("x", (20.375, 0.5), "body 0"),
        ("xy", (0.25, 5.75), "body 0"),
        ("xy", (1.75, -0.25), "body 0"),
    ],
)
def test_an_inserted_body_has_no_room_where_an_image_is(
    periodic: str, place: tuple[float, float], who: str
) -> None:
    given = scene(periodic, (1.75, 0.5), insert=place)
    apart = math.hypot(math.remainder(2.0 - place[0], 2.0), math.remainder(0.5 - place[1], 1.0))
    said = f"it reaches {0.5 - apart:.6g} into {who};"
    sim = kt.Simulation(given, "naive")
    with pytest.raises(Refused, match=said):
        sim.run(until=2.0)
    assert sim.time == 1.0
    by_hand = kt.Simulation(given.replace(commands=()), "naive")
    by_hand.run(until=1.0)
    with pytest.raises(Refused, match=said):
        by_hand.insert(place, STILL, 0.25)


@pytest.mark.parametrize(
    ("periodic", "place"),
    [("x", (0.5, 0.5)), ("x", (2.5, 0.5)), ("x", (-1.5, 0.5)), ("xy", (3.0, 1.0)), ("xy", (5.0, -0.1))],
)
def test_it_has_room_beyond_the_box_and_where_images_touch(periodic: str, place: tuple[float, float]) -> None:
    sim = kt.Simulation(scene(periodic, (1.75, 0.5), insert=place), "naive")
    sim.run(until=1.0)
    assert sim.readings.inserted == 1
    assert sim.unwrapped()[1].tolist() == list(place)


def test_only_the_walls_of_walled_axes_count() -> None:
    given = scene("x", (1.75, 0.5), insert=(0.7, 0.75)).replace(commands=())
    sim = kt.Simulation(given, "naive")
    sim.run(until=1.0)
    assert sim.insert((-0.75, 0.75), STILL, 0.25) == 1
    with pytest.raises(Refused, match="it reaches beyond the bottom wall"):
        sim.insert((0.7, 0.2), STILL, 0.25)


def test_files_name_the_answer(tmp_path: Path) -> None:
    given = kt.Scene([(0.5, 0.5)], [(1.0, 0.25)], 0.25, arena=(2.0, 1.0), periodic="x")
    kt.save_scene(given, tmp_path / "scene.toml")
    files = "--events events.parquet --checkpoint run.save"
    with chdir(tmp_path):
        done = printed(f"run scene.toml --until 1 --broad-phase naive {files}")
        assert done["answer"] == given.answer == kt.ANSWER == 7
        assert kt.read_events("events.parquet").metadata["answer"] == 7
        head = json.loads(np.load("run.save")[MAGIC].tobytes())
        assert head["answer"] == 7


def test_a_body_in_the_slot_of_another_has_flown_over_no_border():
    room = {"arena": (1.0, 1.0), "periodic": "xy"}
    sim = kt.Simulation(kt.Scene([[0.5, 0.5]], [[2.0, -1.5]], 0.125, **room), "cells", live=True)
    sim.run(until=2.0)
    sim.set_velocity(0, (0.0, 0.0))
    sim.remove(0)
    sim.insert((0.25, 0.25), radius=0.125)
    assert sim.snapshot().state.contents.plans[["kx", "ky"]].tolist() == [(0, 0)]
