"""``power``: the contacts of the reference, a structure that is true between events, and refusals."""

import numpy as np
import pytest

import kinetile as kt
from agreement import agree, lattice_scene
from kinetile.errors import Refused
from lanes import first


def same(scene: kt.Scene, until: float, audit: int | None = None) -> None:
    sims = agree(scene, "naive", "power", until=until, contacts=120, audit=audit)
    assert len(sims[0].contacts) > 0


@pytest.mark.parametrize("seed", first(1, [1, 0, *range(2, 40)]))
def test_lattices_with_exact_ties(seed):
    same(lattice_scene(seed), 1.5, audit=9)


@pytest.mark.parametrize("ratio", first(1, [100.0, 1.0, 10.0, 1000.0]))
def test_mixtures(ratio):
    scene = kt.make_scene("random", bodies=24, density=0.2, radius_ratio=ratio, mass_ratio=50.0, seed=4)
    same(scene, 1.0, audit=20)


APART = [(50, 1500.0, 0.2, 1), (1000, 100.0, 0.3, 1), (1000, 200.0, 0.05, 3), (1000, 400.0, 0.3, 1)]


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize(("bodies", "ratio", "density", "seed"), first(1, APART))
def test_radii_far_apart(bodies, ratio, density, seed):
    """What rounding may make of a certificate was taken at the time for which it fails, not at the present:
    scenes as the second one stalled, for slivers beside small discs flipped too late."""
    scene = kt.make_scene(
        "random", bodies=bodies, density=density, radius_ratio=ratio, mass_ratio=100.0, seed=seed
    )
    agree(scene, "cells", "power", contacts=2000, audit=1000)


@pytest.mark.parametrize("size", [2.0**-190, 2.0**100])
def test_a_scene_of_any_size(size):
    scene = kt.make_scene("grid", bodies=9, density=0.3, seed=1)
    scaled = (size * each for each in (scene.position, scene.velocity, scene.radius))
    same(kt.Scene(*scaled, arena=(size, size)), 0.5)


def test_a_row_of_small_discs_at_a_wall_stalled():
    """An edge that failed at the end of a tick was watched again at that tick, without end: its sites were
    rounded once more than its certificate's."""
    places = [(0.9996, y) for y in (0.4557, 0.4563, 0.457, 0.4576)]
    speeds = [(0.3173, 1.0581), (0.0, 0.0), (-0.8908, -0.5851), (0.0, 0.0)]
    same(kt.Scene(places, speeds, 2.0**-12, arena=(1.0, 1.0)), 0.002)


def test_insertions_and_removals_leave_no_edge_to_flip():
    """One that was left would flip in an event, at once: only the costs would be others."""
    scene = kt.make_scene("random", bodies=24, density=0.2, radius_ratio=4.0, seed=3)
    sim = kt.Simulation(scene.replace(velocity=[(0.0, 0.0)] * 24), "power", audit=1)
    for body in range(0, 24, 2):
        sim.remove(body)
    for body in range(0, 24, 4):
        sim.insert(scene.position[body], radius=scene.radius[body])
    sim.run(until=1.0)
    assert sim.readings.structural_events == 0


def test_edges_that_an_insertion_or_a_removal_makes_are_watched():
    """And their ends are queued: of edges to a body with a large number the other ends are the owners."""
    sim = kt.Simulation(kt.make_scene("random", bodies=20, density=0.2, radius_ratio=4.0), "power", live=True)
    for body in (19, 0, 17, 2):
        sim.run(max_contacts=2)
        sim.remove(body)
        sim.audit()
        sim.insert_many(np.random.default_rng(body).random((4, 2)), (0.25, 0.125), radius=1e-3)
        sim.audit()


def test_edges_of_four_bodies_in_the_places_of_a_square_and_of_one_alone():
    for bodies in (1, 4):
        same(kt.make_scene("grid", bodies=bodies, density=0.2, seed=2), 4.0, audit=4)


def test_an_inserted_body_is_refused_where_its_radius_is():
    scene = kt.Scene([[0.25, 0.5], [0.75, 0.5]], [[1.0, 0.0], [-1.0, 0.0]], 0.125, arena=(1.0, 1.0))
    sim = kt.Simulation(scene, "power", live=True)
    sim.run(until=0.0625)
    with pytest.raises(Refused, match="power is for bodies that are at most 16384"):
        sim.insert((0.5, 0.25), radius=3e-5)
