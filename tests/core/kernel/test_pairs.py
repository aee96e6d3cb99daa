"""The pair set against a multiset: the same pairs, lists and free records; and who is new is offered."""

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinetile.kernel.pairs import add_pair, held_pairs, offer, pairs_of, remove_pair
from kinetile.kernel.tables import BAD_PAIR, OFFERS, UNKNOWN_PAIR, allocate, clear, pair_set

pytestmark = pytest.mark.small

BODIES = 9
CAPACITY = 40

pair = st.lists(st.integers(0, BODIES - 1), min_size=2, max_size=2, unique=True).map(tuple)
steps = st.lists(st.tuples(st.booleans(), pair), max_size=120)


def tables(capacity=CAPACITY):
    k = pair_set(allocate(BODIES, BODIES, 1), capacity)
    clear(k)
    return k


@given(steps)
@settings(deadline=None, max_examples=25)
def test_pairs_are_a_multiset(steps):
    k = tables()
    model = Counter()
    for adding, (a, b) in steps:
        k.clock[0].lists.offered = 0
        key = (min(a, b), max(a, b))
        if adding:
            add_pair(k, a, b)
            model[key] += 1
            assert int(k.clock[0].lists.offered) == (model[key] == 1)
            if model[key] == 1:
                assert tuple(k.offers[0].tolist()) == key
        elif model[key] > 0:
            remove_pair(k, a, b)
            model[key] -= 1
    live = +model
    assert held_pairs(k) == sorted(live)
    table = k.pairs[k.pairs.a >= 0]
    assert {(int(r.a), int(r.b)): int(r.holds) for r in table} == dict(live)
    assert int(k.clock[0].lists.pairs) == len(live)
    for body in range(BODIES):
        partners = [b if a == body else a for a, b in live if body in (a, b)]
        assert sorted(k.near[: pairs_of(k, body)].tolist()) == sorted(partners)
    assert k.clock[0].fault.code == 0
    free, at = 0, int(k.clock[0].lists.free_pair)
    while at >= 0:
        free, at = free + 1, int(k.pairs[at].next_a)
    assert free == CAPACITY - len(live)


def test_a_full_table_asks_for_room_and_loses_count_of_nothing():
    k = tables(capacity=2)
    for a in range(5):
        add_pair(k, a, a + 1)
    assert int(k.clock[0].lists.pairs) == 2
    assert int(k.clock[0].lists.wanted) == 3


def test_removing_what_is_not_there_is_a_fault():
    k = tables()
    add_pair(k, 1, 2)
    remove_pair(k, 1, 3)
    assert int(k.clock[0].fault.code) == UNKNOWN_PAIR
    assert (int(k.clock[0].fault.a), int(k.clock[0].fault.b)) == (1, 3)


def test_without_a_pair_set_room_is_asked_for():
    k = allocate(BODIES, BODIES, 1)
    clear(k)
    add_pair(k, 0, 1)
    assert int(k.clock[0].lists.wanted) == 1
    assert pairs_of(k, 0) == 0
    remove_pair(k, 0, 1)  # what was wanted is not known to be missing
    assert int(k.clock[0].fault.code) == 0


@pytest.mark.parametrize("report", [add_pair, offer])
@pytest.mark.parametrize(("a", "b"), [(-1, 2), (0, BODIES), (BODIES, 0), (3, 3)])
def test_what_is_not_two_bodies_is_a_fault(report, a, b):
    k = tables()
    report(k, a, b)
    assert int(k.clock[0].fault.code) == BAD_PAIR
    assert int(k.clock[0].lists.offered) == 0


def test_more_offers_than_there_is_room_for_are_counted_and_nothing_is_overwritten():
    k = tables()
    for number in range(OFFERS + 3):
        offer(k, number % 4, 4 + number % 5)
    assert int(k.clock[0].lists.offered) == OFFERS + 3
    assert [tuple(each) for each in k.offers[:2].tolist()] == [(0, 4), (1, 5)]
