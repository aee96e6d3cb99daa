"""The certified oracle on commands, kinds and responses: against closed forms, and against runs of games."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction
from typing import Any

import pytest
from typer.testing import CliRunner

import kinetile as kt
from games import draw_game
from judged_games import against_oracle
from kinetile.cli import app
from kinetile.errors import Refused
from kinetile_accuracy.oracle.agreement import FirstDifference
from kinetile_accuracy.oracle.oracle import CertifiedRun, Oracle, oracle_contacts

pytest.importorskip("flint", reason="the certified oracle needs python-flint")

LEFT, RIGHT, BOTTOM, TOP = -1, -2, -3, -4
INF = math.inf

Expected = list[tuple[float | Fraction, int, int]]


def check(run: CertifiedRun, expected: Expected) -> None:
    """A run has just these contacts, and each time lies in its enclosure."""
    assert [(each.a, each.b) for each in run.contacts] == [(a, b) for _, a, b in expected]
    for each, (time, _, _) in zip(run.contacts, expected, strict=True):
        assert abs(each.time.middle - Fraction(time)) <= each.time.radius < Fraction(1, 2**70)


def row(*bodies: tuple[float, float], mass: Any = 1.0, **more: Any) -> kt.Scene:
    """Discs of radius 1/4 at height 1/2 of an arena of 8 x 1: their places and velocities along x."""
    places, velocities = ([(x, 0.5) for x, _ in bodies], [(vx, 0.0) for _, vx in bodies])
    return kt.Scene(places, velocities, 0.25, mass, arena=(8.0, 1.0), **more)


def restitution(e: float, contact_time: float) -> kt.Response:
    return kt.Response("restitution", e=e, contact_time=contact_time)


# Responses


def test_an_immovable_body_stays() -> None:
    scene = row((1.0, 1.0), (3.0, 0.0), mass=[1.0, INF])
    check(oracle_contacts(scene, 6.0), [(1.5, 0, 1), (3.75, 0, LEFT), (6.0, 0, 1)])


def test_a_moving_immovable_body_is_met_again_and_again() -> None:
    scene = row((4.0, 0.0), (1.0, 1.0), mass=[1.0, INF])
    # Disc 0 gets twice the speed of disc 1, and comes back from the wall with it.
    check(oracle_contacts(scene, 5.0), [(2.5, 0, 1), (4.375, 0, RIGHT), (5.0, 0, 1)])


def test_two_immovable_bodies_part_as_equals() -> None:
    run = oracle_contacts(row((1.0, 1.0), (7.0, -0.5), mass=INF), 12.5)
    check(run, [(Fraction(11, 3), 0, 1), (6.25, 1, RIGHT), (12.5, 0, LEFT)])


def test_an_immovable_body_keeps_its_line_where_it_is_hit_at_an_irrational_time() -> None:
    """So its tie with a command is decided, as it would be if nothing had met it."""
    places, velocities = [[1.0, 1.0], [3.0, 1.1]], [[1.0, 0.0], [1.0, 0.0]]
    scene = kt.Scene(places, velocities, 0.25, [1.0, INF], (8.0, 4.0))
    scene = scene.replace(turns=[(0, 0.5, (2.0, 0.0)), (1, 4.75, (0.0, -1.0))])
    run = oracle_contacts(scene, 5.5)
    assert (run.contacts[0].a, run.contacts[0].b) == (0, 1)
    assert run.contacts[0].time.radius > 0
    assert (1, RIGHT) not in [(each.a, each.b) for each in run.contacts]
    assert run.ended == "until"


def test_restitution_at_a_wall_leaves_a_share_of_the_speed() -> None:
    scene = row((1.0, 1.0), responses={(0, "wall"): restitution(0.5, 2.0**-20)})
    check(oracle_contacts(scene, 60.0), [(6.75, 0, RIGHT), (21.75, 0, LEFT), (51.75, 0, RIGHT)])


def test_all_comes_back_up_to_contact_time_after_the_last_contact() -> None:
    scene = row((1.0, 1.0), responses={(0, "wall"): restitution(0.5, 15.0)})
    first: Expected = [(6.75, 0, RIGHT), (21.75, 0, LEFT)]
    check(oracle_contacts(scene, 60.0), [*first, (36.75, 0, RIGHT), (51.75, 0, LEFT)])
    less = row((1.0, 1.0), responses={(0, "wall"): restitution(0.5, math.nextafter(15.0, 0.0))})
    check(oracle_contacts(less, 60.0), [*first, (51.75, 0, RIGHT)])


def test_restitution_of_two() -> None:
    scene = row((1.0, 1.0), (2.0, 0.0), mass=[1.0, 3.0], responses=restitution(0.5, 2.0**-20))
    # 1 - 3/2 * 3/4 = -1/8, and 3/2 * 1/4 = 3/8.
    check(oracle_contacts(scene, 16.0), [(0.5, 0, 1), (10.5, 0, LEFT), (Fraction(95, 6), 1, RIGHT)])


def test_stop_brings_to_rest() -> None:
    rules: Any = {("*", "wall"): "stop", ("*", "*"): "stop"}
    scene = row((2.0, -1.0), (4.0, 0.0), (6.0, -0.5), responses=rules)
    check(oracle_contacts(scene, 100.0), [(1.75, 0, LEFT), (3.0, 1, 2)])
    assert oracle_contacts(scene, max_contacts=5).ended == "quiet"


def test_what_stops_at_an_immovable_body_goes_with_it_until_both_are_jammed() -> None:
    scene = row((2.0, 1.0), (5.0, -0.5), mass=[1.0, INF], responses="stop")
    check(oracle_contacts(scene, 8.0), [(Fraction(5, 3), 0, 1)])
    # At the left wall disc 0 turns back, is stopped, turns back, without end and at one time.
    jam = oracle_contacts(scene, 20.0)
    check(oracle_contacts(scene, max_contacts=2), [(Fraction(5, 3), 0, 1), (8.5, 0, LEFT)])
    assert {each.time.middle for each in jam.contacts[1:]} == {Fraction(17, 2)}
    assert (jam.ended, jam.complete) == ("jammed", False)
    assert "jammed near time 8.5" in jam.ending


def test_a_push_against_what_stops_has_no_end() -> None:
    """Disc 1 is stopped by the wall, and pushed again with a third of the speed, at an irrational time."""
    rules: Any = {("*", "wall"): "stop"}
    places, velocities = [[1.0, 1.0], [0.375, 1.125]], [[-1.0, 0.0], [-1.0, 0.0]]
    scene = kt.Scene(places, velocities, 0.25, [2.0, 1.0], (8.0, 4.0), responses=rules)
    run = oracle_contacts(scene, 4.0)
    assert [(each.a, each.b) for each in run.contacts[:5]] == [(1, LEFT), *[(0, 1), (1, LEFT)] * 2]
    assert run.ended == "jammed"
    assert run.bits > 128, "each contact is slower than the one before"
    assert len({each.time.middle for each in run.contacts[1:]}) == 1


def test_who_rests_at_another_still_touches_it_where_no_number_is_rational() -> None:
    places = [[1.0, 1.0], [3.0, 1.1], [0.25, 0.9]]
    velocities = [[1.0, 0.0], [0.0, 0.0], [0.25, 0.0]]
    kinds, rules = ["ball", "post", "club"], {("ball", "post"): "stop"}
    scene = kt.Scene(places, velocities, [0.25, 0.25, 0.125], [1.0, INF, 0.5], kind=kinds, responses=rules)
    run = oracle_contacts(scene, 20.0)
    met = [(each.a, each.b, each.tied) for each in run.contacts]
    assert met == [(0, 1, False), (0, 2, False), (0, 1, True)]
    assert run.contacts[1].time == run.contacts[2].time
    assert run.ended == "until"


# Passing


def test_passings_begin_and_end() -> None:
    check(oracle_contacts(row((1.0, 1.0), (3.0, -1.0), responses="pass"), 1.5), [(0.75, 0, 1), (1.25, 1, 0)])
    scene = kt.Scene([[0.0, 0.375], [2.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], 0.3125, responses="pass")
    run = oracle_contacts(scene, 4.0)
    check(run, [(1.5, 0, 1), (2.5, 1, 0)])
    assert [each.head_on for each in run.contacts] == [0.8, 0.8]


def test_a_passing_at_irrational_times() -> None:
    scene = kt.Scene([[0.0, 0.5], [2.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], 0.5, responses="pass")
    begin, end = oracle_contacts(scene, 4.0).contacts
    assert (begin.a, begin.b, end.a, end.b) == (0, 1, 1, 0)
    for each, sign in (begin, -1), (end, 1):
        half = sign * (each.time.middle - 2)  # the square root of 3/4
        assert half > 0
        assert abs(half * half - Fraction(3, 4)) < 4 * each.time.radius < Fraction(1, 2**100)
        assert each.head_on == pytest.approx(math.sqrt(0.75), abs=1e-15)


def test_a_passing_ends_by_the_plans_of_its_bodies_as_they_are_then() -> None:
    turns = [(0, 0.875, (-1.0, 0.0)), (0, 3.0, (2.0, 0.0))]
    scene = row((1.0, 1.0), (3.0, -1.0), responses="pass", turns=turns)
    # They fly side by side, one after the other turns back at the wall, and then the first is faster.
    check(oracle_contacts(scene, 3.5), [(0.75, 0, 1), (2.5, 0, LEFT), (2.75, 1, LEFT), (3.25, 1, 0)])


def test_ends_of_passings_come_after_all_else_of_their_time() -> None:
    scene = kt.Scene(
        [[1.0, 0.5], [3.0, 0.5], [1.0, 1.5], [4.0, 1.5], [6.5, 1.5]],
        [[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 0.0]],
        0.25,
        arena=(8.0, 2.0),
        kind=["wisp", "wisp", "ball", "ball", "ball"],
        responses={("wisp", "wisp"): "pass"},
    )
    run = oracle_contacts(scene, 1.25)
    check(run, [(0.75, 0, 1), (1.25, 4, RIGHT), (1.25, 2, 3), (1.25, 1, 0)])
    assert [each.tied for each in run.contacts] == [False, False, True, True]


def test_ends_at_one_irrational_time_are_in_order() -> None:
    places = [[2.0, 0.0], [0.0, 0.5], [2.0, 8.0], [0.0, 7.5]]
    velocities = [[0.0, 0.0], [1.0, 0.0]] * 2
    run = oracle_contacts(kt.Scene(places, velocities, 0.5, responses="pass"), 4.0)
    assert [(each.a, each.b) for each in run.contacts] == [(0, 1), (2, 3), (1, 0), (3, 2)]
    assert [each.tied for each in run.contacts] == [False, True, False, True]
    assert run.bits == 128, "a tie that rational numbers decide"


def test_passings_of_those_who_overlap_begin_at_the_start() -> None:
    run = oracle_contacts(row((2.0, 1.0), (2.25, 0.0), (2.125, 1.0), responses="pass"), 1.0)
    check(run, [(0.0, 0, 1), (0.0, 0, 2), (0.0, 1, 2), (0.625, 2, 1), (0.75, 1, 0)])


def test_a_pair_passes_through_several_images_at_a_time() -> None:
    places, velocities = [[0.0, 0.0], [0.5, 0.0]], [[0.5, 0.0], [0.0, 0.0]]
    scene = kt.Scene(places, velocities, 0.375, arena=(1.0, 1.0), periodic="xy", responses="pass")
    run = oracle_contacts(scene, 2.5)
    check(run, [(0.0, 0, 1), (0.0, 0, 1), (0.5, 1, 0), (1.5, 0, 1), (2.5, 1, 0)])
    assert run.images == ((-1, 0), (0, 0), (-1, 0), (1, 0), (0, 0))


# Commands


def test_bodies_come_and_go() -> None:
    commands = [kt.Insert(1.0, (4.0, 0.5), (-1.0, 0.0), 0.25, 3.0, 7), kt.Remove(0, 4.0)]
    scene = row((1.0, 1.0), commands=commands)
    # 1 - 2 * 3/4 * 2 = -2, and -1 + 2 * 1/4 * 2 = 0.
    check(oracle_contacts(scene, 10.0), [(1.75, 0, 7), (3.0, 0, LEFT)])
    assert oracle_contacts(scene, max_contacts=5).ended == "quiet"


def test_kinds_of_bodies_that_come() -> None:
    rules = {("ball", "wisp"): "pass"}
    before = [kt.Insert(0.25, (3.25, 0.5), (0.0, 0.0), 0.25, kind="wisp"), kt.Remove(1, 1.5)]
    scene = row((1.0, 2.0), kind="ball", commands=before, responses=rules)
    check(oracle_contacts(scene, 2.0), [(0.875, 0, 1), (1.375, 1, 0)])
    inside = [before[0]._replace(position=(1.5, 0.5), velocity=(2.0, 0.0)), before[1]]
    check(oracle_contacts(scene.replace(commands=inside), 2.0), [(0.25, 0, 1), (1.5, 1, 0)])


def test_who_has_no_room_ends_the_run() -> None:
    scene = row((1.0, 1.0), commands=[kt.Insert(1.0, (2.25, 0.5), (0.0, 0.0), 0.125)])
    run = oracle_contacts(scene, 10.0)
    assert (run.ended, run.complete, run.contacts) == ("crowded", False, ())
    assert "has no room" in str(run)
    beside = scene.replace(commands=[kt.Insert(1.0, (2.375, 0.5), (0.0, 0.0), 0.125)])
    check(oracle_contacts(beside, 1.0), [(1.0, 0, 1)])


AT_WALL = (5, 3 << 50, 0)
"""The moment 5.75, at which a disc from 2 with the speed 1 is at the right wall."""


def test_a_command_at_an_exact_tick_comes_before_the_contacts_of_its_time() -> None:
    turn = kt.Turn(0, 5.75, (0.0, 0.25), at=AT_WALL)
    scene = row((2.0, 1.0), commands=[turn])
    check(oracle_contacts(scene, 7.0), [(6.75, 0, TOP)])
    late = scene.replace(commands=[turn._replace(at=(*AT_WALL[:2], 1))])
    with pytest.raises(
        Refused, match=r"for body 0 comes at .* after contacts of its tick, and the oracle has"
    ):
        Oracle(late)


def test_an_exact_end_is_before_the_contacts_of_its_time() -> None:
    scene = row((2.0, 1.0), settings=kt.Settings(until=5.75, end=AT_WALL))
    assert (oracle_contacts(scene).contacts, oracle_contacts(scene).ended) == ((), "until")
    check(oracle_contacts(scene, 6.0), [(5.75, 0, RIGHT)])
    check(oracle_contacts(row((2.0, 1.0)), 5.75), [(5.75, 0, RIGHT)])
    after = row((2.0, 1.0), settings=kt.Settings(until=5.75, end=(*AT_WALL[:2], 1)))
    with pytest.raises(Refused, match="the end of the scene comes at"):
        oracle_contacts(after)


def test_commands_stay_in_their_order_though_a_tick_begins_before_the_times_in_it() -> None:
    late = Fraction(1, 2) + Fraction(1, 2**53)
    commands = [kt.Turn(0, float(late), (0.0, 0.0)), kt.Turn(0, 0.5, (0.0, 1.0), at=(0, 1 << 51, 0))]
    scene = row((2.0, 1.0), commands=commands)
    assert scene.commands == tuple(commands)
    check(oracle_contacts(scene, 1.0), [(late + Fraction(1, 4), 0, TOP)])


# What is refused, and what is said


def test_responses_of_others_are_refused() -> None:
    bumper = kt.Response("bumper", speed=0.5)
    bumper.found = True  # a reader of a file, without the plugin
    with pytest.raises(Refused, match="elastic, pass, restitution, stop, and not bumper"):
        Oracle(row((1.0, 1.0), responses=bumper))


def test_there_are_too_many_bodies_if_they_come_later() -> None:
    with pytest.raises(Refused, match="1000 bodies, and this scene has 1001, inserted ones included"):
        Oracle(row((1.0, 1.0), commands=[kt.Insert(1.0, (4.0, 0.5), (0.0, 0.0), 0.25, body=1000)]))


@pytest.mark.small
def test_the_command_shows_passings(tmp_path: Any) -> None:
    assert "the parting of discs 1 and 3 at time 0.5" in str(FirstDifference(0, (0.5, 3, 1), None, 0.0))
    path = tmp_path / "passing.toml"
    kt.save_scene(row((1.0, 1.0), (3.0, -1.0), responses="pass"), path)
    shown = CliRunner().invoke(app, ["oracle", str(path), "--until", "1.5"])
    assert shown.exit_code == 0
    assert shown.stdout.count("parting") == 1
    against = CliRunner().invoke(app, ["oracle", str(path), "--until", "1.5", "--against", "naive"])
    assert against.exit_code == 0
    assert "2 of 2 contacts agree" in against.stdout


# Games


def outcomes(seeds: range, most: int) -> tuple[Counter[str], list[tuple[int, str]]]:
    """How far so many games agree, and those that do so strangely."""
    many, strange = Counter[str](), []
    for seed in seeds:
        outcome, found = against_oracle(draw_game(seed), most)
        many[outcome] += 1
        if outcome == "strange":
            strange.append((seed, str(found)))
    return many, strange


@pytest.mark.small
def test_games_agree_until_chaos_or_a_tie() -> None:
    many, strange = outcomes(range(40), 60)
    assert strange == []
    assert many["to the end"] >= 30, many


@pytest.mark.slow
@pytest.mark.small
def test_many_games_agree_until_chaos_or_a_tie() -> None:
    many, strange = outcomes(range(1000, 1400), 150)
    assert strange == []
    assert many["to the end"] >= 300, many
