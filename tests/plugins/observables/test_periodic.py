"""Pressure and rates in a periodic arena, compared with exact values and with a published table."""

from __future__ import annotations

import math

import pytest

import kinetile as kt

pytestmark = [pytest.mark.slow, pytest.mark.compiled]


@pytest.mark.parametrize(
    ("height", "radius", "rate"), [(1.0, 0.15, 0.836521), (1.5, 0.1, 0.291050), (1.0, 0.05, 0.206487)]
)
def test_two_discs_on_a_torus_meet_at_the_exact_rate(height, radius, rate):
    """2 s u/(W H - pi s^2), at the relative speed u = 1."""
    half = (0.5 * math.cos(0.7123), 0.5 * math.sin(0.7123))
    velocity = [half, (-half[0], -half[1])]
    scene = kt.Scene([(0.2, 0.2), (0.7, 0.6)], velocity, radius, arena=(1.0, height), periodic="xy")
    sim = kt.Simulation(scene, "naive", keep_contacts=False)
    sim.run(200_000.0, observe=["rates"])
    pairs = sim.observed["rates"]["pairs"]
    assert abs(pairs.mean - rate) < 3.0 * pairs.error
    assert pairs.error < 0.01 * rate
