"""Scenes of upright boxes and discs drawn from a seed: brick walls, boxes that slide along each other with a
gap of 0, ratios of a thousand, and boxes anywhere, with periodic axes or without."""

import random

import kinetile as kt
from kinetile.errors import SceneError


def drawn(seed: int, bodies: tuple[int, ...] = (2, 3, 4, 6, 8), axes: tuple[str, ...] = ("",)) -> kt.Scene:
    """Returns a scene with one of these numbers of bodies, periodic along some of these axes."""
    rng = random.Random(seed)
    n, lattice = rng.choice(bodies), rng.random() < 0.6
    periodic = rng.choice(axes) if any(axes) else ""
    side = rng.choice((4.0, 6.0)) if lattice else 6.0
    side = max(side, 4.5) if periodic else side
    if lattice:
        sizes = (0.5, 1.0, 1.0, 1.5)
        shapes = [kt.box(rng.choice(sizes), rng.choice(sizes)) for _ in range(3)]
        shapes += [kt.disc(rng.choice((0.25, 0.5)))]
    else:
        small = rng.choice((1.0, 1.0, 1e-3))
        shapes = [kt.box(rng.uniform(0.1, 1.5), rng.uniform(0.1, 1.5)) for _ in range(2)]
        shapes += [kt.box(small, 0.5 * small), kt.disc(rng.uniform(0.1, 0.6) * small)]
    kinds = rng.choice(((0, 1, 2, 3), (0, 1, 2), (0, 3), (0,)))
    arena = (side, side) if periodic or rng.random() < 0.7 else None
    places: list[tuple[float, float]] = []
    shape: list[int] = []
    for _ in range(60 * n):
        if len(places) == n:
            break
        which = rng.choice(kinds)
        place = (
            (rng.randrange(1, int(4 * side)) / 4, rng.randrange(1, int(4 * side)) / 4)
            if lattice
            else (rng.uniform(0, side), rng.uniform(0, side))
        )
        try:
            kt.Scene(
                [*places, place],
                [(0, 0)] * (len(places) + 1),
                shape=[*shape, which],
                shapes=shapes,
                arena=arena,
                periodic=periodic,
            )
        except SceneError:
            continue
        places.append(place)
        shape.append(which)
    steps = (-1.0, -0.5, 0.0, 0.0, 0.5, 1.0)
    velocity = [
        (rng.choice(steps), rng.choice(steps)) if lattice else (rng.gauss(0, 1), rng.gauss(0, 1))
        for _ in places
    ]
    mass = 1.0 if rng.random() < 0.5 else [rng.choice((1.0, 2.0, 0.5)) for _ in places]
    frame = {"arena": arena, "periodic": periodic}
    scene = kt.Scene(places, velocity, mass=mass, shape=shape, shapes=shapes, **frame)
    return scene if scene.shapes and len(places) > 1 else drawn(seed + 1_000_003, bodies, axes)
