"""Scenes with accelerations against their laws: ``python docs/cookbook/gravity.py [NAME ...]``.

Each function plays a file of ``docs/scenes``, prints its result beside the law's, and fails if they differ:
at all if the law is exact, otherwise by more than four standard errors.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import kinetile as kt

SCENES = Path(__file__).parents[1] / "scenes"


def load(name: str) -> kt.Scene:
    """Returns a scene of the documents."""
    return kt.load_scene(SCENES / f"{name}.toml")


def rows_of(scene: kt.Scene, until: float | None = None) -> Any:
    """Returns the log of a scene's events: the two that met, the time, and their places right after it."""
    parts = [np.zeros(0, kt.LOG)]
    kt.Simulation(scene, keep_contacts=False).run(until, recorder=parts.append)
    return np.concatenate(parts)


def galton(balls: int = 1000) -> None:
    """Balls step by 1/2 to either side in eight rows. If the steps are independent, the places of the first
    contacts with the floor are binomial: tested by chi squared, with its mean and standard deviation, and by
    the variance, 2. The steps nearly are: 10,000 balls have a chi squared of 49 and variance 1.88 +- 0.03."""
    scene = kt.make_scene("galton", balls=balls)
    rows = rows_of(scene, 2.0 * balls + 36.0)
    below = rows[rows["b"] == -3]
    _, first = np.unique(below["a"], return_index=True)
    assert len(first) == balls
    places = below["ax"][first] - 5.5
    found = np.bincount(np.clip(np.rint(places), -4, 4).astype(int) + 4, minlength=9)
    wanted = np.array([math.comb(8, k) for k in range(9)]) / 256 * balls
    chi = float(((found - wanted) ** 2 / wanted).sum())
    error = 2.0 * math.sqrt(2.0 / (balls - 1))
    print(f"{balls} balls in nine places: {found.tolist()}, binomial {wanted.round().astype(int).tolist()}")
    print(f"chi squared {chi:.1f}, binomial 8 +- 4; variance {places.var():.2f} +- {error:.2f}, binomial 2")
    assert chi < 8 + 4 * 4
    assert abs(places.mean()) < 4 * math.sqrt(2.0 / balls)
    assert abs(places.var() - 2.0) < 4 * error


def sedimentation() -> None:
    """The barometric law of two kinds: with gravity g the mean height of discs of mass m above the floor
    is kT/(m g), less a term for the ceiling. All have the same kT. The law is exact for points; discs that
    cover 0.05 % of the room differ by less than the error."""
    scene, blocks = load("sedimentation"), 20
    g, r, until = 0.0075, 0.5, 60_000.0
    sim = kt.Simulation(scene, keep_contacts=False)
    sim.run(until / 10)  # to equilibrium
    heights, heat = np.zeros((blocks, 2)), np.zeros(blocks)
    kinds = [scene.mass == 1.0, scene.mass == 4.0]
    for block in range(blocks):
        for _ in range(50):
            sim.run(sim.time + 0.9 * until / (50 * blocks))
            y = sim.positions()[:, 1] - r
            heights[block] += [y[kind].mean() / 50 for kind in kinds]
            heat[block] += (scene.mass[:, None] * sim.velocities() ** 2).sum() / (2 * len(scene)) / 50
    room = (scene.arena or (0.0, 0.0))[1] - 2 * r
    for mass, each in zip((1.0, 4.0), heights.T, strict=True):
        scale = heat.mean() / (mass * g)
        law = scale - room / math.expm1(room / scale)
        error = each.std(ddof=1) / math.sqrt(blocks)
        print(f"mass {mass:g}: mean height {each.mean():.1f} +- {error:.1f}, barometric {law:.1f}")
        assert abs(each.mean() - law) < 4 * error
        assert error < 0.04 * law


def traffic() -> None:
    """A car that brakes from the speed v with deceleration a stops after v^2/(2 a). With a billionth more
    room it meets nothing; with a billionth less it meets the obstacle sqrt(2e-9/a) before it would stop. A
    car that reacts later than the car in front of it keeps its speed for that time."""
    scene = load("traffic")
    sim = kt.Simulation(scene)
    sim.run()
    (time,) = sim.contacts["time"].tolist()
    print(f"one contact, at {time:.12f}, by the law {4.0 - math.sqrt(2e-9):.12f}")
    assert sim.contacts[["a", "b"]].tolist() == [(2, 3)]
    assert abs(time - (4.0 - math.sqrt(2e-9))) < 1e-10
    gaps = np.diff(sim.positions()[:, 0])[[0, 4]] - 1.0
    print(f"gaps of those that stopped in time: {gaps.tolist()}")
    assert abs(gaps - 1e-9).max() < 1e-14
    assert not sim.velocities()[[0, 1, 4, 5]].any()


def robots() -> None:
    """A trapezoidal profile of the way d, speed v and acceleration a lasts d/v + v/a = 6. Two robots that
    cross at full speed meet if the second is later by less than 2 sqrt(2) r/v = 0.707."""
    scene = load("robots")
    sim = kt.Simulation(scene)
    for time, there in ((6.0, [0, 1]), (7.25, [2, 3])):
        sim.run(time)
        assert not sim.velocities()[there].any()
    print(f"at 6 and 7.25 they are at {sim.positions().tolist()}, after {len(sim.contacts)} contacts")
    assert sim.positions().tolist() == [[9.0, 4.0], [1.0, 6.0], [5.0, 9.0], [6.5, 1.0]]
    assert len(sim.contacts) == 0
    early = [
        kt.Accelerate(each.body, each.time - 0.125 * (each.body > 1), each.acceleration)
        for each in scene.commands
        if isinstance(each, kt.Accelerate)
    ]
    sim = kt.Simulation(scene.replace(commands=early))
    sim.run(max_contacts=1)
    law = 3.3125 - math.sqrt(0.125 - 0.3125**2)
    print(f"an eighth earlier the third meets the first at {sim.time:.12f}, by the law {law:.12f}")
    assert sim.contacts[["a", "b"]].tolist() == [(0, 2)]
    assert abs(sim.time - law) < 1e-14


def pinball(until: float | None = None) -> None:
    """The energy of the ball, v^2/2 + y, stays the same at every hit. In two dimensions the ball spends its
    time evenly over the area A that it can reach (the microcanonical measure). So it hits a piece ds of a
    bumper, or of a wall, v(y) ds/(pi A) times a unit of time. Errors of rates are from 20 blocks."""
    scene = load("pinball")
    rows = rows_of(scene, until)
    hits = rows[rows["a"] == 0]
    energy = 0.5 * (hits["avx"] ** 2 + hits["avy"] ** 2) + hits["ay"]
    start = 0.5 * float((scene.velocity[0] ** 2).sum()) + float(scene.position[0, 1])
    print(f"energy {start} at the start, after {len(hits)} hits within {abs(energy - start).max():.1e} of it")
    assert abs(energy - start).max() < 1e-12 * start
    if until is None:
        return
    r = float(scene.radius[0])
    width, height = scene.arena or (0.0, 0.0)
    reach = scene.radius[1:] + r
    low = 0.75 - r  # of the drain: the ball cannot pass below it
    corner = math.acos(low / reach[-1])
    lost = reach[-1] * math.sin(corner)
    area = (
        (width - 2 * r) * (height - 2 * r) - math.pi * (reach**2).sum() + reach[-1] ** 2 * corner - low * lost
    )
    angle = np.linspace(0.0, 2 * math.pi, 10_000, endpoint=False)
    y = scene.position[1:, 1:] + reach[:, None] * np.sin(angle)
    around = 2 * math.pi * reach * np.where(y > r, np.sqrt(2 * (start - y)), 0.0).mean(axis=1)
    floor = math.sqrt(2 * (start - r)) * (width - 2 * r - 2 * lost)
    for name, those in {"floor": [-3], "bumper": [1, 2, 3], "post": [4, 5, 6, 7], "drain": [8]}.items():
        times = hits["time"][np.isin(hits["b"], those)]
        counts = np.histogram(times, 20, (0.0, until))[0] * 20 / until
        error = counts.std(ddof=1) / math.sqrt(20)
        law = (floor if name == "floor" else sum(around[body - 1] for body in those)) / (math.pi * area)
        print(f"hits of a {name} a unit of time: {counts.mean():.4f} +- {error:.4f}, by the law {law:.4f}")
        assert abs(counts.mean() - law) < 4 * error
        assert error < 0.02 * law


def pinball_for_long() -> None:
    """Plays ``pinball`` for 200,000 units of time, with the rates."""
    pinball(200_000.0)


FALL = 70.0
"""The height of the floor with the slot above the other floor: all discs have room below."""


def silo(slot: float, bodies: int, width: float = 20.0, fall: float = FALL, seed: int = 0) -> kt.Scene:
    """Returns discs of five sizes about 1 in layers over a floor with a slot in its middle, far above another
    floor. Each contact halves the speed; discs come to rest on floors, and press on each other."""
    rng = np.random.default_rng(seed)
    sizes = [0.45, 0.475, 0.5, 0.525, 0.55]
    of_each = rng.integers(0, 5, bodies)
    columns = int(width // 1.15)
    layer, place = np.divmod(np.arange(bodies), columns)
    x = (place + 0.5) * width / columns + rng.uniform(-0.01, 0.01, bodies)
    plate = (width - slot) / 2
    return kt.Scene(
        [
            *zip(x, fall + 0.65 + 1.15 * layer, strict=True),
            (plate / 2, fall - 0.5),
            (width - plate / 2, fall - 0.5),
        ],
        [*rng.normal(0.0, 0.02, (bodies, 2)), (0.0, 0.0), (0.0, 0.0)],
        mass=[*(4.0 * np.array(sizes)[of_each] ** 2), math.inf, math.inf],
        shape=[*of_each.tolist(), 5, 5],
        shapes=[*map(kt.disc, sizes), kt.box(plate, 1.0)],
        arena=(width, fall + 1.15 * (layer[-1] + 2)),
        gravity=(0.0, -1.0),
        responses=kt.Response("restitution", e=0.5, contact_time=0.05, settle=0.05),
    )


def hopper(bodies: int = 1000) -> None:
    """Beverloo's law: C (D - k)^(3/2) discs a unit of time fall through a slot of width D, however many lie
    above it. Here, in two dimensions and without friction, six slots give C and k, and their deviations.
    Discs are counted from a quarter to three quarters of them."""
    slots, rates = np.arange(4.0, 10.0), []
    for slot in slots:
        found = []
        for seed in range(2):
            sim, below = kt.Simulation(silo(slot, bodies, seed=seed), keep_contacts=False), [0]
            while below[-1] <= 0.75 * bodies:
                sim.run(sim.time + 0.5)
                below.append(int((sim.positions()[:bodies, 1] < FALL - 2.0).sum()))
            some = [count for count in below if count > 0.25 * bodies]
            found.append((some[-2] - some[0]) / (len(some) - 2) * 2)
        rates.append(np.mean(found))
    slope, zero = np.polyfit(slots, np.array(rates) ** (2 / 3), 1)
    law = (slope * slots + zero) ** 1.5
    print(f"C is {slope**1.5:.2f}, and k {-zero / slope:.2f}")
    for slot, rate, wanted in zip(slots, rates, law, strict=True):
        print(f"slot {slot:g}: {rate:.2f} discs a unit of time, by the law {wanted:.2f}")
    assert abs(rates / law - 1).max() < 0.05


SYSTEMS: dict[str, Callable[[], None]] = {
    each.__name__.replace("_", "-"): each
    for each in (traffic, robots, pinball, pinball_for_long, galton, sedimentation, hopper)
}

if __name__ == "__main__":
    for name in sys.argv[1:] or SYSTEMS:
        print(f"{name}:")
        SYSTEMS[name]()
