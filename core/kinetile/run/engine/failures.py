"""Errors for faults of the compiled loop, which leaves a number and two slots: each error has a type, a time,
the numbers of the bodies, the responsible phase, and the correct behaviour."""

import math
from typing import Any

import numpy as np

from kinetile.errors import (
    KinetileError,
    MissedContactError,
    NoRoom,
    PhaseError,
    Refused,
    StalledError,
    ZenoError,
)
from kinetile.kernel import tables
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.flight import plans_now
from kinetile.kernel.log import OF_KIND, WALLS
from kinetile.kernel.plan import Plan, positions_after, velocities_after
from kinetile.kernel.tables import Kernel
from kinetile.plugin.calling import described
from kinetile.run.compose import Composition
from kinetile.scene.bodies import nearest_image
from kinetile.scene.checks import WALL_KIND

_OF_SLOTS = (
    *(tables.LATE_CONTACT, tables.TOO_DEEP, *tables.JAMS, tables.STALLED, tables.NOT_FINITE),
    *(tables.BAD_RESPONSE, tables.ADDED_ENERGY),
)
"""Faults of present bodies, which the loop reports by their slots; users have their numbers."""

_BROKEN = {
    tables.BAD_PARTNER: "named body {b} as the first that body {a} meets, which is no body of the scene",
    tables.BAD_CERTIFICATE: "scheduled the certificate of body {a}, which is no body of the scene",
    tables.BAD_COUNT: "said that {b} bodies are near body {a}, and there is room for {room}",
    tables.BAD_NAME: "named body {b} as near body {a}, which is no body of the scene",
    tables.BAD_PAIR: "reported the pair ({a}, {b}), which is not two bodies of the scene",
    tables.UNKNOWN_PAIR: "removed the pair ({a}, {b}), which was not in its pair set",
}
"""Actions of a phase that the protocol does not allow."""


def failure(k: Kernel, composition: Composition, time: float) -> KinetileError:
    """Returns the error for the fault that the loop has left in the tables at a time."""
    clock = k.clock[0]
    left = clock.fault
    fault, slots = int(left.code), (int(left.a), int(left.b))
    a, b = slots
    if fault in _OF_SLOTS:
        a, b = (int(k.queue[slot].number) if slot >= 0 else slot for slot in slots)
    bodies = tuple(body for body in (a, b) if body >= 0)
    named = f"bodies {a} and {b}" if b >= 0 else f"body {a}"
    named += f" and the {WALLS[b]} wall" if b in WALLS else ""
    at, phase = f"at time {time!r}", described("broad phase", composition.broad_phase)
    narrow = " and ".join(described("narrow phase", name) for name in composition.narrow_phases)
    if fault == tables.TOO_DEEP and b >= 0 and _pass_through(k, composition, *slots):
        return PhaseError(
            f"{at} {named} overlap more than rounding explains, and no contact of theirs has been "
            f"missed: {narrow} lets them go on towards each other at a contact, so that bodies pass through "
            "each other; a collide has to part them (without a narrow phase for pairs all bodies pass)"
        )
    if fault in (tables.TOO_DEEP, tables.LATE_CONTACT):
        who, how = (phase, "reported the pair") if b >= 0 else (narrow, "foresaw it")
        what = f"{named} overlap more than rounding explains: {who} has missed their contact"
        if fault == tables.LATE_CONTACT:
            what = f"a contact of {named} came up that lies in the past: {who} {how} too late"
        return MissedContactError(f"{at} {what}", time=time, bodies=bodies)
    if fault in tables.JAMS:
        many = f"{int(clock.jam.window_size)} contacts took next to no time, the last of them between {named}"
        message = f"{at} the bodies are jammed: {many}; nothing can move on from here"
        if fault == tables.SQUEEZED:
            message = f"{at} body {a} is squeezed by immovable bodies that close in: {many}"
        return ZenoError(message, time=time, bodies=bodies)
    if fault in (tables.BAD_RESPONSE, tables.ADDED_ENERGY):
        return PhaseError(f"{at} {_bad_response(k, composition, fault, slots, named)}")
    if fault == tables.STALLED:
        return StalledError(
            f"{at} {phase} makes no progress: its certificates, the last one of body {a}, "
            "fail again and again at the same moment"
        )
    if fault >= tables.MY_FAULT:
        return PhaseError(f"{at} {phase} {_its_own(composition, fault - tables.MY_FAULT, a, b)}")
    if fault == tables.NOT_FINITE:
        what = f"a contact of {named} has no outcome in finite numbers, as where centres meet"
        return PhaseError(f"{at} {what}")
    room = len(k.near) - tables.SPARE
    who = narrow if fault == tables.BAD_PARTNER else phase
    text = _BROKEN.get(fault, "left fault {fault} ({a}, {b})").format(fault=fault, a=a, b=b, room=room)
    return PhaseError(f"{at} {who} {text}")


def _bad_response(k: Kernel, composition: Composition, fault: int, slots: tuple[int, int], named: str) -> str:
    assert composition.rules is not None
    scene, bodies = composition.prepared, np.array([slot for slot in slots if slot >= 0])
    kinds, at_wall = k.traits.view(np.ndarray)["kind"][bodies].tolist(), slots[1] < 0
    response = scene.meets[kinds[0]][-1 if at_wall else kinds[1]]
    met = " and ".join(repr(each) for each in [*(scene.kinds[kind] for kind in kinds), WALL_KIND][:2])
    made = velocities_after(Plan.of(k.places.view(np.ndarray)[bodies]), 0.0)
    was = velocities_after(*plans_now(k, bodies))
    does = f"lets {named} go on towards each other"
    right = "it has to turn them away from each other, or to leave no speed along the normal"
    if fault == tables.ADDED_ENERGY:
        does = f"says that it is dissipative, and adds energy to {named}"
        right = "it may add none, or not declare that feature"
    return (
        f"{composition.rules.named(response.name)}, for {met}, {does}: the velocities before it are "
        f"{was.tolist()}, and after it {made.tolist()}; {right}"
    )


def blocked(k: Kernel, clock: Clock, command: Any, blocker: int) -> Refused:
    """Returns the error for an inserted body without room: the body or wall that it would reach into
    (``blocker``, a slot or a wall's code), and the depth; or for a new kind that would meet a passed body.
    Its text is made at its first reading, for games."""
    ticks = clock.total(int(command["tick"]))
    who, other = 0, None
    if blocker >= 0:
        who, other = k.queue.view(np.ndarray)["number"][blocker], k.bodies.view(np.ndarray)[blocker].copy()

    def text() -> str:
        when, number = clock.moment(ticks)[0], int(command["body"])
        if command["code"] == OF_KIND:
            why = f"body {number} is passing through body {who}, which it would meet then"
            return f"at time {when!r} the kind stays: {why}; wait until they have parted"
        x, y, radius = (command[name].item() for name in ("x", "y", "radius"))
        message = f"it reaches into body {who}"
        if other is None:
            message = f"it reaches beyond the {WALLS[blocker]} wall"
        elif not len(k.forms):
            elapsed = float(command["tick"] - other["anchor"]) * clock.unit / TICKS
            apart = positions_after(Plan.of(other), elapsed) - (x, y)
            torus = k.clock[0].torus
            (away,) = nearest_image(apart[None], (float(torus.x), float(torus.y)))
            deep = radius + other["radius"].item() - math.hypot(*away.tolist())
            message = f"it reaches {deep:.6g} into body {who}"
        place = f"at ({x!r}, {y!r})" + ("" if len(k.forms) else f" with radius {radius!r}")
        return f"at time {when!r} there is no room for body {number} {place}: {message}; nothing has changed"

    return NoRoom(text)


def _its_own(composition: Composition, number: int, a: int, b: int) -> str:
    faults = composition.broad.faults
    if number < len(faults):
        return f"cannot go on: {faults[number].format(a=a, b=b)}"
    which = f"MY_FAULT + {number}" if number else "MY_FAULT"
    has = f"{len(faults)} {'sentence' if len(faults) == 1 else 'sentences'} for faults of its own"
    return f"left its fault {which} ({a}, {b}), and its parts have {has}"


collide = to_be_filled_in


def part_head_on(k: Kernel, a: int, b: int) -> float:
    """Template, as ``loop.advance``: makes two bodies meet head on, along x; returns the parting speed."""
    k = disowned(k)
    one = k.bodies[a]
    two = k.bodies[b]
    one.x = one.y = two.y = 0.0
    two.x = one.radius + two.radius
    one.vx = 1.0
    two.vx = -1.0
    one.vy = two.vy = 0.0
    one.anchor = two.anchor = k.clock[0].now
    collide(k, a, b)
    return float(two.vx - one.vx)


def _pass_through(k: Kernel, composition: Composition, a: int, b: int) -> bool:
    """True if, on a copy, the narrow phase lets two bodies fly towards each other after a contact."""
    if composition.pair is None:
        return False
    aside = Kernel(*(table.copy() for table in k))
    apart = compose(part_head_on, {"collide": composition.pair.collide}, "part", Kernel)(aside, a, b)
    return bool(apart < 0.0)
