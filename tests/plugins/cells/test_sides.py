"""The width and the number of cells, and the values of the option ``side``."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from grids import few_wide_many_small, in_the_open, state_of
from kinetile.errors import Refused
from kinetile_plugins.cells.layout import empty, sides_for


def test_a_side_that_is_narrower_than_every_body_is_refused_with_the_least_that_is_not():
    scene = kt.make_scene("random", bodies=20, radius_ratio=8.0, seed=1)
    narrow = float(2.0 * scene.radius.min())
    with pytest.raises(Refused, match="narrower than the smallest body of this scene") as caught:
        kt.Simulation(scene, "cells", options={"side": narrow})
    least = float(str(caught.value).split("at least ")[1].split(",")[0])
    kt.Simulation(scene, "cells", options={"side": least}).run(max_contacts=5)


def test_a_wider_body_goes_to_the_first_level_that_is_not_narrower():
    scene = kt.Scene([[1, 1], [2, 3], [7, 5], [7, 1]], np.zeros((4, 2)), [0.1, 0.4, 1.9, 0.1], arena=(10, 10))
    state = state_of(kt.Simulation(scene, "cells", options={"side": 0.25}))
    assert state.levels.side.tolist() == [0.25, 1.0, 4.0]
    assert state.homes.level.tolist() == [0, 1, 2, 0]


def test_dense_bodies_of_one_size_have_narrow_cells_and_sparse_ones_two_or_three_a_cell():
    dense = kt.make_scene("random", bodies=4, density=0.4, seed=1)
    sparse = kt.make_scene("grid", bodies=400, density=0.01)
    (side,) = sides_for(dense, None)
    assert side == pytest.approx(1.65 / 2.0 - dense.radius.max(), rel=1e-2)
    assert sides_for(sparse, None) == [pytest.approx(1.65 / 20.0 - sparse.radius[0], rel=1e-2)]


def test_small_bodies_that_crowd_get_a_level_of_their_own_and_few_do_not():
    assert len(sides_for(few_wide_many_small(50, 100.0, 1), None)) == 1
    assert len(sides_for(few_wide_many_small(800, 100.0, 1), None)) == 2


@settings(deadline=None)
@given(
    radius=st.lists(st.floats(2.0**-200, 2.0**90), min_size=1, max_size=40),
    spread=st.floats(0.0, 2.0**200),
    narrow=st.one_of(st.none(), st.floats(1.01, 1e9)),
    arena=st.booleans(),
)
def test_any_sizes_get_cells_that_are_wide_enough_and_not_too_many(radius, spread, narrow, arena):
    """The scene's bodies may overlap here: only sizes and places are laid out."""
    n = len(radius)
    scene = kt.Scene.__new__(kt.Scene)
    place = np.column_stack([np.linspace(0.0, spread, n), np.zeros(n)])
    for name, value in (("position", place), ("radius", np.array(radius)), ("shapes", ())):
        object.__setattr__(scene, name, value)
    object.__setattr__(scene, "arena", (max(spread, 1.0), 1.0) if arena else None)
    sides = sides_for(scene, None if narrow is None else 2.0 * min(radius) * narrow)
    state = empty(scene, sides)
    steps = np.log2(np.array(sides) / sides[0])
    assert (steps == np.floor(steps)).all()
    assert (np.diff(sides) > 0.0).all()
    assert (state.levels.side[state.homes.level] >= 2.0 * np.array(radius)).all()
    assert len(state.lists) <= len(sides) * (8 * n + 40)
    assert (state.levels.columns >= 3).all()
    assert (state.levels.cells >= 3 * state.levels.columns).all()


@pytest.mark.parametrize(("density", "open_plane"), [(0.5, False), (0.01, True)])
def test_the_state_takes_no_more_than_100_bytes_a_body(density, open_plane):
    random = np.random.default_rng(1)
    n = 100_000
    radius = math.sqrt(density / n / math.pi)
    row = np.arange(317) / 317 + 1 / 634
    place = np.stack(np.meshgrid(row, row), axis=-1).reshape(-1, 2)[:n]
    scene = kt.Scene(place, random.normal(size=(n, 2)), radius, arena=(1.0, 1.0))
    scene = in_the_open(scene) if open_plane else scene
    state = empty(scene, sides_for(scene, None))
    assert sum(array.nbytes for array in state) <= 100 * n


def test_cells_are_as_wide_as_what_reaches_farthest_to_a_side():
    lattice = [(0.5 + 1.01 * column, 0.5 + 1.01 * row) for row in range(20) for column in range(20)]
    bricks = kt.Scene(
        lattice, [(0, 0)] * 400, shape=[0, 1] * 200, shapes=[kt.box(1.0, 0.25), kt.box(0.25, 0.875)]
    )
    state = empty(bricks, sides_for(bricks, None))
    assert state.levels.widest.tolist() == [0.5]
    assert sides_for(bricks, 1.001)[0] == 1.001
    with pytest.raises(Refused, match="narrower than the smallest body"):
        kt.Simulation(bricks, "cells", options={"side": 0.875})
    kt.Simulation(bricks, "cells", options={"side": 0.876})
