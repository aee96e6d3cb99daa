"""Programs of docs/examples: they play to the end, and their own comparisons hold."""

import os
import runpy
import subprocess
import sys
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
import lanes

ROOT = Path(__file__).parents[1]


def play(words: str, capsys) -> str:
    main = runpy.run_path(str(ROOT / "docs/examples/game.py"))["main"]
    assert main(words.split()) == 0
    return str(capsys.readouterr().out)


@pytest.mark.small
def test_a_game_of_few_bodies_is_rewound_and_played_again(capsys):
    said = play("--frames 26 --bodies 20 --phases cells", capsys)
    assert "one fingerprint" in said
    for counted in ("bullets", "frames: 26"):
        assert counted in said


@pytest.mark.slow
def test_the_game_is_one_under_two_phases(capsys):
    said = play("", capsys)
    assert "one fingerprint" in said
    for counted in ("bullets", "coins", "pieces", "frames: 600", "in the polygon", "seconds in sensors"):
        assert counted in said


GRAVITY = runpy.run_path(str(ROOT / "docs/cookbook/gravity.py"))["SYSTEMS"]
EXACT = ("traffic", "robots", "pinball")


@pytest.mark.small
@pytest.mark.parametrize("system", EXACT)
def test_scenes_with_accelerations_obey_exact_laws(system):
    GRAVITY[system]()


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("system", sorted({*GRAVITY} - {*EXACT}))
def test_scenes_with_accelerations_obey_statistical_laws(system):
    GRAVITY[system]()


MATTER = runpy.run_path(str(ROOT / "docs/cookbook/matter.py"))["SYSTEMS"]


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("system", MATTER)
def test_matter_is_as_published(system):
    MATTER[system]()


def by_legs(flights: dict, separation: float) -> dict:
    """The least distance of each two flights while both are there, and when, where it is below a separation:
    by the closed form of each two legs, with no scene at all."""
    found = {}
    legs = {name: list(pairwise(points)) for name, points in flights.items()}
    for one, two in combinations(sorted(flights), 2):
        least = []
        for (t1, *p1), (t2, *p2) in legs[one]:
            for (s1, *q1), (s2, *q2) in legs[two]:
                begin, end = max(t1, s1), min(t2, s2)
                if begin < end:
                    flies, others = (
                        np.subtract(b, a) / (t - s) for a, b, s, t in ((p1, p2, t1, t2), (q1, q2, s1, s2))
                    )
                    place = (q1 + others * (begin - s1)) - (p1 + flies * (begin - t1))
                    way = others - flies
                    after = min(max(-(place @ way) / (way @ way), 0.0), end - begin)
                    least.append((float(np.hypot(*(place + way * after))), begin + after))
        if least and min(least)[0] < separation:
            found[one, two] = min(least)
    return found


@pytest.mark.small
@pytest.mark.parametrize("count", lanes.first(1, [40, 500]))
def test_losses_of_separation_are_those_of_the_closed_form_of_legs(count):
    example = runpy.run_path(str(ROOT / "docs/examples/separation.py"))
    flights = example["draw"](count, side=500.0 if count > 100 else 120.0)
    found, wanted = {}, by_legs(flights, 5.0)
    for one, two, _, _, closest, time in example["losses"](flights, 5.0):
        pair = min(one, two), max(one, two)
        found[pair] = min(found.get(pair, (closest, time)), (closest, time))
    assert found.keys() == wanted.keys()
    assert len(found) > 10
    for pair in found:
        assert found[pair] == pytest.approx(wanted[pair], abs=1e-9)


def test_flights_are_read_from_a_file(tmp_path, capsys):
    example = runpy.run_path(str(ROOT / "docs/examples/separation.py"))
    (tmp_path / "f.csv").write_text("flight,time,x,y\nB,0,10,0\nA,0,0,0\nB,10,0,0\nA,5,5,0\nA,10,5,50\n")
    assert example["read"](tmp_path / "f.csv") == {
        "A": [(0.0, 0.0, 0.0), (5.0, 5.0, 0.0), (10.0, 5.0, 50.0)],
        "B": [(0.0, 10.0, 0.0), (10.0, 0.0, 0.0)],
    }


LANDED = ["2.1000, 0.6500", "3.2000, 1.1500", "5.1250, 0.7500", "6.2750, 1.2500", "5.3750, 0.7500"]


@pytest.mark.small
def test_a_player_lands_on_each_platform_and_takes_all_coins():
    sim, told = runpy.run_path(str(ROOT / "docs/examples/platformer.py"))["play"](400)
    assert [line.partition(" at ")[2] for line in told if "stands" in line] == LANDED
    assert sum("coin" in line for line in told) == 3
    again = kt.Simulation(sim.recorded(), "sap-1d")
    again.run()
    assert again.fingerprint == sim.fingerprint


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a script of POSIX shells")
def test_a_session_in_a_shell(tmp_path):
    command = tmp_path / "kinetile"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m kinetile "$@"\n')
    command.chmod(0o755)
    paths = {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}", "TMPDIR": str(tmp_path)}
    done = subprocess.run(
        ["sh", ROOT / "docs/examples/shell.sh"],
        env={**os.environ, **paths, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    right, _, print_, clock, rows, same, fault = done.stdout.splitlines()
    assert right == "standard input: all lines are right: 9, to time 3.0"
    assert (clock, print_[:12], rows.strip()) == ("unit 1.0 start 0.0", "fingerprint ", "3")
    assert same == "identical: 9 contacts, the end and every body's state agree bit for bit"
    assert fault == "no fault"


def example(name: str) -> dict:
    return runpy.run_path(str(ROOT / f"docs/examples/{name}.py"))


@pytest.mark.small
def test_air_hockey_scores_and_begins_again(capsys):
    air = example("air_hockey")
    (table,) = air["play"](1, 10)
    assert capsys.readouterr().out == "goals 0:0, 0 squeezes\n"
    table.reset()
    table.sim.set_position(0, (1.75, 0.7))
    table.sim.set_velocity(0, (11.4, -12.0))
    assert table.step([(0.0, 0.0)] * 2)[1:3] == (1, True)
    starts = [table.reset(seed=seed)[0][0].tolist() for seed in (1, 2, 1, None)]
    assert starts[0] == starts[2] != starts[1]
    assert starts[3] not in starts[:3]
    assert starts[3][:2] == [1.0, 0.5]


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.own_loop
def test_air_hockey_frees_a_squeezed_puck():
    table = example("air_hockey")["AirHockey"](1)
    table.sim.set_position(0, (0.8, 0.06))
    table.sim.set_velocity(0, (0.0, 0.0))
    table.sim.set_position(1, (0.8, 0.25))
    until = table.sim.time + 0.1
    table.sim.set_velocity(1, (0.0, -1.0))
    table.sim.run(until=until, on_jam=table.release)
    assert (table.jams, table.sim.time) == (1, until)


@pytest.mark.small
def test_billiard_balls_all_rest_after_a_shot_in_straight_paths(capsys):
    game = example("billiards")["play"](1)
    assert not game.stops
    assert not game.sim.velocities().any()
    again = kt.Simulation(game.sim.recorded(), "sap-1d")
    again.run()
    assert again.fingerprint == game.sim.fingerprint


@pytest.mark.small
def test_robots_of_the_warehouse_meet_scanners_alone():
    sim, scans = example("warehouse")["drive"](12, 20.0)
    pairs = sim.contacts[["a", "b"]].tolist()
    assert scans
    assert {tuple(sorted(pair)) for pair in pairs} == {(robot, at) for _, robot, at in scans}


@pytest.mark.small
def test_contacts_of_two_blocks_are_the_digits_of_pi():
    lesson = example("pi_lesson")
    assert [lesson["count"](digits)[0] for digits in (1, 2)] == [3, 31]
    assert [lesson["foreseen"](digits) for digits in (1, 2, 3)] == [3, 31, 314]
