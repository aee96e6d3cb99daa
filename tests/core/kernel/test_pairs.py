"""The candidate pairs against a multiset: any sequence of adds and removes leaves the same pairs, lists and
free records."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinetile.kernel.faults import BAD_PAIR, UNKNOWN_PAIR
from kinetile.kernel.pairs import add_pair, remove_pair
from kinetile.kernel.tables import allocate, clear

BODIES = 9
CAPACITY = 40

pair = st.lists(st.integers(0, BODIES - 1), min_size=2, max_size=2, unique=True).map(tuple)
steps = st.lists(st.tuples(st.booleans(), pair), max_size=120)


def tables(capacity=CAPACITY):
    k = allocate(BODIES, 0, capacity, 1)
    clear(k)
    return k


def listed(k, body):
    found = []
    at = int(k.bodies[body].first)
    while at >= 0:
        record = k.certificates[at]
        found.append(int(record.b if record.a == body else record.a))
        at = int(record.next_a if record.a == body else record.next_b)
    return found


@given(steps)
@settings(deadline=None, max_examples=200)
def test_pairs_are_a_multiset(steps):
    k = tables()
    model = Counter()
    for adding, (a, b) in steps:
        k.clock[0].fresh = 0
        key = (min(a, b), max(a, b))
        if adding:
            add_pair(k, a, b)
            model[key] += 1
        elif model[key] > 0:
            remove_pair(k, a, b)
            model[key] -= 1
    live = +model
    table = k.certificates[k.certificates.a >= 0]
    assert {(int(r.a), int(r.b)): int(r.holds) for r in table} == dict(live)
    assert int(k.clock[0].pairs) == len(live)
    for body in range(BODIES):
        partners = [b if a == body else a for a, b in live if body in (a, b)]
        assert sorted(listed(k, body)) == sorted(partners)
    assert k.clock[0].fault == 0
    free, at = 0, int(k.clock[0].free)
    while at >= 0:
        free, at = free + 1, int(k.certificates[at].next_a)
    assert free == CAPACITY - len(live)


def test_a_full_table_asks_for_room_and_loses_count_of_nothing():
    k = tables(capacity=2)
    for a in range(5):
        add_pair(k, a, a + 1)
    assert int(k.clock[0].pairs) == 2
    assert int(k.clock[0].wanted) == 3


@pytest.mark.parametrize(("a", "b"), [(-1, 2), (0, BODIES), (3, 3)])
def test_what_is_not_a_pair_of_bodies_is_a_fault(a, b):
    k = tables()
    add_pair(k, a, b)
    assert int(k.clock[0].fault) == BAD_PAIR


def test_removing_what_is_not_there_is_a_fault():
    k = tables()
    add_pair(k, 1, 2)
    remove_pair(k, 1, 3)
    assert int(k.clock[0].fault) == UNKNOWN_PAIR
    assert (int(k.clock[0].fault_a), int(k.clock[0].fault_b)) == (1, 3)
