"""Predictions: what a queue entry claims about a body's contacts, and how it is computed.

An entry of body h makes these claims on all bodies near it when it was refreshed, and all newcomers since::

    its contact with ``partner`` is not before ``tick``, if the partner still has the plan of stamp ``seen``;
    every other contact is not before ``guard``; tick <= guard

The first values are cheap lower bounds, which ``soonest`` of the narrow phase returns as delays. A contact is
computed exactly only at the head of the queue; without ``soonest`` all contacts are computed exactly at once.

Coverage
========

An entry of h **covers** a near pair {h, j} if it is true for this pair: the contact of h and j is not before
``tick``; if j is not the partner, it is not before ``guard``; and if j is the partner, ``exact`` is set and
``seen`` is j's stamp, it is exactly at ``tick``.

    Between two events every near pair that is not barred is covered by one of its bodies.

Five rules maintain this invariant:

1. *A body whose plan has changed raises its stamp and is predicted again.* It covers all its pairs. The
   entries of other bodies do not change; they may now be wrong for this body, and that is allowed.
2. *A newcomer is predicted by one of the two*: the body under repair, or the first of an ``offer``. If the
   newcomer's contact may be the first, the old first becomes the guard; else the guard is lowered to it. The
   entry still covers the pairs that it covered.
3. *An entry at the head whose partner has another plan is predicted again.* Until then the partner covered
   the pair, by rule 1.
4. *If a guess turns out to be at or after ``guard``, all contacts of the body are computed exactly.*
5. *A pair is barred while each body stores the other as its last contact*, and that ends only when one of
   them gets another plan: rule 1.

So a broad phase must name every body that becomes near (``repair``, ``offer``), but none that parts.
"""

from typing import Any

from kinetile.kernel.compiled import hook, larger, smaller, template, to_be_filled_in
from kinetile.kernel.features import ACCELERATIONS, BOUNDS, PASSINGS, PERIODIC, RESTING, UNEQUAL
from kinetile.kernel.images import await_through
from kinetile.kernel.loop.responses import have_passed, leaves_out
from kinetile.kernel.passings import passes
from kinetile.kernel.rest import is_held_by
from kinetile.kernel.tables import NEVER, NOBODY, Kernel, elder

LEFT_OUT = 2.0**62 + 2.0**20
"""Ticks. A contact further away is left out: both bodies are anchored again before it."""

MARGIN = 1 << 12
"""Ticks subtracted from a bound, for the rounding of a delay of up to 2^62 ticks."""

near = meet = soonest = to_be_filled_in


@hook
def barred_with(k: Kernel, h: int) -> int:
    """Returns the body that h has just met, if neither has met another since, or NOBODY."""
    partner = k.bodies[h].last
    return int(partner) if partner >= 0 and k.bodies[partner].last == h else NOBODY


@template
def left_out(k: Kernel, h: int) -> int:
    """Returns the body whose contact with h is not computed: the barred one, or NOBODY. On periodic axes an
    image is barred and not a body, and two bodies with different accelerations may meet again: there ``meet``
    itself leaves out the barred contacts."""
    return NOBODY if PERIODIC or UNEQUAL else barred_with(k, h)


@template
def not_before(at: int, ticks: float) -> int:
    """Returns a lower bound of the tick of a contact, ``ticks`` after tick ``at``; NEVER if it is too far."""
    near_enough = ticks < LEFT_OUT
    tick = at + larger(int(ticks if near_enough else LEFT_OUT) - MARGIN, 0)
    return tick if near_enough else NEVER


@template
def look_at(k: Kernel, h: int, count: int, at: int) -> None:
    """Updates an entry with the bodies in ``k.near[:count]``, at a tick that no contact is before."""
    entry = k.queue[h]
    if PASSINGS and not PERIODIC:
        count = leaves_out(k, h, count)
    barred = left_out(k, h)
    k.counts[0].asked += count
    if BOUNDS:
        first, second, who = soonest(k, h, count, barred, at)
        per_time = k.clock[0].per_time
        tick = not_before(at, first * per_time)
        rest = not_before(at, second * per_time)
        exact = 0
    else:
        known = h
        if entry.partner >= 0 and entry.seen == k.stamps[entry.partner]:
            known = entry.partner
        m = k.images[h].m if PERIODIC else 0
        n = k.images[h].n if PERIODIC else 0
        tick, rest, who = soonest_exactly(k, h, count, barred, known)
        exact = 1
        if PERIODIC and tick >= entry.tick:
            k.images[h].m = m
            k.images[h].n = n
    if tick < entry.tick:
        entry.guard = smaller(smaller(entry.guard, entry.tick), rest)
        entry.tick = tick
        entry.partner = who
        entry.seen = k.stamps[who]
        entry.exact = exact
    else:
        entry.guard = smaller(entry.guard, tick)
        if tick == entry.tick:
            entry.exact = 0


@template
def meeting(k: Kernel, a: int, b: int) -> int:
    """Returns the tick of the first contact of two bodies, or ``NEVER``; ``a`` is the elder. If the two pass
    through each other, a contact in the past does not count: that passing has begun already. If one holds the
    other, they have no contact."""
    if RESTING and (is_held_by(k, a, b) or is_held_by(k, b, a)):
        return NEVER
    if PASSINGS and not (PERIODIC or ACCELERATIONS) and passes(k, a, b):
        if have_passed(k, a, b):
            return NEVER
        tick = meet(k, a, b)
        return NEVER if tick < k.clock[0].now else int(tick)
    return int(meet(k, a, b))


@template
def soonest_exactly(k: Kernel, h: int, count: int, barred: int, known: int) -> tuple[int, int, int]:
    """Returns the ticks of the first two exact contacts with ``k.near[:count]``, and the first's partner.

    ``barred`` and ``known`` are left out. At equal ticks the pair with the smaller numbers is first.
    """
    first = NEVER
    second = NEVER
    who = NOBODY
    for i in range(count):
        other = k.near[i]
        if other != h and other != barred and other != known and other != who:
            k.counts[0].exact += 1
            older = elder(k, h, other)
            tick = meeting(k, older, h + other - older)
            sooner = tick < first
            if tick == first and tick != NEVER:
                sooner = elder(k, other, who) == other  # of two pairs with h, the elder's comes first
            if sooner:
                await_through(k, h)
                second = first
                first = tick
                who = other
            else:
                second = smaller(second, tick)
    return first, second, int(who)


@template
def ask_all_exactly(k: Kernel, s: Any, h: int, known: int, tick: int, at: int) -> None:
    """Computes all contacts of a body exactly, because bounds did not decide which is first. The contact with
    ``known`` is at ``tick``. With different accelerations this may have been an immediate guess for two
    bodies that have just met: then a second look at the bounds of the others mostly decides."""
    count = near(k, s, h)
    if PASSINGS and not PERIODIC:
        count = leaves_out(k, h, count)
    entry = k.queue[h]
    told = False
    if UNEQUAL and BOUNDS:
        first, second, who = tick, NEVER, known
        per_time = k.clock[0].per_time
        soon, rest, other = soonest(k, h, count, known, at)
        if other != NOBODY and not_before(at, soon * per_time) < tick:
            k.counts[0].exact += 1
            older = elder(k, h, other)
            second = meeting(k, older, h + other - older)
            if second < tick:
                first, second, who = second, tick, other
                await_through(k, h)
            soon = rest
        second = smaller(second, not_before(at, soon * per_time))
        told = first < second or second == NEVER
    if not told:
        first, second, who = soonest_exactly(k, h, count, left_out(k, h), h)
    entry.tick = first
    entry.guard = second
    entry.partner = who
    entry.exact = 1
    if who >= 0:
        entry.seen = k.stamps[who]
