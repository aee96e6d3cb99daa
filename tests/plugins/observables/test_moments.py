"""Observables of sampled moments: compared with closed forms, with all pairs, and with equipartition."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import BadOption
from kinetile_observables import geometry
from kinetile_observables.geometry import displacement, neighbours
from kinetile_observables.moments import BondOrder, PairCorrelation, StructureFactor
from lanes import first


def simulation_of(radii, positions):
    return SimpleNamespace(bodies=np.arange(len(positions)), positions=lambda: positions, radii=lambda: radii)


def in_a_box(periodic):
    periods = tuple(side * (axis in periodic) for side, axis in zip((3.0, 2.0), "xy", strict=True))
    given = {"periodic": periodic, "periods": periods, "radius": np.zeros(1), "shapes": ()}
    return SimpleNamespace(arena=(3.0, 2.0), **given)


def test_a_free_body_moves_as_the_square_of_time():
    sim = kt.Simulation(kt.Scene([(0.0, 0.0)], [(3.0, 4.0)], 1.0, 2.0), "naive")
    sim.run(1.0, observe=["msd:every=0.125,lags=4", "vacf:every=0.125,lags=20", "energy", "momentum"])
    found = sim.observed
    msd = found["msd:every=0.125,lags=4"]["msd"]
    assert msd.axis == "time"
    assert msd.at.tolist() == [0.0, 0.125, 0.25, 0.375, 0.5]
    assert msd.mean == pytest.approx(25.0 * msd.at**2)
    vacf = found["vacf:every=0.125,lags=20"]["vacf"]
    assert vacf.mean[:9].tolist() == [25.0] * 9
    assert np.isnan(vacf.mean[9:]).all()  # longer than the run
    assert found["energy"]["E"].mean == 25.0
    assert (found["momentum"]["px"].mean, found["momentum"]["py"].mean) == (6.0, 8.0)


def test_bodies_that_come_begin_a_new_displacement():
    scene = kt.Scene([(0.0, 0.0)], [(1.0, 0.0)], 1.0, commands=[kt.Insert(0.5, (9.0, 9.0), (1.0, 0.0), 1.0)])
    sim = kt.Simulation(scene, "naive")
    sim.run(1.0, observe=["msd:every=0.25,lags=4"])
    msd = sim.observed["msd:every=0.25,lags=4"]["msd"].mean
    assert msd[:3] == pytest.approx([0.0, 0.0625, 0.25])
    assert np.isnan(msd[3:]).all()


def test_immovable_bodies_do_not_count_in_a_displacement():
    scene = kt.Scene([(0.0, 0.0), (9.0, 9.0)], [(3.0, 4.0), (0.0, 0.0)], 1.0, [1.0, math.inf])
    sim = kt.Simulation(scene, "naive")
    sim.run(1.0, observe=["msd:every=0.25,lags=4", "vacf:every=0.25,lags=4"])
    (msd,), (vacf,) = (each.values() for each in sim.observed.values())
    assert msd.mean == pytest.approx(25.0 * msd.at**2)
    assert vacf.mean == pytest.approx(np.full(5, 25.0))


def test_momentum_that_immovable_bodies_take_up_was_taken_off_the_temperature():
    still = [(0.5, 0.5), (0.2, 0.8)], [(0.0, 0.0), (0.6, 0.3)], 0.15, [math.inf, 1.0]
    for periodic in ("", "x", "xy"):
        sim = kt.Simulation(kt.Scene(*still, arena=(1.0, 1.0), periodic=periodic), "naive")
        sim.run(1.0, observe=["temperature"])
        assert sim.observed["temperature"]["kT"].mean == pytest.approx(0.225)  # m v^2 / 2, two degrees


@pytest.mark.parametrize("periodic", ["xy", "x"])
def test_a_drift_was_heat_of_each_kind_and_not_of_all(periodic):
    """kT was 0 of two discs with one velocity, and of each kind .5."""
    two = kt.Scene([(1.0, 1.0), (3.0, 3.0)], [(1.0, 0.0)] * 2, 0.25, [1.0, 3.0], arena=(4.0, 4.0))
    two = two.replace(kind=["light", "heavy"], periodic=periodic)
    gas = kt.make_scene("mixture", bodies=9, density=0.3, radii=(0.5, 0.7), periodic=periodic, seed=2)
    gas = gas.replace(kind=["light"] * 5 + ["heavy"] * 4)
    found = []
    for scene in (two, gas, gas.replace(velocity=gas.velocity + np.array([3.0, 0.0]))):
        sim = kt.Simulation(scene, "naive")
        sim.run(0.01, observe=["temperature"])
        found.append({name: each.mean for name, each in sim.observed["temperature"].items()})
    assert found[0] == pytest.approx(dict.fromkeys(["kT", "kT of light", "kT of heavy"], 0.0), abs=1e-12)
    assert found[1] == pytest.approx(found[2])
    axes, share = len(periodic), gas.mass[:5].sum() / gas.mass.sum()
    light, heavy = 10.0 - axes * share, 8.0 - axes * (1.0 - share)  # degrees of freedom
    whole = (light * found[1]["kT of light"] + heavy * found[1]["kT of heavy"]) / (18.0 - axes)
    assert found[1]["kT"] == pytest.approx(whole)


def test_momentum_that_is_kept_is_constant_and_not_a_walk_of_roundings():
    sim = kt.Simulation(kt.make_scene("mixture", bodies=9, density=0.5, periodic="xy", seed=5), "naive")
    sim.run(1.0, observe=["momentum"])
    assert [(each.mean, each.error) for each in sim.observed["momentum"].values()] == [(0.0, 0.0)] * 2


def test_displacements_were_not_separated_by_kind():
    flies = [(1.0, 0.0), (0.0, 2.0), (3.0, 0.0), (0.0, 0.0)]
    scene = kt.Scene([(1.0, 4.0), (5.0, 1.0), (1.0, 8.0), (9.0, 9.0)], flies, 0.25, [1.0] * 3 + [math.inf])
    scene = scene.replace(kind=["slow", "slow", "fast", "post"], commands=[kt.SetKind(1, 0.6, "fast")])
    sim = kt.Simulation(scene, "naive")
    sim.run(1.0, observe=["msd:every=0.25,lags=2", "vacf:every=0.25,lags=2"])
    cases = ("msd", [0.0, 0.0625, 0.25]), ("vacf", [1.0] * 3)
    for found, (one, lag) in zip(sim.observed.values(), cases, strict=True):
        assert [*found] == [one, f"{one} of fast", f"{one} of slow"]
        # Both slow ones count until .5; from .75 on all begin again.
        assert found[one].mean == pytest.approx(np.multiply(lag, 14.0 / 3.0))
        assert found[one].at.tolist() == found[f"{one} of slow"].at.tolist() == [0.0, 0.25, 0.5]
        assert found[f"{one} of slow"].mean[2] == pytest.approx(lag[2] * 2.5)
        assert found[f"{one} of fast"].mean[2] == pytest.approx(lag[2] * 9.0)


def test_heights_are_those_of_each_body_s_own_acceleration():
    moving = [(1.0, 1.0), (3.0, 2.0), (2.0, 3.0)], [(0.5, 0.0), (-1.0, 0.5), (0.0, 0.0)], 0.25
    own = [(math.nan, math.nan), (0.5, 0.25), (math.nan, math.nan)]
    scene = kt.Scene(*moving, [1.0, 2.0, math.inf], arena=(4, 4), gravity=(0.0, -1.0), acceleration=own)
    sim = kt.Simulation(scene, "naive")
    sim.run(4.0, observe=["energy:every=0.25"])
    found = sim.observed["energy:every=0.25"]
    assert sim.readings.contacts_disc
    assert found["E"].mean + found["U"].mean == pytest.approx(1.375 + 1.0 - 2.0 * (1.5 + 0.5))


@pytest.mark.slow
@pytest.mark.compiled
def test_a_mixture_of_masses_shares_its_energy_equally():
    scene = kt.make_scene("mixture", bodies=32, radii=(0.5, 0.7), masses=(1.0, 4.0), density=0.4, seed=2)
    named = scene.replace(kind=["light"] * 16 + ["heavy"] * 16)
    for each, names in ((scene, ("mass 1.0", "mass 4.0")), (named, ("light", "heavy"))):
        sim = kt.Simulation(each, "naive", keep_contacts=False)
        sim.run(10.0)
        sim.run(800.0, observe=["temperature"])
        found = sim.observed["temperature"]
        light, heavy = (found[f"kT of {name}"] for name in names)
        assert found["kT"].mean == pytest.approx(1.0)
        assert abs(light.mean - heavy.mean) < 3.0 * math.hypot(light.error, heavy.error)
        assert light.error < 0.02


def brute(scene, positions, within):
    i, j = np.triu_indices(len(positions), 1)
    apart = np.hypot(*displacement(scene, positions[j] - positions[i]).T)
    return sorted(zip(i[apart <= within].tolist(), j[apart <= within].tolist(), strict=True))


@pytest.mark.parametrize("periodic", ["", "x", "y", "xy"])
@pytest.mark.parametrize("n", [0, 1, 2, 3, 4, 50, 51])
def test_neighbours_are_all_pairs_within_a_distance_each_once(periodic, n, monkeypatch):
    monkeypatch.setattr(geometry, "_AT_ONCE", 20)
    scene = in_a_box(periodic)
    positions = np.random.default_rng(n).random((n, 2)) * scene.arena
    for within in (0.1, 0.5, 1.0):
        found = [
            (min(pair), max(pair))
            for one, other, _ in neighbours(scene, positions, within)
            for pair in zip(one.tolist(), other.tolist(), strict=True)
        ]
        assert sorted(found) == brute(scene, positions, within)


def test_each_place_was_compared_with_all_of_a_strip(monkeypatch):
    compared, scene = [], in_a_box("xy")
    monkeypatch.setattr(np, "hypot", lambda x, y, hypot=np.hypot: compared.append(len(x)) or hypot(x, y))
    for _ in neighbours(scene, np.random.default_rng(1).random((2000, 2)) * scene.arena, 0.1):
        pass
    assert (
        sum(compared) < 2000 * 20
    )  # of the 333 in a unit of area nine cells have 30, and half of them count


@pytest.mark.parametrize("periodic", first(2, ["", "xy", "x", "y"]))
def test_g_of_points_at_random_places_is_1(periodic):
    scene = in_a_box(periodic)
    correlation = PairCorrelation(bins=5, to=1.0)
    correlation.prepare(scene)
    places, found = np.random.default_rng(3), []
    for _ in range(20):
        simulation = simulation_of(None, places.random((400, 2)) * scene.arena)
        found.append(correlation.sample(simulation)["g"])
    error = np.std(found, axis=0, ddof=1) / math.sqrt(len(found))
    assert (np.abs(np.mean(found, axis=0) - 1.0) < 3.0 * error).all()
    assert (error < 0.015).all()


def test_structure_factor_is_the_sum_over_pairs():
    scene = kt.make_scene("grid", bodies=9, seed=3)
    factor = StructureFactor(modes=3)
    factor.prepare(scene)
    one = factor.sample(simulation_of(None, scene.position[:1]))["S"]
    assert one == pytest.approx(np.ones(3))
    width, height = scene.arena
    shells: dict[int, list[float]] = {1: [], 2: [], 3: []}
    for i in range(4):
        for j in range(-3, 4):
            k = np.array([i / width, j / height]) * 2.0 * math.pi
            shell = round(math.hypot(*k) * min(scene.arena) / (2.0 * math.pi))
            if 0 < shell <= 3:
                shells[shell].append(abs(np.exp(1j * scene.position @ k).sum()) ** 2 / 9)
    assert factor.sample(simulation_of(None, scene.position))["S"] == pytest.approx(
        [np.mean(each) for each in shells.values()]
    )


def test_a_hexagonal_crystal_is_in_order_and_a_square_one_is_not():
    hexagonal, square = (
        kt.make_scene(name, columns=6, rows=6, density=0.7) for name in ("hexagonal", "square")
    )
    for scene, expected in ((hexagonal, 1.0), (square, 0.0)):
        order = BondOrder(cutoff=1.3)
        order.prepare(scene)
        found = order.sample(simulation_of(scene.radius, scene.position))
        assert found["psi6"] == pytest.approx(expected, abs=0.2)
        if expected:
            assert found == pytest.approx({"psi6": 1.0, "psi6_local": 1.0})


def test_bonds_by_voronoi_cells_are_those_of_a_crystal_at_any_density():
    crystal = kt.make_scene("hexagonal", columns=6, rows=6, walls=False)
    step = float(crystal.position[1, 0] - crystal.position[0, 0])
    shaken = crystal.position + np.random.default_rng(2).normal(0.0, 0.03 * step, (36, 2))
    crystal = crystal.replace(arena=(6.0 * step, 6.0 * step * math.sqrt(0.75)), periodic="xy")
    found = []
    for cutoff, radius in ((1.3, 0.5 * step), ("voronoi", 0.5 * step), ("voronoi", 0.01 * step)):
        order = BondOrder(cutoff)
        order.prepare(crystal)
        found.append(order.sample(simulation_of(np.full(36, radius), shaken % crystal.arena)))
    assert 0.9 < found[0]["psi6"] < found[0]["psi6_local"] < 1.0
    assert found[1] == found[2] == pytest.approx(found[0])
    with pytest.raises(
        BadOption, match="cutoff is 'near'; expected a number of sums of radii, above 1, or vor"
    ):
        BondOrder("near")
