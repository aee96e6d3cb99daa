"""Bodies that are called by names, in scenes, files and commands."""

import csv
import pickle
from pathlib import Path

import pytest

import kinetile as kt
from capabilities import outcome
from command_line import kinetile
from kinetile.errors import SceneError
from kinetile.scene.files import dumps_scene, loads_scene

pytestmark = pytest.mark.small


def flights(*more: object, names: object = ("AF123", None)) -> kt.Scene:
    return kt.Scene(
        [[1.0, 1.0], [3.0, 1.0]],
        [[1.0, 0.0], [0.0, 0.0]],
        0.25,
        arena=(6.0, 4.0),
        names=names,
        kind=["flight"] * 2,
        responses={("flight", "flight"): "pass"},
        commands=[
            kt.Turn("BA777", 1.5, (0.0, 1.0)),
            kt.Insert(1.0, (5.0, 1.0), (-1.0, 0.0), 0.25, name="BA777"),
            kt.Turn("AF123", 2.0, (0.5, 0.0)),
            kt.Move("AF123", 2.25, (1.0, 3.0)),
            kt.Remove("BA777", 2.5),
            *more,
        ],
    )


def test_commands_call_bodies_by_names_and_a_scene_has_their_numbers() -> None:
    scene = flights()
    assert scene.numbers == {"AF123": 0, "BA777": 2}
    assert [each.body for each in scene.commands] == [2, 2, 0, 0, 2]
    come, *others = scene.commands
    plain = scene.replace(names=None, commands=[come._replace(name=None), *others])
    assert not plain.numbers
    assert plain != scene
    sims = [kt.Simulation(each) for each in (scene, plain)]
    for sim in sims:
        sim.run(until=3.0)
    assert outcome(sims[0]) == outcome(sims[1])
    assert sims[0].number("BA777") == 2
    with pytest.raises(ValueError, match=r"no body of this scene is called 'AF132': .* did you mean 'AF123'"):
        sims[0].number("AF132")


def test_names_are_in_files_and_copies() -> None:
    walled = kt.with_obstacles(flights(), [kt.Obstacle(kt.box(0.5, 0.5), (3.0, 3.5))])
    assert walled.numbers == {"AF123": 0, "BA777": 3}
    for each in (flights(), walled):
        for again in (loads_scene(dumps_scene(each)), pickle.loads(pickle.dumps(each))):
            assert (again, again.numbers) == (each, each.numbers)


def test_a_file_may_call_bodies_by_names() -> None:
    text = dumps_scene(flights()).replace("turn = 0", 'turn = "AF123"')
    text = text.replace("remove = 2", 'remove = "BA777"')
    assert loads_scene(text) == flights()


def test_what_was_recorded_and_saved_has_the_names(tmp_path: Path) -> None:
    sim = kt.Simulation(flights(), live=True)
    sim.run(until=0.5)
    sim.insert((5.0, 3.5), radius=0.25)
    sim.save(tmp_path / "saved.kt")
    sim.run(until=3.0)
    assert sim.recorded().numbers == {"AF123": 0, "BA777": 2}
    resumed = kt.resume(tmp_path / "saved.kt")
    resumed.run(until=3.0)
    assert resumed.number("BA777") == 2
    assert outcome(resumed) == outcome(sim)


def test_a_body_that_was_inserted_by_hand_has_a_name(tmp_path: Path) -> None:
    sim = kt.Simulation(flights(), live=True)
    sim.run(until=1.25)
    assert sim.insert((5.0, 3.0), (0.0, 0.0), 0.25, name="EI1") == sim.number("EI1") == 3
    for taken, words in (("EI1", "name of body 3"), ("AF123", "name of body 0"), ("", "expected a name")):
        with pytest.raises(ValueError, match=words):
            sim.insert((3.0, 3.0), (0.0, 0.0), 0.25, name=taken)
    before = sim.snapshot()
    sim.insert((3.0, 3.0), (0.0, 0.0), 0.25, name="EI2")
    sim.restore(before)
    sim.save(tmp_path / "half.kt")
    for each in (sim, kt.resume(tmp_path / "half.kt")):
        assert each.recorded().numbers == {"AF123": 0, "BA777": 2, "EI1": 3}
        with pytest.raises(ValueError, match="did you mean 'EI1'"):
            each.number("EI")


def test_names_that_no_body_or_two_bodies_have_are_told() -> None:
    with pytest.raises(SceneError) as caught:
        flights(kt.Remove("BA778", 2.0), kt.Insert(3.0, (1.0, 3.0), (0.0, 0.0), 0.1, name="AF123"))
    message = str(caught.value)
    assert (
        "commands[5].body: found 'BA778'; expected a number, or a name of a body; did you mean 'BA777'?"
        in message
    )
    assert "commands[6].name: found 'AF123'; expected another name: it is the name of body 0" in message
    with pytest.raises(SceneError, match=r"names: found .*; expected one for each of the 2 bodies, or None"):
        flights(names=["AF123"])
    with pytest.raises(SceneError, match=r"names\[1\]: found 3; expected a name of its own, text"):
        flights(names=["AF123", 3])


def test_a_table_of_encounters_shows_names(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(dumps_scene(flights()))
    kinetile("run", str(tmp_path / "scene.toml"), "--until", "3", "--encounters", str(tmp_path / "met.csv"))
    rows = list(csv.DictReader((tmp_path / "met.csv").open()))
    assert [(row["a"], row["b"]) for row in rows] == [("AF123", "1")]
