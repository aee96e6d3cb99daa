"""Floors of tiles and lines that are flush but for rounding: what slides along them meets nothing."""

import random

import pytest

import kinetile as kt
from kinetile.errors import ZenoError
from lanes import GENERAL, first

FLOORS = ("tiles", "tiles of many heights", "polyline")
TILES = 9


def hundredths(rng: random.Random, low: int, high: int) -> float:
    return rng.randrange(low, high) / 100


def floor_of(kind: str, width: float, top: float, rng: random.Random) -> list[kt.Obstacle]:
    if kind == "polyline":
        return kt.polyline([(width * i, top) for i in range(TILES + 1)])
    heights = [top if kind == "tiles" else hundredths(rng, 5, 90) for _ in range(TILES)]
    places = [(width / 2 + width * i, top - height / 2) for i, height in enumerate(heights)]
    return [kt.Obstacle(kt.box(width, height), place) for height, place in zip(heights, places, strict=True)]


def drawn(seed: int, kind: str) -> kt.Scene:
    """Returns a box or a disc that slides along a floor, all its numbers in hundredths."""
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
    """Returns the result of a scene without any event to come: "jams", "snags", "met" or nothing."""
    sim = kt.Simulation(scene, phase)
    try:
        sim.run(until=12.0, max_contacts=50)
    except ZenoError:
        return "jams"
    if sim.velocities()[0, 0] <= 0.0:
        return "snags"
    return "met" if len(sim.contacts) else ""


@pytest.mark.parametrize("kind", FLOORS)
@pytest.mark.parametrize("block", first(1, range(50)))
def test_what_slides_along_a_flush_floor_meets_nothing(kind: str, block: int) -> None:
    """Before there was a strip, 62, 100 and 67 of 200 of each kind met something."""
    seeds = range(4 * block, 4 * (block + 1))
    assert [met(drawn(seed, kind), GENERAL[seed % 4]) for seed in seeds] == [""] * 4


@pytest.mark.parametrize(("step", "turns"), [(1e-13, False), (1e-9, True)])
@pytest.mark.parametrize("shape", [kt.box(0.1, 0.2), kt.disc(0.1)])
def test_a_step_that_is_higher_is_met(shape: kt.Shape, step: float, turns: bool) -> None:
    tile = kt.box(0.3, 0.7)
    floor = [kt.Obstacle(tile, (0.15, 0.35)), kt.Obstacle(tile, (0.45, 0.35 + step))]
    scene = kt.with_obstacles(kt.Scene([(0.15, 0.7 + 0.1)], [(0.5, 0.0)], shape=shape), floor)
    assert met(scene) == ("" if not turns else "snags" if shape.kind == "box" else "met")
