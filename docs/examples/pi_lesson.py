"""A lesson: two blocks and a wall count the digits of pi, and momentum and energy explain it.

A heavy disc meets a light one at rest before a wall. Masses of 1, 100 and 10,000 to 1 make 3, 31 and
314 contacts (Galperin, Regular and Chaotic Dynamics 8, 375, 2003). In the plane of velocities times the roots
of the masses, each contact turns the state by the same angle on a circle of constant energy.

    $ python docs/examples/pi_lesson.py
"""

from __future__ import annotations

import math

import kinetile as kt


def count(digits: int) -> tuple[int, float]:
    """Returns the contacts for a ratio of masses of 100 ** (digits - 1), and the relative drift of energy."""
    ratio = 100.0 ** (digits - 1)
    start = kt.Scene([(3.0, 0.5), (1.0, 0.5)], [(-1.0, 0.0), (0.0, 0.0)], 0.1, [ratio, 1.0], (1e4, 1.0))
    sim = kt.Simulation(start, "cells")
    sim.run(until=40.0)
    heavy, light = sim.velocities()[:, 0].tolist()
    assert heavy >= light >= 0.0, "nothing is left to meet"
    return len(sim.contacts), (ratio * heavy**2 + light**2) / ratio - 1.0


def foreseen(digits: int) -> int:
    """Returns the number of turns by the angle of a contact that fit into half a circle."""
    return math.ceil(math.pi / math.atan(10.0 ** (1 - digits))) - 1


if __name__ == "__main__":
    for digits in (1, 2, 3):
        contacts, drift = count(digits)
        said = f"{contacts} contacts, {foreseen(digits)} by the circle, energy {drift:.0e}"
        print(f"{100 ** (digits - 1):>6} : 1  {said}")
