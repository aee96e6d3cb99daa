"""Pressures of published tables, from runs of seconds to half a minute.

Tables: periodic boxes, Li et al., J. Chem. Phys. 157, 234111 (2022), by event chains; the fluid of infinite
size, Kolafa and Rottner, Mol. Phys. 104, 3435 (2006).
"""

import math

import pytest

import kinetile as kt
from kinetile.statistics import Estimate

pytestmark = [pytest.mark.slow, pytest.mark.compiled]

FLUID = {0.2: 1.411834, 0.3: 1.723373, 0.4: 2.151444, 0.5: 2.760124, 0.6: 3.663698} | {
    0.7: 5.082369,
    0.75: 6.113377,
    0.8: 7.476513,
}
"""P A / (N kT) at reduced densities N s^2 / A, s being the diameter."""


def compressibility(bodies: int, density: float, warm: float, time: float) -> Estimate:
    """Returns P A / (N kT) of discs of diameter 1 in a square periodic box."""
    scene = kt.make_scene("mixture", bodies=bodies, density=density, radii=(0.5,), periodic="xy")
    sim = kt.Simulation(scene, "cells", keep_contacts=False)
    sim.run(warm)
    sim.run(warm + time, observe=[name := f"pressure:every={time / 256}"])
    return sim.observed[name]["Z"]


@pytest.mark.parametrize(
    ("bodies", "density", "time", "wanted", "error"),
    [
        (72, 0.65, 25_000.0, 6.901074, 3e-3),
        pytest.param(72, 0.67, 150_000.0, 7.85637, 3e-3, marks=pytest.mark.long),
        (870, 0.67, 3_000.0, 7.986779, 5e-3),
    ],
)
def test_the_pressure_of_few_discs_is_that_of_the_table(bodies, density, time, wanted, error):
    ratio = compressibility(bodies, density, 300.0, time)
    reduced, own = (4.0 * density / math.pi * each for each in (ratio.mean, ratio.error))
    assert own < error
    assert abs(reduced - wanted) < 3.0 * own


@pytest.mark.parametrize(("reduced_density", "wanted"), FLUID.items())
def test_the_equation_of_state_of_the_fluid(reduced_density, wanted):
    density = reduced_density * math.pi / 4.0
    ratio = compressibility(4096, density, 20.0, 160.0 / reduced_density)
    assert ratio.error < 2e-3 * wanted
    assert abs(ratio.mean - wanted) < 3.0 * ratio.error
