"""Sine, cosine and powers with the same bits on every machine.

A C library rounds sines and powers as it likes: one that may use fused multiply-adds gives other bits than
one that may not, and NumPy chooses again by processor. What is below is made of sums, differences and
products of doubles alone, one at a time, which are rounded in one way everywhere, and of decimal arithmetic,
which is defined to the last digit.

Sine and cosine come from tables (Gal, 1986): an angle is k / 128 and a rest below 1 / 256, for which short
series do. The largest term is multiplied exactly (Dekker, 1971). Of 200,000 angles the worst was wrong by
0.521 units in the last place; where the nearest double is missed, the GNU C library with fused multiply-adds
nearly always misses it in the same way.
"""

from __future__ import annotations

import decimal
from decimal import Decimal
from typing import Any

import numpy as np

from kinetile_plugins.scenes._draws import Floats

__all__ = ["cosine_and_sine", "powers"]

_DECIMALS = decimal.Context(prec=50, rounding=decimal.ROUND_HALF_EVEN)
_PI = Decimal("3.14159265358979323846264338327950288419716939937511")
_STEPS = 128  # to the radian
_SMALL = 0.126  # the series alone does better than the table below it


def cosine_and_sine(angle: Floats) -> tuple[Floats, Floats]:
    """Return the cosines and sines of angles in radians, which are at most 2**16 in size."""
    quarters = np.rint(angle * _QUARTERS_TO_THE_RADIAN)
    first = angle - quarters * _QUARTER[0]  # exact, as the next difference is: the parts are short
    second = quarters * _QUARTER[1]
    rest = first - second
    tail = ((first - rest) - second) - quarters * _QUARTER[2]
    cosine, sine = _within_an_eighth(rest, tail)
    turned = quarters.astype(np.int64) % 4
    return (
        np.choose(turned, [cosine, -sine, -cosine, sine]),
        np.choose(turned, [sine, cosine, -sine, -cosine]),
    )


def powers(base: float, exponent: Floats) -> Floats:
    """Return ``base``, which is above 0, to the power of each exponent: the nearest doubles."""
    log = _DECIMALS.ln(Decimal(base))
    exact = (_DECIMALS.exp(_DECIMALS.multiply(log, Decimal(each))) for each in exponent.tolist())
    return np.array([float(each) for each in exact], dtype=np.float64)


def _within_an_eighth(angle: Floats, tail: Floats) -> tuple[Floats, Floats]:
    """Return cosine and sine of ``angle + tail``, an eighth of a turn or less in size."""
    sign = np.where(angle < 0.0, -1.0, 1.0)
    size, tail = sign * angle, sign * tail
    k = np.rint(size * _STEPS).astype(np.int64)
    cos, cos_tail, sin, sin_tail = _TABLE[k].T
    x = size - k / _STEPS
    sin_x, less = _sine(x, tail), _less_than_one(x, tail)
    cosine = cos + _product_and_sum(-sin, sin_x, (cos_tail - sin_x * sin_tail) - cos * less)
    sine = sin + _product_and_sum(cos, sin_x, (sin_tail + sin_x * cos_tail) - sin * less)
    return cosine, sign * np.where(size < _SMALL, _sine(size, tail), sine)


def _sine(x: Floats, tail: Floats) -> Floats:
    """Return the sine of ``x + tail``, where x is small."""
    square = x * x
    return x + (tail + x * square * _series(square, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880, -1 / 39916800))


def _less_than_one(x: Floats, tail: Floats) -> Floats:
    """Return by how much the cosine of ``x + tail`` is less than 1, where x is below 1 / 256."""
    square = x * x
    return x * tail + square * _series(square, 1 / 2, -1 / 24, 1 / 720)


def _series(square: Floats, *coefficients: float) -> Floats:
    """Return the polynomial in ``square`` with these coefficients, the constant one first."""
    total = np.zeros_like(square)
    for each in reversed(coefficients):
        total = total * square + each
    return total


def _product_and_sum(a: Floats, b: Floats, c: Floats) -> Floats:
    """Return a b + c, almost as if it were rounded once."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    missing = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    total = product + c
    other = total - product
    return total + (((product - (total - other)) + (c - other)) + missing)


def _halves(a: Floats) -> tuple[Floats, Floats]:
    """Return two numbers of at most 26 bits whose sum is ``a``."""
    wide = (2.0**27 + 1.0) * a
    high = wide - (wide - a)
    return high, a - high


def _parts(number: Decimal, *bits: int) -> list[float]:
    """Return doubles that add up to a number: of so many bits each, and a last one of all its own."""
    parts = []
    for count in bits:
        unit = 2.0 ** (np.frexp(float(number))[1] - count)
        parts.append(round(float(number) / unit) * unit)
        number = _DECIMALS.subtract(number, Decimal(parts[-1]))
    return [*parts, float(number)]


def _table() -> Any:
    """Return rows of cos(k / 128) and sin(k / 128), each as two doubles, as far as an eighth of a turn."""
    with decimal.localcontext(_DECIMALS):
        step = Decimal(1) / _STEPS
        terms = [Decimal(1)]
        while abs(terms[-1]) > Decimal("1e-50"):
            terms.append(terms[-1] * step / len(terms))
        cos_step = sum((term * (-1) ** k for k, term in enumerate(terms[0::2])), Decimal(0))
        sin_step = sum((term * (-1) ** k for k, term in enumerate(terms[1::2])), Decimal(0))
        rows, cos, sin = [], Decimal(1), Decimal(0)
        for _ in range(_STEPS):
            rows.append([*_parts(cos, 53), *_parts(sin, 53)])
            cos, sin = cos * cos_step - sin * sin_step, sin * cos_step + cos * sin_step
    return np.array(rows)


_QUARTER = _parts(_DECIMALS.divide(_PI, Decimal(2)), 33, 33)
_QUARTERS_TO_THE_RADIAN = float(_DECIMALS.divide(Decimal(2), _PI))
_TABLE = _table()
