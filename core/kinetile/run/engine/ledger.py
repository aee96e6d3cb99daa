"""The ledger of a run: what the loop logged, as contacts, as a fingerprint, and for whoever records it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import Clock
from kinetile.kernel.log import CONTACT, LOG, TURNED
from kinetile.kernel.tables import Kernel

__all__ = ["Ledger", "Recorder", "digestible"]

Recorder = Callable[[npt.NDArray[np.void]], None]
"""Called with the log rows (``kinetile.kernel.log.LOG``) of each chunk of a run."""


class Ledger:
    """Takes over the loop's log chunk by chunk.

    ``recorder``, where there is one, is given every row; ``unrecorded`` are rows that wait for the next one;
    ``rows`` is how many there have been; ``keep`` says whether contacts are kept at all.
    """

    def __init__(self, clock: Clock, keep: bool) -> None:
        self.recorder: Recorder | None = None
        self.unrecorded: list[npt.NDArray[np.void]] = []
        self.rows = 0
        self._clock = clock
        self._keep = keep
        self._kept = np.zeros(0, CONTACT)
        self._count = 0
        self._digest = hashlib.sha256()

    @property
    def contacts(self) -> npt.NDArray[np.void]:
        """All contacts so far, in canonical order."""
        if not self._keep:
            raise ValueError("this simulation keeps no contacts: it was made with keep_contacts=False")
        contacts = self._kept[: self._count]
        contacts.flags.writeable = False
        return contacts

    @property
    def fingerprint(self) -> str:
        """Hex digest of (epoch, tick, a, b) of all contacts: it does not see the start of the clock."""
        return self._digest.hexdigest()

    def take(self, k: Kernel) -> None:
        """Take over what the loop has logged, and empty its log."""
        header = k.clock[0]
        if header.logged == 0:
            return
        raw = k.log[: int(header.logged)]
        self.rows += len(raw)
        time, epoch, tick = self._clock.split(raw.tick)
        columns = {"time": time, "epoch": epoch, "tick": tick, "a": raw.a, "b": raw.b}
        met = raw.b > TURNED
        contacts = np.zeros(int(met.sum()), CONTACT)
        for name, column in columns.items():
            contacts[name] = column[met]
        rows = _rows(raw, columns) if self.recorder is not None else None
        self._digest.update(digestible(contacts))
        if self._keep:
            self._put(contacts)
        header.logged = 0
        if rows is not None and self.recorder is not None:
            self.recorder(rows)

    def _put(self, contacts: npt.NDArray[np.void]) -> None:
        """Keep contacts; room is made by doubling, so that what was handed out before is never moved."""
        end = self._count + len(contacts)
        if end > len(self._kept):
            room = np.zeros(max(end, 2 * len(self._kept)), CONTACT)
            room[: self._count] = self._kept[: self._count]
            self._kept = room
        self._kept[self._count : end] = contacts
        self._count = end

    def hand_over(self) -> None:
        """Give the rows that waited, those of turns made between two runs, to the recorder."""
        waiting, self.unrecorded = self.unrecorded, []
        begin = getattr(self.recorder, "begin", None)
        if begin is not None:  # an event file says how many rows came before it
            begin(self.rows - sum(map(len, waiting)))
        if self.recorder is not None:
            for rows in waiting:
                self.recorder(rows)


def _rows(raw: Any, columns: dict[str, Any]) -> npt.NDArray[np.void]:
    """Return the log rows, with NaN for second bodies that do not exist."""
    rows = np.zeros(len(raw), LOG)
    for name, column in columns.items():
        rows[name] = column
    for name in ("ax", "ay", "avx", "avy"):
        rows[name] = raw[name]
    for name in ("bx", "by", "bvx", "bvy"):
        rows[name] = np.where(raw.b >= 0, raw[name], np.nan)
    return rows


def digestible(contacts: npt.NDArray[np.void]) -> bytes:
    """Return what the fingerprint is made from, in an order of bytes that is the same everywhere."""
    exact = np.zeros(len(contacts), [("epoch", "<i8"), ("tick", "<i8"), ("a", "<i4"), ("b", "<i4")])
    for name in ("epoch", "tick", "a", "b"):
        exact[name] = contacts[name]
    return exact.tobytes()
