"""Lower bounds of contact times in doubles, so that few pairs need exact arithmetic.

``ContactBounds`` has a row for each body's plan. Take a tick before which no contact can come any more, and
which is not before any anchor. For one body and every other body, it returns a tick before which the two do
not meet. It decides nothing: a bound at the head of the queue is replaced by the exact tick.

The bound. Let u = 2^-53; X the largest of all coordinates of plans and of places at that tick; R the sum of
two radii, r the largest radius; d and v the separation and relative velocity of two bodies at the tick, in
exact arithmetic; t the time from there to their contact, when the distance is at most R. Until then they fly
|v| t <= |d| + R <= L with L = 4 X + 2 r, since |d| <= 2 sqrt(2) X.

1. *Places.* A place is x + v s. The time s is a difference of integers, rounded; with the product and the sum
   there are three roundings, of numbers below 2 X, and X for the sum: at most 5.1 u X. A coordinate of d is
   the difference of two places: its error is less than 13 u X, so the error of d is less than 19 u X. The
   relative velocity has an error of u |v|, which until t grows to u L. So along the line of the doubles the
   distance at t is at most R + e with e = 19 u X + u L.
2. *The line.* For the doubles d and v, exactly: p = -d.v / |v| is the way to the closest point, and
   h = |d x v| / |v| its distance. The distance falls to rho after a way of s(rho) = p - sqrt(rho^2 - h^2),
   and never if h > rho. Since ds/drho <= -1, s(rho + f) <= s(rho) - f for f >= 0.
3. *Roundings.* h and p are computed with errors of at most 6 u |d|: two products and a sum, none above
   |d| |v|, two roundings' worth for |v|, one for the quotient. An error f of h is covered by f more in rho,
   because (rho + f)^2 - (h + f)^2 >= rho^2 - h^2 for h <= rho. The root of (rho - h)(rho + h) has an error of
   3 u rho, rho itself of 2 u rho, the difference p - root of u L. With e, the sum is less than
   70 u X + 20 u r. So with

       rho = R + fat,  fat = 2^-45 (X + r) = 256 u (X + r)

   the computed way is at most the exact one to the contact, and if the computed h is above rho there is no
   contact. If the way is not positive, the contact may be now. If p < -fat, d.v > 0 exactly: they part.
4. *The tick.* The way divided by |v| and by a tick has six roundings: the factor 1 - 2^-48 is less than their
   loss. Rounded down and added to the present tick, an integer, the result is a bound of the contact's tick.

*Periods.* The separation is to the nearest image, dx - N P with N the nearest whole number to dx / P. The
product and the difference are two more roundings, of numbers below 2.5 X if X is P at least: 8 u X in the
terms of 1 to 3, twice, and 256 still covers that. Any other image is, along an axis of period P, at least
P/2 - 6 u X away: so it does not come before (P/2 - rho) / |vx|, or the same for y, as in 4.

*Accelerations.* Let w be the relative acceleration, and n the direction of d. The distance at t is at least
n.(d + v t + w t^2/2). So it does not fall to rho before the gap g = |d| - rho is flown with the speed
c = -n.v and the acceleration h = -n.w: this is after 2 g / (c + sqrt(c^2 + 2 h g)), or never. A product with
n has an error of less than 8 u times the sum of the sizes of the vector's terms: velocities and their gains.
c and h are enlarged by 2^-45 of these sums, and the root's argument by 2^-45 of itself, so each of the three
can only make the bound earlier. The terms of places are in X as well.

*Shapes.* The radii are the radii of the circles around them. Two shapes whose circles overlap, fat included,
may touch now; others do not touch before their circles do.

Underflow: |v|^2 below 2^-900 decides nothing, unless v is 0, and v = 0 is exact: then the two never meet.
Above that, the underflow of a product is below 2^-1074, and divided by |v| below 2^-624, while fat is at
least 2^-245 (radii are at least 2^-200). An overflow becomes infinite or not a number, which is a bound of
now; an infinite X makes fat infinite, and everything is computed exactly.
"""

import numpy as np

from kinetile.arrays import Floats
from kinetile_accuracy.specification.arithmetic import FlightPlan

_FAT = 2.0**-45
_LESS = 1.0 - 2.0**-48
_SLOWEST = 2.0**-900


class ContactBounds:
    """Rows of all present bodies' plans: place, velocity, anchor, counted from ``origin`` so that 64 bits
    hold it. The origin is moved on in time (``rebase``); all anchors are within 2^62 ticks of the present."""

    def __init__(
        self,
        radius: Floats,
        fine: int,
        periods: tuple[float, float] = (0.0, 0.0),
        shapes: bool = False,
        accelerated: bool = False,
    ) -> None:
        count = len(radius)
        self.origin = 0
        self._radius = radius
        self._largest = float(radius.max(initial=0.0))
        self._plans = np.zeros((6, count))
        self._anchor = np.zeros(count, np.int64)
        self._absent = np.ones(count, np.bool_)
        self._periods = periods
        self._shapes = shapes
        self._accelerated = accelerated
        self._extent = max(periods)
        self._tick = 2.0**-fine
        self._ticks = 2.0**fine

    def put(self, body: int, plan: FlightPlan) -> None:
        """Writes a body's row."""
        self._plans[:, body] = plan.x, plan.y, plan.vx, plan.vy, *plan.pull
        self._anchor[body] = plan.anchor - self.origin
        self._absent[body] = False
        self._extent = max(self._extent, abs(plan.x), abs(plan.y))

    def remove(self, body: int) -> None:
        """Removes a body."""
        self._absent[body] = True

    def rebase(self, origin: int) -> None:
        """Counts anchors from another tick."""
        self._anchor -= origin - self.origin
        self.origin = origin

    def waits(self, bodies: list[int], now: int) -> Floats:
        """Returns (len(bodies), n): ticks from ``now`` on without a contact of two bodies; infinite if
        they never do on these plans, and for the body itself."""
        with np.errstate(all="ignore"):
            place, flies, pull = self._plans.reshape(3, 2, -1)
            elapsed = (now - self.origin - self._anchor) * self._tick
            place = place + flies * elapsed
            extent = max(self._extent, float(np.abs(place).max()))
            sizes = np.abs(flies).sum(axis=0)
            if self._accelerated:
                bend = 0.5 * pull * elapsed * elapsed
                place = place + bend
                extent = max(extent, float(np.abs(place).max()), float(np.abs(bend).max()))
                flies = flies + pull * elapsed
                sizes = sizes + np.abs(pull).sum(axis=0) * np.abs(elapsed)
            fat = _FAT * (extent + self._largest)
            which = np.array(bodies)[:, None]
            d, v = (each[:, None] - each[:, which] for each in (place, flies))
            for axis, period in zip(d, self._periods, strict=True):
                if period:
                    axis -= np.rint(axis / period) * period
            reach = self._radius + (self._radius[which] + fat)
            if self._accelerated:
                w, error = pull[:, None] - pull[:, which], sizes + sizes[which]
                wait = self._wait_accelerated(d, v, w, reach, error)
            else:
                wait = self._wait_unaccelerated(d, v, reach, fat, len(bodies))
            return self._others(wait, bodies, v, reach)

    def _wait_accelerated(self, d: Floats, v: Floats, w: Floats, reach: Floats, error: Floats) -> Floats:
        """Returns the waits on accelerated plans: until the height along d comes down to the reach."""
        apart = np.sqrt((d * d).sum(axis=0))
        gap = apart * (1.0 - 2.0**-50) - reach
        closing = -(d * v).sum(axis=0) / apart + 2.0**-45 * error
        bend = -(d * w).sum(axis=0) / apart + 2.0**-45 * np.abs(w).sum(axis=0)
        under = closing * closing + 2.0 * bend * gap
        under += 2.0**-45 * (closing * closing + 2.0 * np.abs(bend) * gap)
        ahead = closing + np.sqrt(under)
        soonest: Floats = np.fmax(2.0 * gap / ahead * (self._ticks * _LESS), 0.0)
        soonest[(under < 0.0) | (ahead <= 0.0)] = np.inf
        soonest[~(gap > 0.0)] = 0.0
        return soonest

    def _wait_unaccelerated(self, d: Floats, v: Floats, reach: Floats, fat: float, many: int) -> Floats:
        """Returns the waits on plans without accelerations, of ``many`` bodies."""
        speed2 = (v * v).sum(axis=0)
        speed = np.sqrt(speed2)
        ahead = -(d * v).sum(axis=0) / speed
        miss = np.abs(d[0] * v[1] - d[1] * v[0]) / speed
        way = ahead - np.sqrt((reach - miss) * (reach + miss))
        # NaN (overflow, a root of less than 0) becomes a bound of now: fmax drops it.
        wait: Floats = np.fmax(way / speed * (self._ticks * _LESS), 0.0)
        passes = (miss > reach) | (ahead < -fat)
        if self._shapes:  # within their circles two may touch, whatever the circles do
            inside = (d * d).sum(axis=0) <= reach * reach
            passes &= ~inside
            wait[inside] = 0.0
        wait[passes] = np.inf
        odd = ~(speed2 >= _SLOWEST)
        if np.count_nonzero(odd) > many:  # each body itself is one of them
            wait[odd] = np.where((v == 0.0).all(axis=0), np.inf, 0.0)[odd]
        return wait

    def _others(self, wait: Floats, bodies: list[int], v: Floats, reach: Floats) -> Floats:
        """Returns the waits for nearest images, less if another may come before; only for present bodies."""
        for speed, period in zip(v, self._periods, strict=True):
            if period:  # another image: half a period less the reach has to be flown
                free = np.maximum(0.5 * period - reach, 0.0) / np.abs(speed) * (self._ticks * _LESS)
                wait = np.minimum(wait, np.where(np.isnan(free), 0.0, free))
        wait[np.arange(len(bodies)), bodies] = np.inf
        wait[:, self._absent] = np.inf
        return wait
