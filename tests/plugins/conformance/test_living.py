"""Living scenes: the play of a state machine is a scene that any phase runs; failures lose commands."""

from itertools import islice

import pytest

from kinetile.run.compose import CommandSupport
from kinetile.run.simulation import composition_of
from kinetile.scene import Insert, Remove, Scene, Turn
from kinetile_conformance.cases import Subject, is_living
from kinetile_conformance.checks import CHECKS, check_named, table
from kinetile_conformance.drawing import Drawing, reduced
from kinetile_conformance.strategies.kinds import BUILT, acceptable
from kinetile_conformance.strategies.living import STARTS, played
from kinetile_conformance.strategies.swarms import scaled


@pytest.mark.slow
@pytest.mark.small
@pytest.mark.parametrize(
    "kind", [each if each == "living" else pytest.param(each, marks=pytest.mark.slow) for each in STARTS]
)
def test_the_same_number_plays_the_same_scenes_with_commands_of_all_kinds(kind):
    scenes = list(islice(played(kind, 3), 3))
    assert scenes == list(islice(played(kind, 3), 3))
    given = {type(command) for scene in scenes for command in scene.commands}
    assert given == {Insert, Remove, Turn}


@pytest.mark.small
def test_scenes_of_all_kinds_have_one_loop_and_a_slot_for_each_body_where_none_comes():
    alike = Scene([[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]], 0.5, arena=(4.0, 4.0))
    scenes = [
        alike,
        alike.replace(radius=[0.5, 0.25]),
        alike.replace(mass=[1.0, 2.0]),
        alike.replace(commands=[Remove(0, 1.0)]),
    ]
    sims = [Subject("sap-1d", {}).simulation(scene) for scene in scenes]
    assert len({composition_of(sim).loop(CommandSupport.ALL) for sim in sims}) == 1
    assert [len(sim.tables.bodies) for sim in sims[:3]] == [2, 2, 2]
    assert len(sims[3].tables.bodies) > 2


@pytest.mark.slow
@pytest.mark.small
def test_a_phase_that_is_built_anew_for_each_command_sees_the_beginning_of_a_long_scene():
    scene = next(each for each in played("living") if len(each.commands) > 2 * BUILT)
    assert acceptable(Subject("cells", {}), scene) is scene
    beginning = acceptable(Subject("naive", {}), scene)
    assert beginning.commands == scene.commands[: len(beginning.commands)]
    assert BUILT < len(beginning.commands) < len(scene.commands)
    assert beginning.settings.until >= beginning.commands[-1].time


@pytest.mark.small
def test_living_scenes_are_played_once_for_all_checks():
    drawing = Drawing(10, 0)
    first = list(drawing.scenes(check_named("same-contacts-as-bodies-come-and-go")))
    others = drawing.scenes(check_named("its-structure-is-true-as-bodies-come-and-go"))
    assert next(others) is first[0]


@pytest.mark.small
def test_of_hundreds_of_commands_those_that_matter_are_left():
    scene = next(each for each in played("living") if sum(isinstance(c, Insert) for c in each.commands) > 20)
    wanted = [command for command in scene.commands if isinstance(command, Insert)][9].position

    def fails(other):
        return any(isinstance(each, Insert) and each.position == wanted for each in other.commands)

    small = reduced(scene, fails, 20.0)
    assert len(small.commands) == 1
    assert len(small) <= 1


def test_scaled_swarms_are_far_away_fast_and_small():
    scenes = [scaled(number) for number in range(30)]
    assert not any(map(is_living, scenes))
    assert max(float(abs(scene.velocity).max()) for scene in scenes) > 2.0**30
    sizes = [float(abs(scene.position).max() / scene.radius.max()) for scene in scenes]
    assert max(sizes) > 2.0**40


def test_the_table_has_every_check_once():
    rows = table(100)
    assert sorted(name for _, _, name in rows) == sorted(check.name for check in CHECKS)
    assert len({strategy for strategy, _, _ in rows}) >= 14
