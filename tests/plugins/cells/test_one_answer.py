"""Cells give naive's contacts, bit for bit: with and without an arena, near and far, many sizes and ties."""

from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from agreement import agree, outcome
from grids import in_the_open, state_of
from lanes import first

SCENES = Path(__file__).parents[2] / "scenes"
SMALL = kt.make_scene("random", bodies=9, density=0.3, radius_ratio=3.0, mass_ratio=4.0, seed=2)
GRID = [(x, y) for x in (0.25, 0.5, 0.75) for y in (0.25, 0.5, 0.75)]
WAYS = np.array([(1, 0), (0, 1), (1, 1), (-1, 0), (0, 0), (0, -1), (1, -1), (-1, 1), (0.5, 0)])
AUDITED = {
    "small": SMALL,
    "small, in the open": in_the_open(SMALL, (-3.0, 100.0)),
    **{  # discs of radius 1/16 at multiples of 1/4, cells of side 1/4: every start is on a corner
        f"on corners, {sign}": kt.Scene(GRID, sign * WAYS, 0.0625, arena=(1.0, 1.0)) for sign in (1, -1)
    },
    **{  # cells are as wide as the scene needs that they have been prepared for, not as present bodies do
        path.stem: kt.load_scene(path) for path in sorted(SCENES.glob("wide-newcomer-*.toml"))
    },
}


@pytest.mark.parametrize("name", AUDITED)
def test_with_an_audit_at_every_contact(name):
    scene = AUDITED[name]
    sides = (2.1 * float(scene.radius.min()), 3.0) if name.startswith("small") else ()
    phases = (
        ["cells:side=0.25"] if "corners" in name else ["cells", *(f"cells:side={each}" for each in sides)]
    )
    sims = agree(scene, "naive", *phases, until=scene.settings.until or 4.0, contacts=16, audit=1)
    assert len(sims[0].contacts) > 1


def assert_naives(
    scene: kt.Scene, contacts: int = 300, until: float = 20.0, **options: float
) -> kt.Simulation:
    """Asserts that cells leave behind what naive does, and that their structure holds meanwhile."""
    _, wanted = outcome(scene, "naive", {}, until, contacts)
    sim, found = outcome(scene, "cells", options, until, contacts)
    assert found == wanted
    if found.ended == "ran":
        kt.Simulation(scene, "cells", options=options, audit=10).run(until=until, max_contacts=contacts // 4)
    return sim


def test_cells_that_the_skin_had_widened_were_narrower_than_a_body_by_a_rounding():
    near = kt.make_scene("random", bodies=50, density=0.25, radius_ratio=1.0, seed=1)
    sim = kt.Simulation(in_the_open(near, (1e12, 0.0)), "cells")
    sim.audit()
    assert sim.state.levels.slack[0] >= 0.0


@pytest.mark.compiled
@pytest.mark.parametrize("side", [0.09, 0.2, 1.0, 1e6, 1e300])
def test_any_number_of_bodies_in_a_cell(side):
    scene = kt.make_scene("grid", bodies=100, density=0.5)
    sim = assert_naives(scene, contacts=1000, side=side)
    assert (state_of(sim).lists.max() >= 0) == (side > 0.2)


@pytest.mark.compiled
@pytest.mark.parametrize("arena", [(40.0, 0.1), (0.1, 40.0), (2.0**100, 0.1)])
def test_thin_arenas(arena):
    position = np.full((30, 2), 0.05)
    position[:, 0 if arena[0] > arena[1] else 1] = 0.5 + np.arange(30)
    velocity = np.random.default_rng(3).uniform(-1.0, 1.0, (30, 2))
    assert_naives(kt.Scene(position, velocity, 0.03, arena=arena), contacts=600, until=100.0)


@pytest.mark.compiled
def test_four_thousand_bodies_of_all_sizes():
    scene = kt.make_scene("random", bodies=4000, density=0.25, radius_ratio=1000.0, seed=1)
    agree(scene, "naive", "cells", contacts=4000)


@pytest.mark.parametrize("bodies", first(1, [4, 60]))
def test_a_wide_body_is_inserted_by_hand(bodies):
    """With four bodies there is one level, with sixty that crowd there are more."""
    place = np.column_stack([0.5 + np.arange(bodies) % 10, 0.5 + np.arange(bodies) // 10]) * 0.25
    flight = np.column_stack([np.cos(np.arange(bodies)), np.sin(np.arange(bodies))])

    def play(sim):
        sim.run(until=0.5)
        sim.insert((9.0, 2.0), (-1.0, 0.25), 1.5)
        sim.run(until=8.0, max_contacts=300)

    scene = kt.Scene(place, flight, 0.1, arena=(12.0, 4.0))
    met = agree(scene, "naive", "cells", play=play, audit=1, live=True)[0].contacts[["a", "b"]].tolist()
    assert any(bodies in pair and min(pair) >= 0 for pair in met), "the wide one meets another body"


def test_without_a_name_cells_do_any_scene():
    """With walls or without, bodies that part and bodies that pass, and no body at all."""
    place, flight = [[0.25, 0.25], [0.75, 0.25]], [[1.0, 0.0], [-1.0, 0.5]]
    walled = kt.Scene(place, flight, 0.125, arena=(1.0, 1.0))
    assert kt.Simulation(walled).broad_phase == "cells"
    assert kt.Simulation(walled, narrow_phases=("wall",)).broad_phase == "cells"
    assert kt.Simulation(kt.Scene(place, flight, 0.125)).broad_phase == "cells"
    for arena in (None, (1.0, 1.0)):
        sim = kt.Simulation(kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 1.0, arena=arena), audit=1)
        sim.run(until=1.0)
        assert (sim.broad_phase, len(sim.contacts)) == ("cells", 0)
