"""Fixed scenes: the gallery for every phase, and few bodies of all kinds, for interpreted hooks with watched
memory: crowds and lone bodies, with and without walls, turns, sizes, places far from the origin."""

from collections.abc import Iterator

import numpy as np

from kinetile import Scene
from kinetile_conformance.strategies.changes import ended_at
from kinetile_conformance.strategies.shapes import shape_torus
from kinetile_conformance.strategies.swarms import swarm
from kinetile_conformance.strategies.torus import torus


def row_between_two() -> Scene:
    """Returns two large bodies, and a row of small ones between them, through which they see each other."""
    small = 24
    place = np.concatenate([[[8.0, 8.0], [8.0, 25.5]], np.full((small, 2), 16.75)])
    place[2:, 0] = 2.25 + np.arange(small) / 2
    velocity = np.zeros((small + 2, 2))
    velocity[:2, 1] = -0.125, 0.125
    velocity[2:, 0] = np.arange(small) % 3 - 1.0
    return Scene(place, velocity, [8.0, 8.0] + [0.125] * small, arena=(16.0, 34.0))


def smallest() -> Scene:
    """Returns one body in a box."""
    return Scene([[0.5, 0.5]], [[0.0, 0.0]], 0.25, arena=(1.0, 1.0))


def _gallery(count: int, seed: int) -> Iterator[Scene]:
    """Yields scenes with nothing, one body, or nothing that moves, and a row between two."""
    none = np.zeros((0, 2))
    yield Scene(none, none, np.zeros(0), arena=(1.0, 1.0))
    yield smallest()
    yield smallest().replace(velocity=[[1.0, 0.5]])
    yield Scene([[0.25, 0.5], [0.75, 0.5]], np.zeros((2, 2)), 0.25, arena=(1.0, 1.0))
    yield Scene([[0.5, 0.5], [1.5, 0.5]], [[1.0, 0.0], [1.0, 0.0]], 0.5, arena=(8.0, 1.0))
    yield row_between_two()


DRAWS = {"the gallery": _gallery}

SHORT = 0.5
"""The length of scenes with watched memory."""

_OF_KINDS = (
    *(("gas", 16, 3), ("lattice", 12, 0), ("cloud", 12, 1), ("far", 9, 7)),
    *(("burst", 20, 2), ("corridor", 20, 2), ("crowd", 24, 4)),
)


def small_ones() -> list[tuple[str, Scene]]:
    """Returns few bodies of all kinds, with titles: for interpreted hooks many would take too long."""
    shown = {
        "one body": smallest().replace(velocity=[[1.0, 0.5]]),
        **{f"{n} bodies of the kind {kind!r}": swarm(kind, n, variation=each) for kind, n, each in _OF_KINDS},
        "a swarm on a torus": torus(19),
        "a swarm of shapes on a torus": shape_torus(6),
    }
    return [(title, ended_at(scene, SHORT)) for title, scene in shown.items()]
