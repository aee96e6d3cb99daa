"""What a long run loses: the readings agree with what can be worked out by hand."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import kinetile as kt
from kinetile_accuracy.long_runs import drift
from kinetile_accuracy.long_runs.drift import clocks, drifts


def silent(what: str, done: int, total: int) -> None:
    """Show no progress."""


def few(seed: int = 1) -> kt.Scene:
    return kt.make_scene("grid", bodies=9, density=0.3, seed=seed)


def ledger_of(
    scene: kt.Scene, contacts: int, chunks: int = 1, change=None
) -> tuple[drift.LogReadings, np.ndarray]:
    """Return a ledger that has seen a run, in so many calls, and all its log rows."""
    ledger, rows = drift.LogReadings(scene), []
    sim = kt.Simulation(scene)
    for _ in range(chunks):
        sim.run(max_contacts=contacts // chunks, recorder=lambda log: rows.append(log.copy()))
    log = np.concatenate(rows)
    if change is not None:
        change(log)
    for part in np.array_split(log, chunks):
        ledger(part)
    return ledger, log


def test_momentum_and_distances_agree_with_exact_arithmetic():
    scene = few()
    ledger, log = ledger_of(scene, 300, chunks=3)
    velocity = [[Fraction(v) for v in body] for body in scene.velocity.tolist()]
    left, gaps = [Fraction(0), Fraction(0)], []
    for row in log:
        after = {int(row["a"]): (row["avx"], row["avy"])}
        if row["b"] >= 0:
            after[int(row["b"])] = (row["bvx"], row["bvy"])
            reach = scene.radius[row["a"]] + scene.radius[row["b"]]
            gaps.append((np.hypot(row["bx"] - row["ax"], row["by"] - row["ay"]) - reach) / reach)
        for body, new in after.items():
            for axis in (0, 1):
                if row["b"] >= 0:
                    left[axis] += Fraction(float(scene.mass[body])) * (
                        Fraction(float(new[axis])) - velocity[body][axis]
                    )
                velocity[body][axis] = Fraction(float(new[axis]))
    scale = float((scene.mass * np.hypot(*scene.velocity.T)).sum())
    assert ledger.momentum == pytest.approx(float(np.hypot(*map(float, left))) / scale, rel=1e-3)
    assert ledger.gap_max == max(map(abs, gaps))
    assert ledger.late == np.mean(np.array(gaps) < 0.0)
    assert 0.8 < ledger.gap(0.5) / np.median(np.abs(gaps)) < 1.25


def test_a_contact_that_loses_momentum_is_seen():
    def change(log: np.ndarray) -> None:
        log["avx"][np.flatnonzero(log["b"] >= 0)[-1]] *= 1.0 + 1e-9

    assert ledger_of(few(), 300)[0].momentum < 1e-15 < ledger_of(few(), 300, change=change)[0].momentum


def test_discs_that_meet_too_early_are_seen():
    def change(log: np.ndarray) -> None:
        log["bx"][np.flatnonzero(log["b"] >= 0)[-1]] += 1e-6

    assert ledger_of(few(), 300)[0].gap_max < 1e-13 < ledger_of(few(), 300, change=change)[0].gap_max


@pytest.mark.compiled
def test_the_readings_of_a_run():
    rows = drifts(few(), 10_000, silent)
    assert [row.contacts for row in rows] == [1_000, 10_000]
    assert all(row.energy < 1e-13 and row.deepest_overlap < 1e-13 and row.momentum < 1e-13 for row in rows)
    assert [row.audits for row in rows] == [1, 10]
    assert rows[0].time < rows[1].time


def test_a_late_clock_shows_the_same_contacts():
    rows = clocks(few(), 500)
    assert [row.start for row in rows] == [0.0, 2.0**20, 2.0**40]
    assert all(row.same and row.contacts == 500 for row in rows)


def test_a_clock_with_other_contacts_is_told(monkeypatch):
    make = kt.Simulation

    def other(scene: kt.Scene, **options: object) -> kt.Simulation:
        return make(scene if scene.start == 0.0 else few(seed=2), **options)

    monkeypatch.setattr(drift.kt, "Simulation", other)
    assert [row.same for row in clocks(few(), 100)] == [True, False, False]
