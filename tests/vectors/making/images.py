"""Runs in boxes of which one axis or both are periodic, and runs for single clauses of their rules."""

from __future__ import annotations

from collections.abc import Iterator
from math import ldexp

from .draws import Draws
from .scenes import Asked
from .whole_runs import Body, Insert, Scene

__all__ = ["boxes", "images"]

STILL = (0.0, 0.0)


def _box(d: Draws, columns: int, rows: int, axes: str, dyadic: bool, wide: float = 0.45) -> Scene:
    """A disc in each cell of a grid, some written some periods away."""
    made = []
    for site in range(columns * rows):
        place = [site % columns + 0.5, site // columns + 0.5]
        if dyadic:
            speed = d.whole(-2, 2) / 2, d.whole(-2, 2) / 2
            radius = d.pick((0.25, 0.375, 0.4375))
        else:
            place = [each + d.uniform(-0.05, 0.05) for each in place]
            speed = d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)
            radius = d.uniform(0.2, wide)
        for axis, side in enumerate((columns, rows)):
            if "xy"[axis] in axes:
                place[axis] += side * d.pick((0, 0, -1, 5))
        made.append(Body((place[0], place[1]), speed, radius))
    return Scene(tuple(made), (float(columns), float(rows)), periodic=axes)


def boxes() -> Iterator[Asked]:
    """One axis or both, dense, with hardly any room, with ties, masses, turns, fast and slow."""
    for axes, columns, rows in (("x", 3, 2), ("y", 3, 3), ("xy", 2, 2), ("xy", 3, 3), ("xy", 1, 2)):
        d = Draws(f"box {axes} {columns} {rows}")
        name = f"{columns * rows} discs in a box of {columns} x {rows}, periodic along {axes}"
        yield Asked(name, _box(d, columns, rows, axes, False), contacts=60)
        yield Asked(f"{name}, dyadic", _box(d, columns, rows, axes, True), contacts=60)
    d = Draws("box, masses")
    scene = _box(d, 3, 2, "xy", False)
    bodies = tuple(body._replace(mass=d.uniform(0.5, 4.0)) for body in scene.bodies)
    yield Asked("masses", scene._replace(bodies=bodies), contacts=60)
    d = Draws("box, turns")
    scene = _box(d, 3, 2, "x", False)
    turns = ((2.0, (0.5, -0.5)), (2.0, (0.0, 1.0)), (4.5, (-1.0, 0.25)))
    bodies = tuple(body._replace(turns=turns[n % 3 :]) for n, body in enumerate(scene.bodies))
    yield Asked("turns, some at a beat of the clock", scene._replace(bodies=bodies, start=-2.0), contacts=60)
    d = Draws("box, fast")
    scene = _box(d, 2, 2, "xy", False)
    fast = scene.bodies[0]._replace(velocity=(317.0, -41.0))
    yield Asked("a fast one", scene._replace(bodies=(fast, *scene.bodies[1:])), contacts=60)
    d = Draws("box, sparse")
    small = tuple(body._replace(radius=ldexp(body.radius, -4)) for body in _box(d, 2, 2, "xy", False).bodies)
    yield Asked("sparse: long flights between contacts", Scene(small, (2.0, 2.0), periodic="xy"), contacts=40)
    d = Draws("box, flat")
    thin = tuple(Body((n + 0.5, 0.1), (d.uniform(-1.0, 1.0), d.uniform(-0.1, 0.1)), 0.4) for n in range(3))
    yield Asked("a period of 2.1 radii", Scene(thin, (3.0, 0.84), periodic="xy"), contacts=60)
    alone = Body((0.5, 0.5), (1.0, 0.25), 0.25)
    yield Asked("one that meets walls only", Scene((alone,), (1.0, 1.0), periodic="x"), 40.0)


def images() -> Iterator[Asked]:
    """Rules 4p, 5p, 7p, 8p and 9p."""
    there, here = Body((0.25, 0.5), (1.0, 0.0), 0.125), Body((0.75, 0.5), STILL, 0.125)
    alone = Scene((there, here), (1.0, 1.0), periodic="xy")
    yield Asked("two alone meet again and again", alone, 12.0, otherwise="a bar is of all images")
    slope = there._replace(velocity=(1.0, 0.03125))
    oblique = alone._replace(bodies=(slope, here))
    yield Asked("two alone, obliquely", oblique, contacts=12, otherwise="a bar is of all images")
    for axes, side in (
        ("x", 4.0),
        ("xy", 2.0),
    ):  # it comes down between an image to its left and one to its right
        falling, still = Body((2.0, 3.25), (0.0, -1.0), 1.25), Body((0.0, 1.25), STILL, 1.0)
        third = Body((0.25, 5.0), (0.0, 0.5), 0.25)
        if axes == "xy":
            falling, still = Body((1.0, 1.75), (0.0, -1.0), 0.75), Body((0.0, 0.5), STILL, 0.5)
            third = Body((1.75, 2.25), (0.0, 0.0625), 0.0625)
        scene = Scene((falling, still, third), (side, 6.0 if axes == "x" else 3.0), periodic=axes)
        name = f"two images at one tick, periodic along {axes}"
        yield Asked(name, scene, contacts=15, otherwise="the greatest image of a tick")
    for number, otherwise in enumerate(("plans are kept for 512 units", "places are not wrapped")):
        d = Draws(f"long flights {number}")
        for axes in ("x", "xy"):
            bodies = tuple(
                Body(
                    (0.3 + 0.5 * n, 0.4 + 0.2 * n),
                    (d.uniform(0.6, 1.0) * (1 - 2 * n), d.uniform(-0.3, 0.3)),
                    d.uniform(0.05, 0.08),
                )
                for n in range(2)
            )
            scene = Scene(bodies, (1.0, 1.0), periodic=axes)
            yield Asked(f"long flights, periodic along {axes}", scene, 20.0, otherwise=otherwise)
    there = Body((0.4375, 0.5), STILL, 0.125), Body((0.0, 0.25), (0.0, 0.375), 0.0625)
    for x, y in ((-0.3225, 0.5), (-0.3125, 0.5), (3.6775, 0.5), (-4.3225, 0.5), (7.6, 0.875)):
        comes = Insert(1.0, Body((x, y), STILL, 0.125))
        scene = Scene(there, (1.0, 1.0), commands=(comes,), periodic="x")
        full = "images take no room" if y == 0.5 and x != -0.3125 else ""
        yield Asked(f"a body is inserted at ({x}, {y}), near an image", scene, 6.0, otherwise=full)
