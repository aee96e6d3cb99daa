"""The cost of questions about a moment: prints a table for given numbers of bodies, which are squares."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

import kinetile as kt

TIMES = 101


def questions(sim: Any) -> dict[str, Callable[[], Any]]:
    """Returns the questions by name; each call is about another place or body."""
    rng = np.random.default_rng(1)
    radius, side = float(sim.scene.radius[0]), sim.scene.arena[0]
    tenth = (0.4 * side, 0.4 * side, 0.5 * side, 0.5 * side)

    def body() -> int:
        return int(rng.integers(len(sim.scene)))

    def place() -> list[float]:
        return rng.uniform(0.0, side, 2).tolist()

    def way() -> list[float]:
        return rng.normal(size=2).tolist()

    return {
        "next_contact(a, b)": lambda: sim.next_contact(0, 1 + body() % (len(sim.scene) - 1)),
        "next_contact_of(a)": lambda: sim.next_contact_of(body()),
        "next_contact_of(a, scheduled=True)": lambda: sim.next_contact_of(body(), scheduled=True),
        "cast(disc, velocity)": lambda: sim.cast((*place(), radius), way()),
        "bodies_in(box), a hundredth of all": lambda: sim.bodies_in(tenth),
        "bodies_near(point, radius=), some 20": lambda: sim.bodies_near(place(), radius=5.0 * radius),
        "bodies_near(point, k=10)": lambda: sim.bodies_near(place(), k=10),
        "ray(origin, direction, most=1)": lambda: sim.ray(place(), way(), most=1),
        "ray(origin, direction)": lambda: sim.ray(place(), way()),
    }


def microseconds(question: Callable[[], Any]) -> float:
    """Returns the median CPU time of a question; the first call does not count."""
    question()
    took = []
    for _ in range(TIMES):
        began = time.process_time_ns()
        question()
        took.append(time.process_time_ns() - began)
    return median(took) / 1000.0


def main(numbers: list[int], make: Callable[[kt.Scene], Any] = kt.Simulation) -> None:
    """Prints a row for each question, with a column for each number of bodies."""
    columns = []
    for bodies in numbers:
        sim = make(kt.make_scene("grid", bodies=bodies, density=0.5, seed=1))
        sim.run(max_contacts=bodies)
        columns.append({name: microseconds(question) for name, question in questions(sim).items()})
    print(f"{'microseconds a question':38s}" + "".join(f"{bodies:>10,}" for bodies in numbers))
    for name in columns[0]:
        print(f"{name:38s}" + "".join(f"{column[name]:10.0f}" for column in columns))


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]] or [1024, 10_000])
