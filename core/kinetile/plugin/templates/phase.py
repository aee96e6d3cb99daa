"""A leash for every body: it has a home, and a certificate that says it is no further from it than its leash.

While that holds the body is in a box around its home, and two bodies whose boxes are apart cannot touch. So
the candidate pairs are those whose boxes overlap. They change only when a body comes to the end of its leash:
then its home is where it is now, and its neighbours are found anew. Homes decide, never present positions.

To make a phase of your own of it, begin with what a certificate should say; ``State``, ``watch`` and
``repair`` follow from that. This one asks all bodies at every repair. A structure that knows who is near
makes it fast.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.errors import BadOption
from kinetile.toolbox import (
    BroadPhaseParts,
    Kernel,
    Records,
    add_pair,
    falls,
    hook,
    positions_now,
    remove_pair,
    schedule,
    since_anchor,
)

__all__ = ["TemplatePhase"]


class State(NamedTuple):
    """What the phase knows, as arrays; hooks may change what is in them, and nothing else."""

    home: Records  # (n, 2) where each body was when it was last looked at
    leash: Records  # (2,) what was asked for, and how far a body may be from its home in x and in y


def arrange(k: Kernel, s: State) -> None:
    """Put the state in order as of now, before ``build``. This is plain Python; hooks are compiled."""
    s.home[:] = positions_now(k)
    n = len(s.home)
    spread = np.ptp(s.home, axis=0).max() / (4 * n) if n > 1 else math.inf  # alone, it needs no leash
    s.leash[1] = max(s.leash[0], spread, k.bodies.reach.max(initial=0.0))


@hook
def watch(k: Kernel, s: State, body: int) -> None:
    """Schedule the failure of a body's certificate: the end of its leash, in x or in y."""
    b = k.bodies[body]
    off_x = b.x - s.home[body, 0]  # at the body's anchor, not now: ``falls`` reckons from there
    off_y = b.y - s.home[body, 1]
    gap_x = s.leash[1] - off_x if b.vx > 0.0 else s.leash[1] + off_x
    gap_y = s.leash[1] - off_y if b.vy > 0.0 else s.leash[1] + off_y
    schedule(k, body, min(falls(k, b.anchor, gap_x, -abs(b.vx)), falls(k, b.anchor, gap_y, -abs(b.vy))))


@hook
def near(k: Kernel, s: State, a: int, b: int) -> bool:
    """Whether two boxes overlap. They have the reach in them, not the radius: it has room for rounding."""
    room = k.bodies[a].reach + k.bodies[b].reach + 2.0 * s.leash[1]
    return bool(abs(s.home[a, 0] - s.home[b, 0]) <= room and abs(s.home[a, 1] - s.home[b, 1]) <= room)


@hook
def build(k: Kernel, s: State) -> None:
    """Schedule every certificate, and make every pair that there has to be, once."""
    for body in range(len(k.bodies)):
        watch(k, s, body)
        for other in range(body):
            if near(k, s, body, other):
                add_pair(k, body, other)


@hook
def repair(k: Kernel, s: State, body: int) -> None:
    """A body is at the end of its leash: part from its neighbours, move its home, find its new neighbours."""
    for other in range(len(k.bodies)):
        if other != body and near(k, s, body, other):
            remove_pair(k, body, other)
    b = k.bodies[body]
    time = since_anchor(k, b, k.clock[0].now)
    s.home[body, 0] = b.x + b.vx * time
    s.home[body, 1] = b.y + b.vy * time
    for other in range(len(k.bodies)):
        if other != body and near(k, s, body, other):
            add_pair(k, body, other)
    watch(k, s, body)


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A contact or a turn has changed a body's velocity, not its place: it meets another end of its leash."""
    watch(k, s, body)


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yield a sentence for what must hold between two events and does not. For tests; plain Python."""
    off = np.abs(positions_now(k) - s.home).max(axis=1, initial=0.0)
    for body in np.flatnonzero(off > s.leash[1] + k.bodies.reach - k.bodies.radius):
        yield f"body {body} is {off[body]} from its home, and its leash is {s.leash[1]}"


class TemplatePhase:
    """Every body on a leash.

    Args:
        leash: how far a body may be from its home, at least; more is used where bodies are far apart.
    """

    def __init__(self, *, leash: float = 0.0) -> None:
        if not 0.0 <= leash < math.inf:
            raise BadOption(f"leash must be a finite number, 0 or greater, not {leash!r}")
        self.leash = leash

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        """Return the parts: state, number of certificates (one a body, numbered as the bodies), hooks."""
        n = len(scene)
        state = State(home=np.zeros((n, 2)), leash=np.array([self.leash, 0.0]))
        return BroadPhaseParts(state, n, build, repair, replan, arrange, audit)
