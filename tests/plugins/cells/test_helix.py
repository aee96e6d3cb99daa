"""The helix of places: what adjoins in the plane adjoins in the table; and which bodies are near."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kinetile as kt
from grids import in_the_open, state_of
from inside import engine_of
from kinetile.kernel.flight import positions_now
from kinetile.kernel.tables import NEVER
from kinetile_plugins.cells.layout import LEVEL, cell_of, cells_of, list_ahead, list_around, wrapped

AROUND = [(right, up) for up in (-1, 0, 1) for right in (-1, 0, 1)]
AHEAD = [(-1, 0), (1, 0), (0, -1), (0, 1)]


def part_of_a_table(columns: int, rows: int, first: int) -> np.recarray:
    """Returns a level of a table, whose first cell has a number."""
    level = np.zeros(1, LEVEL).view(np.recarray)
    level.columns, level.cells, level.first = columns, columns * rows, first
    return level


@given(
    columns=st.integers(3, 1000),
    rows=st.integers(3, 1000),
    first=st.sampled_from([0, 9, 10**9]),
    x=st.integers(-(2**45), 2**45),
    y=st.integers(-(2**35), 2**35),
)
def test_a_step_in_the_plane_is_a_step_in_the_table(columns, rows, first, x, y):
    """Nine cells have nine places, and a body that steps from one to the next finds the one of that cell."""
    grid = part_of_a_table(columns, rows, first)
    cell = int(cell_of(grid[0], float(x), float(y)))
    assert cell == first + (x + y * columns) % (columns * rows)
    places = [int(wrapped(grid[0], cell + right + up * columns)) for right, up in AROUND]
    assert len(set(places)) == 9
    for (right, up), place in zip(AROUND, places, strict=True):
        assert place == int(cell_of(grid[0], float(x + right), float(y + up)))
        assert place == cells_of(grid, np.array([float(x + right)]), np.array([float(y + up)]))[0]


@pytest.mark.parametrize("arena", [True, False])
@pytest.mark.parametrize("crowded", [False, True])
def test_who_is_at_home_around_each_place_of_the_table(arena, crowded):
    """The ends and the middle of the whole table: with blocks alone, and with lists."""
    scene = kt.make_scene("grid", bodies=100, density=0.25, seed=4)
    options = {"side": 0.4 if crowded else 0.12}
    sim = kt.Simulation(scene if arena else in_the_open(scene, (-0.3, 7.0)), "cells", options=options)
    state, k = state_of(sim), engine_of(sim).k
    grid = state.levels[0]
    columns, cells = int(grid.columns), int(grid.cells)
    assert (state.lists.max() >= 0) == crowded
    for cell in range(cells):
        places = [(cell + right + up * columns) % cells for right, up in AROUND]
        count = list_around(k, state, 0, cell, 0)
        at_home = np.flatnonzero(np.isin(state.homes.cell, places))
        assert sorted(k.near[:count].tolist()) == at_home.tolist()
        for right, up in AHEAD:
            places = [(cell + right + a * up + (up + a * right) * columns) % cells for a in (-1, 0, 1)]
            count = list_ahead(k, state, 0, cell, right, up, 3)
            at_home = np.flatnonzero(np.isin(state.homes.cell, places))
            assert sorted(k.near[3:count].tolist()) == at_home.tolist()


def test_near_names_no_body_from_afar():
    scene = kt.make_scene("grid", bodies=100, density=0.25)
    sim = kt.Simulation(scene, "cells")
    sim.run(max_contacts=50)
    level = state_of(sim).levels[0]
    place = positions_now(engine_of(sim).k)
    found = sim.candidate_pairs()
    assert 100 < len(found) < 1500
    assert (np.abs(place[found[:, 0]] - place[found[:, 1]]) <= 2.0 * (level.side + level.slack)).all()


def test_a_body_at_rest_has_no_certificate():
    position = [[0.25, 0.25], [0.75, 0.75]]
    sim = kt.Simulation(kt.Scene(position, [[0.0, 0.0], [0.0, -0.5]], 0.1, arena=(1.0, 1.0)), "cells")
    sim.build()
    own = engine_of(sim).k.queue.certificate
    assert own[0] == NEVER
    assert own[1] < NEVER


def test_cells_a_whole_turn_apart_share_a_place_and_cost_time_alone():
    """In the open: two discs that meet, and two exactly one turn of the table away, which are near them."""
    at = np.array([[0.5, 0.5], [1.5, 0.5]])
    sim = kt.Simulation(
        kt.Scene(np.vstack([at, at + np.array([3.0, 5.0])]), np.array([[1, 0], [-1, 0]] * 2), 0.25),
        "cells",
        options={"side": 1.0},
    )
    level = state_of(sim).levels[0]
    assert (level.columns, level.cells) == (3, 15)
    sim.run(until=1.0)
    assert sim.contacts[["a", "b"]].tolist() == [(0, 1), (2, 3)]
