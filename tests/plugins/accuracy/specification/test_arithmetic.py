"""The certifier's arithmetic: the error of a product, and lower bounds of contact times."""

import json
from pathlib import Path

import numpy as np
import pytest

from kinetile_accuracy.specification.arithmetic import HORIZON, FlightPlan, Frame, Separation, product_error
from kinetile_accuracy.specification.bounds import ContactBounds
from kinetile_accuracy.specification.touching import touching_tick

VECTORS = Path(__file__).parents[3] / "vectors" / "contacts"
NAMES = sorted({path.stem for path in VECTORS.glob("*.json")} - {"extreme"})  # no scene holds those


@pytest.mark.parametrize("name", NAMES)
def test_no_contact_is_before_its_bound_and_the_order_of_two_bodies_does_not_matter(name):
    tight = 0
    families = json.loads((VECTORS / f"{name}.json").read_text())["families"].values()
    for e, one, two, answer in (row for family in families for row in family):
        frame, tick = Frame(None, e), None if answer is None else int(answer)
        numbers = [[*map(float.fromhex, words[:5])] for words in (one, two)]
        plans = [
            FlightPlan(x, y, vx, vy, int(words[5]), radius, frame)
            for (x, y, vx, vy, radius), words in zip(numbers, (one, two), strict=True)
        ]
        assert [touching_tick(None, Separation(*order)) for order in (plans, plans[::-1])] == [tick, tick]
        since = max(each.anchor for each in plans)
        if since - min(each.anchor for each in plans) > HORIZON:
            continue  # one of them would have been anchored before
        found = ContactBounds(np.array([numbers[0][4], numbers[1][4]]), frame.fine)
        found.rebase(since)
        for body, each in enumerate(plans):
            found.put(body, each)
        for now in {since, since if tick is None else since + (tick - since) * 2 // 3}:
            wait = found.waits([0, 1], now)
            assert np.isinf(wait.diagonal()).all()
            if tick is not None:
                assert now + int(max(wait[0, 1], wait[1, 0])) <= tick
                tight += tick - now - wait[0, 1] < 1e-3 * (tick - now) + 2**20
            else:
                tight += bool(wait[0, 1] >= HORIZON)
    assert tight > 10  # it is a bound that says something


def test_what_a_product_loses_is_one_number():
    assert product_error(1.0 + 2.0**-52, 1.0 + 2.0**-52) == 2.0**-104
    assert product_error(2.0**-1000, 2.0**-1000) == 0.0  # 2^-2000 has no double
    assert product_error(0.1, 10.0) == -product_error(-0.1, 10.0) != 0.0


def test_where_a_square_underflows_the_bound_is_now():
    found = ContactBounds(np.array([0.25, 0.25]), 52)
    frame = Frame(None, 0)
    found.put(0, FlightPlan(0.0, 0.0, 1e-300, 0.0, 0, 0.25, frame))
    found.put(1, FlightPlan(4.0, 0.0, -1e-300, 0.0, 0, 0.25, frame))
    assert found.waits([0], 0)[0, 1] == 0.0
    found.put(1, FlightPlan(4.0, 0.0, 1e-300, 0.0, 0, 0.25, frame))
    assert found.waits([0], 0)[0, 1] == np.inf  # none
