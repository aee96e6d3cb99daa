"""Rule 11h: what accelerations press together hops, and nothing that can move is a jam."""

import math

import numpy as np
import pytest

import kinetile as kt
import lanes
from agreement import agree

INF, PHASES = math.inf, ("naive", "cells", "sap-1d", "sap-2d")
BALL, PEG = (2.0, 1.5), (2.0, 1.0)


def on_a_peg(response, velocity=(0.0, 0.0), aside=0.0, until=0.004, **more):
    """A ball that touches a fixed or moving disc from above, a little aside."""
    given = {"mass": [INF, 1.0], "arena": (4.0, 4.0), "gravity": (0.0, -1.0), "responses": response, **more}
    places = [PEG, (BALL[0] + aside, PEG[1] + math.sqrt(0.25 - aside * aside) + 1e-12)]
    return kt.Scene(places, [velocity] * 2, 0.25, settings=kt.Settings(until=until), **given)


def lossy(e, contact_time=2.0**-8, **more):
    return kt.Response("restitution", e=e, contact_time=contact_time, **more)


@pytest.mark.parametrize("response", ["elastic", "stop", lossy(0.0), lossy(0.9)])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.5, 0.25)])
def test_what_touched_without_speed_met_endlessly_at_one_tick(response, velocity):
    sims = agree(on_a_peg(response, velocity), *PHASES, until=0.004)
    gap = sims[0].positions()[1, 1] - sims[0].positions()[0, 1] - 0.5
    assert 0.0 <= gap < 2.0**-18
    assert len(sims[0].contacts) <= 0.004 * 2.0**14 + 2


@pytest.mark.slow
@pytest.mark.own_loop
@pytest.mark.compiled
@pytest.mark.parametrize("contact_time", [1e-3, 1e-6])
def test_a_disc_that_slid_off_a_fixed_one_ended_as_a_jam(contact_time):
    for e in (0.05, 0.3, 0.6, 0.95):
        for aside in (0.0005, 0.00556, 0.03):
            sim = kt.Simulation(on_a_peg(lossy(e, contact_time), aside=aside, until=9.0), "naive")
            sim.run()
            assert sim.time == 9.0
            assert sim.positions()[1, 0] > 2.5  # it has left the peg


@pytest.mark.parametrize("settle", [None, 0.5])
@pytest.mark.parametrize("velocity", [(0.5, 0.0), (0.0, 0.5), (0.0, 0.0)])
def test_what_rode_on_a_support_that_moves_left_it(velocity, settle):
    box, deck = kt.box(0.5, 0.5), kt.box(2.0, 0.5)
    land = lossy(0.05, **({} if settle is None else {"settle": settle}))
    scene = kt.Scene(
        [(1.5, 1.0), (1.5, 1.5)], [velocity, velocity], shapes=[deck, box], shape=[0, 1], mass=[INF, 1.0],
        arena=(4.0, 4.0), gravity=(0.0, -1.0), responses=land,
    )  # fmt: skip
    sim = agree(scene, *PHASES, until=0.5)[0]
    apart = sim.velocities()[1] - sim.velocities()[0]
    assert abs(apart[1]) <= 2.0**-8 * (1 + 1e-9)
    assert apart[0] == 0.0
    assert (settle is not None) == (sim.supports()[1] != ())


def test_a_pile_of_what_stops_was_a_jam():
    places = [(2.0, 0.25), (2.0, 0.75), (2.0, 1.25)]
    scene = kt.Scene(places, [(0.0, 0.0)] * 3, 0.25, arena=(4.0, 4.0), gravity=(0.0, -1.0), responses="stop")
    sim = agree(scene, "naive", "cells", until=0.0001)[0]
    assert abs(sim.positions() - places).max() < 1e-6


@pytest.mark.parametrize("settle", [None, 0.5])
@pytest.mark.parametrize("count", lanes.first(1, [3, 6]))
def test_a_stack_of_bodies_without_bounce_was_a_jam(count, settle):
    land = lossy(0.0, **({} if settle is None else {"settle": settle}))
    places = [(1.0, 0.25 + 0.5 * each) for each in range(count)]
    scene = kt.Scene(
        places, [(0.0, 0.0)] * count, 0.25, arena=(2.0, 4.0), gravity=(0.0, -1.0), responses=land
    )
    sim = agree(scene, "naive", "cells", until=0.02)[0]
    assert abs(sim.positions() - places).max() < 1e-4
    assert len(sim.contacts) < 20 * count * count


def overlap(sim):
    """The deepest overlap of two discs, or of one and the floor; below 0: the least gap."""
    place, r = sim.positions(), sim.scene.radius
    apart = np.hypot(*(place[:, None] - place).T) - (r[:, None] + r)
    np.fill_diagonal(apart, np.inf)
    return -min(apart.min(), (place[:, 1] - r).min())


def test_a_disc_on_a_floor_keeps_its_place_to_g_t_squared_by_8():
    t = 2.0**-8
    scene = kt.Scene(
        [(1.0, 0.5)], [(0.0, 0.0)], 0.5, arena=(2.0, 2.0), gravity=(0.0, -8.0), responses=lossy(0.3, t)
    )
    heights = []
    sim = agree(scene, *PHASES, until=0.125)[0]
    assert len(sim.contacts) <= 0.125 / t + 2
    sim = kt.Simulation(scene, "naive")
    for moment in range(1, 200):
        sim.run(0.125 * moment / 200)
        heights.append(sim.positions()[0, 1] - 0.5)
    assert min(heights) >= -1e-15
    assert 0.99 < max(heights) / (8.0 * t * t / 8) < 1 + 1e-9


@pytest.mark.parametrize("bodies", lanes.first(1, [30, 60]))
def test_a_heap_had_contacts_in_proportion_to_its_depth(bodies):
    t = 2.0**-7
    scene = kt.make_scene("heap", bodies=bodies, columns=6, contact_time=t)
    sim = agree(scene, "naive", "cells", "sweep-tiling", until=0.5)[0]
    lying = sim.contacts["time"] > 0.375
    assert 0.1 < lying.sum() * t / (0.125 * bodies) < 0.5
    assert overlap(sim) < 1e-14


@pytest.mark.slow
@pytest.mark.own_loop
@pytest.mark.compiled
@pytest.mark.parametrize("bodies", [1000, 2000])
def test_a_heap_of_many_layers_has_at_most_a_contact_of_each_body_in_a_contact_time(bodies):
    t = 1e-3
    scene = kt.make_scene("heap", bodies=bodies, columns=36, contact_time=t)
    sims = [kt.Simulation(scene, phase, keep_contacts=False) for phase in ("cells", "sweep-tiling")]
    for sim in sims:
        sim.run(5.0)
        contacts = sim.readings.contacts
        deepest = []
        for moment in range(1, 11):
            sim.run(5.0 + 0.1 * moment)
            deepest.append(overlap(sim))
        assert sim.readings.contacts - contacts < 1.1 * bodies / t
        assert max(deepest) < 1e-13
    assert sims[0].fingerprint == sims[1].fingerprint
