"""SHA-256 that can be saved half-way: the fingerprint of a run that keeps no contacts.

A fingerprint is SHA-256 over the rows of all contacts. Where contacts are kept, a saved run has the rows, and
hashing begins again from them. Where they are not kept, a saved run needs the state of the hash between two
blocks, which ``hashlib`` does not give away. Hashing in chained blocks would avoid that and change every
fingerprint, so the state is computed here: eight words, and what does not fill a block yet.

``hashlib`` does the work for as long as it can, for it is some eight times as fast. What it has hashed since
the state was last brought up to date waits, at most ``MOST_WAITING`` bytes, so a short run that is not saved
never pays for the state. A run that was resumed has no object of ``hashlib`` and gets its digest from the
state.
"""

from __future__ import annotations

import hashlib
import math
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import compose
from kinetile.kernel.tables import Kernel

BLOCK = 64
MOST_WAITING = 1 << 22

U = np.uint32
Words = npt.NDArray[np.uint32]


class Digest(Protocol):
    """What the ledger needs of a hash."""

    def update(self, data: Any, /) -> None:
        """Goes on with a contiguous array of bytes."""

    def copy(self) -> Digest:
        """Returns another one, which stands where this one does."""

    def hexdigest(self) -> str:
        """Returns the digest of all that there was so far."""


class Sha256:
    """SHA-256, as ``hashlib.sha256()``, with a ``state`` that can be saved and continued from."""

    def __init__(self) -> None:
        self._fast: Any = hashlib.sha256()
        self._words = INITIAL.copy()
        self._length = 0
        self._waiting: list[bytes] = []  # what the words have not taken in yet
        self._many = 0  # bytes that wait

    def update(self, data: Any) -> None:
        """Goes on with a contiguous array of bytes."""
        content = bytes(data)
        if self._fast is not None:
            self._fast.update(content)
        self._waiting.append(content)
        self._length += len(content)
        self._many += len(content)
        if self._many > MOST_WAITING:
            self._take_in()

    def copy(self) -> Sha256:
        """Returns another one, which stands where this one does."""
        other = Sha256()
        other._fast = None if self._fast is None else self._fast.copy()
        other._words, other._length = self._words.copy(), self._length
        other._waiting, other._many = self._waiting.copy(), self._many
        return other

    def hexdigest(self) -> str:
        """Returns the digest of all that there was so far."""
        if self._fast is not None:
            return str(self._fast.hexdigest())
        rest = self._take_in()
        zeros = bytes(-(len(rest) + 9) % BLOCK)
        last = rest + b"\x80" + zeros + (8 * self._length).to_bytes(8, "big")
        words = self._words.copy()
        _take_in_blocks(words, last)
        return words.astype(">u4").tobytes().hex()

    @property
    def state(self) -> tuple[str, int, str]:
        """The eight words so far, how many bytes there have been, and those that wait for a whole block."""
        rest = self._take_in()
        return self._words.astype(">u4").tobytes().hex(), self._length, rest.hex()

    @classmethod
    def from_state(cls, words: str, length: int, waiting: str) -> Sha256:
        """Returns the hash that stood so; ValueError for what is no such state."""
        eight, rest = bytes.fromhex(words), bytes.fromhex(waiting)
        if len(eight) != 32 or not 0 <= length < 2**61 or len(rest) != length % BLOCK:
            raise ValueError("this is no state of SHA-256")
        new = cls()
        new._fast, new._words = None, np.frombuffer(eight, ">u4").astype(np.uint32)
        new._length, new._waiting, new._many = length, [rest], len(rest)
        return new

    def _take_in(self) -> bytes:
        """Brings the words up to date, and returns what waits for a whole block."""
        content = b"".join(self._waiting)
        whole = len(content) // BLOCK * BLOCK
        _take_in_blocks(self._words, memoryview(content)[:whole])
        rest = content[whole:]
        self._waiting, self._many = [rest], len(rest)
        return rest


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in found):
            found.append(number)
        number += 1
    return found


def _root_bits(number: int, power: int) -> int:
    """Returns the first 32 bits of the fractional part of a square root, or a cube root."""
    if power == 2:
        return math.isqrt(number << 64) & 0xFFFFFFFF
    low, high = 0, 1 << 36  # all roots are below 2^4, and get 32 bits more
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if middle**3 <= number << 96 else (low, middle - 1)
    return low & 0xFFFFFFFF


INITIAL: Words = np.array([_root_bits(prime, 2) for prime in _primes(8)], np.uint32)
ROUNDS: Words = np.array([_root_bits(prime, 3) for prime in _primes(64)], np.uint32)


def _take_in_blocks(words: Words, content: bytes | memoryview) -> None:
    """Takes whole blocks into the eight words."""
    if content:
        blocks = np.frombuffer(content, "<u4").astype(np.uint32, copy=False)
        with np.errstate(over="ignore"):  # interpreted, sums of words wrap around as they are to
            compose(compress, {}, "sha256", Kernel)(words, blocks, ROUNDS)


def compress(words: Words, blocks: Words, rounds: Words) -> None:
    """The compression function of SHA-256 (FIPS 180-4, 6.2.2), block after block; a template.

    ``x >> n | x << 32 - n`` is a rotation. Compiled, words are computed with 64 bits, and what is shifted
    beyond 32 of them is cut off with the sum. Rotations stand here written out because a hook for them is a
    call, which costs four times as much (47 against 220 MB/s).
    """
    w = np.zeros(64, np.uint32)
    for start in range(0, len(blocks), 16):
        for i in range(16):
            x = blocks[start + i]  # little-endian, and SHA-256 has its words the other way round
            w[i] = U(x >> U(24) | (x >> U(8) & U(0xFF00)) | (x << U(8) & U(0xFF0000)) | x << U(24))
        for i in range(16, 64):
            x = w[i - 15]
            y = w[i - 2]
            low = (x >> U(7) | x << U(25)) ^ (x >> U(18) | x << U(14)) ^ (x >> U(3))
            high = (y >> U(17) | y << U(15)) ^ (y >> U(19) | y << U(13)) ^ (y >> U(10))
            w[i] = U(w[i - 16] + low + w[i - 7] + high)
        a, b, c, d = words[0], words[1], words[2], words[3]
        e, f, g, h = words[4], words[5], words[6], words[7]
        for i in range(64):
            mixed = (e >> U(6) | e << U(26)) ^ (e >> U(11) | e << U(21)) ^ (e >> U(25) | e << U(7))
            one = U(h + mixed + (g ^ (e & (f ^ g))) + rounds[i] + w[i])
            mixed = (a >> U(2) | a << U(30)) ^ (a >> U(13) | a << U(19)) ^ (a >> U(22) | a << U(10))
            two = U(mixed + ((a & b) | (c & (a | b))))
            h, g, f = g, f, e
            e = U(d + one)
            d, c, b = c, b, a
            a = U(one + two)
        for i, word in enumerate((a, b, c, d, e, f, g, h)):
            words[i] += word
