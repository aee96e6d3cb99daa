"""What the commands about studies print."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.table import Table

from kinetile.cli.tables import rows_table

if TYPE_CHECKING:
    from kinetile_bench.study.study import Outcome, Study

__all__ = ["crossovers_table", "exponents_table", "groups_table", "outcome_table"]


def outcome_table(study: Study, outcome: Outcome) -> Table:
    """Return how a study stands."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    counts = ", ".join(f"{count:,} {status}" for status, count in sorted(outcome.statuses.items()))
    table.add_row("tasks", f"{outcome.total:,}: {counts or 'none done'}, {outcome.open:,} open")
    if outcome.ran:
        table.add_row("this run", f"{outcome.ran:,} rows")
    if outcome.elsewhere:
        table.add_row("elsewhere", f"{outcome.elsewhere:,} tasks: another process was at them")
    if outcome.others:
        table.add_row("others", f"{outcome.others:,} rows of other versions, or that the study had before")
    for said in outcome.changed:
        table.add_row("changed", said)
    if outcome.damaged:
        table.add_row("damaged", f"{outcome.damaged:,} files, moved to `damaged`: their tasks are done again")
    table.add_row("results", str(study.results))
    return table


def groups_table(groups: Sequence[Mapping[str, Any]], parameters: Sequence[str]) -> Table:
    """Return a quantity for each scene and phase: mean over seeds, interval, ratio to the first phase."""
    heads = (
        *(f"> {name}" for name in parameters),
        "| phase",
        "> rows",
        "> contacts",
        "> mean",
        "> 95 %",
        "> ratio",
        "> 95 % of ratio",
    )
    rows = [
        (
            *(_number(group["scene"].get(name)) for name in parameters),
            group["phase"],
            f"{group['rows']:,}" + (f" ({group['odd']})" if group["odd"] else ""),
            _number(group["contacts"]),
            _number(group["mean"]),
            _interval(group["interval"]),
            _number(group["ratio"]),
            _interval(group["ratio_interval"]),
        )
        for group in groups
    ]
    return rows_table(heads, rows, shared=len(parameters))


def exponents_table(exponents: Sequence[Mapping[str, Any]], x: str, parameters: Sequence[str]) -> Table:
    """Return the exponents over a parameter, one row for each phase and choice of the others."""
    heads = (*(f"> {name}" for name in parameters), "| phase", f"> {x}", "> exponent", "> 95 %", "> seeds")
    rows = [
        (
            *(_number(each["scene"].get(name)) for name in parameters),
            each["phase"],
            "{:g} to {:g}".format(*each["range"]),
            "" if each["exponent"] is None else f"{each['exponent']:.3f}",
            "" if each["interval"] is None else "{:.3f} to {:.3f}".format(*each["interval"]),
            str(each["seeds"]),
        )
        for each in exponents
    ]
    return rows_table(heads, rows)


def crossovers_table(crossovers: Sequence[Mapping[str, Any]], x: str, parameters: Sequence[str]) -> Table:
    """Return where one phase overtakes another over a parameter."""
    heads = (*(f"> {name}" for name in parameters), "| below", "| above", f"> {x}", "> 95 %", "> seeds")
    rows = [
        (
            *(_number(each["scene"].get(name)) for name in parameters),
            each["below"],
            each["above"],
            _number(each["at"]),
            _interval(each["interval"]),
            str(each["seeds"]),
        )
        for each in crossovers
    ]
    return rows_table(heads, rows)


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
