"""Tables as HTML, for a cell of a notebook: all text escaped, no script, no style sheet.

What stands in the attributes ``style`` goes with the table alone; colours are those of the page around it.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape

__all__ = ["facts", "figure", "grid", "paragraph"]

_LABEL = "text-align:left;vertical-align:top;padding:.15em .8em .15em 0;white-space:nowrap"
_CELL = "text-align:{side};vertical-align:top;padding:.15em .8em .15em 0"
_TABLE = '<table style="border-collapse:collapse;margin:.3em 0">'
_CAPTION = '<caption style="text-align:left;caption-side:top;padding:.2em 0;font-weight:bold">{}</caption>'


def facts(caption: str, rows: Iterable[tuple[str, str]]) -> str:
    """Return a table of what is so: a word in front of each line, and what is to be said of it."""
    lines = (
        f'<tr><th scope="row" style="{_LABEL}">{escape(label)}</th>'
        f'<td style="{_CELL.format(side="left")};overflow-wrap:anywhere">{escape(text)}</td></tr>'
        for label, text in rows
    )
    return "\n".join([_TABLE, _CAPTION.format(escape(caption)), *lines, "</table>"])


def grid(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[bool]) -> str:
    """Return a table with a head for each column; those of numbers stand at the right. It scrolls sideways
    where it is too wide."""
    sides = ["right" if number else "left" for number in numbers]

    def line(tag: str, texts: Sequence[str]) -> str:
        cells = (
            f'<{tag} style="{_CELL.format(side=side)}">{escape(text)}</{tag.split()[0]}>'
            for text, side in zip(texts, sides, strict=True)
        )
        return f"<tr>{''.join(cells)}</tr>"

    body = "\n".join([line('th scope="col"', heads), *(line("td", row) for row in rows)])
    return (
        f'<div style="overflow-x:auto">{_TABLE}\n{_CAPTION.format(escape(caption))}\n{body}\n</table></div>'
    )


def paragraph(text: str) -> str:
    """Return a sentence, its lines as they are."""
    return f'<p style="margin:.3em 0;white-space:pre-wrap;text-align:left">{escape(text)}</p>'


def figure(svg: bytes, words: str, width: int = 480) -> str:
    """Return a picture, at most so many pixels wide, with words for those who cannot see it.

    It is an image of its own: its style sheet and its names are no part of the page.
    """
    data = b64encode(svg).decode("ascii")
    return (
        f'<img alt="{escape(words)}" style="width:100%;max-width:{width}px;height:auto" '
        f'src="data:image/svg+xml;base64,{data}">'
    )
