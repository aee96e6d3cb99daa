"""The benchmarks' results as tables for people."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any

from rich.table import Table

from kinetile.cli.tables import empty_table, rows_table
from kinetile_bench.events import Bench
from kinetile_bench.growth import Growth
from kinetile_bench.measures import NOT_MEASURED, Fit, Mean, Spread
from kinetile_bench.thesis_statements.statements import Statement

__all__ = [
    "events_table",
    "exponents_table",
    "growth_table",
    "measures_notes",
    "measures_table",
    "rates_table",
    "statements_table",
    "time_table",
]

Rows = Sequence[Mapping[str, Any]]

_MEASURES = (
    "updates_per_event",
    "updates_in_theory",
    "asked_per_contact",
    "computed_per_contact",
    "bound_per_contact",
    "bound_per_pair_change",
    "pair_change_in_theory",
    "queue_per_body",
    "pairs_per_body",
    "pairs_in_theory",
)


def rates_table(bench: Bench) -> Table:
    """Return the rates of a benchmark, one row for each phase on each scene."""
    heads = (
        "> discs",
        "> density",
        "| broad phase",
        "> million events\n/ CPU s",
        "| slowest ..\nfastest",
        "> thousand contacts\n/ CPU s",
        "> of the\nfastest",
        "> events\n/ contact",
        "> asked\n/ contact",
        "> exact\n/ contact",
    )
    rows = [
        (
            f"{row.bodies:,}",
            f"{row.density:g}",
            row.phase,
            f"{row.events_per_cpu_second / 1e6:.2f}",
            f"{row.slowest / 1e6:.2f} .. {row.fastest / 1e6:.2f}",
            f"{row.contacts_per_cpu_second / 1e3:,.1f}",
            f"{row.of_fastest:.2f}",
            f"{row.events_per_contact:.2f}",
            f"{row.asked_per_contact:.1f}",
            f"{row.computed_per_contact:.2f}",
        )
        for row in bench.rows
    ]
    return rows_table(heads, rows, shared=2)


def time_table(rows: Rows) -> Table:
    """Return the CPU time of each phase on each scene (figure 23): median over seeds, and the extremes.

    The last column is how many times as long a phase's slowest round took as its fastest, at most.
    """
    phases = list(dict.fromkeys(row["phase"] for row in rows))
    table = empty_table("> density", "> discs", *(f"> {phase}" for phase in phases), "> unrest")
    for scene, group in _by_scene(rows, table):
        found = {row["phase"]: Spread(**row["cpu_seconds_per_time"]) for row in group}
        fastest = min(found, key=lambda phase: found[phase].median)
        marks = {phase: "*" if phase == fastest else " " for phase in phases}
        cells = [_milliseconds(found[phase]) + marks[phase] if phase in found else "" for phase in phases]
        table.add_row(*scene, *cells, f"{max(row['unrest'] for row in group):.2f}")
    return table


def events_table(rows: Rows) -> Table:
    """Return numbers and shares of events of each kind (figure 24), the queue and the candidate pairs."""
    table = empty_table(
        "> density",
        "> discs",
        "| broad phase",
        "> bound\nevents",
        "> ±",
        "> in\ntheory",
        "> coll.",
        "> wall",
        "> bound\n%",
        "> coll.\n%",
        "> wall\n%",
        "> queue",
        "> pairs",
    )
    for scene, group in _by_scene(rows, table):
        for place, row in enumerate(group):
            bound = Mean(**row["bound_events_per_time"])
            contacts = [row[f"{kind}_per_time"]["mean"] for kind in ("contacts_disc", "contacts_wall")]
            kinds = ("bound_events", "contacts_disc", "contacts_wall")
            table.add_row(
                *(scene if place == 0 else ("", "")),
                row["phase"],
                f"{bound.mean:,.0f}",
                _or_dash(bound.error, ",.0f"),
                _or_dash(row["bound_events_in_theory"], ",.0f"),
                *(f"{each:,.0f}" if place == 0 else "" for each in contacts),
                *(f"{100.0 * row[f'share_{kind}']['mean']:.1f}" for kind in kinds),
                f"{row['queue_max']:,}",
                f"{row['pairs_mean']:,.1f}",
            )
    return table


def exponents_table(rows: Rows) -> Table:
    """Return the fitted exponents of CPU time and bound events over n."""
    fits = [Fit(**fit) for fit in rows[0]["cpu_seconds"]]
    over = [f"{fit.first} to {fit.last}" for fit in fits]
    heads = [f"> {what}\n{each}" for what in ("CPU time", "bound events", "in theory") for each in over]
    cells = [
        (
            f"{row['density']:g}",
            row["phase"],
            *(_exponent(Fit(**fit)) for kind in ("cpu_seconds", "bound_events") for fit in row[kind]),
            *(_or_dash(each, ".2f") for each in row["bound_events_in_theory"]),
        )
        for row in rows
    ]
    return rows_table(("> density", "broad phase", *heads), cells, shared=1)


def measures_table(rows: Rows) -> Table:
    """Return the four measures of a kinetic data structure, measured and in theory, for the largest n."""
    table = empty_table(
        "> density",
        "| broad phase",
        "> updates\n/ event",
        "> at\nmost",
        "> asked\n/ contact",
        "> exact\n/ contact",
        "> bound\n/ contact",
        "> bound /\npair change",
        "> in\ntheory",
        "> queue\n/ n",
        "> pairs\na body",
        "> in\ntheory",
        "> at\nmost",
    )
    largest = max(row["bodies"] for row in rows)
    for scene, group in _by_scene([row for row in rows if row["bodies"] == largest], table):
        for place, row in enumerate(group):
            found = row["measures"]
            table.add_row(
                scene[0] if place == 0 else "",
                row["phase"],
                *(_or_dash(found[name], ".3g") for name in _MEASURES),
                f"{found['pairs_of_one_body']:,}",
            )
    return table


def measures_notes() -> list[str]:
    """Return what the columns of ``measures_table`` are, and what is not measured."""
    return [
        "responsiveness: certificates set anew for one event; for one contact, partners that were looked at "
        "and contact times worked out exactly",
        "efficiency: bound events for one contact, and for one candidate pair that comes or goes",
        "compactness: bodies in the queue over n",
        "locality: candidate pairs that a body is in: on average, and the most, of the moments looked at",
        *(f"not measured: {each}" for each in NOT_MEASURED),
    ]


def statements_table(found: Iterable[Statement]) -> Table:
    """Return the thesis's statements, whether they hold, and the numbers that decide it."""
    table = empty_table("| ", "verdict", "statement, and the numbers that decide it")
    for statement in found:
        lines = [statement.text]
        for part in statement.parts:
            lines.append(f"  {part.answer.mark} {part.text}: {part.numbers}")
        table.add_row(statement.name, statement.verdict.replace(": ", ":\n"), "\n".join(lines))
    return table


def growth_table(growth: Growth) -> Table:
    """Return one row for each number of discs."""
    heads = (
        "> discs",
        "> set-up\ns",
        "> CPU s / unit\nof time",
        "> fastest-\nslowest",
        "> exponent\nsince",
        "> thousand contacts\n/ CPU s",
        "> events\n/ contact",
        "> peak bytes\n/ disc",
        "> of tables",
    )
    rows = [
        (
            f"{row.bodies:,}",
            f"{row.setup_seconds:.2f}",
            f"{row.cpu_seconds_per_time:.4g}",
            f"{row.fastest:.4g}-{row.slowest:.4g}",
            _or_dash(exponent, ".2f"),
            f"{row.contacts_per_cpu_second / 1e3:,.0f}",
            f"{row.events_per_contact:.2f}",
            _or_dash(row.peak_bytes_per_body, ",.0f"),
            f"{row.table_bytes_per_body:,.0f}",
        )
        for row, exponent in zip(growth.rows, [None, *growth.steps], strict=True)
    ]
    return rows_table(heads, rows)


def _by_scene(rows: Rows, table: Table) -> Iterable[tuple[tuple[str, str], list[Mapping[str, Any]]]]:
    """Yield the rows scene by scene, with what stands in the first two columns, and part the densities."""
    last = None
    for (density, bodies), group in groupby(rows, key=lambda row: (row["density"], row["bodies"])):
        if last not in (None, density):
            table.add_section()
        yield (f"{density:g}" if density != last else "", f"{bodies:,}"), list(group)
        last = density


def _milliseconds(found: Spread) -> str:
    return f"{1e3 * found.median:.3g} ({1e3 * found.low:.3g}-{1e3 * found.high:.3g})"


def _exponent(fit: Fit) -> str:
    if fit.exponent is None:
        return "-"
    return f"{fit.exponent:.2f}" + (f" ± {fit.error:.2f}" if fit.error is not None else "")


def _or_dash(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
