"""Floors of tiles and lines that are flush but for rounding: what slides along them meets nothing on its way."""

from __future__ import annotations

import random

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import ZenoError

FLOORS = ("tiles", "tiles of many heights", "polyline")
TILES = 9


def hundredths(rng: random.Random, low: int, high: int) -> float:
    return rng.randrange(low, high) / 100


def floor_of(kind: str, width: float, top: float, rng: random.Random) -> list[kt.Obstacle]:
    """Return a floor of a kind, at a height and from 0 on to the right."""
    if kind == "polyline":
        return kt.polyline([(width * i, top) for i in range(TILES + 1)])
    heights = [top if kind == "tiles" else hundredths(rng, 5, 90) for _ in range(TILES)]
    places = [(width / 2 + width * i, top - height / 2) for i, height in enumerate(heights)]
    return [
        kt.Obstacle(kt.box(width, height), place) for height, place in zip(heights, places, strict=True)
    ]


def drawn(seed: int, kind: str) -> kt.Scene:
    """Return a box or a disc that slides along a floor, all its numbers in hundredths."""
    rng = random.Random(f"{kind} {seed}")
    width, top = hundredths(rng, 5, 90), hundredths(rng, 5, 90)
    shape = kt.box(hundredths(rng, 5, 90), hundredths(rng, 5, 90))
    if seed % 4 == 3:
        shape = kt.disc(hundredths(rng, 5, 60))
    _, right, bottom, _ = shape.reaches
    place = [(right + width * rng.randrange(2), top + bottom)]
    return kt.with_obstacles(
        kt.Scene(place, [(hundredths(rng, 5, 99), 0.0)], shape=shape), floor_of(kind, width, top, rng)
    )


def met(scene: kt.Scene, phase: str = "naive") -> str:
    """Return what becomes of a scene in which nothing should happen: "jams", "snags", "met" or ""."""
    sim = kt.Simulation(scene, phase)
    try:
        sim.run(until=12.0, max_contacts=1000)
    except ZenoError:
        return "jams"
    if not (sim.velocities()[0] > 0).any():
        return "snags"
    return "met" if len(sim.contacts) else ""
