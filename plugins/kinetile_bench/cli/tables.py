"""Results of benchmarks and studies as printed tables, for each kind of result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import singledispatch
from typing import Any

from rich.table import Table

from kinetile.cli.output import rows_table
from kinetile.errors import legible
from kinetile_bench.counters import CountersBench
from kinetile_bench.events import Bench
from kinetile_bench.frames import PARTS, FrameBench
from kinetile_bench.growth import Growth
from kinetile_bench.study import Study
from kinetile_bench.study_run import StudyStatus
from kinetile_bench.user_scene import Chosen, SceneBench

Rows = Sequence[Mapping[str, Any]]
Column = tuple[str, Callable[[Any], str]]
"""The head of a column as ``kinetile.cli.output`` has it, and the text of a row in it."""


@singledispatch
def printed_parts(found: Any) -> list[Any]:
    """Returns the tables and lines that a command prints of a result."""
    raise TypeError(f"there are no tables for {type(found).__name__}")


def column_table(rows: Iterable[Any], *columns: Column, shared: int = 0) -> Table:
    """Returns a table of rows by its columns; the first ``shared`` columns leave out what repeats."""
    return rows_table(
        [head for head, _ in columns], [[cell(row) for _, cell in columns] for row in rows], shared
    )


@printed_parts.register
def _events(bench: Bench) -> list[Any]:
    """The rates of all phases, one row for each phase on each scene."""
    where = bench.conditions
    table = column_table(
        bench.rows,
        ("> discs", lambda row: f"{row.bodies:,}"),
        ("> density", lambda row: f"{row.density:g}"),
        ("| broad phase", lambda row: row.phase),
        ("> million events\n/ CPU s", lambda row: f"{row.events_per_cpu_second / 1e6:.2f}"),
        ("| slowest ..\nfastest", lambda row: f"{row.slowest / 1e6:.2f} .. {row.fastest / 1e6:.2f}"),
        ("> thousand contacts\n/ CPU s", lambda row: f"{row.contacts_per_cpu_second / 1e3:,.1f}"),
        ("> of the\nfastest", lambda row: f"{row.of_fastest:.2f}"),
        ("> events\n/ contact", lambda row: f"{row.events_per_contact:.2f}"),
        ("> asked\n/ contact", lambda row: f"{row.asked_per_contact:.1f}"),
        ("> exact\n/ contact", lambda row: f"{row.computed_per_contact:.2f}"),
        shared=2,
    )
    seconds = f"about {where['seconds']:g} CPU s each"
    return [table, f"{where['processor']}; medians of {where['repeats']} runs of {seconds}"]


@printed_parts.register
def _growth(growth: Growth) -> list[Any]:
    """One row for each number of discs."""
    rows, where = growth.rows, growth.conditions
    exponents = dict(zip((row.bodies for row in rows), [None, *growth.steps], strict=True))
    table = column_table(
        rows,
        ("> discs", lambda row: f"{row.bodies:,}"),
        ("> set-up\ns", lambda row: f"{row.setup_seconds:.2f}"),
        ("> CPU s / unit\nof time", lambda row: f"{row.cpu_seconds_per_time:.4g}"),
        ("> fastest-\nslowest", lambda row: f"{row.fastest:.4g}-{row.slowest:.4g}"),
        ("> exponent\nsince", lambda row: or_dash(exponents[row.bodies], ".2f")),
        ("> thousand contacts\n/ CPU s", lambda row: f"{row.contacts_per_cpu_second / 1e3:,.0f}"),
        ("> events\n/ contact", lambda row: f"{row.events_per_contact:.2f}"),
        ("> peak bytes\n/ disc", lambda row: or_dash(row.peak_bytes_per_body, ",.0f")),
        ("> of tables", lambda row: f"{row.table_bytes_per_body:,.0f}"),
    )
    lines = [f"{growth.phase} at density {growth.density:g}; {where['processor']}"]
    if growth.exponent is not None:
        lines.append(
            f"CPU time for a unit of simulated time grows as n^{growth.exponent:.2f} "
            f"from {rows[0].bodies:,} to {rows[-1].bodies:,} discs"
        )
    arrays = ", ".join(f"{name} {size:.0f}" for name, size in rows[-1].arrays.items())
    return [table, *lines, f"bytes a disc in tables, {rows[-1].bodies:,} discs: {arrays}"]


@printed_parts.register
def _frames(bench: FrameBench) -> list[Any]:
    """The cost of a frame, one row a phase."""
    names = ("median", "p99", "worst", "turns", "goings", "comings", "run", "read-out", "first")
    heads = ("broad phase", *(f"> {name}\nms" for name in names), "> compiled\ns", "> drift")
    rows = [
        (row.phase, "refused")
        if row.parts is None
        else (
            row.phase,
            *(or_dash(each, ".2f") for each in (row.median, row.p99, row.worst)),
            *(f"{row.parts[part]:.3f}" for part in PARTS),
            f"{row.first[0]:.2f}",
            or_dash(row.compile_seconds, ".3g"),
            or_dash(row.drift, ".2f"),
        )
        for row in bench.rows
    ]
    where = bench.conditions
    return [
        rows_table(heads, rows),
        f"CPU time of a frame: {where['turned']} of {where['bodies']:,} discs turn in one call, "
        f"{where['exchanged']} go and {where['exchanged']} come, 1/{where['rate']} of a unit of time passes "
        f"at speed {where['speed']:g} and density {where['density']:g}, all positions and the new contacts "
        "are read",
        f"{where['frames']:,} frames; first: the first of them; compiled: after it began; drift: the last "
        f"tenth over the first; {where['processor']}",
        *(f"{row.phase} refuses: {row.refused}" for row in bench.rows if row.refused),
        _agreement(bench.identical, bench.rows),
    ]


@printed_parts.register
def _counters(bench: CountersBench) -> list[Any]:
    """The counts of all phases, one row for each phase on each scene."""

    def count(name: str, form: str) -> Callable[[Any], str]:
        return lambda row: "refused" if row.refused else or_dash(row.counts[name], form)

    table = column_table(
        bench.rows,
        ("> density", lambda row: f"{row.density:g}"),
        ("> discs", lambda row: f"{row.bodies:,}"),
        ("| broad phase", lambda row: row.phase),
        ("> instructions", count("instructions", ",.0f")),
        ("> branches", count("branches", ",.0f")),
        ("> mispredicted", count("mispredicted", ",.1f")),
        ("> first-level\ncache misses", count("first_cache_misses", ",.1f")),
        ("> last-level\ncache misses", count("last_cache_misses", ",.1f")),
        shared=2,
    )
    where = bench.conditions
    counted = min((row.counted for row in bench.rows if row.counted is not None), default=1.0)
    lines = [
        f"{where['processor']}; for one contact, in user mode: {where['contacts']:,} contacts of each phase, "
        f"after {where['contacts_before']} a disc",
        *(f"{row.phase} refuses: {row.refused}" for row in bench.rows if row.refused),
    ]
    if counted < 1.0:
        lines.append(f"extrapolated: the counters took turns, and one counted {counted:.0%} of the time")
    return [table, *lines, *([] if bench.identical else [_DIFFERENT])]


_SPEED: tuple[Column, ...] = (
    ("> thousand contacts\n/ CPU s", lambda row: or_dash(row.contacts_per_cpu_second or None, ",.1f", 1e-3)),
    ("> of the\nfastest", lambda row: or_dash(row.of_fastest, ".2f")),
    ("> structural\n/ contact", lambda row: or_dash(row.structural_per_contact, ".2f")),
)


@printed_parts.register
def _scene(bench: SceneBench) -> list[Any]:
    """The results of the phases on a scene, one row a phase."""
    table = column_table(
        bench.rows,
        ("broad phase", lambda row: row.phase),
        ("> CPU s", lambda row: or_dash(row.cpu_seconds, ".4g")),
        (
            "| fastest ..\nslowest",
            lambda row: "" if row.cpu_seconds is None else f"{row.fastest:.4g} .. {row.slowest:.4g}",
        ),
        *_SPEED,
        ("> contacts", lambda row: or_dash(row.contacts, ",d")),
        ("> commands", lambda row: or_dash(row.commands, ",d")),
        ("fingerprint", lambda row: (row.fingerprint or "")[:16]),
        ("ended by", lambda row: "refused" if row.cpu_seconds is None else _kind(row.ended_by)),
    )
    where = bench.conditions
    return [
        table,
        *(f"{row.phase}: {row.ended_by}" for row in bench.rows if row.ended_by),
        f"{where['processor']}; medians of {where['repeats']} runs each, compiling and set-up apart",
        _agreement(bench.identical, bench.rows),
    ]


@printed_parts.register
def _choice(chosen: Chosen) -> list[Any]:
    """The results of the candidates, the fastest first, and the recommendation."""
    table = column_table(
        chosen.candidates,
        ("broad phase", lambda row: row.phase),
        *_SPEED,
        ("> arrays\nKB", lambda row: or_dash(row.memory, ",.0f", 1 / 1024)),
        ("", _remark),
    )
    where = chosen.conditions
    return [
        table,
        *(f"{row.phase}: {row.ended_by}" for row in chosen.candidates if row.ended_by),
        f"{where['processor']}; the first {where['max_contacts']:,} contacts, medians of {where['repeats']} "
        "runs each, compiling and set-up apart",
        "the same contacts under all phases that ran" if chosen.identical else _DIFFERENT,
        f"take {chosen.phase}: {chosen.reason}" if chosen.phase else chosen.reason,
    ]


def _remark(candidate: Any) -> str:
    if candidate.memory is None:
        return "refuses"
    return "slow from the beginning" if candidate.hopeless else _kind(candidate.ended_by)


def _kind(error: str | None) -> str:
    return (error or "").partition(":")[0]


_DIFFERENT = "NOT identical: the fingerprints differ; `kinetile compare` shows where"


def _agreement(identical: bool, rows: Sequence[Any]) -> str:
    played = [row for row in rows if row.fingerprint is not None]
    if not identical:
        return _DIFFERENT
    if len(played) < 2:
        return "one phase alone: there is nothing to compare it with"
    same = f"{played[0].contacts:,} contacts, the same under all {len(played)} phases"
    return f"identical: {same}, fingerprint {played[0].fingerprint[:16]}"


def status_parts(study: Study, status: StudyStatus) -> list[Any]:
    """Returns the progress of a study, and its first disagreements."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    counts = ", ".join(f"{count:,} {kind}" for kind, count in sorted(status.statuses.items()))
    table.add_row("tasks", f"{status.total:,}: {counts or 'none done'}, {status.open:,} open")
    if status.ran:
        table.add_row("this run", f"{status.ran:,} rows")
    if status.elsewhere:
        table.add_row("elsewhere", f"{status.elsewhere:,} tasks: another process was at them")
    if status.others:
        table.add_row("others", f"{status.others:,} rows of other versions, or that the study had before")
    for sentence in status.changed:
        table.add_row("changed", legible(sentence))
    if status.damaged:
        table.add_row("damaged", f"{status.damaged:,} files, moved to `damaged`: their tasks are done again")
    table.add_row("results", legible(str(study.results)))
    return [table, *(f"disagreement: {sentence}" for sentence in status.disagreements[:10])]


def results_parts(found: Mapping[str, Any]) -> list[Any]:
    """Returns the results of the rows of a study: groups, exponents, crossovers."""
    y, parts = found["y"], []
    if found["groups"]:
        ratio = f"ratio to {found['base']}, paired by seed"
        parts = [f"{y}: mean over seeds, 95 % interval; {ratio}", _groups_table(found)]
    if found["exponents"]:
        columns = _of_scene(found["parameters"], found["x"])
        parts += [
            f"\nExponents of {y} over {found['x']}",
            column_table(
                found["exponents"],
                *columns,
                ("| phase", lambda row: row["phase"]),
                (f"> {found['x']}", lambda row: "{:g} to {:g}".format(*row["range"])),
                ("> exponent", lambda row: "" if row["exponent"] is None else f"{row['exponent']:.3f}"),
                (
                    "> 95 %",
                    lambda row: (
                        "" if row["interval"] is None else "{:.3f} to {:.3f}".format(*row["interval"])
                    ),
                ),
                ("> seeds", lambda row: str(row["seeds"])),
            ),
        ]
    for crossed in found["crossovers"]:
        columns = _of_scene(found["parameters"], crossed["over"])
        parts += [
            f"\nCrossovers over {crossed['over']}: where {y} is equal",
            column_table(
                crossed["found"],
                *columns,
                ("| below", lambda row: row["below"]),
                ("| above", lambda row: row["above"]),
                (f"> {crossed['over']}", lambda row: _number(row["at"])),
                ("> 95 %", lambda row: _interval(row["interval"])),
                ("> seeds", lambda row: str(row["seeds"])),
            ),
        ]
    return parts or ["no rows with this column yet"]


def _groups_table(found: Mapping[str, Any]) -> Table:
    """Returns a quantity for each scene and phase: mean over seeds, interval, ratio to the first phase."""
    return column_table(
        found["groups"],
        *_of_scene(found["parameters"]),
        ("| phase", lambda row: row["phase"]),
        ("> rows", lambda row: f"{row['rows']:,}" + (f" ({row['odd']})" if row["odd"] else "")),
        ("> contacts", lambda row: _number(row["contacts"])),
        ("> mean", lambda row: _number(row["mean"])),
        ("> 95 %", lambda row: _interval(row["interval"])),
        ("> ratio", lambda row: _number(row["ratio"])),
        ("> 95 % of ratio", lambda row: _interval(row["ratio_interval"])),
        shared=len(found["parameters"]),
    )


def _of_scene(parameters: Sequence[str], without: str = "") -> list[Column]:
    """Returns a column for each parameter of a scene."""
    return [
        (f"> {name}", lambda row, name=name: _number(row["scene"].get(name)))  # type: ignore[misc]
        for name in parameters
        if name != without
    ]


def _number(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool | str):
        return str(value)
    if isinstance(value, int) or 1000.0 <= abs(value) < 1e9:
        return f"{value:,.0f}"
    return f"{value:.4g}"


def _interval(interval: Sequence[float] | None) -> str:
    return "" if interval is None else f"{_number(interval[0])} to {_number(interval[1])}"


def or_dash(value: float | None, form: str, unit: float = 1) -> str:
    """Returns a value in this form, in units of 1 / ``unit``; a dash for None."""
    return "-" if value is None else format(value * unit, form)
