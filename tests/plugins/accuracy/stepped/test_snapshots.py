"""The pseudo-dynamic method: its stated properties, no better and no worse."""

import math

import numpy as np
import numpy.typing as npt
import pytest

import kinetile as kt
from kinetile_accuracy.stepped import snapshots
from kinetile_accuracy.stepped.snapshots import Finder, SteppedRun, deepest_overlap, run_snapshots

FINDERS: tuple[Finder, ...] = ("sweep", "cells")


def mixed(bodies: int = 30, seed: int = 1) -> kt.Scene:
    """Discs of different sizes and masses in an arena that is not square, at random directions."""
    random = np.random.default_rng(seed)
    side = math.ceil(math.sqrt(bodies))
    cell = np.arange(bodies)
    position = (np.stack([cell % side, cell // side], axis=1) + 0.5) / side * (1.5, 1.0)
    velocity = random.normal(size=(bodies, 2))
    return kt.Scene(
        position,
        velocity,
        random.uniform(0.2, 0.45, bodies) / side,
        random.uniform(0.5, 4.0, bodies),
        (1.5, 1.0),
    )


def by_all_pairs(scene: kt.Scene, dt: float, steps: int) -> list[tuple[int, int, int]]:
    """Returns (step, a, b) of contacts by the plainest loop: all pairs at each snapshots, left to right."""
    x, v, r, m = scene.position.copy(), scene.velocity.copy(), scene.radius, scene.mass
    contacts = []
    for step in range(1, steps + 1):
        x += v * dt
        for i in range(len(x)):
            for axis, side in enumerate(scene.arena or ()):
                if x[i, axis] < r[i] and v[i, axis] < 0.0:
                    contacts.append((step, i, -1 - 2 * axis))
                    x[i, axis] = 2.0 * r[i] - x[i, axis]
                    v[i, axis] = -v[i, axis]
                elif x[i, axis] > side - r[i] and v[i, axis] > 0.0:
                    contacts.append((step, i, -2 - 2 * axis))
                    x[i, axis] = 2.0 * (side - r[i]) - x[i, axis]
                    v[i, axis] = -v[i, axis]
        order = np.argsort(x[:, 0] - r, kind="stable")
        for place, i in enumerate(order):
            for j in order[place + 1 :]:
                dx, dy = x[j] - x[i]
                square = dx * dx + dy * dy
                if square < (r[i] + r[j]) ** 2:
                    approach = dx * (v[j, 0] - v[i, 0]) + dy * (v[j, 1] - v[i, 1])
                    if approach < 0.0:
                        v_i = m[j] / (m[i] + m[j]) * 2.0 * approach / square
                        v_j = m[i] / (m[i] + m[j]) * 2.0 * approach / square
                        v[i] += (v_i * dx, v_i * dy)
                        v[j] -= (v_j * dx, v_j * dy)
                        contacts.append((step, int(min(i, j)), int(max(i, j))))
    return contacts


def listed(run: SteppedRun) -> list[tuple[int, int, int]]:
    return [(int(row["step"]), int(row["a"]), int(row["b"])) for row in run.contacts]


@pytest.mark.slow
def test_the_sorted_sweep_finds_the_pairs_that_all_pairs_find() -> None:
    scene = mixed()
    run = run_snapshots(scene, 0.01, 1.0)
    expected = by_all_pairs(scene, 0.01, run.steps)
    assert len(expected) > 100
    # Walls are written body by body in the order of rows, which the sweep moves.
    assert sorted(listed(run)) == sorted(expected)
    assert [c for c in listed(run) if c[2] >= 0] == [c for c in expected if c[2] >= 0]
    assert run.energy_drift < 1e-13


def test_cells_find_the_pairs_that_the_sweep_finds() -> None:
    scene = mixed(seed=3)
    sweep, cells = (run_snapshots(scene, 0.001, 0.4, finder=finder) for finder in FINDERS)
    assert len(sweep.contacts) > 20
    assert sorted(listed(sweep)) == sorted(listed(cells))
    np.testing.assert_array_equal(sweep.position, cells.position)


@pytest.mark.compiled
@pytest.mark.parametrize(("step", "published"), [(0.15, 3.75e-3), (0.5, 0.0435), (1.0, 0.215), (2.0, 0.607)])
def test_single_encounters_have_no_impulse_as_often_as_theory_says(step: float, published: float) -> None:
    """The discs approach during the first half of an overlap: with twice the step as many are unseen."""
    assert single_encounters(step) == pytest.approx(published, rel=0.02)


def single_encounters(step: float, pairs: int = 20_000) -> float:
    """Returns the share of encounters without an impulse, with v dt = ``step`` sigma.

    Pairs stand far apart, one disc at rest and one that flies past it, with impact parameters from 0 to 1 and
    phases spread evenly.
    """
    k = np.arange(pairs)
    u = (k + 0.5) / pairs
    phase = (k * (math.sqrt(5.0) - 1.0) / 2.0) % 1.0
    target = np.stack([k * (8.0 + 2.0 * step), np.zeros(pairs)], axis=1)
    flying = target + np.stack([u, -1.0 - (phase + 1.0) * step], axis=1)
    position = np.concatenate([target, flying])
    velocity = np.concatenate([np.zeros((pairs, 2)), np.tile([0.0, step], (pairs, 1))])
    scene = kt.Scene(position, velocity, 0.5)
    steps = math.ceil(2.0 / step + 3.0)
    run = run_snapshots(scene, 1.0, float(steps))
    return 1.0 - len({*run.contacts["a"].tolist()}) / pairs


def test_a_log_that_is_too_short_is_made_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = mixed()
    whole = run_snapshots(scene, 0.01, 1.0)
    monkeypatch.setattr(snapshots, "_ROOM", 3)
    again = run_snapshots(scene, 0.01, 1.0)
    assert listed(again) == listed(whole)
    np.testing.assert_array_equal(again.position, whole.position)


def test_the_deepest_overlap_is_that_of_all_pairs() -> None:
    random = np.random.default_rng(5)
    position: npt.NDArray[np.float64] = random.uniform(size=(40, 2))
    radius = random.uniform(0.01, 0.1, 40)
    a, b = np.triu_indices(40, 1)
    depth = (radius[a] + radius[b] - np.hypot(*(position[a] - position[b]).T)) / np.minimum(
        radius[a], radius[b]
    )
    assert deepest_overlap(position, radius) == pytest.approx(depth.max(), rel=1e-14)
    assert deepest_overlap(position, radius * 1e-3) == 0.0


def test_no_bodies_and_no_time() -> None:
    empty = kt.Scene(np.empty((0, 2)), np.empty((0, 2)), 1.0, arena=(1.0, 1.0))
    for finder in FINDERS:
        assert len(run_snapshots(empty, 0.1, 1.0, finder=finder).contacts) == 0
    assert run_snapshots(mixed(), 0.1, 0.0).steps == 0
    assert run_snapshots(mixed(), 0.1, 1.0).steps == 10
    assert run_snapshots(mixed(), 0.3, 1.0).steps == 4
