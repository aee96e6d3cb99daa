"""Random numbers of which only ``getrandbits`` is asked, so that every Python draws the same ones.

Drawing computes with floats, since any double is as good a question as another: with ``+ - * /`` and roots
only, which are the same everywhere.
"""

from __future__ import annotations

import random
import zlib
from collections.abc import Sequence
from math import ldexp, sqrt
from typing import TypeVar

__all__ = ["TRIPLES", "Draws"]

T = TypeVar("T")

TRIPLES = ((3, 4, 5), (5, 12, 13), (8, 15, 17), (7, 24, 25), (20, 21, 29), (1, 0, 1))
"""Whole numbers with a^2 + b^2 = c^2: directions in which lengths are exact."""


class Draws:
    """Draws for one family, named by it."""

    def __init__(self, name: str) -> None:
        self._bits = random.Random(zlib.crc32(name.encode())).getrandbits

    def below(self, end: int) -> int:
        """Return a whole number from 0 to before ``end``."""
        return self._bits(end.bit_length() + 64) % end

    def whole(self, low: int, high: int) -> int:
        """Return a whole number from ``low`` to ``high``, both included."""
        return low + self.below(high - low + 1)

    def pick(self, values: Sequence[T]) -> T:
        """Return one of some values."""
        return values[self.below(len(values))]

    def sign(self) -> int:
        """Return 1 or -1."""
        return 1 - 2 * self._bits(1)

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        """Return a number from ``low`` to ``high``."""
        return low + (high - low) * ldexp(self._bits(53), -53)

    def power(self, low: int, high: int) -> float:
        """Return a number from 2^low to 2^(high + 1), its exponent as likely as another; subnormal below
        2^-1022."""
        return ldexp(1.0 + ldexp(self._bits(52), -52), self.whole(low, high))

    def direction(self) -> tuple[float, float]:
        """Return a vector of length 1, or nearly."""
        while True:
            x, y = self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0)
            if 0.01 < x * x + y * y < 1.0:
                length = sqrt(x * x + y * y)
                return x / length, y / length

    def turned(self, a: float, b: float) -> tuple[float, float]:
        """Return a vector turned by a multiple of a right angle and perhaps mirrored, exactly."""
        if self._bits(1):
            a, b = b, a
        return self.sign() * a, self.sign() * b

    def shuffled(self, values: Sequence[T]) -> list[T]:
        """Return the values in another order."""
        rest = list(values)
        return [rest.pop(self.below(len(rest))) for _ in range(len(rest))]
