"""Rest: bodies that one or two supports hold against their accelerations (rules 9r, 8r and 9h).

A support is a wall, an immovable body, or a body that another support holds from the same side and that is
not accelerated: so stacks rest. What frees a body frees all that it holds.

A plan has the *present* acceleration in ``ax`` and ``ay``, which all evaluations use, and the *whole* one
beside it; they differ while the body is held. Each event of a body that is no pass frees it first
(``let_go``), and a response may have it settle again (``rest``). The loop has decided before whether it can
(``responses.consider``), because only the narrow phase computes when a body leaves its support.
"""

import math

from kinetile.kernel.compiled import hook, with_field
from kinetile.kernel.features import RESTING, only_with
from kinetile.kernel.tables import NEVER, NOBODY, Kernel, Records

NOT, WITH_ANOTHER, ALONE = range(3)
"""Whether a body may settle at this contact: no; only with its former support; or with this one alone."""


@hook
def is_held_by(k: Kernel, body: int, other: int) -> bool:
    """Returns True if a body is held by the body in a slot, or by a wall."""
    plan = k.bodies[body]
    return bool((plan.supports > 0 and plan.support == other) or (plan.supports > 1 and plan.second == other))


@hook
def _account_hold(k: Kernel, body: int, sign: float) -> None:
    """Accounts for the potential energy that a body has no longer, or again, when a support holds it:
    a support that moves works on it meanwhile."""
    plan = k.bodies[body]
    if k.mass[body] < math.inf:
        lacks = (plan.ax - plan.whole_x) * plan.x + (plan.ay - plan.whole_y) * plan.y
        k.counts[0].commanded_energy -= sign * k.mass[body] * lacks


@hook
def hangs(k: Kernel, body: int) -> bool:
    """Returns True if a movable body that holds a body is not held itself."""
    plan = k.bodies[body]
    return bool(plan.supports > 0 and (_falls(k, plan.support) or _falls(k, plan.second)))


@hook
def _falls(k: Kernel, support: int) -> bool:
    return bool(support >= 0 and k.mass[support] < math.inf and k.bodies[support].supports == 0)


@hook
def _count_on_supports(k: Kernel, body: int, count: int, change: int) -> None:
    """Adds to the number of bodies that the first ``count`` supports of a body hold."""
    plan = k.bodies[body]
    if count > 0 and plan.support >= 0:
        k.bodies[plan.support].carries += change
    if count > 1 and plan.second >= 0:
        k.bodies[plan.second].carries += change


@only_with(RESTING)
@hook
def let_go(k: Kernel, body: int) -> None:
    """Gives a body its whole acceleration. Its former supports remain stored until ``take_hold``."""
    plan = k.bodies[body]
    _count_on_supports(k, body, plan.supports, -1)
    plan.was_x = plan.ax
    plan.was_y = plan.ay
    _account_hold(k, body, -1.0)
    plan.ax = plan.whole_x
    plan.ay = plan.whole_y
    plan.may = NOT
    plan.holds = 0


@only_with(RESTING)
@hook
def take_hold(k: Kernel, body: int) -> bool:
    """Applies a response's decision on a freed body; returns True if its acceleration has changed."""
    plan = k.bodies[body]
    plan.may = NOT
    plan.supports = plan.holds
    _count_on_supports(k, body, plan.supports, 1)
    _account_hold(k, body, 1.0)
    if plan.holds < 2:
        plan.second = NOBODY
    if plan.holds == 0:
        plan.support = NOBODY
        plan.ledge = NEVER
    return bool(plan.ax != plan.was_x or plan.ay != plan.was_y)


@hook
def without(ax: float, ay: float, mx: float, my: float) -> tuple[float, float]:
    """Returns a vector without its part along a normal."""
    part = ax * mx + ay * my
    return ax - part * mx, ay - part * my


@hook
def support_velocity(k: Kernel, support: int) -> tuple[float, float]:
    """Returns the velocity of a body that is a support, or of a wall (below 0), which has none."""
    if support < 0:
        return 0.0, 0.0
    return k.bodies[support].vx, k.bodies[support].vy


@hook
def stands(k: Kernel, body: int, mx: float, my: float) -> bool:
    """Returns True if a body that an event has freed was held by one support, with this normal, and not
    accelerated: it may hold another that meets it with the same normal."""
    plan = k.bodies[body]
    still = plan.was_x == 0.0 and plan.was_y == 0.0
    return bool(plan.supports == 1 and still and plan.side_x == mx and plan.side_y == my)


@hook
def _hold_again(k: Kernel, support: int) -> None:
    """Has a movable support held as it was until this event, which has freed it."""
    if support >= 0 and k.mass[support] < math.inf:
        under = k.bodies[support]
        under.ax = under.was_x
        under.ay = under.was_y
        under.holds = 1


@hook
def _settles(plan: Records, k: Kernel, support: int, mx: float, my: float, slow: float) -> bool:
    dx, dy = without(plan.ax, plan.ay, mx, my)
    ux, uy = support_velocity(k, support)
    vx = plan.vx - ux
    vy = plan.vy - uy
    if plan.may != NOT and plan.supports == 1 and vx * vx + vy * vy <= slow * slow:
        alike = support_velocity(k, plan.support) == (ux, uy)
        cx, cy = without(plan.ax, plan.ay, plan.side_x, plan.side_y)
        if alike and cx * mx + cy * my < 0.0 and dx * plan.side_x + dy * plan.side_y < 0.0:
            plan.vx = ux
            plan.vy = uy
            plan.ax = plan.ay = 0.0
            plan.second = support
            plan.holds = 2
            plan.ledge = NEVER
            _hold_again(k, support)
            return True
    if plan.may != ALONE:
        return False
    vx, vy = without(vx, vy, mx, my)
    plan.vx = ux + vx
    plan.vy = uy + vy
    plan.ax = dx
    plan.ay = dy
    plan.support = support
    plan.side_x = mx
    plan.side_y = my
    plan.holds = 1
    _hold_again(k, support)
    return True


@with_field("whole_x", _settles)
@hook
def settles(plan: Records, k: Kernel, support: int, mx: float, my: float, slow: float) -> bool:
    """Makes a body settle on a support, given the normal from it, if it may; returns True if it has."""
    return False


@hook
def _settled_on(plan: Records, support: int) -> bool:
    return bool(plan.holds > 0 and plan.support == support)


@with_field("whole_x", _settled_on)
@hook
def rests_on(plan: Records, support: int) -> bool:
    """Returns True if a body has settled on a support alone in the response that is running."""
    return False


@hook
def rest(k: Kernel, a: int, b: int, nx: float, ny: float, slow: float) -> bool:
    """Makes a body settle on the other one, of two bodies, or of a body and a wall (b below 0), in a
    response; returns True if it has. The normal is from a to b, or into the wall.

    A body of finite mass rests on a wall, or on the face of a body of infinite mass or of one that rests
    itself, and moves with it: it keeps the relative velocity along the face, and is accelerated along it
    alone, until it is freed (rule 9h). A body that is no faster than ``slow``, relative to them, may be held
    by two. Scenes whose responses have an option ``settle`` have supports; in others nothing settles. Before:
    the two do not close in by more than ``slow``.
    """
    if settles(k.bodies[a], k, b, -nx, -ny, slow):
        return True
    return bool(b >= 0 and settles(k.bodies[b], k, a, nx, ny, slow))


@hook
def _pull_until(plan: Records) -> tuple[float, float]:
    return plan.was_x, plan.was_y


@with_field("whole_x", _pull_until)
@hook
def _pull_of(plan: Records) -> tuple[float, float]:
    """Returns the present acceleration that a body has had until the present contact."""
    return plan.ax, plan.ay


@hook
def pull_between(k: Kernel, a: int, b: int) -> tuple[float, float]:
    """Returns b's present acceleration until this contact less a's; for a wall (b below 0) it is 0."""
    x, y = _pull_of(k.bodies[a])
    if b >= 0:
        other_x, other_y = _pull_of(k.bodies[b])
        return other_x - x, other_y - y
    return -x, -y
