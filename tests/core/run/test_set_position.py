"""Bodies that are moved, by hand and by commands of a scene (rule 11m)."""

import math
from pathlib import Path

import numpy as np
import pytest

import games
import kinetile as kt
from capabilities import outcome
from kinetile.errors import NoRoom, SceneError
from kinetile.records import EventRecorder, Trajectory
from kinetile.scene.files import dumps_scene, loads_scene
from kinetile_accuracy import certify_log
from lanes import GENERAL, first

PHASES = (*GENERAL, "sweep-tiling", "power")


def row(*commands: kt.Move, gates: str = "elastic") -> kt.Scene:
    """A body that flies to the right, towards two others that are at rest."""
    return kt.Scene(
        [[0.5, 0.5], [1.5, 0.5], [2.5, 0.5]],
        [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
        0.2,
        [1.0, math.inf, math.inf],
        arena=(4.0, 2.0),
        kind=["ball", "gate", "gate"],
        responses={("ball", "gate"): gates},
        commands=commands,
    )


def met(sim: kt.Simulation) -> list[tuple[float, int, int]]:
    return [(round(float(time), 6), a, b) for time, _, _, a, b in sim.contacts.tolist()]


def holds(sim: kt.Simulation, *phases: str) -> None:
    """Asserts that the record of a run is a scene with its contacts, and right."""
    scene = sim.recorded()
    assert loads_scene(dumps_scene(scene)) == scene
    for phase in phases or GENERAL:
        again = kt.Simulation(scene, phase)
        again.run()
        assert outcome(again) == outcome(sim), phase
    report = certify_log(scene, sim.contacts, until=sim.time, fingerprint=sim.fingerprint)
    assert report.right, report


@pytest.mark.parametrize("phase", PHASES)
def test_it_flies_on_from_there_with_its_velocity_and_its_number(phase: str) -> None:
    sim = kt.Simulation(row(), phase)
    sim.run(0.25)
    sim.set_position(0, (1.25, 1.5))
    sim.set_position(2, (2.5, 1.5))
    assert sim.positions()[[0, 2]].tolist() == [[1.25, 1.5], [2.5, 1.5]]
    assert sim.velocities()[0].tolist() == [1.0, 0.0]
    sim.audit()
    sim.run(2.0)
    assert met(sim) == [(1.1, 0, 2)]
    holds(sim, *PHASES)
    planned = kt.Simulation(row(kt.Move(0, 0.25, (1.25, 1.5)), kt.Move(2, 0.25, (2.5, 1.5))), phase)
    planned.run(2.0)
    assert outcome(planned) == outcome(sim)


def test_what_it_passes_ends_and_what_it_comes_to_begins() -> None:
    sim = kt.Simulation(row(gates="pass"), live=True)
    sim.run(1.0)
    sim.set_position(0, (2.25, 0.5))
    sim.set_position(1, (0.5, 1.5))
    sim.run(2.0)
    assert met(sim) == [(0.6, 0, 1), (1.0, 1, 0), (1.0, 0, 2), (1.65, 2, 0)]
    holds(sim)
    kinds = [event.kind for event in kt.Simulation(sim.recorded()).steps(until=2.0)]
    assert kinds == ["pass", "part", "move", "pass", "move", "part"]


@pytest.mark.parametrize("live", [False, True])
def test_without_room_it_stays_and_the_run_goes_on(live: bool) -> None:
    sim = kt.Simulation(row(), live=live)
    sim.run(0.25)
    before = outcome(sim)
    for place, why in (
        ((1.5, 0.75), r"no room for body 0 at \(1\.5, 0\.75\) .*: it reaches 0\.15 into body 1; nothing"),
        ((0.0, 1.0), "beyond the left wall"),
    ):
        with pytest.raises(NoRoom, match=why):
            sim.set_position(0, place)
        assert outcome(sim) == before
    assert sim.recorded().commands == ()
    sim.set_position(0, (0.8, 0.5))  # it may be where it is itself
    sim.run(1.0)
    holds(sim)
    planned = kt.Simulation(row(kt.Move(0, 0.5, (1.5, 0.75))))
    with pytest.raises(NoRoom, match=r"at time 0\.5 there is no room for body 0"):
        planned.run(1.0)
    assert planned.time == 0.5


def test_wrong_places_and_bodies_are_named() -> None:
    sim = kt.Simulation(row())
    with pytest.raises(ValueError, match=r"position of body 0 is \(1\.0, nan\); expected \[x, y\]"):
        sim.set_position(0, (1.0, math.nan))
    with pytest.raises(IndexError, match="there is no body 3"):
        sim.set_position(3, (1.0, 1.0))
    with pytest.raises(SceneError) as caught:
        row(kt.Move(0, 1.0, (5.0, 1.0)), kt.Move(7, 1.0, (1.0, 1.0)))
    assert "commands[0].position: found (5.0, 1.0); expected a place in [0.0, 4.0]" in str(caught.value)
    with pytest.raises(SceneError, match=r"commands\[0\]\.position: found nothing; expected \[x, y\]"):
        loads_scene(dumps_scene(row(kt.Move(0, 1.0, (1.0, 1.0)))).replace("position = [1.0, 1.0]", ""))


def test_a_record_has_it_at_both_places(tmp_path: Path) -> None:
    """On a periodic axis the periods that it has flown are counted from 0."""
    scene = row().replace(periodic="x", commands=[kt.Move(0, 0.75, (9.0, 1.5))])
    sim = kt.Simulation(scene)
    with EventRecorder(tmp_path / "events.parquet", scene) as recorder:
        sim.run(4.0, recorder=recorder)
    trajectory = Trajectory.read(tmp_path / "events.parquet")
    assert np.allclose(trajectory.positions(0.5)[0], [1.0, 0.5])
    for time in (0.75, 2.0, 4.0):
        again = kt.Simulation(scene, "cells")
        again.run(time)
        assert trajectory.positions(time).tolist() == again.positions().tolist()


def test_a_move_waits_in_a_saved_run_and_after_a_snapshot(tmp_path: Path) -> None:
    scene = row(kt.Move(0, 1.0, (0.5, 1.5)), kt.Move(1, 1.5, (3.5, 1.5)))
    sim = kt.Simulation(scene)
    sim.run(0.9)
    taken = sim.snapshot()
    sim.save(tmp_path / "saved.kt")
    sim.run(4.0)
    holds(sim)
    resumed = kt.resume(tmp_path / "saved.kt", "sap-1d")
    resumed.run(4.0)
    again = kt.Simulation(scene)
    again.restore(taken)
    again.run(4.0)
    assert outcome(resumed) == outcome(again) == outcome(sim)


def test_what_rests_on_it_falls_and_it_falls_itself() -> None:
    land = kt.Response("restitution", e=0.1, contact_time=1e-3, settle=0.5)
    scene = kt.Scene(
        [[2.0, 1.0], [2.0, 1.5], [0.5, 0.1]],
        [[0.0, 0.0]] * 3,
        mass=[math.inf, 1.0, 1.0],
        shapes=[kt.box(1.0, 0.2), kt.box(0.2, 0.2)],
        shape=[0, 1, 1],
        arena=(4.0, 4.0),
        gravity=(0.0, -1.0),
        responses={("*", "*"): land, ("*", "wall"): land},
    )
    sim = kt.Simulation(scene)
    sim.run(4.0)
    assert list(map(bool, sim.supports())) == [False, True, True]
    sim.set_position(0, (1.0, 3.0))
    sim.set_position(2, (1.0, 3.5))
    assert not any(sim.supports())
    sim.run(9.0)
    assert sim.positions()[1:].tolist() == [pytest.approx([2.0, 0.1]), pytest.approx([1.0, 3.2])]
    holds(sim)


@pytest.mark.parametrize("phase", GENERAL)
def test_far_away_in_the_open_plane_bodies_meet_at_their_ticks(phase: str) -> None:
    """The skin fitted the places at the start, and rounding grows with the distance."""
    scene = kt.Scene([[0.0, 0.0], [3.0, 0.0]], [[1.0, 0.1], [0.0, 0.3]], 0.5)
    sim = kt.Simulation(scene, phase)
    skin = float(sim.tables.clock[0].limits.skin)
    far = 1e9
    sim.set_position(0, (far, far / 3))
    sim.set_position(1, (far + 3.0, far / 3))
    body = sim.insert((far + 6.0, far / 3), (-1.0, 0.2), radius=0.5)
    sim.run(8.0)
    assert float(sim.tables.clock[0].limits.skin) > 1e6 * skin
    assert {(a, b) for _, a, b in met(sim)} >= {(0, 1), (1, body)}
    holds(sim)


@pytest.mark.parametrize("seed", first(2, range(300)))
def test_a_drawn_game_has_one_list_under_every_phase(seed: int) -> None:
    game = games.draw_moving_game(seed)
    one = games.play(game)
    for phase in GENERAL[1:]:
        assert games.play(game, phase) == one, phase
