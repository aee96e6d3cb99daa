"""Bodies with accelerations: drawn games have one list, by the rules and under every phase; and what the
examples of docs/specification.md say."""

import math
from contextlib import suppress

import pytest

import by_the_rules
import games
import kinetile as kt
from kinetile.errors import MissedContactError, NoRoom, Refused, ZenoError
from lanes import first

pytestmark = pytest.mark.small

PHASES = ("naive", "cells", "sap-1d", "sweep-tiling", "power")
MOST = 60


@pytest.mark.parametrize("seed", first(3, [0, 1, 3, 2, *range(4, 200)]))
def test_a_drawn_game_has_one_list_by_the_rules_and_under_every_phase(seed: int) -> None:
    """Lattices with exact ties and others, with pegs, own accelerations, kinds, and commands. Where
    bodies come to rest on each other a run ends before the list does."""
    game = games.draw_bent_game(seed)
    wanted = by_the_rules.answer_of_game(game, MOST)
    played = 0
    for phase in PHASES:
        ended = False
        with suppress(Refused):
            kt.Simulation(game, phase).build()
            sim = kt.Simulation(game, phase)
            try:
                sim.run(max_contacts=MOST)
            except (MissedContactError, NoRoom, ZenoError):
                ended = True
            found = by_the_rules.rows(sim)
            assert found == (wanted[: len(found)] if ended else wanted), phase
            played += 1
    assert played > 0 or game.periodic


def meetings(count: int, places: list[tuple[float, float]], velocities: list[tuple[float, float]], **more):
    """Returns the times and bodies of the first contacts under naive, which are those of the rules."""
    mass = [1.0] if len(places) == 1 else [math.inf, 1.0]
    scene = kt.Scene(places, velocities, 0.25, mass, unit=1.0, **more)
    sim = kt.Simulation(scene, "naive")
    sim.run(max_contacts=count)
    assert by_the_rules.rows(sim) == by_the_rules.answer(scene, count, 2**60).contacts
    return [(time, a, b) for time, _, _, a, b in sim.contacts.tolist()]


def test_a_ball_that_leaves_the_floor_is_back_at_2_4_6() -> None:
    rows = meetings(3, [(1.0, 0.25)], [(0.0, 1.0)], arena=(2.0, 2.0), gravity=(0.0, -1.0))
    assert rows == [(2.0, 0, -3), (4.0, 0, -3), (6.0, 0, -3)]


@pytest.mark.parametrize(("speed", "met"), [(1.0, (2.5, 1, -3)), (0.875, (1.0667460501135313, 0, 1))])
def test_a_disc_that_is_thrown_over_a_peg_may_touch_it_and_not_meet_it(speed: float, met: object) -> None:
    more = {"arena": (8.0, 4.0), "gravity": (0.0, -2.0)}
    assert meetings(1, [(2.0, 2.0), (1.0, 1.5)], [(0.0, 0.0), (speed, 2.0)], **more) == [met]


def test_a_ball_bounces_on_a_peg_again_and_again() -> None:
    """The two are barred after each contact, and no other event is between."""
    more = {"arena": (2.0, 4.0), "gravity": (0.0, -1.0)}
    rows = meetings(3, [(1.0, 1.0), (1.0, 2.0)], [(0.0, 0.0), (0.0, 0.0)], **more)
    assert rows == [(1.0, 0, 1), (3.0, 0, 1), (5.0, 0, 1)]
