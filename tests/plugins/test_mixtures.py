"""Mixtures of large and small bodies whose masses go with their sizes: in time all share the energy, and the
smallest are a thousand times faster than anything was at the start."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from agreement import assert_one_answer, choices
from kinetile.errors import BadOption


def mixture(bodies: int, ratio: float, power: int, density: float, seed: int) -> kt.Scene:
    """Radii up to ``ratio`` apart, masses as the radius to a power."""
    plain = kt.make_scene("random", bodies=bodies, density=density, radius_ratio=ratio, seed=seed)
    mass = (plain.radius / plain.radius.min()) ** power
    return kt.Scene(plain.position, plain.velocity, plain.radius, mass, plain.arena)


@pytest.fixture(scope="module", params=[2, pytest.param(3, marks=pytest.mark.slow)])
def ordinary(request) -> kt.Scene:
    """4,000 bodies, radii a thousand apart, masses as discs or as balls."""
    return mixture(4000, 1000.0, request.param, 0.25, 1)


def test_ordinary_mixtures_were_refused(ordinary):
    """The skin allowed for all bodies at once to be as fast as the lightest with all energy."""
    sim = kt.Simulation(ordinary, "sweep-tiling")
    assert sim.explain()["numbers"]["skin_in_radii"] < 1e-4


@pytest.mark.slow
@pytest.mark.compiled
def test_ordinary_mixtures_run_as_under_sap_2d(ordinary):
    ends = set()
    for phase in ("sap-2d", "cells", "sweep-tiling"):
        sim = kt.Simulation(ordinary, phase)
        sim.run(max_contacts=5000)
        sim.audit()
        ends.add((sim.fingerprint, sim.positions().tobytes()))
    assert len(ends) == 1


def press() -> kt.Scene:
    """Two heavy discs close in on a light one that lies between them, all in line, and a bystander."""
    position = [[0.25, 0.5], [0.5, 0.5 + 2.0**-12], [0.75, 0.5], [0.5, 0.875]]
    velocity = [[1.0, 0.0], [-0.5, 0.0], [-1.0, 0.0], [0.125, -0.25]]
    return kt.Scene(
        position, velocity, [0.125, 2.0**-9, 0.125, 2.0**-5], [1e6, 1.0, 1e6, 1e2], arena=(1.0, 1.0)
    )


@pytest.mark.compiled
def test_a_light_body_gets_fifty_times_faster_than_any_was():
    """All phases go on alike, audited, whatever the speeds."""
    scene = press()
    assert_one_answer(scene, max_contacts=300)
    fastest = 0.0
    for phase, options in choices(scene):
        sim = kt.Simulation(scene, phase, options=options, audit=5)
        for _ in range(120):
            sim.run(max_contacts=5)
            fastest = max(fastest, float(np.abs(sim.velocities()).max()))
    assert fastest > 50.0
    assert fastest <= kt.Simulation(scene).explain()["numbers"]["speed_bound"]


@pytest.mark.slow
@pytest.mark.compiled
@given(
    st.integers(2, 25),
    st.floats(0.0, 3.0),
    st.sampled_from([0, 2, 3]),
    st.sampled_from([0.05, 0.2]),
    st.integers(0, 10**6),
)
@settings(max_examples=60)
def test_mixtures_have_one_answer(bodies, ratio, power, density, seed):
    try:
        scene = mixture(bodies, 10.0**ratio, power, density, seed)
    except BadOption:  # no room for the largest
        return
    assert_one_answer(scene, until=20.0, max_contacts=300)
    kt.Simulation(scene, "sweep-tiling", audit=20).run(until=20.0, max_contacts=300)
