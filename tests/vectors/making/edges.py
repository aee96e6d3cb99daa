"""Scenes for whole runs at the edges of the rules: touching starts, corners, the clock, the bar."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import ldexp

from .draws import TRIPLES, Draws
from .rules import FAR, tick_of
from .scenes import Asked
from .whole_runs import BY_CLOCK, PAIR, Body, Scene, events

__all__ = ["barred", "clocks", "touches"]


def _row(count: int, radius: float, moving: int, speed: float, mass: tuple[float, ...] = (1.0,)) -> Scene:
    """A cradle: discs in a row that touch, the first of them struck by others; with walls."""
    made = []
    for number in range(count):
        x = (2 * number + 1) * radius + (0.0 if number < moving else 4.0 * radius)
        velocity = (speed, 0.0) if number < moving else (0.0, 0.0)
        made.append(Body((x, 0.5), velocity, radius, mass[number % len(mass)]))
    return Scene(tuple(made), ((2 * count + 8) * radius, 1.0))


def touches() -> Iterator[Asked]:
    """Cradles, corners, touching starts."""
    yield Asked("cradle, dyadic", _row(6, 0.125, 1, 1.0), contacts=120)
    yield Asked("cradle, two strike", _row(7, 0.125, 2, 0.5), contacts=150)
    yield Asked("cradle of 1/7, unequal masses", _row(5, 1.0 / 7.0, 1, 1.0, (1.0, 3.0, 0.7)), contacts=150)
    corner = Body((0.25, 0.375), (-1.0, -1.0), 0.125)
    yield Asked("one body into corners", Scene((corner._replace(position=(0.25, 0.25)),), (1.0, 1.0)), 16.0)
    yield Asked("one body past a corner", Scene((corner,), (1.0, 2.0)), 16.0)
    four = tuple(
        Body((0.5 + 0.25 * x, 0.5 + 0.25 * y), (0.5 * x, 0.5 * y), 0.125, 1.0)
        for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))
    )
    middle = Body((0.5, 0.5), (0.0, 0.0), 0.125)
    yield Asked("four bodies into four corners and back to a fifth", Scene((middle, *four), (1.0, 1.0)), 12.0)
    for number in range(3):
        d = Draws(f"touching {number}")
        a, b, c = TRIPLES[number]
        size = 1.0 / 64.0
        place, made = (2.0, 2.0), []
        for _ in range(4 + 2 * number):  # a chain of triples, each disc touching the one before it
            velocity = d.whole(-4, 4) / 4, d.whole(-4, 4) / 4
            made.append(
                Body(place, velocity, c * size / 2.0, d.pick((1.0, 1.0, 3.0)) if number == 2 else 1.0)
            )
            place = place[0] + b * size, place[1] + d.sign() * a * size  # a < b: none overlap
        yield Asked(f"a chain of {len(made)} touching discs", Scene(tuple(made), (8.0, 4.0)), contacts=150)


def _slow_gas(d: Draws, count: int, slow: int, walls: bool) -> Scene:
    made = []
    for number in range(count):
        x, y = 0.5 + number + d.uniform(-0.1, 0.1), 0.5 + d.uniform(-0.1, 0.1)
        vx, vy = ldexp(d.uniform(-1.0, 1.0), -slow), ldexp(d.uniform(-1.0, 1.0), -slow)
        if not walls:  # towards the middle
            vx, vy = ldexp(0.5 * count - x, -slow), vy / 64.0
        mass = d.pick((1.0, 2.5)) if walls else 1.0
        made.append(Body((x, y), (vx, vy), d.uniform(0.1, 0.3), mass))
    return Scene(tuple(made), (float(count), 1.0) if walls else None)


def barred(d: Draws) -> Scene:
    """Two discs that touch, nearly, and fly on together but for the rounding of an exchange."""
    nx, ny = d.direction()
    reach = 0.25 + ldexp(d.below(64), -9)
    vx, vy = d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)
    slide, press = ldexp(d.uniform(-1.0, 1.0), -d.whole(50, 56)), ldexp(d.uniform(), -d.whole(50, 54))
    one = Body((0.0, 0.0), (vx, vy), reach / 2.0)
    two = Body(
        (reach * nx, reach * ny),
        (vx - slide * ny - press * nx, vy + slide * nx - press * ny),
        reach / 2.0,
    )
    return Scene((one, two))


def _walls_at_the_clock(d: Draws) -> Scene:
    """Small discs that set out by a turn and reach the left wall within tick 2^62.

    Anchoring comes first there, and rounds a place by much more than is flown in a tick: some meet the wall
    at that tick, and the others later.
    """
    made = []
    for number in range(8):
        speed = ldexp(d.uniform(1.0, 2.0), -12)
        time = d.uniform(256.0, 400.0)
        way = (Fraction(FAR - tick_of(time, 0.0, 0)) + Fraction(1, 2)) * Fraction(speed) / (1 << 52)
        x = float(way) + d.power(-10, -10)
        radius = float(Fraction(x) - way)
        made.append(Body((x, 0.2 + 0.2 * number), (0.0, 0.0), radius, turns=((time, (-speed, 0.0)),)))
    return Scene(tuple(made), (2.0, 2.0))


def _what_happens(scene: Scene, until: int) -> tuple[list[int], bool]:
    """Return the classes of the events up to a tick, and whether two met at once while they were barred."""
    kinds, again = [], False
    for event in events(scene):
        if event.tick > until:
            break
        kinds.append(event.kind)
        again = again or event.barred
    return kinds, again


def clocks() -> Iterator[Asked]:
    """Runs over several spans of 512 units, what happens at their ends, and barred pairs."""
    for number, (count, slow, walls) in enumerate(
        ((1, 8, True), (3, 8, True), (5, 9, True), (4, 10, True), (3, 11, False))
    ):
        d = Draws(f"spans {number}")
        name = f"{count} slow bodies, {'walls' if walls else 'no arena'}"
        yield Asked(name, _slow_gas(d, count, slow, walls), 6000.0 + 512.0 * number)
    resting = Body((7.0, 0.5), (0.0, 0.0), 0.25)
    late = Body((0.5, 0.5), (ldexp(6.0, -10), 0.0), 0.25)
    yield Asked("two bodies that meet at the tick of the clock's anchoring", Scene((late, resting)), 3000.0)
    slow = ldexp(3.0, -12)  # in 1024 units, 2^62 ticks, it flies the 3/4 to the wall
    early = Body((1.0, 1.0), (-slow, slow), 0.25, turns=((512.0, (-ldexp(1.0, -10), 0.0)),))
    at_it = Body((3.0, 3.0), (slow, ldexp(1.0, -11)), 0.25, turns=((1024.0, (0.0, -ldexp(1.0, -9))),))
    alone = Body((1.0, 3.0), (-slow, 0.0), 0.25)
    scene = Scene((early, at_it, alone), (4.0, 4.0))
    yield Asked("walls and turns at the ticks of the clock's anchoring", scene, 16384.0)
    scene = _walls_at_the_clock(Draws("walls at the clock"))
    yield Asked("walls at the very tick of the clock's anchoring, whose rounding moves them", scene, 1100.0)
    yield from _barring(Draws("barred"))


def _barring(d: Draws) -> Iterator[Asked]:
    """Pairs that are barred where rule 5 says that they meet: to the end, until the clock, until a turn."""
    found = 0
    while found < 2:
        scene = barred(d)
        if _what_happens(scene, 1 << 55)[1]:
            found += 1
            yield Asked("two bodies that would meet again at once, and are barred", scene, 64.0)
    while found < 3:
        scene = barred(d)
        kinds, again = _what_happens(scene, 1 << 64)
        if again and PAIR in kinds[kinds.index(BY_CLOCK) :]:
            found += 1
            yield Asked("a bar that the clock's anchoring ends: they meet again", scene, 4096.0)
    while found < 4:
        scene = barred(d)
        first = scene.bodies[0]
        first = first._replace(turns=((1.0, first.velocity), (2.0, first.velocity)))
        scene = scene._replace(bodies=(first, scene.bodies[1]))
        kinds, again = _what_happens(scene, 3 << 52)
        if again and kinds.count(PAIR) > 1:
            found += 1
            yield Asked("a bar that a turn ends: they meet again", scene, 64.0)
