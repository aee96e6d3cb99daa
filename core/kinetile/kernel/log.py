"""The format of a run's results: contacts, and the log rows that make the whole trajectory.

The exact time of a row is ``start + (epoch + tick * 2**-52) * time_unit``: ``epoch`` counts whole units since
the scene's start, ``tick`` is the fraction in ticks of 2**-52 (0 <= tick < 2**52). ``time`` is that number
rounded to a float.
"""

import hashlib
from typing import Self

import numpy as np

from kinetile.arrays import Rows
from kinetile.kernel.plan import FIELDS_OF_TWO

ANSWER = 7
"""The number of the specification that the contacts follow (docs/specification.md); it changes with every
rule. Event files without a number are of answer 0, from before there was a specification."""

LEFT, RIGHT, BOTTOM, TOP = -1, -2, -3, -4
TURNED, REANCHORED, INSERTED, REMOVED, ACCELERATED, HELD, OF_KIND, MOVED = range(-5, -13, -1)
WALLS = {LEFT: "left", RIGHT: "right", BOTTOM: "bottom", TOP: "top"}
"""The walls by their numbers as partners of a contact."""

CONTACT = np.dtype([("time", "f8"), ("epoch", "i8"), ("tick", "i8"), ("a", "i4"), ("b", "i4")])
"""One contact: body ``a`` with body ``b`` > a, or with a wall (-1 left, -2 right, -3 bottom, -4 top).

For two bodies that pass through each other it is the beginning; the end is a row with 0 <= ``b`` < ``a``."""

CONTACT_ROW = np.dtype([("epoch", "<i8"), ("tick", "<i8"), ("a", "<i4"), ("b", "<i4")])
"""One contact as the fingerprint reads it, and as the loop writes it."""

LOG = np.dtype(
    [
        *((name, CONTACT[name]) for name in CONTACT.names or ()),
        *((name, "f8") for name in FIELDS_OF_TWO.split()),
    ]
)
"""One event that changed a flight plan: as CONTACT, and for ``b``: -5 a turn, -6 a re-anchoring that keeps
the velocity, -7 an inserted body, -8 a removed one, with its last plan, -9 a new acceleration, -10 a body
that supports hold or let go, after the row of the event that does so if there is one, -11 a new kind, -12 a
new place; then position and velocity of both bodies right after it (NaN for ``b`` without a second body, and
for both if they begin or end to pass through each other: no plan changes). Along a periodic axis a position
is the one nearest to 0, from minus half a period to half of it. If bodies are accelerated, rows of -7, -9,
-10 and -12 have the present acceleration in the place of ``b``'s position."""


def digestible(contacts: Rows) -> bytes:
    """Returns the input of the fingerprint, in an order of bytes that is the same everywhere."""
    exact = np.zeros(len(contacts), CONTACT_ROW)
    for name in CONTACT_ROW.names or ():
        exact[name] = contacts[name]
    return exact.tobytes()


IN_BLOCK = 4096
"""Rows in a block of the fingerprint's chain."""


class Fingerprint:
    """The fingerprint of a list of contacts, row by row (docs/specification.md, rule 10).

    A chain of SHA-256: each block of ``IN_BLOCK`` rows is hashed behind the digest of the blocks before it,
    and so are the last rows, 1 to ``IN_BLOCK`` of them. So a long run only has to save one digest and the
    rows of the open block; and for a short run the fingerprint is the plain SHA-256 of its rows. Two lists
    have the same input only if they are the same: a digest is 32 bytes, which is no number of rows of 24.

    Attributes:
        chain: the digest of all whole blocks before the open one; empty in the first.
        rows: the bytes of the open block's rows.
    """

    def __init__(self, chain: bytes = b"", rows: bytes = b"") -> None:
        self.chain = chain
        self.rows = bytearray(rows)

    def update(self, rows: bytes | memoryview) -> None:
        """Adds rows, in the form of ``CONTACT_ROW``."""
        self.rows += rows
        begin, block = 0, IN_BLOCK * CONTACT_ROW.itemsize
        while len(self.rows) - begin > block:
            self.chain = hashlib.sha256(self.chain + self.rows[begin : begin + block]).digest()
            begin += block
        del self.rows[:begin]

    def copy(self) -> Self:
        """Returns another one with the same rows."""
        return type(self)(self.chain, bytes(self.rows))

    def hexdigest(self) -> str:
        """Returns the fingerprint of all rows so far, 64 hexadecimal digits."""
        return hashlib.sha256(self.chain + self.rows).hexdigest()
