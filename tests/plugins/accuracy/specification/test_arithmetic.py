"""The certifier's arithmetic against the test vectors, which were made by other programs; and its bounds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from kinetile.scene import Scene, Turn
from kinetile_accuracy.specification.arithmetic import (
    HORIZON,
    FlightPlan,
    Frame,
    anchored,
    exchanged,
    pair_tick,
    product_error,
    tick_of,
    unit_bits,
    wall_tick,
)
from kinetile_accuracy.specification.bounds import ContactBounds

VECTORS = Path(__file__).parents[3] / "vectors"
CONTACTS = sorted(path.stem for path in (VECTORS / "contacts").glob("*.json"))
double = float.fromhex


def rows(name):
    """Yield the questions of a file of vectors."""
    for family in json.loads((VECTORS / f"{name}.json").read_text())["families"].values():
        yield from family


def plan(row, frame):
    x, y, vx, vy, radius = map(double, row[:5])
    return FlightPlan(x, y, vx, vy, int(row[5]), radius, frame)


@pytest.mark.parametrize("name", CONTACTS)
def test_pairs_meet_when_the_vectors_say(name):
    seen = 0
    for e, one, two, tick in rows(f"contacts/{name}"):
        frame = Frame(None, e)
        both = plan(one, frame), plan(two, frame)
        assert pair_tick(*both) == pair_tick(*reversed(both)) == (None if tick is None else int(tick))
        seen += 1
    assert seen > 100


@pytest.mark.parametrize("name", [name for name in CONTACTS if name != "extreme"])  # no scene holds those
def test_no_contact_is_before_its_bound(name):
    tight = 0
    for e, one, two, tick in rows(f"contacts/{name}"):
        frame = Frame(None, e)
        plans = plan(one, frame), plan(two, frame)
        since = max(each.anchor for each in plans)
        radii = np.array([double(one[4]), double(two[4])])
        found = ContactBounds(radii, frame.fine)
        found.rebase(since)
        if since - min(each.anchor for each in plans) > HORIZON:
            continue  # one of them would have been anchored before
        for body, each in enumerate(plans):
            found.put(body, each)
        for now in {since, since if tick is None else since + (int(tick) - since) * 2 // 3}:
            wait = found.waits([0, 1], now)
            assert np.isinf(wait.diagonal()).all()
            if tick is not None:
                assert now + int(max(wait[0, 1], wait[1, 0])) <= int(tick)
                tight += int(tick) - now - wait[0, 1] < 1e-3 * (int(tick) - now) + 2**20
            else:
                tight += bool(wait[0, 1] >= HORIZON)
    assert tight > 10  # it is a bound that says something


def test_walls_are_met_when_the_vectors_say():
    for e, sides, row, answer in rows("walls"):
        frame = Frame((double(sides[0]), double(sides[1])), e)
        assert wall_tick(plan(row, frame), frame) == (answer and (int(answer[0]), answer[1]))


def test_momentum_is_exchanged_as_the_vectors_say():
    for masses, one, two, answer in rows("exchanges"):
        a, b = list(map(double, one)), list(map(double, two))
        found = exchanged(
            ((a[0], a[1]), (b[0], b[1])),
            ((a[2], a[3]), (b[2], b[3])),
            masses and (double(masses[0]), double(masses[1])),
        )
        assert [*found[0], *found[1]] == list(map(double, answer))


def test_plans_are_anchored_as_the_vectors_say():
    for e, row, anchor, tick, answer in rows("places"):
        x, y, vx, vy = map(double, row)
        elapsed, length = int(tick) - int(anchor), 2.0 ** -(52 + e)
        assert [anchored(x, vx, elapsed, length), anchored(y, vy, elapsed, length)] == list(
            map(double, answer)
        )


def test_times_have_the_ticks_of_the_vectors():
    for e, start, time, tick in rows("times"):
        assert tick_of(double(time), double(start), e) == int(tick)


def test_units_are_those_of_the_vectors():
    seen = 0
    for sides, bodies, turns, e in rows("units"):
        states = np.array([[double(each) for each in body] for body in bodies]).reshape(-1, 5)
        scene = object.__new__(Scene)  # some of these are no scenes: bodies of such speeds are refused
        scene.__dict__.update(
            position=states[:, :2],
            velocity=states[:, 2:4],
            radius=states[:, 4],
            arena=sides and tuple(map(double, sides)),
            commands=tuple(Turn(0, 0.0, tuple(map(double, turn))) for turn in turns),
            unit=None,
        )
        assert unit_bits(scene) == e
        seen += 1
    assert seen > 20


def test_what_a_product_loses_is_one_number():
    assert product_error(1.0 + 2.0**-52, 1.0 + 2.0**-52) == 2.0**-104
    assert product_error(2.0**-1000, 2.0**-1000) == 0.0  # 2^-2000 has no double
    assert product_error(0.1, 10.0) == -product_error(-0.1, 10.0) != 0.0


def test_what_the_filter_cannot_compute_it_leaves_to_be_asked():
    found = ContactBounds(np.array([0.25, 0.25]), 52)
    frame = Frame(None, 0)
    found.put(0, FlightPlan(0.0, 0.0, 1e-300, 0.0, 0, 0.25, frame))
    found.put(1, FlightPlan(4.0, 0.0, -1e-300, 0.0, 0, 0.25, frame))
    assert found.waits([0], 0)[0, 1] == 0.0  # the square of the speed underflows
    found.put(1, FlightPlan(4.0, 0.0, 1e-300, 0.0, 0, 0.25, frame))
    assert found.waits([0], 0)[0, 1] == np.inf  # none
