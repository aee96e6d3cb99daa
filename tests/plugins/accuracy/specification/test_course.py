"""The course of events: its heap and its bounds against asking everybody, exactly, at every event."""

from __future__ import annotations

from itertools import islice, zip_longest

import numpy as np
import pytest

import kinetile as kt
from kinetile_accuracy.specification.arithmetic import (
    FlightPlan,
    anchored,
    exchanged,
    pair_tick,
    tick_of,
    unit_bits,
    wall_tick,
)
from kinetile_accuracy.specification.course import Course, CourseEvent

SPAN = 2**61


def course(scene, end):
    """Yield all events, with the plans after each."""
    found = Course(scene)
    while (event := found.next(end)) is not None:
        found.carry_out()
        yield event, states(found.plans)


def states(plans):
    return [(plan.x, plan.y, plan.vx, plan.vy, plan.anchor) for plan in plans]


def by_asking_everybody(scene, end):
    """Yield what ``course`` does: rules 7 to 9, with nothing kept but the plans and who has met whom."""
    whole = Course(scene)
    frame, tick, plans = whole.frame, whole.tick, whole.plans
    radii, masses = scene.radius.tolist(), scene.mass.tolist()
    times = [tick_of(each.time, scene.start, unit_bits(scene)) for each in scene.turns]
    turns = sorted(
        (at, each.body, k, each) for k, (at, each) in enumerate(zip(times, scene.turns, strict=True))
    )
    stamps, met, span = [0] * len(scene), {}, 1
    while True:
        coming = [(at, 2, body, index) for at, body, index, _ in turns[:1]]
        for a, plan in enumerate(plans):
            wall = wall_tick(plan, frame)
            coming += [] if wall is None else [(wall[0], 3, a, wall[1])]
            for b in range(a + 1, len(plans)):
                if met.get((a, b)) != (stamps[a], stamps[b]):
                    at = pair_tick(plan, plans[b])
                    coming += [] if at is None else [(at, 4, a, b)]
        while span * SPAN <= min([*(each[0] for each in coming), end]):
            old = [a for a, plan in enumerate(plans) if plan.anchor < (span - 1) * SPAN]
            if old:
                coming.append((span * SPAN, 1, old[0], 0))
                break
            span += 1
        at, kind, a, b = min(coming, default=(end + 1, 0, 0, 0))
        if at > end:
            return
        involved = (a, b) if kind == 4 else (a,)
        place = {
            body: [
                anchored(z, v, at - plans[body].anchor, tick)
                for z, v in zip((plans[body].x, plans[body].y), (plans[body].vx, plans[body].vy), strict=True)
            ]
            for body in involved
        }
        velocity = {body: (plans[body].vx, plans[body].vy) for body in involved}
        if kind == 2:
            velocity[a] = turns.pop(0)[3].velocity
        elif kind == 3:
            sign = (-1.0, 1.0) if b in (-1, -2) else (1.0, -1.0)
            velocity[a] = (velocity[a][0] * sign[0], velocity[a][1] * sign[1])
        elif kind == 4:
            both = None if len(set(masses)) == 1 else (masses[a], masses[b])
            velocity[a], velocity[b] = exchanged(
                (tuple(place[a]), tuple(place[b])), (velocity[a], velocity[b]), both
            )
        for body in involved:
            plans[body] = FlightPlan(*place[body], *velocity[body], at, radii[body], frame)
            stamps[body] += 1
        if kind == 4:
            met[a, b] = stamps[a], stamps[b]
        yield CourseEvent(at, a, {1: -6, 2: -5}.get(kind, b)), states(plans)


def slow_box(**more):
    """Three discs that meet a few times in many spans of the clock."""
    return kt.Scene(
        [[0.2, 0.3], [0.6, 0.7], [0.8, 0.2]],
        [[1e-3, 2e-4], [-5e-4, 1e-3], [0.0, 0.0]],
        0.1,
        arena=(1.0, 1.0),
        **more,
    )


SCENES = {
    "gas": (lambda: kt.make_scene("grid", bodies=16, density=0.5, seed=1), 1.0),
    "dilute gas": (lambda: kt.make_scene("grid", bodies=16, density=0.01, seed=2), 4.0),
    "lattice": (lambda: kt.make_scene("lattice"), 2.0),
    "cradle": (lambda: kt.make_scene("cradle"), 8.0),
    "spans": (lambda: slow_box(), 4000.0),
    "turns": (
        lambda: slow_box(
            turns=[
                (1, 700.0, (1e-3, -1e-3)),
                (0, 700.0, (0.0, 1e-3)),
                (1, 700.0, (1e-3, 1e-3)),
                (2, 512.0, (0.0, -2e-3)),
            ]
        ),
        4000.0,
    ),
    "masses": (
        lambda: kt.Scene(
            [[0.2, 0.3], [0.6, 0.7], [0.8, 0.2], [0.2, 0.8]],
            [[0.7, 0.2], [-0.5, 0.9], [0.1, 0.3], [0.3, -1.1]],
            [0.1, 0.15, 0.05, 0.12],
            mass=[1.0, 3.0, 0.1, 1e6],
            arena=(1.0, 1.0),
            start=3.7,
        ),
        60.0,
    ),
    "no walls": (
        lambda: kt.Scene(
            np.mgrid[0:4, 0:4].reshape(2, -1).T * 3.0,
            np.random.default_rng(5).normal(size=(16, 2)) - 0.4 * (np.mgrid[0:4, 0:4].reshape(2, -1).T - 1.5),
            1.0,
        ),
        2000.0,
    ),
    "fast": (lambda: kt.make_scene("grid", bodies=9, density=0.3, seed=3, speed=1e5), 1e-4),
}


@pytest.mark.parametrize("few", [1, 4])
@pytest.mark.parametrize("name", SCENES)
def test_the_next_event_is_that_of_asking_everybody(name, few, monkeypatch):
    monkeypatch.setattr("kinetile_accuracy.specification.course._FEW", few)
    made, until = SCENES[name]
    scene = made()
    end = tick_of(until, scene.start, unit_bits(scene))
    seen = []
    both = islice(zip_longest(course(scene, end), by_asking_everybody(scene, end)), 400)
    for found, right in both:
        assert found == right
        seen.append(min(found[0].b, 0))
    assert len(seen) > 10
    assert set(seen) >= {"turns": {0, -5, -6}, "spans": {0, -6}, "no walls": {0, -6}}.get(name, {0})


def test_bodies_that_are_barred_meet_again_only_with_another_plan():
    scene = kt.make_scene("grid", bodies=16, density=0.5)
    found = Course(scene)
    pairs = 0
    while pairs < 50:
        event = found.next(2**60)
        assert event is not None
        found.carry_out()
        if event.b >= 0:
            pairs += 1
            assert found.barred(event.a, event.b)
            assert found.barred(event.b, event.a)
            assert not any(
                found.barred(event.a, other) for other in range(len(scene)) if other not in event[1:]
            )


def test_without_bodies_nothing_happens():
    empty = kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), arena=(1.0, 1.0))
    assert Course(empty).next(2**63) is None
