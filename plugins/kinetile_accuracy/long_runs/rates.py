"""The part ``rates`` of the report: contacts in a unit of time, known exactly for two discs, nearly for many.

Chaos forbids to compare long trajectories, and is what makes averages comparable: a billiard visits all its
states evenly, so the rate at which two discs in a box meet each other and the walls is a ratio of volumes.
For discs of diameter d with unit masses, sum of squared speeds v^2, in a box W x H, w = W - d and h = H - d::

    volume     w^2 h^2 - (pi d^2 w h - 4/3 d^3 (w + h) + d^4 / 2)                  (d <= w, h)
    disc-disc  (2 v / 3 pi) sqrt(2) (2 pi d w h - 4 d^2 (w + h) + 2 d^3) / volume
    x walls    (2 v / 3 pi) 4 (w h^2 - pi d^2 h / 2 + 2/3 d^3) / volume            y walls: w and h exchanged

(mean free time of a billiard; Zapfe, Sanders and Rodriguez-Mota, arXiv 1908.04749, treat this box.) A run is
cut into blocks of equal time; the mean of the blocks' rates has a standard error, and the distance from the
exact rate is given in standard errors.

For many discs Enskog's theory gives the rate of a dense gas without walls, n^2/2 4r chi sqrt(pi/2) v / A with
chi = (1 - 7 phi / 16) / (1 - phi)^2 and v the root mean square speed. It is an approximation, to some per
cent with walls that near, and a check of orders only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
import numpy.typing as npt

import kinetile as kt
from kinetile_accuracy.drawing import LOOKS, new_figure
from kinetile_accuracy.long_runs.drift import contacts_of
from kinetile_accuracy.sections import (
    Budget,
    Claim,
    Column,
    ReportFigure,
    ReportProgress,
    Section,
    Table,
    grouped,
    listed,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONTACTS: dict[Budget, int] = {"quick": 2 * 10**6, "normal": 2 * 10**7, "full": 10**8}
"""Contacts of two discs in a box."""

BLOCKS = 200
BOXES = ((0.15, 1.0, 1.0), (0.1, 1.5, 1.0))
"""Radius, width and height."""
VELOCITIES = ((0.6, math.sqrt(0.5)), (-math.sqrt(0.5), 0.8))

MANY = 400
FORGOTTEN = 20
"""Contacts for each of many discs after which those are counted that follow: the grid is forgotten then."""
MANY_CONTACTS: dict[Budget, int] = {"quick": 10**5, "normal": 10**6, "full": 10**7}
DENSITIES = (0.5, 0.25, 0.1, 0.01)


@dataclass(frozen=True)
class Rate:
    """A rate, measured and in theory."""

    scene: Annotated[str, Column("which", "scene")]
    phase: Annotated[str, Column("the broad phase of the run", "broad phase")]
    what: Annotated[str, Column("which contacts are counted", "contacts")]
    contacts: Annotated[int, Column("how many there were of all kinds")]
    rate: Annotated[float, Column("contacts of this kind in a unit of time", "rate")]
    error: Annotated[float, Column("standard error of the rate, from blocks", "standard error")]
    theory: Annotated[float, Column("the rate in theory", "theory")]
    exact: Annotated[bool, Column("whether the theory is exact", "exact")]
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


def enskog_rate(scene: kt.Scene) -> float:
    """Returns Enskog's rate of disc-disc contacts, for equal discs in an arena."""
    if scene.arena is None:
        raise ValueError("Enskog's rate needs an arena")
    area = scene.arena[0] * scene.arena[1]
    radius = float(scene.radius[0])
    density = len(scene) * math.pi * radius**2 / area
    chi = (1.0 - 7.0 * density / 16.0) / (1.0 - density) ** 2
    speed = math.sqrt(float((scene.velocity**2).sum(axis=1).mean()))
    return len(scene) ** 2 / 2.0 * 4.0 * radius * chi * math.sqrt(math.pi / 2.0) * speed / area


class _Counter:
    """Counts contacts of two discs, with x walls and with y walls."""

    def __init__(self) -> None:
        self.counts = np.zeros(3, dtype=np.int64)

    def __call__(self, rows: npt.NDArray[np.void]) -> None:
        b = rows["b"]
        self.counts += [
            int((b >= 0).sum()),
            int(((b == -1) | (b == -2)).sum()),
            int(((b == -3) | (b == -4)).sum()),
        ]


def _blocks(
    sim: kt.Simulation, length: float, blocks: int, progress: ReportProgress, label: str
) -> npt.NDArray[np.float64]:
    """Runs on for blocks of equal time; returns their rates, (blocks, 3)."""
    rates = np.empty((blocks, 3))
    start = sim.time
    for block in range(blocks):
        counter = _Counter()
        sim.run(until=start + (block + 1) * length, recorder=counter)
        rates[block] = counter.counts / length
        progress(label, block + 1, blocks)
    return rates


def two_discs(
    radius: float, width: float, height: float, contacts: int, progress: ReportProgress
) -> list[Rate]:
    """Runs two discs in a box for about this many contacts; returns their three rates."""
    scene = kt.Scene(
        position=[(0.3 * width, 0.4 * height), (0.7 * width, 0.63 * height)],
        velocity=VELOCITIES,
        radius=radius,
        arena=(width, height),
    )
    theories = two_disc_rates(radius, width, height, float((scene.velocity**2).sum()))
    sim = kt.Simulation(scene, keep_contacts=False)
    name = f"two discs of radius {radius:g} in {width:g} x {height:g}"
    rates = _blocks(sim, contacts / sum(theories) / BLOCKS, BLOCKS, progress, name)
    kinds = ("disc-disc", "x walls", "y walls")
    return [_rate(name, sim, what, rates[:, k], theories[k], exact=True) for k, what in enumerate(kinds)]


def many_discs(density: float, contacts: int, progress: ReportProgress) -> Rate:
    """Runs many discs, after they have forgotten their grid; returns the rate of their contacts."""
    scene = kt.make_scene("grid", bodies=MANY, density=density, seed=1)
    theory = enskog_rate(scene)
    sim = kt.Simulation(scene, keep_contacts=False)
    sim.run(max_contacts=FORGOTTEN * MANY)
    name = f"grid, {MANY} discs, density {density:g}"
    blocks = 50
    rates = _blocks(sim, contacts / theory / blocks, blocks, progress, name)
    return _rate(name, sim, "disc-disc", rates[:, 0], theory, exact=False)


def _rate(
    scene: str, sim: kt.Simulation, what: str, rates: npt.NDArray[np.float64], theory: float, exact: bool
) -> Rate:
    mean = float(rates.mean())
    error = float(rates.std(ddof=1)) / math.sqrt(len(rates))
    off = (mean - theory) / error if error else 0.0
    return Rate(scene, sim.broad_phase, what, contacts_of(sim), mean, error, theory, exact, off)


def measure(budget: Budget, progress: ReportProgress) -> Section:
    """Measures the rates of two discs in two boxes and of many discs at four densities."""
    exact = [rate for box in BOXES for rate in two_discs(*box, CONTACTS[budget], progress)]
    nearly = [many_discs(density, MANY_CONTACTS[budget], progress) for density in DENSITIES]
    rows = [*exact, *nearly]
    worst = max(exact, key=lambda rate: abs(rate.off))
    within = f"{sum(abs(rate.off) <= 3.0 for rate in exact)} of {len(exact)} rates"
    ratios = [rate.rate / rate.theory for rate in nearly]
    return Section(
        name="rates",
        title="Rates known in theory",
        about=(
            f"Two discs with unit masses in a box, sum of squared speeds {np.square(VELOCITIES).sum():g}, "
            f"about {CONTACTS[budget]:,} contacts, in {BLOCKS} blocks of equal time; and {MANY} discs after "
            f"{FORGOTTEN * MANY:,} contacts. The runs are under {listed(list(grouped(rows, 'phase')))}."
        ),
        findings=(
            f"Many discs meet {min(ratios):.3f} to {max(ratios):.3f} times as often as Enskog's theory says, "
            "which is an approximation and knows no walls.",
        ),
        tables=(
            Table("rates", "Contacts in a unit of time, with the standard error over blocks.", tuple(rows)),
        ),
        claims=(
            Claim(
                "Two discs meet each other and the walls at the exact rates, within three standard errors",
                f"{within}; the furthest is {abs(worst.off):.1f} standard errors off",
                abs(worst.off) <= 3.0,
            ),
        ),
        pictures=(
            ReportFigure(
                "rates",
                "How far each measured rate is from the theory, in per cent, with three standard errors. Of "
                "two discs (dots) the theory is exact; of many (squares) it is Enskog's.",
                lambda: _draw(rows),
            ),
        ),
    )


def _draw(rows: list[Rate]) -> Figure:
    figure, panel = new_figure(height=0.5 + 0.26 * len(rows))
    for exact, (colour, marker, _) in zip((True, False), LOOKS, strict=False):
        at = [place for place, row in enumerate(rows) if row.exact is exact]
        off = [100.0 * (rows[place].rate / rows[place].theory - 1.0) for place in at]
        bars = [300.0 * rows[place].error / rows[place].theory for place in at]
        panel.errorbar(off, at, xerr=bars, fmt=marker, color=colour, markersize=4, capsize=2.5)
    panel.axvline(0.0, color="0.5", linewidth=0.8)
    panel.set_yticks(range(len(rows)), [f"{row.scene}: {row.what}" for row in rows])
    panel.invert_yaxis()
    panel.set(xlabel="measured less theory, %")
    return figure
