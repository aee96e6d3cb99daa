"""Bounds sorted along lines of any direction and number: contacts of naive, and refusals."""

import numpy as np
import pytest

import kinetile as kt
from agreement import agree, lattice_scene
from kinetile.errors import Refused
from kinetile.plugin.choices import read_phase
from kinetile_plugins.sweep_and_prune import SweepAndPrune, SweepAndPruneBoxes, SweepAndPruneMany
from lanes import first

LINES = ("sap-1d:axis=3:4", "sap-1d:axis=-1:1", "sap-1d:axis=auto", "sap-k", "sap-k:directions=x+2:-1")
LIVING = [kt.Remove(3, 0.25), kt.Insert(0.5, (3.5, 0.5), (-1.0, 0.25), 0.125), kt.Turn(0, 0.5, (1.0, -0.5))]
PLACES = [(0.5 + i % 4, 0.5 + i // 4) for i in range(12)]
VELOCITIES = [((7 * i % 5 - 2) / 2, (3 * i % 7 - 3) / 4) for i in range(12)]
OUTLINES = [kt.box(0.5, 0.25), kt.disc(0.25), kt.polygon([(-0.25, -0.25), (0.25, -0.25), (0.0, 0.25)])]
SCENES = {
    "walls": kt.Scene(PLACES, VELOCITIES, 0.25, arena=(4.0, 3.0)),
    "living": kt.Scene(PLACES, VELOCITIES, 0.25, arena=(4.0, 3.0), commands=LIVING),
    "far from the origin": kt.Scene(
        np.add(PLACES, (1e6, -3e6)), [(2.0 - x, 1.0 - y) for x, y in PLACES], 0.25
    ),
    "shapes": kt.Scene(
        PLACES, VELOCITIES, shape=[i % 3 for i in range(12)], shapes=OUTLINES, arena=(4.0, 3.0)
    ),
    "sizes": kt.make_scene("random", bodies=14, density=0.3, radius_ratio=40.0, seed=2),
    "nobody": kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 0.25),
}


def under(phase: str, scene: kt.Scene, **more) -> kt.Simulation:
    name, options = read_phase(phase)
    return kt.Simulation(scene, name, options=options, **more)


@pytest.mark.parametrize("name", first(2, [*SCENES, *range(40)]))
def test_the_contacts_are_those_of_naive_and_the_audit_holds(name):
    scene = SCENES[name] if name in SCENES else lattice_scene(name)
    sims = agree(scene, "naive", *LINES, until=10.0, contacts=12, audit=4)
    assert all(sim.drawing() is not None for sim in sims)
    assert len(sims[0].contacts) >= 12 or name not in SCENES or not len(scene)


def test_one_and_two_lines_along_the_axes_are_the_loops_of_sap_1d_and_sap_2d():
    scene = SCENES["walls"]
    for one, other in (
        (SweepAndPruneMany(directions=1), SweepAndPrune()),
        (SweepAndPruneMany(directions="y"), SweepAndPrune(axis="y")),
        (SweepAndPruneMany(directions="y+x"), SweepAndPruneBoxes()),
    ):
        parts = [each.prepare(scene) for each in (one, other)]
        hooks = [(each.build, each.repair, each.replan) for each in parts]
        assert hooks[0] == hooks[1]


def test_directions_share_a_loop():
    ways = [SweepAndPrune(axis=axis).prepare(SCENES["walls"]) for axis in ("3:4", "1:-7", "auto")]
    assert len({parts.repair for parts in ways}) == 1


@pytest.mark.parametrize(("angle", "wanted"), [(0.0, (0, 1)), (90.0, (1, 0)), (45.0, (-1, 1))])
def test_auto_takes_the_line_across_two_streams_and_again_when_built_anew(angle, wanted):
    """Bodies that fly against each other along a line pass each other on it, and not across it."""
    turn = np.exp(1j * np.radians(angle))
    lanes = np.arange(5) + 1j * np.arange(5)[:, None]
    place, fly = (
        (lanes * turn).ravel(),
        (turn * np.where(np.arange(5)[:, None] % 2, 1.0, -1.0) + 0 * lanes).ravel(),
    )
    scene = kt.Scene(np.c_[place.real, place.imag], np.c_[fly.real, fly.imag], 0.25)
    sim = under("sap-1d:axis=auto", scene)
    assert tuple(sim.state.ways) == wanted
    sim.run(until=0.5)
    assert tuple(under("sap-1d:axis=auto", scene).state.ways) == wanted
    sim.restore(sim.snapshot())
    assert tuple(sim.state.ways) == wanted


@pytest.mark.parametrize(
    "recipe", first(1, ["break", "figure-16", "grid", "random", "hexagonal", "figure-11"])
)
def test_auto_costs_hardly_more_than_x_on_recipes(recipe):
    """In a break one ball moves, along x: the line across it had twice the exchanges, once all moved."""
    sims = [under(phase, kt.make_scene(recipe)) for phase in ("sap-1d:axis=x", "sap-1d:axis=auto")]
    for sim in sims:
        sim.run(until=20.0, max_contacts=300)
    x, auto = (sim.readings.structural_events + sim.readings.partners_asked for sim in sims)
    assert auto < 1.15 * x


@pytest.mark.parametrize("phase", LINES)
def test_a_periodic_axis_is_refused_with_what_to_do(phase):
    scene = kt.Scene(PLACES, VELOCITIES, 0.25, arena=(4.0, 3.0), periodic="y")
    with pytest.raises(Refused, match=r"periodic along y: .* no circle on such a line; sort along x or y"):
        under(phase, scene)
