"""The part ``queries`` of the report: when do two discs meet, and how right is the answer?

The kernel's answer must be the exact tick, and anchoring two discs at
their tick must not make them overlap by more than the proved bound. Each hard family (``families``) is
computed by the kernel's own form and by the textbook's (``forms``), which show the difficulty. Families are
never pooled: an average over easy and hard queries says nothing about either.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from kinetile_accuracy.contact_times.encounter import Deviation, Encounter, QueryRow, deviation, query_row
from kinetile_accuracy.contact_times.families import FAMILIES, Family
from kinetile_accuracy.contact_times.forms import KERNEL, batch_times, forms, ticks_by
from kinetile_accuracy.drawing import LOOKS, is_narrow, legend_below, new_figure
from kinetile_accuracy.sections import (
    Budget,
    Claim,
    Column,
    ReportFigure,
    ReportProgress,
    Section,
    Table,
    grouped,
    number,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COUNTS: dict[Budget, int] = {"quick": 4_000, "normal": 20_000, "full": 100_000}
"""Queries of a family."""

BATCH = 500
BATCHES: dict[Budget, int] = {"quick": 100, "normal": 400, "full": 1_000}
"""Queries that are timed together, and how many such batches at least."""


@dataclass(frozen=True)
class Hardness:
    """What makes a family hard."""

    family: Annotated[str, Column("the family's name", "family")]
    about: Annotated[str, Column("what its queries are", "what makes it hard")]


def measure(budget: Budget, progress: ReportProgress) -> Section:
    """Puts every family to every form."""
    rows: list[QueryRow] = []
    for done, family in enumerate(FAMILIES):
        progress(f"queries: {family.name}", done, len(FAMILIES))
        rows += measure_family(family, COUNTS[budget], BATCHES[budget])
    progress("queries", len(FAMILIES), len(FAMILIES))
    about = (
        f"{COUNTS[budget]:,} queries of each family, put to the form that the kernel is composed with "
        "(narrow phase disc) and to three from textbooks, on the kernel's own tables and in its ticks of "
        "2^-52, rounded down. Whether two discs meet, and in which tick, is computed in exact integers. "
        "Errors are in ticks from the exact one, and as the way along the line of centres that this amounts "
        "to, over the sum of the radii R; depth is how far the discs overlap when both are anchored at the "
        "tick, which rounds their places to doubles. ns are CPU time in a loop over "
        f"{BATCH} independent queries, less an empty loop's; inside a run a query waits for memory as well."
    )
    families = tuple(Hardness(family.name, family.about) for family in FAMILIES)
    return Section(
        name="queries",
        title="When two discs meet",
        about=about,
        findings=query_findings(rows),
        tables=(
            Table("families", "Each family put to each form.", tuple(rows)),
            Table("hardness", "The families.", families),
        ),
        pictures=_pictures(rows),
        claims=query_claims(rows),
        left_out=(
            "Contacts 1,024 units of time or more after the later anchor: bodies are anchored anew before.",
        ),
    )


def measure_family(family: Family, count: int, batches: int) -> list[QueryRow]:
    """Puts one family to every form, and returns a row for each."""
    queries = family.draw(count)
    answers = {name: ticks_by(form, queries) for name, form in forms().items()}
    found: dict[str, list[Deviation]] = {name: [] for name in answers}
    given = zip(*(answer.tolist() for answer in answers.values()), strict=True)
    for plans, ticks in zip(queries.plans(), given, strict=True):
        encounter = Encounter(*plans)
        for name, tick in zip(answers, ticks, strict=True):
            found[name].append(deviation(encounter, tick))
    times = batch_times(forms(), queries, BATCH, batches)
    return [query_row(family.name, name, found[name], times[name]) for name in answers]


def query_claims(rows: list[QueryRow]) -> tuple[Claim, ...]:
    """Returns what must hold for the kernel's form in every family, and what was found."""
    ours = [row for row in rows if row.form == KERNEL]
    of_all = f"of {sum(row.queries for row in ours):,} queries"
    wrong, missed, false = (sum(getattr(row, name) for row in ours) for name in ("wrong", "missed", "false"))
    deepest = max(row.depth_rho for row in ours)
    return (
        Claim(
            "Every answer is the exact tick, grazes, tangency and simultaneous contacts included",
            f"{wrong:,} {of_all} differ from the integer one",
            not wrong,
        ),
        Claim("No contact is missed", f"{missed:,} {of_all}", not missed),
        Claim("No contact is invented", f"{false:,} {of_all}", not false),
        Claim(
            "Discs anchored at a contact overlap by no more than the rounding of their places, rho",
            f"at most {number(deepest)} rho",
            deepest <= 1.0,
        ),
    )


def query_findings(rows: list[QueryRow]) -> tuple[str, ...]:
    """Returns what the rows of all families and forms show beside the claims, in sentences."""
    ours = [row for row in rows if row.form == KERNEL]
    others = [row for row in rows if row.form != KERNEL]
    return (*_textbook(others), _cost(ours, others))


def _textbook(others: list[QueryRow]) -> list[str]:
    """Returns what each of the textbook's forms gets wrong."""
    found = []
    for form, rows in grouped(others, "form").items():
        worst = max(rows, key=lambda row: row.depth)
        shares = [row.wrong / row.queries for row in rows]
        missed, false = (sum(getattr(row, name) for row in rows) for name in ("missed", "false"))
        found.append(
            f"The textbook's {form} form: {min(shares):.0%} to {max(shares):.0%} of the answers, by family, "
            f"are not the exact ones; it misses {missed:,} contacts and finds {false:,} that are none; discs "
            f"overlap by up to {number(worst.depth)} R ({worst.family})."
        )
    return found


def _cost(ours: list[QueryRow], others: list[QueryRow]) -> str:
    naive = {row.family: row.ns_median for row in others if row.form == "naive"}
    ratios = [row.ns_median / naive[row.family] for row in ours if naive[row.family] > 0.0]
    low, high = min(row.ns_median for row in ours), max(row.ns_median for row in ours)
    cost = f"A query costs {low:,.0f} to {high:,.0f} ns of CPU time in the kernel's form, by family (medians)"
    if not ratios:
        return f"{cost}."
    least, most = number(min(ratios)), number(max(ratios))
    return f"{cost}: {least} to {most} times the naive one's, {number(np.median(ratios))} in the middle."


_FORMS = ("citardauq", "naive", KERNEL, "cross product")
"""In the order of the looks."""


def _pictures(rows: list[QueryRow]) -> tuple[ReportFigure, ...]:
    error, depth = "time off the exact tick × closing speed / R", "deepest overlap at the answer / rho"
    return (
        ReportFigure(
            "error",
            "What the answers are off the exact tick, as a way along the line of centres: the 99th "
            "percentile (mark) and up to the largest (line). At the left edge: less, or exact, or no contact "
            "found.",
            lambda: draw_rows(rows, "error_p99", "error_max", 3e-17, error),
        ),
        ReportFigure(
            "depth",
            "The deepest overlap of discs that are anchored at the answer, in units of rho, by family and "
            "form; the dashed line is the bound that is proved for exact ticks. At the left edge: less, or "
            "none.",
            lambda: draw_rows(rows, "depth_rho", "depth_rho", 0.02, depth, bound=1.0),
        ),
    )


def draw_rows(
    rows: list[QueryRow], usual: str, worst: str, edge: float, label: str, bound: float | None = None
) -> Figure:
    """Draws a mark at one column of each row and a line to another: families one below the other, their forms
    a little apart; values below ``edge`` at the left edge."""
    families = list(grouped(rows, "family"))
    forms = [form for form in _FORMS if any(row.form == form for row in rows)]
    figure, panel = new_figure(1, height=1.0 + 0.34 * len(families))
    panel.set(xscale="log", ylim=(len(families) - 0.5, -0.5), xlabel=label)
    panel.set_yticks(range(len(families)), families)
    panel.tick_params(axis="y", length=0, labelsize=6.5 if is_narrow(figure) else 8.0)
    panel.grid(False, axis="y")
    for line in range(1, len(families)):
        panel.axhline(line - 0.5, color="0.88", linewidth=0.6, zorder=0)
    for row in rows:
        colour, marker, _ = LOOKS[_FORMS.index(row.form)]
        fill = colour if row.form == KERNEL else "white"
        place = families.index(row.family) + 0.7 * ((forms.index(row.form) + 0.5) / len(forms) - 0.5)
        low, high = (max(getattr(row, name) or 0.0, edge) for name in (usual, worst))
        panel.plot([low, high], [place, place], color=colour, linewidth=1.0)
        look = {"color": colour, "markerfacecolor": fill, "markersize": 4, "clip_on": False}
        panel.plot(low, place, marker, label=row.form, **look)
    if bound is not None:
        panel.axvline(bound, color="black", linewidth=0.9, linestyle="--", zorder=1)
    panel.set_xlim(left=edge / 1.5)
    legend_below(figure, len(_FORMS))
    return figure
