"""Games: the certifier agrees with runs of them to their ends, and finds forged lists of their contacts."""

import contextlib
from collections import Counter

import numpy as np
import pytest

import kinetile as kt
from games import draw_accelerated_game, draw_changing_game, draw_game, draw_game_of_shapes, draw_moving_game
from judged_games import forged_and_found, with_end
from kinetile.errors import Refused, ZenoError
from kinetile.kernel.log import LOG
from kinetile_accuracy import certify_log
from lanes import first


@pytest.mark.small
@pytest.mark.parametrize("draw", [draw_game, draw_game_of_shapes, draw_accelerated_game])
@pytest.mark.parametrize("seed", first(1, range(60)))
def test_a_game_is_certified_to_its_end(draw, seed):
    game = draw(seed)
    sim, end = with_end(game)
    found = certify_log(game, sim.contacts, **end, fingerprint=sim.fingerprint)
    assert found.right, str(found)


@pytest.mark.small
@pytest.mark.parametrize("draw", [draw_game, draw_accelerated_game, draw_changing_game, draw_moving_game])
@pytest.mark.parametrize("seed", first(1, range(100)))
def test_the_plans_of_a_recorded_game_are_certified(seed, draw):
    """With commands among the rows, and the plan of each body after each event."""
    game, rows = draw(seed), [np.zeros(0, LOG)]
    with contextlib.suppress(ZenoError, Refused):
        kt.Simulation(game, "naive").run(max_contacts=100, recorder=lambda some: rows.append(some.copy()))
    assert certify_log(game, np.concatenate(rows)).right


@pytest.mark.small
@pytest.mark.parametrize("seeds", first(1, [range(2), *(range(k, k + 4) for k in range(0, 100, 4))]))
def test_forged_lists_of_games_are_found_at_the_first_wrong_line(seeds):
    found = Counter()
    for seed in seeds:
        for name, is_found in forged_and_found(draw_game(seed), seed):
            assert is_found, (seed, name)
            found[name] += 1
    assert len(found) >= 9


def test_at_an_exact_end_so_many_contacts_of_its_tick_are_there():
    """Three pairs meet at one time; the scene ends after some of them."""
    places = [(x, y) for y in (0.5, 1.0, 1.5) for x in (0.25, 0.75)]
    velocities = [(0.5, 0.0), (-0.5, 0.0)] * 3
    for after in (0, 1, 2, 3):
        end = kt.Settings(until=0.25, end=(0, 2**50, after))
        scene = kt.Scene(places, velocities, 0.125, arena=(2.0, 2.0), settings=end)
        sim = kt.Simulation(scene, "naive")
        sim.run()
        assert len(sim.contacts) == after
        assert certify_log(scene, sim.contacts, 0.25).right
        all_three = kt.Simulation(scene.replace(settings=kt.Settings()), "naive")
        all_three.run(until=0.25)
        wrong = certify_log(scene, all_three.contacts, 0.25).wrong
        assert (wrong is None) == (after == 3)
        assert wrong is None or (wrong.index, wrong.expected) == (after, None)
        assert after == 0 or not certify_log(scene, sim.contacts[:-1], 0.25).right
