"""The files of single questions, with the answers of the rules."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from . import convex
from .contacts import FAMILIES
from .draws import Draws
from .others import Impact, Moment, Moved, Pace, WallQuestion, impacts, moments, moved, paces, walls
from .rules import anchored, exchange, meeting, tick_of, unit_exponent, wall_contact
from .shapes import FAMILIES as OF_SHAPES
from .shapes import Body, Question
from .shapes import meeting as shapes_meeting
from .writing import Row, number, numbers, plan, table

__all__ = ["files"]

Q = TypeVar("Q")


def files() -> dict[str, str]:
    """Return the text of each file, by its path in this folder."""
    e = "e: the unit is 2^-e"
    return {
        **{f"contacts/{name}.json": _contacts(name) for name in FAMILIES},
        "walls.json": table(
            "Rule 6: when a body meets a wall, and which.",
            (e, "width, height", "plan", "tick and wall, or null"),
            _answered(walls(), _wall),
        ),
        "exchanges.json": table(
            "Rule 9: velocities after a contact of two bodies.",
            ("masses of a and b, or null: equal", "a: x y vx vy", "b: x y vx vy", "vxa vya vxb vyb after it"),
            _answered(impacts(), _impact),
        ),
        "places.json": table(
            "Rule 4: where a plan's place is after it has been anchored.",
            (e, "x y vx vy", "anchor", "tick", "x y then"),
            _answered(moved(), _place),
        ),
        "units.json": table(
            "Rule 3: the unit of a scene.",
            ("width, height, or null", "bodies: x y vx vy radius", "velocities of turns", e),
            _answered(paces(), _unit),
        ),
        "times.json": table(
            "Rule 3: the tick of a time.", (e, "start", "time", "tick"), _answered(moments(), _tick)
        ),
        "shapes.json": table(
            "Rule 5s: when two bodies a and b of convex shapes meet, and at which feature.",
            (
                e,
                "a: core, radius, plan",
                "b: core, radius, plan",
                "tick, face or corner, its number; or null",
            ),
            {name: _of_shapes(name) for name in OF_SHAPES},
        ),
        "shape_sizes.json": table(
            "Rule 3s: the r of a shape.", ("core", "radius", "r"), _answered(convex.shapes(), _size)
        ),
        "shape_walls.json": table(
            "Rule 6s: when a body of a convex shape meets a wall, and which.",
            (e, "width, height", "core, radius, plan", "tick and wall, or null"),
            _answered(convex.walls(), _shape_wall),
        ),
        "shape_exchanges.json": table(
            "Rule 9s: velocities after a contact of two bodies of convex shapes.",
            (
                "masses of a and b, or null: equal",
                "a: core, radius, x y vx vy",
                "b: core, radius, x y vx vy",
                "vxa vya vxb vyb after it",
            ),
            _answered(convex.impacts(), _shape_impact),
        ),
    }


def _answered(families: Mapping[str, Sequence[Q]], row: Callable[[Q], Row]) -> dict[str, list[Row]]:
    return {name: [row(asked) for asked in questions] for name, questions in families.items()}


def _of_shapes(family: str) -> list[Row]:
    sampler, count = OF_SHAPES[family]
    d = Draws("shapes, " + family)
    return [_shapes(sampler(d)) for _ in range(count)]


def _shapes(asked: Question) -> Row:
    met = shapes_meeting(asked)
    answer = None if met is None else [str(met.tick), met.kind, met.number]
    return asked.e, _body(asked.one), _body(asked.two), answer


def _body(of: Body) -> list[list[str] | list[list[str]] | str]:
    flight = [*numbers(of.x, of.y, of.vx, of.vy), str(of.anchor)]
    return [numbers(*corner) for corner in of.core], number(of.radius), flight


def _size(asked: convex.Shape) -> Row:
    core, radius = asked
    return [numbers(*corner) for corner in core], number(radius), number(convex.size(core, radius))


def _shape_wall(asked: convex.WallQuestion) -> Row:
    found = convex.wall(asked)
    answer = None if found is None else (str(found[0]), found[1])
    return asked.e, numbers(*asked.arena), _body(asked.body), answer


def _shape_impact(asked: convex.Impact) -> Row:
    masses = None if asked.masses is None else numbers(*asked.masses)
    after_a, after_b = convex.exchange(asked)
    bodies = [[*_body(body)[:2], _body(body)[2][:4]] for body in (asked.one, asked.two)]
    return masses, *bodies, numbers(*after_a, *after_b)


def _contacts(name: str) -> str:
    families: dict[str, list[Row]] = {}
    for family, (sampler, count) in FAMILIES[name].items():
        d = Draws("contacts, " + family)
        rows = families[family] = []
        for _ in range(count):
            e, one, two = sampler(d)
            tick = meeting(one, two, e)
            rows.append((e, plan(one), plan(two), None if tick is None else str(tick)))
    about = "Rule 5: when two bodies meet. Asked with the bodies the other way round the answer is the same."
    return table(about, ("e: the unit is 2^-e", "plan", "plan", "tick, or null"), families)


def _wall(asked: WallQuestion) -> Row:
    found = wall_contact(asked.plan, asked.arena, asked.e)
    answer = None if found is None else (str(found[0]), found[1])
    return asked.e, numbers(*asked.arena), plan(asked.plan), answer


def _impact(asked: Impact) -> Row:
    masses = None if asked.masses is None else numbers(*asked.masses)
    after_a, after_b = exchange(asked.one, asked.two, asked.masses)
    return masses, numbers(*asked.one[:4]), numbers(*asked.two[:4]), numbers(*after_a, *after_b)


def _place(asked: Moved) -> Row:
    then = anchored(asked.plan, asked.tick, asked.e)
    return (
        asked.e,
        numbers(*asked.plan[:4]),
        str(asked.plan.anchor),
        str(asked.tick),
        numbers(then.x, then.y),
    )


def _unit(asked: Pace) -> Row:
    e = unit_exponent(asked.places, asked.radii, asked.velocities, asked.turned, asked.arena)
    bodies = zip(asked.places, asked.velocities, asked.radii, strict=True)
    return (
        None if asked.arena is None else numbers(*asked.arena),
        [numbers(*place, *velocity, radius) for place, velocity, radius in bodies],
        [numbers(*velocity) for velocity in asked.turned],
        e,
    )


def _tick(asked: Moment) -> Row:
    return asked.e, number(asked.start), number(asked.time), str(tick_of(asked.time, asked.start, asked.e))
