"""The built-in recipes: scenes by name, and refusals; ``test_same_bits.py`` holds their bits."""

import math
from contextlib import suppress
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest

from command_line import printed
from kinetile import Scene, SceneSpec, Simulation, film, hookimpl, make_scene, registry, view
from kinetile.errors import BadOption, PhaseError, SceneError
from kinetile.plugin.parameters import Parameter
from kinetile.plugin.registry import Registry
from kinetile.scene import by_name
from kinetile.scene.by_name import parse_parameters, recipe_parameters
from kinetile.scene.files import loads_scene
from messages import table
from registering import registered

NAMES = (
    *("grid", "random", "lattice", "figure-10", "figure-11", "figure-16", "cradle", "break", "two-discs"),
    *("mixture", "grown", "hexagonal", "square", "galton", "heap"),
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


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", [name for name in NAMES if name not in IN_A_RUN])
def test_a_number_that_no_scene_has_was_a_warning_of_numpy_or_blamed_on_the_recipe(name: str) -> None:
    for each in (each.name for each in recipe_parameters(name) if each.type == "float"):
        for odd in (math.inf, -math.inf, math.nan, 1e300, 1e-320, -1.0, 0.0):
            with suppress(BadOption, SceneError):
                make_scene(name, **{each: odd})


def test_galton_s_board_ended_before_a_ball_had_landed() -> None:
    few = {"rows": 2, "balls": 2}
    scene, text = make_scene("galton", **few), 'recipe = "galton"\nparameters = {rows = 2, balls = 2}\n'
    assert scene.settings.until == scene.commands[-1].time == 14.0
    assert [loads_scene(each + text).settings.until for each in ("", "until = 3\n")] == [14.0, 3.0]
    assert printed("run galton -s rows=2 -s balls=2")["run"]["time"] == 14.0
    sim = Simulation(scene, "naive")
    assert film(sim).times[-1] == view(sim).page.recordings[0].end / 2**52 == 14.0
    sim.run()
    assert (len(sim.bodies), sim.readings.unaccounted_energy < 1e-12) == (len(scene), True)


def test_dyadic_lattices_are_exact_and_touch() -> None:
    for seed in range(6):
        scene = make_scene("lattice", bodies=1 + 3 * seed, turns=seed, seed=seed)
        for numbers, unit in ((scene.position, 128.0), (scene.radius, 64.0), (scene.velocity, 4.0)):
            assert np.array_equal(numbers * unit, np.round(numbers * unit))
        assert len(scene.turns) == seed
        assert gaps(scene).min() >= 0.0
        assert (gaps(make_scene("lattice", bodies=40, touching=1.0, seed=seed)) == 0.0).any()


def test_a_recipe_that_breaks_is_named() -> None:
    class Broken:
        @hookimpl
        def kinetile_scenes(self) -> list[SceneSpec]:
            return [SceneSpec("broken", lambda: np.zeros(2**62), "asks for too much")]

    said = r"scene 'broken' of .*: the recipe raised "
    with registered(Broken()), pytest.raises(PhaseError, match=said):
        make_scene("broken")


def test_parameters_are_read_from_text() -> None:
    texts = ["bodies=1e3", "radius-ratio=4", "density = .25", "seed=7"]
    assert parse_parameters("random", texts) == {
        "bodies": 1000,
        "radius_ratio": 4.0,
        "density": 0.25,
        "seed": 7,
    }
    assert parse_parameters("lattice", ["kind=non-dyadic"]) == {"kind": "non-dyadic"}


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


@pytest.fixture
def foreign(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Scenes by name, where these recipes are the only ones."""
    for module in ("plugin.parameters", "scene.by_name"):
        monkeypatch.setattr(f"kinetile.{module}.registry", lambda: Registry([Foreign()]))
    return by_name


test_message = table(globals())


@pytest.mark.usefixtures("foreign")
def test_recipes_of_others_are_scenes() -> None:
    assert recipe_parameters("needs")[1] == Parameter("flag", "bool", False)
    found = make_scene("needs", count=1, flag=True, several=[2], other=[1]).origin["parameters"]
    assert found == {"count": 1, "flag": True, "several": (2,), "other": [1]}
    assert parse_parameters("needs", ["flag=true", "count=2"]) == {"flag": True, "count": 2}


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
