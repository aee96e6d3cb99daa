"""Losses of separation: flights along waypoints, and each two that come too near to each other.

``python docs/examples/separation.py FLIGHTS.csv 5`` reads lines ``flight,time,x,y``, the waypoints of each
flight in the order of time, and prints each two that are nearer than 5, from when to when, and how near.
Without a file it draws 500 random flights. Bodies are discs of half the separation that pass through each
other. So a loss of separation is a passing with an exact time, and nothing is sampled.
"""

from __future__ import annotations

import csv
import random
import sys
from itertools import groupby, pairwise
from typing import Any

import numpy as np

import kinetile as kt

Point = tuple[float, float, float]
Flights = dict[str, list[Point]]


def read(path: str) -> Flights:
    """Returns the waypoints (time, x, y) of each flight."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = [
            (each["flight"], *map(float, (each["time"], each["x"], each["y"])))
            for each in csv.DictReader(file)
        ]
    return {name: sorted(row[1:] for row in its) for name, its in groupby(sorted(rows), lambda row: row[0])}


def draw(count: int, seed: int = 1, side: float = 500.0) -> Flights:
    """Returns flights of one to three legs across a square, at a speed of 8 to 9 a unit of time."""
    rng, flights = random.Random(seed), Flights()
    for number in range(count):
        points: list[Point] = [(rng.uniform(0.0, 100.0), rng.uniform(0.0, side), rng.uniform(0.0, side))]
        for _ in range(rng.randint(1, 3)):
            time, x, y = points[-1]
            there = rng.uniform(0.0, side), rng.uniform(0.0, side)
            points.append((time + np.hypot(there[0] - x, there[1] - y) / rng.uniform(8.0, 9.0), *there))
        flights[f"F{number:03}"] = points
    return flights


def scene_of(flights: Flights, separation: float) -> kt.Scene:
    """Returns the scene of flights: each is inserted at its first waypoint and removed at its last."""
    commands: list[Any] = []
    for name, points in flights.items():
        for at, (one, two) in enumerate(pairwise(points)):
            flies = tuple(
                (there - here) / (two[0] - one[0]) for here, there in zip(one[1:], two[1:], strict=True)
            )
            come = kt.Insert(one[0], one[1:], flies, separation / 2, name=name)
            commands.append(kt.Turn(name, one[0], flies) if at else come)
        commands.append(kt.Remove(name, points[-1][0]))
    end = kt.Settings(until=max(points[-1][0] for points in flights.values()))
    rules = {("flight", "flight"): "pass"}
    none = np.zeros((0, 2))
    return kt.Scene(none, none, [], kinds=["flight"], responses=rules, commands=commands, settings=end)


def losses(flights: Flights, separation: float) -> list[tuple[Any, ...]]:
    """Returns (name, name, begin, end, closest, its time) of each loss of separation."""
    scene = scene_of(flights, separation)
    names = {number: name for name, number in scene.numbers.items()}
    rows: list[Any] = []
    kt.Simulation(scene).run(recorder=lambda some: rows.append(some.copy()))
    found = kt.encounters(kt.Trajectory(np.concatenate(rows), scene))
    columns = ["a", "b", "begin", "end", "closest", "closest_time"]
    return [(names[a], names[b], *rest) for a, b, *rest in found[columns].tolist()]


if __name__ == "__main__":
    flights = read(sys.argv[1]) if len(sys.argv) > 1 else draw(500)
    found = losses(flights, float(sys.argv[2]) if len(sys.argv) > 2 else 5.0)
    for one, two, begin, end, closest, time in sorted(found, key=lambda each: each[4])[:10]:
        print(f"{one} {two}  from {begin:8.3f} to {end:8.3f}, closest {closest:6.4f} at {time:8.3f}")
    print(f"{len(found)} losses of separation among {len(flights)} flights")
