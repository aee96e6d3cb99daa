"""The part of the report on queries: when do two discs meet, and how right is the answer?

Each hard family (``families``) is put to the kernel's own form and to the textbook's (``forms``), and each
answer is judged by the exact truth (``truth``).
Families are never pooled: an average over easy and hard questions says nothing about either.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
import numpy.typing as npt

from kinetile.accuracy.parts import Budget, Claim, Column, Picture, Progress, Section, Table, grouped
from kinetile.accuracy.queries.chains import LINES, ChainRow, chain_findings, chains
from kinetile.accuracy.queries.climbing import Climb, climb
from kinetile.accuracy.queries.families import FAMILIES, LATER, Family
from kinetile.accuracy.queries.figures import draw_depths, draw_errors
from kinetile.accuracy.queries.forms import KERNEL, ask, batch_times, forms
from kinetile.accuracy.queries.truth import Encounter
from kinetile.accuracy.queries.verdicts import QueryRow, TieRow, Verdict, judge, query_row, tie_row
from kinetile.accuracy.wording import number
from kinetile.kernel.tables import NEVER

__all__ = ["measure", "query_findings"]

COUNTS: dict[Budget, int] = {"quick": 4_000, "normal": 20_000, "full": 100_000}
"""Queries of a family."""

BATCH = 500
BATCHES: dict[Budget, int] = {"quick": 100, "normal": 400, "full": 1_000}
"""Queries that are timed together, and how many such batches at least."""

ROUNDS: dict[Budget, int] = {"quick": 20, "normal": 60, "full": 300}
"""Rounds of climbing for the deepest overlap."""


@dataclass(frozen=True)
class Hardness:
    """What makes a family hard."""

    family: Annotated[str, Column("the family's name", "family")]
    about: Annotated[str, Column("what its queries are", "what makes it hard")]


def measure(budget: Budget, progress: Progress) -> Section:
    """Put every family to every form, and follow chains of contacts."""
    rows: list[QueryRow] = []
    ties: list[TieRow] = []
    kernel: dict[str, npt.NDArray[np.int64]] = {}
    steps = len(FAMILIES) + 1
    for done, family in enumerate(FAMILIES):
        progress(f"queries: {family.name}", done, steps)
        kernel[family.name] = _put(family, budget, rows, ties)[KERNEL]
    progress("queries: chains of contacts", len(FAMILIES), steps)
    links = chains(budget)
    deepest = climb(ROUNDS[budget])
    progress("queries", steps, steps)
    later = _moved(kernel["anchors apart"], kernel["late clock"])
    about = (
        f"{COUNTS[budget]:,} queries of each family, asked of the form that the kernel is composed with "
        "(narrow phase disc) and of three from textbooks, on the kernel's own tables and in its ticks of "
        "2^-52, rounded down. Whether two discs meet is judged in exact integers, and when, to 160 bits "
        "behind the tick. An error of time is told as the way along the line of centres that it amounts to, "
        "over the sum of the radii R; depth is how far the discs overlap by the computed time. The ticks "
        "off are between the answer and the last tick before the contact, so they are the formula's own "
        f"error, without the clock's. ns are CPU time in a loop over {BATCH} independent queries, less an "
        "empty loop's; inside a run a query waits for memory as well."
    )
    families = tuple(Hardness(family.name, family.about) for family in FAMILIES)
    chained = "Two bodies that meet again and again, against 100 digits; a third disc after an exchange."
    return Section(
        name="queries",
        title="When two discs meet",
        about=about,
        findings=(
            *query_findings(rows, deepest),
            _clock_finding(*later),
            *_tie_findings(ties),
            *chain_findings(links),
        ),
        tables=(
            Table("families", "Each family put to each form.", tuple(rows)),
            Table("ties", "Contacts that are simultaneous in truth.", tuple(ties)),
            Table("chains", chained, tuple(links)),
            Table("hardness", "The families.", families),
        ),
        pictures=_pictures(rows),
        claims=(*query_claims(rows, deepest), *_other_claims(later, ties, links)),
        left_out=(
            "Long chains in the plane: two discs in a box are chaotic. For them see the certified oracle.",
            "Contacts more than 1,024 units of time after the later anchor: the kernel anchors bodies anew "
            "before.",
        ),
    )


def _put(
    family: Family, budget: Budget, rows: list[QueryRow], ties: list[TieRow]
) -> Mapping[str, npt.NDArray[np.int64]]:
    """Put one family to every form and add its rows; return the answers of each form."""
    queries = family.draw(COUNTS[budget])
    answers = {name: ask(form, queries) for name, form in forms().items()}
    verdicts: dict[str, list[Verdict]] = {name: [] for name in answers}
    given = zip(*(answer.tolist() for answer in answers.values()), strict=True)
    for plans, ticks in zip(queries.plans(), given, strict=True):
        encounter = Encounter(*plans)
        for name, tick in zip(answers, ticks, strict=True):
            verdicts[name].append(judge(encounter, tick))
    times = batch_times(forms(), queries, BATCH, BATCHES[budget])
    for name in answers:
        rows.append(query_row(family, queries, name, verdicts[name], times[name]))
        if queries.tied > 1:
            ties.append(tie_row(family, name, answers[name], queries.tied))
    return answers


def query_claims(rows: list[QueryRow], deepest: Climb) -> list[Claim]:
    """Return what must hold for the kernel's form in every family, and what was found."""
    ours = [row for row in rows if row.form == KERNEL]
    asked = sum(row.queries for row in ours)
    outside = sum(row.outside_dead_zone for row in ours)
    false = sum(row.false_positives for row in ours)
    sampled = max(row.depth_proved for row in ours)
    return [
        Claim("No contact outside the dead zone is missed", f"{outside:,} of {asked:,} queries", not outside),
        Claim("No contact is invented", f"{false:,} of {asked:,} queries", not false),
        Claim(
            "No overlap at a computed contact passes the proved bound, eta",
            f"at most {number(sampled)} eta in the sample, {number(deepest.depth_proved)} eta by climbing",
            max(sampled, deepest.depth_proved) <= 1.0,
        ),
    ]


def _other_claims(later: tuple[int, int], ties: list[TieRow], links: list[ChainRow]) -> list[Claim]:
    """Return what must hold beyond single queries."""
    copies = next(row for row in ties if row.form == KERNEL and "copies" in row.family)
    chained = [row for row in links if row.chain in LINES]
    return [
        Claim(
            "A late clock changes no answer", f"{later[0]:,} of {later[1]:,} are other ticks", not later[0]
        ),
        Claim(
            "Moved, turned and mirrored copies of a contact have one tick",
            f"{copies.same:.0%} of {copies.groups:,} groups",
            copies.spread == 0,
        ),
        Claim(
            "Chains on a line keep the order of their contacts",
            f"{sum(row.wrong for row in chained)} of {sum(row.runs for row in chained)} are wrong",
            not any(row.wrong for row in chained),
        ),
    ]


def query_findings(rows: list[QueryRow], deepest: Climb) -> list[str]:
    """Say what the rows of all families and forms show."""
    ours = [row for row in rows if row.form == KERNEL]
    others = [row for row in rows if row.form != KERNEL]
    return [
        _missed(ours),
        _false(ours),
        *_depths(ours, deepest),
        _textbook(ours, others),
        _cost(ours, others),
    ]


def _missed(ours: list[QueryRow]) -> str:
    outside = [row for row in ours if row.outside_dead_zone]
    if outside:
        where = "; ".join(
            f"{row.family}: {row.outside_dead_zone} of {row.false_negatives:,}, the deepest "
            f"{row.deepest_in_zones:.3f} times what is documented"
            for row in outside
        )
        return f"The kernel misses contacts outside the dead zone that it documents ({where})."
    asked = sum(row.queries for row in ours)
    said = (
        f"No false negative of the kernel outside its dead zone in any of {len(ours)} families, "
        f"{asked:,} queries"
    )
    inside = "; ".join(
        f"{row.family}: {row.false_negatives:,} of {row.hits:,} hits, at most "
        f"{number(row.deepest_missed)} R deep"
        for row in ours
        if row.false_negatives
    )
    return f"{said}. Inside it: {inside}." if inside else f"{said}; none inside it either."


def _false(ours: list[QueryRow]) -> str:
    wrong = [row for row in ours if row.false_positives]
    if not wrong:
        return "No false positive of the kernel in any family."
    where = "; ".join(
        f"{row.family}: {row.false_positives}, passing with {number(row.widest_false)} R" for row in wrong
    )
    return f"The kernel finds contacts that are none ({where})."


def _depths(ours: list[QueryRow], deepest: Climb) -> list[str]:
    found = []
    for apart, rows in grouped(ours, "anchors_apart").items():
        most = max(rows, key=lambda row: row.depth_proved)
        verdict = "nowhere passed" if most.depth_proved <= 1.0 else "passed"
        bound = (
            f"The proved bound, eta, is {verdict}: the sample's largest is {number(most.depth_proved)} of it "
            f"({most.family})."
        )
        if apart:
            where = ", ".join(f"{row.family} {number(row.depth_separation)}" for row in rows)
            extent = max(row.depth_extent for row in rows)
            found.append(
                "Where one disc was anchored before the other its place at the later anchor is rounded to "
                "the doubles of its coordinates, whatever the form: the sampled maximum of the overlap is "
                f"{extent:.2f} × 2^-53 × (separation + largest coordinate), which in units of 2^-53 × "
                f"separation makes: {where}. {bound}"
            )
        else:
            widest = max(rows, key=lambda row: row.depth_separation)
            found.append(
                "Where both discs are anchored at one tick the sampled maximum of the overlap at a contact "
                f"that the kernel computed is {widest.depth_separation:.2f} × 2^-53 × the separation "
                f"({widest.family}; {sum(row.hits for row in rows):,} contacts). {bound}"
            )
    return [
        *found,
        f"Climbing, which changes the deepest of {deepest.queries:,} queries again and again, finds an "
        f"overlap of {deepest.depth_separation:.2f} × 2^-53 × the separation, and one of "
        f"{number(deepest.depth_proved)} eta: a sample's maximum is no bound.",
    ]


def _textbook(ours: list[QueryRow], others: list[QueryRow]) -> str:
    best = {row.family: row for row in ours}
    worst = max(others, key=lambda row: row.depth)
    naive = {row.family: row for row in others if row.form == "naive"}
    missed = sum(row.outside_dead_zone for row in naive.values())
    false = sum(row.false_positives for row in naive.values())
    least, most = _ratios(others, "citardauq", naive)
    return (
        f"The textbook's forms reach an overlap of {number(worst.depth)} R ({worst.form}, {worst.family}) "
        f"where the kernel's reaches {number(best[worst.family].depth)} R; the naive one misses {missed:,} "
        f"contacts deeper than the kernel's dead zone and finds {false:,} that are none. Citardauq's depth "
        f"is {least:.2f} to {most:.2f} times the naive one's: it is b^2 - ac that costs, not the last "
        "subtraction."
    )


def _ratios(rows: list[QueryRow], form: str, naive: Mapping[str, QueryRow]) -> tuple[float, float]:
    """Return between what a form's depths lie, relative to the naive form's."""
    of = [
        row.depth / naive[row.family].depth
        for row in rows
        if row.form == form and naive[row.family].depth > 0
    ]
    return (min(of), max(of)) if of else (1.0, 1.0)


def _cost(ours: list[QueryRow], others: list[QueryRow]) -> str:
    naive = {row.family: row.ns_median for row in others if row.form == "naive"}
    ratios = [row.ns_median / naive[row.family] for row in ours if naive[row.family] > 0.0]
    low, high = min(row.ns_median for row in ours), max(row.ns_median for row in ours)
    said = f"A query costs {low:.1f} to {high:.1f} ns in the kernel's form, by family (medians)"
    return f"{said}: {np.median(ratios):.1f} times the naive one's." if ratios else f"{said}."


def _moved(early: npt.NDArray[np.int64], late: npt.NDArray[np.int64]) -> tuple[int, int]:
    """Return how many answers under a late clock are not those under an early one, moved; and of how many."""
    return int((np.where(early == NEVER, NEVER, early + LATER) != late).sum()), len(late)


def _clock_finding(differ: int, asked: int) -> str:
    later = f"{LATER >> 52} units of time later"
    if differ:
        return f"{later} {differ:,} of {asked:,} answers are other ticks."
    return f"{later} each of {asked:,} answers is the same tick, moved by just that."


def _tie_findings(ties: list[TieRow]) -> list[str]:
    found = []
    for row in ties:
        if row.form == KERNEL:
            groups = f"{row.groups:,} groups of {row.size} contacts of one exact time ({row.family})"
            apart = (
                "some are not found"
                if row.spread is None
                else f"the rest is at most {row.spread} ticks apart"
            )
            found.append(
                f"All {groups} get a single tick from the kernel."
                if row.spread == 0
                else f"Of {groups} {row.same:.0%} get a single tick from the kernel; {apart}."
            )
    return found


def _pictures(rows: list[QueryRow]) -> tuple[Picture, ...]:
    return (
        Picture(
            "depth",
            "The deepest overlap at a computed contact in units of eta, by family and form; the dashed line "
            "is the bound that is proved for the kernel's form. At the left edge: never deeper than in "
            "truth, or no contact found.",
            partial(draw_depths, rows),
        ),
        Picture(
            "error",
            "Error of the time of contact as a way along the line of centres: the 99th percentile (mark) "
            "and up to the largest (line). At the left edge: less, or no contact found.",
            partial(draw_errors, rows),
        ),
    )
