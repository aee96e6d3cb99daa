"""The built-in recipes: that each makes what it says, and refuses what it cannot make."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from kinetile import Scene, SceneSpec, hookimpl, make_scene, registry
from kinetile.errors import BadOption, PhaseError, SceneError, UnknownName
from kinetile.plugin.parameters import Parameter
from kinetile.plugin.registry import Registry
from kinetile.scene.by_name import parse_parameters, recipe_parameters
from registering import registered

NAMES = (
    *("grid", "random", "lattice", "figure-10", "figure-11", "figure-16", "cradle", "break", "two-discs"),
    *("mixture", "grown", "hexagonal", "square"),
)


def gaps(scene: Scene) -> npt.NDArray[np.float64]:
    apart = scene.position[:, np.newaxis] - scene.position[np.newaxis]
    between = np.hypot(apart[..., 0], apart[..., 1]) - (scene.radius[:, np.newaxis] + scene.radius)
    np.fill_diagonal(between, np.inf)
    return between


def test_all_are_registered_and_described() -> None:
    assert registry().names("scene")[: len(NAMES)] == NAMES
    for name in NAMES:
        doc = registry().target("scene", name).__doc__
        assert doc
        assert doc.splitlines()[0].endswith((".", ","))
        readable = ("int", "float", "str", "bool", "tuple[int, ...]", "tuple[float, ...]")
        assert all(each.type in readable for each in recipe_parameters(name))


IN_A_RUN = {"grown": [pytest.mark.slow, pytest.mark.compiled]}
"""Recipes that are runs of many events."""


@pytest.mark.parametrize("name", [pytest.param(name, marks=IN_A_RUN.get(name, [])) for name in NAMES])
def test_defaults_give_a_scene_that_is_the_same_each_time(name: str) -> None:
    scene = make_scene(name)
    assert scene == make_scene(name)
    assert scene.origin["recipe"] == name
    assert make_scene(name, **scene.origin["parameters"]) == scene
    assert scene.origin["parameters"] == {each.name: each.default for each in recipe_parameters(name)}


@pytest.mark.parametrize(
    "name", ["grid", "random", "lattice", "figure-10", "figure-11", "figure-16", "two-discs"]
)
def test_another_seed_gives_another_scene(name: str) -> None:
    assert make_scene(name, seed=1) != make_scene(name, seed=2)


@pytest.mark.parametrize("bodies", [1, 2, 3, 12, 13, 25, 400, 401])
def test_grid_is_the_benchmark_of_the_thesis_for_any_number_of_bodies(bodies: int) -> None:
    scene = make_scene("grid", bodies=bodies, density=0.3)
    assert len(scene) == bodies
    assert scene.arena == (1.0, 1.0)
    assert math.isclose(math.pi * float(np.sum(scene.radius**2)), 0.3)
    assert np.allclose(np.hypot(*scene.velocity.T), 1.0)
    columns = math.ceil(math.sqrt(bodies))
    row, column = np.divmod(np.arange(bodies), columns)
    rows = math.ceil(bodies / columns)
    assert np.allclose(scene.position, np.stack([(column + 0.5) / columns, (row + 0.5) / rows], axis=1))


def test_random_has_the_density_and_the_ratios_that_are_given() -> None:
    scene = make_scene(
        "random", bodies=300, density=0.3, radius_ratio=50.0, mass_ratio=1e6, speed=2.0, seed=3
    )
    assert math.isclose(math.pi * float(np.sum(scene.radius**2)), 0.3)
    assert 30.0 < scene.radius.max() / scene.radius.min() <= 50.0
    assert 1e5 < scene.mass.max() / scene.mass.min() <= 1e6
    assert np.allclose(np.hypot(*scene.velocity.T), 2.0)
    dense = make_scene("random", bodies=100, density=0.75)  # too dense for random places: from a lattice
    assert math.isclose(math.pi * float(np.sum(dense.radius**2)), 0.75)
    assert len(np.unique(np.round(dense.position[:, 1], 9))) <= 12


@pytest.mark.parametrize("seed", range(12))
def test_dyadic_lattices_are_exact_and_touch(seed: int) -> None:
    scene = make_scene("lattice", bodies=1 + 3 * seed, turns=seed, seed=seed)
    for numbers, unit in ((scene.position, 128.0), (scene.radius, 64.0), (scene.velocity, 4.0)):
        assert np.array_equal(numbers * unit, np.round(numbers * unit))
    assert len(scene.turns) == seed
    assert all((turn.time * 16.0).is_integer() and 0.0 <= turn.time <= 4.0 for turn in scene.turns)
    assert gaps(scene).min() >= 0.0
    assert (gaps(make_scene("lattice", bodies=40, touching=1.0, seed=seed)) == 0.0).any()


@pytest.mark.parametrize("seed", range(12))
def test_non_dyadic_and_jittered_lattices_touch_within_the_tolerance(seed: int) -> None:
    jitter = 10.0 ** -(9 + seed % 8)
    for kind in ("dyadic", "non-dyadic"):
        still = make_scene("lattice", bodies=1 + 3 * seed, kind=kind, seed=seed)
        moved = make_scene("lattice", bodies=1 + 3 * seed, kind=kind, jitter=jitter, seed=seed)
        assert moved.arena is not None
        assert moved.arena[0] != moved.arena[1]
        assert np.abs(moved.position - still.position).max() <= jitter + 2.0**-52
        assert (moved.radius <= still.radius).all()
        assert (moved.radius >= still.radius - 4.0 * jitter).all()


def test_cradle_is_exact_and_touches() -> None:
    scene = make_scene("cradle", bodies=5, moving=2)
    assert np.array_equal(scene.position * 8.0, np.round(scene.position * 8.0))
    between = np.diff(scene.position[:, 0]) - 0.25
    assert between.tolist() == [0.0, 0.5, 0.0, 0.0]
    assert scene.velocity[:, 0].tolist() == [1.0, 1.0, 0.0, 0.0, 0.0]


def test_break_is_a_touching_rack_of_fifteen() -> None:
    scene = make_scene("break", aim=0.1)
    rack = gaps(scene)[1:, 1:]
    assert len(scene) == 16
    assert (np.abs(rack) < 1e-15).sum() == 2 * 30
    assert math.isclose(math.hypot(*scene.velocity[0]), 8.0)
    assert not scene.velocity[1:].any()


def test_two_discs_start_on_their_energy_surface() -> None:
    for seed in range(100):
        scene = make_scene("two-discs", seed=seed)
        assert len(scene) == 2
        assert math.isclose(float(np.sum(scene.velocity**2)), 2.0)
        assert gaps(scene).min() >= 0.0


LATTICE = r"came to 0\.\d+ \(\d+ of 100 discs\), and a lattice with room for the largest .* ask for less"


@pytest.mark.parametrize(
    ("name", "parameters", "sentence"),
    [
        ("random", {"density": 0.9}, LATTICE),
        ("random", {"density": 0.7, "radius_ratio": 1.5}, LATTICE),
        ("random", {"density": 1.0}, "density is 1.0; it is above 0 and below 1"),
        ("random", {"density": math.nan}, "density is nan"),
        ("random", {"bodies": -1}, "bodies is -1"),
        ("random", {"radius_ratio": 0.5}, "radius_ratio is 0.5; a ratio is finite, and 1 or more"),
        ("random", {"seed": -1}, "seed is -1; a seed is 0 or more"),
        ("random", {"temperature": -1.0}, "temperature is -1.0; expected a finite number"),
        ("random", {"bodies": 10**20}, "bodies is 1" + "0" * 20 + "; it is at most 10,000,000, for memory"),
        ("grid", {"bodies": 5}, r"below pi / 4 \* 5 / 3\*\*2 = 0.436, where 5 discs would touch"),
        ("grid", {"bodies": 1, "temperature": 1.0}, "bodies is 1; at a temperature and without momentum"),
        ("grid", {"speed": 2.0, "temperature": 1.0}, "speed is 2.0 beside a temperature, 1.0; expected one"),
        ("lattice", {"kind": "diadic"}, "kind is 'diadic'; it is 'dyadic' or 'non-dyadic'"),
        ("lattice", {"jitter": 0.1}, r"jitter is 0\.1"),
        ("lattice", {"turns": 10**12}, "turns is 1000000000000; it is at most 10,000,000"),
        ("figure-11", {"bodies": 153}, "bodies is 153; figure 11 has from 1 to 152"),
        ("cradle", {"moving": 5}, "moving is 5; it is from 1 to 4"),
        ("two-discs", {"radius": 0.3}, r"radius is 0\.3"),
        ("mixture", {"density": 0.7}, LATTICE),
        ("mixture", {"bodies": 1}, "bodies is 1; a mixture has 2 bodies or more"),
        ("mixture", {"radii": ()}, "radii are left empty"),
        ("mixture", {"radii": (0.5, -1.0)}, r"radii\[1\] is -1.0; expected a finite number"),
        ("mixture", {"fractions": (1.0,)}, "fractions has 1 numbers, and radii has 2; expected one for each"),
        ("mixture", {"fractions": (1.0, 0.0)}, r"fractions\[1\] is 0.0; expected a finite number"),
        ("mixture", {"mass": "volume"}, "mass is 'volume'; it is 'equal' or 'area'"),
        ("mixture", {"mass": "area", "masses": (1.0, 2.0)}, "mass is 'area' beside masses"),
        ("mixture", {"masses": (1.0, math.inf)}, r"masses\[1\] is inf"),
        ("mixture", {"temperature": math.nan}, "temperature is nan"),
        ("hexagonal", {"density": 0.8506}, "with walls have one above 0 and below 0.850556, where they"),
        ("hexagonal", {"density": 0.91, "walls": False}, "without walls have one above 0 and below 0.906900"),
        ("square", {"density": 0.75, "vacancies": 10}, "90 discs at 100 sites .* below 0.706858"),
        ("square", {"vacancies": 99}, "vacancies is 99; it is from 0 to 98, of 100 sites"),
        ("square", {"columns": 10_000, "rows": 10_000}, "are 100,000,000 sites; expected 2 to 10,000,000"),
        ("square", {"rows": 0}, "rows is 0; a crystal has 1 row or more"),
        ("square", {"radius": 0.0}, "radius is 0.0; expected a finite number"),
    ],
)
def test_what_cannot_be_made_is_refused_in_a_sentence(
    name: str, parameters: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(BadOption, match=sentence):
        make_scene(name, **parameters)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        *((name, {"speed": 1e300}) for name in ("grid", "random", "figure-10", "figure-11", "break")),
        ("random", {"speed": math.inf}),
        ("random", {"density": 1e-320}),
        ("random", {"mass_ratio": 2.0**101}),
        ("mixture", {"radii": (1e60, 1e60), "density": 1e-9}),
        ("mixture", {"temperature": 1e60, "masses": (1e-60, 1e-60)}),
        ("square", {"density": 1e-320}),
    ],
)
def test_what_no_scene_may_have_is_refused_by_the_scene(name: str, parameters: dict[str, float]) -> None:
    with pytest.raises(SceneError, match=r"expected .*(2\*\*|finite)"):
        make_scene(name, **parameters)


def test_a_recipe_that_breaks_is_named() -> None:
    class Broken:
        @hookimpl
        def kinetile_scenes(self) -> list[SceneSpec]:
            return [SceneSpec("broken", lambda: np.zeros(2**62), "asks for too much")]

    said = r"scene 'broken' of .*: the recipe raised "
    with registered(Broken()), pytest.raises(PhaseError, match=said):
        make_scene("broken")


def test_wrong_parameters_are_all_told_with_a_suggestion() -> None:
    with pytest.raises(BadOption) as caught:
        make_scene("grid", bodys=4, density="much", seed=1.5, speed=True)
    assert str(caught.value).splitlines() == [
        "scene 'grid': parameter 'bodys': found no parameter of this name; "
        "expected one of bodies, density, seed, speed, temperature, periodic, gravity; "
        "did you mean 'bodies'?",
        "scene 'grid': parameter 'density': found 'much'; expected a number",
        "scene 'grid': parameter 'seed': found 1.5; expected a whole number",
        "scene 'grid': parameter 'speed': found True; expected a number",
    ]
    with pytest.raises(UnknownName, match="did you mean 'grid'"):
        make_scene("gird")


def test_parameters_are_read_from_text() -> None:
    texts = ["bodies=1e3", "radius-ratio=4", "density = .25", "seed=7"]
    assert parse_parameters("random", texts) == {
        "bodies": 1000,
        "radius_ratio": 4.0,
        "density": 0.25,
        "seed": 7,
    }
    assert parse_parameters("lattice", ["kind=non-dyadic"]) == {"kind": "non-dyadic"}
    with pytest.raises(BadOption) as caught:
        parse_parameters("grid", ["bodies=1.5", "densty=1", "seed=1", "seed=2", "x", "=3", "speed=fast"])
    assert str(caught.value).splitlines() == [
        "scene 'grid': parameter 'bodies': found '1.5'; expected a whole number",
        "scene 'grid': parameter 'densty': found no parameter of this name; "
        "expected one of bodies, density, seed, speed, temperature, periodic, gravity; "
        "did you mean 'density'?",
        "scene 'grid': the parameter 'seed' is given twice; expected one value",
        "scene 'grid': a parameter is written name=value; found 'x'",
        "scene 'grid': a parameter is written name=value; found '=3'",
        "scene 'grid': parameter 'speed': found 'fast'; expected a number",
    ]


class Foreign:
    """A plugin of somebody else, with recipes of every shape."""

    @hookimpl
    def kinetile_scenes(self) -> list[SceneSpec]:
        return [
            SceneSpec("needs", self.needs, "has a parameter without a default"),
            SceneSpec("hides", self.hides, "takes any parameter"),
            SceneSpec("returns", self.returns, "makes no scene"),
        ]

    @staticmethod
    def needs(
        *, count: int, flag: bool = False, several: tuple[int, ...] = (), other: list[int] | None = None
    ) -> Scene:
        return Scene(np.zeros((0, 2)), np.zeros((0, 2)), [])

    @staticmethod
    def hides(**anything: int) -> Scene:
        raise AssertionError

    @staticmethod
    def returns() -> int:
        return 3


def test_recipes_of_others_are_held_to_their_signature(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("plugin.parameters", "scene.by_name"):
        monkeypatch.setattr(f"kinetile.{module}.registry", lambda: Registry([Foreign()]))
    assert recipe_parameters("needs")[1] == Parameter("flag", "bool", False)
    with pytest.raises(
        BadOption, match="parameter 'count': found nothing; expected a whole number; it has no default"
    ):
        make_scene("needs")
    with pytest.raises(BadOption, match=r"'several': found \[1.5, 2\]; expected whole numbers, such as"):
        make_scene("needs", count=1, several=[1.5, 2])
    found = make_scene("needs", count=1, flag=True, several=[2], other=[1]).origin["parameters"]
    assert found == {"count": 1, "flag": True, "several": (2,), "other": [1]}
    assert parse_parameters("needs", ["flag=true", "count=2"]) == {"flag": True, "count": 2}
    with pytest.raises(BadOption, match="parameter 'flag': found 'maybe'; expected true or false"):
        parse_parameters("needs", ["flag=maybe"])
    with pytest.raises(
        PhaseError, match="gathers its parameters in 'anything'; expected parameters that can each"
    ):
        recipe_parameters("hides")
    with pytest.raises(
        PhaseError, match=r"the recipe of the scene 'returns' returned 3; expected a kinetile\.Scene"
    ):
        make_scene("returns")


def test_a_recipe_with_a_parameter_called_periodic_got_the_one_of_all_recipes() -> None:
    asked = []

    def ring(periodic: bool = False) -> Scene:
        asked.append(periodic)
        return Scene([(0.5, 0.5)], [(0.0, 0.0)], 0.1, arena=(1, 1))

    class Rings:
        @hookimpl
        def kinetile_scenes(self) -> list[SceneSpec]:
            return [SceneSpec("ring", ring, "one disc")]

    with registered(Rings()):
        scene = make_scene("ring", periodic=True)
    assert asked == [True]
    assert scene.periodic == ""
    assert scene.origin["parameters"] == {"periodic": True}
