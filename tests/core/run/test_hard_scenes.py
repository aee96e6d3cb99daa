"""The named hard scenes: each under every broad phase, with one answer, and the answer it has to be.

The scenes are files, ``tests/scenes/H*.toml``, and say there what is hard about them. Most are dyadic, so
that the times and velocities below are exact. A few numbers (H10, H22, H24, H26, H31) have no scene.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import kinetile as kt
from agreement import assert_one_answer

SCENES = Path(__file__).parents[2] / "scenes"
LEFT, RIGHT, BOTTOM, TOP = -1, -2, -3, -4


class Expected(NamedTuple):
    """All contacts (time, a, b), and all velocities at the end."""

    contacts: list[tuple[float, int, int]]
    velocities: list[tuple[float, float]]


AT_REST = (0.0, 0.0)

EXACT = {
    "H01": Expected([], []),
    "H02": Expected([], [AT_REST]),
    "H03": Expected([(0.375, 0, RIGHT), (0.375, 0, TOP)], [(-1.0, -1.0)]),
    "H04a": Expected([], [(1.0, 0.0)]),
    "H04b": Expected([(0.0, 0, LEFT)], [(1.0, 0.0)]),
    "H04c": Expected([(0.375, 0, TOP), (1.125, 0, BOTTOM), (1.875, 0, TOP)], [(0.0, -1.0)]),
    "H05": Expected([(0.125, 0, 1), (0.375, 0, LEFT), (0.375, 1, RIGHT)], [(1.0, 0.0), (-1.0, 0.0)]),
    "H06": Expected([(0.125, 0, 1), (0.375, 0, BOTTOM), (0.375, 1, TOP)], [(0.0, 1.0), (0.0, -1.0)]),
    "H07": Expected([], [(1.0, 0.0), (-1.0, 0.0)]),
    "H08b": Expected([], [(1.0, 0.0), (-1.0, 0.0)]),
    "H09": Expected([], [(0.0, 1.0), (0.0, -1.0)]),
    "H11": Expected([(0.75, 0, 1), (0.75, 1, 2), (0.75, 2, 3), (0.75, 3, 4)], [AT_REST] * 4 + [(1.0, 0.0)]),
    "H12": Expected(
        [(0.5, 1, 2), (0.5, 0, 1), (0.5, 2, 3), (0.5, 1, 2), (0.5, 3, 4), (0.5, 2, 3)],
        [AT_REST] * 3 + [(1.0, 0.0)] * 2,
    ),
    "H14": Expected([(0.4375, body, LEFT) for body in range(5)], [(1.0, 0.0)] * 5),
    "H16": Expected([], [AT_REST] * 16),
    "H23": Expected([], [(1.0, 0.0), AT_REST, AT_REST]),
    "H25": Expected([], [(1.0, 0.0), (0.5, 0.0), AT_REST]),
    "H32": Expected([], [(1.0, 0.25)] * 8),
}

TOLD_BELOW = {"H08a", "H13", "H15", "H17", "H18", "H19", "H20", "H21", "H27", "H28", "H29", "H30", "H33"}


def scene_of(name: str) -> kt.Scene:
    return kt.load_scene(SCENES / f"{name}.toml")


def listed(sim: kt.Simulation) -> list[tuple[float, int, int]]:
    return [(float(row["time"]), int(row["a"]), int(row["b"])) for row in sim.contacts]


def test_no_scene_is_left_out() -> None:
    assert {path.stem for path in SCENES.glob("H*.toml")} == set(EXACT) | TOLD_BELOW


@pytest.mark.parametrize("name", sorted(EXACT))
def test_the_answer_is_exact(name: str) -> None:
    sim = assert_one_answer(scene_of(name))
    assert listed(sim) == EXACT[name].contacts
    assert list(map(tuple, sim.velocities().tolist())) == EXACT[name].velocities
    readings = sim.readings
    assert readings.unaccounted_energy == 0.0
    assert readings.deepest_overlap == 0.0
    assert readings.lateness == 0.0


def test_h06_has_no_structural_event_on_x() -> None:
    sim = kt.Simulation(scene_of("H06"), "sap-1d", options={"axis": "x"})
    sim.run()
    assert sim.readings.structural_events == 0


def test_h08a_grazes_and_keeps_its_energy() -> None:
    sim = assert_one_answer(scene_of("H08a"))
    ((time, a, b),) = listed(sim)
    assert (a, b) == (0, 1)
    # The centres are 0.25 - 1e-9 apart on y and approach each other on x from 0.5, at a relative speed of 2.
    assert time == pytest.approx((0.5 - math.sqrt(0.25**2 - (0.25 - 1e-9) ** 2)) / 2.0, abs=1e-12)
    assert sim.readings.unaccounted_energy <= 2.0**-52
    one, two = sim.velocities()
    assert np.array_equal(one, -two)
    assert abs(one[1]) == pytest.approx(math.sin(2.0 * math.acos(1.0 - 4e-9)), rel=1e-6)


def test_h13_is_decided_by_the_numbers_of_the_discs() -> None:
    sim = assert_one_answer(scene_of("H13"))
    first, second = listed(sim)
    assert (first[1:], second[1:]) == ((0, 1), (0, 2))
    assert first[0] == pytest.approx(1.0 - math.sqrt(0.25**2 - 0.125**2), abs=1e-15)
    assert 0.0 <= second[0] - first[0] <= 2.0**-51
    assert np.abs(sim.velocities().sum(axis=0) - (1.0, 0.0)).max() < 1e-15
    assert sim.readings.unaccounted_energy < 1e-15


@pytest.mark.slow
@pytest.mark.compiled
def test_h15_keeps_its_ties_for_ever() -> None:
    sim = assert_one_answer(scene_of("H15"))
    # Discs of one mass in a line exchange velocities, as points would that fly through each other in what the
    # discs leave free, a length of 1/4: at speed 1 on x and 1/2 on y, 4 lines of 4 points each way.
    crossings = 6 * 4 * (32 + 16)
    bounces = 4 * 4 * (32 + 16)
    assert sim.readings.contacts_disc == crossings
    assert sim.readings.contacts_wall == bounces
    assert sim.readings.deepest_overlap == 0.0
    assert np.array_equal(sim.contacts["time"] * 32.0, np.round(sim.contacts["time"] * 32.0))


@pytest.mark.parametrize(
    ("name", "contacts", "more_than", "overlap", "drift"),
    [
        ("H17", None, 100, 1e-13, 1e-13),  # ties that come apart
        ("H33", None, 100, 1e-13, 1e-13),
        ("H19", 3000, 2999, 1e-14, 1e-13),  # a burst
        pytest.param("H20", 3000, 2999, 1e-13, 1e-12, marks=pytest.mark.slow),  # ten decades of speed
        # Of the smallest radius, which is 1e-5.
        pytest.param("H21", None, 1000, 1e-10, 1e-13, marks=pytest.mark.slow),
    ],
)
@pytest.mark.compiled
def test_a_long_run_has_one_answer_and_keeps_its_energy(
    name: str, contacts: int | None, more_than: int, overlap: float, drift: float
) -> None:
    sim = assert_one_answer(scene_of(name), max_contacts=contacts)
    assert len(sim.contacts) > more_than
    assert sim.readings.deepest_overlap < overlap
    assert sim.readings.unaccounted_energy < drift


@pytest.mark.compiled
def test_h18_is_the_same_jam_in_every_phase() -> None:
    assert_one_answer(scene_of("H18"), ends="ZenoError")


def test_h25_all_pairs_are_candidates_where_the_bounds_meet() -> None:
    sim = kt.Simulation(scene_of("H25"), "sap-1d", options={"axis": "x"})
    sim.run(until=0.25)
    assert sim.candidate_pairs().tolist() == [[0, 1], [0, 2], [1, 2]]


@pytest.mark.filterwarnings("error")
def test_h27_nothing_happens_for_a_million_time_units() -> None:
    sim = assert_one_answer(scene_of("H27"))
    assert sim.time == 1e6
    assert len(sim.contacts) == 0
    assert np.array_equal(sim.positions(), sim.scene.position)
    assert sim.velocities().tobytes() == sim.scene.velocity.tobytes()


@pytest.mark.parametrize(("lengths", "times"), [(20, -10), (20, 0), (0, -10)])
@pytest.mark.slow
@pytest.mark.compiled
def test_h28_other_units_give_the_same_bits(lengths: int, times: int) -> None:
    scene = scene_of("H28")
    length, time = 2.0**lengths, 2.0**times
    scaled = replace(
        scene,
        position=scene.position * length,
        velocity=scene.velocity * (length / time),
        radius=scene.radius * length,
        arena=(length, length),
    )
    one = assert_one_answer(scene, until=3.0)
    two = assert_one_answer(scaled, until=3.0 * time)
    assert len(one.contacts) > 500
    assert np.array_equal(one.contacts["time"] * time, two.contacts["time"])
    assert np.array_equal(one.contacts[["a", "b"]], two.contacts[["a", "b"]])
    assert np.array_equal(one.positions() * length, two.positions())
    assert np.array_equal(one.velocities() * (length / time), two.velocities())


def test_h29_axes_exchanged() -> None:
    scene = scene_of("H29")
    other = replace(scene, position=scene.position[:, ::-1], velocity=scene.velocity[:, ::-1])
    one = assert_one_answer(scene, max_contacts=8)
    two = assert_one_answer(other, max_contacts=8)
    wall = {LEFT: BOTTOM, RIGHT: TOP, BOTTOM: LEFT, TOP: RIGHT}
    assert [(time, a, wall.get(b, b)) for time, a, b in listed(one)] == listed(two)


def test_h30_bodies_renumbered() -> None:
    scene = scene_of("H30")
    order = np.random.default_rng(30).permutation(len(scene))
    other = replace(
        scene,
        position=scene.position[order],
        velocity=scene.velocity[order],
        radius=scene.radius[order],
        mass=scene.mass[order],
    )
    one = assert_one_answer(scene, max_contacts=8)
    two = assert_one_answer(other, max_contacts=8)
    renumbered = []
    for time, a, b in listed(two):
        a, b = int(order[a]), int(order[b]) if b >= 0 else b
        renumbered.append((time, a, b) if b < 0 else (time, min(a, b), max(a, b)))
    assert listed(one) == renumbered
