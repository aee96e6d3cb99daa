"""What an event file says of its own contents, so that a reader can tell whether they were written so."""

from __future__ import annotations

import hashlib
from typing import Any

from numpy.typing import NDArray

from kinetile.kernel.log import LOG, TURNED
from kinetile.run.engine.ledger import digestible

__all__ = ["Seal"]

_EVERYWHERE = LOG.newbyteorder("<")


class Seal:
    """Grows with the rows of a file, in their order.

    It tells of damage and of mistakes, not of malice: whoever changes a file can seal it anew.
    """

    def __init__(self) -> None:
        self._contacts = hashlib.sha256()
        self._rows = hashlib.sha256()

    def add(self, rows: NDArray[Any]) -> None:
        """Go on with the next rows (dtype LOG)."""
        self._contacts.update(digestible(rows[rows["b"] > TURNED]))
        self._rows.update(rows.astype(_EVERYWHERE, copy=False).tobytes())

    @property
    def fingerprint(self) -> str:
        """The fingerprint of the contacts, as a simulation has it."""
        return self._contacts.hexdigest()

    def digest(self, *texts: str) -> str:
        """Hex digest of all bits of the rows and of these texts."""
        whole = self._rows.copy()
        for text in texts:
            whole.update(hashlib.sha256(text.encode()).digest())
        return whole.hexdigest()
