"""The benchmark's arithmetic and its counts; no clock is judged here."""

from __future__ import annotations

import json

import kinetile as kt
from kinetile.bench.events import COUNTED, bench_events


def test_every_phase_on_every_scene():
    started, finished, steps = [], [], []
    result = bench_events(
        ["naive", ("sap-1d", {"axis": "y"})],
        [4, 9],
        [0.5],
        seconds=0.001,
        repeats=2,
        start=lambda label, sim: started.append((label, len(sim.scene))),
        finish=finished.append,
        progress=lambda done, total: steps.append((done, total)),
    )
    assert [(row.bodies, row.density, row.phase) for row in result.rows] == [
        (4, 0.5, "naive"),
        (4, 0.5, "sap-1d:axis=y"),
        (9, 0.5, "naive"),
        (9, 0.5, "sap-1d:axis=y"),
    ]
    assert started == [("naive", 4), ("sap-1d", 4), ("naive", 9), ("sap-1d", 9)]
    assert tuple(finished) == result.rows
    assert steps == [(step, 12) for step in range(1, 13)]
    for row in result.rows:
        assert len(row.cpu_seconds) == 2
        assert row.slowest <= row.events_per_cpu_second <= row.fastest
        assert row.contacts > 0
        assert row.events_per_contact >= 1.0
        assert row.asked_per_contact > row.computed_per_contact > 0.0


def test_the_fastest_phase_of_a_scene_is_the_measure_of_the_others():
    result = bench_events(["naive", "cells"], [9, 16], [0.5, 0.25], seconds=0.001, repeats=1)
    for n in (9, 16):
        for density in (0.5, 0.25):
            rows = [row for row in result.rows if (row.bodies, row.density) == (n, density)]
            most = max(row.contacts_per_cpu_second for row in rows)
            assert [row.of_fastest for row in rows] == [row.contacts_per_cpu_second / most for row in rows]
            assert max(row.of_fastest for row in rows) == 1.0


def test_counts_are_taken_over_a_fixed_number_of_contacts():
    counts = []
    for _ in range(2):
        result = bench_events(["naive", "sap-2d"], [9], [0.25], seconds=0.001, repeats=1)
        counts.append([row.counts for row in result.rows])
    assert counts[0] == counts[1]
    for each in counts[0]:
        assert each["contacts_disc"] + each["contacts_wall"] == COUNTED * 9
    assert counts[0][0]["fingerprint"] == counts[0][1]["fingerprint"]
    assert counts[0][0]["structural_events"] == 0


def test_the_scene_is_the_recipes_own():
    result = bench_events(["naive"], [4], [0.125], seconds=0.001, repeats=1, seed=6)
    sim = kt.Simulation(kt.make_scene("grid", bodies=4, density=0.125, seed=6), "naive")
    sim.run(max_contacts=COUNTED * 4)
    assert result.rows[0].counts["fingerprint"] == sim.fingerprint


def test_the_result_is_fit_for_json():
    result = bench_events(["naive"], [4], [0.5], seconds=0.001, repeats=1)
    found = json.loads(json.dumps(result.as_dict()))
    assert found["rows"][0]["phase"] == "naive"
    assert found["conditions"]["repeats"] == 1
    assert found["conditions"]["versions"]["kinetile"] == kt.__version__
