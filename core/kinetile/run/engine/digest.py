"""SHA-256 that can be stopped and taken up again: the fingerprint of a run that keeps no contacts.

Python's own digests cannot be written down half-way. The state of SHA-256 is no secret, though: eight words,
how much has been read, and what of the last block is waiting. OpenSSL, of which Python's ``hashlib`` is made,
shows it (``SHA256_CTX`` in its public header), as fast as ``hashlib`` itself. Where that cannot be reached,
in a Python that was built with no OpenSSL beside it, say, ``digest`` returns one of ``hashlib``, which goes
on in this process only. Every process tries it out before it trusts it.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib
from functools import cache
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["Digest", "StoppableSha256", "digest", "stoppable"]

_BLOCK = 64


class Digest(Protocol):
    """What the ledger asks of a digest."""

    def update(self, data: Any, /) -> None:
        """Go on with a contiguous array of bytes."""

    def copy(self) -> Digest:
        """Return another one, which stands where this one does."""

    def hexdigest(self) -> str:
        """Return the digest of all that there was so far."""


class _Context(ctypes.Structure):
    """OpenSSL's ``SHA256_CTX``."""

    _fields_ = (
        ("h", ctypes.c_uint32 * 8),
        ("low", ctypes.c_uint32),
        ("high", ctypes.c_uint32),
        ("data", ctypes.c_uint32 * 16),
        ("num", ctypes.c_uint),
        ("md_len", ctypes.c_uint),
    )


class StoppableSha256:
    """SHA-256, as ``hashlib.sha256()``, with a ``state`` that can be written down and gone on from."""

    def __init__(self) -> None:
        self._context = _Context()
        self._call("SHA256_Init")

    def update(self, data: npt.NDArray[np.uint8]) -> None:
        """Go on with a contiguous array of bytes."""
        self._call("SHA256_Update", ctypes.c_void_p(data.ctypes.data), ctypes.c_size_t(data.nbytes))

    def copy(self) -> StoppableSha256:
        """Return another one, which stands where this one does."""
        other = StoppableSha256()
        ctypes.memmove(
            ctypes.byref(other._context), ctypes.byref(self._context), ctypes.sizeof(self._context)
        )
        return other

    def hexdigest(self) -> str:
        """Return the digest of all that there was so far."""
        found = ctypes.create_string_buffer(32)
        last = self.copy()  # the end is put to this one, and this one goes on
        if not getattr(_library(), "SHA256_Final")(found, ctypes.byref(last._context)):  # noqa: B009
            raise OSError("SHA256_Final of OpenSSL has failed")
        return found.raw.hex()

    @property
    def state(self) -> tuple[str, int, str]:
        """The eight words so far, how many bits were read, and the bytes that wait for a whole block."""
        at = self._context
        waiting = ctypes.string_at(ctypes.addressof(at) + _Context.data.offset, at.num)
        words = np.array(at.h[:], ">u4").tobytes()
        return words.hex(), (at.high << 32) + at.low, waiting.hex()

    @classmethod
    def from_state(cls, words: str, bits: int, waiting: str) -> StoppableSha256:
        """Return the digest that stood so; ValueError for what is no such state."""
        new = cls()
        eight, rest = bytes.fromhex(words), bytes.fromhex(waiting)
        if len(eight) != 32 or not 0 <= bits < 2**64 or len(rest) != bits // 8 % _BLOCK or bits % 8:
            raise ValueError("this is no state of SHA-256")
        at = new._context
        at.h[:] = np.frombuffer(eight, ">u4").tolist()
        at.high, at.low = divmod(bits, 2**32)
        at.num = len(rest)
        ctypes.memmove(ctypes.addressof(at) + _Context.data.offset, rest, len(rest))
        return new

    def _call(self, name: str, *arguments: Any) -> None:
        if not getattr(_library(), name)(ctypes.byref(self._context), *arguments):
            raise OSError(f"{name} of OpenSSL has failed")


def digest() -> Digest:
    """Return a SHA-256 whose state can be written down where there is one, else one of ``hashlib``."""
    return StoppableSha256() if stoppable() else hashlib.sha256()


@cache
def stoppable() -> bool:
    """Whether there is a SHA-256 here whose state can be written down: tried out, against ``hashlib``."""
    try:
        _library()
        text = np.arange(200, dtype=np.uint8)
        for cut in (0, 1, 63, 64, 65, 200):
            tried = StoppableSha256()
            tried.update(text[:cut])
            tried = StoppableSha256.from_state(*tried.state)
            tried.update(text[cut:])
            if tried.hexdigest() != hashlib.sha256(text.tobytes()).hexdigest():
                return False
    except (ImportError, OSError, AttributeError, ValueError):
        return False
    return True


@cache
def _library() -> Any:
    """Return the library that ``hashlib`` computes with: its names are found through Python's own module."""
    return ctypes.CDLL(str(importlib.import_module("_hashlib").__file__))
