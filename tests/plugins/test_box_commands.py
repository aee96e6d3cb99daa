"""Boxes under commands and responses: turns, removals, restitution, stops and immovable boxes.

Every phase gives one answer, whatever is done to the run: commands of the scene or by hand, audits, snapshots,
saving, copies.
"""

from __future__ import annotations

import math
import pickle
import random

import pytest

import box_scenes
import kinetile as kt
from kinetile.errors import ZenoError
from lanes import first

PHASES = ("naive", "cells", "sap-1d", "sap-2d")
RULES = {
    ("brick", "brick"): kt.Response("restitution", e=0.75, contact_time=1e-3),
    ("brick", "clay"): "stop",
    ("clay", "wall"): kt.Response("restitution", e=0.5, contact_time=1e-3),
}
UNTIL, MOST = 10.0, 60


def commanded(seed: int) -> kt.Scene:
    """Returns a drawn scene with kinds, responses, bodies that nothing moves, turns and removals."""
    rng, scene = random.Random(-seed - 1), box_scenes.drawn(seed)
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


def simulation(scene: kt.Scene, phase: str, **more) -> kt.Simulation:
    """Returns a simulation whose loop serves all scenes with an arena, or all without one."""
    general = {"general": True}
    narrow = {"boxes": general} | ({"wall": general} if scene.arena else {})
    return kt.Simulation(scene, phase, narrow_phases=narrow, **more)


def ran(sim: kt.Simulation, most: int = MOST) -> str:
    """Returns the fingerprint of a run of a scene, up to a number of contacts, or to a Zeno error."""
    try:
        sim.run(until=UNTIL, max_contacts=most)
    except ZenoError as error:
        return f"{type(error).__name__}: {sim.contacts.tobytes().hex()}"
    return sim.fingerprint


@pytest.mark.small
@pytest.mark.parametrize("seed", first(6, range(200)))
def test_one_answer_under_commands_and_responses(seed):
    scene = commanded(seed)
    audit = 1 if seed % 5 == 0 else None
    answers = {phase: ran(simulation(scene, phase, audit=audit)) for phase in PHASES}
    assert len(set(answers.values())) == 1, answers
