"""Rows of a run in memory, up to a number.

A limit of contacts does not bound the rows of a run: the clock anchors plans again, and each is a row, so
that a slow scene has any number of them without a contact.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import KinetileError
from kinetile.kernel.log import LOG


class TooManyRows(KinetileError):
    """A run has more rows than were to be kept."""


class BoundedRows:
    """A recorder that keeps the first ``limit`` rows of a run, and ends it with TooManyRows after them."""

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self._parts: list[npt.NDArray[Any]] = [np.zeros(0, LOG)]
        self._count = 0

    def __call__(self, rows: npt.NDArray[Any]) -> None:
        """Takes the next rows; raises TooManyRows where there are more than the limit."""
        self._parts.append(np.array(rows[: self.limit - self._count]))
        self._count += len(rows)
        if self._count > self.limit:
            time = float(self.rows["time"][-1]) if self.limit else 0.0
            self._count = self.limit
            raise TooManyRows(
                f"the run has more than {self.limit:,} events and plans that the clock anchors again, which "
                f"is the limit here; the first of them go up to time {time!r}: end there"
            )

    @property
    def rows(self) -> npt.NDArray[Any]:
        """The rows so far (dtype LOG); they are joined once, not at each reading."""
        if len(self._parts) > 1:
            self._parts = [np.concatenate(self._parts)]
        return self._parts[0]
