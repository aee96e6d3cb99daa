"""Eight numbers at once: the processor's vectors, for hooks.

The same arithmetic for many bodies is three times as fast if done for eight at a time. Numba has no vectors,
so this package has some: ``Floats`` (8 doubles), ``Wholes`` (8 32-bit integers), ``Ticks`` (8 64-bit
integers) and ``Truths`` (8 truth values), with the operators ``+ - * /``, ``< > <= >= ==``, ``& |`` and
``>>`` as far as they make sense, and the functions below. They are portable LLVM vectors: a machine with
shorter vectors takes two or four steps, and gives the same bits, since each lane is IEEE arithmetic and
nothing is fused.

Called from Python, the same names are NumPy arrays of eight, which define their meaning: each function is
written twice, here and in ``intrinsics``, and a test compares the two.
"""

import math
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from kinetile.kernel.compiled.backend import both
from kinetile.kernel.plan import Plan

LANES = 8
_ONES = np.ones(LANES)
COLUMNS: tuple[str, ...] = (*Plan._fields, "anchor", "reach")

Floats: TypeAlias = Any
Wholes: TypeAlias = Any
Ticks: TypeAlias = Any
Truths: TypeAlias = Any


def spread(value: float) -> Floats:
    """Returns eight times the same number."""
    return _ONES * value


def spread_whole(value: int) -> Wholes:
    """Returns eight times the same whole number."""
    return np.full(LANES, value, dtype=np.int32)


def numbers(table: Any, first: int) -> Wholes:
    """Returns ``table[first:first + 8]`` of an array of int32."""
    return np.array(table[first : first + LANES], dtype=np.int32)


def fill(table: Any, first: int, value: int) -> None:
    """Writes a number to ``table[first:first + 8]`` of an array of int32."""
    table[first : first + LANES] = value


def numbered(value: Floats, first: int) -> Floats:
    """Returns numbers >= 2^-1000 with first, first + 1, ... (0 to 63) in their last six bits: each becomes
    less, by less than 2^-45 of it."""
    places = np.arange(first, first + LANES)
    return ((np.ascontiguousarray(value).view(np.int64) & -64) + (places - 64)).view(np.float64)


def number_in(value: float) -> int:
    """Returns the last six bits of a number."""
    return int(np.float64(value).view(np.int64)) & 63


def root(value: Floats) -> Floats:
    """Returns the square roots, correctly rounded; NaN for a negative number."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(value)


def choose(where: Truths, yes: Any, no: Any) -> Any:
    """Returns ``yes`` in the lanes where ``where`` is true, else ``no``."""
    return np.where(where, yes, no)


def lane(value: Any, which: int) -> Any:
    """Returns one of the eight lanes."""
    return value[which]


def turned(value: Any, by: int) -> Any:
    """Returns the lanes rotated: lane i has the value of lane i xor ``by`` (1, 2 or 4)."""
    return value[np.arange(LANES) ^ by]


def followed(value: Any) -> Any:
    """Returns the lanes moved by one: lane i has the value of lane i + 1, and the last the first's."""
    return np.roll(value, -1)


def append(source: Any, first: int, target: Any, end: int) -> int:
    """Copies eight numbers, ``source[first:first + 8]``, to ``target[end:end + 8]``; returns the last.

    Both are arrays of int32. One load and one store; so seven numbers may be copied that do not count.
    """
    target[end : end + LANES] = source[first : first + LANES]
    return int(source[first + LANES - 1])


def prefetch(table: Any, row: int) -> None:
    """Prefetches the cache line of a table's row, without waiting."""


def product_error(a: float, b: float, product: float) -> float:
    """Returns a * b - product, for the rounded product, rounded once, as a fused multiply-add does it: exact
    unless a part of the product would be subnormal."""
    a, b, product = float(a), float(b), float(product)
    if not math.isfinite(product):
        return -product if math.isfinite(a) and math.isfinite(b) else math.nan
    if a == 0.0 or b == 0.0:
        return 0.0
    if max(abs(a), abs(b)) < 2.0**900 and abs(product) > 2.0**-900:  # nothing below is rounded
        (a, a_low), (b, b_low) = _halves(a), _halves(b)
        rest = ((product - a * b) - a_low * b) - a * b_low
        return a_low * b_low - rest + 0.0  # a fused operation never returns -0.0 here
    return float(Fraction(a) * Fraction(b) - Fraction(product))


def _halves(value: float) -> tuple[float, float]:
    """Returns the upper and the lower half of a double's digits, after Veltkamp and Dekker (1971)."""
    shifted = 134217729.0 * value
    high = shifted - (shifted - value)
    return high, value - high


def lowest_bit(word: int) -> int:
    """Returns the place of the lowest set bit in a word of 64; the word is not zero."""
    word = int(word)
    return (word & -word).bit_length() - 1


def eight(a: int, b: int, c: int, d: int, e: int, f: int, g: int, h: int) -> Wholes:
    """Returns eight whole numbers as a vector."""
    return np.array([a, b, c, d, e, f, g, h], dtype=np.int32)


def spread_ticks(value: int) -> Ticks:
    """Returns eight times the same tick."""
    return np.full(LANES, value, dtype=np.int64)


def flights(
    table: Any, a: int, b: int, c: int, d: int, e: int, f: int, g: int, h: int
) -> tuple[Floats, Floats, Floats, Floats, Ticks, Floats]:
    """Returns x, y, vx, vy, anchor and reach of eight bodies."""
    rows = table[[a, b, c, d, e, f, g, h]]
    x, y, vx, vy, anchor, reach = (np.array(rows[name]) for name in COLUMNS)
    return x, y, vx, vy, anchor, reach


def places(table: Any, names: Any, first: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Returns the four columns of the rows ``names[first:first + 8]`` of a table of four doubles a row: for a
    table of places x, y, vx, vy."""
    rows = table[names[first : first + LANES]]
    x, y, vx, vy = (np.array(rows[name]) for name in table.dtype.names)
    return x, y, vx, vy


def put_place(table: Any, number: int, x: float, y: float, vx: float, vy: float) -> None:
    """Writes a row of a table of places in one piece, so that a later load need not wait for parts."""
    table[number] = (x, y, vx, vy)


def pick(table: Any, names: Any, first: int) -> Floats:
    """Returns the entries ``names[first:first + 8]`` of an array of doubles."""
    return np.array(table[names[first : first + LANES]])


def to_floats(value: Ticks | Wholes) -> Floats:
    """Returns ticks or whole numbers as doubles, rounded to nearest."""
    return np.asarray(value, dtype=np.float64)


def floor(value: Floats) -> Ticks:
    """Returns doubles, each smaller than 2^63 in size, rounded down."""
    return np.floor(value).astype(np.int64)


def bits(value: Truths) -> int:
    """Returns a word with the bit of each true lane set."""
    return sum(1 << i for i in range(LANES) if value[i])


def some(value: Truths) -> bool:
    """Returns True if any lane is true."""
    return bool(value.any())


from kinetile.kernel.vectors.intrinsics import COMPILED  # noqa: E402 - it needs the names above

for _name, _made in COMPILED.items():
    globals()[_name] = both(globals()[_name])(_made)
