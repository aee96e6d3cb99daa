"""Sections of the accuracy report, the rows behind them, and the forms of their numbers and words.

A part measures something and returns a ``Section``. Its claims are statements that must hold, each with the
measured values; its findings are sentences made from the rows, the data behind the tables and the pictures.
The heading and the meaning of a column are at the field of the row::

    @dataclass(frozen=True)
    class LateClock:
        start: Annotated[float, Column("when the clock begins", "clock begins at")]
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar, get_type_hints

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Figure
else:
    Figure = Any  # matplotlib is an extra

Budget = Literal["quick", "normal", "full"]
"""The effort: the whole report takes about a minute, some minutes, or about half an hour."""

ReportProgress = Callable[[str, int, int], None]
"""Called with the present measurement, the number of its finished steps, and their total."""


class Column(NamedTuple):
    """The meaning of a row's field, and its heading on the page; without a heading it is only in the file."""

    meaning: str
    head: str = ""


@dataclass(frozen=True)
class Table:
    """Rows of one kind: the stem of their file, a caption, and instances of one frozen dataclass. Its fields
    are texts, numbers, truth values or None, each annotated with its ``Column``."""

    name: str
    caption: str
    rows: tuple[Any, ...]

    @property
    def columns(self) -> dict[str, Column]:
        """All columns, by the names of the fields."""
        fields = get_type_hints(type(self.rows[0]), include_extras=True) if self.rows else {}
        return {name: field.__metadata__[0] for name, field in fields.items()}

    @property
    def heads(self) -> dict[str, str]:
        """The headings of the fields that the page shows."""
        return {name: column.head for name, column in self.columns.items() if column.head}


@dataclass(frozen=True)
class ReportFigure:
    """A figure drawn from the rows: the stem of its file, a caption of a sentence or two, the function that
    draws it, and the subject of its rows, for the metadata of the file."""

    name: str
    caption: str
    draw: Callable[[], Figure]
    description: str = ""


class Claim(NamedTuple):
    """A statement that must hold, the measured value, and True if it holds there."""

    says: str
    measured: str
    holds: bool


@dataclass(frozen=True)
class Section:
    """A part of the report, by its name as in ``--part``: the measurement and its method, sentences made
    from the rows, and the parts that could not be measured, each with its reason."""

    name: str
    title: str
    about: str
    findings: tuple[str, ...]
    tables: tuple[Table, ...]
    pictures: tuple[ReportFigure, ...] = ()
    claims: tuple[Claim, ...] = ()
    left_out: tuple[str, ...] = ()


Measure = Callable[[Budget, ReportProgress], Section]
Row = TypeVar("Row")


def grouped(rows: Iterable[Row], *names: str) -> dict[Any, list[Row]]:
    """Returns rows by the value of a field, or by the values of several, in their order."""
    found: dict[Any, list[Row]] = {}
    for row in rows:
        key = tuple(getattr(row, name) for name in names)
        found.setdefault(key[0] if len(names) == 1 else key, []).append(row)
    return found


LEAST, MOST = 1e-3, 1e6
"""Numbers from the first to below the second are written as decimals."""


def number(value: float, digits: int = 2) -> str:
    """Returns a number in this many digits: a decimal, 0.25 or 1,200, or if very small or large 2.5e-15."""
    if value == 0.0:
        return "0"
    if not math.isfinite(value):
        return "–"
    if LEAST <= abs(value) < MOST:
        places = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
        text, power = f"{value:,.{places}f}", ""
    else:
        text, exponent = f"{value:.{digits - 1}e}".split("e")
        power = f"e{int(exponent)}"
    return (text.rstrip("0").rstrip(".") if "." in text else text) + power


def cell(value: Any) -> str:
    """Returns a value of a table in readable form, fractions to three digits."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    return number(value, 3) if isinstance(value, float) else str(value)


def listed(words: Sequence[str]) -> str:
    """Returns words as a list in a sentence: a, b and c."""
    return " and ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)
