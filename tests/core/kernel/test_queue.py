"""The queue against a sorted list: any sequence of schedulings pops in the one total order."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from kinetile.kernel.queue import precedes, schedule
from kinetile.kernel.tables import NEVER, allocate, clear

BODIES, STRUCTURAL, PAIRS = 3, 4, 6
FIRST_PAIR = STRUCTURAL + 1 + BODIES
CERTIFICATES = FIRST_PAIR + PAIRS

changes = st.lists(
    st.tuples(st.integers(0, CERTIFICATES - 1), st.one_of(st.integers(-3, 3), st.just(NEVER))), max_size=60
)


def tables():
    k = allocate(BODIES, STRUCTURAL, PAIRS, 1)
    clear(k)
    # Pairs whose numbers run against the order of their bodies, as a free list leaves them.
    for number, (a, b) in enumerate([(1, 2), (0, 2), (0, 1), (2, 3), (1, 3), (0, 3)]):
        k.certificates[FIRST_PAIR + number].a = a
        k.certificates[FIRST_PAIR + number].b = b
    return k


def order(k, certificate):
    record = k.certificates[certificate]
    return (FIRST_PAIR, int(record.a), int(record.b)) if certificate >= FIRST_PAIR else (certificate, 0, 0)


@given(changes)
@settings(deadline=None)
def test_entries_leave_in_the_one_total_order(changes):
    k = tables()
    model = {}
    for certificate, tick in changes:
        schedule(k, certificate, tick)
        model.pop(certificate, None)
        if tick != NEVER:
            model[certificate] = tick
        assert int(k.clock[0].queued) == len(model)
        for place in range(len(model)):
            assert int(k.certificates[int(k.queue[place].certificate)].place) == place
    expected = sorted(model, key=lambda certificate: (model[certificate], order(k, certificate)))
    popped = []
    while k.clock[0].queued:
        popped.append(int(k.queue[0].certificate))
        schedule(k, popped[-1], NEVER)
    assert popped == expected


@given(
    st.integers(0, CERTIFICATES - 1), st.integers(0, CERTIFICATES - 1), st.integers(-2, 2), st.integers(-2, 2)
)
@settings(deadline=None)
def test_precedence_is_total(one, two, tick, other_tick):
    k = tables()
    if (one, tick) == (two, other_tick):
        assert not precedes(k, tick, one, other_tick, two)
    elif one != two:
        assert precedes(k, tick, one, other_tick, two) != precedes(k, other_tick, two, tick, one)


def test_insertion_order_does_not_matter():
    rng = np.random.default_rng(5)
    first = None
    for _ in range(20):
        k = tables()
        for certificate in rng.permutation(CERTIFICATES):
            schedule(k, int(certificate), 7)
        popped = []
        while k.clock[0].queued:
            popped.append(int(k.queue[0].certificate))
            schedule(k, popped[-1], NEVER)
        first = first or popped
        assert popped == first
