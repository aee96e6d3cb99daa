"""How the report writes numbers: one notation on the page, in its tables and in its sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

__all__ = ["cells", "listed", "number", "scientific"]

LEAST, MOST = 1e-3, 1e6
"""Numbers from the one to below the other are written as decimals."""


def number(value: float, digits: int = 2) -> str:
    """Return a number in so many digits: as a decimal, 0.25 or 1,200, or very small or large as 2.5e-15."""
    if value == 0.0:
        return "0"
    if not math.isfinite(value):
        return "–"
    if not LEAST <= abs(value) < MOST:
        return scientific(value, digits)
    places = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return _without_zeros(f"{value:,.{places}f}")


def scientific(value: float, digits: int = 2) -> str:
    """Return a number in so many digits times a power of ten: 2.5e-15."""
    if value == 0.0 or not math.isfinite(value):
        return number(value)
    digits_, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{_without_zeros(digits_)}e{int(exponent)}"


def cells(values: Sequence[Any]) -> list[str]:
    """Return a column of a table as people read it, all its fractions in one notation, to three digits."""
    sizes = [abs(value) for value in values if isinstance(value, float) and value and math.isfinite(value)]
    write = scientific if sizes and not LEAST <= min(sizes) <= max(sizes) < MOST else number
    return [_cell(value, write) for value in values]


def listed(words: Sequence[str]) -> str:
    """Return words as a list in a sentence: a, b and c."""
    return " and ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)


def _cell(value: Any, write: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    return str(write(value, 3)) if isinstance(value, float) else str(value)


def _without_zeros(text: str) -> str:
    return text.rstrip("0").rstrip(".") if "." in text else text
