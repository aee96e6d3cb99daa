"""The kernel knows certificates and events, not collisions alone: the examples, of which one sorts, and one
keeps the closest pair."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from installing import loaded
from registering import registered, remove

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
PRINTED = {
    "kinetile-thesis/kinetile_thesis/sorted_list.py": [
        "at  0.5: [1, 0, 2, 3, 4, 5] after 1 events",
        "at  1.0: [1, 0, 4, 2, 3, 5] after 3 events",
        "at  2.0: [1, 4, 3, 2, 0, 5] after 7 events",
        "at  4.0: [1, 4, 3, 5, 2, 0] after 9 events",
        "at  8.0: [0, 4, 1, 5, 3, 2] after 16 events",
    ],
    "closest_pair.py": [
        "0.000000: (6, 7)",
        "0.838092: (4, 7)",
        "3.077640: (3, 5)",
        "5.584348: (0, 3)",
        "6.000000: 19 certificates have failed",
    ],
}


COMPILED = [pytest.param(each, marks=(pytest.mark.slow, pytest.mark.compiled)) for each in PRINTED]


@pytest.mark.parametrize("example", [*PRINTED, *COMPILED])
def test_an_example_prints_its_events(example, capsys):
    with loaded(EXAMPLES / example) as module, remove("sorted-list"):  # kinetile-thesis may be installed
        module.main()
    assert capsys.readouterr().out.splitlines() == PRINTED[example]


def squares(sim):
    """Returns the squared distance of each pair of points at the end of this tick, exactly."""
    clock, s = sim.tables.clock[0], sim.state
    tick = Fraction(float(clock.per_tick))
    places = [
        [Fraction(float(x)) + Fraction(float(v)) * int(clock.now + 1 - b.anchor) * tick for x, v in axes]
        for b in sim.tables.bodies
        for axes in [((b.x, b.vx), (b.y, b.vy))]
    ]
    ends = zip(s.one.tolist(), s.other.tolist(), strict=True)
    return [sum((x - y) ** 2 for x, y in zip(places[a], places[b], strict=True)) for a, b in ends]


@pytest.mark.parametrize("seed", range(12))
def test_each_winner_among_pairs_is_the_closer_one_of_exact_distances(seed):
    """Two of three are lattices, where many are equal, or change at the very tick; one point turns, and one
    is removed. Where all is slow the clock's base moves."""
    rng = np.random.default_rng(seed)
    place, speed = rng.uniform(0.0, 6.0, (7, 2)), rng.normal(size=(7, 2))
    if seed % 3:
        place = np.stack(np.divmod(rng.permutation(36)[:7], 6), axis=-1).astype(float)
        speed = rng.integers(-2, 3, (7, 2)) / 2.0
    slow = 2.0 ** (-10 * (seed % 2))
    with loaded(EXAMPLES / "closest_pair.py") as example, registered(example.Plugin()):
        sim = kt.Simulation(kt.Scene(place, speed * slow, 2.0**-10), "closest-pair", narrow_phases=[])
        for step in range(20):
            if step == 8:
                sim.set_velocity(2, (slow, slow / 2))
            elif step == 14:
                sim.remove(1)
            sim.run(until=step / slow / 4)
            square, winner = squares(sim), sim.state.winner.tolist()
            for v in range(1, len(square)):
                assert square[winner[v]] == min(square[winner[2 * v]], square[winner[2 * v + 1]])
                assert winner[v] in winner[2 * v : 2 * v + 2]
        assert sim.readings.structural_events > 5
