"""Bodies that cannot move on: jams and squeezes, and what a program does with them."""

import math

import pytest

import kinetile as kt
from agreement import agree
from kinetile.errors import ZenoError

INF, PHASES = math.inf, ("naive", "cells", "sap-1d", "sap-2d")
PADDLES = {"mass": [1.0, INF, INF], "arena": (2.0, 2.0)}


def between_paddles(response="elastic", by=1.0):
    """A ball on a wall, on which two paddles close in."""
    places = [(1.0, 0.04), (0.93, 0.13), (1.07, 0.13)]
    velocities = [(0.0, 0.0), (0.6 * by, -1.3 * by), (-0.6 * by, -1.3 * by)]
    rules = None if response == "elastic" else response
    return kt.Scene(places, velocities, [0.03, 0.06, 0.06], responses=rules, **PADDLES)


def to_a_wall(speed=-1.0, balls=1):
    """Balls in a row between a wall and a paddle that moves towards it."""
    places = [(0.2 + 0.25 * i, 0.5) for i in range(balls)] + [(2.0, 0.5)]
    velocities = [(1.0, 0.0)] + [(0.0, 0.0)] * (balls - 1) + [(speed, 0.0)]
    return kt.Scene(places, velocities, [0.1] * balls + [0.2], mass=[1.0] * balls + [INF], arena=(3.0, 1.0))


def until_jammed(sim):
    with pytest.raises(ZenoError, match="is squeezed by immovable bodies"):
        sim.run(until=9.0, max_contacts=100_000)


@pytest.mark.parametrize(
    ("scene", "most"),
    [
        (between_paddles(), 10_000),
        (between_paddles(kt.Response("restitution", e=0.5, contact_time=1e-6)), 10_000),
        (between_paddles(kt.Response("restitution", e=0.5, contact_time=1e-3)), 10_000),
        (to_a_wall(), 10_000),
        (to_a_wall(balls=5), 20_000),
    ],
)
@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.own_loop
def test_a_squeeze_had_twenty_million_contacts_or_no_end(scene, most):
    sims = agree(scene, *PHASES, play=until_jammed)
    assert len(sims[0].contacts) <= most


@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.own_loop
def test_what_is_no_squeeze_was_not_taken_for_one():
    """A light disc between a heavy one and a wall has as many contacts as pi has digits; a slow wall, moving
    elsewhere, changes nothing of that."""
    scene = kt.Scene(
        [(2.0, 0.5), (1.0, 0.5), (5.0, 2.5)], [(-1.0, 0.0), (0.0, 0.0), (-1e-3, 0.0)], 0.1,
        mass=[1e8, 1.0, INF], arena=(30.0, 3.0),
    )  # fmt: skip
    sims = agree(scene, *PHASES, until=10.0)
    assert len(sims[0].contacts) == 31415


@pytest.mark.compiled
@pytest.mark.own_loop
@pytest.mark.slow
def test_a_program_had_to_catch_the_error_of_a_squeeze_and_run_again():
    told = []

    def release(sim, jam):
        told.append(jam.bodies)
        sim.set_velocities([1, 2], [(0.0, 0.0)])

    sim = kt.Simulation(between_paddles(), "cells")
    sim.run(until=0.1, max_contacts=100_000, on_jam=lambda jam: release(sim, jam))
    assert len(told) == 1
    again = kt.Simulation(sim.recorded(), "naive")  # which jammed before the command that ends the jam
    again.run(until=0.1, max_contacts=100_000)
    assert again.fingerprint == sim.fingerprint
    with pytest.raises(ZenoError):  # a function that changes nothing
        kt.Simulation(between_paddles(), "cells").run(until=0.1, on_jam=lambda jam: told.append(jam.bodies))
    assert len(told) == 2
