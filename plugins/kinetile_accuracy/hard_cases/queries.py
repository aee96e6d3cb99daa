"""The part ``queries`` of the report: the contact time of two discs in hard cases, and the errors of answers.

The kernel's answer must be the exact tick, and discs that are anchored at their tick must not overlap by more
than the proved bound. The answer comes from the hook that the main loop calls for the narrow phase ``disc``;
the textbook's answer beside it shows the difficulty. Families are never pooled.
"""

from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Annotated, Any

import numpy as np

import kinetile as kt
from kinetile.instruments import allocate, compose, disowned, to_be_filled_in
from kinetile.toolbox import NEVER, Kernel, Plan, positions_after
from kinetile_accuracy import sections
from kinetile_accuracy.drawing import LOOKS, legend_below, new_figure
from kinetile_accuracy.hard_cases.families import FAMILIES, Family, Queries, Ticks
from kinetile_accuracy.sections import Column, number
from kinetile_accuracy.specification.arithmetic import UNIT_TICKS, FlightPlan, Separation
from kinetile_accuracy.specification.touching import touching_tick

COUNTS: dict[sections.Budget, int] = {"quick": 4_000, "normal": 20_000, "full": 100_000}
KERNEL, TEXTBOOK = "kernel", "textbook"


@dataclass(frozen=True)
class QueryRow:
    """The answers of one form to one family; R is the sum of the radii."""

    family: Annotated[str, Column("the family's name", "family")]
    about: Annotated[str, Column("what its queries are")]
    form: Annotated[str, Column("the kernel's form, or the textbook's", "form")]
    queries: Annotated[int, Column("how many", "queries")]
    hits: Annotated[int, Column("how many of them meet", "hits")]
    wrong: Annotated[int, Column("answers that are not the exact tick, or not the exact none", "wrong")]
    missed: Annotated[int, Column("contacts that were not found", "missed")]
    false: Annotated[int, Column("contacts that were found but do not exist", "false")]
    depth: Annotated[float, Column("the deepest overlap once both are anchored at the tick", "depth / R")]
    depth_rho: Annotated[float, Column("the same by rho, the bound of that rounding", "depth / rho")]


def measure(budget: sections.Budget, progress: sections.ReportProgress) -> sections.Section:
    """Computes every family with both forms."""
    rows: list[QueryRow] = []
    for done, family in enumerate(FAMILIES):
        progress(f"queries: {family.name}", done, len(FAMILIES))
        queries = family.draw(COUNTS[budget])
        rows.append(query_row(family, KERNEL, queries, kernel_ticks(queries)))
        rows.append(query_row(family, TEXTBOOK, queries, textbook_ticks(queries)))
    progress("queries", len(FAMILIES), len(FAMILIES))
    return sections.Section(
        name="queries",
        title="When two discs meet: hard cases",
        about=(
            f"{COUNTS[budget]:,} queries of each family, put to the kernel's form (narrow phase disc) and to "
            "the textbook's, (-b - sqrt(b^2 - ac)) / a, in ticks of 2^-52, rounded down. Whether two discs "
            "meet, and the tick, is computed in exact integers. Depth is how far the discs overlap when "
            "both are anchored at the tick, which rounds their places to doubles."
        ),
        findings=query_findings(rows),
        tables=(sections.Table("families", "Each family put to each form.", tuple(rows)),),
        pictures=(
            sections.ReportFigure(
                "depth",
                "The deepest overlap of discs that are anchored at the answer, in units of rho, by family "
                "and form; the dashed line is the bound that is proved for exact ticks. At the left edge: "
                "less, or none.",
                lambda: draw_rows(rows),
            ),
        ),
        claims=query_claims(rows),
        left_out=(
            "Contacts 1,024 units of time or more after the later anchor: bodies are anchored again before.",
        ),
    )


def query_claims(rows: list[QueryRow]) -> tuple[sections.Claim, ...]:
    """Returns the claims on the kernel's form in every family, with the measured values."""
    ours = [row for row in rows if row.form == KERNEL]
    of_all = f"of {sum(row.queries for row in ours):,} queries"
    wrong, missed, false = (sum(getattr(row, name) for row in ours) for name in ("wrong", "missed", "false"))
    deepest = max(row.depth_rho for row in ours)
    exact = "Every answer is the exact tick, grazes, tangency and simultaneous contacts included"
    found = f"{wrong:,} {of_all} differ from the integer one: {missed:,} contacts missed, {false:,} invented"
    shallow = "Discs anchored at a contact overlap by no more than the rounding of their places, rho"
    return (
        sections.Claim(exact, found, not wrong),
        sections.Claim(shallow, f"at most {number(deepest)} rho", deepest <= 1.0),
    )


def query_findings(rows: list[QueryRow]) -> tuple[str, ...]:
    """Returns the results of all families beyond the claims, in sentences."""
    others = [row for row in rows if row.form == TEXTBOOK]
    worst = max(others, key=lambda row: row.depth)
    shares = [row.wrong / row.queries for row in others]
    missed, false = (sum(getattr(row, name) for row in others) for name in ("missed", "false"))
    return (
        f"The textbook's form: {min(shares):.0%} to {max(shares):.0%} of the answers, by family, are not the "
        f"exact ones; it misses {missed:,} contacts and invents {false:,}; discs overlap by up "
        f"to {number(worst.depth)} R ({worst.family}).",
    )


def query_row(family: Family, form: str, queries: Queries, ticks: Ticks) -> QueryRow:
    """Returns the row of a form's answers to queries, compared with the exact ticks."""
    plans = queries.plans()
    exact = [touching_tick(None, Separation(*pair)) for pair in plans]
    answers = [None if tick == NEVER else tick for tick in ticks.tolist()]
    pairs = list(zip(answers, exact, strict=True))
    depths = [
        depth_at(pair, found)
        for pair, found, right in zip(plans, answers, exact, strict=True)
        if found is not None and right is not None
    ]
    return QueryRow(
        family=family.name,
        about=family.about,
        form=form,
        queries=len(pairs),
        hits=sum(right is not None for right in exact),
        wrong=sum(found != right for found, right in pairs),
        missed=sum(found is None and right is not None for found, right in pairs),
        false=sum(found is not None and right is None for found, right in pairs),
        depth=max((by_reach for by_reach, _ in depths), default=0.0),
        depth_rho=max((by_rho for _, by_rho in depths), default=0.0),
    )


def depth_at(plans: tuple[FlightPlan, FlightPlan], tick: int) -> tuple[float, float]:
    """Returns the overlap of two discs once both are anchored at a tick, less their overlap at the later
    anchor, in R and in rho = 16 u X, with X the largest coordinate of the flight and u = 2^-53."""
    pair = Separation(*plans)
    places = [plan.moved(tick, 1.0 / UNIT_TICKS)[0] for plan in plans]
    coordinates = [*places[0], *places[1], *(each for plan in plans for each in (plan.x, plan.y))]
    with localcontext(prec=60):
        reach, *start = (Decimal(whole) / (1 << pair.bits) for whole in (pair.reach, *pair.ways[0]))
        end = [Decimal(far) - Decimal(near) for near, far in zip(*places, strict=True)]
        before, after = ((x * x + y * y).sqrt() for x, y in (start, end))
        depth = max(min(before, reach) - after, Decimal(0))
        return float(depth / reach), float(depth) / (16.0 * 2.0**-53 * max(map(abs, coordinates)))


# The forms


def textbook_ticks(queries: Queries) -> Ticks:
    """Returns the ticks, (m,), by (-b - sqrt(b^2 - ac)) / a, from the later of two anchors on."""
    since = queries.anchor.max(axis=1)
    flown = (since[:, None] - queries.anchor) / UNIT_TICKS
    place = positions_after(Plan.of_vectors(queries.position, queries.velocity), flown)
    d, v = place[:, 1] - place[:, 0], queries.velocity[:, 1] - queries.velocity[:, 0]
    a, b = (v * v).sum(axis=1), (d * v).sum(axis=1)
    root = b * b - a * ((d * d).sum(axis=1) - queries.radius.sum(axis=1) ** 2)
    after = np.maximum((-b - np.sqrt(np.maximum(root, 0.0))) / a, 0.0)
    met = (b < 0.0) & (root > 0.0) & (after < 1024.0)
    return np.where(met, since + (np.where(met, after, 0.0) * UNIT_TICKS).astype(np.int64), NEVER)


meet = to_be_filled_in


def ticks_of_all(k: Kernel, answers: Any) -> None:
    """Writes the ticks of bodies 2i and 2i + 1 by ``meet``, for every i."""
    k = disowned(k)
    for i in range(len(answers)):
        answers[i] = meet(k, 2 * i, 2 * i + 1)


def kernel_ticks(queries: Queries) -> Ticks:
    """Returns the kernel's ticks, (m,); NEVER for no contact. Raises RuntimeError for a fault."""
    k = allocate(2 * len(queries), near=0, log_rows=0)  # the discs of query i are the bodies 2i and 2i + 1
    k.bodies.x, k.bodies.y = queries.position.reshape(-1, 2).T
    k.bodies.vx, k.bodies.vy = queries.velocity.reshape(-1, 2).T
    k.bodies.radius = queries.radius.ravel()
    k.bodies.anchor = queries.anchor.ravel()
    k.bodies.last = -1
    clock = k.clock[0]
    clock.per_tick, clock.per_time = 1.0 / UNIT_TICKS, float(UNIT_TICKS)
    scene = kt.Scene([(0.0, 0.0), (3.0, 0.0)], [(0.0, 0.0), (0.0, 0.0)], 1.0, mass=[1.0, 2.0])
    disc = kt.registry().target("narrow phase", "disc")().prepare(scene)
    answers = np.zeros(len(queries), np.int64)
    compose(ticks_of_all, {"meet": disc.meet}, "ask", Kernel)(k, answers)
    if clock.fault.code:
        raise RuntimeError(f"fault {clock.fault.code} at the bodies of query {clock.fault.a // 2}")
    return answers


def draw_rows(rows: list[QueryRow]) -> sections.Figure:
    """Draws the depth of each row, families one below the other."""
    families = list(dict.fromkeys(row.family for row in rows))
    figure, panel = new_figure(1, height=1.0 + 0.26 * len(families))
    panel.set(xscale="log", ylim=(len(families) - 0.5, -0.5), xlabel="deepest overlap at the answer / rho")
    panel.set_yticks(range(len(families)), families)
    panel.tick_params(axis="y", length=0)
    panel.grid(True, axis="y")
    for form, (colour, marker, _) in zip((KERNEL, TEXTBOOK), LOOKS, strict=False):
        some = [row for row in rows if row.form == form]
        places = [families.index(row.family) for row in some]
        depths = [max(row.depth_rho, 0.02) for row in some]
        panel.plot(depths, places, marker, color=colour, markersize=4, clip_on=False, label=form)
    panel.axvline(1.0, color="black", linewidth=0.9, linestyle="--", zorder=1)
    panel.set_xlim(left=0.015)
    legend_below(figure, 2)
    return figure
