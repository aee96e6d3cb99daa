"""Bodies that are carried, by lifts, platforms and conveyors, and ledges that are passed from below."""

import math
from contextlib import suppress
from copy import copy
from pathlib import Path
from typing import Any

import pytest

import games
import kinetile as kt
from agreement import agree
from judged_games import MOST, second_agrees, with_end
from kinetile.errors import BadOption, KinetileError, SceneError, ZenoError
from kinetile_accuracy import certify_log
from lanes import first

INF = math.inf
PHASES = ("naive", "cells")
DECK, CRATE = kt.box(2.0, 0.5), kt.box(0.5, 0.5)


def lands(**options: Any) -> kt.Response:
    return kt.Response("restitution", **{"e": 0.0, "contact_time": 2.0**-6, "settle": 1.0, **options})


def on_a_deck(velocity: tuple[float, float], *crates: float, **more: Any) -> kt.Scene:
    """Returns a deck at (3, 2) that moves, and crates at rest that stand on it at these places of x."""
    some = [(x, 2.5) for x in crates or (3.0,)]
    values: dict[str, Any] = {"arena": (6.0, 6.0), "gravity": (0.0, -1.0), "responses": lands(), **more}
    return kt.Scene(
        [(3.0, 2.0), *some], [velocity, *((0.0, 0.0) for _ in some)], shapes=[DECK, CRATE],
        shape=[0, *(1 for _ in some)], mass=[INF, *(1.0 for _ in some)], **values,
    )  # fmt: skip


def standing(sim: kt.Simulation) -> bool:
    """Returns True if all crates are held by the deck, exactly."""
    deck, *crates = sim.positions().tolist()
    return all(y == deck[1] + 0.5 for _, y in crates) and set(sim.supports()[1:]) == {(0,)}


@pytest.mark.parametrize("up", [0.5, -0.25])
def test_a_lift_holds_exactly_what_stands_on_it(up):
    sim = agree(on_a_deck((0.0, up), 2.5, 3.5), *PHASES, until=2.0)[0]
    assert standing(sim)
    assert sim.velocities().tolist() == [[0.0, up]] * 3
    assert len(sim.contacts) == 2
    assert sim.readings.unaccounted_energy < 1e-14


@pytest.mark.parametrize(("grip", "carried"), [(0.0, 0.0), (0.5, 0.25), (1.0, 0.5)])
def test_a_deck_that_moves_aside_carries_what_it_grips(grip, carried):
    sim = agree(on_a_deck((0.5, 0.0), responses=lands(grip=grip)), *PHASES, until=1.0)[0]
    assert sim.positions().tolist() == [[3.5, 2.0], [3.0 + carried, 2.5]]
    assert sim.velocities()[1].tolist() == [carried, 0.0]


@pytest.mark.parametrize("grip", [0.5, 1.0])
def test_without_settle_hops_grip_again_and_again(grip):
    sim = agree(on_a_deck((0.5, 0.0), responses=lands(grip=grip, settle=None)), *PHASES, until=1.0)[0]
    assert sim.velocities()[1, 0] == pytest.approx(0.5, abs=1e-12)
    assert 2.5 <= sim.positions()[1, 1] <= 2.5 + 2.0**-15 * (1 + 1e-9)  # g contact_time^2 / 8


def test_what_is_not_carried_leaves_at_the_edge_with_its_own_velocity():
    """The deck's left end passes the crate's right one at 2.5 / 0.5; there the crate begins to fall."""
    sim = agree(on_a_deck((0.5, 0.0), arena=(16.0, 6.0)), *PHASES, until=3.5)[0]
    assert sim.velocities()[1].tolist() == pytest.approx([0.0, -1.0], abs=1e-6)
    assert sim.positions()[1].tolist() == pytest.approx([3.0, 2.0], abs=1e-6)


def test_a_lift_that_turns_lets_go_and_what_falls_is_caught():
    """From rest at 2.5, beside a deck that goes down at 0.5 from time 1 on: met again after 2 * 0.5 / g."""
    scene = on_a_deck((0.0, 0.0), commands=[kt.Turn(0, 1.0, (0.0, -0.5))])
    sim = agree(scene, *PHASES, until=3.0)[0]
    times = sim.contacts["time"].tolist()
    assert times == [0.0, 2.0]
    assert standing(sim)
    assert sim.velocities().tolist() == [[0.0, -0.5]] * 2


def test_a_lift_that_starts_lifts_at_once():
    scene = on_a_deck((0.0, 0.0), commands=[kt.Turn(0, 1.0, (0.0, 0.5)), kt.Turn(0, 2.0, (0.0, 0.25))])
    sim = agree(scene, *PHASES, until=2.75)[0]
    assert sim.contacts["time"].tolist() == [0.0, 1.0, 2.5]  # slower than the crate, it is met after 0.5
    assert standing(sim)


def test_a_lift_speeds_up_by_steps():
    steps = [kt.Turn(0, k / 16, (0.0, k / 16)) for k in range(1, 17)]
    sim = agree(on_a_deck((0.0, 0.0), commands=steps), *PHASES, until=1.0)[0]
    assert standing(sim)
    assert sim.contacts["time"].tolist() == [0.0, *(k / 16 for k in range(1, 17))]


def test_a_lift_turns_at_a_wall_and_lets_go():
    sim = agree(on_a_deck((0.0, -0.5)), *PHASES, until=4.0)[0]
    assert sim.contacts[["time", "a", "b"]].tolist() == [(1.0, 0, 1), (3.5, 0, -3), (3.5, 0, 1)]
    assert standing(sim)


@pytest.mark.slow  # 2,400 contacts until it is a jam
def test_a_lift_that_squeezes_a_crate_ends_as_a_squeeze():
    for phase in (*PHASES, "sap-1d", "sap-2d"):
        sim = kt.Simulation(on_a_deck((0.0, 0.5), responses=lands(contact_time=2.0**-10)), phase)
        with pytest.raises(ZenoError, match="between body 1 and the top wall"):
            sim.run(9.0)
        assert sim.time == pytest.approx(6.5)


@pytest.mark.parametrize("settle", [None, 1.0])
def test_a_conveyor_carries_what_lies_on_it(settle):
    belt = lands(grip=1.0, surface=(0.5, 9.0), settle=settle)
    floor = kt.Scene(
        [(2.0, 0.5)], [(0.0, 0.0)], 0.5, arena=(6.0, 6.0), gravity=(0.0, -1.0),
        responses={("*", "wall"): belt},
    )  # fmt: skip
    for scene in (floor, on_a_deck((0.25, 0.0), responses=belt)):
        sim = agree(scene, *PHASES, until=1.0)[0]
        carried = 0.5 + (sim.velocities()[0, 0] if len(scene) > 1 else 0.0)
        assert sim.velocities()[-1, 0] == carried
        assert sim.positions()[-1, 0] == scene.position[-1, 0] + carried


def test_what_lands_keeps_the_rest_of_its_velocity():
    land = lands(e=0.5, grip=0.25, settle=None)
    scene = kt.Scene([(1.0, 1.0)], [(1.0, 0.0)], 0.5, arena=(9.0, 2.0), gravity=(0.0, -1.0), responses=land)
    sim = kt.Simulation(scene)
    event = sim.run(3.0, stop_at=kt.StopAt()).event
    assert (event.normal, event.closing_speed) == ((0.0, -1.0), 1.0)
    assert event.impulse == (pytest.approx(0.25), pytest.approx(-1.5))
    assert sim.velocities().tolist() == [[0.75, 0.5]]


def with_a_ledge(way: tuple[float, float], **more: Any) -> kt.Scene:
    """Returns a ledge at a height of 2, and a disc that is thrown up from below it to 3.5 - 0.25."""
    rules = {("hero", "ledge"): lands(e=0.0, one_way=way), ("hero", "wall"): lands()}
    values = {"kind": ["ledge", "hero"], "responses": rules, **more}
    ledge = kt.segment((-1.0, 0.0), (1.0, 0.0))
    return kt.Scene(
        [(3.0, 2.0), (3.0, 1.25)], [(0.0, 0.0), (0.0, 2.0)], shapes=[ledge, kt.disc(0.25)],
        shape=[0, 1], mass=[INF, 1.0], arena=(6.0, 6.0), gravity=(0.0, -1.0), **values,
    )  # fmt: skip


def test_a_ledge_is_passed_from_below_and_met_from_above():
    sim = agree(with_a_ledge((0.0, 1.0)), *PHASES, until=6.0)[0]
    begin, end, *landed = sim.contacts[["a", "b"]].tolist()
    assert (begin, end, set(landed)) == ((0, 1), (1, 0), {(0, 1)})
    assert sim.positions()[1].tolist() == [3.0, 2.25]
    assert sim.supports()[1] == (0,)
    events = [event for event in kt.Simulation(with_a_ledge((0.0, 1.0))).steps(6.0) if event.bodies]
    assert [event.kind for event in events][:3] == ["pass", "part", "disc"]
    assert [event.normal for event in events][:3:2] == [(0.0, -1.0), (0.0, 1.0)]


def test_a_ledge_is_met_from_its_side_alone():
    sim = agree(with_a_ledge((0.0, -1.0)), *PHASES, until=1.0)[0]
    assert set(sim.contacts[["a", "b"]].tolist()) == {(0, 1)}
    assert sim.positions()[1, 1] < 2.0


def test_a_disc_may_begin_within_a_ledge():
    sim = agree(with_a_ledge((0.0, 1.0)).replace(position=[(3.0, 2.0), (3.0, 2.125)]), *PHASES, until=5.0)[0]
    assert sim.contacts[["a", "b"]].tolist()[:2] == [(0, 1), (1, 0)]
    assert sim.contacts["time"][0] == 0.0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"grip": 1.5}, "grip is 1.5; expected a number from 0 to 1"),
        ({"grip": math.nan}, "grip is nan"),
        ({"surface": (1.0, 0.0)}, "a surface moves nothing without grip"),
        ({"grip": 1.0, "surface": 1.0}, "surface is 1.0; expected two numbers"),
        ({"one_way": (0.0, 0.0)}, "one_way is (0, 0); expected a direction"),
        ({"one_way": "up"}, "one_way is 'up'; expected two numbers"),
        ({"one_way": (1.0, math.inf)}, "one_way is"),
    ],
)
def test_options_that_mean_nothing_are_refused(options, said):
    with pytest.raises((SceneError, BadOption)) as error:
        with_a_ledge((0.0, 1.0), responses={("hero", "ledge"): lands(**options)})
    assert said in str(error.value)


def test_a_wall_has_one_side():
    with pytest.raises(SceneError, match="walls cannot be passed"):
        with_a_ledge((0.0, 1.0), responses={("hero", "wall"): lands(one_way=(0.0, 1.0))})


@pytest.mark.small
@pytest.mark.parametrize("seeds", first(1, [range(2), *(range(k, k + 10) for k in range(0, 500, 10))]))
def test_a_game_with_lifts_conveyors_and_ledges_has_one_answer(seeds, tmp_path):
    """Under all phases, by the certifier and the second implementation, replayed and resumed."""
    for seed in seeds:
        game = games.draw_carrying_game(seed)
        sim, end = with_end(game)
        rows = sim.contacts.tolist()
        for phase in ("cells", "sap-1d", "sap-2d")[: None if seed > 1 else 1]:
            assert with_end(game, phase)[0].contacts.tolist() == rows, (seed, phase)
        if end:
            found = certify_log(game, sim.contacts, **end)
            assert found.right, (seed, str(found))
        assert second_agrees(game, tmp_path), seed
        if len(rows) < MOST and sim.time == game.settings.until:
            assert interrupted(game, tmp_path / "half.kts", sim.time) == rows, seed


def interrupted(game: kt.Scene, file: Path, end: float) -> list[Any]:
    """Returns the contacts of a game that is saved in its middle, resumed under another phase, and played
    again by its recording."""
    half = kt.Simulation(game, "naive")
    half.run(0.5 * (game.start + end))
    half.save(file)
    sim = kt.resume(file, "sap-2d")
    sim.run(end)
    again = kt.Simulation(sim.recorded(), "cells")
    again.run(end)
    assert again.fingerprint == sim.fingerprint
    return again.contacts.tolist()


@pytest.mark.small
@pytest.mark.parametrize("seeds", first(1, [range(2), *(range(k, k + 10) for k in range(0, 200, 10))]))
def test_what_is_said_of_the_next_contact_comes_true(seeds):
    """At ten moments of each game: the soonest of all answers is the next contact, whatever lies between."""
    for seed in seeds:
        game = games.draw_carrying_game(seed)
        sim = kt.Simulation(game, "naive")
        for tenth in range(10):
            with suppress(KinetileError):
                sim.run(game.start + 0.05 * tenth * (game.settings.until - game.start), max_contacts=300)
            said = [sim.next_contact_of(body, scheduled=True) for body in sim.bodies.tolist()]
            soonest = min((each[1:3] for each in said if each), default=None)
            seen, ahead = len(sim.contacts), copy(sim)
            with suppress(KinetileError):
                ahead.run(game.settings.until, max_contacts=1)
            new = ahead.contacts[["epoch", "tick"]][seen:].tolist()
            assert soonest is None or not new or soonest == new[0], (seed, tenth)
