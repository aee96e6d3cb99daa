"""The calendar against a sorted list: any sequence of filings leaves in the one total order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinetile.kernel.compiled import hook
from kinetile.kernel.loop import calendar
from kinetile.kernel.tables import GUESS, NEVER, NOBODY, PAIR, STRUCTURAL, WALL, Kernel, allocate, clear

pytestmark = pytest.mark.small

BODIES = 9
PARTNERS = (3, 5, 8, 0, 1, 2, 4, 6, 7)
"""The partner of each body: some pairs are there twice, some run against the order of their bodies."""

kinds = st.sampled_from([STRUCTURAL, GUESS, WALL, PAIR])
ticks = st.one_of(
    st.integers(-3, 3),
    st.integers(-200, 200),
    st.integers(0, 2**40),
    st.integers(2**60, 2**62),
    st.just(NEVER),
)
filings = st.tuples(st.just("file"), st.integers(0, BODIES - 1), ticks, kinds)
changes = st.lists(
    st.one_of(
        filings,
        filings,
        filings,
        st.tuples(st.just("head"), st.just(0), st.just(0), st.just(0)),
        st.tuples(st.just("shift"), st.integers(0, 55), st.just(0), st.just(0)),
    ),
    max_size=50,
)


@hook
def file(k: Kernel, body: int, key: int, kind: int) -> None:
    k.queue[body].kind = kind
    calendar.move(k, body, key)


@hook
def pop(k: Kernel) -> int:
    first = calendar.head(k)
    if first >= 0:
        calendar.move(k, first, NEVER)
    return first


def tables(shift: int = 0, bodies: int = BODIES) -> Kernel:
    k = allocate(bodies, bodies, 1)
    k.clock[0].calendar.shift = shift
    clear(k)
    for body in range(min(bodies, BODIES)):
        k.queue[body].partner = PARTNERS[body]
    return k


def order(entry: tuple[int, int, int]) -> tuple[int, ...]:
    body, key, kind = entry
    first, second = sorted((body, PARTNERS[body])) if kind == PAIR else (0, 0)
    return (key, kind, first, second, body)


@given(changes, st.integers(0, 55))
@settings(deadline=None, max_examples=30)
def test_entries_leave_in_the_one_total_order(changes, shift):
    k = tables(shift)
    model: dict[int, tuple[int, int, int]] = {}
    for what, body, key, kind in changes:
        if what == "shift":
            k.clock[0].calendar.shift = body
            calendar.file_all(k)
        elif what == "head":
            assert int(calendar.head(k)) == (min(model.values(), key=order)[0] if model else NOBODY)
        else:
            file(k, body, np.int64(key), kind)
            model.pop(body, None)
            if key != NEVER:
                model[body] = (body, key, kind)
        assert int(k.counts[0].queued) == len(model)
    found = [int(pop(k)) for _ in range(len(model) + 1)]
    assert found == [*(body for body, _, _ in sorted(model.values(), key=order)), NOBODY]
    assert not k.marks.any()
    assert (k.rings == BODIES).all()


@given(
    st.lists(st.tuples(ticks.filter(lambda tick: tick != NEVER), kinds), min_size=1, max_size=BODIES),
    st.integers(0, 55),
)
@settings(deadline=None)
def test_nothing_but_head_and_partner_comes_before_the_runner_up(entries, shift):
    k = tables(shift)
    for body, (key, kind) in enumerate(entries):
        file(k, body, np.int64(key), kind)
    head = int(calendar.head(k))
    for partner in range(BODIES):
        bound = int(calendar.runner_up(k, head, partner))
        others = [key for body, (key, _) in enumerate(entries) if body not in (head, partner)]
        assert bound <= min([*others, NEVER])


def test_the_longest_queue_is_counted():
    k = tables()
    for body in (1, 2, 3):
        file(k, body, np.int64(body), GUESS)
    pop(k)
    file(k, 5, np.int64(1), GUESS)
    assert (int(k.counts[0].queued), int(k.counts[0].queue_max)) == (3, 3)


def bodies_of(k: Kernel, day: int) -> list[int]:
    at, found = int(k.rings[calendar.ring_of(k, day)]), []
    while at < len(k.bodies):
        found.append(at)
        at = int(k.links[at].next)
    return found


def test_a_burst_at_one_tick_was_searched_through_for_each_of_its_heads():
    """A million discs on edges of cells took 2 ms a head: now the ring is put in order once, when it is
    reached, its first is the head, and later entries are filed in order."""
    rng = np.random.default_rng(6)
    k = tables(shift=3)
    order_of_filing = [int(body) for body in rng.permutation(BODIES)]
    for body in order_of_filing[:-1]:
        file(k, body, np.int64(8 + rng.integers(2) * 8 * 4096), STRUCTURAL)  # this year and one to come
    assert bodies_of(k, 1) == order_of_filing[-2::-1]
    by_rank = sorted(order_of_filing[:-1], key=lambda body: (int(k.queue[body].key), body))
    assert int(calendar.head(k)) == by_rank[0]
    assert bodies_of(k, 1) == by_rank
    file(k, order_of_filing[-1], np.int64(8), STRUCTURAL)
    assert bodies_of(k, 1) == sorted(range(BODIES), key=lambda body: (int(k.queue[body].key), body))
