"""binary64 in whole numbers: each operation exact, then rounded to nearest, ties to even.

A ``Double`` is a rational that happens to be one of IEEE 754's. There is one zero: its sign is no part of the
answer. Python's floats carry doubles from and to files, and are not computed with.
"""

from __future__ import annotations

from fractions import Fraction
from math import isqrt

__all__ = ["Double", "error_of_product", "rounded", "sqrt"]


def rounded(exact: Fraction) -> Fraction:
    """Return the double that is nearest to a rational; of two as near, the one whose last bit is 0."""
    top, bottom = abs(exact.numerator), exact.denominator
    leading = top.bit_length() - bottom.bit_length()
    if (top << max(-leading, 0)) < (bottom << max(leading, 0)):
        leading -= 1
    last = max(leading - 52, -1074)  # the weight of the last bit is 2^last
    divisor = bottom << max(last, 0)
    whole, rest = divmod(top << max(-last, 0), divisor)
    whole += 2 * rest > divisor or (2 * rest == divisor and whole % 2)
    if whole.bit_length() + last > 1024:
        raise OverflowError("beyond the largest double")
    return Fraction(whole << max(last, 0), 1 << max(-last, 0)) * (1 if exact >= 0 else -1)


class Double:
    """A double; ``+ - * /`` of two of them round once. Whole numbers take part as the doubles they are."""

    __slots__ = ("exact",)

    def __init__(self, value: float | int | Fraction) -> None:
        self.exact = rounded(Fraction(value))

    def __float__(self) -> float:
        return self.exact.numerator / self.exact.denominator

    def __add__(self, other: Double) -> Double:
        return Double(self.exact + other.exact)

    def __sub__(self, other: Double) -> Double:
        return Double(self.exact - other.exact)

    def __mul__(self, other: Double) -> Double:
        return Double(self.exact * other.exact)

    def __truediv__(self, other: Double) -> Double:
        return Double(self.exact / other.exact)


def sqrt(value: Double) -> Double:
    """Return the square root, correctly rounded."""
    top, bottom = value.exact.numerator, value.exact.denominator
    bits = 64 + max(bottom.bit_length() - top.bit_length(), 0)
    whole, rest = divmod(top << 2 * bits, bottom)
    root = isqrt(whole)
    inexact = rest != 0 or root * root != whole  # as a last bit, far below those that stay
    return Double(Fraction(2 * root + inexact, 2 << bits))


def error_of_product(one: Double, other: Double) -> Double:
    """Return E(a, b): what their product loses by its rounding, rounded."""
    exact = one.exact * other.exact
    return Double(exact - rounded(exact))
