"""What is carried on rounded: rules 4 and 9 of docs/specification.md, in doubles and in the order of the
rules.

Python's float is a double, each of its operations rounds once, to nearest and ties to even, and nothing is
contracted; ``float(n)`` of an integer and the quotient of two integers are rounded correctly as well.
"""

from __future__ import annotations

import math

__all__ = ["Vector", "anchored", "exchanged", "product_error"]

Vector = tuple[float, float]


def anchored(place: float, speed: float, ticks: int, tick: float) -> float:
    """Return one coordinate, so many ticks of a length later (rule 4)."""
    elapsed = float(ticks) * tick
    return place + speed * elapsed


def product_error(a: float, b: float) -> float:
    """Return E(a, b) of rule 1: how much the product of two doubles loses by rounding, rounded."""
    (n, d), (m, e), (p, f) = a.as_integer_ratio(), b.as_integer_ratio(), (a * b).as_integer_ratio()
    return (n * m * f - p * d * e) / (d * e * f)


def exchanged(
    places: tuple[Vector, Vector],
    velocities: tuple[Vector, Vector],
    masses: tuple[float, float] | None,
) -> tuple[Vector, Vector]:
    """Return the velocities of two bodies after their contact (rule 9).

    ``places`` are their centres; ``masses`` is None where all bodies of the scene have one mass.
    """
    (xa, ya), (xb, yb) = places
    (vxa, vya), (vxb, vyb) = velocities
    dx, dy = xb - xa, yb - ya
    length = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / length, dy / length
    ux, uy = vxb - vxa, vyb - vya
    xx, yy = nx * nx, ny * ny
    excess = ((xx - 0.5) + (yy - 0.5)) + (product_error(nx, nx) + product_error(ny, ny))
    px, py = ux * nx, uy * ny
    total = px + py
    part = total - px
    low = ((px - (total - part)) + (py - part)) + (product_error(ux, nx) + product_error(uy, ny))
    speed = total + (low - total * excess)
    ga = gb = speed
    if masses is not None:
        ga, gb = _share(masses[0], masses[1], speed), _share(masses[1], masses[0], speed)
    return (vxa + ga * nx, vya + ga * ny), (vxb - gb * nx, vyb - gb * ny)


def _share(mass: float, other: float, speed: float) -> float:
    both = mass + other
    part = both - mass
    low = (mass - (both - part)) + (other - part)
    share = 2 * other / both
    back = share * both
    rest = ((2 * other - back) - product_error(share, both) - low * share) / both
    taken = share * speed
    return taken + (product_error(share, speed) + rest * speed)
