"""Chords of bodies that are accelerated: a shadow never jumps, and is never farther off than the margin."""

import math

import numpy as np
import pytest

import kinetile as kt
from kinetile.kernel.flight import plans_now
from kinetile.kernel.plan import Plan, positions_after
from kinetile.scene.bodies import nearest_image

pytestmark = pytest.mark.small


def crowd(seed: int) -> kt.Scene:
    """Bodies that meet before their chords end, and some whose acceleration changes or goes."""
    rng = np.random.default_rng(seed)
    places = 1.0 + 2.0 * np.column_stack(np.divmod(np.arange(9), 3)) + rng.uniform(-0.4, 0.4, (9, 2))
    speeds, own = rng.normal(size=(9, 2)), rng.normal(size=(9, 2))
    mass = np.where(np.arange(9) == 4, math.inf, 1.0)
    own[4] = speeds[4] = 0.0
    times = rng.uniform(0.0, 2.0, 6)
    changes = [
        kt.Accelerate(int(body), time, (0.0, 0.0) if body % 2 else (0.5, -1.0))
        for body, time in zip(rng.permutation([0, 1, 2, 3, 5, 6]), times, strict=True)
    ]
    more = {"acceleration": own, "commands": changes, "periodic": "", "mass": mass}
    if seed % 2:  # across a periodic axis, along which nothing is accelerated
        own[:, 0] = 0.0
        more["periodic"] = "x"
        more["commands"] = [each._replace(acceleration=(0.0, each.acceleration[1])) for each in changes]
    return kt.Scene(places, speeds, 0.5, arena=(6.0, 6.0), **more)


@pytest.mark.parametrize("seed", range(4))
def test_a_shadow_stays_within_the_margin_and_never_jumps(seed):
    scene, before, anchors, met = crowd(seed), None, np.zeros(9), 0
    sim = kt.Simulation(scene, "naive")
    for event in sim.steps(until=2.0):
        k = sim.tables
        plans, elapsed = plans_now(k._replace(bodies=k.shadows))
        here = positions_after(plans, elapsed)
        if before is not None:
            jump = positions_after(before, (k.clock[0].now - anchors) * float(k.clock[0].per_tick)) - here
            assert np.abs(nearest_image(jump, scene.periods)).max() < 1e-12
        off = positions_after(*plans_now(k)) - here
        assert np.hypot(*off.T).max() <= float(k.clock[0].limits.margin) * (1.0 + 1e-9)
        before, anchors = type(plans)(*map(np.array, plans)), np.array(k.shadows.anchor)
        met += event.kind != "structural"
    assert met > 10


def test_the_shadow_of_a_shape_that_is_inserted_is_as_wide_as_the_body():
    """All that a shadow has of its body besides the plan: a list that sorts sides missed contacts without."""
    shapes = [kt.box(1.0, 0.5), kt.polygon([(-0.5, -0.25), (0.5, -0.25), (0.0, 0.5)])]
    scene = kt.Scene(
        [[2.0, 2.0]], [[1.0, 0.0]], arena=(8.0, 8.0), shapes=shapes, shape=[0], gravity=(0.0, -1.0)
    )
    sim = kt.Simulation(scene, "sap-1d", live=True)
    sim.run(0.25)
    for at, shape in ((5.0, 1), (2.0, 0)):
        sim.insert((6.0, at), (0.0, 1.0), shape=shape)
    bodies, shadows = sim.tables.bodies[:3], sim.tables.shadows[:3]
    own = [name for name in shadows.dtype.names if name not in (*Plan._fields, "anchor")]
    assert {"left", "right", "down", "up", "form", "reach"} <= {*own}
    for name in own:
        assert shadows[name].tolist() == bodies[name].tolist(), name
