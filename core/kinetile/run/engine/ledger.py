"""The ledger of a run: what the loop logged, as contacts, as a fingerprint, and for whoever records it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import Clock
from kinetile.kernel.log import CONTACT, LOG
from kinetile.kernel.tables import MET, Kernel

__all__ = ["Ledger", "Recorder", "digestible"]

Recorder = Callable[[npt.NDArray[np.void]], None]
"""Called with the log rows (``kinetile.kernel.log.LOG``) of each chunk of a run."""


class Ledger:
    """Takes over the loop's log chunk by chunk.

    ``recorder``, where there is one, is given every row; ``unrecorded`` are rows that wait for the next one;
    ``rows`` is how many there have been; ``keep`` says whether contacts are kept at all.

    The loop writes contacts as they are digested, so that a chunk costs little more than its digest; they get
    their times as floats when somebody asks.
    """

    def __init__(self, clock: Clock, keep: bool) -> None:
        self.recorder: Recorder | None = None
        self.unrecorded: list[npt.NDArray[np.void]] = []
        self.rows = 0
        self._clock = clock
        self._keep = keep
        self._waiting: list[Any] = []
        self._kept = np.zeros(0, CONTACT)
        self._count = 0
        self._digest = hashlib.sha256()

    @property
    def contacts(self) -> npt.NDArray[np.void]:
        """All contacts so far, in canonical order."""
        if not self._keep:
            raise ValueError("this simulation keeps no contacts: it was made with keep_contacts=False")
        waiting, self._waiting = self._waiting, []
        if waiting:
            self._put(np.concatenate(waiting))
        contacts = self._kept[: self._count]
        contacts.flags.writeable = False
        return contacts

    @property
    def fingerprint(self) -> str:
        """Hex digest of (epoch, tick, a, b) of all contacts: it does not see the start of the clock."""
        return self._digest.hexdigest()

    def take(self, k: Kernel) -> None:
        """Take over what the loop has logged, and empty its log."""
        clock = k.clock[0]
        met = k.met[: int(clock.logged)]
        written = k.log[: int(clock.written)]
        self.rows = int(k.counts[0].logged)
        self._digest.update(met.view(np.uint8).data)
        if self._keep:
            self._waiting.append(met.copy())
        clock.logged = 0
        clock.written = 0
        if len(written) and self.recorder is not None:
            self.recorder(_rows(written, self._clock))

    def _put(self, met: Any) -> None:
        """Keep contacts; room is made by doubling, so that what was handed out before is never moved."""
        end = self._count + len(met)
        if end > len(self._kept):
            room = np.zeros(max(end, 2 * len(self._kept)), CONTACT)
            room[: self._count] = self._kept[: self._count]
            self._kept = room
        new = self._kept[self._count : end]
        for name in ("epoch", "tick", "a", "b"):
            new[name] = met[name]
        new["time"] = self._clock.rounded(met["epoch"], met["tick"])
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


def _rows(written: Any, clock: Clock) -> npt.NDArray[np.void]:
    """Return the log rows, with NaN for second bodies that do not exist."""
    rows = np.zeros(len(written), LOG)
    rows["time"], rows["epoch"], rows["tick"] = clock.split(written.tick)
    for name in ("a", "b", "ax", "ay", "avx", "avy"):
        rows[name] = written[name]
    for name in ("bx", "by", "bvx", "bvy"):
        rows[name] = np.where(written.b >= 0, written[name], np.nan)
    return rows


def digestible(contacts: npt.NDArray[np.void]) -> bytes:
    """Return what the fingerprint is made from, in an order of bytes that is the same everywhere."""
    exact = np.zeros(len(contacts), MET)
    for name in ("epoch", "tick", "a", "b"):
        exact[name] = contacts[name]
    return exact.tobytes()
