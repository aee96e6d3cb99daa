"""The audit notices what it is there for: a state that is broken by hand, and the sentence about it."""

import numpy as np
import pytest

import kinetile as kt
from grids import state_of
from kinetile.errors import AuditError
from kinetile.toolbox import schedule


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
    return "\n".join(sim._engine.composition.broad.audit(sim._engine.k, sim._engine.state))


def put(record, **values) -> None:
    for name, value in values.items():
        record[name] = value


def copy_a_block(state) -> None:
    state.blocks[8 * 7] = state.blocks[0]
    state.blocks[8 * 7 + 7] = 1


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            lambda s: put(s.homes[3], way=0),
            ["body 3 reaches edge 1 of its cell first, and edge 0 is noted"],
        ),
        (
            copy_a_block,
            ["listed in cell 7 of the table, and is at home in cell 0", "2 times in the table"],
        ),
        (
            lambda s: np.put(s.lists, 0, -1),
            ["0 cells of level 0 have a list, and 1 are counted", "0 times in the table"],
        ),
        (lambda s: np.put(s.blocks, 7, 6), ["cell 0 has a list beginning with 9, and counts 6"]),
        (
            lambda s: put(s.homes[3], cell=1),
            ["body 3 is at home in cell 1 of the table, where cell (0, 0) of the plane is not"],
        ),
        (
            lambda s: put(s.guests[3], cell=s.levels[1].first + 1),
            ["body 3 is a guest of level 1 in another cell than the one around its own"],
        ),
        (
            lambda s: np.put(s.hosts, s.levels[1].first, -1),
            ["level 1 has 0 guests, and 10 bodies are at home in finer ones"],
        ),
        (lambda s: put(s.guests[3], prev=7), ["cannot be read backwards"]),
        (lambda s: put(s.homes[10], level=0), ["body 10 is too wide for the cells of level 0"]),
        (lambda s: put(s.levels[1], widest=0.125), ["body 10 is too wide for the cells of level 1"]),
    ],
)
def test_a_state_that_is_broken_by_hand(sim, change, told):
    change(state_of(sim))
    assert all(sentence in said(sim) for sentence in told)


def test_plans_and_certificates_that_are_not_those_of_the_cells(sim):
    level, k = state_of(sim).levels[0], sim._engine.k
    level.slack *= 1.0 + 2.0**-20
    schedule(k, 3, int(k.queue.own[3]) + 1)
    k.bodies[4].x += 0.5
    assert f"level 0 has cells of side 0.25: too narrow for a slack of {level.slack}" in said(sim)
    assert "body 3 reaches an edge at tick" in said(sim)
    assert "body 4 is at x = 0.63, outside cell 0 of side 0.25" in said(sim)
    with pytest.raises(AuditError):
        sim._engine.audit()
