"""Instruments that read radii, with boxes: right for them, or refused in a sentence that says so."""

import json

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import Refused
from kinetile_accuracy import certify_log, oracle_contacts
from kinetile_accuracy.specification.certify import explain_difference
from kinetile_accuracy.stepped.engines import run_engine
from kinetile_accuracy.stepped.snapshots import run_snapshots
from kinetile_bench.user_scene import bench_scene


def bodies(**more) -> kt.Scene:
    return kt.Scene(
        [(1.5, 1.0), (5.0, 1.0), (4.0, 3.5), (1.0, 3.0)],
        [(0.5, 0.25), (-0.5, 0.25), (0.25, -0.75), (1.0, 0.5)],
        shape=[0, 0, 1, 2],
        shapes=[kt.box(2.0, 0.5), kt.box(0.5, 1.0), kt.disc(0.25)],
        arena=(8.0, 6.0),
        **more,
    )


def observed(scene: kt.Scene, until: float, *observe: str):
    sim = kt.Simulation(scene, "cells", keep_contacts=False)
    sim.run(until, observe=observe)
    return sim.observed


@pytest.mark.slow
@pytest.mark.compiled
def test_the_virial_of_boxes_is_the_pressure_on_the_walls():
    """In a square, where both are the mean of both axes: between boxes alone no energy goes from the one to
    the other. They differ by the sum of r . p at the ends of the run."""
    pressure = observed(bodies().replace(arena=(8.0, 8.0)), 20_000.0, "pressure")["pressure"]
    walls = [each.mean for name, each in pressure.items() if name.startswith("P_")]
    assert pressure["P"].mean == pytest.approx(sum(walls) / 4, rel=5e-4)
    assert pressure["Z"].mean > 1.0


def test_observables_of_shapes():
    found = observed(bodies(), 1.0, "rates", "temperature", "energy", "momentum", "msd", "vacf", "S")
    assert len(found) == 7


def test_the_oracle_and_engines_of_discs_refuse_boxes_and_the_certifier_follows_them():
    scene = bodies()
    sim = kt.Simulation(scene, "cells")
    sim.run(until=3.0)
    for ask in (
        lambda: oracle_contacts(scene, 1.0),
        lambda: run_snapshots(scene, 0.1, 1.0),
        lambda: run_engine("chipmunk", scene, 0.1, 1.0),
    ):
        with pytest.raises(Refused, match="bodies of other shapes"):
            ask()
    assert certify_log(scene, sim.contacts, 3.0).right
    said = explain_difference(scene, {"cells": sim.contacts, "none": sim.contacts[:0]}, 0)
    assert "cells is right there; none is wrong in contact 0" in said


def test_the_command_line_says_which_bodies_there_are(tmp_path):
    kt.save_scene(bodies(), tmp_path / "boxes.toml")
    said = kinetile("run --until 4", tmp_path / "boxes.toml").stdout
    assert "4 bodies: box (3), disc (1), in 8 x 6" in said
    found = json.loads(kinetile("run --json --until 4", tmp_path / "boxes.toml").stdout)
    assert found["scene"]["shapes"] == {"box": 3, "disc": 1}
    said += kinetile("run --explain", tmp_path / "boxes.toml").stdout
    assert "4 bodies, flying straight" in said
    assert "discs" not in said


def test_a_bench_of_boxes_measures_the_phases_that_take_them():
    found = bench_scene(bodies(), ["cells", "sap-1d", "sweep-tiling"], 4.0, repeats=1)
    assert [row.contacts is None for row in found.rows] == [False, False, True]
    assert found.identical
