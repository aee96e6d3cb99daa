"""Time in which nothing happens passes in one step, and changes no bit of what comes after it."""

import math
import random

import pytest

import kinetile as kt
from kinetile.kernel.images import remainder, turns_of
from kinetile.run.engine import engine, spans
from lanes import BUILT_IN, first


def slow(speed: float, **more: object) -> kt.Scene:
    velocity = [[speed, speed / 3], [-speed / 2, speed / 7], [0.0, 0.0]]
    return kt.Scene(
        [[0.2, 0.5], [0.7, 0.55], [0.5, 0.9]], velocity, [0.05, 0.05, 0.04], 1.0, (1.0, 1.0), **more
    )


def steps_of(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    moved: list[int] = []
    one = engine.Engine.move_base

    def counted(*arguments: object) -> None:
        moved.append(1)
        one(*arguments)

    monkeypatch.setattr(engine.Engine, "move_base", counted)
    return moved


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_each_empty_span_cost_a_step_of_python(phase, monkeypatch):
    """Two million spans for ten contacts, which would have taken minutes; now some hundred steps."""
    moved = steps_of(monkeypatch)
    sim = kt.Simulation(slow(2.0**-30), phase)
    sim.run(1e30, max_contacts=10)
    assert len(sim.contacts) == 10
    assert sim.exact_time[0] // 512 > 1e6
    assert len(moved) < 5000


@pytest.mark.parametrize("until", first(1, [None, 3e4 + 0.125]))
def test_skipped_time_leaves_the_same_bits(until, monkeypatch):
    commands = [kt.Turn(0, 10_000.5, (2.0**-16, 0.0)), kt.Remove(2, 20_000.25)]
    scene = slow(2.0**-14, commands=commands)
    quick = kt.Simulation(scene, "cells")
    quick.run(until, max_contacts=6 if until is None else None)
    monkeypatch.setattr(engine.Engine, "skip", lambda *_: 0)
    slowly = kt.Simulation(scene, "naive")
    slowly.run(until, max_contacts=6 if until is None else None)
    assert slowly.fingerprint == quick.fingerprint
    assert slowly.exact_time == quick.exact_time
    assert (slowly.positions() == quick.positions()).all()
    assert (slowly.velocities() == quick.velocities()).all()
    assert slowly.next_event == quick.next_event


def test_anchors_are_rows_so_nothing_is_skipped_where_rows_are_recorded(monkeypatch):
    moved = steps_of(monkeypatch)
    sim = kt.Simulation(slow(2.0**-20), "cells")
    rows = []
    sim.run(20_000.0, recorder=lambda part: rows.extend(part.tolist()))
    assert len(moved) == 39
    assert len(rows) > 2 * 18


@pytest.mark.parametrize("seed", first(1, range(8)))
def test_many_sums_in_a_few_operations_are_those_one_by_one(seed):
    """Ties, places at 0 and at powers of two, subnormal numbers, steps that are lost; with and without
    periods."""
    rng = random.Random(seed)
    for _ in range(40):
        period = rng.choice([0.0, 0.0, 1.0, 0.7, 1e5])
        place = rng.choice(
            [rng.uniform(-0.35, 0.35), 0.0, 0.25, rng.uniform(-0.5, 0.5) * 2.0 ** -rng.randint(0, 1070)]
        )
        step = rng.choice([1, -1]) * rng.choice(
            [
                rng.uniform(0.5, 1.0) * 2.0 ** -rng.randint(0, 58),
                rng.randint(1, 9) * 2.0 ** -rng.randint(1, 56),
                math.ulp(place) * (rng.randint(0, 8) + 0.5),
            ]
        )
        times = rng.randint(0, 1500)
        found = spans.flown(place, step, times, period)
        turned = 0
        for _ in range(times):
            place += step
            turns = turns_of(place, period)
            place, turned = remainder(place, period, turns), turned + int(turns)
        assert found == (place, turned)
