"""Rows of events and contacts, room for them, and what follows from each contact: stops, jams, faults."""

import math

import numpy as np
import pytest

from kinetile.kernel.compiled import compose
from kinetile.kernel.features import NONE
from kinetile.kernel.log import INSERTED, REMOVED, TURNED
from kinetile.kernel.loop import LOG_FULL, NO_REASON
from kinetile.kernel.loop.bookkeeping import (
    ANY_BEGIN,
    ENDS,
    SOME,
    count_contact,
    count_row,
    is_watched,
    log,
    log_is_full,
    log_passing,
    stop_there,
)
from kinetile.kernel.loop.commands import must_wait
from kinetile.kernel.tables import (
    COMMAND,
    JAMMED,
    NOT_FINITE,
    OFFER,
    PASSING,
    ROW,
    TOO_DEEP,
    TRAIT,
    Kernel,
    allocate,
    record_table,
)

pytestmark = pytest.mark.small


def tables() -> Kernel:
    """Returns tables of three bodies, numbered backwards, of radii 1, 1/4 and 1/2; the second moves."""
    k = allocate(3, 2, 4)._replace(log=record_table(ROW, 4))
    k.queue.number, k.slots[:] = [2, 1, 0], [2, 1, 0]
    k.bodies.radius, k.bodies.vx, k.bodies.vy = [1.0, 0.25, 0.5], [0.0, 0.75, 0.0], [0.0, 1.0, 0.0]
    k.clock[0].per_time, k.clock[0].jam.window_size = 2.0**52, 5
    return k


def test_a_log_is_full_where_there_is_no_room_for_so_many_rows_of_either_kind():
    k = tables()
    lists = k.clock[0].lists
    for of_both in (False, True):
        lists.rows = 4 * of_both
        for logged, written, rows in np.ndindex(5, 5, 6):
            lists.logged, lists.written = logged, written
            assert log_is_full(k, rows) == (4 - logged < rows or (of_both and 4 - written < rows))


def test_a_command_waits_for_room_for_all_rows_of_passings_that_it_begins_or_ends():
    k = tables()._replace(commands=record_table(COMMAND, 1), traits=record_table(TRAIT, 3))
    k = k._replace(passings=record_table(PASSING, 9))
    waiting = compose(must_wait, {**NONE, "PASSINGS": True}, "waiting", Kernel)
    command, lists = k.commands[0], k.clock[0].lists
    command.body, k.traits[1].inside = 1, 2
    for code, rows in ((REMOVED, 3), (INSERTED, 4), (TURNED, 1)):
        command.code = code
        for logged in range(5):
            lists.logged = logged
            assert waiting(k, command) == (LOG_FULL if 4 - logged < rows else NO_REASON)


def test_a_pair_is_watched_in_either_order_of_its_row_and_a_body_at_every_contact():
    k = tables()._replace(watch=np.zeros(3, np.uint8), watched=record_table(OFFER, 1))
    k = k._replace(watched_kinds=np.zeros(2, np.uint8))
    pairs = [(a, b) for a in range(3) for b in (-1, 0, 1, 2) if a != b]  # slots, whose numbers descend
    ends = {(a, b) for a, b in pairs if a < b}  # the younger first
    for flag, left_out in ((0, ends), (ENDS, set())):
        for row in ((0, 1), (1, 0)):
            k.watch[:], (k.watched[0].a, k.watched[0].b) = (SOME | flag, SOME | flag, 0), row
            found = {(2, 1), (1, 2)} - left_out
            assert {pair for pair in pairs if is_watched(k, *pair)} == found
        k.watch[2] = ANY_BEGIN | flag
        found |= {pair for pair in pairs if 0 in pair} - left_out
        assert {pair for pair in pairs if is_watched(k, *pair)} == found


def test_rows_have_numbers_and_plans_of_both_bodies():
    k = tables()
    k.clock[0].lists.rows, k.clock[0].epoch = 4, 3
    log(k, (1 << 52) + 5, 2, 1)
    log(k, 7, 1, -5)  # a turn is no contact
    log_passing(k, 8, 2, 1)
    assert k.met[: k.clock[0].lists.logged].tolist() == [(4, 5, 0, 1), (3, 8, 0, 1)]
    names = ("tick", "a", "b", "avx", "avy", "bvx", "bvy")
    first, turn, passing = ([getattr(k.log[at], name) for name in names] for at in range(3))
    assert first == [(1 << 52) + 5, 0, 1, 0.0, 0.0, 0.75, 1.0]
    assert turn[:5] == [7, 1, -5, 0.75, 1.0]
    assert passing[:3] == [8, 0, 1]
    assert np.isnan(
        [each for name, each in zip(ROW.names, k.log[2].tolist(), strict=True) if len(name) > 1][1:]
    ).all()
    stop_there(k, 9, 0, 2)
    assert [getattr(k.clock[0].stops, name) for name in ("due", "tick", "a", "b")] == [1, 9, 2, 0]
    stop_there(k, 9, 1, -3)
    assert (k.clock[0].stops.a, k.clock[0].stops.b) == (1, -3)


def test_contacts_of_a_tick_are_counted_from_one():
    k, found = tables(), []
    for tick in (3, 3, 3, 4, 9, 9):
        count_row(k, tick, 0, 1)
        found.append(k.clock[0].met_there)
    assert found == [1, 2, 3, 1, 1, 2]


LEAST = int(5 * 1e-13 * 0.25 / 1.25 * 2.0**52)
"""Ticks of five flights of 1e-13 of the smallest radius each, at the greatest speed."""


@pytest.mark.parametrize(("ticks", "jams"), [(LEAST, True), (LEAST + 1, False)])
def test_a_window_of_contacts_in_too_few_ticks_is_a_jam(ticks, jams):
    k = tables()
    clock = k.clock[0]
    clock.jam.spins = 9
    for window in (1, 2):
        for _ in range(5):
            assert clock.fault.code == 0
            count_row(k, window * (LEAST + 1) if window == 1 else LEAST + 1 + ticks, 2, 1)
    assert clock.fault.code == (JAMMED if jams else 0)
    assert (clock.jam.spins, clock.jam.window, clock.jam.window_tick) == (0, 0, LEAST + 1 + ticks)


def test_bodies_at_rest_are_jammed_only_within_a_tick():
    k = tables()
    k.bodies.vx = k.bodies.vy = 0.0
    k.clock[0].jam.window_tick = 0
    for tick in range(5):
        count_row(k, tick, 0, 1)
    assert k.clock[0].fault.code == 0


@pytest.mark.parametrize(("depth", "code"), [(0.5, 0), (0.51, TOO_DEEP), (math.nan, NOT_FINITE)])
def test_an_overlap_beyond_the_tolerance_is_a_fault_and_the_deepest_is_kept(depth, code):
    k = tables()
    k.clock[0].limits.tolerance = 0.5
    count_contact(k, 1, 0, 1, 0.4, 2.0, 0.0)
    assert k.counts[0].deepest == 0.2
    count_contact(k, 1, 0, 1, 0.1, 2.0, 0.0)
    assert k.counts[0].deepest == 0.2
    assert k.clock[0].fault.code == 0
    count_contact(k, 1, 0, 1, depth, 2.0, 0.0)
    assert k.clock[0].fault.code == code
