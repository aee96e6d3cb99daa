"""The audit of sorted bounds: nothing to say of sound runs, and each thing that is broken by hand is told."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import AuditError
from kinetile.kernel.pairs import add_pair, remove_pair
from kinetile.kernel.tables import NEVER, STRUCTURAL
from kinetile_plugins.sweep_and_prune import PLACE
from lanes import first
from tilings import columns, lattice

PHASES = ("sap-1d", "sap-2d")


def running(phase: str) -> kt.Simulation:
    """Return a simulation between two events."""
    sim = kt.Simulation(kt.make_scene("grid", bodies=25, density=0.3, seed=3), phase, audit=1)
    sim.run(max_contacts=20)
    return sim


def audited(sim: kt.Simulation) -> None:
    """Audit now."""
    sim.run(max_contacts=0)


def list_of(sim: kt.Simulation) -> np.ndarray:
    """Return the bounds on x from left to right, to be changed in place."""
    return sim._engine.state.order[1 : 1 + 2 * len(sim.scene)]


def places_of(sim: kt.Simulation, bounds: np.ndarray) -> np.ndarray:
    """Return where the numbers of the places of bounds stand in ``state.bounds``."""
    return bounds + PLACE


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize(("phase", "options"), [("sap-1d", {}), ("sap-1d", {"axis": "y"}), ("sap-2d", {})])
@pytest.mark.parametrize("block", first(1, range(4)))
def test_sound_runs_pass_ties_and_all(phase, options, block):
    for seed in range(10 * block, 10 * block + 10):
        for scene in (lattice(seed, jitter=False), lattice(seed, jitter=True), columns(seed)):
            kt.Simulation(scene, phase, options=options, audit=1).run(max_contacts=30, until=20.0)


@pytest.mark.parametrize("phase", PHASES)
def test_a_few_sound_contacts_pass(phase):
    audited(running(phase))


def bound_twice(sim):
    list_of(sim)[0] = list_of(sim)[1]


def wrong_rank(sim):
    two = places_of(sim, list_of(sim)[:2])
    sim._engine.state.bounds[two] = sim._engine.state.bounds[two[::-1]]


def wrong_order(sim):
    """Two neighbours exchanged: their certificates are not those of the plans any more."""
    order = list_of(sim)
    body = order // 8
    place = next(i for i in range(10, 40) if body[i] != body[i + 1])
    order[[place, place + 1]] = order[[place + 1, place]]
    sim._engine.state.bounds[places_of(sim, order)] = 1 + np.arange(len(order))


def gap_unwatched(sim):
    bounds = sim._engine.state.bounds
    bounds[next(bound for bound in list_of(sim) if bounds[bound] != NEVER)] = NEVER


def last_watched(sim):
    sim._engine.state.bounds[list_of(sim)[-1]] = 2**60


def certificate_dropped(sim):
    queue = sim._engine.k.queue
    queue[int(np.flatnonzero((queue.own != NEVER) & (queue.kind != STRUCTURAL))[0])].own = NEVER


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (bound_twice, "the list of x does not have each bound once"),
        (wrong_rank, "the ranks of x are not those of its list"),
        (wrong_order, r"bounds [LR]\(\d+\) and [LR]\(\d+\) on x pass .*, but are watched"),
        (gap_unwatched, r"pass at tick .*, but are watched never"),
        (last_watched, "the last bound on x has no neighbour, but is watched at tick"),
        (certificate_dropped, r"body \d+ is scheduled never, but its bounds pass at tick"),
    ],
)
def test_a_list_that_is_broken_by_hand(change, said, phase):
    sim = running(phase)
    change(sim)
    with pytest.raises(AuditError, match=said):
        audited(sim)


@pytest.mark.parametrize("phase", PHASES)
def test_a_pair_too_few(phase):
    sim = running(phase)
    a, b = next(
        (int(a), int(b))
        for a, b in sim.candidate_pairs()
        if np.hypot(*(sim.positions()[a] - sim.positions()[b])) > 1.01 * sum(sim.scene.radius[[a, b]])
    )
    remove_pair(sim._engine.k, a, b)
    with pytest.raises(
        AuditError, match=rf"intervals of bodies {a} and {b} overlap, and they are not a cand"
    ):
        audited(sim)


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("held", [True, False])
def test_a_pair_too_many(phase, held):
    sim = running(phase)
    pairs = set(map(tuple, sim.candidate_pairs().tolist()))
    pair = min(pairs if held else {(a, b) for a in range(25) for b in range(a + 1, 25)} - pairs)
    add_pair(sim._engine.k, *pair)
    twice = "is held 2 times, and overlaps 1 times"
    said = twice if held else "are a candidate pair, and their intervals do not overlap"
    with pytest.raises(AuditError, match=said):
        audited(sim)
