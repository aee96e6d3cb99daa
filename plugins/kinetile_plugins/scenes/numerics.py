"""Numbers of the recipes, with the same bits on every machine: draws from a seed, and velocities from them;
sine, cosine, logarithm and powers.

NumPy guarantees the bits of its bit generators and of its seed sequences for ever, but not the bits of its
Generator. So here a uniform number is the upper 53 bits of a draw, and a choice among n is the integer part
of one half of a draw times n (which favours some by up to n / 2**32). C libraries round sines, logarithms and
powers differently, and NumPy chooses its own by processor. The functions below use only sums, differences,
products and quotients of doubles, one at a time, and decimal arithmetic.

Sine and cosine use tables (Gal, 1986): an angle is k / 128 and a rest below 1 / 256; short series suffice for
the rest. The largest term is multiplied exactly (Dekker, 1971). The largest error among 200,000 angles was
0.521 units in the last place.
"""

import decimal
import math
from decimal import Decimal
from typing import Any

import numpy as np

from kinetile.arrays import Floats, Integers
from kinetile.errors import BadOption, shown
from kinetile.scene.values import SIZE_VALUE


class Draws:
    """Random numbers, one after the other, from a seed sequence."""

    def __init__(self, seeds: np.random.SeedSequence) -> None:
        self._source = np.random.PCG64(seeds)
        self._half = np.empty(0, dtype=np.uint64)

    def uniform(self, *shape: int) -> Floats:
        """Returns numbers from 0 up to, and never, 1: multiples of 2**-53."""
        bits = np.asarray(self._source.random_raw(int(np.prod(shape, dtype=np.int64))), dtype=np.uint64)
        return (bits >> np.uint64(11)).astype(np.float64).reshape(shape) * 2.0**-53

    def below(self, limits: int | Integers, *shape: int) -> Integers:
        """Returns whole numbers from 0 up to, and never, the limit (for all, or each), at most 2**32."""
        wanted = int(np.prod(shape, dtype=np.int64))
        bits = np.asarray(self._source.random_raw(max(0, wanted - len(self._half) + 1) // 2), dtype=np.uint64)
        halves = np.stack([bits & np.uint64(2**32 - 1), bits >> np.uint64(32)], axis=1).ravel()
        halves = np.concatenate([self._half, halves])
        self._half = halves[wanted:]
        return ((halves[:wanted] * np.uint64(limits)) >> np.uint64(32)).astype(np.int64).reshape(shape)

    def order(self, number: int) -> Integers:
        """Returns 0 to ``number`` - 1 in random order, all equally likely (Fisher and Yates's shuffle)."""
        order, last = list(range(number)), number - 1
        while last > 0:
            for half in self.below(2**32, last).tolist():
                other = half & ((1 << last.bit_length()) - 1)
                if other <= last:
                    order[last], order[other] = order[other], order[last]
                    last -= 1
        return np.array(order, dtype=np.int64)


_DECIMALS = decimal.Context(prec=50, rounding=decimal.ROUND_HALF_EVEN)
_PI = Decimal("3.14159265358979323846264338327950288419716939937511")
_STEPS = 128  # to the radian
_SMALL = 0.126  # below it the series alone is more exact than the table


def cosine_and_sine(angle: Floats) -> tuple[Floats, Floats]:
    """Returns the cosines and sines of angles in radians, which are at most 2**16 in size."""
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
    """Returns ``base``, which is above 0, to the power of each exponent: the nearest doubles."""
    log = _DECIMALS.ln(Decimal(base))
    exact = (_DECIMALS.exp(_DECIMALS.multiply(log, Decimal(each))) for each in exponent.tolist())
    return np.array([float(each) for each in exact], dtype=np.float64)


def logarithms(number: Floats) -> Floats:
    """Returns the natural logarithms of numbers from 2**-1022 to 1, to 2 units in the last place."""
    part, exponent = np.frexp(number)
    low = part < math.sqrt(0.5)
    part, exponent = np.where(low, 2.0 * part, part), exponent - low
    ratio = (part - 1.0) / (part + 1.0)  # at most 0.172 in size: ln part = 2 artanh ratio
    square = ratio * ratio
    rest = ratio * square * _series(square, *(2.0 / k for k in range(3, 25, 2)))
    return exponent * _LN_2[0] + (exponent * _LN_2[1] + (2.0 * ratio + rest))


def _within_an_eighth(angle: Floats, tail: Floats) -> tuple[Floats, Floats]:
    """Returns cosine and sine of ``angle + tail``, an eighth of a turn or less in size."""
    sign = np.where(angle < 0.0, -1.0, 1.0)
    size, tail = sign * angle, sign * tail
    k = np.rint(size * _STEPS).astype(np.int64)
    cos, cos_tail, sin, sin_tail = _TABLE[k].T
    x = size - k / _STEPS
    square = x * x
    sin_x = _sine(x, tail)
    less = x * tail + square * _series(square, 1 / 2, -1 / 24, 1 / 720)  # 1 - cos(x + tail)
    cosine = cos + _product_and_sum(-sin, sin_x, (cos_tail - sin_x * sin_tail) - cos * less)
    sine = sin + _product_and_sum(cos, sin_x, (sin_tail + sin_x * cos_tail) - sin * less)
    return cosine, sign * np.where(size < _SMALL, _sine(size, tail), sine)


def _sine(x: Floats, tail: Floats) -> Floats:
    """Returns the sine of ``x + tail``, where x is small."""
    square = x * x
    return x + (tail + x * square * _series(square, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880, -1 / 39916800))


def _series(square: Floats, *coefficients: float) -> Floats:
    """Returns the polynomial in ``square`` with these coefficients, the constant one first."""
    total = np.zeros_like(square)
    for each in reversed(coefficients):
        total = total * square + each
    return total


def _product_and_sum(a: Floats, b: Floats, c: Floats) -> Floats:
    """Returns a b + c, almost as if it were rounded once."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    missing = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    total = product + c
    other = total - product
    return total + (((product - (total - other)) + (c - other)) + missing)


def _halves(a: Floats) -> tuple[Floats, Floats]:
    """Returns two numbers of at most 26 bits whose sum is ``a``."""
    wide = (2.0**27 + 1.0) * a
    high = wide - (wide - a)
    return high, a - high


def _parts(number: Decimal, *bits: int) -> list[float]:
    """Returns doubles that add up to a number: of this many bits each, and one for the rest."""
    parts = []
    for count in bits:
        unit = 2.0 ** (np.frexp(float(number))[1] - count)
        parts.append(round(float(number) / unit) * unit)
        number = _DECIMALS.subtract(number, Decimal(parts[-1]))
    return [*parts, float(number)]


def _table() -> Any:
    """Returns rows of cos(k / 128) and sin(k / 128), each as two doubles, as far as an eighth of a turn."""
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
_LN_2 = _parts(_DECIMALS.ln(Decimal(2)), 33)

MOST = 10_000_000
"""The most bodies, or turns, of a recipe: a scene of more would not fit into memory, nor would its run."""


def demand(granted: bool | np.bool_, sentence: str) -> None:
    """Raises BadOption with ``sentence`` unless the demand is granted."""
    if not granted:
        raise BadOption(sentence)


def demand_number(name: str, number: int, least: int, why: str) -> None:
    """Raises BadOption if there are fewer bodies, or turns, than ``least``, or more than memory holds."""
    demand(number >= least, f"{name} is {shown(number)}; {why}")
    demand(number <= MOST, f"{name} is {shown(number)}; it is at most {MOST:,}: memory would not hold more")


def demand_density(density: float) -> None:
    """Raises BadOption unless a density is above 0 and below 1."""
    demand(0.0 < density < 1.0, f"density is {density}; it is above 0 and below 1")


def demand_in_range(name: str, number: float) -> None:
    """Raises BadOption unless a length, a mass or a temperature is above 0 and possible in a scene."""
    expected = SIZE_VALUE.expected(number)
    demand(not expected, f"{name} is {number}; expected {expected}")


def draws(seed: int, count: int) -> list[Draws]:
    """Returns independent draws from a seed: draws from one do not affect the others."""
    demand(seed >= 0, f"seed is {seed}; a seed is 0 or more")
    return [Draws(child) for child in np.random.SeedSequence(seed).spawn(count)]


def in_random_directions(speed: float, bodies: int, random: Draws) -> Floats:
    """Returns (bodies, 2) velocities of one speed, in directions drawn evenly from the whole turn."""
    return speed * np.stack(cosine_and_sine(2.0 * math.pi * random.uniform(bodies)), axis=1)


def maxwell(temperature: float, mass: Floats, random: Draws) -> Floats:
    """Returns (n, 2) velocities from Maxwell's distribution, without momentum and of a given temperature, the
    mean kinetic energy of a body: normal with the variance ``temperature`` / mass (Box and Muller, 1958),
    less the velocity of the centre of mass, scaled. ``mass`` is (n,), and finite. Raises BadOption for fewer
    than 2 bodies, and for a temperature that is not a number from 2**-200 to 2**200."""
    bodies = len(mass)
    demand(bodies >= 2, f"bodies is {bodies}; at a temperature and without momentum there are 2 or more")
    demand_in_range("temperature", temperature)
    size = np.sqrt(-2.0 * logarithms(1.0 - random.uniform(bodies)))  # 1 less a draw is never 0
    share = mass / mass.max()
    velocity: Floats = (size / np.sqrt(share))[:, np.newaxis] * in_random_directions(1.0, bodies, random)
    weight = share[:, np.newaxis]
    velocity -= np.array([math.fsum(axis) for axis in (weight * velocity).T]) / math.fsum(share)
    energy = math.fsum((weight * velocity * velocity).ravel()) / 2.0
    velocity *= math.sqrt(temperature / float(mass.max())) * math.sqrt(bodies / energy)
    return velocity


def draw_velocities(speed: float, temperature: float, mass: Floats, random: Draws) -> Floats:
    """Returns (n, 2) velocities: of one speed in random directions, or of a temperature if that is not 0."""
    if temperature == 0.0:
        return in_random_directions(speed, len(mass), random)
    both = f"speed is {speed} beside a temperature, {temperature}; expected one of the two"
    demand(speed == 1.0, f"{both}: the temperature determines the speeds")
    return maxwell(temperature, mass, random)
