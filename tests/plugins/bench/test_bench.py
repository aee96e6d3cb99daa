"""The benchmark's arithmetic and its counts; no clock is judged here."""

from __future__ import annotations

import json

import kinetile as kt
from kinetile_bench import Study
from kinetile_bench.events import COUNTED, Bench, events_study, read_events
from studies import run_here


def bench(tmp_path, *choices, repeats: int = 1, **others) -> Bench:
    return read_events(
        run_here(events_study(tmp_path / "rows", *choices, seconds=0.001, repeats=repeats, **others))
    )


def test_every_phase_on_every_scene(tmp_path):
    result = bench(tmp_path, ["naive", ("sap-1d", {"axis": "y"})], [4, 9], [0.5], repeats=2)
    assert [(row.bodies, row.density, row.phase) for row in result.rows] == [
        (4, 0.5, "naive"),
        (4, 0.5, "sap-1d:axis=y"),
        (9, 0.5, "naive"),
        (9, 0.5, "sap-1d:axis=y"),
    ]
    for row in result.rows:
        assert len(row.cpu_seconds) == 2
        assert row.slowest <= row.events_per_cpu_second <= row.fastest
        assert row.contacts > 0
        assert row.events_per_contact >= 1.0
        assert row.asked_per_contact > row.computed_per_contact > 0.0


def test_the_study_that_ships_is_what_the_command_measures(tmp_path):
    built_in = ["cells", "naive", "sap-1d", "sap-2d", "sweep-tiling"]
    assert list(Study("events", tmp_path).tasks) == list(events_study(tmp_path, built_in).tasks)


def test_the_fastest_phase_of_a_scene_is_the_measure_of_the_others(tmp_path):
    result = bench(tmp_path, ["naive", "cells"], [9, 16], [0.5, 0.25])
    for n in (9, 16):
        for density in (0.5, 0.25):
            rows = [row for row in result.rows if (row.bodies, row.density) == (n, density)]
            most = max(row.contacts_per_cpu_second for row in rows)
            assert [row.of_fastest for row in rows] == [row.contacts_per_cpu_second / most for row in rows]
            assert max(row.of_fastest for row in rows) == 1.0


def test_counts_are_taken_over_a_fixed_number_of_contacts(tmp_path):
    counts = []
    for time in ("once", "again"):
        result = bench(tmp_path / time, ["naive", "sap-2d"], [9], [0.25])
        counts.append([row.counts for row in result.rows])
    assert counts[0] == counts[1]
    for each in counts[0]:
        assert each["contacts_disc"] + each["contacts_wall"] == COUNTED * 9
    assert counts[0][0]["fingerprint"] == counts[0][1]["fingerprint"]
    assert counts[0][0]["structural_events"] == 0


def test_the_scene_is_the_recipes_own(tmp_path):
    result = bench(tmp_path, ["naive"], [4], [0.125], seed=6)
    sim = kt.Simulation(kt.make_scene("grid", bodies=4, density=0.125, seed=6), "naive")
    sim.run(max_contacts=COUNTED * 4)
    assert result.rows[0].counts["fingerprint"] == sim.fingerprint


def test_the_result_is_fit_for_json(tmp_path):
    result = bench(tmp_path, ["naive"], [4], [0.5])
    found = json.loads(json.dumps(result.as_dict()))
    assert found["rows"][0]["phase"] == "naive"
    assert found["conditions"]["repeats"] == 1
    assert found["conditions"]["versions"]["kinetile"] == kt.__version__
