"""Statistics of observables: block averages of samples, with error bars, and tables of them."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, NoReturn, TypeVar

import numpy as np

from kinetile.arrays import Floats

_Value = TypeVar("_Value")

_MOST_BLOCKS = 256
_FEWEST_BLOCKS = 8
_LEAST_INDEPENDENT = 50
_ROUNDING = 2.0**-40
"""Values that scatter by at most this part of their mean are constant up to rounding: their error is 0."""


class Estimate(NamedTuple):
    """A quantity, averaged over a run: its mean, standard error, and the number of independent ``blocks`` for
    the error. If it is an array, these three are arrays, too, and ``axis`` and ``at`` are the name and the
    values of its coordinate. Without an error, ``error`` is NaN and ``blocks`` is 0; ``reason`` gives the
    cause and a sufficient time. A number has not ``relaxed`` if no length of blocks is long enough."""

    mean: Any
    error: Any
    blocks: Any
    axis: str = ""
    at: Any = None
    reason: str = ""
    relaxed: bool = True

    @property
    def interval(self) -> Any:
        """Half the width of the 95 % interval around the mean: the error times Student's factor."""
        return self.error * _student(np.maximum(self.blocks, 2) - 1)


def _student(degrees: Any) -> Any:
    """Returns the factor of a 95 % interval, to 1e-3 from 7 degrees on (Abramowitz and Stegun 26.7.5)."""
    z, d = 1.959963984540054, np.asarray(degrees, dtype=np.float64)
    first, second = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96
    return z + first / d + second / d**2 + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * d**3)


class ObservedRow(NamedTuple):
    """One number of a table of estimates."""

    observable: str
    quantity: str
    axis: str
    at: float | None
    mean: float
    error: float
    blocks: int
    reason: str


class Named(dict[str, _Value]):
    """Results by name; KeyError gives the names, or the ``reason`` if there are no results."""

    reason = "nothing"

    def __missing__(self, name: str) -> NoReturn:
        raise KeyError(f"{name!r} was not observed, but {', '.join(map(repr, self)) or self.reason}")


class Observed(Named[Named[Estimate]]):
    """The estimates of a run by observable, as written with its options, then by quantity."""

    HEADS = ("observable", "quantity", "mean", "standard error", "95 % within", "blocks")

    def entries(self) -> Iterator[tuple[str, str, Estimate]]:
        """Yields observables, quantities and estimates; for an observable without any, the reason."""
        for name, quantities in self.items():
            nothing = {"": Estimate(math.nan, math.nan, 0, reason=quantities.reason)}
            yield from ((name, *entry) for entry in (quantities or nothing).items())

    def lines(self) -> list[tuple[str, ...]]:
        """Returns estimates as texts under ``HEADS``: numbers with their errors, a curve as its length."""
        lines = []
        for name, quantity, each in self.entries():
            mean = f"{len(each.at)} values over {each.axis}" if each.axis else f"{each.mean:.7g}"
            none = each.reason or each.axis
            errors = ["", ""] if none else [f"{each.error:.2g}", f"{each.interval:.2g}"]
            few, most = int(np.min(each.blocks)), int(np.max(each.blocks))
            blocks = f"{few}" if few == most else f"{few} to {most}"
            lines.append((name, quantity, mean, *errors, "; ".join(filter(None, (blocks, each.reason)))))
        return lines

    def withhold(self) -> None:
        """Removes all errors except errors of constants if a number has not relaxed: in so short a time,
        others that depend on it may not show that."""
        slow = next((entry for entry in self.entries() if not entry[2].relaxed), None)
        for name, quantity, each in [*self.entries()] if slow else ():
            if slow and np.any(each.error > 0.0):
                reason = f"{slow[1]} of {slow[0]} has not relaxed: {slow[2].reason}"
                error, blocks = each.error * math.nan, each.blocks * 0
                self[name][quantity] = each._replace(error=error, blocks=blocks, reason=reason)

    def rows(self) -> list[ObservedRow]:
        """Returns all numbers as the rows of one table."""
        rows = []
        for name, quantity, each in self.entries():
            places = [None] if each.at is None else each.at.tolist()
            values = (np.atleast_1d(of).tolist() for of in (each.mean, each.error, each.blocks))
            table = zip(places, *values, [each.reason] * len(places), strict=True)
            rows += [ObservedRow(name, quantity, each.axis, *row) for row in table]
        return rows


class Blocks:
    """Averages of successive values, in equal blocks; their number is kept between 128 and 256 by joining
    neighbours, so that memory does not grow with the run."""

    def __init__(self) -> None:
        self._blocks: list[Floats] = []  # sums of values, and numbers of values
        self._open: Any = 0.0
        self._length, self._filled = 1, 0

    @property
    def state(self) -> list[Any]:
        """Its content, in values that are never changed."""
        return [np.array(self._blocks), self._open, self._length, self._filled]

    @classmethod
    def of(cls, state: Sequence[Any]) -> "Blocks":
        """Returns the blocks of a state."""
        blocks = cls()
        kept, blocks._open, blocks._length, blocks._filled = state
        blocks._blocks = list(kept)
        return blocks

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the values so far."""
        return np.shape(self._blocks[0] if self._blocks else self._open)[1:]

    def add(self, value: Floats, time: float = math.nan) -> None:
        """Adds a value; its NaN elements do not count."""
        known = ~np.isnan(value)
        self._open = self._open + np.stack([np.where(known, value, 0.0), known])
        self._filled += 1
        if self._filled == self._length:
            self._blocks.append(self._open)
            self._open, self._filled = 0.0, 0
        if len(self._blocks) == _MOST_BLOCKS:
            self._blocks = [np.add(*pair) for pair in zip(self._blocks[::2], self._blocks[1::2], strict=True)]
            self._length *= 2

    def estimate(self, axis: str = "", at: Any = None) -> Estimate:
        """Returns the mean of all values, and the standard error from complete blocks.

        Blocks are made longer until the error levels off (Flyvbjerg and Petersen, J. Chem. Phys. 91, 461,
        1989). Let n be the number of blocks, and R the growth of the error's square after joining b of them.
        They are long enough if b^3 > 2 n R^2 (Lee et al., Phys. Rev. E 83, 066706, 2011): then they depend on
        each other by less than the uncertainty of the spread of so few. The remaining dependence on
        neighbours is added (twice their correlation). The n blocks are worth n/R independent ones: below 50,
        R itself is too uncertain, mostly too small: there is no error before 50 R/n of the time.
        """
        with np.errstate(all="ignore"):
            mean = np.divide(*(self._open + np.sum(self._blocks, axis=0)))
            error, blocks = np.full(np.shape(mean), math.nan), np.zeros(np.shape(mean), dtype=np.int64)
            kept = np.array(self._blocks)
            many = np.sum(kept[:, 1] > 0.0, axis=0) if len(kept) else 0
            growth, settled = np.ones(np.shape(mean)), blocks > 0
            for joined in range(1, len(kept) // _FEWEST_BLOCKS + 1):
                whole = kept[len(kept) % joined :]
                sums = whole.reshape(len(whole) // joined, joined, *whole.shape[1:]).sum(axis=1)
                means = sums[:, 0] / sums[:, 1]
                known = (~np.isnan(means)).sum(axis=0)
                apart = means - np.nansum(means, axis=0) / known
                spread = np.nansum(apart**2, axis=0)
                square = spread / (known - 1.0) / known
                if joined == 1:
                    least = square
                    constant = least <= (_ROUNDING * mean) ** 2
                grown = np.where(constant, 1.0, square / least)
                growth = np.where(settled, growth, np.fmax(growth, grown))
                found = ~settled & (known >= _FEWEST_BLOCKS) & (joined**3 > 2.0 * many * grown**2)
                # The correlation of deviations from their own mean is too low by one over their number.
                follow = np.nansum(apart[1:] * apart[:-1], axis=0) / spread
                square = square * (1.0 + 2.0 * np.fmax(follow + 1.0 / known, 0.0))
                square = np.where(constant, 0.0, square)
                enough = np.sqrt(np.where(many >= _LEAST_INDEPENDENT * grown, square, math.nan))
                error, blocks = np.where(found, enough, error), np.where(found, known, blocks)
                settled = settled | found
            blocks, lacking = np.where(np.isnan(error), 0, blocks), np.isnan(error) & (many > 0)
            longer = np.max(_LEAST_INDEPENDENT * growth / many, where=lacking, initial=0.0)
        reason = f"run too short: expected {math.ceil(10.0 * longer) / 10.0:g} times the time or more"
        if np.ndim(mean) == 0:
            reason, relaxed = reason * bool(longer), bool(settled | (many < _LEAST_INDEPENDENT))
            return Estimate(float(mean), float(error), int(blocks), reason=reason, relaxed=relaxed)
        reason = f"{np.sum(lacking)} without error: {reason}" if longer else ""
        axis, at = (axis, at) if axis else ("index", np.arange(len(mean)))
        return Estimate(mean, error, blocks, axis, at, reason)


class Series(Blocks):
    """All values of a number, with their times, instead of averages: a curve without errors."""

    shape = ()

    def add(self, value: Floats, time: float = math.nan) -> None:
        """Adds a value at a time."""
        self._blocks.append(np.array([time, float(value)]))

    def estimate(self, axis: str = "time", at: Any = None) -> Estimate:
        """Returns the values over time."""
        at, values = np.transpose(self._blocks)
        return Estimate(values, np.full(len(at), math.nan), np.zeros(len(at), np.int64), axis, at)
