"""Wrapping, against IEEE 754."""

import math
import random
from fractions import Fraction

import numpy as np

from encounters import compiled
from kinetile.kernel.images import remainder, turns_of


@compiled
def wrap_all(table, found):
    for i in range(len(table)):
        times = turns_of(table[i, 0], table[i, 1])
        found[i, 0] = remainder(table[i, 0], table[i, 1], times)
        found[i, 1] = times


def test_wrapping_is_the_remainder_of_ieee_754():
    rng = random.Random(1)
    drawn = []
    for _ in range(4000):
        size = rng.choice((rng.uniform(1e-3, 1e3), 2.0 ** rng.randrange(-40, 40)))
        period = rng.choice((1.0, 3.0, 0.1, 1e200, 2.0**-190, size, size))
        near = rng.randrange(-9, 10) / 2 * period
        place = rng.choice(
            (near, math.nextafter(near, math.inf), near + rng.uniform(-1, 1) * period, near * 1e6)
        )
        drawn.append((place, period))
    found = np.zeros((len(drawn), 2))
    wrap_all(np.array(drawn), found)
    for (place, period), (rest, times) in zip(drawn, found.tolist(), strict=True):
        assert rest == math.remainder(place, period)
        assert Fraction(rest) == Fraction(place) - Fraction(times) * Fraction(period)
