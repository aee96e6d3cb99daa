"""Bodies with accelerations: drawn games have one list, by the rules and under every phase; and what the
examples of docs/specification.md say."""

import itertools
import math
from contextlib import suppress

import numpy as np
import pytest

import by_the_rules
import games
import kinetile as kt
from kinetile.errors import MissedContactError, NoRoom, Refused, ZenoError
from kinetile.instruments import composition_of
from kinetile.kernel.tables import NOBODY
from kinetile_conformance.checks.meetings import copied
from lanes import first

pytestmark = pytest.mark.small

PHASES = ("naive", "cells", "sap-1d", "sweep-tiling", "power")
MOST = 60


@pytest.mark.parametrize("seed", first(3, [0, 1, 3, 2, *range(4, 200)]))
def test_a_drawn_game_has_one_list_by_the_rules_and_under_every_phase(seed: int) -> None:
    """Lattices with exact ties and others, with pegs, own accelerations, kinds, and commands. Where
    bodies come to rest on each other a run ends before the list does."""
    one_list(games.draw_accelerated_game(seed), PHASES)


@pytest.mark.parametrize("seed", first(1, range(1, 101)))
def test_a_drawn_game_of_shapes_has_one_list(seed: int) -> None:
    """Convex shapes, with margins or not, among obstacles, also beside a periodic axis."""
    one_list(games.draw_accelerated_game_of_shapes(seed), ("naive", "cells", "sap-1d"), 20)


def one_list(game: kt.Scene, phases: tuple[str, ...], most: int = MOST) -> None:
    wanted = by_the_rules.answer_of_game(game, most)
    played = 0
    for phase in phases:
        ended = False
        with suppress(Refused):
            kt.Simulation(game, phase).build()
            sim = kt.Simulation(game, phase)
            try:
                sim.run(max_contacts=most)
            except (MissedContactError, NoRoom, ZenoError):
                ended = True
            found = by_the_rules.rows(sim)[:most]  # passings of the start begin all at once
            assert found == (wanted[: len(found)] if ended else wanted), phase
            played += 1
    assert played > 0 or game.periodic


def meetings(count: int, places: list[tuple[float, float]], velocities: list[tuple[float, float]], **more):
    """Returns the times and bodies of the first contacts under naive, which are the rules' contacts."""
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


@pytest.mark.parametrize("seed", first(2, range(8)))
@pytest.mark.parametrize("periodic", ["", "x"])
def test_no_bound_is_later_than_the_contact(periodic: str, seed: int) -> None:
    """Up to the end of the chord of either; in a narrow arena, where images follow each other closely."""
    random = np.random.default_rng(seed)
    place = np.stack(np.meshgrid(range(3), range(3)), axis=-1).reshape(-1, 2) + 0.5
    pulls = random.normal(size=place.shape) * [periodic != "x", True] * 2.0 ** random.integers(-3, 4)
    scene = kt.Scene(
        place, random.normal(size=place.shape), 0.375, arena=(3.0, 3.0), periodic=periodic, acceleration=pulls
    )
    sim, looked_at = kt.Simulation(scene, "naive"), 0
    parts = composition_of(sim).pair
    assert parts is not None
    assert parts.soonest is not None
    for _ in range(3):
        sim.run(max_contacts=4)
        k = copied(sim.tables)
        now, per_time = int(k.clock[0].now), float(k.clock[0].per_time)
        for a, b in itertools.permutations(range(len(place)), 2):
            k.near[0] = b
            with np.errstate(all="ignore"):
                bound, _, _ = parts.soonest(k, a, 1, NOBODY, now)
            one, two = sorted((a, b), key=lambda body: (int(k.bodies[body].anchor), body))
            tick = parts.meet(k, one, two)
            if now <= tick < min(int(k.bodies[body].end) for body in (a, b)):
                assert bound * per_time * (1.0 - 2.0**-50) <= max(tick - now, 1), (a, b)
                looked_at += 1
    assert looked_at > 0
