"""Loops for all features of scenes, compiled as users run them: their contacts follow the rules."""

from typing import Any

import pytest

import by_the_rules
import kinetile as kt
import kinetile_plugins
from agreement import choices
from kinetile.errors import Refused
from kinetile_plugins.responses import FAMILY
from lanes import BUILT_IN

PLACES = [(0.5 + i % 4, 0.5 + i // 4) for i in range(12)]
VELOCITIES = [((7 * i % 5 - 2) / 2, (3 * i % 7 - 3) / 4) for i in range(12)]
KINDS = [("ball", "wisp", "clay")[i % 3] for i in range(12)]
TURNS = [kt.Turn(0, 0.5, (1.0, -0.5)), kt.Turn(5, 0.75, (0.0, 1.0))]
LIVING = [kt.Remove(3, 0.25), kt.Insert(0.5, (3.5, 0.5), (-1.0, 0.25), 0.0625), kt.Remove(7, 1.0)]
RESPONSES = {
    ("clay", "*"): "stop",
    ("wisp", "wall"): "elastic",
    ("ball", "ball"): kt.Response("restitution", e=0.5, contact_time=0.015625),
    ("ball", "wall"): kt.Response("restitution", e=0.75, contact_time=0.015625),
}
PASSING = {("wisp", "ball"): "pass", ("wisp", "wisp"): "pass"}


def discs(**more: Any) -> kt.Scene:
    return kt.Scene(PLACES, radius=0.25, **({"velocity": VELOCITIES, "arena": (4.0, 3.0)} | more))


def boxes(**more: Any) -> kt.Scene:
    outlines = [kt.box(0.5, 0.25), kt.disc(0.25), kt.polygon([(-0.25, -0.25), (0.25, -0.25), (0.0, 0.25)])]
    numbers = [i % 3 for i in range(12)]
    return kt.Scene(PLACES, VELOCITIES, shape=numbers, shapes=outlines, **({"arena": (4.0, 3.0)} | more))


SCENES = {
    "walls": discs(),
    "open": discs(arena=None, velocity=[(2.0 - x, 1.0 - y) for x, y in PLACES]),
    "turns": discs(commands=TURNS),
    "living": discs(commands=[*TURNS, *LIVING]),
    "responses": discs(kind=KINDS, responses=RESPONSES),
    "passing": discs(kind=KINDS, responses=RESPONSES | PASSING, commands=TURNS),
    "periodic along x": discs(periodic="x"),
    "periodic": discs(periodic="xy"),
    "periodic, passing and living": discs(
        periodic="xy", kind=KINDS, responses=RESPONSES | PASSING, commands=LIVING
    ),
    "boxes": boxes(),
    "boxes on periodic axes": boxes(arena=(4.0, 3.5), periodic="xy"),
    "boxes with responses and turns": boxes(kind=KINDS, responses=RESPONSES, commands=TURNS),
}


def test_each_response_is_in_a_scene_here_and_its_hook_in_the_loops_of_all_rules() -> None:
    used = {each.name: each for scene in SCENES.values() for _, each in scene.responses}
    assert used.keys() == {each.name for each in kinetile_plugins.kinetile_responses()}
    for name, each in used.items():
        hook = kt.registry().target("response", name)(**each.options).prepare(SCENES["walls"]).respond
        assert hook is None or hook in FAMILY, name


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("phase", BUILT_IN)
@pytest.mark.parametrize("name", SCENES)
def test_a_compiled_loop_follows_the_rules(name: str, phase: str) -> None:
    scene = SCENES[name]
    if phase not in dict(choices(scene)):
        with pytest.raises(Refused):
            kt.Simulation(scene, phase)
        return
    wanted = by_the_rules.answer(scene, 40, int(4.0 / scene.time_unit * 2**52)).contacts
    sim = kt.Simulation(scene, phase)
    sim.run(until=4.0, max_contacts=40)
    assert by_the_rules.rows(sim) == wanted
    assert len(wanted) > 10
