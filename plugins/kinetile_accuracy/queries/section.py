"""The part of the report on queries: when do two discs meet, and how right is the answer?

Each hard family (``families``) is put to the kernel's own form and to the textbook's (``forms``), and each
answer is judged by the exact truth (``truth``). What the kernel's answers cost depends on what decides them
(``stages``).
Families are never pooled: an average over easy and hard questions says nothing about either.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np

from kinetile_accuracy.parts import Budget, Claim, Column, Picture, Progress, Section, Table
from kinetile_accuracy.queries.chains import LINES, ChainRow, chain_findings, chains
from kinetile_accuracy.queries.families import FAMILIES, Family
from kinetile_accuracy.queries.figures import draw_depths, draw_errors
from kinetile_accuracy.queries.forms import KERNEL, ask, batch_times, forms
from kinetile_accuracy.queries.questions import Queries
from kinetile_accuracy.queries.stages import StageRow, stage_finding, stage_row
from kinetile_accuracy.queries.truth import Encounter
from kinetile_accuracy.queries.verdicts import QueryRow, TieRow, Verdict, judge, query_row, tie_row
from kinetile_accuracy.wording import number

__all__ = ["measure", "query_findings"]

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


def measure(budget: Budget, progress: Progress) -> Section:
    """Put every family to every form, and follow chains of contacts."""
    rows: list[QueryRow] = []
    ties: list[TieRow] = []
    stages: list[StageRow] = []
    steps = len(FAMILIES) + 1
    for done, family in enumerate(FAMILIES):
        progress(f"queries: {family.name}", done, steps)
        queries = family.draw(COUNTS[budget])
        _put(family, queries, budget, rows, ties)
        stages.append(stage_row(family, queries, BATCH, BATCHES[budget]))
    progress("queries: chains of contacts", len(FAMILIES), steps)
    links = chains(budget)
    progress("queries", steps, steps)
    about = (
        f"{COUNTS[budget]:,} queries of each family, asked of the form that the kernel is composed with "
        "(narrow phase disc) and of three from textbooks, on the kernel's own tables and in its ticks of "
        "2^-52, rounded down. Whether two discs meet, and in which tick, is judged in exact integers. What "
        "an answer is off is told in ticks from the exact one, and as the way along the line of centres that "
        "this amounts to, over the sum of the radii R; depth is how far the discs overlap when both are "
        "anchored at the tick, which rounds their places to doubles. ns are CPU time, not that of a clock on "
        f"the wall, in a loop over {BATCH} independent queries, less an empty loop's; inside a run a query "
        "waits for memory as well."
    )
    families = tuple(Hardness(family.name, family.about) for family in FAMILIES)
    chained = "Two bodies that meet again and again, against 100 digits; a third disc after an exchange."
    decides = (
        "What decides a query in the kernel's form, and CPU time a query (medians over batches; in batches "
        "of queries that one stage decides, its time includes the stages before it)."
    )
    return Section(
        name="queries",
        title="When two discs meet",
        about=about,
        findings=(
            *query_findings(rows),
            stage_finding(stages),
            *_tie_findings(ties),
            *chain_findings(links),
        ),
        tables=(
            Table("families", "Each family put to each form.", tuple(rows)),
            Table("stages", decides, tuple(stages), printed=True),
            Table("ties", "Contacts that are simultaneous in truth.", tuple(ties)),
            Table("chains", chained, tuple(links)),
            Table("hardness", "The families.", families),
        ),
        pictures=_pictures(rows),
        claims=(*query_claims(rows), *_other_claims(ties, links)),
        left_out=(
            "Long chains in the plane: two discs in a box are chaotic. For them see the certified oracle.",
            "Contacts 1,024 units of time or more after the later anchor: bodies are anchored anew before.",
        ),
    )


def _put(family: Family, queries: Queries, budget: Budget, rows: list[QueryRow], ties: list[TieRow]) -> None:
    """Put one family to every form and add its rows."""
    answers = {name: ask(form, queries) for name, form in forms().items()}
    verdicts: dict[str, list[Verdict]] = {name: [] for name in answers}
    given = zip(*(answer.tolist() for answer in answers.values()), strict=True)
    for plans, ticks in zip(queries.plans(), given, strict=True):
        encounter = Encounter(*plans)
        for name, tick in zip(answers, ticks, strict=True):
            verdicts[name].append(judge(encounter, tick))
    times = batch_times(forms(), queries, BATCH, BATCHES[budget])
    for name in answers:
        rows.append(query_row(family, name, verdicts[name], times[name]))
        if queries.tied > 1:
            ties.append(tie_row(family, name, answers[name], queries.tied))


def query_claims(rows: list[QueryRow]) -> list[Claim]:
    """Return what must hold for the kernel's form in every family, and what was found."""
    ours = [row for row in rows if row.form == KERNEL]
    asked = f"of {sum(row.queries for row in ours):,} queries"
    wrong, missed, false = (sum(getattr(row, name) for row in ours) for name in ("wrong", "missed", "false"))
    deepest = max(row.depth_rho for row in ours)
    return [
        Claim(
            "Every answer is the exact tick, grazes and tangency included",
            f"{wrong:,} {asked} differ from the integer truth",
            not wrong,
        ),
        Claim("No contact is missed", f"{missed:,} {asked}", not missed),
        Claim("No contact is invented", f"{false:,} {asked}", not false),
        Claim(
            "Discs anchored at a contact overlap by no more than the rounding of their places, rho",
            f"at most {number(deepest)} rho",
            deepest <= 1.0,
        ),
    ]


def _other_claims(ties: list[TieRow], links: list[ChainRow]) -> list[Claim]:
    """Return what must hold beyond single queries."""
    tied = [row for row in ties if row.form == KERNEL]
    chained = [row for row in links if row.chain in LINES]
    return [
        Claim(
            "Contacts of one exact time have one tick",
            "; ".join(f"{row.same:.0%} of {row.groups:,} groups ({row.family})" for row in tied),
            all(row.spread == 0 for row in tied),
        ),
        Claim(
            "Chains on a line keep the order of their contacts",
            f"{sum(row.wrong for row in chained)} of {sum(row.runs for row in chained)} are wrong",
            not any(row.wrong for row in chained),
        ),
    ]


def query_findings(rows: list[QueryRow]) -> list[str]:
    """Say what the rows of all families and forms show."""
    ours = [row for row in rows if row.form == KERNEL]
    others = [row for row in rows if row.form != KERNEL]
    return [_exact(ours), _depths(ours), *_textbook(others), _cost(ours, others)]


def _exact(ours: list[QueryRow]) -> str:
    wrong = [row for row in ours if row.wrong]
    if wrong:
        where = "; ".join(
            f"{row.family}: {row.wrong:,} of {row.queries:,}, {row.missed:,} of them missed and "
            f"{row.false:,} invented"
            for row in wrong
        )
        return f"The kernel's answer is not the exact one ({where})."
    asked = sum(row.queries for row in ours)
    return (
        f"The kernel's answer is the integer truth in each of {asked:,} queries, {len(ours)} families: the "
        "exact tick, nothing missed, nothing invented."
    )


def _depths(ours: list[QueryRow]) -> str:
    most = max(ours, key=lambda row: row.depth_rho)
    return (
        "Up to the exact tick no contact adds to an overlap. Anchoring the discs there does, since places "
        f"are doubles: by at most {number(most.depth_rho)} rho ({most.family}), rho = 16 × 2^-53 × the "
        f"largest coordinate, which {'bounds' if most.depth_rho <= 1.0 else 'DOES NOT bound'} it."
    )


def _textbook(others: list[QueryRow]) -> list[str]:
    """Say of each of the textbook's forms what it gets wrong."""
    found = []
    for form in dict.fromkeys(row.form for row in others):
        rows = [row for row in others if row.form == form]
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
    said = f"A query costs {low:,.0f} to {high:,.0f} ns of CPU time in the kernel's form, by family (medians)"
    if not ratios:
        return f"{said}."
    least, most = number(min(ratios)), number(max(ratios))
    return f"{said}: {least} to {most} times the naive one's, {number(np.median(ratios))} in the middle."


def _tie_findings(ties: list[TieRow]) -> list[str]:
    found = []
    for name, rows in _by_family(ties).items():
        ours = rows.pop(KERNEL)
        theirs = ", ".join(f"{row.same:.0%} ({form})" for form, row in rows.items())
        found.append(
            f"{ours.same:.0%} of {ours.groups:,} groups of {ours.size} contacts of one exact time ({name}) "
            f"get a single tick from the kernel; from the textbook's forms {theirs}."
        )
    return found


def _by_family(ties: list[TieRow]) -> Mapping[str, dict[str, TieRow]]:
    found: dict[str, dict[str, TieRow]] = {}
    for row in ties:
        found.setdefault(row.family, {})[row.form] = row
    return found


def _pictures(rows: list[QueryRow]) -> tuple[Picture, ...]:
    return (
        Picture(
            "error",
            "What the answers are off the exact tick, as a way along the line of centres: the 99th "
            "percentile (mark) and up to the largest (line). At the left edge: less, or exact, or no contact "
            "found.",
            partial(draw_errors, rows),
        ),
        Picture(
            "depth",
            "The deepest overlap of discs that are anchored at the answer, in units of rho, by family and "
            "form; the dashed line is the bound that is proved for exact ticks. At the left edge: less, or "
            "none.",
            partial(draw_depths, rows),
        ),
    )
