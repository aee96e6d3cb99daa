"""Scenes of convex bodies drawn from a seed: capsules, polygons, boxes and discs, among obstacles or not, on
lattices or anywhere, with periodic axes or without."""

import math
import random

import kinetile as kt
from convex_questions import drawn_shape
from kinetile.errors import SceneError


def drawn(seed: int, bodies: tuple[int, ...] = (2, 3, 4, 6, 8), axes: tuple[str, ...] = ("",)) -> kt.Scene:
    """Returns a scene with one of these numbers of bodies, or fewer if there is no room, periodic along some
    of these axes."""
    rng = random.Random(seed)
    n, lattice = rng.choice(bodies), rng.choice((4, 4, 16, 0))
    periodic = rng.choice(axes) if any(axes) else ""
    shapes = [scaled(drawn_shape(rng, lattice), 0.25) for _ in range(3)]
    shapes.append(kt.segment((-0.5, 0.25), (0.75, -0.25)))
    still = rng.choice((0.0, 0.0, 0.3, 0.5))
    side = 8.0 if periodic else 6.0
    arena = (side, side) if periodic or rng.random() < 0.7 else None
    chosen: list[tuple[tuple[float, float], int, float]] = []
    for _ in range(40 * n):
        if len(chosen) == n:
            break
        mass = math.inf if rng.random() < still else rng.choice((1.0, 1.0, 2.0, 0.5))
        which = rng.randrange(4 if mass == math.inf else 3)
        place = (
            (rng.randrange(1, int(4 * side)) / 4, rng.randrange(1, int(4 * side)) / 4)
            if lattice
            else (rng.uniform(0, side), rng.uniform(0, side))
        )
        try:
            made([*chosen, (place, which, mass)], shapes, arena, [(0.0, 0.0)] * (len(chosen) + 1), periodic)
        except SceneError:
            continue
        chosen.append((place, which, mass))
    steps = (-1.0, -0.5, 0.0, 0.0, 0.5, 1.0)
    velocity = []
    for *_, mass in chosen:
        speed = (rng.choice(steps), rng.choice(steps)) if lattice else (rng.gauss(0, 1), rng.gauss(0, 1))
        velocity.append(speed if mass < math.inf or rng.random() < 0.3 else (0.0, 0.0))
    if len(chosen) < 2:
        return drawn(seed + 1_000_003, bodies, axes)
    if rng.random() < 0.5:
        chosen = [(*row[:2], row[2] if row[2] == math.inf else 1.0) for row in chosen]
    scene = made(chosen, shapes, arena, velocity, periodic)
    return scene if scene.shapes else drawn(seed + 1_000_003, bodies, axes)


def made(rows, shapes, arena, velocity, periodic="") -> kt.Scene:
    return kt.Scene(
        [row[0] for row in rows],
        velocity,
        shape=[row[1] for row in rows],
        mass=[row[2] for row in rows],
        shapes=shapes,
        arena=arena,
        periodic=periodic,
    )


def scaled(shape: kt.Shape, by: float) -> kt.Shape:
    return kt.Shape(tuple((x * by, y * by) for x, y in shape.core), shape.radius * by)
