"""Sums of two doubles without loss (Knuth), and the sizes for which what is proved of them holds."""

from __future__ import annotations

from kinetile.kernel.compiled import hook
from kinetile.kernel.vectors import product_error

__all__ = ["LARGE", "SMALL", "TINY", "ULP", "kept", "plus", "whole_sum"]

ULP = 2.0**-53

LARGE = 2.0**200
SMALL = 2.0**-200
"""Sizes of lengths and speeds between which no product of four overflows, and none that counts underflows."""

TINY = 2.0**-500
"""More than all underflow in a sum of products of two, and no square of more is subnormal."""


@hook
def plus(a: float, b: float) -> tuple[float, float]:
    """Return the rounded sum of two numbers, and exactly what rounding took from it."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@hook
def kept(a: float, b: float, product: float) -> bool:
    """Whether the rounded product of two numbers is their product."""
    return product_error(a, b, product) == 0.0 and (abs(product) > TINY or a == 0.0 or b == 0.0)


@hook
def whole_sum(a: float, b: float) -> bool:
    """Whether the rounded sum of two numbers is their sum."""
    return plus(a, b)[1] == 0.0
