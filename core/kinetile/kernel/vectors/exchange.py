"""What two bodies exchange at a contact: momentum along a normal, to half an ulp."""

from __future__ import annotations

import math

from kinetile.kernel.compiled import hook
from kinetile.kernel.tables import Records
from kinetile.kernel.vectors import product_error

__all__ = ["closing_speed", "shared"]


@hook
def closing_speed(one: Records, two: Records, nx: float, ny: float) -> float:
    """Return (v . n) / (n . n) for the relative velocity v and a vector n of length nearly 1, to half an ulp.

    Both products are carried in full. The plain formula is off by an ulp or so, and where all radii are equal
    by nearly the same one at every contact, so that energy would drift in proportion to the contacts.
    """
    vx = two.vx - one.vx
    vy = two.vy - one.vy
    xx = nx * nx
    yy = ny * ny
    excess = ((xx - 0.5) + (yy - 0.5)) + (product_error(nx, nx, xx) + product_error(ny, ny, yy))
    px = vx * nx
    py = vy * ny
    total = px + py
    part = total - px
    low = (px - (total - part)) + (py - part) + (product_error(vx, nx, px) + product_error(vy, ny, py))
    return float(total + (low - total * excess))


@hook
def shared(mass: float, other: float, speed: float) -> float:
    """Return the part of an exchange that a body takes: 2 other / (mass + other) speed, to about half an ulp.

    The quotient is the same at every contact of two bodies, and so would be its rounding: energy would drift
    in proportion to the contacts. Of a body of infinite mass the part is 0, and the other one takes 2; two of
    them part as two equals do.
    """
    if mass == math.inf:
        return speed if other == math.inf else 0.0
    if other == math.inf:
        return 2.0 * speed
    both = mass + other
    part = both - mass
    low = (mass - (both - part)) + (other - part)
    share = 2.0 * other / both
    back = share * both
    rest = ((2.0 * other - back) - product_error(share, both, back) - share * low) / both
    taken = share * speed
    return taken + (product_error(share, speed, taken) + rest * speed)
