"""Tables for people of what a program's frames cost, and of one's own scene under the phases."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from kinetile.cli.tables import rows_table
from kinetile_bench.own.choose import Chosen
from kinetile_bench.own.frames import PARTS, FrameBench
from kinetile_bench.own.scene import SceneBench

__all__ = ["choice_notes", "choice_table", "frames_notes", "frames_table", "scene_notes", "scene_table"]


def frames_table(bench: FrameBench) -> Table:
    """Return what a frame costs, one row a phase."""
    names = ("turns", "goings", "comings", "run", "read-out")
    heads = ("median", "p99", "worst", *names, "first")
    rows = [
        (row.phase, "refused")
        if row.parts is None
        else (
            row.phase,
            *(_number(each, ".2f") for each in (row.median, row.p99, row.worst)),
            *(f"{row.parts[part]:.3f}" for part in PARTS),
            f"{row.first[0]:.2f}",
            _number(row.compile_seconds, ".3g"),
            _number(row.drift, ".2f"),
        )
        for row in bench.rows
    ]
    return rows_table(("broad phase", *(f"> {name}\nms" for name in heads), "> compiled\ns", "> drift"), rows)


def frames_notes(bench: FrameBench) -> list[str]:
    """Return what was played, and whether the phases agree."""
    where = bench.conditions
    return [
        f"CPU time of a frame: {where['turned']} of {where['bodies']:,} discs turn in one call, "
        f"{where['exchanged']} go and {where['exchanged']} come, 1/{where['rate']} of a unit of time passes "
        f"at speed {where['speed']:g} and density {where['density']:g}, all positions and the new contacts "
        "are read",
        f"{where['frames']:,} frames; first: the first of them; compiled: after it began; drift: the last "
        f"tenth over the first; {where['processor']}",
        *(f"{row.phase} refuses: {row.refused}" for row in bench.rows if row.refused),
        _agreement(bench.identical, bench.rows),
    ]


def scene_table(bench: SceneBench) -> Table:
    """Return how the phases did on a scene, one row a phase."""
    heads = (
        "broad phase",
        "> CPU s",
        "| fastest ..\nslowest",
        "> thousand contacts\n/ CPU s",
        "> of the\nfastest",
        "> structural\n/ contact",
        "> contacts",
        "> commands",
        "fingerprint",
        "ended by",
    )
    rows = [
        (
            row.phase,
            _number(row.cpu_seconds, ".4g"),
            "" if row.cpu_seconds is None else f"{row.fastest:.4g} .. {row.slowest:.4g}",
            _number(row.contacts_per_cpu_second, ",.1f", 1e-3),
            _number(row.of_fastest, ".2f"),
            _number(row.structural_per_contact, ".2f"),
            _number(row.contacts, ",d"),
            _number(row.commands, ",d"),
            (row.fingerprint or "")[:16],
            "refused" if row.cpu_seconds is None else (row.ended_by or "").partition(":")[0],
        )
        for row in bench.rows
    ]
    return rows_table(heads, rows)


def scene_notes(bench: SceneBench) -> list[str]:
    """Return what ended runs before their end, how it was measured, and whether the phases agree."""
    where = bench.conditions
    return [
        *(f"{row.phase}: {row.ended_by}" for row in bench.rows if row.ended_by),
        f"{where['processor']}; medians of {where['repeats']} runs each, compiling and set-up apart",
        _agreement(bench.identical, bench.rows),
    ]


def choice_table(chosen: Chosen) -> Table:
    """Return how the candidates did, the fastest first."""
    heads = (
        "broad phase",
        "> thousand contacts\n/ CPU s",
        "> of the\nfastest",
        "> structural\n/ contact",
        "> arrays\nKB",
        "",
    )
    rows = [
        (
            each.row.phase,
            _number(each.rate or None, ",.1f", 1e-3),
            _number(each.row.of_fastest, ".2f"),
            _number(each.row.structural_per_contact, ".2f"),
            _number(each.memory, ",.0f", 1 / 1024),
            _remark(each.memory is None, each.hopeless, each.row.ended_by),
        )
        for each in chosen.candidates
    ]
    return rows_table(heads, rows)


def _remark(refused: bool, hopeless: bool, ended_by: str | None) -> str:
    if refused:
        return "refuses"
    return "slow from the beginning" if hopeless else (ended_by or "").partition(":")[0]


def choice_notes(chosen: Chosen) -> list[str]:
    """Return what phases refuse, how it was measured, and the recommendation."""
    where = chosen.conditions
    rows = [each.row for each in chosen.candidates]
    return [
        *(f"{row.phase}: {row.ended_by}" for row in rows if row.ended_by),
        f"{where['processor']}; the first {where['max_contacts']:,} contacts, medians of {where['repeats']} "
        "runs each, compiling and set-up apart",
        "the same contacts under all phases that ran"
        if chosen.identical
        else "NOT identical: the fingerprints differ; `kinetile compare` shows where",
        f"take {chosen.phase}: {chosen.reason}" if chosen.phase else chosen.reason,
    ]


def _agreement(identical: bool, rows: Sequence[Any]) -> str:
    played = [row for row in rows if row.fingerprint is not None]
    if not identical:
        return "NOT identical: the fingerprints differ; `kinetile compare` shows where"
    if len(played) < 2:
        return "one phase alone: there is nothing to compare it with"
    same = f"{played[0].contacts:,} contacts, the same under all {len(played)} phases"
    return f"identical: {same}, fingerprint {played[0].fingerprint[:16]}"


def _number(value: float | None, form: str, unit: float = 1) -> str:
    return "-" if value is None else format(value * unit, form)
