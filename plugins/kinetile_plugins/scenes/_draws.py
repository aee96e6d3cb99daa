"""Drawing from a seed: the same numbers with every NumPy, on every machine.

NumPy promises the bits of its bit generators and of its seed sequences for ever, but not what its Generator
makes of them, so that is done here: a uniform number is the upper 53 bits of a draw, a choice among n is one
half of a draw times n, its integer part. (The choice favours some by up to n / 2**32, which no scene shows.)
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["Draws", "Floats", "Ints"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


class Draws:
    """Random numbers, one after the other, from a seed sequence."""

    def __init__(self, seeds: np.random.SeedSequence) -> None:
        self._source = np.random.PCG64(seeds)
        self._half = np.empty(0, dtype=np.uint64)

    def uniform(self, *shape: int) -> Floats:
        """Return numbers from 0 up to, and never, 1: multiples of 2**-53."""
        bits = np.asarray(self._source.random_raw(int(np.prod(shape, dtype=np.int64))), dtype=np.uint64)
        return (bits >> np.uint64(11)).astype(np.float64).reshape(shape) * 2.0**-53

    def below(self, limits: int | Ints, *shape: int) -> Ints:
        """Return whole numbers from 0 up to, and never, the limit (one for all, or each its own), at most
        2**32."""
        wanted = int(np.prod(shape, dtype=np.int64))
        bits = np.asarray(self._source.random_raw(max(0, wanted - len(self._half) + 1) // 2), dtype=np.uint64)
        halves = np.stack([bits & np.uint64(2**32 - 1), bits >> np.uint64(32)], axis=1).ravel()
        halves = np.concatenate([self._half, halves])
        self._half = halves[wanted:]
        return ((halves[:wanted] * np.uint64(limits)) >> np.uint64(32)).astype(np.int64).reshape(shape)

    def order(self, number: int) -> Ints:
        """Return 0 to ``number`` - 1 in an order of which each is as likely (Fisher and Yates's shuffle)."""
        order, last = list(range(number)), number - 1
        while last > 0:
            for half in self.below(2**32, last).tolist():
                other = half & ((1 << last.bit_length()) - 1)
                if other <= last:
                    order[last], order[other] = order[other], order[last]
                    last -= 1
        return np.array(order, dtype=np.int64)
