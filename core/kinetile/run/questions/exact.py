"""Exact comparisons of lengths: squares, and differences of square roots, in whole numbers of any size.

Doubles are whole numbers of one unit, a power of two. So are their sums and products, in powers of the
unit; square roots are removed by squaring once or twice.

Before that, arrays are compared in floating point. A bound covers all roundings, so what this decides is
right. ULP is 2^-53, half the distance of doubles next to 1, and each operation is off by a factor of
1 +- ULP at most. Underflow does not count beside the radii that lengths are compared with: these are 2^-200
or more (``kinetile.scene.checks``), their squares 2^-400, and what underflow takes is below 2^-1073. What
overflows is infinite, or no number, and settles nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import cmp_to_key
from itertools import pairwise
from math import isqrt

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Truths = npt.NDArray[np.bool_]


def whole(numbers: Iterable[float]) -> tuple[list[int], int]:
    """Returns finite doubles as whole numbers of one unit, and how many units are 1: a power of two."""
    ratios = [float(number).as_integer_ratio() for number in numbers]
    unit = max((below for _, below in ratios), default=1)
    return [above * (unit // below) for above, below in ratios], unit


def compare_roots(a: int | Fraction, b: int | Fraction, c: int | Fraction) -> int:
    """Returns the sign of sqrt(a) - sqrt(b) - c, for a, b >= 0: -1, 0 or 1."""
    if c < 0:
        return -compare_roots(b, a, -c)
    # both sides of sqrt(a) ? sqrt(b) + c are >= 0: squared, that is
    rest = a - b - c * c  # rest ? 2 c sqrt(b), and squared again
    if rest < 0:
        return -1
    twice = 4 * c * c * b
    return (rest * rest > twice) - (rest * rest < twice)


def difference_of_roots(dot: int, d: int, n: int, unit: int) -> float:
    """Returns (dot - sqrt(d)) / (sqrt(n) unit) to the nearest double, for dot^2 > d >= 0 and dot, n > 0.

    As (sqrt(p) - sqrt(q)) / unit with p = dot^2 / n and q = d / n: both roots to enough bits that what is
    left of them has 64. Then it lies between two numbers that mostly round to the same double; where they do
    not, it is asked on which side of the middle between their doubles it lies, and that has an answer.
    """
    size, shared, gap = ((dot * dot // n).bit_length(), n.bit_length(), (dot * dot - d).bit_length())
    bits = 70 + max(size // 2 + shared - gap, 0)  # (p - q) / 2 sqrt(p) is 2^(67 - bits) or more
    left = isqrt((dot * dot << 2 * bits) // n) - isqrt((d << 2 * bits) // n)
    low, high = (left - 1) / (unit << bits), (left + 1) / (unit << bits)
    if low == high:
        return low
    middle = (Fraction(low) + Fraction(high)) / 2
    above, below = (middle * unit).as_integer_ratio()
    side = compare_roots(dot * dot * n * below * below, d * n * below * below, above * n)
    return (low, float(middle), high)[side + 1]


def in_order(lower: Floats, upper: Floats, compare: Callable[[int, int], int]) -> list[int]:
    """Returns 0 to n - 1 in ascending order of n values that lie between bounds.

    ``compare`` is called, as for ``functools.cmp_to_key``, for two whose bounds overlap, or that are in one
    heap with such; equals stay in ascending order.
    """
    order = np.argsort(lower, kind="stable")
    clear = lower[order][1:] > np.maximum.accumulate(upper[order])[:-1]
    begins = np.concatenate([[0], np.flatnonzero(clear) + 1, [len(order)]]).tolist()
    numbers: list[int] = order.tolist()
    for begin, end in pairwise(begins):
        if end - begin > 1:
            numbers[begin:end] = sorted(sorted(numbers[begin:end]), key=cmp_to_key(compare))
    return numbers
