"""Results of the thesis's benchmark as printed tables: scenes, exponents, measures, statements."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rich.table import Table

from kinetile.cli.output import empty_table, rows_table
from kinetile_bench.cli.tables import Rows, column_table, or_dash
from kinetile_bench.thesis import ThesisBench
from kinetile_bench.thesis.evidence import QUIET
from kinetile_bench.thesis.measures import NOT_MEASURED, Fit
from kinetile_bench.thesis.statements import Statement


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
        f"slowest over fastest round of the same run: {_unrest(bench.unrest, 3)}, the median of all; "
        f"a machine is quiet up to {QUIET:g}",
    ]


def _unrest(unrest: float, places: int) -> str:
    return f"{unrest:.{places}f}" if math.isfinite(unrest) else "not known"


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
        rows.append((f"{density:g}", f"{bodies:,}", *cells, _unrest(unrest, 2)))
    heads = ("> density", "> discs", *(f"> {phase}" for phase in phases), "> unrest")
    return rows_table(heads, rows, shared=1)


def _events_table(scenes: Rows) -> Table:
    """Returns numbers and shares of events of each kind (figure 24), the queue and the candidate pairs."""

    def rate(kind: str) -> Callable[[Any], str]:
        return lambda row: f"{row[f'{kind}_per_time']['mean']:,.0f}"

    def share(kind: str) -> Callable[[Any], str]:
        return lambda row: f"{100.0 * row[f'share_{kind}']['mean']:.1f}"

    return column_table(
        scenes,
        ("> density", lambda row: f"{row['density']:g}"),
        ("> discs", lambda row: f"{row['bodies']:,}"),
        ("| broad phase", lambda row: row["phase"]),
        ("> bound\nevents", rate("bound_events")),
        ("> ±", lambda row: or_dash(row["bound_events_per_time"]["error"], ",.0f")),
        ("> in\ntheory", lambda row: or_dash(row["bound_events_in_theory"], ",.0f")),
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
            *(or_dash(each, ".2f") for each in row["bound_events_in_theory"]),
        )
        for row in exponents
    ]
    return rows_table(("> density", "broad phase", *heads), cells, shared=1)


def _measures_table(scenes: Rows) -> Table:
    """Returns the four measures of a kinetic data structure, measured and in theory."""

    def measure(name: str) -> Callable[[Any], str]:
        return lambda row: or_dash(row["measures"][name], ".3g")

    return column_table(
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
