"""What an event says of its contact: normal, closing speed and impulse, against the rows of the run."""

import math
from collections.abc import Callable
from contextlib import suppress
from itertools import islice

import numpy as np
import pytest

import kinetile as kt
from games import (
    draw_accelerated_game,
    draw_accelerated_game_of_shapes,
    draw_game,
    draw_game_of_shapes,
    draw_resting_game,
)
from kinetile.errors import KinetileError
from kinetile.kernel.plan import velocities_after
from lanes import examples

DRAWN = (
    draw_game,
    draw_game_of_shapes,
    draw_accelerated_game,
    draw_accelerated_game_of_shapes,
    draw_resting_game,
)
CONTACTS = ("wall", "disc", "pass", "part")
TWO = ("naive", "cells")


def played(scene: kt.Scene, phase: str) -> list[kt.Event]:
    """Returns the first events of a game, one by one."""
    events: list[kt.Event] = []
    with suppress(KinetileError):
        events.extend(islice(kt.Simulation(scene, phase).steps(scene.settings.until), 200))
    return events


def of_rows(scene: kt.Scene) -> list[list[np.ndarray] | None]:
    """Returns the velocities before and after each contact of a game, by the rows of its recording; None for
    a passing, and for the first row."""
    parts, sim = [np.zeros(0, kt.LOG)], kt.Simulation(scene, "naive")
    with suppress(KinetileError):
        sim.run(scene.settings.until, max_events=200, recorder=parts.append)
    trajectory = kt.Trajectory(np.concatenate(parts), scene)
    rows, found = trajectory.rows, []
    ticks = [epoch * 2**52 + tick for epoch, tick in rows[["epoch", "tick"]].tolist()]
    for row, (a, b, vx) in enumerate(rows[["a", "b", "avx"]].tolist()):
        if b < -4:
            continue
        if row == 0 or math.isnan(vx):
            found.append(None)
            continue
        earlier, later = (trajectory.plans_after(at, [a, b] if b >= 0 else [a]) for at in (row - 1, row))
        since = (ticks[row] - ticks[row - 1]) * 2.0**-52 * scene.time_unit
        flew = velocities_after(earlier.plan, earlier.elapsed + since)
        found.append([flew, velocities_after(later.plan, later.elapsed)])
    return found


@pytest.mark.parametrize("draw", DRAWN)
def test_events_say_what_the_rows_of_the_run_have(draw: Callable[[int], kt.Scene]):
    met = 0
    for seed in range(examples(12)):
        scene = draw(seed)
        events, others = (
            [event for event in played(scene, phase) if event.kind in CONTACTS] for phase in TWO
        )
        least = min(len(events), len(others))
        assert events[:least] == others[:least]
        for event, velocities in zip(events, of_rows(scene), strict=False):
            if event.kind == "part":
                assert event[-3:] == (None, None, None)
            elif event.kind == "pass":  # without impulse if one was put into the other
                assert event.impulse in (None, (0.0, 0.0))
            elif velocities is not None:
                agrees(scene, event, *velocities)
                met += 1


def agrees(scene: kt.Scene, event: kt.Event, before: np.ndarray, after: np.ndarray) -> None:
    """Compares an event with the velocities before and after it."""
    size = np.abs([*before, *after]).max() + 1.0
    assert event.normal is not None
    assert event.impulse is not None
    assert math.hypot(*event.normal) == pytest.approx(1.0, abs=1e-15)
    if len(before) == 1:
        before, after = (np.vstack([each, (0.0, 0.0)]) for each in (before, after))
    assert event.closing_speed == pytest.approx((before[0] - before[1]) @ event.normal, abs=1e-9 * size)
    masses = [scene.mass[body] if body < len(scene) else 1.0 for body in event.bodies]
    if not math.isnan(event.impulse[0]) and max(event.bodies) < len(scene):
        changes = zip((-1.0, 1.0), masses, before, after, strict=False)
        given = [sign * mass * (new - old) for sign, mass, old, new in changes if mass == min(masses)]
        if scene.resting and len(given) > 1:  # one that rests itself passes on what it receives
            given = [change for change in given if change.any()] or given
        assert event.impulse == pytest.approx(np.mean(given, axis=0), abs=1e-9 * size * min(masses))
    halts = any(response.name == "stop" for _, response in scene.responses)
    halts |= scene.resting and not after[masses.index(min(masses))].any()  # two supports hold it
    if not halts and not math.isnan(event.impulse[0]):
        (nx, ny), (jx, jy) = event.normal, event.impulse
        assert jx * ny - jy * nx == pytest.approx(0.0, abs=1e-9 * size)


def test_a_stomp_is_told_from_a_bump():
    hero = {"radius": 0.25, "arena": (8.0, 4.0), "kind": ["hero", "foe"]}
    for place, normal in (((4.0, 3.0), (0.0, -1.0)), ((2.0, 1.0), (1.0, 0.0))):
        scene, seen = kt.Scene([place, (4.0, 1.0)], [normal, (0.0, 0.0)], mass=[2.0, 1.0], **hero), []
        for key in (("hero", "foe"), ("foe", "hero")):
            kt.Simulation(scene).run(2.0, on_contact={key: seen.append})
        one, other = seen
        assert (one.bodies, one.normal, one.closing_speed) == ((0, 1), normal, 1.0)
        assert one.impulse == pytest.approx([4 / 3 * each for each in normal])
        assert (other.bodies, other.closing_speed) == ((1, 0), 1.0)
        assert [-each for each in other.normal] == [*one.normal]
        assert [-each for each in other.impulse] == [*one.impulse]


def test_what_passes_has_a_normal_and_no_impulse():
    for period, place, normal in (("", (3.0, 1.0), (1.0, 0.0)), ("x", (7.75, 1.0), (-1.0, 0.0))):
        scene = kt.Scene(
            [(1.0, 1.0), place],
            [(0.0, 0.0), (-normal[0], 0.0)],
            [0.5, 0.25],
            arena=(8.0, 2.0),
            periodic=period,
            kind=["sensor", "ball"],
            responses={("sensor", "ball"): "pass"},
        )
        events = [each for each in kt.Simulation(scene).steps(2.0) if each.kind == "pass"]
        assert [each[-3:] for each in events] == [(normal, 1.0, (0.0, 0.0))]


def test_an_event_to_come_has_no_impulse():
    sim = kt.Simulation(kt.Scene([(1.0, 1.0)], [(1.0, 0.0)], 0.5, arena=(4.0, 2.0)))
    assert sim.run(4.0, stop_at=kt.StopAt(before=True)).event[-3:] == (None, None, None)
    assert sim.next_event.impulse is None
    assert sim.step()[-3:] == ((1.0, 0.0), 1.0, (2.0, 0.0))


def test_two_immovable_ones_have_no_number_for_an_impulse():
    scene = kt.Scene([(1.0, 1.0), (3.0, 1.0)], [(1.0, 0.0), (-1.0, 0.0)], 0.5, mass=math.inf, responses={})
    event = next(each for each in kt.Simulation(scene).steps(2.0) if each.kind == "disc")
    assert (event.normal, event.closing_speed) == ((1.0, 0.0), 2.0)
    assert all(map(math.isnan, event.impulse))


def test_the_impulse_of_a_heavy_partner_was_lost_in_rounding():
    for heavy in (1e9, 1e17, math.inf):
        scene = kt.Scene([(1.0, 1.0), (2.25, 1.0)], [(1.0, 0.0), (1 / 3, 0.0)], 0.5, mass=[1.0, heavy])
        event = kt.Simulation(scene).run(5.0, stop_at=kt.StopAt()).event
        assert event.impulse == (pytest.approx(4 / 3, rel=2 / heavy + 1e-15), 0.0)
        assert {type(each) for each in (*event.normal, event.closing_speed, *event.impulse)} == {float}


def test_what_is_put_into_another_had_an_impulse_without_a_normal():
    scene = kt.Scene(
        [(1.0, 1.0)], [(0.0, 0.0)], 0.5, arena=(4.0, 2.0), kind=["sensor"],
        responses={("sensor", "ball"): "pass"},
        commands=[kt.Insert(0.5, (1.25, 1.0), (0.0, 0.0), 0.25, kind="ball")],
    )  # fmt: skip
    heard = []
    kt.Simulation(scene).run(1.0, on_contact=heard.append)
    stepped = [event for event in kt.Simulation(scene).steps(1.0) if event.kind == "pass"]
    assert heard == stepped
    assert heard[0][-3:] == (None, None, None)
