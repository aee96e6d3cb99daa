"""Mixtures, crystals and starts at a temperature: what they promise, and what they refuse."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from kinetile import Scene, load_scene, make_scene
from kinetile.scene.by_name import parse_parameters
from kinetile_plugins.scenes.numerics import draws, maxwell

STARTS: list[tuple[str, dict[str, Any]]] = [
    ("mixture", {}),
    ("mixture", {"bodies": 500, "density": 0.45, "radii": (0.5, 1.0, 5.0), "fractions": (70.0, 29.0, 1.0)}),
    ("mixture", {"density": 0.58, "mass": "area"}),  # too dense for random places
    ("mixture", {"radii": (0.5, 2.0), "masses": (1.0, 100.0), "density": 0.3, "temperature": 1e-3}),
    ("mixture", {"radii": (1e-9,), "bodies": 2, "density": 0.1, "temperature": 1e9}),
    ("hexagonal", {"temperature": 2.5}),
    ("hexagonal", {"density": 0.85, "columns": 12, "rows": 9, "radius": 3.0}),
    ("hexagonal", {"density": 0.906, "walls": False}),
    ("hexagonal", {"columns": 7, "rows": 1, "vacancies": 2, "density": 0.5}),
    ("square", {}),
    ("square", {"density": 0.75, "vacancies": 4, "columns": 5, "rows": 40}),
    ("square", {"density": 0.785398, "walls": False}),
    ("grid", {"bodies": 1000, "temperature": 0.5}),
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


def test_velocities_are_those_of_maxwell_for_light_and_heavy_alike() -> None:
    mass = np.repeat([1.0, 4.0, 2.0**90], 20_000)
    (random,) = draws(7, 1)
    velocity = maxwell(2.0, mass, random)
    for kind in (1.0, 4.0, 2.0**90):
        own = velocity[mass == kind] * math.sqrt(kind / 2.0)  # of variance 1
        assert np.abs(own.mean(axis=0)).max() < 4.0 / math.sqrt(20_000)
        # Moments of a normal distribution, within four standard errors: 40,000 numbers.
        assert abs(np.mean(own**2) - 1.0) < 4.0 * math.sqrt(2.0 / 40_000)
        assert abs(np.mean(own**4) - 3.0) < 4.0 * math.sqrt(96.0 / 40_000)
        assert abs(np.mean(np.abs(own) > 2.0) - 0.0455) < 4.0 * math.sqrt(0.0455 / 40_000)
        assert abs(np.mean(own[:, 0] * own[:, 1])) < 4.0 / math.sqrt(20_000)


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


def test_masses_are_equal_or_as_the_area_or_given() -> None:
    radii = (0.5, 1.0)
    assert (make_scene("mixture", radii=radii).mass == 1.0).all()
    scene = make_scene("mixture", radii=radii, mass="area")
    assert scene.mass.tolist() == [1.0] * 50 + [4.0] * 50
    assert make_scene("mixture", radii=radii, masses=(1.0, 4.0)) == scene


def test_random_mixtures_are_placed_up_to_a_half_and_on_a_lattice_beyond() -> None:
    rows = {
        density: len(np.unique(make_scene("mixture", bodies=400, density=density).position[:, 1].round(9)))
        for density in (0.5, 0.61)
    }
    assert rows[0.5] == 400
    assert rows[0.61] <= 25


@pytest.mark.parametrize("name", ["hexagonal", "square"])
@pytest.mark.parametrize("walls", [True, False])
def test_crystals_have_equal_neighbours_and_fill_their_box(name: str, walls: bool) -> None:
    scene = make_scene(name, columns=6, rows=8, walls=walls, radius=0.5, density=0.4)
    apart = scene.position[:, np.newaxis] - scene.position
    distance = np.hypot(apart[..., 0], apart[..., 1])
    spacing = distance[0, 1]
    neighbours = np.sum(np.abs(distance - spacing) < 1e-9 * spacing, axis=1)
    assert neighbours.max() == (6 if name == "hexagonal" else 4)
    cell = spacing**2 * (math.sqrt(0.75) if name == "hexagonal" else 1.0)
    if walls:
        assert scene.arena is not None
        assert np.allclose(scene.position.min(axis=0), spacing / 2.0)
        assert np.allclose(scene.arena - scene.position.max(axis=0), spacing / 2.0)
    else:
        assert scene.arena is None
        assert math.isclose(48 * cell, 48 * math.pi * 0.25 / 0.4)


def test_one_row_is_the_same_crystal_by_either_name() -> None:
    one = {"columns": 7, "rows": 1, "density": 0.6}
    assert make_scene("hexagonal", **one) == make_scene("square", **one)


def test_vacancies_are_sites_of_the_lattice_and_follow_the_seed() -> None:
    def sites(**parameters: Any) -> set[tuple[int, ...]]:
        scene = make_scene("square", density=0.01, **parameters)
        assert scene.arena is not None
        return {tuple(place) for place in np.floor(scene.position / scene.arena[0] * 10).astype(int).tolist()}

    assert len(sites()) == 100
    assert len(sites(vacancies=98)) == 2
    assert sites(vacancies=30) < sites()
    assert len(sites(vacancies=30)) == 70
    assert sites(vacancies=30) != sites(vacancies=30, seed=2)


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
