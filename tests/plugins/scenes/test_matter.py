"""Mixtures, crystals and starts at a temperature: what they promise, and what they refuse."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from kinetile import Scene, Simulation, load_scene, make_scene
from kinetile.errors import BadOption
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


def gap(scene: Scene) -> float:
    """Return the smallest distance between the edges of two discs, in units of the smallest radius."""
    apart = scene.position[:, np.newaxis] - scene.position
    between = np.hypot(apart[..., 0], apart[..., 1]) - (scene.radius[:, np.newaxis] + scene.radius)
    return float(between[~np.eye(len(scene), dtype=bool)].min() / scene.radius.min())


def energies(scene: Scene) -> npt.NDArray[np.float64]:
    energy: npt.NDArray[np.float64] = scene.mass * np.sum(scene.velocity**2, axis=1) / 2.0
    return energy


@pytest.mark.parametrize(("name", "parameters"), STARTS)
def test_starts_have_density_and_temperature_and_neither_overlap_nor_momentum(
    name: str, parameters: dict[str, Any]
) -> None:
    scene = make_scene(name, **parameters)
    asked = scene.origin["parameters"]
    assert gap(scene) > 0.0
    if scene.arena is not None:
        width, height = scene.arena
        assert math.isclose(math.pi * np.sum(scene.radius**2), asked["density"] * width * height)
        low, high = scene.position - scene.radius[:, None], scene.position + scene.radius[:, None]
        assert (low >= 0.0).all()
        assert (high <= scene.arena).all()
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
        ({"bodies": 12, "counts": (1, 11)}, [1, 11]),
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


@pytest.mark.parametrize("bodies", [1, 2, 3, 12, 13, 399, 401])
def test_a_grid_takes_any_number_of_bodies(bodies: int) -> None:
    scene = make_scene("grid", bodies=bodies, density=0.3)
    assert len(scene) == bodies
    assert math.isclose(math.pi * np.sum(scene.radius**2), 0.3)
    columns = math.ceil(math.sqrt(bodies))
    rows = math.ceil(bodies / columns)
    row, column = np.divmod(np.arange(bodies), columns)
    assert np.allclose(scene.position, np.stack([(column + 0.5) / columns, (row + 0.5) / rows], axis=1))
    assert bodies == 1 or gap(scene) > 0.0


def test_several_numbers_are_written_as_lists_or_as_text(tmp_path: Any) -> None:
    asked = {"radii": (0.5, 1.0), "counts": (3, 9), "bodies": 12, "density": 0.3}
    scene = make_scene("mixture", **asked)
    for texts in (["radii=.5, 1", "counts=3,9"], ["radii=[0.5,1.0]", "counts=(3, 9,)"]):
        assert parse_parameters("mixture", [*texts, "bodies=12", "density=0.3"]) == asked
    for radii in ("[0.5, 1]", '"0.5, 1"'):
        (tmp_path / "scene.toml").write_text(
            "recipe = 'mixture'\n"
            f"parameters = {{bodies = 12, density = 0.3, counts = [3, 9], radii = {radii}}}"
        )
        assert load_scene(tmp_path / "scene.toml") == scene
    assert make_scene("mixture", radii=0.5) == make_scene("mixture", radii=[0.5])
    assert parse_parameters("mixture", ["counts="]) == {"counts": ()}
    with pytest.raises(BadOption, match=r"'radii': found 'a,1'; expected numbers, such as \[0.5, 0.7\], or"):
        parse_parameters("mixture", ["radii=a,1"])
    with pytest.raises(BadOption, match=r"'counts': found \[1.5, 2\]; expected whole numbers, such as"):
        make_scene("mixture", counts=[1.5, 2])


@pytest.mark.parametrize(
    ("name", "parameters", "told"),
    [
        (
            "mixture",
            {"density": 0.7},
            r"came to 0\.5\d+ \(\d+ of 100 discs\), and a lattice .* has 0\.593; ask",
        ),
        ("mixture", {"density": 1.0}, "density is 1.0; it is above 0 and below 1"),
        ("mixture", {"bodies": 1}, "bodies is 1; a mixture has 2 bodies or more"),
        ("mixture", {"radii": ()}, "radii are left empty"),
        ("mixture", {"radii": (0.5, -1.0)}, r"radii\[1\] is -1.0; it is above 0"),
        ("mixture", {"radii": (0.5, math.inf)}, r"radii\[1\] is inf"),
        ("mixture", {"fractions": (1.0,)}, "fractions has 1 numbers, and radii has 2; expected one for each"),
        ("mixture", {"fractions": (1.0, 0.0)}, r"fractions\[1\] is 0.0; it is above 0"),
        ("mixture", {"counts": (50, 50), "fractions": (1.0, 1.0)}, "counts are given beside fractions"),
        ("mixture", {"counts": (3, 9)}, "counts add up to 12, and bodies is 100"),
        ("mixture", {"counts": (-1, 101)}, r"counts are \[-1, 101\]; each is 1 or more"),
        ("mixture", {"mass": "volume"}, "mass is 'volume'; it is 'equal' or 'area'"),
        ("mixture", {"mass": "area", "masses": (1.0, 2.0)}, "mass is 'area' beside masses"),
        ("mixture", {"masses": (1.0, math.inf)}, r"masses\[1\] is inf"),
        ("mixture", {"temperature": 0.0}, "temperature is 0.0; it is above 0"),
        ("mixture", {"temperature": math.nan}, "temperature is nan"),
        (
            "mixture",
            {"temperature": 1e60, "masses": (1e-60, 1e-60)},
            "temperature is 1e.60, at which a speed",
        ),
        ("mixture", {"radii": (1e60, 1e60), "density": 1e-9}, "side of the square for this density is 5"),
        (
            "hexagonal",
            {"density": 0.8506},
            "with walls have one above 0 and below 0.850556, where they",
        ),
        ("hexagonal", {"density": 0.91, "walls": False}, "without walls have one above 0 and below 0.906900"),
        ("square", {"density": 0.75, "vacancies": 10}, "90 discs at 100 sites .* below 0.706858"),
        ("square", {"vacancies": 99}, "vacancies is 99; it is from 0 to 98, of 100 sites"),
        ("square", {"columns": 1, "rows": 1}, "1 columns and 1 rows are 1 sites; expected 2 to 10,000,000"),
        ("square", {"columns": 10_000, "rows": 10_000}, "are 100,000,000 sites; expected 2 to 10,000,000"),
        ("square", {"rows": 0}, "rows is 0; a crystal has 1 row or more"),
        ("square", {"radius": 0.0}, "radius is 0.0; it is above 0"),
        ("square", {"density": 1e-320}, "side of the box for this density is"),
        ("grid", {"bodies": 5}, r"below pi / 4 \* 5 / 3\*\*2 = 0.436, where 5 discs would touch"),
        ("grid", {"bodies": 1, "temperature": 1.0}, "bodies is 1; at a temperature and without momentum"),
        ("grid", {"speed": 2.0, "temperature": 1.0}, "speed is 2.0 beside a temperature, 1.0; expected one"),
        ("random", {"temperature": -1.0}, "temperature is -1.0; it is above 0"),
    ],
)
def test_what_cannot_be_made_is_refused_in_a_sentence(
    name: str, parameters: dict[str, Any], told: str
) -> None:
    with pytest.raises(BadOption, match=told):
        make_scene(name, **parameters)


@pytest.mark.compiled
def test_a_mixture_and_a_crystal_have_one_answer_under_two_broad_phases() -> None:
    for scene in (
        make_scene("mixture", bodies=40, radii=(0.5, 1.5), masses=(1.0, 9.0), fractions=(3.0, 1.0)),
        make_scene("hexagonal", columns=6, rows=6, vacancies=3).replace(mass=np.arange(33) % 2 + 1.0),
    ):
        logs = []
        for phase in ("naive", "cells"):
            sim = Simulation(scene, phase)
            sim.run(until=100.0, max_contacts=300)
            logs.append(sim.contacts.tolist())
        assert len(logs[0]) == 300
        assert logs[0] == logs[1]
