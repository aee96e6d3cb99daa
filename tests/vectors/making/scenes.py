"""Scenes for whole runs: drawn once by their family and number, and data from then on."""

from __future__ import annotations

from collections.abc import Iterator
from math import ldexp, sqrt
from typing import NamedTuple

from .draws import Draws
from .whole_runs import Body, Scene, Turn

__all__ = ["Asked", "gases", "lattices", "mixtures", "turning"]


class Asked(NamedTuple):
    """A run: to an end in time, to an exact one, or to the time of its so manieth contact, rounded to a
    double. ``otherwise``: the reading of the rules with which it has another answer."""

    name: str
    scene: Scene
    until: float | None = None
    contacts: int = 0
    end: tuple[int, int, int] | None = None
    otherwise: str = ""


def _lattice(
    d: Draws, bodies: int, dyadic: bool, jitter: float = 0.0, touching: float = 0.3, equal: bool = True
) -> Scene:
    """Discs on some sites of a lattice, in few velocities, some moved until they touch another."""
    cells = 8 if dyadic else d.whole(3, 11)
    columns = 2
    while columns * columns < 2 * bodies:
        columns += 1
    rows = columns + d.whole(1, 2)
    steps = d.pick((1, 2, 4) if dyadic else (1, 3, 7))
    radius = d.whole(2, 4) / 8 / cells
    sites = sorted(d.shuffled(range(columns * rows))[:bodies])
    along = d.below(2)
    made, row, end = [], -1, 0.0
    for site in sites:
        if site // columns != row:
            row, end = site // columns, 0.0
        own = radius if equal or d.below(2) else radius * (0.5 if dyadic else 0.7)
        x, y = (site % columns + 0.5) / cells, (row + 0.5) / cells
        if d.uniform() < touching:
            x = end + own
        end = x + own
        if jitter:
            x, y = x + d.uniform(-jitter, jitter), y + d.uniform(-jitter, jitter)
            own -= 3.0 * jitter if jitter > 1e-15 else 0.0
        vx, vy = d.whole(-steps, steps) / steps, d.whole(-steps, steps) / steps
        if along:
            vx, vy = (vx, 0.0) if d.below(2) else (0.0, vy)
        mass = 1.0 if equal else d.pick((1.0, 2.0, 4.0) if dyadic else (0.3, 1.0, 2.5, 7.0))
        made.append(Body((x, y), (vx, vy), own, mass))
    return Scene(tuple(d.shuffled(made)), (columns / cells, rows / cells))


def lattices() -> Iterator[Asked]:
    """Ties, touching starts, and what is a rounding away from them."""
    for number, bodies in enumerate((6, 12, 20, 30, 40)):
        d = Draws(f"lattice {number}")
        yield Asked(f"dyadic lattice, {bodies} bodies", _lattice(d, bodies, True), contacts=250)
    d = Draws("lattice, masses")
    yield Asked("dyadic lattice, unequal masses and radii", _lattice(d, 24, True, equal=False), contacts=250)
    for number, bodies in enumerate((8, 20, 36)):
        d = Draws(f"lattice of thirds {number}")
        scene = _lattice(d, bodies, False, equal=number != 1)
        yield Asked(f"non-dyadic lattice, {bodies} bodies", scene, contacts=250)
    for number, jitter in enumerate((ldexp(1.0, -55), 1e-16, 1e-15, 1e-14, 1e-12, 1e-9)):
        d = Draws(f"jittered lattice {number}")
        scene = _lattice(d, 16 + number, number % 2 == 0, jitter)
        yield Asked(f"lattice, jittered by {jitter:.2g}", scene, contacts=250)


def turned(d: Draws, scene: Scene, count: int, end: int) -> Scene:
    """Return a scene with turns at multiples of 1/16, up to ``end`` of them, in small velocities."""
    turns: dict[int, list[Turn]] = {body: [] for body in range(len(scene.bodies))}
    for _ in range(count):
        time = scene.start + d.below(end) / 16
        for body in {d.below(len(scene.bodies)) for _ in range(d.whole(1, 3))}:
            for _ in range(1 + (d.below(4) == 0)):  # one of two at once is never seen, and anchors twice
                turns[body].append((time, (d.whole(-4, 4) / 4, d.whole(-4, 4) / 4)))
    bodies = (body._replace(turns=tuple(turns[number])) for number, body in enumerate(scene.bodies))
    return scene._replace(bodies=tuple(bodies))


def turning() -> Iterator[Asked]:
    """Turns: several at one tick, several of one body at one tick, at the ticks of contacts."""
    for number, bodies in enumerate((5, 10, 16, 24)):
        d = Draws(f"turns {number}")
        scene = turned(d, _lattice(d, bodies, True), 6 * bodies, 64)
        yield Asked(f"dyadic lattice with turns, {bodies} bodies", scene, contacts=250)
    d = Draws("turns, thirds")
    scene = turned(d, _lattice(d, 14, False, 1e-16), 40, 64)
    yield Asked("jittered lattice with turns", scene, contacts=250)
    d = Draws("turns, gas")
    scene = turned(d, _gas(d, 5, 0.3)._replace(start=-3.5), 30, 99)
    yield Asked("gas with turns, from a start of -3.5", scene, contacts=250)
    # two turns of one body at one tick, out of the order of times, and a third at the start
    turns = ((0.25, (0.0, 1.0)), (0.25, (1.0, 0.0)), (0.0, (-1.0, 0.0)))
    back = Body((0.75, 0.5), (-1.0, 0.0), 0.125, turns=turns)
    there = Body((0.25, 0.5), (1.0, 0.0), 0.125, turns=((0.125, (0.5, 0.0)), (1.0, (1.0, 1.0))))
    yield Asked("two bodies, turned at the tick of their contact", Scene((there, back), (1.0, 1.0)), 4.0)
    soon = ldexp(1.0, -10)
    turns = ((soon + ldexp(1.0, -60), (0.25, 0.5)), (soon, (-0.5, 1.0)))
    slow = tuple(body._replace(turns=turns[:: 1 - 2 * n]) for n, body in enumerate((back, there)))
    yield Asked("turns within a tick, in the order of their times", Scene(slow, (1.0, 1.0)), 4.0)
    there = there._replace(turns=((0.125, (1.0, 0.0)), (0.5, (1.0, 0.5))))
    back = back._replace(turns=((0.125, (-1.0, 0.0)),))
    yield Asked("turns to the velocity a body has", Scene((there, back), (1.0, 1.0)), 8.0)


def _gas(d: Draws, side: int, density: float, speed: float = 1.0) -> Scene:
    """Equal discs on a jittered grid in a unit box; density is the share of it that they cover."""
    radius = sqrt(density / 3.14159265358979) / side
    free = 0.999 * (0.5 / side - radius)
    made = []
    for site in range(side * side):
        x = (site % side + 0.5) / side + d.uniform(-free, free)
        y = (site // side + 0.5) / side + d.uniform(-free, free)
        made.append(Body((x, y), (d.uniform(-speed, speed), d.uniform(-speed, speed)), radius))
    return Scene(tuple(made), (1.0, 1.0))


def gases() -> Iterator[Asked]:
    """Dense and dilute, from any start, fast and slow, with and without an arena."""
    for number, (side, density) in enumerate(
        ((3, 0.5), (6, 0.5), (8, 0.5), (5, 0.25), (8, 0.25), (5, 0.01), (8, 0.01))
    ):
        d = Draws(f"gas {number}")
        yield Asked(f"gas, {side * side} bodies at {density}", _gas(d, side, density), contacts=300)
    d = Draws("gas, late")
    late = _gas(d, 5, 0.5)._replace(start=ldexp(1.0, 40) + 0.3)
    yield Asked("gas, from a start of 2^40 and some", late, contacts=250)
    for number, speed in enumerate((3.0, 1e3, 1e9, ldexp(1.0, 190))):
        d = Draws(f"fast gas {number}")
        yield Asked(f"gas, speeds up to {speed:.3g}", _gas(d, 5, 0.4, speed), contacts=250)
    d = Draws("fast turn")
    scene = _gas(d, 4, 0.4)
    first = scene.bodies[0]._replace(turns=((0.25, (300.0, 40.0)),))
    yield Asked(
        "gas in which a turn is fast", scene._replace(bodies=(first, *scene.bodies[1:])), contacts=250
    )
    for number, size in enumerate((-150, 150)):
        d = Draws(f"scaled gas {number}")
        scene = _gas(d, 5, 0.4)
        bodies = tuple(
            Body(
                (ldexp(body.position[0], size), ldexp(body.position[1], size)),
                (ldexp(body.velocity[0], size + 3), ldexp(body.velocity[1], size + 3)),
                ldexp(body.radius, size),
                ldexp(1.0, -size),
            )
            for body in scene.bodies
        )
        scene = Scene(bodies, (ldexp(1.0, size), ldexp(1.0, size)))
        yield Asked(f"gas in lengths of 2^{size}", scene, contacts=250)
    for number, side in enumerate((3, 5, 7)):
        d = Draws(f"no arena {number}")
        inwards = tuple(
            body._replace(
                velocity=(
                    1.0 - 2.0 * body.position[0] + 0.2 * body.velocity[0],
                    1.0 - 2.0 * body.position[1] + 0.2 * body.velocity[1],
                )
            )
            for body in _gas(d, side, 0.3).bodies
        )
        yield Asked(f"no arena, {side * side} bodies flying together", Scene(inwards), 20.0)


def mixtures() -> Iterator[Asked]:
    """Unequal masses and sizes."""
    for number, (heavy, density) in enumerate(((3, 0.5), (40, 0.3), (99, 0.3))):
        d = Draws(f"masses {number}")
        scene = _gas(d, 5, density)
        bodies = tuple(body._replace(mass=d.power(0, heavy) / 2.0) for body in scene.bodies)
        yield Asked(f"gas, masses up to 2^{heavy} apart", scene._replace(bodies=bodies), contacts=250)
    d = Draws("two masses")
    scene = _gas(d, 6, 0.5)
    bodies = tuple(body._replace(mass=(1.0, 1e6)[n % 2]) for n, body in enumerate(scene.bodies))
    yield Asked("gas, masses 1 and 1e6", scene._replace(bodies=bodies), contacts=250)
    for number, arena in enumerate(((1.0, 1.0), None, (1.0, 1.0))):
        d = Draws(f"sizes {number}")
        yield Asked(
            f"radii 100 apart, {'masses alike' if number < 2 else 'masses as areas'}"
            + (", no arena" if arena is None else ""),
            _sizes(d, number == 2)._replace(arena=arena),
            contacts=250 if arena else 30,
            until=None if arena else 40.0,
        )


def _sizes(d: Draws, weighed: bool) -> Scene:
    """Four large discs and thirty that are a hundredth as large, wherever there is room."""
    made = [
        Body(place, (d.uniform(-0.3, 0.3), d.uniform(-0.3, 0.3)), 0.2, 1e4 if weighed else 1.0)
        for place in ((0.25, 0.25), (0.75, 0.27), (0.26, 0.75), (0.74, 0.74))
    ]
    while len(made) < 34:
        x, y, radius = d.uniform(0.01, 0.99), d.uniform(0.01, 0.99), d.uniform(0.002, 0.003)
        if all(
            (x - body.position[0]) * (x - body.position[0]) + (y - body.position[1]) * (y - body.position[1])
            > (body.radius + radius) * (body.radius + radius) * 1.01
            for body in made
        ):
            made.append(Body((x, y), (d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)), radius))
    return Scene(tuple(d.shuffled(made)), (1.0, 1.0))
