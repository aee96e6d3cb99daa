"""The accuracy report: its parts are measured one after the other, then written as a page and as data.

The page is made from ``templates`` and needs nothing else: no script, no other file. The verdict comes first,
as a table of what must hold; then a list of the parts, and each part with its findings, figures and tables.
Figures are in the page twice, for wide and for narrow windows.
"""

from __future__ import annotations

import os
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from kinetile.cli.output import as_csv, as_json
from kinetile.errors import BadOption, MissingExtra
from kinetile.show.html import figure, grid, paragraph
from kinetile_accuracy.drawing import NARROW, as_svg, house_style, save_figure
from kinetile_accuracy.sections import (
    Budget,
    Claim,
    Measure,
    ReportFigure,
    ReportProgress,
    Section,
    Table,
    needed,
)

PARTS: Mapping[str, str] = {
    "chart": "kinetile_accuracy.stepped.chart",
    "queries": "kinetile_accuracy.hard_cases.queries",
    "oracle": "kinetile_accuracy.oracle.horizon",
    "specification": "kinetile_accuracy.long_runs.whole_runs",
    "drift": "kinetile_accuracy.long_runs.drift",
    "rates": "kinetile_accuracy.long_runs.rates",
}
"""The parts in the order of the page, each with the module whose ``measure`` does it."""


class AccuracyReport(list[Section]):
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
            parts += [_table_html(table) for table in section.tables if table.rows]
            parts += [part for picture in section.pictures for part in _figure_html(picture)]
        return "\n".join(parts)


def _table_html(table: Table) -> str:
    rows = table.cells
    texts = [[text for text, _ in row] for row in rows]
    return grid(table.caption, list(table.heads.values()), texts, [number for _, number in rows[0]])


def _figure_html(picture: ReportFigure) -> list[str]:
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
    progress: ReportProgress | None = None,
    finish: Callable[[Section], object] | None = None,
) -> AccuracyReport:
    """Measures parts of the report.

    Args:
        budget: how much is measured.
        parts: names from ``PARTS``; None for all.
        progress: called with the present measurement, the number of its finished steps, and their total.
        finish: called with each finished section; after Ctrl-C these sections are the report.

    A part that needs a package which is not installed becomes a section that says so.

    Raises:
        BadOption: there is no such part.
    """
    sections = AccuracyReport()
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
    """Shows no progress."""


def check_packages(parts: Sequence[str] | None = None) -> None:
    """Raises MissingExtra where the page cannot be made, or one of these parts not be measured."""
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
    """Writes the page, its figures (SVG and PNG) and the rows of its tables (CSV).

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
    sections, folder = list(sections), Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    images: dict[tuple[str, str, str], str] = {}
    for section in sections:
        for table in section.tables:
            written.append(folder / f"{section.name}-{table.name}.csv")
            written[-1].write_text(as_csv(map(vars, table.rows)), encoding="utf-8")
        for picture in section.pictures:
            stem = folder / f"{section.name}-{picture.name}"
            with house_style():
                svg, png = save_figure(picture.draw(), stem, picture.description)
            with house_style(NARROW):
                narrow = as_svg(picture.draw())
            written += svg, png
            images[section.name, picture.name, "wide"] = _embedded(svg.read_bytes())
            images[section.name, picture.name, "narrow"] = _embedded(narrow)
    data = folder / "accuracy.json"
    parts = [section_as_dict(section) for section in sections]
    data.write_text(
        as_json({"budget": budget, "conditions": dict(conditions), "parts": parts}) + "\n", "utf-8"
    )
    target = folder / "accuracy.html"
    target.write_text(_page(sections, images, budget, conditions), encoding="utf-8")
    return [target, data, *written]


def section_as_dict(section: Section) -> dict[str, Any]:
    """Returns a section for ``as_json``, its rows included."""
    return {
        "name": section.name,
        "title": section.title,
        "about": section.about,
        "claims": [claim._asdict() for claim in section.claims],
        "findings": list(section.findings),
        "left_out": list(section.left_out),
        "tables": {table.name: list(map(vars, table.rows)) for table in section.tables},
    }


# The page


def _page(
    sections: Sequence[Section],
    images: Mapping[tuple[str, str, str], str],
    budget: Budget,
    conditions: Mapping[str, Any],
) -> str:
    """Returns the page; ``images`` has each figure by its section, its picture, and "wide" or "narrow"."""
    jinja = needed("Writing the report", "Jinja2", "accuracy", "jinja2")
    environment = jinja.Environment(
        loader=jinja.PackageLoader("kinetile_accuracy"),
        autoescape=True,
        undefined=jinja.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    claims = [claim for section in sections for claim in section.claims]
    text: str = environment.get_template("page.html").render(
        sections=sections,
        claims=claims,
        verdict=verdict(claims),
        command=command(budget),
        conditions=conditions,
        images=images,
    )
    return text


def _embedded(svg: bytes) -> str:
    """Returns a picture as the address that a page embeds it by."""
    return "data:image/svg+xml;base64," + b64encode(svg).decode("ascii")


def command(budget: Budget) -> str:
    """Returns the command that measures within a budget."""
    return "kinetile accuracy" if budget == "normal" else f"kinetile accuracy --{budget}"


def verdict(claims: Sequence[Claim]) -> str:
    """Returns a sentence on all claims together."""
    fail = sum(not claim.holds for claim in claims)
    if not claims:
        return "Nothing was measured that could hold or fail."
    if fail:
        return f"{fail} of {len(claims)} statements do not hold in what was measured."
    return f"All {len(claims)} statements hold in what was measured."
