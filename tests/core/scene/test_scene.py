"""Scenes made from arrays: their contents, their refusals, and the comparison of two."""

import itertools
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetile import Insert, Scene, Settings, Turn, box, make_scene
from kinetile.errors import SceneError
from kinetile.scene import bodies
from kinetile.scene.bodies import overlapping_images, overlapping_pairs

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


def test_settings_are_a_value() -> None:
    options = {"sap-1d": {"axis": "y"}}
    settings = Settings(narrow_phases=["disc"], options=options, until=2)  # type: ignore[arg-type]
    options["sap-1d"]["axis"] = "x"
    assert settings.options == {"sap-1d": {"axis": "y"}}
    assert settings.narrow_phases == ("disc",)
    assert isinstance(settings.until, float)


def test_touching_is_allowed() -> None:
    touching = {"velocity": np.zeros((2, 2)), "radius": 0.1, "arena": (1.0, 1.0)}
    Scene([[0.1, 0.1], [0.1 + 0.2 * (1.0 - 0.9e-12), 0.1]], **touching)
    Scene([[0.1 * (1.0 - 0.9e-12), 0.1], [0.9, 0.9]], **touching)


def test_overlaps_are_found_even_at_the_ends_of_the_number_range() -> None:
    def found(position: list[list[float]], radius: list[float]) -> list[list[int]]:
        chunks = overlapping_pairs(np.array(position), np.array(radius))
        return [pair for chunk in chunks for pair in chunk.tolist()]

    assert found([[1e308, 0.0], [-1e308, 0.0]], [1.7e308, 1.7e308]) == [[0, 1]]
    assert found([[0.0, 0.0], [5e-324, 0.0]], [1e-320, 1e-320]) == [[0, 1]]
    assert found([[1e300, 0.0], [1e300, 1e290]], [1e-10, 1e280]) == []


def test_commands_of_a_tick_are_in_the_order_of_the_contacts_before_them() -> None:
    tick = 0, 1 << 51
    turns = [Turn(0, 0.5, (speed, 0.0), (*tick, after)) for speed, after in ((3.0, 2), (1.0, 0), (2.0, 0))]
    scene = make_scene("grid", bodies=4).replace(commands=turns)
    assert [each.velocity[0] for each in scene.commands] == [1.0, 2.0, 3.0]


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
    Scene([[0.0, 0.0], [1.0, 0.0]], np.zeros((2, 2)), 0.1, [1.0, 2.0**100], turns=[(0, 1.0, (most, 0.0))])
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
    assert places(refused(position=[[0, 0]], **STILL, start=-(2.0**53))) == ["start"]


def test_settings_have_a_hash_though_their_options_are_a_table() -> None:
    options = ({"sap-1d": {"axis": "y", "odd": float("nan")}} for _ in range(2))
    one, two = (Settings("sap-1d", ["disc"], each, 2) for each in options)  # type: ignore[arg-type]
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


@pytest.mark.parametrize("chunk", [bodies.CHUNK, 4])
@pytest.mark.parametrize("periods", [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
def test_discs_of_a_crowd_overlap_in_all_directions_and_over_borders(
    chunk: int, periods: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bodies, "CHUNK", chunk)
    random = np.random.default_rng(1)
    position, radius = (
        random.random((203, 2)),
        0.99 * 2.0 ** np.minimum(random.uniform(-7.0, -3.0, 203), -5.0),
    )
    position[:3], radius[:3] = [(0.49, 0.51), (0.51, 0.49), (0.49, 0.49)], 0.03  # over two borders at once
    apart = position[:, np.newaxis] - position
    apart -= np.rint(apart) * periods
    overlap = np.hypot(*apart.T) < radius + radius[:, np.newaxis]
    found = overlapping_images(position, radius, periods)
    pairs = sorted(pair for pairs in found for pair in pairs.tolist())
    assert pairs == np.argwhere(np.triu(overlap, 1)).tolist()


def test_a_body_is_narrower_than_a_period_and_a_place_is_less() -> None:
    room = {"position": [[0.5, 0.5]], "velocity": [[0.0, 0.0]], "arena": (1.0, 2.0), "periodic": "x"}
    Scene(**room, radius=np.nextafter(0.5, 0.0))
    Scene(**room, shape=box(0.25, 0.375))
    assert places(refused(**room, radius=0.5)) == ["bodies[0].radius"]
    assert places(refused(**room, shape=box(0.375, 0.5))) == ["bodies[0].shape"]
    assert bodies.in_box(np.array([[-(2.0**-60), -0.25]]), (1.0, 0.0)).tolist() == [[0.0, -0.25]]


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
    assert declared.replace(kind="c", kinds=None).kinds == ("c",)
    assert declared.replace(kinds=["b", "a"]) != declared
