"""Mixtures of large and small bodies whose masses go with their sizes."""

import numpy as np
import pytest

import kinetile as kt
from agreement import assert_one_answer, choices
from lanes import first


@pytest.mark.parametrize("power", first(1, [2, 3]))
def test_ordinary_mixtures_were_refused(power):
    """The skin allowed for all bodies at once to be as fast as the lightest with all energy: masses as of
    discs or as of balls."""
    plain = kt.make_scene("random", bodies=4000, density=0.25, radius_ratio=1000.0, seed=1)
    sim = kt.Simulation(plain.replace(mass=(plain.radius / plain.radius.min()) ** power), "sweep-tiling")
    assert sim.explain()["numbers"]["skin_in_radii"] < 1e-4


@pytest.mark.compiled
def test_a_light_body_gets_fifty_times_faster_than_any_was():
    """Two heavy discs close in on a light one that lies between them, all in line, and a bystander."""
    position = [[0.25, 0.5], [0.5, 0.5 + 2.0**-12], [0.75, 0.5], [0.5, 0.875]]
    velocity = [[1.0, 0.0], [-0.5, 0.0], [-1.0, 0.0], [0.125, -0.25]]
    radius, mass = [0.125, 2.0**-9, 0.125, 2.0**-5], [1e6, 1.0, 1e6, 1e2]
    scene = kt.Scene(position, velocity, radius, mass, arena=(1.0, 1.0))
    assert_one_answer(scene, max_contacts=300)
    fastest = 0.0
    for phase, options in choices(scene)[4::2]:
        sim = kt.Simulation(scene, phase, options=options, audit=5)
        for _ in range(120):
            sim.run(max_contacts=5)
            fastest = max(fastest, float(np.abs(sim.velocities()).max()))
    assert fastest > 50.0
    assert fastest <= kt.Simulation(scene).explain()["numbers"]["speed_bound"]
