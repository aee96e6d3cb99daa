"""The accuracy report: its parts are measured one after the other, then written as a page and as data. The
page needs no script and no other file: first the verdict, a table of the claims; then each part."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any

from kinetile.cli.output import as_csv, as_json
from kinetile.errors import BadOption
from kinetile.instruments import figure, grid, paragraph, write_file
from kinetile.lazy import needed
from kinetile_accuracy.drawing import as_svg, house_style, save_figure
from kinetile_accuracy.sections import (
    Budget,
    Claim,
    Measure,
    ReportFigure,
    ReportProgress,
    Section,
    Table,
    cell,
)

PARTS: Mapping[str, str] = {
    "chart": "kinetile_accuracy.stepped.chart",
    "queries": "kinetile_accuracy.hard_cases.queries",
    "oracle": "kinetile_accuracy.oracle.horizon",
    "specification": "kinetile_accuracy.long_runs.whole_runs",
    "drift": "kinetile_accuracy.long_runs.drift",
}
"""The parts in the order of the page, each with the module that has its ``measure``."""


class AccuracyReport(list[Section]):
    """The measured sections; a notebook shows them with their tables and figures."""

    def _repr_html_(self) -> str:
        with house_style():
            return "\n".join(_body(self, lambda _, picture: as_svg(picture.draw())))


def measure_parts(
    budget: Budget = "normal",
    parts: Sequence[str] | None = None,
    *,
    progress: ReportProgress | None = None,
    finish: Callable[[Section], object] | None = None,
) -> AccuracyReport:
    """Measures parts of the report: names from ``PARTS``, None for all; ``finish`` gets each finished
    section. Raises BadOption for an unknown part, MissingExtra if ``oracle`` lacks python-flint."""
    check_parts(parts)
    sections = AccuracyReport()
    for name in PARTS if parts is None else parts:
        part: Measure = import_module(PARTS[name]).measure
        section = part(budget, progress or (lambda *_: None))
        sections.append(section)
        if finish is not None:
            finish(section)
    return sections


def check_parts(parts: Sequence[str] | None) -> None:
    """Raises BadOption for an unknown part."""
    for name in parts or ():
        if name not in PARTS:
            raise BadOption(f"the report has no part {name!r}; its parts are {', '.join(PARTS)}")


def check_packages(parts: Sequence[str] | None = None) -> None:
    """Raises BadOption for an unknown part, and MissingExtra if a part cannot be measured or drawn."""
    check_parts(parts)
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
    """Writes the page, its figures (SVG and PNG) and the rows of its tables (CSV) to a folder, which is made
    if it does not exist; returns the paths, the page ``accuracy.html`` first. ``conditions`` are the values
    of ``environment``. Raises MissingExtra without matplotlib, before it writes anything, and OSError."""
    check_packages(())
    sections, folder = list(sections), Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for section in sections:
        for table in section.tables:
            written.append(folder / f"{section.name}-{table.name}.csv")
            write_file(written[-1], as_csv(map(vars, table.rows)))

    def saved(section: Section, picture: ReportFigure) -> bytes:
        stem = folder / f"{section.name}-{picture.name}"
        paths = save_figure(picture.draw(), stem, picture.description)
        written.extend(paths)
        return paths[0].read_bytes()

    with house_style():
        page = _page(_body(sections, saved), sections, budget, conditions)
    target, data = folder / "accuracy.html", folder / "accuracy.json"
    parts = [section_as_dict(section) for section in sections]
    write_file(data, as_json({"budget": budget, "conditions": dict(conditions), "parts": parts}) + "\n")
    write_file(target, page)
    return [target, data, *written]


def section_as_dict(section: Section) -> dict[str, Any]:
    """Returns a section, with its rows, for ``as_json``."""
    claims = [claim._asdict() for claim in section.claims]
    tables = {table.name: list(map(vars, table.rows)) for table in section.tables}
    plain = {name: value for name, value in vars(section).items() if name != "pictures"}
    return plain | {"claims": claims, "tables": tables}


_STYLE = """\
body { font: 16px/1.45 system-ui, sans-serif; color: #111; }
main { max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
td, th { font-size: .82rem; border-bottom: 1px solid #ddd; }
a, summary { color: #0060a0; }
figure { margin: 1.4rem 0; }
figcaption { font-size: .9rem; color: #333; }
@media print { body { font-size: 10px; } figure, tr { break-inside: avoid; } }
"""


def _page(
    body: Iterable[str], sections: Sequence[Section], budget: Budget, conditions: Mapping[str, Any]
) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in conditions["versions"].items())
    machine = f"{conditions['processor']}, {conditions['processors']} processors, {conditions['system']}"
    how = f"<code>{command(budget, sections)}</code> on {escape(machine)}; {escape(versions)}."
    parts = "\n".join(body)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>kinetile: speed against error</title>
<style>
{_STYLE}</style>
</head>
<body>
<main>
<h1>kinetile: how fast, how right</h1>
{parts}
<p>Measured with {how}</p>
</main>
</body>
</html>
"""


def _body(sections: Sequence[Section], drawn: Callable[[Section, ReportFigure], bytes]) -> Iterator[str]:
    yield f"<p><strong>{verdict([claim for section in sections for claim in section.claims])}</strong></p>"
    held = [
        (section.name, claim.says, claim.measured, "holds" if claim.holds else "does not hold")
        for section in sections
        for claim in section.claims
    ]
    if held:
        yield grid("What must hold", ("part", "statement", "measured", "verdict"), held, (False,) * 4)
    yield "<ol>"
    yield from (f'<li><a href="#{section.name}">{escape(section.title)}</a></li>' for section in sections)
    yield "</ol>"
    for section in sections:
        yield f'<section id="{section.name}">\n<h2>{escape(section.title)}</h2>'
        yield from _list(section.findings)
        for picture in section.pictures:
            image = figure(drawn(section, picture), picture.caption, 1000)
            yield f"<figure>{image}<figcaption>{escape(picture.caption)}</figcaption></figure>"
        if section.about:
            yield paragraph(section.about)
        for table in section.tables:
            yield from _table(section, table) if table.rows else ()
        if section.left_out:
            yield paragraph("Left out:")
            yield from _list(section.left_out)
        yield "</section>"


def _list(sentences: Sequence[str]) -> Iterator[str]:
    if sentences:
        yield "\n".join(["<ul>", *(f"<li>{escape(sentence)}</li>" for sentence in sentences), "</ul>"])


def _table(section: Section, table: Table) -> Iterator[str]:
    meanings = [(each.head or f"{name} (in the file)", each.meaning) for name, each in table.columns.items()]
    title = f"All columns: {section.name}-{table.name}.csv"
    yield f"<details>\n<summary>{escape(table.caption)}</summary>"
    values = [[getattr(row, name) for name in table.heads] for row in table.rows]
    numbers = [any(type(each) in (int, float) for each in column) for column in zip(*values, strict=True)]
    yield grid(title, list(table.heads.values()), [list(map(cell, row)) for row in values], numbers)
    yield grid("The columns", ("column", "what it is"), meanings, (False, False))
    yield "</details>"


def command(budget: Budget, sections: Sequence[Section] = ()) -> str:
    """Returns the command that measures these parts within a budget."""
    words = ["kinetile accuracy"] + ([] if budget == "normal" else [f"--{budget}"])
    names = [section.name for section in sections]
    return " ".join(words + ([] if names == list(PARTS) else [f"--part {name}" for name in names]))


def verdict(claims: Sequence[Claim]) -> str:
    """Returns a sentence on all claims together."""
    fail = sum(not claim.holds for claim in claims)
    if not claims:
        return "Nothing was measured that could hold or fail."
    if fail:
        return f"{fail} of {len(claims)} statements do not hold in these measurements."
    return f"All {len(claims)} statements hold in these measurements."
