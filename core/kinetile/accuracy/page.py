"""The accuracy report as one self-contained page: no script, no other file, fit to print."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from kinetile.accuracy.parts import Budget, Section, Table

__all__ = ["page"]

_LOOK = """
body { font: 15px/1.45 system-ui, sans-serif; color: #111; }
body { max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; margin-bottom: .2rem; } h2 { font-size: 1.25rem; margin-top: 2.4rem; }
ul.findings li { margin: .35rem 0; font-weight: 600; }
table { border-collapse: collapse; font-size: .82rem; margin: .6rem 0 1.2rem; }
th { text-align: left; vertical-align: bottom; border-bottom: 1.5px solid #111; }
th { padding: .25rem .7rem .25rem 0; }
td { border-bottom: 1px solid #ddd; padding: .2rem .7rem .2rem 0; font-variant-numeric: tabular-nums; }
td.number, th.number { text-align: right; }
caption { text-align: left; padding: .3rem 0; color: #333; }
.wide { overflow-x: auto; } figure { margin: 1rem 0; } figure img { width: 100%; height: auto; }
figcaption, .about, .left { color: #333; } code { font-size: .85em; background: #f3f3f3; padding: .1em .3em; }
@media print { body { margin: 0; max-width: none; font-size: 10px; } figure, tr { break-inside: avoid; } }
"""


def page(
    sections: Sequence[Section],
    drawn: Mapping[tuple[str, str], Path],
    budget: Budget,
    conditions: Mapping[str, Any],
) -> str:
    """Return the page.

    Args:
        sections: what was measured, in order.
        drawn: the SVG file of each figure, by the names of its section and picture; the page takes them in.
        budget: how much was measured.
        conditions: versions and machine.
    """
    versions = ", ".join(f"{name} {number}" for name, number in conditions.get("versions", {}).items())
    machine = f"{conditions.get('processor', '')}, {conditions.get('processors', '?')} processors"
    body = [
        "<h1>kinetile: how fast, how right</h1>",
        f'<p class="about">{escape(machine)}, {escape(str(conditions.get("system", "")))}; '
        f"{escape(versions)}; measured with <code>{command(budget)}</code>.</p>",
    ]
    for section in sections:
        body += _section(section, drawn, budget)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>kinetile: speed against '
        f"error</title>\n<style>{_LOOK}</style>\n</head>\n<body>\n" + "\n".join(body) + "\n</body>\n</html>\n"
    )


def _section(section: Section, drawn: Mapping[tuple[str, str], Path], budget: Budget) -> list[str]:
    parts = [f'<h2 id="{escape(section.name)}">{escape(section.title)}</h2>']
    if section.findings:
        parts.append(_items("findings", section.findings))
    for picture in section.pictures:
        file = drawn.get((section.name, picture.name))
        if file is not None:
            parts.append(
                f'<figure><img alt="{escape(picture.caption)}" src="data:image/svg+xml;base64,'
                f'{b64encode(file.read_bytes()).decode("ascii")}"><figcaption>{escape(picture.caption)}'
                "</figcaption></figure>"
            )
        else:
            parts.append(f'<p class="left">Not drawn for want of matplotlib: {escape(picture.caption)}</p>')
    if section.about:
        parts.append(f'<p class="about">{escape(section.about)}</p>')
    parts += [_table(section, table) for table in section.tables]
    if section.left_out:
        parts += ['<p class="left">Left out:</p>', _items("left", section.left_out)]
    parts.append(f"<p><code>{command(budget)} --part {escape(section.name)}</code></p>")
    return parts


def command(budget: Budget) -> str:
    """Return the command that measures within a budget."""
    return "kinetile accuracy" if budget == "normal" else f"kinetile accuracy --{budget}"


def _items(kind: str, texts: Sequence[str]) -> str:
    return f'<ul class="{kind}">' + "".join(f"<li>{escape(text)}</li>" for text in texts) + "</ul>"


def _table(section: Section, table: Table) -> str:
    columns = {
        name: any(
            isinstance(getattr(row, name), int | float) and not _truth(getattr(row, name))
            for row in table.rows
        )
        for name in table.heads
    }
    heads = "".join(f"<th{_number(columns[name])}>{escape(head)}</th>" for name, head in table.heads.items())
    rows = "".join(
        "<tr>"
        + "".join(
            f"<td{_number(number)}>{escape(shown(getattr(row, name)))}</td>"
            for name, number in columns.items()
        )
        + "</tr>"
        for row in table.rows
    )
    return (
        f'<div class="wide"><table><caption>{escape(table.caption)} All columns: '
        f"<code>{escape(section.name)}-{escape(table.name)}.csv</code></caption>"
        f"<thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _truth(value: Any) -> bool:
    return isinstance(value, bool)


def _number(number: bool) -> str:
    return ' class="number"' if number else ""


def shown(value: Any) -> str:
    """Return a value as people read it: three digits of a fraction, whole numbers in full."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        whole = value.is_integer() or abs(value) >= 1000.0
        return f"{value:,.0f}" if whole and abs(value) < 1e6 else f"{value:.3g}"
    return str(value)
