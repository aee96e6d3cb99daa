"""Time without events passes in one step, and changes no bit of the later events."""

import math
import random
import re

import pytest

import kinetile as kt
from kinetile.kernel.images import remainder, turns_of
from kinetile.run import advance
from kinetile.run.engine import spans
from kinetile_accuracy.specification.certify import certify_log
from lanes import BUILT_IN, first


def slow(speed: float, **more: object) -> kt.Scene:
    velocity = [[speed, speed / 3], [-speed / 2, speed / 7], [0.0, 0.0]]
    return kt.Scene(
        [[0.2, 0.5], [0.7, 0.55], [0.5, 0.9]], velocity, [0.05, 0.05, 0.04], 1.0, (1.0, 1.0), **more
    )


def steps_of(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    moved: list[int] = []
    one = advance.move_base

    def counted(*arguments: object) -> None:
        moved.append(1)
        one(*arguments)

    monkeypatch.setattr(advance, "move_base", counted)
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
    monkeypatch.setattr(advance, "skip", lambda *_: 0)
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


def gas(speed: float, bodies: int, size: float = 1.0, seed: int = 0, **more: object) -> kt.Scene:
    """Discs on a square lattice, in directions of their own, none faster than ``speed``."""
    rng, side = random.Random(seed), math.isqrt(bodies - 1) + 1
    angles = [rng.uniform(0.0, math.tau) for _ in range(bodies)]
    speeds = [speed * rng.uniform(0.25, 1.0) for _ in range(bodies)]
    return kt.Scene(
        [
            [(k % side + rng.uniform(0.4, 0.6)) * size / side, (k // side + 0.5) * size / side]
            for k in range(bodies)
        ],
        [[s * math.cos(angle), s * math.sin(angle)] for s, angle in zip(speeds, angles, strict=True)],
        0.25 * size / side,
        arena=(size, size),
        **more,
    )


@pytest.mark.small
@pytest.mark.parametrize(
    ("speed", "bodies", "more"), first(1, [(1e-6, 25, {}), (1e-12, 2, {}), (1e-9, 2, {"periodic": "xy"})])
)
def test_a_failed_try_to_skip_kept_others_from_being_made(speed, bodies, more, monkeypatch):
    """Some 40 spans a contact passed one by one, each a step of Python."""
    moved = steps_of(monkeypatch)
    sim = kt.Simulation(gas(speed, bodies, **more), "naive")
    sim.run(1e30, max_contacts=10)
    assert len(moved) < 100


@pytest.mark.small
@pytest.mark.parametrize("seed", first(1, [1, 0, *range(2, 24)]))
def test_skipping_is_stepping(seed, monkeypatch):
    rng = random.Random(seed)
    speed, periodic = 2.0 ** rng.uniform(-15.0, -9.0), rng.choice(["", "xy", "x"])
    scene = gas(speed, rng.randint(2, 5), rng.choice([1.0, 0.7]), seed, periodic=periodic)
    until = 2.0 ** rng.uniform(13.0, 15.0) / (4.0 if periodic else 1.0)
    quick, slowly = kt.Simulation(scene, "cells"), kt.Simulation(scene, "naive")
    quick.run(until)
    monkeypatch.setattr(advance, "skip", lambda *_: 0)
    slowly.run(until)
    assert slowly.fingerprint == quick.fingerprint
    assert slowly.positions().tolist() == quick.positions().tolist()
    assert slowly.exact_time == quick.exact_time


@pytest.mark.small
@pytest.mark.parametrize(
    ("speed", "periodic"), first(3, [(1e-15, ""), (1.0, "xy"), (1e15, "xy"), (1e-3, "")])
)
def test_a_scene_is_as_fast_as_others_or_a_unit_is_advised_in_which_it_is(
    speed, periodic, monkeypatch, caplog
):
    scene, moved = gas(speed, 2, periodic=periodic), steps_of(monkeypatch)
    kt.Simulation(scene, "naive").run(1e3 / speed, max_contacts=400 if speed == 1e-3 else 40)
    told = re.findall(r"unit=2\.0\*\*(\d+)", caplog.text)
    assert len(told) == (speed < 1.0)
    if told:
        scene = scene.replace(unit=2.0 ** int(told[0]))
        moved.clear()
        kt.Simulation(scene, "naive").run(1e3 / speed, max_contacts=400 if speed == 1e-3 else 40)
    assert len(moved) <= 2


@pytest.mark.small
@pytest.mark.parametrize("periodic", ["", "xy"])
def test_slowness_is_a_matter_of_units(periodic):
    """In a unit that is as much longer as bodies are slower, contacts are the same to the tick."""
    fast, slower = gas(1.0, 5, periodic=periodic), 2.0**-70
    scene = fast.replace(velocity=fast.velocity * slower, unit=fast.time_unit / slower)
    one, other = kt.Simulation(fast, "naive"), kt.Simulation(scene, "cells")
    one.run(max_contacts=100)
    other.run(max_contacts=100)
    assert one.fingerprint == other.fingerprint
    assert certify_log(scene, other.contacts).wrong is None


@pytest.mark.small
def test_a_run_whose_bodies_get_nowhere_went_on_without_end():
    """Their flight in two spans is less than the rounding of the sum."""
    sim = kt.Simulation(gas(1e-9, 2, 1e10), "naive")
    with pytest.raises(kt.errors.Refused, match=r"too slow for the scene's unit, 1: .* unit=2\.0\*\*6\d$"):
        sim.run(1e30, max_contacts=5)
