"""Periodic scenes drawn from a seed: lattices with ties on borders and corners, boxes of 2.1 radii, flights
of many boxes, one and two bodies, places written some periods away."""

import random

import kinetile as kt
from kinetile.errors import SceneError

BOXES = ((1.0, 1.0), (1.0, 1.5), (1.0, 0.3), (2.0, 0.25), (1.0, 1.0), (3.0, 1.0))


def drawn(
    seed: int,
    bodies: tuple[int, ...] = (1, 2, 2, 3, 4, 5),
    axes: tuple[str, ...] = ("x", "y", "xy", "xy", "xy"),
) -> kt.Scene:
    """Returns a scene with one of these numbers of bodies, periodic along some of these axes."""
    rng = random.Random(seed)
    n, periodic = rng.choice(bodies), rng.choice(axes)
    width, height = rng.choice(BOXES)
    lattice, speed = rng.random() < 0.4, rng.choice((0.1, 1.0, 1.0, 1.0, 8.0, 60.0))
    position: list[list[float]] = []
    radius: list[float] = []
    for _ in range(100 * n):
        if len(position) == n:
            break
        if lattice:
            r = rng.choice((1 / 32, 1 / 16, 1 / 8))
            place = [rng.randrange(33) / 32 * width, rng.randrange(33) / 32 * height]
        else:
            r = rng.uniform(0.01, 0.24) * min(width, height) * rng.choice((0.1, 1.0, 1.0, 1.98))
            place = [rng.uniform(0, width), rng.uniform(0, height)]
        if periodic == "xy" and rng.random() < 0.1:
            place = [place[0] + rng.randrange(-3, 4) * width, place[1] + rng.randrange(-3, 4) * height]
        try:
            frame = {"arena": (width, height), "periodic": periodic}
            kt.Scene([*position, place], [(0, 0)] * (len(position) + 1), [*radius, r], **frame)
        except SceneError:
            continue
        position, radius = [*position, place], [*radius, r]
    steps = (-1.0, -0.5, 0.0, 0.5, 1.0)

    def pace() -> float:
        return rng.choice(steps) * speed if lattice else rng.gauss(0.0, speed)

    velocity = [(pace(), pace()) for _ in position]
    mass = 1.0 if rng.random() < 0.5 else [rng.choice((1.0, 2.0, 0.5, 3.0)) for _ in position]
    if not position:
        return drawn(seed + 1_000_003, bodies, axes)
    return kt.Scene(position, velocity, radius, mass, arena=(width, height), periodic=periodic)


def with_passing(scene: kt.Scene, seed: int) -> kt.Scene:
    """Returns a scene with bodies that pass through each other and bodies that turn, on dyadic times."""
    rng = random.Random(seed)
    kind = [rng.choice(("ball", "wisp", "wisp")) for _ in range(len(scene))]
    passing = rng.choice(([("wisp", "wisp")], [("ball", "wisp")], [("ball", "wisp"), ("wisp", "wisp")]))
    unit = scene.time_unit
    turns = [
        (
            rng.randrange(len(scene)),
            rng.randrange(1, 40) / 8 * unit,
            tuple(rng.choice(scene.velocity).tolist()),
        )
        for _ in range(rng.choice((0, 0, 3)))
    ]
    places = [place.tolist() for place in scene.position]
    radii = scene.radius.tolist()
    for a in range(len(scene)):  # some begin on top of each other
        for b in range(a):
            if kind[a] == kind[b] == "wisp" and len(passing) == 2 and rng.random() < 0.5:
                aside = rng.choice((0.0, 0.25)) * radii[b]
                away = [side * rng.randrange(-1, 2) for side in scene.periods]
                places[a] = [places[b][0] + aside + away[0], places[b][1] + away[1]]
    frame = {"arena": scene.arena, "periodic": scene.periodic, "kind": kind, "unit": unit}
    said = {"responses": dict.fromkeys(passing, "pass"), "kinds": ("ball", "wisp")}
    try:
        return kt.Scene(places, scene.velocity, radii, scene.mass, turns=turns, **frame, **said)
    except SceneError:
        return kt.Scene(scene.position, scene.velocity, radii, scene.mass, turns=turns, **frame, **said)
