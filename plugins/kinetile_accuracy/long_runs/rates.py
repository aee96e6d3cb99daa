"""The part ``rates`` of the report: contacts of two discs in a unit of time, which are known exactly.

Chaos forbids to compare long trajectories, and is what makes averages comparable: a billiard visits all its
states evenly, so the rate at which two discs in a box meet each other and the walls is a ratio of volumes.
For discs of diameter d with unit masses, sum of squared speeds v^2, in a box W x H, w = W - d and h = H - d::

    volume     w^2 h^2 - (pi d^2 w h - 4/3 d^3 (w + h) + d^4 / 2)                  (d <= w, h)
    disc-disc  (2 v / 3 pi) sqrt(2) (2 pi d w h - 4 d^2 (w + h) + 2 d^3) / volume
    x walls    (2 v / 3 pi) 4 (w h^2 - pi d^2 h / 2 + 2/3 d^3) / volume            y walls: w and h exchanged

(mean free time of a billiard; Zapfe, Sanders and Rodriguez-Mota, arXiv 1908.04749, treat this box.) A run is
cut into blocks of equal time; the mean of the blocks' rates has a standard error, and the distance from the
exact rate is given in standard errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

import kinetile as kt
from kinetile.toolbox import BOTTOM, LEFT, RIGHT, TOP
from kinetile_accuracy.long_runs.drift import contacts_of
from kinetile_accuracy.sections import Budget, Claim, Column, ReportProgress, Section, Table

CONTACTS: dict[Budget, int] = {"quick": 2 * 10**6, "normal": 2 * 10**7, "full": 10**8}
"""Contacts of two discs in a box."""

BLOCKS = 200
BOXES = ((0.15, 1.0, 1.0), (0.1, 1.5, 1.0))
"""Radius, width and height."""

KINDS = {"disc-disc": (1,), "x walls": (LEFT, RIGHT), "y walls": (BOTTOM, TOP)}
"""The kinds of contacts, each with the second bodies that it has in the log."""


@dataclass(frozen=True)
class Rate:
    """A rate, measured and exactly."""

    scene: Annotated[str, Column("which", "scene")]
    what: Annotated[str, Column("which contacts are counted", "contacts")]
    contacts: Annotated[int, Column("how many there were of all kinds")]
    rate: Annotated[float, Column("contacts of this kind in a unit of time", "rate")]
    error: Annotated[float, Column("standard error of the rate, from blocks", "standard error")]
    theory: Annotated[float, Column("the rate in theory", "exactly")]
    off: Annotated[float, Column("(rate - theory) / standard error", "standard errors off")]


def two_disc_rates(radius: float, width: float, height: float, speed2: float) -> tuple[float, float, float]:
    """Returns the exact rates of disc-disc contacts and of both discs' contacts with the x and the y walls.

    Args:
        radius: of both discs.
        width, height: of the box.
        speed2: the sum of their squared speeds; the masses are equal.
    """
    d = 2.0 * radius
    w, h = width - d, height - d
    if not 0.0 < d <= min(w, h):
        raise ValueError(f"the formula needs discs that can pass each other: {d} is not at most {min(w, h)}")
    volume = w * w * h * h - (math.pi * d * d * w * h - 4.0 / 3.0 * d**3 * (w + h) + d**4 / 2.0)
    unit = 2.0 * math.sqrt(speed2) / (3.0 * math.pi) / volume
    pair = math.sqrt(2.0) * (2.0 * math.pi * d * w * h - 4.0 * d * d * (w + h) + 2.0 * d**3)
    x_walls = 4.0 * (w * h * h - math.pi * d * d * h / 2.0 + 2.0 / 3.0 * d**3)
    y_walls = 4.0 * (h * w * w - math.pi * d * d * w / 2.0 + 2.0 / 3.0 * d**3)
    return pair * unit, x_walls * unit, y_walls * unit


def two_discs(
    radius: float, width: float, height: float, contacts: int, progress: ReportProgress
) -> list[Rate]:
    """Runs two discs in a box for about this many contacts; returns their three rates."""
    scene = kt.Scene(
        position=[(0.3 * width, 0.4 * height), (0.7 * width, 0.63 * height)],
        velocity=[(0.6, math.sqrt(0.5)), (-math.sqrt(0.5), 0.8)],
        radius=radius,
        arena=(width, height),
    )
    theories = two_disc_rates(radius, width, height, float((scene.velocity**2).sum()))
    sim = kt.Simulation(scene, "naive", keep_contacts=False)
    name = f"two discs of radius {radius:g} in {width:g} x {height:g}"
    length = contacts / sum(theories) / BLOCKS
    counts = np.zeros((BLOCKS, len(KINDS)))
    for block in range(BLOCKS):

        def count(rows: npt.NDArray[np.void], here: npt.NDArray[np.float64] = counts[block]) -> None:
            here += [np.isin(rows["b"], partners).sum() for partners in KINDS.values()]

        sim.run(until=(block + 1) * length, recorder=count)
        progress(name, block + 1, BLOCKS)
    means = counts.mean(axis=0) / length
    errors = counts.std(axis=0, ddof=1) / length / math.sqrt(BLOCKS)
    return [
        Rate(name, kind, contacts_of(sim), mean, error, theory, (mean - theory) / error)
        for kind, mean, error, theory in zip(KINDS, means.tolist(), errors.tolist(), theories, strict=True)
    ]


def measure(budget: Budget, progress: ReportProgress) -> Section:
    """Measures the rates of two discs in two boxes."""
    rates = [rate for box in BOXES for rate in two_discs(*box, CONTACTS[budget], progress)]
    worst = max(rates, key=lambda rate: abs(rate.off))
    within = sum(abs(rate.off) <= 3.0 for rate in rates)
    return Section(
        name="rates",
        title="Rates known in theory",
        about=(
            f"Two discs with unit masses in a box, sum of squared speeds 2, about {CONTACTS[budget]:,} "
            f"contacts, in {BLOCKS} blocks of equal time."
        ),
        findings=(),
        tables=(
            Table("rates", "Contacts in a unit of time, with the standard error over blocks.", tuple(rates)),
        ),
        claims=(
            Claim(
                "Two discs meet each other and the walls at the exact rates, within three standard errors",
                f"{within} of {len(rates)} rates; the furthest is {abs(worst.off):.1f} standard errors off",
                abs(worst.off) <= 3.0,
            ),
        ),
    )
