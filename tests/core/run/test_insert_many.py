"""Many bodies inserted at once: as the same insertions one after the other, some of them without room."""

import pickle
import random

import pytest

import kinetile as kt
from capabilities import Game
from inside import engine_of
from kinetile.errors import NoRoom, Refused
from lanes import first

SCENES = (("discs",), ("pass",), ("periodic xy",), ("shapes",), ("radii of many sizes", "periodic x"))
REFUSED = {("pass",): "pass through", ("periodic xy",): "periodic", ("shapes",): "is for discs"}
"""What sweep-tiling and power say of scenes that they refuse."""


def batch(seed: int, names: tuple[str, ...]):
    """Returns positions, velocities and the rest of a drawn batch: some reach into others, into walls, or
    into present bodies."""
    rng, draft = random.Random(seed), Game(*names).draft
    many = (6, 80, 1, 12)[seed % 4]  # 80: more than there are slots for
    places = [(rng.randrange(1, 48) / 8, rng.randrange(1, 48) / 8) for _ in range(many)]
    speeds = [(rng.randrange(-4, 5) / 2, rng.randrange(-4, 5) / 2) for _ in range(many)]
    rest = {"mass": [rng.choice((1.0, 2.0)) for _ in range(many)]}
    if draft.shaped:
        rest["shape"] = [draft.form(rng.randrange(7)) for _ in range(many)]
    else:
        rest["radius"] = [rng.choice((0.25, 0.125, 0.0625)) for _ in range(many)]
    if draft.rules:
        rest["kind"] = [rng.choice("ab") for _ in range(many)]
    return places, speeds, rest


@pytest.mark.parametrize(
    "phase", first(2, ["cells", "sweep-tiling", "sap-1d", "naive", "sap-2d", "sap-k", "power"])
)
@pytest.mark.parametrize("names", SCENES)
@pytest.mark.parametrize("seed", first(1, range(8)))
def test_a_batch_is_its_insertions_one_after_the_other(names, phase, seed):
    game = Game(*names)
    solid, periodic = phase in ("sweep-tiling", "power"), names[-1].startswith("periodic")
    if (solid and names in REFUSED) or (phase in ("sap-k", "power") and periodic):
        with pytest.raises(Refused, match=REFUSED.get(names, "periodic")):
            kt.Simulation(game.scene, phase, live=True).build()
        return
    together, apart = (kt.Simulation(game.scene, phase, live=True) for _ in range(2))
    together.run(0.5), apart.run(0.5)
    places, speeds, rest = batch(seed, names)
    numbers, said = [], {}
    for at, (place, speed) in enumerate(zip(places, speeds, strict=True)):
        try:
            numbers.append(apart.insert(place, speed, **{name: given[at] for name, given in rest.items()}))
        except ValueError as error:
            numbers.append(-1)
            said[at] = str(error)
    found = together.insert_many(places, speeds, **rest)
    assert found.numbers.tolist() == numbers
    assert found.refused.tolist() == [number < 0 for number in numbers]
    assert {*found.reasons} == {*said}
    together.audit()
    together.run(1.0), apart.run(1.0)
    assert together.fingerprint == apart.fingerprint
    replayed = kt.Simulation(together.recorded(), "sap-1d")
    replayed.run()
    assert replayed.fingerprint == together.fingerprint


def test_reasons_are_sentences_that_name_what_is_in_the_way():
    sim = kt.Simulation(kt.Scene([[2.0, 2.0]], [[0.0, 0.0]], 0.5, arena=(4.0, 4.0)), "cells", live=True)
    found = sim.insert_many([(2.5, 2.0), (3.9, 1.0), (1.0, 1.0), (1.25, 1.0)], radius=0.25)
    assert found.numbers.tolist() == [-1, -1, 1, -1]
    assert [str(error) for error in found.reasons.values()] == [
        "at time 0.0 there is no room for body 1 at (2.5, 2.0) with radius 0.25: it reaches 0.25 into body "
        "0; nothing has changed",
        "at time 0.0 there is no room for body 1 at (3.9, 1.0) with radius 0.25: it reaches beyond the right "
        "wall; nothing has changed",
        "there is no room: it reaches into body 1, inserted with it",
    ]


def test_the_eldest_is_named_and_the_first_of_a_batch_is_one_that_can_be():
    scene = kt.Scene([[2.0, 2.0], [2.0, 3.0]], [[0.0, 0.0]] * 2, 0.5, arena=(4.0, 4.0))
    sim = kt.Simulation(scene, "cells", live=True)
    with pytest.raises(NoRoom, match="into body 0"):
        sim.insert((2.5, 2.5), radius=0.5)
    found = sim.insert_many([(1.0, 1.0), (1.25, 1.0), (0.75, 1.0)], radius=0.25)
    assert found.numbers.tolist() == [2, -1, -1]
    assert {str(each) for each in found.reasons.values()} == {
        "there is no room: it reaches into body 2, inserted with it"
    }


@pytest.mark.parametrize("place", [(3.9, 1.0), (-50.0, 1.0), (0.25, 5.0)])
def test_one_body_beyond_a_wall_is_refused_as_one_of_many_is(place):
    sim = kt.Simulation(kt.Scene([[2.0, 2.0]], [[0.0, 0.0]], 0.5, arena=(4.0, 4.0)), "naive", live=True)
    with pytest.raises(NoRoom, match=r"it reaches beyond the .* wall; nothing has changed") as caught:
        sim.insert(place, radius=0.25)
    assert str(caught.value) == str(sim.insert_many([place], radius=0.25).reasons[0])


def test_a_shape_is_beyond_a_wall_by_its_reach_to_that_side():
    wedge = kt.polygon([(0.0, 0.0), (1.0, 0.0), (0.0, 0.5)])
    scene = kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], shape=wedge, arena=(4.0, 4.0))
    sim = kt.Simulation(scene, "naive", live=True)
    places = {"left": (-0.25, 2.0), "right": (3.25, 2.0), "bottom": (2.0, -0.25), "top": (2.0, 3.75)}
    found = sim.insert_many([*places.values(), (3.0, 3.5), (0.0, 0.0)], shape=wedge)
    assert found.numbers.tolist() == [-1] * 4 + [1, 2]
    for wall, reason in zip(places, found.reasons.values(), strict=True):
        assert f"beyond the {wall} wall" in str(reason)


def test_small_bodies_had_room_within_the_rounding_of_a_large_arena():
    sim = kt.Simulation(
        kt.Scene([[60.0, 60.0]], [[0.0, 0.0]], 2.0**-12, arena=(64.0, 64.0)), "naive", live=True
    )
    sim.run(1.0)
    there = [(60.0 + 2.0**-11 - overlap, 60.0) for overlap in (2.0**-44, 0.0)]
    assert sim.insert_many(there, radius=2.0**-12).numbers.tolist() == [-1, 1]


def test_a_reason_is_of_its_moment_when_it_is_read_later_and_elsewhere():
    sim = kt.Simulation(kt.Scene([[2.0, 2.0]], [[1.0, 0.0]], 0.5, arena=(4.0, 4.0)), "naive", live=True)
    with pytest.raises(NoRoom) as caught:
        sim.insert((2.5, 2.0), radius=0.25)
    sim.run(1.0)
    assert "at time 0.0 there is no room for body 1" in str(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


@pytest.mark.parametrize("waits", [False, True])
def test_a_batch_that_a_phase_refuses_in_its_middle_left_some_of_it_in(waits, monkeypatch):
    """Behind commands of the scene bodies come one after the other; naive refuses the fifth."""
    monkeypatch.setattr("kinetile_plugins.naive.LIMIT", 12)
    grid = kt.make_scene("grid", bodies=9, density=0.25, seed=3)
    own = [kt.Remove(0, 0.25, (0, 1 << 50, 0)), kt.Turn(1, 0.25, (0.5, 0.5), (0, 1 << 50, 0))]
    scene = kt.Scene(grid.position, grid.velocity, grid.radius, 1.0, grid.arena, commands=own)
    sim = kt.Simulation(scene, "naive", live=True)
    while sim.exact_time < (0, 1 << 50):
        sim.run(0.25, max_events=1)
    if not waits:
        sim.run(0.25)
    assert bool(engine_of(sim).due) is waits
    before, free = (
        sim.snapshot(),
        grid.position[0] + [[x / 25, y / 25] for x in (-1, 0, 1) for y in (-1, 0, 1)],
    )
    with pytest.raises(Refused, match="naive compares"):
        sim.insert_many(free, radius=0.001)
    assert sim.snapshot() == before
    found = sim.insert_many([sim.positions()[3], (9.0, 0.1), free[4], free[4]], radius=0.001)
    assert found.numbers.tolist() == [-1, -1, 9, -1]
    assert all(isinstance(error, NoRoom) for error in found.reasons.values())
