"""Rules: what happens where two kinds of bodies meet, or a kind and a wall.

The table ``k.rules`` has a row for each two kinds and for each kind and a wall. Its response is ``ELASTIC``
(what the narrow phase does), ``PASS`` (nothing changes: ``kinetile.kernel.loop.passing``), or one of the
hooks that are composed into the loop. A loop for a scene without rules has none of this in it.
"""

from __future__ import annotations

import math

from kinetile.kernel.compiled import hook, template, to_be_filled_in
from kinetile.kernel.flight import since_anchor
from kinetile.kernel.pairs import follower
from kinetile.kernel.tables import Kernel, Records

__all__ = [
    "ELASTIC",
    "MOST_RESPONSES",
    "PASS",
    "answer",
    "answer_wall",
    "have_passed",
    "is_passing",
    "leaves_out",
    "passes",
    "row_of",
    "rule_of",
]

ELASTIC, PASS, FIRST = range(3)

MOST_RESPONSES = 4
"""Hooks of responses that there can be in a loop."""

RESPONSES = 0
respond_1 = respond_2 = respond_3 = respond_4 = collide = touch = bounce = touch_wall = to_be_filled_in


@hook
def row_of(kinds: int, one: int, other: int) -> int:
    """Return the row of the rule for two of so many kinds; walls come behind the last kind."""
    return int(one * (kinds + 1) + other)


@hook
def rule_of(k: Kernel, a: int, b: int) -> int:
    """Return the row of the rule for the bodies in two slots, or for one and a wall (b below 0)."""
    kinds = k.clock[0].kinds
    return row_of(kinds, k.traits[a].kind, k.traits[b].kind if b >= 0 else kinds)


@hook
def passes(k: Kernel, a: int, b: int) -> bool:
    """Whether two bodies pass through each other."""
    return bool(k.rules[rule_of(k, a, b)].response == PASS)


@hook
def is_passing(k: Kernel, a: int, b: int) -> bool:
    """Whether two bodies are passing through each other now; as long as the shorter of their lists."""
    body = a if k.traits[a].inside < k.traits[b].inside else b
    pair = k.passers[body]
    while pair >= 0:
        record = k.passings[pair]
        if record.a + record.b == a + b and (record.a == a or record.a == b):
            return True
        pair = follower(k.passings, body, pair)
    return False


@hook
def have_passed(k: Kernel, a: int, b: int) -> bool:
    """Whether two bodies overlap where their plans begin, and that is past: the contact was before."""
    early = a if k.bodies[a].anchor < k.bodies[b].anchor else b
    one = k.bodies[early]
    two = k.bodies[a + b - early]
    if two.anchor >= k.clock[0].now:
        return False
    elapsed = since_anchor(k, one, two.anchor)
    dx = two.x - (one.x + one.vx * elapsed)
    dy = two.y - (one.y + one.vy * elapsed)
    reach = (one.radius + two.radius) * (1.0 - 1e-10)
    return bool(dx * dx + dy * dy < reach * reach)


@hook
def leaves_out(k: Kernel, body: int, count: int) -> int:
    """Leave out of ``k.near[:count]`` whom a body is passing through; return how many stay."""
    if k.traits[body].inside == 0:
        return count
    kept = 0
    for i in range(count):
        other = k.near[i]
        if other == body or not is_passing(k, body, other):
            k.near[kept] = other
            kept += 1
    return kept


@hook
def _energy(k: Kernel, body: int) -> float:
    """Return a body's kinetic energy; 0 for one that nothing can move."""
    plan = k.bodies[body]
    mass = k.mass[body]
    return 0.5 * mass * (plan.vx * plan.vx + plan.vy * plan.vy) if mass < math.inf else 0.0


@hook
def _note(k: Kernel, body: int, tick: int) -> None:
    """Write down that a body has met another, or a wall, and whether it is too fast for its reach now."""
    k.traits[body].touched = tick
    plan = k.bodies[body]
    if not plan.vx * plan.vx + plan.vy * plan.vy <= k.clock[0].speed2:
        k.clock[0].faster = 1


@template
def _respond(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    """Have a hook respond."""
    if RESPONSES > 0 and rule.response == FIRST:
        respond_1(k, a, b, nx, ny, rule)
    if RESPONSES > 1 and rule.response == FIRST + 1:
        respond_2(k, a, b, nx, ny, rule)
    if RESPONSES > 2 and rule.response == FIRST + 2:
        respond_3(k, a, b, nx, ny, rule)
    if RESPONSES > 3 and rule.response == FIRST + 3:
        respond_4(k, a, b, nx, ny, rule)


@template
def answer(k: Kernel, a: int, b: int, tick: int) -> float:
    """Answer a contact of two bodies, both anchored at it, by their rule; return how deep they overlap."""
    before = _energy(k, a) + _energy(k, b)
    rule = k.rules[rule_of(k, a, b)]
    if rule.response == ELASTIC:
        depth = collide(k, a, b)
    else:
        nx, ny, depth = touch(k, a, b)
        if RESPONSES > 0:
            _respond(k, a, b, nx, ny, rule)
    k.counts[0].answered_energy += (_energy(k, a) + _energy(k, b)) - before
    _note(k, a, tick)
    _note(k, b, tick)
    return float(depth)


@template
def answer_wall(k: Kernel, a: int, wall: int, tick: int) -> float:
    """Answer a contact of a body, anchored at it, and a wall by its rule; return how deep it is in there."""
    before = _energy(k, a)
    rule = k.rules[rule_of(k, a, wall)]
    if rule.response == ELASTIC:
        depth = bounce(k, k.bodies[a], wall)
    else:
        nx, ny, depth = touch_wall(k, k.bodies[a], wall)
        if RESPONSES > 0:
            _respond(k, a, wall, nx, ny, rule)
    k.counts[0].answered_energy += _energy(k, a) - before
    _note(k, a, tick)
    return float(depth)
