"""SHA-256 that can be saved half-way: the fingerprint of a run that keeps no contacts.

A fingerprint is SHA-256 over the rows of all contacts. Where contacts are kept, a saved run has the rows, and
hashing begins again from them. Where they are not kept, a saved run needs the state of the hash between two
blocks, which ``hashlib`` does not give away. Hashing in chained blocks would avoid that and change every
fingerprint, so the state is computed here: eight words, and what does not fill a block yet.

On a processor with instructions for SHA-256 this is as fast as ``hashlib``; elsewhere it is slower. The first
``AT_FIRST`` bytes are left to ``hashlib``, and kept as well, so a short run that is not saved does not need
the code, compiled or interpreted.
"""

from __future__ import annotations

import hashlib
import math
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import compose
from kinetile.kernel.tables import Kernel
from kinetile.kernel.vectors import sha256 as instructions

BLOCK = 64
AT_FIRST = 1 << 20

U = np.uint32
Words = npt.NDArray[np.uint32]
Bytes = npt.NDArray[np.uint8]


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
        self._at_first: Any = hashlib.sha256()  # None: beyond ``AT_FIRST``, or continued from a state
        self._words = INITIAL.copy()
        self._length = 0
        self._rest = bytearray()  # what the words have not taken in yet: less than a block, but at first

    def update(self, data: Any) -> None:
        """Goes on with a contiguous array of bytes."""
        content = memoryview(data).cast("B")
        self._length += len(content)
        if self._at_first is not None and self._length <= AT_FIRST:
            self._at_first.update(content)
            self._rest += content
            return
        self._at_first = None
        self._take_in()
        missing = -len(self._rest) % BLOCK
        self._rest += content[:missing]
        self._take_in()
        whole = max(len(content) - missing, 0) // BLOCK * BLOCK
        _take_in_blocks(self._words, content[missing : missing + whole])
        self._rest += content[missing + whole :]

    def copy(self) -> Sha256:
        """Returns another one, which stands where this one does."""
        other = Sha256()
        other._at_first = None if self._at_first is None else self._at_first.copy()
        other._words, other._length = self._words.copy(), self._length
        other._rest = self._rest.copy()
        return other

    def hexdigest(self) -> str:
        """Returns the digest of all that there was so far."""
        if self._at_first is not None:
            return str(self._at_first.hexdigest())
        zeros = bytes(-(len(self._rest) + 9) % BLOCK)
        last = self._rest + b"\x80" + zeros + (8 * self._length).to_bytes(8, "big")
        words = self._words.copy()
        _take_in_blocks(words, last)
        return words.astype(">u4").tobytes().hex()

    @property
    def state(self) -> tuple[str, int, str]:
        """The eight words so far, how many bytes there have been, and those that wait for a whole block."""
        self._take_in()
        return self._words.astype(">u4").tobytes().hex(), self._length, self._rest.hex()

    @classmethod
    def from_state(cls, words: str, length: int, waiting: str) -> Sha256:
        """Returns the hash that stood so; ValueError for what is no such state."""
        eight, rest = bytes.fromhex(words), bytes.fromhex(waiting)
        if len(eight) != 32 or not 0 <= length < 2**61 or len(rest) != length % BLOCK:
            raise ValueError("this is no state of SHA-256")
        new = cls()
        new._at_first, new._words = None, np.frombuffer(eight, ">u4").astype(np.uint32)
        new._length, new._rest = length, bytearray(rest)
        return new

    def _take_in(self) -> None:
        """Brings the words up to date: what is left does not fill a block."""
        whole = len(self._rest) // BLOCK * BLOCK
        _take_in_blocks(self._words, memoryview(self._rest)[:whole])
        self._rest = self._rest[whole:]


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


def _take_in_blocks(words: Words, content: bytes | bytearray | memoryview) -> None:
    """Takes whole blocks into the eight words."""
    if content:
        blocks = np.frombuffer(memoryview(content).toreadonly(), np.uint8)
        with np.errstate(over="ignore"):  # interpreted, sums of words wrap around as they are to
            compose(COMPRESS, {}, "sha256", Kernel)(words, blocks, ROUNDS)


def by_instructions(words: Words, blocks: Bytes, rounds: Words) -> None:
    """The compression function by instructions of the processor; a template."""
    instructions.take_in_blocks(words, blocks, rounds)


def in_portable_code(words: Words, blocks: Bytes, rounds: Words) -> None:
    """The compression function of SHA-256 (FIPS 180-4, 6.2.2), block after block; a template.

    ``x >> n | x << 32 - n`` is a rotation. Compiled, words are computed with 64 bits, and what is shifted
    beyond 32 of them is cut off with the sum. Rotations stand here written out because a hook for them is a
    call, which costs four times as much.
    """
    w = np.zeros(64, np.uint32)
    for start in range(0, len(blocks), BLOCK):
        for i in range(16):
            at = start + 4 * i
            x, y = U(blocks[at]) << U(24) | U(blocks[at + 1]) << U(16), U(blocks[at + 2]) << U(8)
            w[i] = U(x | y | U(blocks[at + 3]))
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


COMPRESS = by_instructions if instructions.HAS_SHA256 else in_portable_code
