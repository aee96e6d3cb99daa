"""Coverage of 95 % intervals: how many of 200 runs have the true mean within what they give for it.

``python docs/figures/intervals.py [RUNS [FIRST]]`` prints the table of docs/observables.md, of runs whose
seeds are FIRST and on: others than 0 to 199, on which the settings were chosen. The true mean of a
temperature of one mass is that of equipartition; of a pressure, the mean of all runs, whose own error is a
fourteenth of that of one.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.statistics import Estimate

RUNS, FIRST = 200, 1000


class Case(NamedTuple):
    """A system, the length of its runs, what is observed, and the true mean, if it is known."""

    name: str
    scene: Callable[[int], kt.Scene]
    until: float
    observe: str
    quantity: str
    true: float | None = None


def _fluid(seed: int, density: float, periodic: str, bodies: int = 16) -> kt.Scene:
    return kt.make_scene(
        "mixture", bodies=bodies, radii=(0.5,), density=density, periodic=periodic, seed=seed
    )


def _two_masses(seed: int) -> kt.Scene:
    scene = _fluid(seed, 0.3, "")
    return scene.replace(mass=np.where(np.arange(len(scene)) % 2, 8.0, 1.0))


def _kinetic(seed: int) -> kt.Scene:
    """Two masses, with the energy of one unit of temperature a body."""
    scene = _two_masses(seed)
    energy = float((scene.mass[:, None] * scene.velocity**2).sum()) / 2
    return scene.replace(velocity=scene.velocity * math.sqrt(len(scene) / energy))


CASES = [
    Case("torus, density .3", lambda seed: _fluid(seed, 0.3, "xy"), 60.0, "pressure", "P"),
    Case("torus, density .6", lambda seed: _fluid(seed, 0.6, "xy"), 60.0, "pressure", "Z"),
    Case("box, density .5", lambda seed: _fluid(seed, 0.5, ""), 60.0, "pressure", "P"),
    Case("box, density .5, by walls", lambda seed: _fluid(seed, 0.5, ""), 60.0, "pressure", "P_left"),
    Case("torus, by impulses", lambda seed: _fluid(seed, 0.5, "xy"), 60.0, "pressure:by=impulses", "P"),
    Case("box, masses 1 and 8", _kinetic, 400.0, "temperature:every=0.5", "kT of mass 1.0", 1.0),
    Case("box, masses 1 and 8", _kinetic, 800.0, "temperature:every=2", "kT of mass 8.0", 1.0),
    Case("the same, too short", _kinetic, 60.0, "temperature:every=0.05", "kT of mass 1.0", 1.0),
]


def estimates(case: Case, runs: int, seed: int = FIRST) -> list[Estimate]:
    """Returns what each of some runs has measured, after a tenth of its time."""
    found = []
    for each in range(seed, seed + runs):
        sim = kt.Simulation(case.scene(each), "naive", keep_contacts=False)
        sim.run(case.until / 10)
        sim.run(case.until, observe=[case.observe])
        ((_, quantities),) = sim.observed.items()
        found.append(quantities[case.quantity])
    return found


def rows(
    runs: int, seed: int = FIRST, cases: Sequence[Case] = CASES
) -> Iterator[tuple[str, int, float, float, float]]:
    """Yields for each case the runs that give an error, the percentage of their intervals that have the true
    mean, how often the means scatter by the errors, and the blocks that errors are from."""
    for case in cases:
        made = estimates(case, runs, seed)
        given = [each for each in made if each.blocks]
        true = case.true if case.true is not None else float(np.mean([each.mean for each in made]))
        off = np.array([each.mean - true for each in given])
        covered = 100.0 * float(np.mean(np.abs(off) <= [each.interval for each in given]))
        scatter = float(np.sqrt(np.mean(off**2) / np.mean([each.error**2 for each in given])))
        blocks = float(np.mean([each.blocks for each in given]))
        yield f"`{case.observe}` {case.quantity}: {case.name}", len(given), covered, scatter, blocks


def main() -> None:
    """Prints the table."""
    given_here = [int(each) for each in sys.argv[1:]]
    runs, seed = given_here + [RUNS, FIRST][len(given_here) :]
    print("| quantity and system | runs with an error | % within 95 % | scatter / error | blocks |")
    print("|---|---|---|---|---|")
    for name, given, covered, scatter, blocks in rows(runs, seed):
        print(f"| {name} | {given} of {runs} | {covered:.1f} | {scatter:.2f} | {blocks:.0f} |", flush=True)


if __name__ == "__main__":
    main()
