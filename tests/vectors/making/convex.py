"""Rules 3s, 6s and 9s: sizes of shapes, their contacts with walls, and exchanges along their normals."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from fractions import Fraction
from itertools import islice
from typing import NamedTuple

from .doubles import Double, sqrt
from .draws import Draws
from .rules import Arena, Plan, Velocity, anchored, exchange_along, normal, wall_contact
from .shapes import (
    FAMILIES,
    WALL_AS_SEGMENT,
    Body,
    Course,
    Place,
    Question,
    anywhere,
    dot,
    meeting,
    on_lattice,
    wall_as_segment,
)

__all__ = ["Impact", "WallQuestion", "exchange", "impacts", "shapes", "size", "wall", "walls"]

Shape = tuple[tuple[Place, ...], float]


class WallQuestion(NamedTuple):
    """When does a body of a shape meet a wall of an arena, and which? The unit is 2^-e."""

    e: int
    arena: Arena
    body: Body


class Impact(NamedTuple):
    """Two bodies of shapes when they meet; masses, or None: equal ones."""

    masses: tuple[float, float] | None
    one: Body
    two: Body


def size(core: tuple[Place, ...], radius: float) -> float:
    """Return the r of rule 3s, by halving: doubles above 0 are in the order of their bits."""

    def holds(bits: int) -> bool:
        rest = Fraction(_double(bits)) - Fraction(radius)
        return rest >= 0 and all(rest**2 >= Fraction(x) ** 2 + Fraction(y) ** 2 for x, y in core)

    low, high = -1, 0x7FE << 52
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return _double(high)


def _double(bits: int) -> float:
    return float(struct.unpack(">d", bits.to_bytes(8, "big"))[0])


def wall(asked: WallQuestion) -> tuple[int, int] | None:
    """Return tick and wall of a contact, or None (rule 6s)."""
    body = asked.body
    xs, ys = ([Double(corner[axis]) for corner in body.core] for axis in (0, 1))
    r = Double(body.radius)
    left, right, bottom, top = (
        [float(r - min(each, key=float)), float(r + max(each, key=float))][side]
        for each in (xs, ys)
        for side in (0, 1)
    )
    plan = Plan(*body[2:6], body.radius, body.anchor)
    return wall_contact(plan, asked.arena, asked.e, reaches=(left, right, bottom, top))


def exchange(asked: Impact) -> tuple[Velocity, Velocity]:
    """Return the velocities of a and b after their contact (rule 9s)."""
    one, two = asked.one, asked.two
    return exchange_along(_normal(one, two), (one.vx, one.vy), (two.vx, two.vy), asked.masses)


def _normal(one: Body, two: Body) -> tuple[Double, Double]:
    course = Course(one, two, 0)
    dx, dy = Double(two.x) - Double(one.x), Double(two.y) - Double(one.y)

    def from_place(place: tuple[int, int]) -> tuple[Double, Double]:
        x, y = (Double(Fraction(each, course.unit)) for each in place)
        return dx - x, dy - y

    if not course.faces:
        return normal(*from_place(course.corners[0]))
    closing = [face for face in course.faces if dot(face.normal, course.v) < 0]
    best = None
    for face in course.faces if course.r or not closing else closing:
        tx, ty = (Double(Fraction(each, course.unit)) for each in face.way)
        length = sqrt(tx * tx + ty * ty)
        nx, ny = ty / length, Double(0) - tx / length
        x, y = from_place(face.start)
        gap = nx * x + ny * y
        if best is None or gap.exact > best[0].exact:
            best = gap, face, nx, ny
    assert best is not None
    _, face, nx, ny = best
    if course.r:
        first = from_place(face.start)
        last = from_place((face.start[0] + face.way[0], face.start[1] + face.way[1]))
        if (nx * first[1] - ny * first[0]).exact < 0:
            return normal(*first)
        if (nx * last[1] - ny * last[0]).exact > 0:
            return normal(*last)
    return nx, ny


# What is asked


def shapes() -> dict[str, list[Shape]]:
    """Shapes of short numbers, and of any."""
    d = Draws("sizes of shapes")
    lattice = [on_lattice(d, d.pick((1.0, 1 / 16)), d.pick((2, 6))) for _ in range(50)]
    return {"lattice": lattice, "any": [anywhere(d) for _ in range(50)]}


def walls() -> dict[str, list[WallQuestion]]:
    """Bodies in an arena: at a wall exactly, at two walls at one tick, or anywhere; and those of
    ``shapes.json`` that fly to a segment, with a wall in its place."""
    d = Draws("shapes at walls")
    made: dict[str, list[WallQuestion]] = {"lattice": [], "any": []}
    for _ in range(60):
        core, radius = on_lattice(d, 1 / 16, 4)
        arena = d.whole(2, 4) / 2, d.whole(2, 4) / 2
        place = d.whole(4, 16) / 16, d.whole(4, 16) / 16
        speed = d.whole(-4, 4) / 4, d.whole(-4, 4) / 4
        anchor = d.pick((0, d.whole(-(1 << 60), 1 << 60)))
        made["lattice"].append(
            WallQuestion(d.pick((0, 3)), arena, Body(core, radius, *place, *speed, anchor))
        )
        core, radius = anywhere(d)
        place = d.uniform(1.0, 8.0), d.uniform(1.0, 8.0)
        speed = d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)
        made["any"].append(WallQuestion(0, (9.0, 9.5), Body(core, radius, *place, *speed, anchor)))
    d = Draws("shapes, " + WALL_AS_SEGMENT)
    bodies = [wall_as_segment(d).two for _ in range(FAMILIES[WALL_AS_SEGMENT][1])]
    return made | {WALL_AS_SEGMENT: [WallQuestion(0, (6.0, 6.0), body) for body in bodies]}


def impacts() -> dict[str, list[Impact]]:
    """The first contacts of each family of shapes, both bodies anchored at the tick."""
    made = {}
    for family, (sampler, count) in FAMILIES.items():
        d, masses = Draws("shapes, " + family), Draws("masses, " + family)
        asked = (sampler(d) for _ in range(count))
        made[family] = list(islice(_met(asked, masses), 30))
    return made


def _met(asked: Iterable[Question], masses: Draws) -> Iterator[Impact]:
    for each in asked:
        met = meeting(each)
        if met is not None:
            drawn = masses.pick((None, (masses.power(-9, 9), masses.power(-9, 9))))
            yield Impact(drawn, *(_anchored(body, met.tick, each.e) for body in (each.one, each.two)))


def _anchored(body: Body, tick: int, e: int) -> Body:
    then = anchored(Plan(*body[2:6], body.radius, body.anchor), tick, e)
    return body._replace(x=then.x, y=then.y, anchor=0)
