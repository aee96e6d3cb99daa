"""From rows back to motion: positions and velocities are the run's, to the last bit."""

import tracemalloc

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import RecordError
from kinetile.records import Trajectory, positions_at
from kinetile.records.log import Seal
from lanes import first
from messages import table
from player_pages import SCENES, record

pytest.importorskip("pyarrow")


@pytest.mark.parametrize("name", first(2, sorted(SCENES, key=lambda name: name != "accelerated")))
def test_positions_and_velocities_are_those_of_the_run(name):
    scene = SCENES[name]
    trajectory = Trajectory(record(kt.Simulation(scene, "naive"), scene.start + 1.5), scene)
    again = kt.Simulation(scene, "naive")
    for time in np.array([0.0, 2.0**-10, 0.3, 0.5, 1.0, 1.359, 1.5]) + scene.start:
        again.run(time)
        assert trajectory.positions(time).tobytes() == again.positions().tobytes()
        assert trajectory.velocities(time).tobytes() == again.velocities().tobytes()
        assert trajectory.accelerations(time).tobytes() == again.accelerations().tobytes()


def test_a_body_inserted_by_hand_has_the_acceleration_of_its_row():
    scene = SCENES["accelerated"]
    sim, parts = kt.Simulation(scene, "naive"), []
    sim.run(0.25, recorder=parts.append)
    body = sim.insert((0.3, 0.55), (0.2, -0.1), 0.05, acceleration=(0.25, -1.0))
    sim.run(0.5, recorder=parts.append)
    sim.set_acceleration(body, (-0.5, 0.75))
    sim.run(1.0, recorder=parts.append)
    trajectory = Trajectory(np.concatenate(parts), scene)
    for time, pull in ((0.375, (0.25, -1.0)), (0.75, (-0.5, 0.75))):
        assert trajectory.accelerations(time)[list(trajectory.bodies(time)).index(body)].tolist() == [*pull]
    assert trajectory.positions(1.0).tobytes() == sim.positions().tobytes()
    assert trajectory.velocities(1.0).tobytes() == sim.velocities().tobytes()


@pytest.mark.parametrize("axes", first(1, ["xy", "x", "y"]))
def test_places_without_periods_are_those_of_the_run(axes):
    made = kt.make_scene("grid", bodies=9, density=0.3, seed=3, periodic=axes)
    away = np.array([5.0 * ("x" in axes), -2.0 * ("y" in axes)]) * made.arena
    place = made.position + away * (np.arange(9) % 3 == 0)[:, None]
    back = kt.Insert(0.25, tuple(place[3] - 3.0 * away), (-9.0, 2.0), 1e-4)
    scene = made.replace(position=place, commands=[kt.Remove(3, 0.2), back])
    trajectory = Trajectory(record(kt.Simulation(scene, "naive"), 1.0), scene)
    again = kt.Simulation(scene, "naive")
    for time in (0.0, 0.1, 0.25, 0.5, 1.0):
        again.run(time)
        assert trajectory.unwrapped(time).tobytes() == again.unwrapped().tobytes()


def test_an_event_counts_at_its_own_tick():
    scene = kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.5)
    trajectory = Trajectory(record(kt.Simulation(scene, "naive"), 1.0), scene)
    assert trajectory.velocities(np.nextafter(0.5, 0.0)).tolist() == [[1.0, 0.0], [-1.0, 0.0]]
    assert trajectory.velocities(0.5).tolist() == [[-1.0, 0.0], [1.0, 0.0]]
    assert trajectory.positions(0.5).tolist() == [[1.5, 1.0], [2.5, 1.0]]


def test_a_run_longer_than_the_kernels_own_clock():
    scene = kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[0.001, 0.0], [0.0, 0.0]], 0.25, arena=(4, 4))
    trajectory = Trajectory(record(kt.Simulation(scene, "naive"), 6000.0), scene)
    again = kt.Simulation(scene, "naive")
    for time in (1400.0, 1500.0, 3000.1, 6000.0):
        again.run(time)
        assert trajectory.positions(time).tobytes() == again.positions().tobytes()


def test_a_scene_without_events_or_bodies():
    empty = kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 1.0)
    assert positions_at(np.zeros(0, kt.LOG), empty, 3.0).shape == (0, 2)
    alone = kt.Scene([[1.0, 2.0]], [[0.5, 0.0]], 1.0)
    assert positions_at(np.zeros(0, kt.LOG), alone, 3.0).tolist() == [[2.5, 2.0]]


def test_a_file_that_says_what_it_misses_is_no_trajectory(tmp_path):
    scene = SCENES["grid"]
    path = tmp_path / "e.parquet"
    with kt.EventRecorder(path, scene) as recorder:
        recorder.begin(None, 12)
        recorder.begin(None, 12)
    for read in (Trajectory.read, lambda path: positions_at(path, scene, 1.0)):
        with pytest.raises(RecordError, match="12 events of the run were not given to its recorder"):
            read(path)


@pytest.mark.parametrize(
    ("recorded", "ends", "inserts", "plays", "says"),
    [
        ((0, 2), 7.0, False, True, "between time 0.0 and time 6.25: body 0 is not where the scene"),
        ((0, 1), 5.0, False, True, "between time 0.0 and time 5.0: 5 of 6 contacts are in them"),
        ((0,), 5.0, True, True, "between time 0.0 and time 5.0: the scene's command for body 3 is not in"),
        (
            (2,),
            5.0,
            False,
            False,
            "between time 0.0 and time 4.0: body 2 and body 1 begin or end to pass each",
        ),
    ],
)
def test_rows_of_some_of_the_runs_were_taken_for_the_whole_motion(recorded, ends, inserts, plays, says):
    rules = {"kind": ["car", "car", "zone"], "responses": {("car", "zone"): "pass"}}
    scene = kt.Scene([(1, 1), (1, 3), (3, 3)], [(1, 0), (1, 0), (0, 0)], 0.25, arena=(4.0, 4.0), **rules)
    sim, rows = kt.Simulation(scene, "cells", live=True), [np.zeros(0, kt.LOG)]
    for run, until in enumerate((0.5, 3.0, ends)):
        sim.run(until, recorder=rows.append if run in recorded else None)
        if inserts and run == 0:
            sim.insert((3.5, 0.5), (0.0, 2.0), 0.125, kind="car")
    with pytest.raises(RecordError, match=says):
        kt.encounters(Trajectory(np.concatenate(rows), sim.recorded() if plays else scene))


@pytest.mark.parametrize("name", ["still", "falling"])
def test_a_body_may_be_moved_before_anything_happens_to_it(name, tmp_path):
    # The reader expected the move at the place where the scene had sent the body.
    more = {"gravity": (0.0, -1.0)} if name == "falling" else {}
    scene = kt.Scene(
        [(1.0, 2.0)], [(0.25, 0.0)], 0.25, arena=(4.0, 4.0), commands=[kt.Move(0, 0.5, (3.0, 3.0))], **more
    )
    sim, path = kt.Simulation(scene), tmp_path / "e.parquet"
    with kt.EventRecorder(path, scene) as recorder:
        sim.run(until=1.0, recorder=recorder)
    assert Trajectory.read(path).positions(1.0).tolist() == sim.positions().tolist()


NO_ROWS, PLANE = np.zeros(0, kt.LOG), SCENES["no walls"]
test_message = table(globals())


def test_a_trajectory_took_ten_times_the_memory_of_its_rows():
    rows = np.zeros(1 << 18, kt.LOG)
    rows["time"] = rows["epoch"] = np.arange(len(rows))
    rows["b"], rows["ax"], rows["ay"], rows["bx"], rows["by"] = -6, 1.0, 1.0, np.nan, np.nan
    scene = kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5)
    tracemalloc.start()
    try:
        Seal().add(rows)
        sealed = tracemalloc.get_traced_memory()[1]
        assert Trajectory(rows, scene).positions(9.5).tolist() == [[1.0, 1.0]]
        checked = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert sealed < 0.1 * rows.nbytes
    assert checked < 2.0 * rows.nbytes
