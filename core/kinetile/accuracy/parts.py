"""What a part of the accuracy report gives: findings, tables, pictures.

A part measures something and returns a ``Section``. Its findings are sentences made from the rows, so that
they say what was found this time, whichever way it went. The rows are the data behind the tables and the
pictures, and are written beside the page.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Budget", "Measure", "Picture", "Progress", "Section", "Table"]

Budget = Literal["quick", "normal", "full"]
"""How much is measured: for the whole report in about a minute, in some minutes, or in half an hour or so."""

Progress = Callable[[str, int, int], None]
"""Told what is being measured, how many steps of it are done, and how many there are."""


@dataclass(frozen=True)
class Table:
    """Rows of one kind.

    Attributes:
        name: the stem of the file that they are written to.
        caption: what they are, in a sentence.
        rows: instances of one frozen dataclass whose fields are text, numbers, truths or None.
        heads: the fields that the page shows, each with its heading; all are in the file.
    """

    name: str
    caption: str
    rows: tuple[Any, ...]
    heads: dict[str, str]


@dataclass(frozen=True)
class Picture:
    """A figure drawn from the rows.

    Attributes:
        name: the stem of its file.
        caption: what is seen, in a sentence or two.
        draw: returns the figure; called only where matplotlib is installed.
    """

    name: str
    caption: str
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class Section:
    """A part of the report.

    Attributes:
        name: the word by which the part is asked for.
        title: its heading.
        about: what was measured and how, in a paragraph.
        findings: sentences made from the rows.
        tables, pictures: what to show.
        left_out: what could not be measured, each with its reason.
    """

    name: str
    title: str
    about: str
    findings: tuple[str, ...]
    tables: tuple[Table, ...]
    pictures: tuple[Picture, ...] = ()
    left_out: tuple[str, ...] = ()


Measure = Callable[[Budget, Progress], Section]
"""A part: measures within a budget."""
