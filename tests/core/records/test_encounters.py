"""``encounters``: passings as pairs, with begin, end and closest approach."""

import math
import random

import numpy as np
import pytest

import kinetile as kt
from kinetile.kernel.log import LOG

pytestmark = pytest.mark.small


def recorded(scene, until, phase="cells"):
    rows = []
    sim = kt.Simulation(scene, phase)
    sim.run(until, recorder=lambda some: rows.append(some.copy()))
    return kt.Trajectory(np.concatenate(rows) if rows else np.zeros(0, LOG), scene, until)


PASS = {"kind": "a", "responses": {("a", "a"): "pass"}}


def test_two_that_cross_are_closest_where_the_line_says():
    scene = kt.Scene([(1.0, 2.0), (3.0, 1.75)], [(1.0, 0.0), (-1.0, 0.0)], 0.25, arena=(4.0, 4.0), **PASS)
    (one,) = kt.encounters(recorded(scene, 2.5))
    half = math.sqrt(0.5**2 - 0.25**2) / 2
    assert (one["a"], one["b"], one["closest"], one["closest_time"]) == (0, 1, 0.25, 1.0)
    assert one["begin"] == pytest.approx(1.0 - half, abs=1e-15)
    assert one["duration"] == one["end"] - one["begin"] == pytest.approx(2 * half, abs=1e-15)


def test_one_that_is_under_way_has_no_end_and_one_that_turns_has_two_pieces():
    turns = [kt.Turn(0, 1.0, (0.0, 1.0))]
    scene = kt.Scene([(1.0, 2.0), (2.0, 2.0)], [(1.0, 0.0), (0.0, 0.0)], 0.5, commands=turns, **PASS)
    (one,) = kt.encounters(recorded(scene, 1.25))
    assert (one["closest"], one["closest_time"]) == (0.0, 1.0)
    assert math.isnan(one["end"])
    assert math.isnan(one["duration"])


def test_one_under_way_ended_with_the_last_row_and_not_where_the_recording_ends():
    scene = kt.Scene([(1.0, 2.0), (3.0, 2.0)], [(1.0, 0.0), (0.0, 0.0)], 0.5, **PASS)
    sim, rows = kt.Simulation(scene, "cells"), []
    sim.run(1.75, recorder=rows.append)
    trajectory = kt.Trajectory(np.concatenate(rows), sim.recorded())
    assert trajectory.end == 1.75
    (one,) = kt.encounters(trajectory)
    assert one[["begin", "closest", "closest_time"]].tolist() == (1.0, 0.25, 1.75)


def test_accelerated_bodies_are_closest_where_a_cubic_is_zero():
    """A thrown disc passes over one at rest: t^4/4 + ... is least at the top of the flight."""
    scene = kt.Scene(
        [(1.0, 1.0), (2.0, 1.75)], [(1.0, 1.0), (0.0, 0.0)], 0.5, arena=(4.0, 4.0), gravity=(0.0, -1.0),
        mass=[1.0, math.inf], **PASS,
    )  # fmt: skip
    (one,) = kt.encounters(recorded(scene, 2.0))
    time = np.linspace(one["begin"], one["end"], 20001)
    assert one["closest"] == pytest.approx(np.hypot(time - 1.0, time - time**2 / 2 - 0.75).min(), abs=1e-8)


def brute(scene, until):
    """All encounters of bodies in straight flight, by the roots of quadratics, an image at a time."""
    found, period = [], np.array(scene.periods)
    for a in range(len(scene)):
        for b in range(a + 1, len(scene)):
            for m in range(-9, 10) if period[0] else [0]:
                place = scene.position[b] - scene.position[a] + (m, 0) * period
                flies = scene.velocity[b] - scene.velocity[a]
                squares, middle = flies @ flies, -(place @ flies) / (flies @ flies)
                least = np.hypot(*(place + flies * middle))
                reach = scene.radius[a] + scene.radius[b]
                if least < reach:
                    half = math.sqrt((reach**2 - least**2) / squares)
                    begin = max(0.0, middle - half)
                    if middle + half > 0.0 and begin < until:
                        end = middle + half if middle + half < until else math.nan
                        at = min(max(middle, begin), until)
                        found.append((a, b, m, begin, end, np.hypot(*(place + flies * at)), at))
    return sorted(found, key=lambda each: each[3])


@pytest.mark.parametrize("periodic", ["", "x"])
def test_drawn_flights_have_the_encounters_of_their_lines(periodic):
    rng = random.Random(1)
    places = [(rng.uniform(0, 8), rng.uniform(30, 40)) for _ in range(20)]
    flies = [(rng.uniform(-2, 2), rng.uniform(-1, 1)) for _ in range(20)]
    frame = {"arena": (8.0, 80.0), "periodic": "x"} if periodic else {}
    scene = kt.Scene(places, flies, 0.5, **PASS, **frame)
    found, wanted = kt.encounters(recorded(scene, 10.0)), brute(scene, 10.0)
    assert len(found) == len(wanted) > 10
    names = ["a", "b", "mx", "begin", "end", "closest", "closest_time"]
    for one, two in zip(found[names].tolist(), wanted, strict=True):
        assert one[:3] == two[:3]
        assert one[3:] == pytest.approx(two[3:], abs=1e-9, nan_ok=True)


def test_a_plan_that_begins_between_two_doubles_of_time_is_not_read_too_late():
    # The time of a row is rounded: half of all pieces after a contact were read with the plan before it.
    rng = np.random.default_rng(5)
    place, way = rng.uniform(0.5, 3.5, (8, 2)), rng.normal(size=(8, 2))
    trajectory = recorded(kt.Scene(place, way, 0.4, arena=(4.0, 4.0), **PASS), 20.0)
    found = kt.encounters(trajectory)
    assert len(found) > 50
    for one in found[~np.isnan(found["end"])]:
        times = np.linspace(one["begin"], one["end"], 200)
        apart = [np.hypot(*np.diff(trajectory.positions(t)[[one["a"], one["b"]]], axis=0)[0]) for t in times]
        assert one["closest"] == pytest.approx(min(apart), abs=np.abs(np.diff(apart)).max(initial=1e-9))
        assert one["closest"] <= min(apart) + 1e-12


@pytest.mark.parametrize("command", [kt.Remove(1, 1.0), kt.Move(1, 1.0, (3.5, 0.5))], ids=["gone", "moved"])
def test_the_last_body_may_go_while_it_passes_another(command):
    places, ways = [(1.0, 2.0), (1.25, 2.0)], [(0.0, 0.0), (0.0625, 0.0)]
    scene = kt.Scene(places, ways, 0.5, arena=(4.0, 4.0), commands=[command], **PASS)
    (one,) = kt.encounters(recorded(scene, 2.0))
    assert one[["begin", "end", "closest", "closest_time"]].tolist() == (0.0, 1.0, 0.25, 0.0)
