"""Results of benchmarks and studies as printed tables, for each kind of result."""

from collections.abc import Callable, Mapping, Sequence
from functools import singledispatch
from math import isfinite
from statistics import median
from typing import Any

from kinetile.cli.output import empty_table, rows_table, table_of
from kinetile_bench.event_rates import EventsBench
from kinetile_bench.thesis import ThesisBench
from kinetile_bench.thesis.statements import Statement
from kinetile_bench.user_scene import Chosen, SceneBench


@singledispatch
def printed_parts(found: Any, **more: Any) -> list[Any]:
    """Returns the tables and lines that a command prints for a result."""
    raise TypeError(f"there are no tables for {type(found).__name__}")


@printed_parts.register
def _events(bench: EventsBench) -> list[Any]:
    where = bench.conditions
    table = table_of(
        [row for row in bench.rows if row.refused is None],
        {
            "> density": lambda row: f"{row.density:g}",
            "> discs": lambda row: f"{row.bodies:,}",
            "| broad phase": lambda row: row.phase,
            "> million events\n/ CPU s": lambda row: f"{row.events_per_cpu_second / 1e6:.2f}",
            "> thousand contacts\n/ CPU s": lambda row: f"{row.contacts_per_cpu_second / 1e3:,.1f}",
            "> best": lambda row: f"{row.best / 1e3:,.1f}",
            "> of the\nfastest": lambda row: f"{row.of_fastest:.2f}",
            "> events\n/ contact": lambda row: f"{row.events_per_contact:.2f}",
            "> asked\n/ contact": lambda row: f"{row.asked_per_contact:.1f}",
            "> exact\n/ contact": lambda row: f"{row.computed_per_contact:.2f}",
            "> CPU s / unit\nof time": lambda row: f"{row.cpu_seconds_per_time:.4g}",
            "> exponent\nover discs": lambda row: or_dash(row.exponent, ".2f"),
        },
        shared=2,
    )
    seconds = f"about {where['seconds']:g} CPU s each"
    loads = [each for each in where["load"] if each is not None]
    loaded = f"; load {min(loads):g} to {max(loads):g}" if loads else ""
    return [
        table,
        *(f"{row.phase} refuses {row.bodies:,} discs: {row.refused}" for row in bench.rows if row.refused),
        f"{where['processor']}; medians of {_times(where, 'run')} of {seconds}{loaded}",
        *([] if bench.identical else [_DIFFERENT]),
    ]


@printed_parts.register
def _thesis(bench: ThesisBench, statements: Sequence[Statement], files: Sequence[Any]) -> list[Any]:
    """The times and counts of the thesis's benchmark, a row for each phase on each scene; its statements."""

    def count(name: str, form: str, over: str | None = None) -> Callable[[Any], str]:
        def text(row: Any) -> str:
            below = bench.mean(row[0], row[1], over) if over else bench.rows[0].until
            return format(bench.mean(row[0], row[1], name) / below, form) if below else "-"

        return text

    def times(row: Any) -> str:
        costs = sorted(1e3 * cell.cost for cell in bench.of(*row).values())
        return f"{median(costs):.3g} ({costs[0]:.3g}-{costs[-1]:.3g})"

    def unrest(row: Any) -> str:
        found = median(cell.unrest for cell in bench.of(*row).values())
        return or_dash(found if isfinite(found) else None, ".2f")

    table = table_of(
        [(scene, phase) for scene in bench.scenes() for phase in bench.phases],
        {
            "> density": lambda row: f"{row[0].density:g}",
            "> discs": lambda row: f"{row[0].bodies:,}",
            "| broad phase": lambda row: row[1],
            "> CPU ms": times,
            "> unrest": unrest,
            "> bound\nevents": count("structural_events", ",.0f"),
            "> collisions": count("contacts_disc", ",.0f"),
            "> wall\ncontacts": count("contacts_wall", ",.0f"),
            "> updates\n/ event": count("certificates_updated", ".2f", "events"),
            "> asked\n/ contact": count("partners_asked", ".3g", "contacts"),
            "> exact\n/ contact": count("contacts_computed", ".2f", "contacts"),
            "> bound\n/ contact": count("structural_events", ".3g", "contacts"),
            "> queue": lambda row: f"{bench.mean(row[0], row[1], 'queue_max'):,.0f}",
            "> pairs": lambda row: f"{bench.mean(row[0], row[1], 'candidate_pairs'):,.1f}",
        },
        shared=2,
    )
    where = bench.conditions
    return [
        "For one unit of simulated time: CPU milliseconds (median over seeds, and the extremes) and counts",
        *(table, _answers(statements)),
        f"{where['processor']}; seeds 1 to {where['seeds']}, {where['until']:g} units of time, "
        f"{_times(where, 'round')} of about {where['seconds']:g} CPU s; unrest: slowest over fastest round",
        *([] if bench.identical else [_DIFFERENT]),
        *(f"written: {path}" for path in files),
    ]


def _answers(statements: Sequence[Statement]) -> Any:
    table = empty_table("| ", "| verdict", "statement, and the numbers that decide it")
    for each in statements:
        parts = (f"  {part.answer}: {part.text} ({part.numbers})" for part in each.parts)
        table.add_row(each.name, each.verdict, "\n".join([each.text, *parts]))
    return table


_SPEED: Mapping[str, Callable[[Any], str]] = {
    "> thousand contacts\n/ CPU s": lambda row: or_dash(row.contacts_per_cpu_second or None, ",.1f", 1e-3),
    "> of the\nfastest": lambda row: or_dash(row.of_fastest, ".2f"),
    "> structural\n/ contact": lambda row: or_dash(row.structural_per_contact, ".2f"),
}


@printed_parts.register
def _scene(bench: SceneBench, **_: Any) -> list[Any]:
    table = table_of(
        bench.rows,
        {
            "broad phase": lambda row: row.phase,
            "> CPU s": lambda row: or_dash(row.cpu_seconds, ".4g"),
            "| fastest ..\nslowest": lambda row: (
                "" if row.cpu_seconds is None else f"{row.fastest:.4g} .. {row.slowest:.4g}"
            ),
            **_SPEED,
            "> contacts": lambda row: or_dash(row.contacts, ",d"),
            "> commands": lambda row: or_dash(row.commands, ",d"),
            "fingerprint": lambda row: (row.fingerprint or "")[:16],
            "ended by": lambda row: "refused" if row.cpu_seconds is None else _kind(row.ended_by),
        },
    )
    where = bench.conditions
    return [
        table,
        *(f"{row.phase}: {row.ended_by}" for row in bench.rows if row.ended_by),
        f"{where['processor']}; medians of {_times(where, 'run')} each, without compiling and set-up",
        _agreement(bench),
    ]


_COSTS = {
    "structural_per_contact": "structural events a contact",
    "asked_per_contact": "candidate checks a contact",
    "computed_per_contact": "exact times a contact",
    "structure_bytes": "bytes of its structure",
}

UNDUE = 2.0
"""The multiple of a cost of ``cells`` that is out of proportion."""


def _undue(chosen: Chosen) -> list[str]:
    """Returns a line for each phase with a cost out of proportion to the cost of ``cells``, if that ran, or
    of the fastest."""
    ran = [row for row in chosen.candidates if row.rate]
    base = next((row for row in ran if row.phase == "cells"), ran[0] if ran else None)
    lines = []
    for row in ran:
        pairs = ((text, getattr(row, name), getattr(base, name)) for name, text in _COSTS.items())
        times = [f"{own / its:.3g} times the {text}" for text, own, its in pairs if own > UNDUE * its > 0]
        if times and base is not None:
            lines.append(f"{row.phase} has, beside {base.phase}, {', '.join(times)}")
    return lines


@printed_parts.register
def _choice(chosen: Chosen, **_: Any) -> list[Any]:
    where = chosen.conditions
    most = max(row.contacts or 0 for row in chosen.candidates)
    columns = {
        "broad phase": lambda row: row.phase,
        **_SPEED,
        "> asked\n/ contact": lambda row: or_dash(row.asked_per_contact, ".1f"),
        "> exact\n/ contact": lambda row: or_dash(row.computed_per_contact, ".2f"),
        "> KiB": lambda row: or_dash(row.structure_bytes, ",.0f", 2.0**-10),
        "": _remark,
    }
    return [
        table_of(chosen.candidates, columns),
        *_undue(chosen),
        *(f"{row.phase}: {row.ended_by}" for row in chosen.candidates if row.ended_by),
        f"{where['processor']}; the first {min(where['max_contacts'], most):,} contacts, medians of "
        f"{_times(where, 'run')} each, without compiling and set-up",
        "the same contacts under all phases that ran" if chosen.identical else _DIFFERENT,
        f"take {chosen.phase}: {chosen.reason}" if chosen.phase else chosen.reason,
    ]


def _remark(candidate: Any) -> str:
    if candidate.cpu_seconds is None:
        return "refuses"
    return "slow from the beginning" if candidate.hopeless else _kind(candidate.ended_by)


def _kind(error: str | None) -> str:
    return (error or "").partition(":")[0]


_DIFFERENT = "NOT identical: the fingerprints differ; `kinetile compare` shows where"


def _agreement(bench: SceneBench) -> str:
    played = [row for row in bench.rows if row.fingerprint is not None]
    if not bench.identical:
        return _DIFFERENT
    if len(played) < 2:
        return "one phase alone: there is nothing to compare it with"
    same = f"{played[0].contacts:,} contacts, the same under all {len(played)} phases"
    return f"identical: {same}, fingerprint {played[0].fingerprint[:16]}"


def study_parts(found: Mapping[str, Any]) -> list[Any]:
    """Returns a table of a quantity for each scene and phase: mean, standard error, ratio to the first."""
    heads = [*(f"> {each}" for each in found["varied"]), "| phase", "> rows", "> contacts"]
    heads += ["> mean", "> error", "> ratio", "> error"]
    rows = [
        [
            *(_number(group["scene"].get(each)) for each in found["varied"]),
            group["phase"],
            f"{group['rows']:,}" + (f" ({group['odd']})" if group["odd"] else ""),
            *(_number(group[each]) for each in ("contacts", "mean", "error", "ratio", "ratio_error")),
        ]
        for group in found["groups"]
    ]
    table = rows_table(heads, rows, shared=len(found["varied"]))
    head = f"{found['y']}: mean over seeds, ratio to {found['base']} paired by seed, standard errors"
    return [head, table] if found["groups"] else []


def _number(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool | str):
        return str(value)
    if isinstance(value, int) or 1000.0 <= abs(value) < 1e9:
        return f"{value:,.0f}"
    return f"{value:.4g}"


def _times(conditions: Mapping[str, Any], what: str) -> str:
    repeats = conditions["repeats"]
    return f"{repeats} {what}" if repeats == 1 else f"{repeats} {what}s"


def or_dash(value: float | None, form: str, unit: float = 1) -> str:
    """Returns a value in this form, in units of 1 / ``unit``; a dash for None."""
    return "-" if value is None else format(value * unit, form)
