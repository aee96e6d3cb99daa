"""Pairs: reports of bodies that have become near, and a set of pairs for broad phases that store them.

The kernel calls ``near`` when it needs the bodies near a body. A pair that becomes near between two such
calls is *offered*, and its contact is predicted for one of the two. A parting pair need not be reported.

Sweep-and-prune only has its pairs by their history. For such phases there is the *pair set*: ``add_pair``,
``remove_pair``, and ``pairs_of``, which answers ``near`` with a body's list. A pair is found by its bodies
through an open-addressing table (linear probing, deletion by shifting back, no tombstones), and by each body
through a list threaded through the pairs' records (``tables.HELD_PAIR``), whose head is ``firsts[body]``, or
-1. Both together cost O(1) a change, and memory grows with the existing pairs, not with the possible ones. A
pair is held once for every ``add_pair`` and is removed by the last ``remove_pair``, so a broad phase that
finds a pair for several reasons need not count them itself."""

from typing import Any

from kinetile.kernel.certificates.structural import to_be_settled
from kinetile.kernel.compiled import hook, larger
from kinetile.kernel.tables import BAD_PAIR, NOBODY, UNKNOWN_PAIR, Kernel, Records, blame


@hook
def link(table: Records, firsts: Any, new: int) -> None:
    """Inserts a pair at the head of the lists of its bodies."""
    record = table[new]
    record.prev_a = -1
    record.prev_b = -1
    record.next_a = _push_front(table, firsts, record.a, new)
    record.next_b = _push_front(table, firsts, record.b, new)


@hook
def _push_front(table: Records, firsts: Any, body: int, new: int) -> int:
    """Inserts a pair at the head of a body's list; returns the former head."""
    head = firsts[body]
    firsts[body] = new
    if head >= 0:
        if table[head].a == body:
            table[head].prev_a = new
        else:
            table[head].prev_b = new
    return int(head)


@hook
def unlink(table: Records, firsts: Any, old: int) -> None:
    """Removes a pair from the lists of its bodies."""
    record = table[old]
    _take_out(table, firsts, record.a, record.prev_a, record.next_a)
    _take_out(table, firsts, record.b, record.prev_b, record.next_b)


@hook
def _take_out(table: Records, firsts: Any, body: int, before: int, after: int) -> None:
    """Removes a pair from a body's list, given its neighbours there."""
    if before < 0:
        firsts[body] = after
    elif table[before].a == body:
        table[before].next_a = after
    else:
        table[before].next_b = after
    if after >= 0:
        if table[after].a == body:
            table[after].prev_a = before
        else:
            table[after].prev_b = before


@hook
def follower(table: Records, body: int, pair: int) -> int:
    """Returns the pair after a pair in a body's list, or -1."""
    record = table[pair]
    return int(record.next_a if record.a == body else record.next_b)


@hook
def offer(k: Kernel, a: int, b: int) -> None:
    """Offers a pair that has become near: after the hook, the kernel predicts its contact for a. O(1)."""
    if a < 0 or a >= k.clock[0].bodies or b < 0 or b >= k.clock[0].bodies or a == b:
        blame(k, BAD_PAIR, a, b)
        return
    to_be_settled(k, a, b)


@hook
def pairs_of(k: Kernel, body: int) -> int:
    """Writes the bodies that are in a pair with a body to ``k.near``; returns their number."""
    table = k.pairs
    if len(k.firsts) == 0:
        return 0
    count = 0
    pair = k.firsts[body]
    while pair >= 0:
        k.near[count] = table[pair].a + table[pair].b - body
        pair = follower(table, body, pair)
        count += 1
    return count


@hook
def _home(k: Kernel, a: int, b: int) -> int:
    """Returns the first slot of the probe for a pair."""
    mixed = (int(a) * 73856093) ^ (int(b) * 19349663)
    return (mixed ^ (mixed >> 15)) & (len(k.lookup) - 1)


@hook
def _find(k: Kernel, a: int, b: int) -> int:
    """Returns the slot of the lookup that holds a pair a < b, or the empty slot for it."""
    table = k.pairs
    lookup = k.lookup
    mask = len(lookup) - 1
    slot = _home(k, a, b)
    while lookup[slot] >= 0 and (table[lookup[slot]].a != a or table[lookup[slot]].b != b):
        slot = (slot + 1) & mask
    return slot


@hook
def add_pair(k: Kernel, a: int, b: int) -> None:
    """Inserts {a, b} into the pair set and offers it, or holds it once more. O(1) expected."""
    clock = k.clock[0]
    lists = clock.lists
    if b < a:
        a, b = b, a
    if a < 0 or b >= clock.bodies or a == b:
        blame(k, BAD_PAIR, a, b)
        return
    if len(k.lookup) == 0:
        lists.wanted += 1
        return
    table = k.pairs
    slot = _find(k, a, b)
    if k.lookup[slot] >= 0:
        table[k.lookup[slot]].holds += 1
        return
    if lists.free_pair < 0:
        lists.wanted += 1
        return
    new = lists.free_pair
    record = table[new]
    lists.free_pair = record.next_a
    k.lookup[slot] = new
    record.a = a
    record.b = b
    record.holds = 1
    link(table, k.firsts, new)
    lists.pairs += 1
    counts = k.counts[0]
    counts.pairs_max = larger(counts.pairs_max, lists.pairs)
    to_be_settled(k, a, b)


@hook
def remove_pair(k: Kernel, a: int, b: int) -> None:
    """Removes one hold on {a, b}; the last one removes the pair from the pair set. O(1) expected."""
    lists = k.clock[0].lists
    if b < a:
        a, b = b, a
    if len(k.lookup) == 0:
        if lists.wanted == 0:
            blame(k, UNKNOWN_PAIR, a, b)
        return
    table = k.pairs
    lookup = k.lookup
    hole = _find(k, a, b)
    old = lookup[hole]
    if old < 0:
        if lists.wanted == 0:
            blame(k, UNKNOWN_PAIR, a, b)
        return
    record = table[old]
    record.holds -= 1
    if record.holds > 0:
        return
    unlink(table, k.firsts, old)
    record.a = NOBODY
    record.next_a = lists.free_pair
    lists.free_pair = old
    lists.pairs -= 1
    mask = len(lookup) - 1
    probe = (hole + 1) & mask
    while lookup[probe] >= 0:  # entries that probed over the hole move back into it
        home = _home(k, table[lookup[probe]].a, table[lookup[probe]].b)
        if ((probe - home) & mask) >= ((probe - hole) & mask):
            lookup[hole] = lookup[probe]
            hole = probe
        probe = (probe + 1) & mask
    lookup[hole] = -1


def held_pairs(k: Kernel) -> list[tuple[int, int]]:
    """Returns the pairs of the pair set, by slots, (a, b) with a < b, sorted; not for hooks."""
    held = k.pairs[k.pairs.a >= 0]
    return sorted(zip(held.a.tolist(), held.b.tolist(), strict=True))
