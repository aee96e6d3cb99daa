"""Mixtures, crystals and starts at a temperature: their promises, and their refusals."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from kinetile import Scene, load_scene, make_scene
from kinetile.scene.by_name import parse_parameters

STARTS: list[tuple[str, dict[str, Any]]] = [
    ("mixture", {}),
    ("mixture", {"bodies": 500, "density": 0.45, "radii": (0.5, 1.0, 5.0), "fractions": (70.0, 29.0, 1.0)}),
    ("mixture", {"bodies": 30, "density": 0.58, "mass": "area"}),  # too dense for random places
    ("mixture", {"radii": (1e-9,), "bodies": 2, "density": 0.1, "temperature": 1e9}),
    ("hexagonal", {"density": 0.906, "walls": False}),
    ("hexagonal", {"columns": 7, "rows": 1, "vacancies": 2, "density": 0.5}),
    ("square", {"density": 0.75, "vacancies": 4, "columns": 5, "rows": 40}),
    ("random", {"bodies": 1000, "mass_ratio": 1e6, "temperature": 3.0}),
]


def energies(scene: Scene) -> npt.NDArray[np.float64]:
    energy: npt.NDArray[np.float64] = scene.mass * np.sum(scene.velocity**2, axis=1) / 2.0
    return energy


@pytest.mark.parametrize(("name", "parameters"), STARTS)
def test_starts_have_density_and_temperature_and_no_momentum(name: str, parameters: dict[str, Any]) -> None:
    scene = make_scene(name, **parameters)
    asked = scene.origin["parameters"]
    if scene.arena is not None:
        width, height = scene.arena
        assert math.isclose(math.pi * np.sum(scene.radius**2), asked["density"] * width * height)
    assert math.isclose(energies(scene).mean(), asked["temperature"], rel_tol=1e-12)
    momentum = scene.mass[:, None] * scene.velocity
    assert np.abs(momentum.sum(axis=0)).max() < 1e-13 * np.abs(momentum).sum()
    assert make_scene(name, **asked) == scene
    other = make_scene(name, **{**asked, "seed": 2})
    assert (other.velocity != scene.velocity).all()


@pytest.mark.parametrize(
    ("parameters", "numbers"),
    [
        ({}, [50, 50]),
        ({"bodies": 101}, [51, 50]),
        ({"bodies": 10, "fractions": (0.75, 0.25)}, [8, 2]),  # 7.5 and 2.5: the first is rounded up
        ({"bodies": 10, "fractions": (0.74, 0.26)}, [7, 3]),
        ({"bodies": 12, "fractions": (3.0, 1.0)}, [9, 3]),
        ({"bodies": 12, "fractions": (1, 11)}, [1, 11]),
        ({"bodies": 7, "radii": (1.0, 1.1, 1.2), "fractions": (1.0, 1.0, 8.0)}, [1, 1, 5]),
        ({"bodies": 9, "radii": (1.0,)}, [9]),
    ],
)
def test_mixtures_have_exactly_these_numbers_of_exactly_these_radii(
    parameters: dict[str, Any], numbers: list[int]
) -> None:
    scene = make_scene("mixture", density=0.3, **parameters)
    radii = scene.origin["parameters"]["radii"]
    assert scene.radius.tolist() == [
        r for r, number in zip(radii, numbers, strict=True) for _ in range(number)
    ]


def test_several_numbers_are_written_as_lists_or_as_text(tmp_path: Any) -> None:
    asked = {"radii": (0.5, 1.0), "fractions": (3, 9), "bodies": 12, "density": 0.3}
    scene = make_scene("mixture", **asked)
    for texts in (["radii=.5, 1", "fractions=3,9"], ["radii=[0.5,1.0]", "fractions=(3, 9,)"]):
        assert parse_parameters("mixture", [*texts, "bodies=12", "density=0.3"]) == asked
    for radii in ("[0.5, 1]", '"0.5, 1"'):
        (tmp_path / "scene.toml").write_text(
            "recipe = 'mixture'\n"
            f"parameters = {{bodies = 12, density = 0.3, fractions = [3, 9], radii = {radii}}}"
        )
        assert load_scene(tmp_path / "scene.toml") == scene
    assert make_scene("mixture", radii=0.5) == make_scene("mixture", radii=[0.5])
    assert parse_parameters("mixture", ["fractions="]) == {"fractions": ()}
