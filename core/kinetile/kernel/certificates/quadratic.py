"""The tick of the fall below zero of a quantity quadratic in time: structural certificates of degree 2.

The quantity is G(n) = gap + rate t + bend t^2 / 2, t being n ticks. Its certificate fails at the first tick
from ``start`` on at whose end G is below zero, the first n with G(n + 1) < 0. So it holds where G only comes
to zero, or is below it for less than a tick.

If G(start + 1) < 0 the tick is ``start``. Else G(n) >= 0 > G(n + 1) at the tick n sought, so rule 6 holds
there (``walls``); and wherever rule 6 holds, G(n + 1) < 0. So the tick is the first from ``start`` on at
which rule 6 holds. ``reaches_edge`` has w, the first from 0 on. If w > start, the tick is w. If w <= start, G
was below zero and no longer is: then it is convex and rises, and stays above.

A value in doubles is off by 2^-100 of its size where it fits (``has_room``); else whole numbers decide.
"""

from kinetile.kernel.certificates.discs_exactly import gap_sign_exactly
from kinetile.kernel.certificates.separation import Motion, place_at, time_of
from kinetile.kernel.certificates.walls import has_room, reaches_edge
from kinetile.kernel.compiled import apart, hook
from kinetile.kernel.tables import NEVER, Kernel


@apart
def first_below(gap: float, rate: float, bend: float, start: int, per_tick: float, per_time: float) -> int:
    """Returns the first count of ticks, from ``start`` (0 to 2^62 - 1) on, at whose end G is below zero;
    ``NEVER`` if that is not before 2^62, or a number is not finite."""
    below = known = False
    if has_room(abs(gap), rate, bend, per_tick):
        t, rest = time_of(start + 1, per_tick)
        value, _, size = place_at(Motion(gap, 0.0, rate, 0.0, bend, 0.0, abs(gap), abs(rate)), t, rest)
        below = value < 0.0
        known = abs(value) > 2.0**-100 * size
    if not known:
        below = gap_sign_exactly(gap, rate, bend, per_tick, start + 1) < 0
    if below:
        return start
    found = reaches_edge(gap, 0.0, 0.0, rate, bend, per_tick, per_time)
    return found if found > start else NEVER


@hook
def falls_bent(k: Kernel, since: int, gap: float, rate: float, bend: float) -> int:
    """Returns the first tick from now on at whose end a quadratic quantity is below zero, or ``NEVER``.

    At tick ``since``, not after now, it is ``gap``, its rate is ``rate`` per unit of time, and the rate's own
    rate is ``bend``: at time t later it is gap + rate t + bend t^2 / 2. The tick is exact for these doubles;
    the caller must bound their errors. With the opposite signs of all three it is another tick: an exchange
    at an event is not reversed at that tick. From 2^62 ticks after ``since`` on there is no prediction.
    """
    clock = k.clock[0]
    found = first_below(gap, rate, bend, clock.now - since, clock.per_tick, clock.per_time)
    return since + int(found) if found < NEVER else NEVER
