"""Runs against the oracle: agreement, reports of differences, and the hard scenes one by one."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import kinetile as kt
from kinetile.errors import Refused, ZenoError
from kinetile.kernel.log import WALLS
from kinetile_accuracy.oracle.agreement import Agreement, FirstDifference, agreement, certify
from kinetile_accuracy.oracle.oracle import oracle_contacts
from kinetile_conformance.cases import horizon
from kinetile_conformance.strategies import scenes
from lanes import first

pytest.importorskip("flint", reason="the certified oracle needs python-flint")

SCENES = Path(__file__).parents[3] / "scenes"


def scene_of(name: str) -> kt.Scene:
    return kt.load_scene(SCENES / f"{name}.toml")


@pytest.mark.parametrize("seed", first(1, [0, 1, 2]))
@pytest.mark.parametrize(
    ("density", "bodies", "pace"), first(1, [(0.01, 25, 4.5), (0.1, 16, 13.0), (0.5, 16, 40.0)])
)
@pytest.mark.compiled
def test_runs_agree_for_as_long_as_is_asked(density: float, bodies: int, pace: float, seed: int) -> None:
    sim = kt.Simulation(kt.make_scene("grid", bodies=bodies, density=density, seed=seed), "naive")
    found = certify(sim, max_contacts=1000)
    assert found.contacts_per_disc >= pace
    assert found.disagreement is not None, "chaos parts every run from the truth"
    assert found.contacts < 1000
    assert found.contacts_per_disc == (2 * (found.b >= 0).sum() + (found.b < 0).sum()) / bodies
    early = found.paces < pace / 20.0
    assert np.abs(found.ticks[early]).max() < 32.0, "it begins with roundings"
    half = len(found.ticks) // 2
    assert np.median(np.abs(found.ticks[half:])) > 100.0 * np.median(np.abs(found.ticks[:half]))


def test_scenes_with_another_unit_of_time() -> None:
    drawn = kt.make_scene("grid", bodies=9, seed=2, speed=1000.0)
    sim = kt.Simulation(drawn, "naive")
    assert sim.time_unit < 1.0
    found = certify(sim, max_contacts=40)
    assert found.complete
    assert np.abs(found.ticks[:5]).max() < 8.0
    finer = certify(kt.Simulation(drawn.replace(unit=sim.time_unit / 4), "naive"), max_contacts=40)
    assert finer.complete
    assert finer.oracle.contacts == found.oracle.contacts, "the clock of a run is not the oracle's"


def test_how_far_it_compares() -> None:
    scene = kt.make_scene("grid", bodies=9, seed=3)
    sim = kt.Simulation(scene, "naive")
    assert certify(sim).compared == 0
    sim.run(0.5)
    whole = certify(sim)
    assert whole.complete
    assert whole.compared == len(sim.contacts) > 20
    assert certify(sim, until=0.25).compared == (sim.contacts["time"] <= 0.25).sum()
    assert certify(sim, max_contacts=5).compared == 5
    more = certify(sim, max_contacts=len(sim.contacts) + 3)
    assert more.complete
    assert more.compared == len(sim.contacts)
    assert sim.time > 0.5
    assert "agree in order" in str(more)
    assert more.as_dict()["agrees"] is True


@pytest.fixture(scope="module")
def run() -> tuple[kt.Simulation, Any]:
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=3), "naive")
    sim.run(0.5)
    return sim, oracle_contacts(sim.scene, 0.5)


def compared(run: tuple[kt.Simulation, Any], contacts: Any, end: float = 0.5) -> Agreement:
    sim, truth = run
    return agreement(contacts, truth, scene=sim.scene, time_unit=sim.time_unit, end=end)


def later(contacts: Any, ticks: int) -> Any:
    """Returns contacts that all come some ticks later."""
    moved = contacts.copy()
    carry, moved["tick"] = np.divmod(moved["tick"] + ticks, 2**52)
    moved["epoch"] += carry
    return moved


CHANGED: dict[str, tuple[int, Any, str]] = {
    "exchanged": (7, lambda log: log[[*range(7), 8, 7, *range(9, len(log))]], "contact 7: the run has"),
    "later": (4, lambda log: np.concatenate([log[:4], later(log[4:], 3)]), "ticks apart"),
    "earlier": (4, lambda log: np.concatenate([log[:4], later(log[4:], -3)]), "ticks apart"),
    "missing": (5, lambda log: np.delete(log, 5), "contact 5: the run has"),
    "the last missing": (-1, lambda log: log[:-1], "the run has nothing more"),
    "one made up": (0, lambda log: np.concatenate([log, later(log[-1:], 2**30)]), "the oracle nothing more"),
}


@pytest.mark.parametrize("name", CHANGED)
def test_a_change_is_noticed(run: tuple[kt.Simulation, Any], name: str) -> None:
    at, change, text = CHANGED[name]
    contacts = run[0].contacts
    assert compared(run, contacts).complete
    found = compared(run, change(contacts))
    assert not found.complete
    assert found.disagreement is not None
    at = len(contacts) if name == "one made up" else at % len(contacts)
    assert found.contacts == found.disagreement.index == at
    assert text in str(found)
    if text == "ticks apart":
        assert found.as_dict()["first_disagreement"]["ticks_apart"] == found.disagreement.ticks_apart
    if name == "the last missing":
        assert compared(run, contacts[:-1], end=float(contacts["time"][-2])).disagreement is None


@pytest.mark.interpreted
def test_a_shift_of_every_contact_by_a_million_ticks_passed() -> None:
    """It passed in 153 of 159 drawn scenes. The first contact is of bodies on the plans of their scene."""
    moved = 0

    @settings(max_examples=16, derandomize=True, database=None)
    @given(scenes())
    def draw(drawn: kt.Scene) -> None:
        nonlocal moved
        scene = drawn.replace(turns=())
        sim = kt.Simulation(scene, "naive")
        with suppress(ZenoError):
            sim.run(until=horizon(scene), max_contacts=10)
        try:
            truth = certify(sim, max_contacts=10).oracle
        except (Refused, ZenoError):
            return
        moved += len(truth.contacts) > 0
        late = later(sim.contacts, 10**6)
        found = agreement(late, truth, scene=scene, time_unit=sim.time_unit, end=sim.time)
        assert not len(truth.contacts) or (found.contacts, found.complete) == (0, False), str(found)

    draw()
    assert moved > 5, moved


def test_walls_are_named() -> None:
    for wall, name in WALLS.items():
        assert f"disc 3 with the {name} wall at" in str(FirstDifference(0, (0.5, 3, wall), None, 0.0))


# The hard scenes

AGREE = (
    *("H01", "H02", "H03", "H04a", "H04b", "H04c", "H05", "H06", "H07", "H08a", "H08b", "H09", "H11", "H12"),
    *("H13", "H14", "H16", "H23", "H25", "H27", "H32"),
)
"""They agree to their end."""

AGREE_FOR = {"H15": 500, "H17": 350, "H20": 200, "H21": 90, "H28": 350, "H29": 350, "H30": 350}
"""They agree for that many contacts at least, exact ties among them; H15 goes on, chaos parts the others."""

PART_EARLY = {"H19": 20, "H33": 9}
"""They agree for just these contacts; then rounding exchanges contacts that are not simultaneous in truth,
but within a few ticks of each other: radii and places are rounded numbers there. In H19 two discs that touch
approach by less than a velocity's last bit, as an exchange has rounded it; the oracle's do not."""

JAMMED = "H18"


def test_every_hard_scene_is_listed() -> None:
    told = {*AGREE, *AGREE_FOR, *PART_EARLY, JAMMED}
    assert told == {path.stem for path in SCENES.glob("H*.toml")}


@pytest.mark.parametrize("name", AGREE)
@pytest.mark.small
def test_hard_scenes_agree(name: str) -> None:
    scene = scene_of(name)
    found = certify(kt.Simulation(scene, "naive"), until=scene.settings.until)
    assert found.complete, str(found)
    assert found.oracle.ended == "until"
    assert found.worst_ticks < 8.0 or name == "H08a"  # a graze


@pytest.mark.parametrize("most", [80, pytest.param(500, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", AGREE_FOR)
@pytest.mark.small
def test_hard_scenes_agree_for_long(name: str, most: int) -> None:
    found = certify(kt.Simulation(scene_of(name), "naive"), max_contacts=most)
    assert found.contacts >= min(AGREE_FOR[name], most), str(found)
    assert found.oracle.ended == "going on"


@pytest.mark.parametrize("name", PART_EARLY)
def test_hard_scenes_whose_near_ties_rounding_exchanges(name: str) -> None:
    found = certify(kt.Simulation(scene_of(name), "naive"), max_contacts=60)
    assert found.contacts == PART_EARLY[name]
    assert found.disagreement is not None
    assert abs(found.disagreement.ticks_apart) < 8.0


@pytest.mark.compiled
def test_a_fault_of_the_run_is_raised_and_contacts_before_it_can_be_compared() -> None:
    sim = kt.Simulation(scene_of(JAMMED), "naive")
    with pytest.raises(ZenoError):
        certify(sim, until=1.0)
    found = certify(sim, max_contacts=100)
    assert (found.contacts, found.compared, found.complete) == (100, 100, True)


@pytest.mark.slow
def test_a_jam_ends_the_oracle() -> None:
    run = oracle_contacts(scene_of(JAMMED), 1.0)
    assert (run.ended, run.complete) == ("jammed", False)
    assert "contacts follow each other without end" in str(run)


@pytest.mark.parametrize("seeds", [2, pytest.param(25, marks=pytest.mark.slow)])
@pytest.mark.parametrize("turns", [0, 12])
@pytest.mark.parametrize("kind", ["dyadic", "non-dyadic"])
@pytest.mark.small
def test_where_lattices_part_from_the_oracle_there_is_a_reason(kind: str, turns: int, seeds: int) -> None:
    """Rounding splits a tie, a graze is lost to it, or chaos has begun; few are undecidable."""
    agree = undecided = 0
    strange = []
    for seed in range(seeds):
        scene = kt.make_scene("lattice", bodies=9, kind=kind, turns=turns, seed=seed)
        found = certify(kt.Simulation(scene, "naive"), until=4.0, max_contacts=100)
        differs = found.disagreement
        undecided += found.oracle.ended == "undecidable"
        agree += found.complete
        if differs is None or found.worst_ticks > 1e6 or abs(differs.ticks_apart) <= 8.0:
            continue
        if differs.oracle is not None and differs.oracle.head_on < 2.0**-22:
            continue
        at = {turn.time for turn in scene.turns if turn.body in (differs.run or ())[1:]}
        if differs.run is not None and any(abs(differs.run[0] - time) < 2.0**-50 for time in at):
            continue  # a contact at the very time of a turn, that rounding puts on its other side
        strange.append((seed, str(found)))
    assert strange == []
    assert undecided <= max(seeds // 6, 1)
    assert agree >= (seeds // 2 if kind == "dyadic" else seeds // 8)
