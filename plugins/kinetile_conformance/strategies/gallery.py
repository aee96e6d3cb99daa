"""The gallery: fixed scenes that every phase is shown, unshrunk; and the smallest one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from kinetile.errors import UnknownName
from kinetile.plugin.by_name import make_scene
from kinetile.scene import Scene

__all__ = ["gallery", "smallest"]

SCENES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("grid", {"bodies": 25, "density": 0.5}),
    ("grid", {"bodies": 25, "density": 0.01}),
    ("random", {"bodies": 20, "density": 0.2, "radius_ratio": 20.0, "mass_ratio": 100.0}),
    ("figure-10", {}),
    ("figure-11", {}),
    ("figure-16", {}),
    ("cradle", {}),
    ("break", {}),
    ("lattice", {"bodies": 16, "seed": 3}),
    ("lattice", {"bodies": 16, "kind": "non-dyadic", "turns": 20, "seed": 4}),
    ("lattice", {"bodies": 16, "jitter": 1e-12, "seed": 5}),
)


def gallery() -> Iterator[tuple[str, Scene]]:
    """Yield (title, scene); recipes that are not installed are left out."""
    yield "a row between two", row_between_two()
    for name, parameters in SCENES:
        title = ", ".join([name, *(f"{key}={value}" for key, value in parameters.items())])
        try:
            yield title, make_scene(name, **parameters)
        except UnknownName:
            continue


def row_between_two() -> Scene:
    """Return two large bodies, one over the other, and a row of small ones between them: behind each gap of
    the row the two see each other, so one may be named to the other many times."""
    small = 24
    place = np.concatenate([[[8.0, 8.0], [8.0, 25.5]], np.full((small, 2), 16.75)])
    place[2:, 0] = 2.25 + np.arange(small) / 2
    velocity = np.zeros((small + 2, 2))
    velocity[:2, 1] = -0.125, 0.125
    velocity[2:, 0] = np.arange(small) % 3 - 1.0
    return Scene(place, velocity, [8.0, 8.0] + [0.125] * small, arena=(16.0, 34.0))


def smallest() -> Scene:
    """Return one body in a box."""
    return Scene([[0.5, 0.5]], [[0.0, 0.0]], 0.25, arena=(1.0, 1.0))
