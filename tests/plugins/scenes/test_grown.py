"""Discs that grow to a density: sizes as given, other seeds other starts."""

import math

import numpy as np
import pytest

from kinetile import make_scene
from kinetile.errors import BadOption

pytestmark = [pytest.mark.slow, pytest.mark.compiled]
"""Growing is a run, with loops of its own; a small one is in ``test_same_bits.py``."""


@pytest.mark.parametrize(
    ("periodic", "density", "radii"),
    [("", 0.7, (0.5, 0.7)), ("x", 0.75, (0.5, 0.7)), ("xy", 0.8, (0.5,)), ("xy", 0.2, (0.5,))],
)
def test_discs_grow_to_their_radii_without_overlap(
    periodic: str, density: float, radii: tuple[float, ...]
) -> None:
    asked = {"bodies": 30, "density": density, "radii": radii, "temperature": 2.0, "mass": "area"}
    scene = make_scene("grown", periodic=periodic, **asked)
    width, height = scene.arena or (0.0, 0.0)
    assert scene.periodic == periodic
    assert sorted(set(scene.radius.tolist())) == list(radii)
    assert math.isclose(math.pi * np.sum(scene.radius**2), density * width * height)
    assert math.isclose(np.mean(scene.mass * np.sum(scene.velocity**2, axis=1)) / 2.0, 2.0)
    again = make_scene("grown", periodic=periodic, **asked)
    other = make_scene("grown", periodic=periodic, seed=2, **asked)
    assert again.position.tolist() == scene.position.tolist()
    assert other.position.tolist() != scene.position.tolist()


def test_what_no_growth_reaches_is_refused_with_the_density_that_was_reached() -> None:
    with pytest.raises(
        BadOption, match=r"density is 0\.95; after \d+ steps the discs held each other at 0\."
    ):
        make_scene("grown", bodies=8, density=0.95, radii=[0.5], periodic="xy")


def test_a_thousand_discs_of_two_sizes_reach_the_density_at_which_they_jam() -> None:
    assert len(make_scene("grown", bodies=1000, density=0.84, periodic="xy")) == 1000
