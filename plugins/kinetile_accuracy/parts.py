"""What a part of the accuracy report gives: claims, findings, tables, pictures.

A part measures something and returns a ``Section``. Its claims are what must hold, with what was found; its
findings are sentences made from the rows, so that they say what was found this time, whichever way it went.
The rows are the data behind the tables and the pictures, and are written beside the page. What a column is
called and means stands once, at the field of the row::

    @dataclass(frozen=True)
    class Clock:
        start: Annotated[float, Column("when the clock begins", "clock begins at")]
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar, get_type_hints

from kinetile.errors import MissingExtra

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "Budget",
    "Claim",
    "Column",
    "Measure",
    "Picture",
    "Progress",
    "Section",
    "Table",
    "columns_of",
    "grouped",
    "needed",
]

Budget = Literal["quick", "normal", "full"]
"""How much is measured: for the whole report in about a minute, in some minutes, or in half an hour or so."""

Progress = Callable[[str, int, int], None]
"""Told what is being measured, how many steps of it are done, and how many there are."""


class Column(NamedTuple):
    """What a field of a row means, and its heading on the page; without one it is in the file alone."""

    meaning: str
    head: str = ""


def columns_of(row: type) -> dict[str, Column]:
    """Return the columns of a class of rows, by the names of its fields."""
    hints = get_type_hints(row, include_extras=True)
    return {field.name: hints[field.name].__metadata__[0] for field in fields(row)}


@dataclass(frozen=True)
class Table:
    """Rows of one kind.

    Attributes:
        name: the stem of the file that they are written to.
        caption: what they are, in a sentence.
        rows: instances of one frozen dataclass whose fields are text, numbers, truths or None, each annotated
            with its ``Column``.
        printed: whether the command prints it too, and not only the page.
    """

    name: str
    caption: str
    rows: tuple[Any, ...]
    printed: bool = False

    @property
    def columns(self) -> dict[str, Column]:
        """All columns, by the names of the fields."""
        return columns_of(type(self.rows[0])) if self.rows else {}

    @property
    def heads(self) -> dict[str, str]:
        """The headings of the fields that the page shows."""
        return {name: column.head for name, column in self.columns.items() if column.head}


@dataclass(frozen=True)
class Picture:
    """A figure drawn from the rows.

    Attributes:
        name: the stem of its file.
        caption: what is seen, in a sentence or two.
        draw: returns the figure, as wide as ``kinetile_accuracy.drawing.house_style`` says.
        description: what its rows are of, for the metadata of the file.
    """

    name: str
    caption: str
    draw: Callable[[], Figure]
    description: str = ""


class Claim(NamedTuple):
    """What must hold, what was measured, and whether it holds in that."""

    says: str
    measured: str
    holds: bool


@dataclass(frozen=True)
class Section:
    """A part of the report.

    Attributes:
        name: the word by which the part is asked for.
        title: its heading.
        about: what was measured and how, in a paragraph.
        findings: sentences made from the rows.
        tables, pictures: what to show.
        claims: what must hold, for the summary.
        left_out: what could not be measured, each with its reason.
    """

    name: str
    title: str
    about: str
    findings: tuple[str, ...]
    tables: tuple[Table, ...]
    pictures: tuple[Picture, ...] = ()
    claims: tuple[Claim, ...] = ()
    left_out: tuple[str, ...] = ()


Measure = Callable[[Budget, Progress], Section]
"""A part: measures within a budget."""

Row = TypeVar("Row")


def grouped(rows: Iterable[Row], *names: str) -> dict[Any, list[Row]]:
    """Return rows by the value of a field, or by the values of several, in the order in which they come."""
    found: dict[Any, list[Row]] = {}
    for row in rows:
        key = tuple(getattr(row, name) for name in names)
        found.setdefault(key[0] if len(names) == 1 else key, []).append(row)
    return found


def needed(purpose: str, package: str, extra: str, module: str = "") -> Any:
    """Return the module of an optional package; MissingExtra where it is not installed."""
    try:
        return import_module(module or package)
    except ImportError as error:
        raise MissingExtra(purpose, package, extra) from error
