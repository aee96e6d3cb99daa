"""Convex bodies under commands and responses: turns, removals, restitution, stops and obstacles.

Every phase gives one answer, whatever is done to the run: commands of the scene or by hand, audits,
snapshots, saving, copies.
"""

from __future__ import annotations

import copy
import math
import pickle
import random
from pathlib import Path

import pytest

import box_scenes
import convex_scenes
import kinetile as kt
from kinetile.errors import ZenoError
from lanes import first

PHASES = ("naive", "cells", "sap-1d", "sap-2d")
RULES = {
    ("brick", "brick"): kt.Response("restitution", e=0.75, contact_time=1e-3),
    ("brick", "clay"): "stop",
    ("clay", "wall"): kt.Response("restitution", e=0.5, contact_time=1e-3),
}


def commanded(seed: int) -> kt.Scene:
    """Returns a drawn scene with kinds, responses, bodies that nothing moves, turns and removals."""
    rng, scene = random.Random(-seed - 1), (convex_scenes if seed % 2 else box_scenes).drawn(seed)
    bodies = list(range(len(scene)))
    mass = [math.inf if rng.random() < 0.2 else each for each in scene.mass.tolist()]
    rest = rng.random() < 0.5  # obstacles, or immovable bodies that fly
    velocity = [
        (0.0, 0.0) if rest and one == math.inf else v
        for one, v in zip(mass, scene.velocity.tolist(), strict=True)
    ]
    gone = rng.sample(bodies, rng.randrange(0, len(bodies)))
    commands: list[kt.Turn | kt.Remove] = [kt.Remove(each, rng.choice((1.0, 3.0))) for each in gone[:2]]
    for _ in range(rng.randrange(1, 6)):
        body = rng.choice([each for each in bodies if each not in gone])
        turned = rng.choice((-1.0, 0.0, 0.5)), rng.choice((-0.5, 0.0, 1.0))
        commands.append(kt.Turn(body, rng.choice((0.5, 1.0, rng.uniform(0, 4))), turned))
    return scene.replace(
        velocity=velocity,
        mass=mass,
        commands=sorted(commands, key=lambda each: each.time),
        kind=[rng.choice(("brick", "brick", "clay", "glass")) for _ in bodies],
        kinds=("brick", "clay", "glass"),
        responses=RULES,
    )


def ran(sim: kt.Simulation) -> str:
    """Returns the fingerprint of a run of a scene, up to a number of contacts, or to a Zeno error."""
    try:
        sim.run(until=10.0, max_contacts=60)
    except ZenoError as error:
        return f"{type(error).__name__}: {sim.contacts.tobytes().hex()}"
    return sim.fingerprint


@pytest.mark.parametrize("seed", first(6, range(40)))
def test_one_answer_under_commands_and_responses(seed):
    scene = commanded(seed)
    audit = 1 if seed % 5 == 0 else None
    answers = {phase: ran(kt.Simulation(scene, phase, audit=audit)) for phase in PHASES}
    assert len(set(answers.values())) == 1, answers


def by_hand(seed: int, phase: str, folder: Path) -> tuple[str, kt.Simulation]:
    """Returns how a run ends in which each leap is followed by a turn, by a removal, by nothing, or by the
    simulation's being taken up again from a copy, a pickle, a snapshot, a file; and the simulation."""
    rng, scene = random.Random(seed), commanded(seed)
    sim = kt.Simulation(scene.replace(commands=[each for each in scene.commands if len(scene) > 3]), phase)
    try:
        for leap in range(8):
            sim.run(until=0.75 * (leap + 1), max_contacts=12)
            body = rng.choice(sim.bodies.tolist())
            what = rng.choice(("turn", "turn", "remove", "copy", "back", "file", "none"))
            if what == "turn":
                sim.set_velocity(body, (rng.choice((0.0, 0.5)), rng.choice((-1.0, 0.0, 0.25))))
            elif what == "remove" and len(sim.bodies) > 2 and not scene.commands:
                sim.remove(body)
            elif what == "copy":
                sim = pickle.loads(pickle.dumps(copy.deepcopy(sim)))
            elif what == "back":
                here = sim.snapshot()
                sim.run(max_contacts=5, until=sim.time + 1.0)
                sim.restore(here)
            elif what == "file":
                sim.save(folder / f"{phase}.kt")
                sim = kt.resume(folder / f"{phase}.kt")
            sim.audit()
    except ZenoError as error:
        return f"{type(error).__name__}: {sim.contacts.tobytes().hex()}", sim
    return sim.fingerprint, sim


@pytest.mark.parametrize("seed", first(3, range(1000, 1020)))
def test_one_answer_under_commands_by_hand(seed, tmp_path):
    found = {phase: by_hand(seed, phase, tmp_path) for phase in PHASES}
    assert len({ending for ending, _ in found.values()}) == 1
    ending, sim = found["cells"]
    if ending == sim.fingerprint:
        kt.save_scene(sim.recorded(), tmp_path / "recorded.toml")
        again = kt.Simulation(kt.load_scene(tmp_path / "recorded.toml"), "sap-1d")
        again.run()
        assert again.fingerprint == sim.fingerprint
        assert (again.positions() == sim.positions()).all()


def test_circles_that_overlap_are_no_passing():
    """Bodies of a scene with responses, whose circles overlap though they do not."""
    scene = kt.Scene(
        [(1.0, 1.0), (1.0, 2.0)],
        [(0.0, 0.0), (0.0, -1.0)],
        shape=kt.box(2.0, 0.5),
        arena=(4.0, 4.0),
        responses="stop",
    )
    sim = kt.Simulation(scene, "cells")
    sim.run(until=2.0)
    assert sim.contacts[["time", "a", "b"]].tolist() == [(0.5, 0, 1)]
    assert (sim.velocities() == 0.0).all()
    assert sim.readings.passings == 0


def test_losses_are_along_the_face_alone():
    back = kt.Response("restitution", e=0.5, contact_time=1e-6)
    scene = kt.Scene(
        [(1.0, 1.0), (4.0, 1.5)],
        [(1.0, 0.25), (0.0, 0.0)],
        mass=[1.0, math.inf],
        shape=kt.box(1.0, 1.0),
        responses=back,
    )
    sim = kt.Simulation(scene, "cells", audit=1)
    sim.run(until=4.0)
    assert sim.velocities().tolist() == [[-0.5, 0.25], [0.0, 0.0]]
