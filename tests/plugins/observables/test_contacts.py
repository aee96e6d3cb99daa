"""Pressure and contact rates, with walls and without, compared with exact values and with each other."""

import math

import pytest

import kinetile as kt

PAIRS, WALLS = 1.35906852, 2.12674818
"""Contacts a unit of time of two discs of radius 0.15 in the unit box, at a mean square of speeds of 1: of
the pair, and of each disc with walls. They follow from the volume and the surface without overlap."""


def two_discs() -> kt.Scene:
    velocity = [(0.6, 0.3), (0.1, math.sqrt(2.0 - 0.36 - 0.09 - 0.01))]
    return kt.Scene([(0.3, 0.3), (0.7, 0.62)], velocity, 0.15, arena=(1.0, 1.0))


def ran(scene: kt.Scene, until: float, *observe: str) -> dict:
    sim = kt.Simulation(scene, "naive", keep_contacts=False)
    sim.run(until, observe=observe)
    return sim.observed


def agree(one, other, exactly: float | None = None) -> bool:
    """Whether two estimates are within three standard errors, or one of an exact value."""
    if exactly is not None:
        return abs(one.mean - exactly) < 3.0 * one.error
    return abs(one.mean - other.mean) < 3.0 * math.hypot(one.error, other.error)


def exact_pressure() -> float:
    """Returns P of the two discs: kT = 1/2, and walls of length 4; each of their contacts gives 2 |v_n|.

    The mean of v_n weighted by flux is <v_n^2>/<|v_n|>, with v_n a coordinate of a sphere in 4 dimensions.
    """
    mean_speed = math.sqrt(2.0) * math.gamma(2.0) / (math.sqrt(math.pi) * math.gamma(2.5))
    return 2.0 * WALLS * 2.0 * 0.5 / mean_speed / 4.0


@pytest.mark.compiled
def test_two_discs_in_a_box_have_the_exact_rates_and_pressure():
    found = ran(two_discs(), 20_000.0, "rates", "pressure", "pressure:by=impulses")
    rates = found["rates"]
    assert agree(rates["pairs"], None, PAIRS)
    assert agree(rates["Gamma"], None, PAIRS)
    assert agree(rates["walls"], None, 2.0 * WALLS)
    assert rates["pairs"].error < 0.01 * PAIRS
    for name in ("pressure", "pressure:by=impulses"):
        assert agree(found[name]["P"], None, exact_pressure())
        assert found[name]["P"].error < 0.005 * exact_pressure()
        for wall in ("left", "right", "bottom", "top"):
            assert agree(found[name][f"P_{wall}"], None, exact_pressure())
        assert found[name]["Z"].mean == pytest.approx(found[name]["P"].mean)  # N kT = A = 1


@pytest.mark.parametrize(("periodic", "heat"), [("", 1.0), ("x", 12 / 11), ("xy", 12 / 10)])
def test_pressure_had_no_kt_beside_it_which_on_a_torus_is_not_the_recipe_s_temperature(periodic, heat):
    found = ran(kt.make_scene("mixture", bodies=6, periodic=periodic), 2.0, "pressure", "temperature")
    pressure = found["pressure"]
    assert list(pressure)[:4] == ["P", "kT", "P/kT", "Z"]
    assert pressure["kT"].mean == pytest.approx(heat)
    assert found["temperature"]["kT"].mean == pytest.approx(heat)
    assert pressure["P/kT"].mean == pytest.approx(pressure["P"].mean / heat)


def test_impulses_are_right_to_the_last_contact():
    """One disc between two walls: each contact gives 2 m v, and the virial of walls is all there is."""
    scene = kt.Scene([(1.0, 0.5)], [(1.0, 0.0)], 0.25, 3.0, arena=(2.0, 1.0))
    sim = kt.Simulation(scene, "naive")
    sim.run(30.0, observe=["pressure:by=impulses,every=3"])  # 1.5 from wall to wall
    (found,) = sim.observed.values()
    force = 2.0 * 3.0 / 1.5  # on both walls together
    assert [found[f"P_{wall}"].mean for wall in ("left", "right")] == pytest.approx([force / 2.0] * 2)
    assert "P_walls" not in found  # the mean of walls with different loads, such as an empty half's
    assert found["P_bottom"].mean == 0.0
    assert found["P"].mean == pytest.approx((1.5 + force * 0.25 / 2.0) / 2.0)


def test_the_estimator_follows_from_the_scene():
    grid = kt.make_scene("grid", bodies=4, seed=3)
    lossy = grid.replace(responses={(0, 0): kt.Response("restitution", e=0.9, contact_time=1e-3)})
    sim = kt.Simulation(lossy, "naive")
    sim.run(1.0, observe=["pressure"])
    assert sim.observed["pressure"]["P"].mean > 0.0


def test_rates_by_kind_are_the_contacts_of_the_log():
    scene = kt.make_scene("grid", bodies=9, density=0.5, seed=3)
    kinds = ["big"] * 4 + ["small"] * 5
    coming = [kt.Insert(0.5, tuple(scene.position[8]), (0.3, 0.2), 1e-3, kind="small"), kt.Remove(8, 0.25)]
    made = scene.replace(
        kind=kinds, responses={("big", "big"): kt.Response("pass")}, commands=coming, kinds=["big", "small"]
    )
    sim = kt.Simulation(made, "naive")
    sim.run(2.0, observe=["rates:every=2"])
    expected = {"pairs": 0, "walls": 0, "big-big": 0, "big-small": 0, "small-small": 0}
    expected |= {"big-wall": 0, "small-wall": 0}
    for row in sim.contacts[(sim.contacts["b"] < 0) | (sim.contacts["b"] > sim.contacts["a"])]:
        expected["walls" if row["b"] < 0 else "pairs"] += 1
        expected["-".join(sorted(sim.kinds_of([row["a"], row["b"]]).tolist()))] += 1
    found = {name: 2.0 * each.mean for name, each in sim.observed["rates:every=2"].items() if name != "Gamma"}
    assert found == expected
    assert expected["big-big"] > 0


def test_pressure_where_there_is_none() -> None:
    """On a torus it needs two bodies."""
    alone = kt.Scene([(0.5, 0.5)], [(1, 0.7)], 0.2, arena=(1, 1), periodic="xy")
    sim = kt.Simulation(alone)
    sim.run(1.0, observe=["pressure"])
    assert sim.observed["pressure"] == {}
