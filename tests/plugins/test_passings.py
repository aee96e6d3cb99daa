"""Bodies of any shape that pass: who begins at once, and what steps, stops and rewound runs have."""

import math
import random

import pytest

import kinetile as kt
from fresh_scenes import fresh
from kinetile_accuracy.specification.course import Course
from kinetile_accuracy.specification.shapes import Difference, room
from lanes import first

PASS = {("ball", "wisp"): "pass"}
SHAPES = (kt.box(0.5, 0.25), kt.disc(0.25), kt.polygon([(-0.3, -0.2), (0.4, -0.1), (0.1, 0.5)], 0.1))
PERIOD = 4.0


def at_the_edge(rng: random.Random, shapes: list[kt.Shape], discs: bool) -> tuple[float, float]:
    """Returns the distances of two bodies in some direction when they begin to pass, or do not, by a last
    bit."""
    turn = rng.choice((rng.uniform(0.0, 6.3), 0.5 * math.pi * rng.randrange(4)))
    x, y = math.cos(turn), math.sin(turn)
    allowed = 1e-12 * sum(shape.reach for shape in shapes)
    together, difference = sum(shape.radius for shape in shapes), Difference(*shapes)
    low, high = 0.0, 3.0
    while low < (middle := 0.5 * (low + high)) < high:
        at = middle * x, middle * y
        apart = math.hypot(*at) - together if discs else room(difference, at)
        low, high = (middle, high) if apart < -allowed else (low, middle)
    return low * x, low * y


@pytest.mark.parametrize("seed", first(8, range(400)))
def test_who_begins_is_one_rule_at_the_start_at_an_insertion_and_for_questions(seed):
    """Rules 11, 11p and 11s: by a start, by an insertion there, by the certifier, and before a run."""
    rng = random.Random(seed)
    for discs in (True, False):
        shapes = [kt.disc(0.25), kt.disc(0.5)] if discs else [rng.choice(SHAPES) for _ in range(2)]
        periodic = rng.choice(("", "", "x", "xy"))
        away = at_the_edge(rng, shapes, discs)
        here = (0.0, 0.0) if not periodic else (rng.choice((0.1, 2.0, 3.9)), 2.0)
        there = tuple(
            a + b + rng.choice((0.0, 0.0, 0.0, 2.0**-52, -(2.0**-52)))
            for a, b in zip(here, away, strict=True)
        )
        if periodic:
            there = (there[0] + rng.choice((-PERIOD, 0.0, PERIOD)), there[1])
        frame = {
            "responses": PASS,
            "kinds": ["ball", "wisp"],
            "arena": (PERIOD, PERIOD) if periodic else None,
        }
        frame |= {"periodic": periodic}
        sizes = {"radius": [0.25, 0.5]} if discs else {"shape": [0, 1], "shapes": shapes}
        one = {"radius": 0.25} if discs else {"shape": 0, "shapes": shapes}
        size = {"radius": 0.5} if discs else {"shape": shapes[1]}
        started = kt.Scene([here, there], [(0, 0), away], kind=["ball", "wisp"], **sizes, **frame)
        coming = kt.Insert(0.0, there, away, body=1, kind="wisp", **size)
        inserted = kt.Scene(
            [here], [(0, 0)], kind="ball", commands=[coming], unit=started.time_unit, **one, **frame
        )
        event = Course(started).next(0)
        begins = event is not None and (event.a, event.b) == (0, 1)
        before = kt.Simulation(started, "naive").next_contact(0, 1)
        assert (before is not None and before.tick == 0 and before.a == 0) == begins
        for scene in (started, inserted):
            sim = kt.Simulation(scene, "naive", audit=1)
            sim.run(until=2.0**-30)
            assert bool(len(sim.contacts)) == begins, (scene, away)


def test_an_insertion_into_bodies_that_it_passes_hung_under_a_phase_that_is_built_anew():
    scene, *_ = fresh(32)
    assert len(scene.commands) > 0
