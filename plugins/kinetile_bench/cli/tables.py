"""Results of benchmarks and studies as printed tables, for each kind of result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import singledispatch
from typing import Any

from rich.table import Table

from kinetile.cli.output import empty_table, rows_table
from kinetile_bench.events import Bench
from kinetile_bench.frames import PARTS, FrameBench
from kinetile_bench.growth import Growth
from kinetile_bench.study import Study
from kinetile_bench.study_run import StudyStatus
from kinetile_bench.thesis import ThesisBench
from kinetile_bench.thesis.evidence import QUIET
from kinetile_bench.thesis.measures import NOT_MEASURED, Fit
from kinetile_bench.thesis.statements import Statement
from kinetile_bench.user_scene import Chosen, SceneBench

Rows = Sequence[Mapping[str, Any]]
Column = tuple[str, Callable[[Any], str]]
"""The head of a column as ``kinetile.cli.output`` has it, and the text of a row in it."""


@singledispatch
def printed_parts(found: Any) -> list[Any]:
    """Returns the tables and lines that a command prints of a result."""
    raise TypeError(f"there are no tables for {type(found).__name__}")


def _table(rows: Iterable[Any], *columns: Column, shared: int = 0) -> Table:
    return rows_table(
        [head for head, _ in columns], [[cell(row) for _, cell in columns] for row in rows], shared
    )


@printed_parts.register
def _events(bench: Bench) -> list[Any]:
    """The rates of all phases, one row for each phase on each scene."""
    where = bench.conditions
    table = _table(
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
    table = _table(
        rows,
        ("> discs", lambda row: f"{row.bodies:,}"),
        ("> set-up\ns", lambda row: f"{row.setup_seconds:.2f}"),
        ("> CPU s / unit\nof time", lambda row: f"{row.cpu_seconds_per_time:.4g}"),
        ("> fastest-\nslowest", lambda row: f"{row.fastest:.4g}-{row.slowest:.4g}"),
        ("> exponent\nsince", lambda row: _or_dash(exponents[row.bodies], ".2f")),
        ("> thousand contacts\n/ CPU s", lambda row: f"{row.contacts_per_cpu_second / 1e3:,.0f}"),
        ("> events\n/ contact", lambda row: f"{row.events_per_contact:.2f}"),
        ("> peak bytes\n/ disc", lambda row: _or_dash(row.peak_bytes_per_body, ",.0f")),
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
            *(_or_dash(each, ".2f") for each in (row.median, row.p99, row.worst)),
            *(f"{row.parts[part]:.3f}" for part in PARTS),
            f"{row.first[0]:.2f}",
            _or_dash(row.compile_seconds, ".3g"),
            _or_dash(row.drift, ".2f"),
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


_SPEED: tuple[Column, ...] = (
    ("> thousand contacts\n/ CPU s", lambda row: _or_dash(row.contacts_per_cpu_second or None, ",.1f", 1e-3)),
    ("> of the\nfastest", lambda row: _or_dash(row.of_fastest, ".2f")),
    ("> structural\n/ contact", lambda row: _or_dash(row.structural_per_contact, ".2f")),
)


@printed_parts.register
def _scene(bench: SceneBench) -> list[Any]:
    """The results of the phases on a scene, one row a phase."""
    table = _table(
        bench.rows,
        ("broad phase", lambda row: row.phase),
        ("> CPU s", lambda row: _or_dash(row.cpu_seconds, ".4g")),
        (
            "| fastest ..\nslowest",
            lambda row: "" if row.cpu_seconds is None else f"{row.fastest:.4g} .. {row.slowest:.4g}",
        ),
        *_SPEED,
        ("> contacts", lambda row: _or_dash(row.contacts, ",d")),
        ("> commands", lambda row: _or_dash(row.commands, ",d")),
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
    table = _table(
        chosen.candidates,
        ("broad phase", lambda row: row.phase),
        *_SPEED,
        ("> arrays\nKB", lambda row: _or_dash(row.memory, ",.0f", 1 / 1024)),
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


def thesis_parts(bench: ThesisBench, scenes: Rows, exponents: Rows, found: Iterable[Statement]) -> list[Any]:
    """Returns the tables and lines of the thesis's benchmark: of its scenes, exponents and statements."""
    where = bench.conditions
    return [
        "CPU milliseconds for one unit of simulated time: median over seeds, and the extremes; * fastest "
        "(figure 23)",
        _time_table(scenes),
        "\nEvents in one unit of time (means over seeds, standard error), their shares (figure 24), "
        "longest queue, mean candidate pairs",
        _events_table(scenes),
        "\nExponents over n, fitted seed by seed: mean and standard error",
        _exponents_table(exponents),
        f"\nThe measures of a kinetic data structure (section 2.1), {bench.bodies[-1]} discs: measured, "
        "and in theory",
        _measures_table([row for row in scenes if row["bodies"] == bench.bodies[-1]]),
        "responsiveness: certificates set anew for one event; for one contact, partners that were looked at "
        "and contact times worked out exactly",
        "efficiency: bound events for one contact, and for one candidate pair that comes or goes",
        "compactness: bodies in the queue over n",
        "locality: candidate pairs that a body is in: on average, and the most, of the moments looked at",
        *(f"not measured: {each}" for each in NOT_MEASURED),
        "\nThe thesis's statements",
        _statements_table(found),
        f"{where['processor']}; seeds 1 to {where['seeds']}, {where['until']:g} units of time; "
        f"{where['repeats']} rounds of all phases on each scene, about {where['seconds']:g} CPU s each",
        f"slowest over fastest round of the same run: {bench.unrest:.3f}, the median of all; "
        f"a machine is quiet up to {QUIET:g}",
    ]


def _time_table(scenes: Rows) -> Table:
    """Returns the CPU time of each phase on each scene (figure 23): median over seeds, and the extremes.

    The last column is how many times as long a phase's slowest round took as its fastest, at most.
    """
    phases = list(dict.fromkeys(row["phase"] for row in scenes))
    groups: dict[tuple[float, int], dict[str, Mapping[str, Any]]] = {}
    for row in scenes:
        groups.setdefault((row["density"], row["bodies"]), {})[row["phase"]] = row
    rows = []
    for (density, bodies), found in groups.items():
        times = {phase: row["cpu_seconds_per_time"] for phase, row in found.items()}
        fastest = min(times, key=lambda phase: times[phase]["median"])
        texts = {
            phase: f"{1e3 * time['median']:.3g} ({1e3 * time['low']:.3g}-{1e3 * time['high']:.3g})"
            + ("*" if phase == fastest else " ")
            for phase, time in times.items()
        }
        unrest = max(row["unrest"] for row in found.values())
        cells = [texts.get(phase, "") for phase in phases]
        rows.append((f"{density:g}", f"{bodies:,}", *cells, f"{unrest:.2f}"))
    heads = ("> density", "> discs", *(f"> {phase}" for phase in phases), "> unrest")
    return rows_table(heads, rows, shared=1)


def _events_table(scenes: Rows) -> Table:
    """Returns numbers and shares of events of each kind (figure 24), the queue and the candidate pairs."""

    def rate(kind: str) -> Callable[[Any], str]:
        return lambda row: f"{row[f'{kind}_per_time']['mean']:,.0f}"

    def share(kind: str) -> Callable[[Any], str]:
        return lambda row: f"{100.0 * row[f'share_{kind}']['mean']:.1f}"

    return _table(
        scenes,
        ("> density", lambda row: f"{row['density']:g}"),
        ("> discs", lambda row: f"{row['bodies']:,}"),
        ("| broad phase", lambda row: row["phase"]),
        ("> bound\nevents", rate("bound_events")),
        ("> ±", lambda row: _or_dash(row["bound_events_per_time"]["error"], ",.0f")),
        ("> in\ntheory", lambda row: _or_dash(row["bound_events_in_theory"], ",.0f")),
        ("> coll.", rate("contacts_disc")),
        ("> wall", rate("contacts_wall")),
        ("> bound\n%", share("bound_events")),
        ("> coll.\n%", share("contacts_disc")),
        ("> wall\n%", share("contacts_wall")),
        ("> queue", lambda row: f"{row['queue_max']:,}"),
        ("> pairs", lambda row: f"{row['pairs_mean']:,.1f}"),
        shared=2,
    )


def _exponents_table(exponents: Rows) -> Table:
    """Returns the fitted exponents of CPU time and bound events over n."""
    over = [f"{fit['first']} to {fit['last']}" for fit in exponents[0]["cpu_seconds"]]
    heads = [f"> {what}\n{each}" for what in ("CPU time", "bound events", "in theory") for each in over]
    cells = [
        (
            f"{row['density']:g}",
            row["phase"],
            *(str(Fit(**fit)) for kind in ("cpu_seconds", "bound_events") for fit in row[kind]),
            *(_or_dash(each, ".2f") for each in row["bound_events_in_theory"]),
        )
        for row in exponents
    ]
    return rows_table(("> density", "broad phase", *heads), cells, shared=1)


def _measures_table(scenes: Rows) -> Table:
    """Returns the four measures of a kinetic data structure, measured and in theory."""

    def measure(name: str) -> Callable[[Any], str]:
        return lambda row: _or_dash(row["measures"][name], ".3g")

    return _table(
        scenes,
        ("> density", lambda row: f"{row['density']:g}"),
        ("| broad phase", lambda row: row["phase"]),
        ("> updates\n/ event", measure("updates_per_event")),
        ("> at\nmost", measure("updates_in_theory")),
        ("> asked\n/ contact", measure("asked_per_contact")),
        ("> exact\n/ contact", measure("computed_per_contact")),
        ("> bound\n/ contact", measure("bound_per_contact")),
        ("> bound /\npair change", measure("bound_per_pair_change")),
        ("> in\ntheory", measure("pair_change_in_theory")),
        ("> queue\n/ n", measure("queue_per_body")),
        ("> pairs\na body", measure("pairs_per_body")),
        ("> in\ntheory", measure("pairs_in_theory")),
        ("> at\nmost", lambda row: f"{row['measures']['pairs_of_one_body']:,}"),
        shared=1,
    )


def _statements_table(found: Iterable[Statement]) -> Table:
    """Returns the thesis's statements, whether they hold, and the numbers that decide it."""
    table = empty_table("| ", "verdict", "statement, and the numbers that decide it")
    for statement in found:
        lines = [statement.text]
        for part in statement.parts:
            lines.append(f"  {part.answer.mark} {part.text}: {part.numbers}")
        table.add_row(statement.name, statement.verdict.replace(": ", ":\n"), "\n".join(lines))
    return table


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
        table.add_row("changed", sentence)
    if status.damaged:
        table.add_row("damaged", f"{status.damaged:,} files, moved to `damaged`: their tasks are done again")
    table.add_row("results", str(study.results))
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
            _table(
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
            _table(
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
    return _table(
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


def _or_dash(value: float | None, form: str, unit: float = 1) -> str:
    return "-" if value is None else format(value * unit, form)
