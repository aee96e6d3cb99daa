"""Flights: the plans that rows of the log give to bodies, each in force until the body's next one."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from kinetile.arrays import Array, Flags, Floats, Integers
from kinetile.kernel.plan import Plan

COLUMNS_OF = {name: (f"a{name}", f"b{name}") for name in Plan._fields}
"""The columns of rows, for a and for b, by the names of their values."""


@dataclass(frozen=True, eq=False)
class Flights:
    """The flights that begin in ``rows`` (dtype LOG), in their order, a before b; (m,) each: the index of the
    ``row``, True for the row's b, and the number of the body."""

    rows: Array
    row: Integers
    is_b: Flags
    body: Integers

    @classmethod
    def of(cls, rows: Array) -> Self:
        """Returns the flights of rows."""
        bodies = np.empty(2 * len(rows), dtype=np.int64)
        bodies[0::2], bodies[1::2] = rows["a"], rows["b"]
        has_plans = np.repeat(~np.isnan(rows["ax"]), 2)  # a body that begins to pass another flies on
        at = np.flatnonzero((bodies >= 0) & has_plans)
        return cls(rows, at // 2, at % 2 == 1, bodies[at])

    def value(self, *names: str, which: Any = slice(None)) -> Floats:
        """Returns values of flights, all or some, at their begin, by names of ``Plan``, (m,) each."""
        row, is_b = self.row[which], self.is_b[which]
        columns = [
            np.where(is_b, self.rows[b][row], self.rows[a][row])
            for a, b in map(COLUMNS_OF.__getitem__, names)
        ]
        return columns[0] if len(columns) == 1 else np.stack(columns, axis=1)

    @cached_property
    def by_body(self) -> Integers:
        """The indices of all flights, sorted by the numbers of their bodies, then in their order."""
        bits = len(self.body).bit_length()  # plain numbers are sorted ten times as fast as by np.argsort
        keys = np.sort(self.body << bits | np.arange(len(self.body)))
        return np.asarray(keys & ((1 << bits) - 1))

    @cached_property
    def before(self) -> Integers:
        """The index of the same body's previous flight, for each; -1 for the first."""
        body, found = self.body[self.by_body], np.full(len(self.body), -1, dtype=np.int64)
        same = body[1:] == body[:-1]
        found[self.by_body[1:][same]] = self.by_body[:-1][same]
        return found

    def accelerations(self, before: Floats) -> Floats:
        """Returns the accelerations (m, 2) in force from each flight on: from the last row of its body that
        gives one, or else from ``before``, (n, 2) by the numbers of bodies."""
        gives = ((self.rows["b"] < 0) & ~np.isnan(self.rows["bx"]))[self.row]
        if not (gives.any() or before.any()):  # no body is accelerated
            return np.broadcast_to(0.0, (len(self.row), 2))
        order = self.by_body
        given = np.stack([self.rows[name][self.row] for name in ("bx", "by")], axis=1)[order]
        body, place = self.body[order], np.arange(len(order))
        last = np.maximum.accumulate(np.where(gives[order], place, -1))
        own = last >= np.searchsorted(body, body)  # of the same body
        found = np.empty_like(given)
        found[order] = np.where(own[:, None], given[last], before[body])
        return found
