"""The built-in responses: the effect of a contact on the two bodies.

``elastic`` and ``pass`` are in the kernel, and only listed here. ``restitution`` gives back a share e of the
closing speed of two bodies, and its ``grip`` takes a share of their velocity along the face. With e < 1 three
bodies on a line can have infinitely many contacts in a finite time (McNamara and Young 1992; Zhou and
Kadanoff 1996), so it has the TC rule (Luding and McNamara, Granular Matter 1, 113, 1998): a contact within
``contact_time`` of the last one of either body loses no energy.
``stop`` brings both to rest, such as a projectile and its target.
"""

import math
from typing import Any

from kinetile.errors import BadOption, Refused
from kinetile.scene import Scene
from kinetile.scene.checks import is_finite
from kinetile.toolbox import (
    Kernel,
    Records,
    ResponseParts,
    closing_speed,
    hook,
    rest,
    rests_on,
    since_touched,
    support_velocity,
    unchecked,
)
from kinetile_plugins.disc import exchange


class Elastic:
    """The response of the narrow phases: it conserves momentum and energy."""

    def prepare(self, scene: Scene) -> ResponseParts:
        """Returns no hook: the kernel has it."""
        return ResponseParts(beside=FAMILY)


class Pass(Elastic):
    """The two pass through each other."""


@hook
def take_along(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    """Takes the share ``rule.fourth`` of the velocity of two bodies, or of a body at a wall, across a unit
    normal; of an immovable one the surface counts, which has the velocity (``rule.fifth``, ``sixth``). One
    that has settled on a movable one takes its velocity."""
    tx = -ny
    ty = nx
    one = k.bodies[a]
    support = b
    alike = b >= 0 and (k.mass[a] < math.inf) == (k.mass[b] < math.inf)
    if b >= 0 and ((k.mass[a] == math.inf and not alike) or rests_on(k.bodies[b], a)):
        one = k.bodies[b]
        support = a
    elif alike and not rests_on(one, b):
        exchange(k, a, b, tx, ty, 0.5 * rule.fourth)
        return
    ux, uy = support_velocity(k, support)
    vx = one.vx - (ux + rule.fifth)
    vy = one.vy - (uy + rule.sixth)
    speed = rule.fourth * (vx * tx + vy * ty)
    one.vx -= speed * tx
    one.vy -= speed * ty


@unchecked
@hook
def give_back(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    """Reverses the closing speed, times the share ``rule.first``; the whole speed within ``rule.second``. Two
    bodies that close at ``rule.third`` at most settle, if they may (rule 9r). Then takes the share
    ``rule.fourth`` of their velocity along the face."""
    back = rule.first if since_touched(k, a, b) > rule.second else 1.0
    slow = rule.third
    one = k.bodies[a]
    if slow > 0.0:
        speed = -(one.vx * nx + one.vy * ny)
        if b >= 0:
            speed = closing_speed(one, k.bodies[b], nx, ny)
        if not speed < -slow and rest(k, a, b, nx, ny, slow):
            if rule.fourth > 0.0:
                take_along(k, a, b, nx, ny, rule)
            return
    if b < 0:
        speed = (1.0 + back) * (one.vx * nx + one.vy * ny)
        one.vx -= speed * nx
        one.vy -= speed * ny
    else:
        exchange(k, a, b, nx, ny, 0.5 * (1.0 + back))
    if rule.fourth > 0.0:
        take_along(k, a, b, nx, ny, rule)


class Restitution:
    """A share of the closing speed comes back.

    Args:
        e: the coefficient of restitution, from 0 to 1.
        contact_time: a contact within this time of the last one of either body loses no energy (a contact of
            an immovable body with a movable one does not count), and bodies that accelerations press together
            return after about this time at the earliest; in the scene's time, below 1,024 units of its clock.
            Optional only if e is 1.
        settle: a speed. A body of finite mass that meets a wall, or a face of an immovable body, no faster
            than this, rests there or slides along it, and moves with it. For scenes with accelerations and
            an arena; without it no body comes to rest.
        grip: the share, from 0 to 1, of the relative velocity along the face that is taken at each contact,
            and when a body settles. With 1 a body is carried by what it stands on.
        surface: (vx, vy), the velocity of a wall's or an immovable body's surface, relative to it, as of a
            conveyor; for grip, which takes its part along the face alone.
        one_way: (x, y), a direction. An immovable body is met by a movable one that is on this side: where
            the normal from the immovable one has a part along it. Otherwise the two pass, and so do two that
            are both movable or both immovable. For bodies, not for walls.

    Raises BadOption for invalid options, for e < 1 without a contact_time above 0, and for a surface without
    grip.
    """

    def __init__(
        self,
        e: float,
        contact_time: float | None = None,
        settle: float | None = None,
        grip: float = 0.0,
        surface: tuple[float, float] | None = None,
        one_way: tuple[float, float] | None = None,
    ) -> None:
        wrong = []
        if not is_finite(e) or not 0.0 <= e <= 1.0:
            wrong.append(f"e is {e!r}; expected a number from 0 to 1 (for more: a response of your own)")
        elif e < 1.0 and not contact_time:
            wrong.append(
                f"e is {e!r} and there is no contact_time; without one infinitely many contacts can come in "
                "a finite time: give one, 1e-4 of the mean time between contacts, in games 1e-3 s"
            )
        if contact_time is not None and (not is_finite(contact_time) or contact_time < 0.0):
            wrong.append(f"contact_time is {contact_time!r}; expected a length of time")
        if settle is not None and (not is_finite(settle) or settle <= 0.0):
            wrong.append(f"settle is {settle!r}; expected a speed above 0")
        if not is_finite(grip) or not 0.0 <= grip <= 1.0:
            wrong.append(f"grip is {grip!r}; expected a number from 0 to 1")
        elif surface is not None and not grip:
            wrong.append("a surface moves nothing without grip; expected a grip above 0")
        for name, value in (("surface", surface), ("one_way", one_way)):
            if value is not None and not _is_vector(value):
                wrong.append(f"{name} is {value!r}; expected two numbers, such as (0.0, 1.0)")
        if one_way is not None and _is_vector(one_way) and not any(one_way):
            wrong.append("one_way is (0, 0); expected a direction, such as (0.0, 1.0) for a ledge from below")
        if wrong:
            raise BadOption("\n".join(f"restitution: {each}" for each in wrong))
        moves = map(float, surface or ())
        self.numbers = (float(e), float(contact_time or 0.0), float(settle or 0.0), float(grip), *moves)

    def prepare(self, scene: Scene) -> ResponseParts:
        """Returns the parts; raises Refused for a contact_time that is longer than the kernel remembers, and
        for settle in a scene whose bodies cannot settle."""
        if self.numbers[2] and (not scene.accelerated or scene.arena is None):
            lacks = "arena" if scene.accelerated else "accelerations"
            raise Refused(
                f"restitution: bodies settle by accelerations in an arena; the scene has no {lacks}"
            )
        longest = REMEMBERED * scene.time_unit
        if self.numbers[1] >= longest:
            raise Refused(
                f"restitution: contact_time is {self.numbers[1]!r}; expected less than {longest!r}, "
                f"{REMEMBERED:,} units of the clock, which is {scene.time_unit!r} in this scene"
            )
        return ResponseParts(give_back, self.numbers, FAMILY, self.numbers[1])


def _is_vector(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(map(is_finite, value))


REMEMBERED = 1024
"""Units of the clock, 2^62 ticks, after which the kernel forgets the tick of a body's last contact."""


@unchecked
@hook
def halt(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    """Brings both to rest; a body that meets an immovable one, to rest relative to it. A body with a contact
    within ``rule.first`` loses its speed along the normal alone (rule 11h): else a pile would be a jam."""
    one = k.bodies[a]
    if since_touched(k, a, b) <= rule.first:
        if b >= 0:
            exchange(k, a, b, nx, ny, 0.5)
        else:
            out = one.vx * nx + one.vy * ny
            one.vx -= out * nx
            one.vy -= out * ny
        return
    vx = 0.0
    vy = 0.0
    if b >= 0 and (k.mass[a] < math.inf) != (k.mass[b] < math.inf):
        still = b if k.mass[a] < math.inf else a
        vx = k.bodies[still].vx
        vy = k.bodies[still].vy
    one.vx = vx
    one.vy = vy
    if b >= 0:
        k.bodies[b].vx = vx
        k.bodies[b].vy = vy


class Stop:
    """The response that brings both bodies to rest."""

    def prepare(self, scene: Scene) -> ResponseParts:
        """Returns the parts."""
        return ResponseParts(halt, (scene.time_unit * 2.0**-15 if scene.accelerated else -1.0,), FAMILY)


FAMILY = (give_back, halt)
"""Hooks of every loop with rules: a scene with another response of this module compiles no new loop."""
