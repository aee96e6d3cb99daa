"""Chains of contacts: how an error of one contact is handed on to the next.

On a line, between two walls, one disc or two meet again and again without chaos, and the same is worked out
in 100 digits. In the plane, a disc that has been struck by one up to 1e12 times heavier or lighter meets a
third.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from kinetile.kernel.clock import TICKS
from kinetile.kernel.tables import NEVER
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile_accuracy.parts import Budget, Column
from kinetile_accuracy.queries.families import chains_of_three
from kinetile_accuracy.queries.forms import KERNEL, ask, forms
from kinetile_accuracy.queries.truth import chain_of_three, line_contacts
from kinetile_accuracy.wording import number

__all__ = ["ChainRow", "chain_findings", "chains", "line_chain", "three_discs"]

LENGTHS: dict[Budget, tuple[int, ...]] = {
    "quick": (1, 10, 100, 1_000),
    "normal": (1, 10, 100, 1_000, 10_000),
    "full": (1, 10, 100, 1_000, 10_000, 100_000),
}
RUNS = 4
THREES: dict[Budget, int] = {"quick": 1_000, "normal": 4_000, "full": 20_000}

LINES = {
    "one disc between two walls": (1.0,),
    "two equal discs between two walls": (1.0, 1.0),
    "two discs of mass 1 and 1e12 between two walls": (1.0, 1e12),
}
"""Masses, from left to right."""

DECADES = ((0.0, 4.0), (4.0, 8.0), (8.0, 12.0))
"""Powers of ten between which the mass ratios of a row lie."""


@dataclass(frozen=True)
class ChainRow:
    """How far the times of contact are off after so many contacts; R at a wall is the radius."""

    chain: Annotated[str, Column("what meets what", "chain")]
    runs: Annotated[int, Column("how many chains, each with another start", "runs")]
    contacts: Annotated[int, Column("of each; the last one counts", "contacts")]
    wrong: Annotated[int, Column("chains in which another contact took place, or none", "wrong")]
    error_median: Annotated[float, Column("error of the last time x closing speed / R", "error / R, median")]
    error_max: Annotated[float, Column("the largest of these", "max")]
    ticks_max: Annotated[float, Column("the largest error in ticks", "ticks, max")]


def chains(budget: Budget) -> list[ChainRow]:
    """Measure all chains."""
    rows = []
    for name, mass in LINES.items():
        rows += line_chain(name, mass, LENGTHS[budget])
    return rows + three_discs(THREES[budget])


def line_chain(name: str, mass: tuple[float, ...], lengths: tuple[int, ...]) -> list[ChainRow]:
    """Return a row for each length of chains of discs on a line in a unit box."""
    offs: dict[int, list[tuple[float, float]]] = {length: [] for length in lengths}
    wrong = dict.fromkeys(lengths, 0)
    for seed in range(1, RUNS + 1):
        draws = np.random.default_rng([seed, len(mass)])
        radius = draws.uniform(0.02, 0.08, len(mass))
        x = draws.uniform(0.2, 0.4, len(mass)) + 0.4 * np.arange(len(mass))
        v = draws.uniform(0.4, 1.0, len(mass)) * draws.choice([-1.0, 1.0], len(mass))
        v /= np.sqrt(mass)
        scene = Scene(
            np.column_stack([x, np.full_like(x, 0.5)]),
            np.column_stack([v, np.zeros_like(v)]),
            radius,
            np.array(mass),
            arena=(1.0, 1.0),
        )
        simulation = Simulation(scene, "naive")
        simulation.run(max_contacts=lengths[-1])
        contacts = simulation.contacts
        truth = line_contacts(x.tolist(), v.tolist(), radius.tolist(), list(mass), 1.0, lengths[-1])
        bodies = np.column_stack([contacts["a"], contacts["b"]])
        right = np.logical_and.accumulate((bodies == [(true.a, true.b) for true in truth]).all(axis=1))
        for length in lengths:
            at = length - 1
            if not right[at]:
                wrong[length] += 1
                continue
            ticks = int(contacts["epoch"][at]) * TICKS + int(contacts["tick"][at])
            true = truth[at]
            reach = float(radius[true.a] + (radius[true.b] if true.b >= 0 else 0.0))
            offs[length].append((true.ticks_off(ticks), true.closing / reach))
    return [_row(name, RUNS, length, wrong[length], offs[length]) for length in lengths]


def three_discs(count: int) -> list[ChainRow]:
    """Return a row for each range of mass ratios of chains of three discs."""
    meet = forms()[KERNEL]
    before, mass, then = chains_of_three(count)
    ticks = ask(meet, then)
    decades = np.abs(np.log10(mass[:, 0] / mass[:, 1]))
    offs: dict[tuple[float, float], list[tuple[float, float]]] = {decade: [] for decade in DECADES}
    wrong, runs = dict.fromkeys(DECADES, 0), dict.fromkeys(DECADES, 0)
    chain = zip(before.plans(), mass.tolist(), then.plans(), ticks.tolist(), decades.tolist(), strict=True)
    for (one, two), weights, (struck, third), tick, power in chain:
        decade = next(each for each in DECADES if power <= each[1])
        true = chain_of_three((one, two, third), (weights[0], weights[1]))
        runs[decade] += 1
        if (true is None) != (tick == NEVER):
            wrong[decade] += 1
        elif true is not None:
            offs[decade].append((true.ticks_off(tick), true.closing / (struck.radius + third.radius)))
    return [
        _row(
            f"a third disc, mass ratio 1e{decade[0]:g} to 1e{decade[1]:g}",
            runs[decade],
            2,
            wrong[decade],
            found,
        )
        for decade, found in offs.items()
    ]


def _row(name: str, runs: int, length: int, wrong: int, offs: list[tuple[float, float]]) -> ChainRow:
    """Return the row of contacts that are so many ticks off, each with its closing speed over R."""
    ticks = [off for off, _ in offs] or [math.nan]
    errors = [off / TICKS * speed for off, speed in offs] or [math.nan]
    return ChainRow(name, runs, length, wrong, float(np.median(errors)), max(errors), max(ticks))


def _growth(chain: list[ChainRow]) -> str:
    """Say with which power of the contacts the error grows at the end of a chain."""
    if len(chain) < 2 or not chain[-2].ticks_max > 0.0:
        return ""
    before, last = chain[-2:]
    power = math.log(last.ticks_max / before.ticks_max) / math.log(last.contacts / before.contacts)
    return f", and grows as contacts^{power:.1f}"


def chain_findings(rows: list[ChainRow]) -> list[str]:
    """Say how the error grows along chains on a line, and what an exchange adds."""
    found = []
    for name in LINES:
        chain = [row for row in rows if row.chain == name]
        last = chain[-1]
        if any(row.wrong for row in chain):
            found.append(
                f"{name.capitalize()}: the order of the contacts is wrong in {last.wrong} of {last.runs}."
            )
            continue
        found.append(
            f"{name.capitalize()}: after {last.contacts:,} contacts the last is at most "
            f"{number(last.error_max)} R off, {number(last.ticks_max / last.contacts)} ticks for each "
            f"contact{_growth(chain)}."
        )
    threes = [row for row in rows if row.chain not in LINES]
    worst = max(threes, key=lambda row: row.error_max)
    wrong = sum(row.wrong for row in threes)
    found.append(
        "A disc struck by one up to 1e12 times heavier or lighter meets a third at most "
        f"{number(worst.error_max)} R off ({worst.chain.removeprefix('a third disc, ')}); hit or miss "
        f"is wrong in {wrong} of {sum(row.runs for row in threes):,}."
    )
    return found
