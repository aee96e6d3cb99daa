"""``kinetile bench events``: its arithmetic and its counts; no clock is judged here."""

import json
import math

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import Refused
from kinetile_bench import event_rates as events_module
from kinetile_bench.event_rates import COUNTED, EventsBench, bench_events, square_at_least

CHOICES = ["naive", ("cells", {"side": 0.4})]  # whose loops of discs alike other tests have


def measure(**others) -> EventsBench:
    *before, found = bench_events(CHOICES, [4, 8], [0.5, 0.25], seconds=0.001, repeats=2, **others)
    assert [len(each.rows) for each in before] == [2, 4, 6]  # Ctrl-C leaves the scenes that are done
    return found


@pytest.fixture(scope="module")
def bench() -> EventsBench:
    return measure(seed=6)


def test_every_phase_on_every_scene(bench):
    assert [(row.density, row.bodies, row.phase) for row in bench.rows] == [
        (density, bodies, phase)
        for density in (0.5, 0.25)
        for bodies in (4, 9)
        for phase in ("naive", "cells:side=0.4")
    ]
    for row in bench.rows:
        assert len(row.cpu_seconds) == 2
        assert 0.0 < row.contacts_per_cpu_second <= row.best
        assert row.contacts > 0
        assert row.events_per_contact >= 1.0
        assert row.asked_per_contact > row.computed_per_contact > 0.0
    assert bench.identical
    found = json.loads(json.dumps(bench.as_dict()))
    assert found["rows"][0]["phase"] == "naive"
    assert found["conditions"]["versions"]["kinetile"] == kt.__version__
    assert len(found["conditions"]["load"]) == 5  # at the start, and after each scene


def test_rows_are_compared_with_the_fastest_phase_and_with_fewer_discs(bench):
    for at in range(0, 8, 2):
        rows = bench.rows[at : at + 2]
        most = max(row.contacts_per_cpu_second for row in rows)
        assert [row.of_fastest for row in rows] == [row.contacts_per_cpu_second / most for row in rows]
    for one, other in zip(bench.rows[:2], bench.rows[2:4], strict=True):
        grown = other.cpu_seconds_per_time / one.cpu_seconds_per_time
        assert other.exponent == pytest.approx(math.log(grown) / math.log(9 / 4))
    assert (bench.rows[0].exponent, bench.rows[4].exponent) == (None, None)  # the first of a density


def test_counts_are_those_of_a_fixed_number_of_contacts_on_the_recipes_scene(bench):
    for row in bench.rows:
        sim = kt.Simulation(kt.make_scene("grid", bodies=row.bodies, density=row.density, seed=6), "naive")
        sim.run(max_contacts=COUNTED * row.bodies)
        assert row.fingerprint == sim.fingerprint
        assert row.counts["contacts_disc"] + row.counts["contacts_wall"] == COUNTED * row.bodies
        assert (row.counts["structural_events"] == 0) == (row.phase == "naive")
    assert [row.counts for row in measure(seed=6).rows] == [row.counts for row in bench.rows]


def test_square_numbers():
    sizes = {1: 1, 2: 4, 100: 100, 1000: 1024, 10_000: 10_000, 100_000: 100_489}
    assert {n: square_at_least(n) for n in sizes} == sizes


def test_the_command_prints_what_is_refused_and_phases_that_differ_are_exit_code_1(monkeypatch, bench):
    arguments = ("bench", "events", "--phases", "naive,cells", "--bodies", "4", "--densities", "0.5")
    arguments += ("--seconds", "0.001", "--repeats", "1")

    def refuse(self, scene, prepared=None):
        raise Refused("not today")

    monkeypatch.setattr("kinetile_plugins.naive.Naive.prepare", refuse)
    printed = kinetile(*arguments, code=0)
    assert "naive refuses 4 discs: not today" in printed.stdout
    refused = json.loads(kinetile(*arguments, "--json").stdout)["rows"][0]["refused"]
    assert refused.startswith("not today")
    one, other = bench.rows[:2]
    rows = one, events_module.replace(other, counts={**other.counts, "fingerprint": "another"})
    differing = EventsBench(rows, bench.conditions)
    monkeypatch.setattr(events_module, "bench_events", lambda *_, **__: iter([differing]))
    printed = kinetile("bench", "events", code=1)
    assert "NOT identical" in printed.stdout
