"""The losses of a long run: its readings, and the contacts under other clocks."""

import pytest

import kinetile as kt
from kinetile_accuracy.long_runs import drift
from kinetile_accuracy.long_runs.drift import clocks, drifts


def few(seed: int = 1) -> kt.Scene:
    return kt.make_scene("grid", bodies=9, density=0.3, seed=seed)


@pytest.mark.compiled
def test_the_readings_of_a_run():
    rows = drifts(few(), 10_000, lambda *_: None)
    assert [row.contacts for row in rows] == [1_000, 10_000]
    assert all(row.energy < 1e-13 and row.deepest_overlap < 1e-13 for row in rows)
    assert [row.audits for row in rows] == [1, 10]
    assert rows[0].time < rows[1].time


def test_a_late_clock_shows_the_same_contacts():
    rows = clocks(few(), 500)
    assert [row.start for row in rows] == [0.0, 2.0**20, 2.0**40]
    assert all(row.same and row.contacts == 500 for row in rows)


def test_a_clock_with_other_contacts_is_reported(monkeypatch):
    make = kt.Simulation

    def other(scene: kt.Scene, **options: object) -> kt.Simulation:
        return make(scene if scene.start == 0.0 else few(seed=2), **options)

    monkeypatch.setattr(drift.kt, "Simulation", other)
    assert [row.same for row in clocks(few(), 100)] == [True, False, False]
