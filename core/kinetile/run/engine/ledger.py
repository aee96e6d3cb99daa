"""Ledger of a run: its contacts, their fingerprint, and the rows for a recorder. Kept contacts are hashed,
and get their times as floats, when they are read, so that a chunk costs only a copy; contacts that are not
kept are hashed at once."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from kinetile.arrays import Rows
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.log import ACCELERATED, CONTACT, CONTACT_ROW, HELD, INSERTED, LOG, MOVED, Fingerprint
from kinetile.kernel.plan import Plan
from kinetile.kernel.tables import PAGE, ROW, Kernel, record_table
from kinetile.run.engine.fields import Fields
from kinetile.run.interrupts import Unbroken

KEPT_ROW = np.dtype([("when", "i8"), ("a", "i4"), ("b", "i4")])
"""A contact as it is kept until it is read, in 16 bytes: ``when`` counts ticks from the beginning of the
epoch of its chunk's first contact. A chunk is shorter than 1,024 epochs (``kernel.clock``)."""

LONG = 1 << 16
"""The number of contacts after which more of them are kept on large pages: getting pages of 4 KiB costs twice
as much as the copy (7 of 10 ns a contact). A short run does not take megabytes."""

AT_ONCE = 2 * PAGE // KEPT_ROW.itemsize - 4
"""Rows that fill two large pages, with the room that ``record_table`` adds."""

_NOTHING = nullcontext()

RowFunction = Callable[[Rows], None]
"""A function of rows of the log (``kinetile.kernel.log.LOG``), or of contacts."""


ContactRow = tuple[int, int, int, int]
"""A contact as the fingerprint reads it (``kinetile.kernel.log.CONTACT_ROW``): epoch, tick, a, b."""


class Entries(NamedTuple):
    """The contents of a ledger at one moment: the number of rows, the contacts (a read-only view; None if
    they are not kept), their digest, the rows that wait for a recorder, and the rows that wait for a step."""

    rows: int
    contacts: Rows | None
    digest: Fingerprint
    unrecorded: tuple[Rows, ...]
    pending_events: tuple[ContactRow, ...]


class Ledger:
    """Takes over the loop's log chunk by chunk.

    A recorder (``recording``) receives every row; rows of commands between two runs wait for the next one
    (``holds_rows``). ``rows`` is their total number; ``keeps`` is True if contacts are kept.
    ``pending_events`` are contacts that no step has returned yet (passings that begin at the start, or begin
    or end together with a command), None while a run passes all events. The last ``latest`` contacts are the
    first rows of ``k.met``. ``complete`` is False if an error has kept rows from a reader.
    """

    def __init__(self, clock: Clock, entries: Entries) -> None:
        self._recorder: RowFunction | None = None
        self._counter: RowFunction | None = None
        self._observer: RowFunction | None = None
        self.holds_rows = False
        self.complete = True
        self._clock = clock
        self.pending_events: list[ContactRow] | None = []
        self.latest = 0
        self._room = np.empty(0, KEPT_ROW)  # for contacts of later chunks
        self.entries = entries

    @property
    def entries(self) -> Entries:
        """The present contents, for a snapshot; the cost does not depend on the number of contacts."""
        contacts = self.contacts if self.keeps else None
        pending_events = tuple(self.pending_events or ())
        return Entries(self.rows, contacts, self._hashed().copy(), tuple(self._that_wait()), pending_events)

    @entries.setter
    def entries(self, entries: Entries) -> None:
        self.rows = entries.rows
        self.keeps = entries.contacts is not None
        if self.pending_events is not None:
            self.pending_events = list(entries.pending_events)
        self._unrecorded = list(entries.unrecorded)  # rows that wait, before the ones below
        # Rows, the clock's base that their ticks count from, and True if bodies were accelerated then.
        self._held: list[tuple[bytes, int, bool]] = []
        self._waiting: list[tuple[int, Any]] = []  # for each chunk its first epoch and kept rows
        self._kept = np.zeros(0, CONTACT) if entries.contacts is None else entries.contacts
        self._count = self._total = len(self._kept)  # contacts in one array, and all with the waiting ones
        self._chunks = 0  # the number of waiting chunks in the digest
        self._digest = entries.digest.copy()

    @property
    def contacts(self) -> Rows:
        """All contacts so far, in canonical order."""
        self._demand_kept()
        with Unbroken():
            self._hashed()
            waiting, self._waiting, self._chunks = self._waiting, [], 0
            self._put(waiting)
        contacts = self._kept[: self._count]
        contacts.flags.writeable = False
        return contacts

    def contacts_since(self, count: int) -> Rows:
        """Returns the contacts after the first ``count``; the cost depends only on the number of new ones:
        older ones are not moved to one array, whose growth would be noticeable in a frame."""
        self._demand_kept()
        if count < self._count or 2 * count < self._total:
            return self.contacts[count:]
        contacts = np.zeros(max(self._total - count, 0), CONTACT)
        missing, new = len(contacts), []
        for epoch, kept in reversed(self._waiting):
            if missing <= 0:
                break
            new.append((epoch, kept[max(len(kept) - missing, 0) :]))
            missing -= len(kept)
        self._fill(contacts, new[::-1])
        contacts.flags.writeable = False
        return contacts

    def _demand_kept(self) -> None:
        if not self.keeps:
            raise ValueError("this simulation keeps no contacts: it was made with keep_contacts=False")

    @property
    def fingerprint(self) -> str:
        """Hex digest of (epoch, tick, a, b) of all contacts: independent of the start of the clock."""
        return self._hashed().hexdigest()

    def _hashed(self) -> Fingerprint:
        if self._chunks < len(self._waiting):
            with Unbroken():
                for epoch, kept in self._waiting[self._chunks :]:
                    met = np.empty(len(kept), CONTACT_ROW)
                    met["epoch"] = (kept["when"] >> 52) + epoch
                    met["tick"] = kept["when"] & (TICKS - 1)
                    met.view("i8")[2::3] = kept.view("i8")[1::2]  # both numbers at once
                    self._digest.update(met.view(np.uint8).data)
                self._chunks = len(self._waiting)
        return self._digest

    @property
    def reads(self) -> bool:
        """True if the long rows of present events are read, or will be."""
        return self.holds_rows or self._recorder is not None or self._observer is not None

    @property
    def records(self) -> bool:
        """True if all rows of present events are kept, also of plans that the clock anchors again."""
        return self.holds_rows or self._recorder is not None

    @property
    def rows_that_wait(self) -> int:
        """The number of rows that wait for a recorder."""
        return sum(map(len, self._that_wait()))

    def recording(
        self,
        recorder: RowFunction | None,
        counter: RowFunction | None = None,
        observer: RowFunction | None = None,
    ) -> AbstractContextManager[None]:
        """A context that gives a recorder all rows, waiting ones first, ``observer`` the rows of the run, and
        ``counter`` the short rows of contacts (``kernel.log.CONTACT_ROW``), valid during the call."""
        waiting = [] if recorder is None else self._that_wait()
        self._unrecorded, self._held = [], []
        self._recorder, self._counter, self._observer = recorder, counter, observer
        nobody = recorder is counter is observer is None
        return _NOTHING if nobody else self._read(waiting)

    @contextmanager
    def _read(self, waiting: Sequence[Rows]) -> Iterator[None]:
        try:
            if self._recorder is not None:
                for rows in waiting:
                    self._recorder(rows)
            yield
        finally:
            self._recorder = self._counter = self._observer = None

    def take(self, k: Kernel, fields: Fields, rows: int) -> None:
        """Takes over the rows of the loop's log, a number since the start, and empties the log."""
        logged, written = fields.lists.logged[0], fields.lists.written[0]
        self.rows, self.latest, self.complete = rows, logged, not (logged or written)
        if self.complete:
            return
        fields.lists.logged[0] = fields.lists.written[0] = 0
        if logged and self.pending_events is not None:
            self.pending_events += np.asarray(k.met)[:logged].tolist()
        if logged:
            met = np.frombuffer(k.met, CONTACT_ROW, logged)
            if self.keeps:
                self._waiting.append(_kept(met, self._room_for(logged)))
                self._total += logged
            else:
                self._digest.update(met.view(np.uint8).data)
        if written:
            long, accelerated = np.frombuffer(k.log, ROW, written), "ax" in (k.bodies.dtype.names or ())
            if self._recorder is not None:
                self._recorder(_rows(long, self._clock, accelerated))
            elif self.holds_rows:
                self._held.append((long.tobytes(), self._clock.base, accelerated))
            if self._observer is not None:
                self._observer(_rows(long, self._clock, accelerated))
        else:  # these contacts are missing: waiting rows are not their beginning
            self._unrecorded, self._held = [], []
        if logged and self._counter is not None:
            self._counter(np.asarray(k.met)[:logged])
        self.complete = True

    def _room_for(self, rows: int) -> Rows:
        if self._total < LONG:
            return np.empty(rows, KEPT_ROW)
        if rows > len(self._room):
            self._room = record_table(KEPT_ROW, max(AT_ONCE, rows)).view(np.ndarray)
        room, self._room = self._room[:rows], self._room[rows:]
        return room

    def _put(self, waiting: list[tuple[int, Any]]) -> None:
        """Keeps contacts; the array grows by doubling, and a view that was returned is never moved."""
        if not waiting:
            return  # restored contacts are read-only
        end = self._total
        if end > len(self._kept):
            room = np.zeros(max(end, 2 * len(self._kept)), CONTACT)
            room[: self._count] = self._kept[: self._count]
            self._kept = room
        self._fill(self._kept[self._count : end], waiting)
        self._count = end

    def _fill(self, contacts: Rows, waiting: list[tuple[int, Any]]) -> None:
        begin = 0
        for epoch, kept in waiting:
            rows = contacts[begin : begin + len(kept)]
            rows["epoch"] = (kept["when"] >> 52) + epoch
            rows["tick"] = kept["when"] & (TICKS - 1)
            rows["a"], rows["b"] = kept["a"], kept["b"]
            begin += len(kept)
        contacts["time"] = self._clock.rounded(contacts["epoch"], contacts["tick"])

    def _that_wait(self) -> list[Rows]:
        aside, self._held = self._held, []
        for rows, base, accelerated in aside:
            clock = replace(self._clock, base=base)
            self._unrecorded.append(_rows(np.frombuffer(rows, ROW), clock, accelerated))
        return self._unrecorded


def _kept(met: Any, kept: Any) -> tuple[int, Any]:
    """Writes a shorter row for each contact of a chunk to ``kept``; returns the first epoch and the rows."""
    first = int(met["epoch"][0])
    when = kept["when"]  # without temporary arrays, which would double the cost
    np.subtract(met["epoch"], first, out=when)
    np.multiply(when, TICKS, out=when)
    np.add(when, met["tick"], out=when)
    kept.view("i8")[1::2] = met.view("i8")[2::3]  # both numbers at once
    return first, kept


def _rows(written: Any, clock: Clock, accelerated: bool) -> Rows:
    """Returns the log rows, with NaN for second bodies that do not exist."""
    rows = np.zeros(len(written), LOG)
    rows["time"], rows["epoch"], rows["tick"] = clock.split(written["tick"])
    rows["a"], rows["b"] = written["a"], written["b"]
    for name in Plan._fields:
        rows[f"a{name}"] = written[f"a{name}"]
        has = written["b"] >= 0
        if accelerated and name in "xy":
            has |= np.isin(written["b"], (INSERTED, ACCELERATED, HELD, MOVED))
        rows[f"b{name}"] = np.where(has, written[f"b{name}"], np.nan)
    return rows
