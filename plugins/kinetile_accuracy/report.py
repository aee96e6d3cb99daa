"""The accuracy report: its parts are measured one after the other, then written as a page and as data."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption, MissingExtra
from kinetile.show.display.tables import figure, grid, paragraph
from kinetile_accuracy.drawing import NARROW, as_svg, house_style, save_figure
from kinetile_accuracy.page import Drawn, page, verdict
from kinetile_accuracy.parts import Budget, Measure, Picture, Progress, Section, Table, needed
from kinetile_accuracy.wording import cells

__all__ = ["PARTS", "Report", "check_packages", "measure_parts", "section_as_dict", "write_report"]

PARTS: Mapping[str, str] = {
    "chart": "kinetile_accuracy.stepped.section",
    "queries": "kinetile_accuracy.queries.section",
    "oracle": "kinetile_accuracy.certified.section",
    "answer": "kinetile_accuracy.answer.section",
    "drift": "kinetile_accuracy.long_runs.drift_section",
    "rates": "kinetile_accuracy.long_runs.rates",
}
"""The parts in the order of the page, each with the module whose ``measure`` does it."""


class Report(list[Section]):
    """The sections that were measured; a notebook shows them with their tables and figures."""

    def _repr_html_(self) -> str:
        claims = [claim for section in self for claim in section.claims]
        parts = [paragraph(verdict(claims))]
        for section in self:
            held = [(claim.says, claim.measured, "yes" if claim.holds else "no") for claim in section.claims]
            heads = ("what must hold", "measured", "holds")
            titled = grid(section.title, heads, held, (False, False, False))
            parts.append(titled if held else paragraph(section.title))
            parts += map(paragraph, filter(None, (section.about, *section.findings, *section.left_out)))
            parts += [_shown(table) for table in section.tables if table.rows]
            parts += [part for picture in section.pictures for part in _pictured(picture)]
        return "\n".join(parts)


def _shown(table: Table) -> str:
    columns = {name: [getattr(row, name) for row in table.rows] for name in table.heads}
    numbers = [not any(isinstance(value, str) for value in values) for values in columns.values()]
    texts = list(zip(*map(cells, columns.values()), strict=True))
    return grid(table.caption, list(table.heads.values()), texts, numbers)


def _pictured(picture: Picture) -> list[str]:
    try:
        with house_style():
            drawn = as_svg(picture.draw())
    except Exception as error:  # the rest is worth seeing all the same
        return [paragraph(f"{picture.name}: cannot be drawn: {error}")]
    return [figure(drawn, picture.caption, 720), paragraph(picture.caption)]


def measure_parts(
    budget: Budget = "normal",
    parts: Sequence[str] | None = None,
    *,
    progress: Progress | None = None,
    finish: Callable[[Section], object] | None = None,
) -> Report:
    """Measure parts of the report.

    Args:
        budget: how much is measured.
        parts: names from ``PARTS``; None for all.
        progress: told what is being measured, how many steps of it are done, and of how many.
        finish: told each section when it is there; after Ctrl-C those that were told are what there is.

    A part that needs a package which is not installed becomes a section that says so.

    Raises:
        BadOption: there is no such part.
    """
    sections = Report()
    for name in PARTS if parts is None else parts:
        if name not in PARTS:
            raise BadOption(f"the report has no part {name!r}; its parts are {', '.join(PARTS)}")
        part: Measure = import_module(PARTS[name]).measure
        try:
            section = part(budget, progress or _silent)
        except MissingExtra as error:
            section = Section(name, name, "", (), (), left_out=(str(error),))
        sections.append(section)
        if finish is not None:
            finish(section)
    return sections


def _silent(what: str, done: int, total: int) -> None:
    """Show no progress."""


def check_packages(parts: Sequence[str] | None = None) -> None:
    """Raise MissingExtra where the page cannot be made, or one of these parts not be measured."""
    needed("The report", "Jinja2", "accuracy", "jinja2")
    needed("The report", "matplotlib", "accuracy")
    if parts is None or "oracle" in parts:
        needed("The report's part oracle", "python-flint", "accuracy", "flint")


def write_report(
    sections: Iterable[Section],
    folder: str | os.PathLike[str],
    *,
    budget: Budget,
    conditions: Mapping[str, Any],
) -> list[Path]:
    """Write the page, its figures (SVG and PNG) and the rows of its tables (CSV).

    Args:
        sections: what was measured.
        folder: where to; made if it is not there.
        budget: how much was measured.
        conditions: versions and machine (``kinetile_accuracy.environment``).

    Returns:
        The paths, the page ``accuracy.html`` first.

    Raises:
        MissingExtra: Jinja2 or matplotlib is not installed; nothing is written.
        OSError: it cannot be written.
    """
    check_packages(())
    sections = list(sections)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    drawn: dict[tuple[str, str], Drawn] = {}
    for section in sections:
        for table in section.tables:
            written.append(_write_rows(table, folder / f"{section.name}-{table.name}.csv"))
        for picture in section.pictures:
            stem = folder / f"{section.name}-{picture.name}"
            with house_style():
                written += save_figure(picture.draw(), stem, picture.description)
            with house_style(NARROW):
                narrow = as_svg(picture.draw())
            drawn[section.name, picture.name] = Drawn(stem.with_name(f"{stem.name}.svg").read_bytes(), narrow)
    data = folder / "accuracy.json"
    found = {
        "budget": budget,
        "conditions": dict(conditions),
        "parts": [section_as_dict(s) for s in sections],
    }
    data.write_text(json.dumps(found, indent=1, default=str) + "\n", encoding="utf-8")
    target = folder / "accuracy.html"
    target.write_text(page(sections, drawn, budget, conditions), encoding="utf-8")
    return [target, data, *written]


def section_as_dict(section: Section) -> dict[str, Any]:
    """Return a section as what JSON can hold, its rows included."""
    return {
        "name": section.name,
        "title": section.title,
        "about": section.about,
        "claims": [claim._asdict() for claim in section.claims],
        "findings": list(section.findings),
        "left_out": list(section.left_out),
        "tables": {
            table.name: [{name: _plain(value) for name, value in vars(row).items()} for row in table.rows]
            for table in section.tables
        },
    }


def _plain(value: Any) -> Any:
    """Return a number that JSON has no name for as text."""
    return str(value) if isinstance(value, float) and not abs(value) < float("inf") else value


def _write_rows(table: Table, path: Path) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table.columns)
        writer.writerows([getattr(row, name) for name in table.columns] for row in table.rows)
    return path
