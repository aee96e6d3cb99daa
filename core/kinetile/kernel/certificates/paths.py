"""Two straight paths, one seen from the other: what the filters compute, and how far it can be off.

Along each axis the separation at the later anchor is ``d + low`` and the relative velocity ``u + w``, each
a rounded number and what rounding took from it. ``w`` is exact, ``low`` nearly. ``size`` is the sum of the
magnitudes that ``d`` is made of. The bounds of the errors, and why they are enough, are in
docs/exact-ticks.md.
"""

from __future__ import annotations

from kinetile.kernel.certificates.sums import TINY, ULP, plus
from kinetile.kernel.compiled import hook
from kinetile.kernel.vectors import product_error

__all__ = ["along", "gap_at", "newton", "seen_from"]


@hook
def seen_from(
    x: float, vx: float, x2: float, vx2: float, time: float, rest: float
) -> tuple[float, float, float, float, float]:
    """Return (d, low, size, u, w) along an axis: of a second body seen from a first, which has flown for
    ``time + rest`` since it was at ``x``."""
    flown = vx * time
    far, far_low = plus(x2, -x)
    d, d_low = plus(far, -flown)
    low = (far_low + d_low) - (product_error(vx, time, flown) + vx * rest)
    u, w = plus(vx2, -vx)
    return d, low, abs(x) + abs(x2) + abs(flown), u, w


@hook
def along(dx: float, x_size: float, ux: float, dy: float, y_size: float, uy: float) -> tuple[float, float]:
    """Return d.u at the later anchor, and how far it can be off."""
    return dx * ux + dy * uy, 2.0**-50 * (x_size * abs(ux) + y_size * abs(uy)) + TINY


@hook
def gap_at(
    t: float,
    dx: float,
    x_low: float,
    x_size: float,
    ux: float,
    wx: float,
    dy: float,
    y_low: float,
    y_size: float,
    uy: float,
    wy: float,
    reach: float,
    reach_low: float,
) -> tuple[float, float, float, float]:
    """Return q, the squared distance less the squared reach, at a time t after the later anchor; how far it
    can be off; minus half its rate, (d.v); and how far that can be off."""
    px = ux * t
    py = uy * t
    x, x_rest = plus(dx, px)
    y, y_rest = plus(dy, py)
    x_rest += product_error(ux, t, px) + (x_low + wx * t)
    y_rest += product_error(uy, t, py) + (y_low + wy * t)
    xx = x * x
    yy = y * y
    rr = reach * reach
    both, both_low = plus(xx, yy)
    gap, gap_low = plus(both, -rr)
    squares = (product_error(x, x, xx) + product_error(y, y, yy)) - product_error(reach, reach, rr)
    mixed = (x_rest * (x + x + x_rest) + y_rest * (y + y + y_rest)) - reach_low * (reach + reach + reach_low)
    q = gap + (((both_low + gap_low) + squares) + mixed)
    x_far = x_size + abs(x)
    y_far = y_size + abs(y)
    spread = x_far * (abs(x) + 2.0**-50 * x_far) + y_far * (abs(y) + 2.0**-50 * y_far)
    q_error = 2.0**-98 * (spread + rr) + ULP * abs(q)
    slope_error = 2.0**-49 * (x_far * abs(ux) + y_far * abs(uy)) + TINY
    return q, q_error, -(x * ux + y * uy), slope_error


@hook
def newton(
    q: float, q_error: float, slope: float, slope_error: float, speed2: float, per_time: float
) -> tuple[float, float, float]:
    """Return one Newton step from what ``gap_at`` says, in ticks; how far it can end from the root; and how
    much the path bends: the bound holds where that is below 1/8, and slope > 8 slope_error."""
    inverse = 1.0 / slope
    step = 0.5 * q * inverse
    bent = speed2 * (abs(q) + q_error) * (inverse * inverse)
    loose = bent + 2.0 * slope_error * inverse + 2.0**-49
    return step * per_time, (q_error * inverse + abs(step) * loose) * per_time + 2.0**-50, bent
