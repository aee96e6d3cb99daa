"""Flight plans, and their changes at a contact.

The time since a plan's anchor is a difference of integer ticks, so it is exact however late the clock is. A
contact, a command or the clock anchors a plan again, a structural event never does, so that a trajectory is a
function of the scene alone. ``kernel.plan`` evaluates a plan at a time.

At a contact two bodies exchange momentum along a normal, computed to half an ulp. An error there would recur
at every contact of the same two bodies, and energy would drift in proportion to the contacts.
"""

import math

import numpy as np

from kinetile.arrays import Array, Floats, Integers
from kinetile.kernel import plan
from kinetile.kernel.compiled import hook, smaller, with_accelerations
from kinetile.kernel.plan import AcceleratedPlan, Plan, positions_after
from kinetile.kernel.tables import NEVER, Kernel, Records
from kinetile.kernel.vectors import product_error, put_place

position_after = with_accelerations(hook(plan.accelerated_position_after))(hook(plan.position_after))
velocity_after = with_accelerations(hook(plan.accelerated_velocity_after))(hook(plan.velocity_after))


@hook
def since_anchor(k: Kernel, body: Records, tick: int) -> float:
    """Returns the time from a body's anchor to a tick, in the scene's unit."""
    return float((tick - body.anchor) * k.clock[0].per_tick)


@hook
def position_at(k: Kernel, body: Records, tick: int) -> tuple[float, float]:
    """Returns the position of a body at a tick, by its plan."""
    return position_after(body, since_anchor(k, body, tick))


@hook
def velocity_at(k: Kernel, body: Records, tick: int) -> tuple[float, float]:
    """Returns the velocity of a body at a tick, by its plan."""
    return velocity_after(body, since_anchor(k, body, tick))


@hook
def anchor_at(k: Kernel, body: Records, tick: int) -> None:
    """Anchors a body's plan at a tick, without changing its motion."""
    body.x, body.y, body.vx, body.vy = position_at(k, body, tick) + velocity_at(k, body, tick)
    body.anchor = tick


@hook
def square_of_speed(body: Records) -> float:
    """Returns the square of a body's speed at its anchor."""
    return float(body.vx * body.vx + body.vy * body.vy)


@hook
def _twice_energy(body: Records) -> float:
    return square_of_speed(body) - 2.0 * float(body.ax * body.x + body.ay * body.y)


@with_accelerations(_twice_energy)
@hook
def twice_energy(body: Records) -> float:
    """Returns twice the energy, per mass, at the anchor of a body's plan: the square of its speed; for an
    accelerated body, the square of its speed on arrival in the corner (0, 0) from its place, begun at rest,
    is added; this is below 0 if it has to be thrown up to there."""
    return square_of_speed(body)


@hook
def since_origin(k: Kernel, tick: int) -> float:
    """Returns the time from the common clock's origin to a tick, in the scene's unit."""
    clock = k.clock[0]
    return float((tick - clock.origin) * clock.per_tick)


@hook
def _note_pull(body: Records, k: Kernel, number: int) -> None:
    end = math.inf if body.end == NEVER else since_origin(k, body.end)
    put_place(k.pulls, number, body.ax, body.ay, end, 0.0)


@with_accelerations(_note_pull)
@hook
def note_pull(body: Records, k: Kernel, number: int) -> None:
    """Writes a body's row of ``k.pulls``, if it exists: its acceleration, and the end of its chord."""


@hook
def note_place(k: Kernel, number: int) -> None:
    """Writes a body's row of ``k.places``: its position by its plan at the origin of the common clock.

    Rounded once more than its plan, so only good for bounds.
    """
    body = k.bodies[number]
    x, y = position_at(k, body, k.clock[0].origin)
    vx, vy = velocity_at(k, body, k.clock[0].origin)
    put_place(k.places, number, x, y, vx, vy)
    note_pull(body, k, number)


@hook
def note_all_places(k: Kernel, tick: int) -> None:
    """Moves the origin of the common clock to a tick."""
    k.clock[0].origin = tick
    for body in range(k.clock[0].bodies):
        note_place(k, body)


def plans_now(k: Kernel, slots: Integers | None = None) -> tuple[Plan | AcceleratedPlan, Floats]:
    """Returns the plans of all bodies, or of the bodies in given slots, and the times since their anchors."""
    clock, bodies = k.clock.view(np.ndarray)[0], k.bodies.view(np.ndarray)
    if slots is not None:
        bodies = bodies.take(slots)
    return Plan.of(bodies), (clock["now"] - bodies["anchor"]) * clock["per_tick"]


def positions_now(k: Kernel, slots: Integers | None = None) -> Floats:
    """Returns (n, 2) positions now, of all bodies or of the bodies in given slots; not for hooks."""
    return positions_after(*plans_now(k, slots))


def whole_pulls(k: Kernel, slots: Array, held: bool = False) -> Floats:
    """Returns (n, 2) accelerations of bodies in slots, as if nothing held them, or ``held``; not for
    hooks."""
    bodies = k.bodies.view(np.ndarray).take(slots)
    for names in (("ax", "ay"),) if held else (("whole_x", "whole_y"), ("ax", "ay")):
        if names[0] in (bodies.dtype.names or ()):
            return np.stack([bodies[name] for name in names], axis=-1)
    return np.zeros((len(bodies), 2))


@hook
def closing_speed(one: Records, two: Records, nx: float, ny: float) -> float:
    """Returns (v . n) / (n . n) for the relative velocity v and a vector n of length nearly 1, to half an
    ulp. Both products are carried in full: the plain formula is wrong by an ulp or so."""
    vx = two.vx - one.vx
    vy = two.vy - one.vy
    xx = nx * nx
    yy = ny * ny
    excess = ((xx - 0.5) + (yy - 0.5)) + (product_error(nx, nx, xx) + product_error(ny, ny, yy))
    px = vx * nx
    py = vy * ny
    total = px + py
    part = total - px
    low = (px - (total - part)) + (py - part) + (product_error(vx, nx, px) + product_error(vy, ny, py))
    return float(total + (low - total * excess))


@hook
def since_touched(k: Kernel, a: int, b: int) -> float:
    """Returns the time since the last contact of either of two bodies, or of a body before a wall."""
    now = k.clock[0].now
    since = now - k.traits[a].touched
    if b >= 0:
        since = smaller(since, now - k.traits[b].touched)
    return float(since * k.clock[0].per_tick)


@hook
def give(k: Kernel, a: int, b: int, nx: float, ny: float, speed: float) -> None:
    """Exchanges momentum along a normal of length 1, as equals that close in at a speed do elastically."""
    one = k.bodies[a]
    two = k.bodies[b]
    one_share = shared(k.mass[a], k.mass[b], speed)
    two_share = shared(k.mass[b], k.mass[a], speed)
    one.vx += one_share * nx
    one.vy += one_share * ny
    two.vx -= two_share * nx
    two.vy -= two_share * ny


@hook
def shared(mass: float, other: float, speed: float) -> float:
    """Returns a body's part of an exchange: 2 other / (mass + other) speed, to about half an ulp. A body of
    infinite mass takes 0, and the other one takes 2; two bodies of infinite mass part as two equal ones."""
    if mass == math.inf:
        return speed if other == math.inf else 0.0
    if other == math.inf:
        return 2.0 * speed
    both = mass + other
    part = both - mass
    low = (mass - (both - part)) + (other - part)
    share = 2.0 * other / both
    back = share * both
    rest = ((2.0 * other - back) - product_error(share, both, back) - share * low) / both
    taken = share * speed
    return taken + (product_error(share, speed, taken) + rest * speed)
