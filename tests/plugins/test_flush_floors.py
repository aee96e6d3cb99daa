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
    """Return what becomes of a scene in which nothing should happen: "jams", "snags", "met" or nothing."""
    sim = kt.Simulation(scene, phase)
    try:
        sim.run(until=12.0, max_contacts=50)
    except ZenoError:
        return "jams"
    if sim.velocities()[0, 0] <= 0.0:
        return "snags"
    return "met" if len(sim.contacts) else ""


@pytest.mark.parametrize("kind", FLOORS)
@pytest.mark.parametrize("block", first(1, range(25)))
def test_what_slides_along_a_flush_floor_meets_nothing(kind: str, block: int) -> None:
    """Before there was a strip, 62, 100 and 67 of 200 of each kind met something."""
    seeds = range(8 * block, 8 * (block + 1))
    assert [met(drawn(seed, kind), GENERAL[seed % 4]) for seed in seeds] == [""] * 8


@pytest.mark.parametrize("kind", FLOORS)
def test_a_floor_may_go_round(kind: str) -> None:
    """The last tile is flush with the image of the first, and what slides comes round some times."""
    scenes = [drawn(seed, kind) for seed in range(4)]
    periods = [round(200 * TILES * float(scene.position[1, 0])) / 100 for scene in scenes]
    rings = [
        scene.replace(arena=(period, 9.0), periodic="xy")
        for scene, period in zip(scenes, periods, strict=True)
        if 4.0 * scene.radius.max() < period
    ]
    assert [met(ring) for ring in rings] == [""] * len(rings)
    assert len(rings) > 1


@pytest.mark.parametrize("seed", range(6))
def test_what_lands_on_a_floor_slides_on(seed: int) -> None:
    """It falls, and where it lands is rounded; there it is given a velocity along the floor."""
    resting = drawn(seed, FLOORS[seed % 3])
    place, velocity = resting.position.copy(), resting.velocity.copy()
    place[0, 1] += 0.3
    velocity[0] = 0.0, -0.7
    sim = kt.Simulation(resting.replace(position=place, velocity=velocity), "naive")
    sim.run(until=12.0, max_contacts=1)
    landed = len(sim.contacts)
    assert landed
    sim.set_velocity(0, resting.velocity[0])
    sim.run(until=12.0, max_contacts=50)
    assert len(sim.contacts) == landed
    assert sim.velocities()[0].tolist() == resting.velocity[0].tolist()


@pytest.mark.parametrize(("step", "turns"), [(1e-13, False), (1e-9, True)])
@pytest.mark.parametrize("shape", [kt.box(0.1, 0.2), kt.disc(0.1)])
def test_a_step_that_is_higher_is_met(shape: kt.Shape, step: float, turns: bool) -> None:
    tile = kt.box(0.3, 0.7)
    floor = [kt.Obstacle(tile, (0.15, 0.35)), kt.Obstacle(tile, (0.45, 0.35 + step))]
    scene = kt.with_obstacles(kt.Scene([(0.15, 0.7 + 0.1)], [(0.5, 0.0)], shape=shape), floor)
    assert met(scene) == ("" if not turns else "snags" if shape.kind == "box" else "met")


@pytest.mark.parametrize("slope", [1e-9, 0.5])
def test_who_comes_down_on_a_floor_meets_it(slope: float) -> None:
    floor = kt.polyline([(0.1 * i, 0.7) for i in range(10)])
    scene = kt.with_obstacles(
        kt.Scene([(0.15, 0.7 + 0.1)], [(0.5, -0.5 * slope)], shape=kt.box(0.1, 0.2)), floor
    )
    sim = kt.Simulation(scene, "naive")
    sim.run(until=0.5, max_contacts=10)
    assert sim.contacts["tick"][0] == 0
    assert sim.velocities()[0].tolist() == [0.5, 0.5 * slope]
