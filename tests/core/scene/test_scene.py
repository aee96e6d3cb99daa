"""Scenes made from arrays: what they keep, what they refuse, and how two compare."""

from __future__ import annotations

import copy
import itertools
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetile import Insert, Scene, Settings, Turn, make_scene
from kinetile.errors import SceneError
from kinetile.scene import bodies, relabelled
from kinetile.scene.bodies import overlapping_pairs

STILL = {"velocity": [[0.0, 0.0]], "radius": 0.1}


def places(error: SceneError) -> list[str]:
    return [mistake.where for mistake in error.mistakes]


def refused(**fields: object) -> SceneError:
    with pytest.raises(SceneError) as caught:
        Scene(**fields)  # type: ignore[arg-type]
    return caught.value


def test_keeps_its_own_read_only_copies() -> None:
    position = np.array([[0.25, 0.5], [0.75, 0.5]], order="F")
    scene = Scene(position, np.zeros((2, 2)), 0.1, 2, arena=[1, 1])
    position[0, 0] = 9.0
    assert scene.position[0, 0] == 0.25
    for array, shape in (
        (scene.position, (2, 2)),
        (scene.velocity, (2, 2)),
        (scene.radius, (2,)),
        (scene.mass, (2,)),
    ):
        assert array.shape == shape
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
        assert not array.flags.writeable
    assert len(scene) == 2
    assert scene.arena == (1.0, 1.0)
    assert repr(scene) == "<Scene: 2 bodies, in 1.0 x 1.0>"


def test_may_be_empty() -> None:
    scene = Scene([], [], 1.0)
    assert len(scene) == 0
    assert scene.position.shape == (0, 2)
    assert scene == Scene(np.empty((0, 2)), np.empty((0, 2)), [])


def test_turns_are_sorted_by_time_and_body_and_keep_their_order_in_ties() -> None:
    turns = [(1, 2.0, (1.0, 0.0)), (0, 2.0, (2.0, 0.0)), (1, 1.0, (3.0, 0.0)), (0, 2.0, (4.0, 0.0))]
    scene = Scene([[0, 0], [1, 0]], np.zeros((2, 2)), 0.1, turns=turns)
    assert [turn.velocity[0] for turn in scene.turns] == [3.0, 2.0, 4.0, 1.0]
    assert scene.turns[0] == Turn(1, 1.0, (3.0, 0.0))


def test_equal_means_the_same_bits() -> None:
    scene = Scene([[0.0, 0.0]], **STILL)
    assert scene == Scene([[0.0, 0.0]], **STILL)
    assert hash(scene) == hash(Scene([[0.0, 0.0]], **STILL))
    assert scene != Scene([[-0.0, 0.0]], **STILL)
    assert scene != Scene([[0.0, 0.0]], **STILL, start=-0.0)
    assert scene != Scene([[0.0, 0.0]], **STILL, turns=[(0, 0.0, (0.0, -0.0))])
    assert scene != Scene([[0.0, 0.0]], **STILL, settings=Settings(until=1))
    assert scene == Scene([[0.0, 0.0]], **STILL, origin={"recipe": "made up"})
    assert scene != "a scene"


@pytest.mark.parametrize("again", [copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s)), replace])
def test_copies_are_equal_and_read_only(again: object) -> None:
    settings = Settings("naive", ("disc",), {"sap-1d": {"axis": "y"}}, 2.0)
    turns = [(0, 1.5, (0.0, -0.0))]
    scene = Scene(
        [[0.5, 0.5]], **STILL, arena=(1, 1), turns=turns, start=1.0, settings=settings, origin={"a": 1}
    )
    twin = again(scene)  # type: ignore[operator]
    assert twin == scene
    assert twin.origin == {"a": 1}
    assert not twin.position.flags.writeable


def test_settings_are_a_value() -> None:
    options = {"sap-1d": {"axis": "y"}}
    settings = Settings(narrow_phases=["disc"], options=options, until=2)  # type: ignore[arg-type]
    options["sap-1d"]["axis"] = "x"
    assert settings.options == {"sap-1d": {"axis": "y"}}
    assert settings.narrow_phases == ("disc",)
    assert isinstance(settings.until, float)


def test_relabelled_shares_the_bodies_and_checks_the_settings() -> None:
    scene = Scene([[0.0, 0.0]], **STILL, start=1.0)
    other = relabelled(scene, settings=Settings(until=3.0), origin={"recipe": "x"})
    assert other.position is scene.position
    assert scene.settings.until is None
    with pytest.raises(SceneError, match=r"until: found 0\.5; expected a time not before the start, 1\.0"):
        relabelled(scene, settings=Settings(until=0.5))


def test_all_mistakes_are_reported_at_once() -> None:
    error = refused(
        position=[[0.1, 0.5], [0.5, np.nan], [0.9, 0.9], [0.12, 0.5]],
        velocity=[[0.0, 0.0], [0.0, 0.0], [np.inf, 0.0], [0.0, 0.0]],
        radius=[0.1, -1.0, 0.2, 0.1],
        mass=[1.0, 0.0, 1.0, 1.0],
        arena=(1.0, 1.0),
        start=2.0,
        turns=[(4, 3.0, (0.0, 0.0)), (0, 1.0, (0.0, np.nan))],
        settings=Settings(until=1.0),
    )
    assert places(error) == [
        "until",
        "bodies[1].position",
        "bodies[2].velocity",
        "bodies[1].radius",
        "bodies[1].mass",
        "bodies[2].position",
        "bodies[0] and bodies[3]",
        "turns[0].body",
        "turns[1].time",
        "turns[1].velocity",
    ]
    assert str(error).startswith("the scene has 10 mistakes\n")
    assert "which reaches 0.1 beyond the right wall and 0.1 beyond the top wall" in str(error)
    assert "an overlap of 0.18 (distance 0.02, sum of the radii 0.2)" in str(error)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"position": [0.0, 0.0], **STILL}, "position: found an array of shape (2,); expected an array of"),
        ({"position": [[0.0], [1.0, 2.0]], **STILL}, "position: found [[0.0], [1.0, 2.0]]; expected an"),
        ({"position": [["a", "b"]], **STILL}, "expected an array of numbers"),
        ({"position": [[0, 0]], "velocity": [[True, False]], "radius": 1}, "velocity: found [[True, False]]"),
        (
            {"position": [[0, 0]], "velocity": [[0, 0], [1, 1]], "radius": 1},
            "velocity: found 2 rows; expected one for",
        ),
        ({"position": [[0, 0]], **STILL, "mass": [[1]]}, "(n,), or one number for all"),
        ({"position": [[0, 0]], **STILL, "arena": (1, 0)}, "arena: found [1, 0]; expected [width, height],"),
        ({"position": [[0, 0]], **STILL, "arena": "ab"}, "arena: found 'ab'"),
        ({"position": [[0, 0]], **STILL, "start": np.inf}, "start: found inf; expected a finite number"),
        ({"position": [[0, 0]], **STILL, "turns": [(0, 1.0)]}, "turns[0]: found (0, 1.0); expected a turn"),
        ({"position": [[0, 0]], **STILL, "turns": [(True, 1, (0, 0))]}, "turns[0].body: found True"),
        ({"position": [[0, 0]], **STILL, "turns": [(0, 1, (0, 0, 0))]}, "turns[0].velocity: found [0, 0, 0]"),
        ({"position": [[0, 0]], **STILL, "settings": Settings(until="2")}, "until: found '2'; expected a"),
        ({"position": [[0, 0]], **STILL, "settings": Settings(broad_phase=3)}, "broad-phase: found 3"),
        (
            {"position": [[0, 0]], **STILL, "settings": Settings(narrow_phases="disc")},
            "narrow-phases: found 'disc'",
        ),
        ({"position": [[0, 0]], **STILL, "settings": Settings(options={"a": 1})}, "options: found {'a': 1}"),
    ],
)
def test_each_mistake_says_where_what_and_what_would_be_right(
    fields: dict[str, object], sentence: str
) -> None:
    error = refused(**fields)
    assert len(error.mistakes) == 1
    assert sentence in str(error)


def test_touching_is_allowed_and_more_is_not() -> None:
    touching = {"velocity": np.zeros((2, 2)), "radius": 0.1, "arena": (1.0, 1.0)}
    Scene([[0.1, 0.1], [0.1 + 0.2 * (1.0 - 0.9e-12), 0.1]], **touching)
    Scene([[0.1 * (1.0 - 0.9e-12), 0.1], [0.9, 0.9]], **touching)
    assert places(refused(position=[[0.1, 0.1], [0.1 + 0.2 * (1.0 - 1.1e-12), 0.1]], **touching)) == [
        "bodies[0] and bodies[1]"
    ]
    assert places(refused(position=[[0.1 * (1.0 - 1.1e-12), 0.1], [0.9, 0.9]], **touching)) == [
        "bodies[0].position"
    ]


def test_coinciding_discs_are_an_overlap() -> None:
    error = refused(position=[[0.5, 0.5]] * 2, velocity=np.zeros((2, 2)), radius=0.1)
    assert "an overlap of 0.2 (distance 0, sum of the radii 0.2)" in str(error)


def test_many_mistakes_of_one_kind_are_counted() -> None:
    n = 1000
    error = refused(position=np.zeros((n, 2)), velocity=np.zeros((n, 2)), radius=1.0, mass=-1.0)
    assert len(error.mistakes) == 42
    assert "found the same in 980 more bodies; expected a number greater than 0, or inf" in str(error)
    assert f"bodies: found {n * (n - 1) // 2 - 20:,} more pairs that overlap" in str(error)
    turns = [(0, -1.0, (0.0, 0.0))] * 50
    error = refused(position=[[0, 0]], **STILL, turns=turns)
    assert len(error.mistakes) == 21
    assert str(error.mistakes[-1]).startswith("turns[...].time: found 30 more mistakes like these; expected")


def test_overlaps_are_found_even_at_the_ends_of_the_number_range() -> None:
    def found(position: list[list[float]], radius: list[float]) -> list[list[int]]:
        chunks = overlapping_pairs(np.array(position), np.array(radius))
        return [pair for chunk in chunks for pair in chunk.tolist()]

    assert found([[1e308, 0.0], [-1e308, 0.0]], [1.7e308, 1.7e308]) == [[0, 1]]
    assert found([[0.0, 0.0], [5e-324, 0.0]], [1e-320, 1e-320]) == [[0, 1]]
    assert found([[1e300, 0.0], [1e300, 1e290]], [1e-10, 1e280]) == []


@pytest.mark.parametrize("exponent", [-560, -300, 300, 520])
def test_a_scene_with_squares_that_over_or_underflow_is_refused_with_all_its_lengths(exponent: int) -> None:
    scene = make_scene("grid", bodies=4)
    scale = 2.0**exponent
    error = refused(
        position=scene.position * scale,
        velocity=scene.velocity * scale,
        radius=scene.radius * scale,
        mass=scale,
        arena=(scale, scale),
    )
    kinds = {re.sub(r"\d+", "", where) for where in places(error)}
    small = {"arena", "bodies[].radius", "bodies[].mass"}
    assert kinds == (small if exponent < 0 else small | {"bodies[].position", "bodies[].velocity"})
    assert "from 2**-200 (6.2e-61) to 2**200 (1.6e+60)" in str(error)


def test_the_limits_of_magnitude_themselves_are_allowed_and_speeds_may_be_tiny() -> None:
    least, most = 2.0**-200, 2.0**200
    Scene([[0.0, 0.0], [most, 5e-324]], [[most, -most], [5e-324, -1e-310]], [least, 2.0**199])
    Scene([[most / 2.0, most / 2.0]], [[0.0, 0.0]], least, mass=most, arena=(most, most))
    (mistake,) = refused(position=[[0, 0]], **STILL, turns=[(0, 1.0, (0.0, -2.0 * most))]).mistakes
    assert str(mistake).startswith("turns[0].velocity: found [0.0, -3.2138")
    error = refused(
        position=[[0, 0], [1, 0], [2, 0]], velocity=np.zeros((3, 2)), radius=0.1, mass=[1, 4, 2**-99]
    )
    assert places(error) == ["bodies[2].mass and bodies[1].mass"]
    assert "expected no body more than 2**100 (1.3e+30) times as heavy as another" in str(error)


def test_a_start_where_a_time_unit_vanishes_is_refused_with_the_rest() -> None:
    error = refused(position=[[0, 0]], velocity=[[0, 0]], radius=-1.0, start=1e17)
    assert places(error) == ["start", "bodies[0].radius"]
    assert "expected a start at most 4.5036e+15 from 0, beyond which a time unit, 1, is lost" in str(error)
    fast = {"position": [[0.5, 0.5]], "velocity": [[1000.0, 0.0]], "radius": 0.1, "arena": (1.0, 1.0)}
    assert "a time unit, 0.000977, is lost" in str(refused(**fast, start=2.0**43))
    Scene(**fast, start=2.0**42)
    Scene([[0, 0]], **STILL, start=-(2.0**52))


def test_turns_settings_and_origin_of_a_wrong_type_are_mistakes_and_no_tracebacks() -> None:
    error = refused(position=[[0, 0]], velocity=[[0, 0]], radius=-1, turns=None, settings={}, origin=3)
    assert places(error) == ["settings", "origin", "bodies[0].radius", "turns"]
    with pytest.raises(SceneError, match=r"settings: found \{'until': 1\}; expected kinetile\.Settings"):
        relabelled(Scene([[0, 0]], **STILL), settings={"until": 1})  # type: ignore[arg-type]


def test_settings_have_a_hash_though_their_options_are_a_table() -> None:
    one, two = (Settings("sap-1d", ["disc"], {"sap-1d": {"axis": "y"}}, 2) for _ in range(2))  # type: ignore[arg-type]
    assert one == two
    assert hash(one) == hash(two)


@given(
    discs=st.lists(
        st.tuples(
            st.sampled_from([-2.0, -0.5, 0.0, 0.25, 0.5, 1.0, 3.0]) | st.floats(-4.0, 4.0),
            st.sampled_from([-1.0, 0.0, 0.25, 1.0]) | st.floats(-4.0, 4.0),
            st.sampled_from([0.125, 0.25, 0.5]) | st.floats(1e-6, 2.0),
        ),
        max_size=40,
    )
)
def test_the_overlap_search_finds_each_pair_once(discs: list[tuple[float, float, float]]) -> None:
    table = np.array(discs).reshape(-1, 3)
    position, radius = table[:, :2], table[:, 2]
    found = [tuple(pair) for pairs in overlapping_pairs(position, radius) for pair in pairs.tolist()]
    expected = [
        (a, b)
        for a, b in itertools.combinations(range(len(table)), 2)
        if np.hypot(*(position[a] - position[b])) < radius[a] + radius[b]
    ]
    assert sorted(found) == expected


def test_each_disc_of_ten_thousand_is_compared_with_few(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []
    measure = bodies.distance
    monkeypatch.setattr(bodies, "distance", lambda apart: compared.append(len(apart)) or measure(apart))
    monkeypatch.setattr(bodies, "CHUNK", 10_000)
    cell = np.arange(100 * 100)
    position = (np.stack([cell % 100, cell // 100], axis=1) + 0.5) / 100
    still = np.zeros_like(position)
    Scene(position, still, 0.004, arena=(1.0, 1.0))
    assert 0 < sum(compared) < 10 * len(cell)
    compared.clear()
    refused(position=position * 1e-3, velocity=still, radius=0.004)  # all of them overlap
    assert sum(compared) < 20 * len(cell)


def test_a_scene_with_other_values_is_checked_and_keeps_the_rest():
    scene = make_scene("two-discs").replace(kind=["a", "b"], responses={("a", "b"): "stop"}, unit=2.0**-4)
    assert scene.origin == {}, "no recipe makes it"
    still = scene.replace(
        velocity=np.zeros((2, 2)), start=1.0, settings=Settings("naive"), origin={"file": "x"}
    )
    assert not still.velocity.any()
    assert (still.start, still.settings.broad_phase, still.origin) == (1.0, "naive", {"file": "x"})
    assert still.replace(velocity=scene.velocity, start=scene.start, settings=scene.settings) == scene
    assert (scene.replace() == scene, scene.replace() is scene) == (True, False)
    with pytest.raises(SceneError, match=r"bodies\[0\].radius: found -1.0"):
        scene.replace(radius=[-1.0, 1.0])
    with pytest.raises(TypeError, match=r"a scene has no 'raduis'; expected one of .*did you mean 'radius'"):
        scene.replace(raduis=1.0)


def test_turns_are_replaced_alone_and_commands_as_a_whole():
    come, turn = Insert(0.5, (3.0, 3.0), (0.0, 0.0), 0.1), Turn(0, 0.25, (0.0, 1.0))
    scene = Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5, commands=[come, turn])
    assert scene.replace(turns=[]).commands == (come._replace(body=1),)
    other = scene.replace(turns=[(0, 0.75, (1.0, 0.0))])
    assert [type(each).__name__ for each in other.commands] == ["Insert", "Turn"]
    assert scene.replace(commands=[]).commands == ()
    assert scene.replace(commands=[come], turns=[turn]) == scene


def test_kinds_follow_again_unless_they_were_declared():
    scene = Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5, kind="a")
    assert scene.replace(kind="b").kinds == ("b",)
    declared = scene.replace(kinds=["a", "b"])
    assert declared.replace(kind="b").kinds == ("a", "b")
    with pytest.raises(SceneError, match="found 'c', which is none of the kinds that the scene declares"):
        declared.replace(kind="c")
    assert declared.replace(kind="c", kinds=None).kinds == ("c",)
    assert declared.replace(kinds=["b", "a"]) != declared
