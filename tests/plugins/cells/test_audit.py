"""The audit finds its faults: a state that is broken by hand, and the sentence about it."""

import numpy as np
import pytest

import kinetile as kt
from grids import state_of
from inside import engine_of
from kinetile.errors import AuditError
from kinetile.toolbox import schedule
from messages import table


@pytest.fixture
def sim() -> kt.Simulation:
    """Ten small discs in one cell of the finest level, one wide disc two levels above."""
    position = [[0.05 + 0.02 * i, 0.1] for i in range(10)] + [[0.7, 0.7]]
    scene = kt.Scene(position, np.full((11, 2), 0.25), [0.005] * 10 + [0.25], arena=(1.0, 1.0))
    found = kt.Simulation(scene, "cells", options={"side": 0.25})
    state = state_of(found)
    assert (state.homes.level[10], len(state.levels), state.blocks[7]) == (1, 2, 7)
    assert said(found) == ""
    return found


def said(sim: kt.Simulation) -> str:
    return "\n".join(engine_of(sim).composition.broad.audit(engine_of(sim).k, engine_of(sim).state))


def put(record, **values) -> None:
    for name, value in values.items():
        record[name] = value


def broken(sim, change) -> str:
    change(state_of(sim))
    return said(sim)


test_message = table(globals())


def copy_a_block(state) -> None:
    state.blocks[8 * 7] = state.blocks[0]
    state.blocks[8 * 7 + 7] = 1


def test_plans_and_certificates_that_are_not_those_of_the_cells(sim):
    level, k = state_of(sim).levels[0], engine_of(sim).k
    level.slack *= 1.0 + 2.0**-20
    schedule(k, 3, int(k.queue.certificate[3]) + 1)
    k.bodies[4].x += 0.5
    assert f"level 0 has cells of side 0.25: too narrow for a slack of {level.slack}" in said(sim)
    assert "body 3 reaches an edge at tick" in said(sim)
    assert "body 4 is at x = 0.63, outside cell 0 of side 0.25" in said(sim)
    with pytest.raises(AuditError):
        sim.audit()
