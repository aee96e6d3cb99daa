"""What phases, responses, recipes and observables refuse: the rows of ``messages.toml``."""

import math

import numpy as np

import kinetile as kt
from messages import table

GRID = kt.make_scene("grid", bodies=4)
PLANE = GRID.replace(arena=None)
PASSING = GRID.replace(responses={("*", "*"): "pass"})
LOSSY = kt.Response("restitution", e=0.9, contact_time=1e-3)
WALLED = kt.Scene([[0.25, 0.5], [0.75, 0.5]], [[1.0, 0.0], [-1.0, 0.0]], 0.125, arena=(1.0, 1.0))
BOXES = kt.Scene(WALLED.position, WALLED.velocity, shape=kt.box(0.2, 0.1), arena=(1.0, 1.0))
TORUS = {
    "position": [(0.2, 0.5), (0.6, 0.5)],
    "velocity": np.zeros((2, 2)),
    "radius": 0.1,
    "arena": (1, 1),
    "periodic": "xy",
}
IMMOVABLE_ON_A_TORUS = kt.Scene(
    [(0, 0), (1.5, 0.5)], [(0, 0), (1, 0.7)], 0.2, [math.inf, 1], (3, 1), periodic="xy"
)


def capsules(*ends, mass=1.0) -> kt.Scene:
    places = [(2.0, 2.0), (6.0, 2.0)]
    return kt.Scene(places, np.zeros((2, 2)), mass=mass, shape=kt.capsule(*ends), arena=(8.0, 4.0))


def observed(scene, observable) -> None:
    """Observes a run of a scene."""
    kt.Simulation(scene, "naive").run(1.0, observe=[observable])


test_message = table(globals())
