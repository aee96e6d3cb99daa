"""Eight numbers at once, for hooks: the vectors of the processor (``kinetile.kernel.vectors``).

``Floats``, ``Wholes``, ``Ticks`` and ``Truths`` have the usual operators; a lane is one of the eight.
Built-in phases use these for bounds of many partners, for certificates of several neighbours, and to copy
rows of cells.
"""

from __future__ import annotations

from kinetile.kernel.vectors import (
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
    lane,
    lowest_bit,
    number_in,
    numbered,
    numbers,
    pick,
    places,
    root,
    some,
    spread,
    spread_whole,
    to_floats,
    turned,
)

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
    "lane",
    "lowest_bit",
    "number_in",
    "numbered",
    "numbers",
    "pick",
    "places",
    "root",
    "some",
    "spread",
    "spread_whole",
    "to_floats",
    "turned",
]
