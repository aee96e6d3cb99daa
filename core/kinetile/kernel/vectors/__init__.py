"""Eight numbers at once: what a hook may do with the vectors of the processor.

Loops over bodies compile to code that takes one body at a time. Where the same arithmetic is done for many,
the bound of a narrow phase for all partners of a body, eight at a time are three times as fast. Numba has no
vectors, so here are some: ``Floats`` (8 doubles), ``Wholes`` (8 32-bit integers), ``Ticks`` (8 64-bit
integers) and ``Truths`` (8 truth values), with the operators ``+ - * /``, ``< > <= >= ==``, ``& |`` and
``>>`` as far as they make sense, and the functions below. They are portable LLVM vectors: a machine with
shorter ones takes two or four steps, and gives the same bits, since each lane is IEEE arithmetic and nothing
is fused.

Interpreted, the same names are NumPy arrays of eight, and that is their meaning: each function is written
twice, and a test compares the two.
"""

from __future__ import annotations

from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.vectors.interpreted import (
    LANES,
    Floats,
    Ticks,
    Truths,
    Wholes,
    append,
    bits,
    choose,
    eight,
    fill,
    flights,
    floor,
    lane,
    lowest_bit,
    number_in,
    numbered,
    numbers,
    pick,
    places,
    prefetch,
    product_error,
    put_place,
    root,
    some,
    spread,
    spread_ticks,
    spread_whole,
    to_floats,
    turned,
)

if not INTERPRETED:
    from kinetile.kernel.vectors.intrinsics import COMPILED

    globals().update(COMPILED)

__all__ = [
    "LANES",
    "Floats",
    "Ticks",
    "Truths",
    "Wholes",
    "append",
    "bits",
    "choose",
    "eight",
    "fill",
    "flights",
    "floor",
    "lane",
    "lowest_bit",
    "number_in",
    "numbered",
    "numbers",
    "pick",
    "places",
    "prefetch",
    "product_error",
    "put_place",
    "root",
    "some",
    "spread",
    "spread_ticks",
    "spread_whole",
    "to_floats",
    "turned",
]
