"""Velocities after contacts: rules 9, 9h, 9r, 9s and 11 of docs/specification.md.

The specified responses are elastic, pass, restitution and stop; the effect of others is not specified.
"""

import math
from typing import Any, NamedTuple

from kinetile import Insert, Scene
from kinetile.errors import Refused
from kinetile.toolbox import BOTTOM, LEFT, RIGHT, TOP
from kinetile_accuracy.specification.arithmetic import (
    FlightPlan,
    Separation,
    Vector,
    Whole,
    exchanged_along,
    largest_pull,
    speed_along,
)
from kinetile_accuracy.specification.shapes import Difference, Face, normal_and_face

_KNOWN = ("elastic", "pass", "restitution", "stop")
_OPTIONS = {"e", "contact_time", "settle", "grip", "surface", "one_way"}
LONG_AGO = -(1 << 62)
LASTING = 2.0**38
ROUNDED = 2.0**-44
LOADED = 128.0
OUT = {LEFT: (-1.0, 0.0), RIGHT: (1.0, 0.0), BOTTOM: (0.0, -1.0), TOP: (0.0, 1.0)}


class Support(NamedTuple):
    """A possible support of a body: a wall, or a body, through an image and on a face of their difference
    (None: on no face); ``out`` is the unit normal from it to the body."""

    number: int
    out: Vector
    image: Whole = (0, 0)
    face: Face | None = None


def part(vector: Vector, out: Vector) -> float:
    """Returns the component of a vector along a unit normal."""
    return vector[0] * out[0] + vector[1] * out[1]


def across(vector: Vector, out: Vector) -> Vector:
    """Returns a vector less its part along a unit normal."""
    less = part(vector, out)
    return vector[0] - less * out[0], vector[1] - less * out[1]


def both_hold(pull: Vector, one: Support, two: Support) -> bool:
    """Returns True if each of two supports presses a body with this acceleration on the other (rule 9r)."""
    return part(across(pull, one.out), two.out) < 0 and part(across(pull, two.out), one.out) < 0


class Answers:
    """The velocities after the contacts of a scene, whose tick has a ``length``. ``masses`` are the masses of
    all bodies, present or later ones; ``passing`` is True if some may pass. Raises Refused for responses that
    are not specified."""

    def __init__(self, scene: Scene, count: int, length: float) -> None:
        self._length = length
        self._meets, self._named = scene.meets, scene.kinds
        used = {response.name for row in self._meets for response in row}
        other = sorted(used.difference(_KNOWN))
        if other:
            raise Refused(f"the specification has {', '.join(_KNOWN)}, and this scene has {', '.join(other)}")
        odd = sorted({option for row in self._meets for each in row for option in each.options} - _OPTIONS)
        if odd:
            raise Refused(
                f"the specification has no option {', '.join(odd)} of a response, and this scene has"
            )
        self.passing = any(response.passes for row in self._meets for response in row)
        first = scene.kind_numbers[0] if len(scene) else 0
        self._kinds = scene.kind_numbers.tolist() + [int(first)] * (count - len(scene))
        self.masses = scene.mass.tolist() + [1.0] * (count - len(scene))
        for each in scene.commands:
            if isinstance(each, Insert):
                self.masses[each.body] = each.mass
                if each.kind is not None:
                    self._kinds[each.body] = scene.kinds.index(each.kind)
        ruled = scene.responses or scene.kinds != (0,) or math.inf in self.masses
        self._equal = not ruled and len(set(self.masses)) <= 1
        self._touched = [LONG_AGO] * count
        self._accelerated, self._resting = any(largest_pull(scene)), scene.resting

    def response(self, a: int, b: int) -> Any:
        """Returns the response of two bodies, or of a body and a wall (b below 0)."""
        return self._meets[self._kinds[a]][self._kinds[b] if b >= 0 else -1]

    def passes(self, a: int, b: int) -> bool:
        """Returns True if two bodies may pass through each other, or a body through a wall (b below 0)."""
        return bool(self.response(a, b).passes)

    def meets(self, a: int, b: int, out: Vector) -> bool:
        """Returns True if two bodies that may pass, with the normal from a to b, meet (rule 11w)."""
        still = [math.isinf(self.masses[body]) for body in (a, b)]
        side = part(self.response(a, b).one_way, out)
        return still[0] != still[1] and (side > 0.0 if still[0] else side < 0.0)

    def set_kind(self, body: int, kind: str | int) -> None:
        """Gives a body another kind (rule 11k)."""
        self._kinds[body] = self._named.index(kind)

    def passes_as(self, kind: str | int, body: int) -> bool:
        """Returns True if a body of a kind might pass through a body."""
        return bool(self._meets[self._named.index(kind)][self._kinds[body]].passes)

    def settle(self, a: int, b: int) -> float:
        """Returns the w of rule 9r of two bodies, or of a body and a wall (b below 0); 0 without one."""
        return float((self._accelerated and self.response(a, b).options.get("settle")) or 0.0)

    def touch(self, bodies: tuple[int, ...], now: int) -> None:
        """Notes that bodies are in a contact that counts as their last (rule 11): for an immovable one only
        if no other is movable."""
        movable = [body for body in bodies if self.masses[body] < math.inf]
        for body in movable or bodies:
            self._touched[body] = now

    def at_wall(self, a: int, wall: int, plan: FlightPlan, pull: Vector) -> Vector:
        """Returns the velocity of a body that has met a wall, anchored; its acceleration until then is
        ``pull``."""
        response = self.response(a, wall)
        vx, vy = plan.vx, plan.vy
        nx, ny = OUT[wall]
        share = self._share(response, [a], plan.anchor)
        if share is None:
            vx = vy = 0.0
        elif response.name == "elastic":
            vx, vy = (-vx, vy) if wall in (LEFT, RIGHT) else (vx, -vy)
        elif response.name != "pass":
            w = share * (vx * nx + vy * ny)
            vx, vy = vx - w * nx, vy - w * ny
        vx, vy = self._gripped_by(response, OUT[wall], (vx, vy))
        closing = plan.vx * nx + plan.vy * ny
        least = self._least(response, part(pull, OUT[wall]), closing, self._since([a], plan.anchor))
        out = vx * nx + vy * ny
        if least > 0.0 and -out < least:
            vx, vy = vx - (out + least) * nx, vy - (out + least) * ny
        self.touch((a,), plan.anchor)
        return vx, vy

    def normal(
        self, one: FlightPlan, two: FlightPlan, apart: Vector, m: Difference | None
    ) -> tuple[Vector, Face | None]:
        """Returns the unit normal of two bodies that have met, anchored and at a difference ``apart`` (rule
        9p), and its face, if it has one. ``m`` is the difference of shapes, None for discs."""
        if m is None:
            dx, dy = apart
            size = math.sqrt(dx * dx + dy * dy)
            return (dx / size, dy / size), None
        _, (vx, vy), (hx, hy) = Separation(one, two).ways
        return normal_and_face(m, apart, (vx + hx, vy + hy))

    def of_pair(
        self,
        bodies: tuple[int, int],
        plans: tuple[FlightPlan, FlightPlan],
        along: Vector,
        pulls: tuple[Vector, Vector],
    ) -> tuple[Vector, Vector]:
        """Returns the velocities of two bodies that have met with a normal, anchored; their accelerations
        until then are ``pulls``."""
        (a, b), (one, two) = bodies, plans
        response = self.response(a, b)
        velocities = (one.vx, one.vy), (two.vx, two.vy)
        masses = None if self._equal else (self.masses[a], self.masses[b])
        share = self._share(response, [a, b], one.anchor)
        if share is None:
            still = [math.isinf(self.masses[body]) for body in bodies]
            rest = velocities[still.index(True)] if still[0] != still[1] else (0.0, 0.0)
            velocities = rest, rest
        else:
            speed = 0.5 * share * speed_along(along, velocities)
            velocities = exchanged_along(along, velocities, masses, speed)
        velocities = self._gripped(response, along, velocities, masses)
        (ax, ay), (bx, by) = pulls
        pull, lasting, speed = (bx - ax, by - ay), self._lasting(response), speed_along(along, velocities)
        (vxa, vya), (vxb, vyb) = velocities
        size = ((abs(vxa) + abs(vya)) + (abs(vxb) + abs(vyb))) + lasting * (abs(pull[0]) + abs(pull[1]))
        closing = -speed_along(along, ((one.vx, one.vy), (two.vx, two.vy)))
        since = self._since([a, b], one.anchor)
        least = max(self._least(response, -part(pull, along), closing, since), ROUNDED * size)
        if (self._resting or any(pull)) and speed < least:
            velocities = exchanged_along(along, velocities, masses, 0.5 * (speed - least))
        self.touch(bodies, one.anchor)
        return velocities

    def settled(self, body: int, support: Support, velocity: Vector, its: Vector) -> Vector:
        """Returns the velocity of a body that settles with a velocity on a support, which has its own."""
        return self._gripped_by(self.response(body, support.number), support.out, velocity, its)

    def _gripped(
        self,
        response: Any,
        normal: Vector,
        velocities: tuple[Vector, Vector],
        masses: tuple[float, float] | None,
    ) -> tuple[Vector, Vector]:
        """Returns the velocities of two bodies without what a response takes of them along the face."""
        (one, two), still = velocities, [math.isinf(mass) for mass in masses or (1.0, 1.0)]
        if still == [False, True]:
            return self._gripped_by(response, normal, one, two), two
        if still == [True, False]:
            return one, self._gripped_by(response, normal, two, one)
        grip, along = float(response.options.get("grip") or 0.0), (-normal[1], normal[0])
        if not grip:
            return velocities
        return exchanged_along(along, velocities, masses, 0.5 * grip * speed_along(along, velocities))

    def _gripped_by(self, response: Any, out: Vector, velocity: Vector, its: Vector = (0.0, 0.0)) -> Vector:
        """Returns the same of a body at a wall, or at an immovable body with a velocity."""
        grip, (tx, ty) = float(response.options.get("grip") or 0.0), (-out[1], out[0])
        if not grip:
            return velocity
        sx, sy = response.options.get("surface") or (0.0, 0.0)
        speed = grip * ((velocity[0] - (its[0] + sx)) * tx + (velocity[1] - (its[1] + sy)) * ty)
        return velocity[0] - speed * tx, velocity[1] - speed * ty

    def _lasting(self, response: Any) -> float:
        """Returns the least duration of the flight after a contact (rule 11h)."""
        return float(response.options.get("contact_time") or 0.0) or self._length * LASTING

    def _least(self, response: Any, pull: float, closing: float, since: float) -> float:
        """Returns the least parting speed of two that are pressed together by ``pull``, after they have met
        (rule 11h); ``since``: the time since the last contact of either."""
        time, least = float(response.options.get("contact_time") or 0.0), 0.5 * self._lasting(response) * pull
        if not (least > 0.0 and since <= time):
            return least
        loaded = LOADED * least
        return max(least, loaded if loaded * since <= closing * time else closing * time / since)

    def _since(self, bodies: list[int], now: int) -> float:
        return float(now - max(self._touched[body] for body in bodies)) * self._length

    def _share(self, response: Any, bodies: list[int], now: int) -> float | None:
        """Returns the part of the speed along the normal that bodies lose, 2 if all of it comes back; None:
        they come to rest, and not along the normal alone (rule 11h)."""
        since = self._since(bodies, now)
        if response.name == "stop":
            return 1.0 if self._accelerated and since <= 0.5 * self._length * LASTING else None
        soon = since <= float(response.options.get("contact_time") or 0.0)
        return 2.0 if soon else 1.0 + float(response.options.get("e", 1.0))
