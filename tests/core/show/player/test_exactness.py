"""Any moment in the page is exact: its places are ``Trajectory``'s, and so the run's, to the bit."""

import math

import numpy as np
import pytest

import kinetile as kt
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.flight import whole_pulls
from kinetile.records import Trajectory
from kinetile.show.player import view_scene
from player_pages import SCENES, ask_node, case_of, moments, needs_node, record

PLACES = """
    return given.times.map((time) => {
        play.seek(clock.momentAt(time, held.start, held.unit));
        return placesOf(play.runs[0].motion, play.moment).flat();
    });
"""


@needs_node
@pytest.mark.parametrize("name", ["come and go", "accelerated", "rests", "changes"])
def test_a_window_is_as_exact(name, tmp_path):
    scene = SCENES[name]
    rows = record(kt.Simulation(scene, "naive"), 2.0)
    trajectory = Trajectory(rows, scene)
    page = view_scene(scene, [("naive", {})], begin=0.75, until=2.0, steps=False).page
    assert 0 < len(page.recordings[0].rows) < len(rows)
    times = moments(scene, rows, 0.75, 2.0, 300)
    assert len(times) > 100
    found = ask_node(tmp_path, page, PLACES, times=times)
    assert found == [trajectory.positions(time).ravel().tolist() for time in times]


def energy(sim: kt.Simulation) -> float:
    """Returns the kinetic and the potential energy of all movable bodies, of those that are held too."""
    slots = np.flatnonzero((sim.tables.queue.number >= 0) & np.isfinite(sim.tables.mass))
    there, mass = sim.tables.queue.number[slots], sim.tables.mass[slots]
    place, velocity = sim.positions()[there], sim.velocities()[there]
    return float(mass @ (0.5 * velocity**2 - whole_pulls(sim.tables, slots) * place).sum(axis=1))


@needs_node
@pytest.mark.parametrize("name", ["masses", "accelerated", "rests"])
def test_velocities_are_exact_and_the_energy_is_that_of_the_run(name, tmp_path):
    scene, trajectory, page, _ = case_of(name)
    times = np.linspace(scene.start, trajectory.rows["time"][-1], 23)[1:].tolist()
    asked = """return given.times.map((time) => {
        play.seek(clock.momentAt(time, held.start, held.unit));
        const { motion } = play.runs[0];
        const those = [...motion.plans.there.keys()].filter((body) => motion.plans.there[body]);
        return [those.map((body) => motion.velocity(body, play.moment)), tables.energy(motion)];
    });"""
    sim = kt.Simulation(scene, "naive")
    for time, (velocities, found) in zip(times, ask_node(tmp_path, page, asked, times=times), strict=True):
        sim.run(time)
        assert velocities == trajectory.velocities(time).tolist()
        assert found == pytest.approx(energy(sim), rel=1e-12)


@needs_node
@pytest.mark.parametrize(("start", "unit"), [(0.0, 1.0), (0.1, 0.5), (-3.7, 2.0**-20), (2.0**40, 1.0)])
def test_a_time_is_the_same_tick_as_the_clocks(start, unit, tmp_path):
    rng = np.random.default_rng(7)
    times = [
        start + each
        for each in [0.0, 1e-300, 5e-324, *rng.uniform(0, 9, 200), *10.0 ** rng.uniform(-20, 9, 200)]
    ]
    times += [math.nextafter(time, way) for time in times for way in (math.inf, -math.inf)]
    page = view_scene(SCENES["no walls"], steps=False).page
    body = """
        const momentOf = (time) => clock.momentAt(time, given.start, given.unit);
        return given.times.map((time) => momentOf(time).map((part) => String(BigInt(part))));
    """
    found = ask_node(tmp_path, page, body, times=times, start=start, unit=unit)
    clock = Clock(start, unit)
    assert found == [[str(part) for part in divmod(clock.ticks(time), TICKS)] for time in times]
