"""The engine's knowledge of its tables between two chunks."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from inside import engine_of
from kinetile.kernel.tables import slots_taken
from lanes import examples

ROOMS = [(0.1 + 0.2 * column, 0.1 + 0.2 * row) for column in range(5) for row in range(5)]


@given(st.lists(st.tuples(st.sampled_from(["insert", "remove", "run"]), st.integers(0, 24)), max_size=12))
@settings(max_examples=examples(50), deadline=None)
def test_occupied_slots_are_those_that_sorting_all_numbers_gives(steps):
    """Planned bodies have lower numbers than bodies by hand that come before them."""
    planned = tuple(kt.Insert(0.1 * at, ROOMS[at], (0.0, 0.0), 0.01) for at in range(1, 5))
    scene = kt.Scene([ROOMS[0]], [(0.0, 0.0)], 0.01, arena=(1.0, 1.0), commands=planned)
    sim = kt.Simulation(scene, "cells", live=True, room=40)
    free, there = ROOMS[5:], dict[int, tuple[float, float]]()
    for what, which in steps:
        if what == "insert" and free:
            place = free.pop(which % len(free))
            there[sim.insert(place, radius=0.01)] = place
        elif what == "remove" and there:
            number = sorted(there)[which % len(there)]
            free.append(there.pop(number))
            sim.remove(number)
        elif what == "run":
            sim.run(until=sim.time + 0.1)
        if which % 2:  # else two changes are seen at once
            assert engine_of(sim).taken.tolist() == slots_taken(engine_of(sim).k).tolist()
    assert engine_of(sim).taken.tolist() == slots_taken(engine_of(sim).k).tolist()
    assert np.array_equal(sim.bodies, np.unique(sim.bodies))
