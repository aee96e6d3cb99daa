"""The answer for upright boxes and discs, by rationals alone: rules 5s, 6s, 7s and 9s of
docs/specification.md, event by event, every pair and every wall.

Short runs only: no anchorings by the clock, and no commands.
"""

from __future__ import annotations

from itertools import combinations

import kinetile as kt
from kinetile_accuracy.specification.arithmetic import FlightPlan, Frame, exchanged, unit_bits
from kinetile_accuracy.specification.shapes import contact, wall_tick

Place = tuple[float, float]


def halves(shape: kt.Shape) -> Place:
    """Return half a width and half a height of a box; 0 for a disc."""
    return shape.core[-2] if len(shape.core) == 4 else (0.0, 0.0)


def normal(one: kt.Shape, two: kt.Shape, d: Place, v: Place) -> Place:
    """Return the line of an exchange (rule 9s), from the rounded separation and relative velocity."""
    (dx, dy), margin = d, one.radius + two.radius
    width, height = (a + b for a, b in zip(halves(one), halves(two), strict=True))
    beside, above = abs(dx) - width, abs(dy) - height
    if margin > 0 and beside > 0 and above > 0:
        return dx - (width if dx > 0 else -width), dy - (height if dy > 0 else -height)
    closing = dx * v[0] < 0, dy * v[1] < 0
    across = beside >= above
    if margin == 0 and closing[0] != closing[1]:
        across = closing[0]
    if across:
        return (1.0 if dx > 0 else -1.0), 0.0
    return 0.0, (1.0 if dy > 0 else -1.0)


def contacts_of(scene: kt.Scene, most: int, until: int) -> list[tuple[int, int, int]]:
    """Return up to ``most`` contacts of a scene, (tick, a, b), up to and at a tick."""
    bits = unit_bits(scene)
    frame = Frame(scene.arena, bits)
    tick = 2.0**-frame.fine
    shapes = [scene.shapes[each] for each in scene.shape.tolist()]
    radii, masses = scene.radius.tolist(), scene.mass.tolist()
    plans = [
        FlightPlan(*place, *velocity, 0, radius, frame)
        for place, velocity, radius in zip(
            scene.position.tolist(), scene.velocity.tolist(), radii, strict=True
        )
    ]
    last: list[int | None] = [None] * len(plans)
    found: list[tuple[int, int, int]] = []

    def anchored(body: int, at: int, velocity: Place | None = None) -> FlightPlan:
        plan = plans[body]
        speed = (plan.vx, plan.vy) if velocity is None else velocity
        return FlightPlan(*plan.rounded_place(at, tick), *speed, at, radii[body], frame)

    while len(found) < most:
        events = []
        for a, plan in enumerate(plans):
            wall = wall_tick(shapes[a], plan, frame)
            if wall is not None:
                events.append((wall[0], 3, a, -wall[1]))
        for a, b in combinations(range(len(plans)), 2):
            if not (last[a] == b and last[b] == a):
                met = contact((shapes[a], shapes[b]), plans[a], plans[b])
                if met is not None:
                    events.append((met.tick, 4, a, b))
        if not events or min(events)[0] > until:
            return found
        at, kind, a, b = min(events)
        one = anchored(a, at)
        if kind == 3:
            plans[a] = anchored(a, at, (-one.vx, one.vy) if b < 3 else (one.vx, -one.vy))
            last[a] = None
            found.append((at, a, -b))
            continue
        two = anchored(b, at)
        v = two.vx - one.vx, two.vy - one.vy
        line = normal(shapes[a], shapes[b], (two.x - one.x, two.y - one.y), v)
        places = (one.vx, one.vy), (two.vx, two.vy)
        equal = len(set(masses)) == 1
        new = exchanged(((0.0, 0.0), line), places, None if equal else (masses[a], masses[b]))
        plans[a], plans[b] = anchored(a, at, new[0]), anchored(b, at, new[1])
        last[a], last[b] = b, a
        found.append((at, a, b))
    return found
