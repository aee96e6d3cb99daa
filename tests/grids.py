"""Scenes and internal state that the tests of cells share."""

from typing import Any

import numpy as np

import kinetile as kt
from inside import engine_of


def state_of(sim: kt.Simulation) -> Any:
    sim.build()
    return engine_of(sim).state


def in_the_open(scene: kt.Scene, shift: tuple[float, float] = (0.0, 0.0)) -> kt.Scene:
    return kt.Scene(scene.position + np.array(shift), scene.velocity, scene.radius, scene.mass)


def few_wide_many_small(small: int, ratio: float, seed: int, arena: bool = True) -> kt.Scene:
    """Returns four wide discs around the unit square's middle, and small ones anywhere between them."""
    random = np.random.default_rng(seed)
    wide = 0.1
    place = [(0.2, 0.2), (0.8, 0.2), (0.2, 0.8), (0.8, 0.8)]
    radius = [wide] * 4
    while len(place) < 4 + small:
        r = wide / ratio
        at = random.uniform(r, 1.0 - r, 2)
        if (np.hypot(*(np.array(place) - at).T) > np.array(radius) + r).all():
            place.append(tuple(at))
            radius.append(r)
    angle = random.uniform(0.0, 2.0 * np.pi, len(place))
    velocity = np.column_stack([np.cos(angle), np.sin(angle)])
    return kt.Scene(place, velocity, radius, np.array(radius), arena=(1.0, 1.0) if arena else None)
