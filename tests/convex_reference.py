"""The answer for convex shapes, by rationals alone: rules 5s, 6s, 7s and 9s of
docs/specification.md, event by event, every pair and every wall.

Short runs only: no anchorings by the clock, and no commands.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations

import kinetile as kt
from kinetile_accuracy.specification.arithmetic import FlightPlan, Frame, exchanged_along, unit_bits
from kinetile_accuracy.specification.shapes import Difference, contact, normal, wall_tick

Place = tuple[float, float]


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
            still = math.isinf(masses[a]) and math.isinf(masses[b])
            if not still and not (last[a] == b and last[b] == a):
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
        v = Fraction(two.vx) - Fraction(one.vx), Fraction(two.vy) - Fraction(one.vy)
        along = normal(Difference(shapes[a], shapes[b]), (two.x - one.x, two.y - one.y), v)
        velocities = (one.vx, one.vy), (two.vx, two.vy)
        equal = len(set(masses)) == 1 and math.isfinite(masses[0])
        new = exchanged_along(along, velocities, None if equal else (masses[a], masses[b]))
        plans[a], plans[b] = anchored(a, at, new[0]), anchored(b, at, new[1])
        last[a], last[b] = b, a
        found.append((at, a, b))
    return found
