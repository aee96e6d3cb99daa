"""Stripes: the plane cut into vertical stripes of one width; a body is in the stripe that its centre is in.

Two bodies are a candidate pair while they are in one stripe or in neighbouring ones. Between the centres of
any others lies a whole stripe, and a stripe is at least as wide as two of the largest bodies with their
skin, so they do not touch. A crossing is rounded by far less than the skin, so it does not matter on which
side of a border a body counts that lies on it (see one-answer.md in kinetile's documentation).

There is one certificate a body: it has not crossed the border that lies ahead. When it fails, the body
loses the stripe behind it and meets the one ahead. Stripes are numbered without bound, so a scene needs no
arena; the list of a stripe is found by its number modulo the number of lists, and one list may hold several
stripes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import kinetile as kt
import numpy as np
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
)

__all__ = ["Stripes"]


class State(NamedTuple):
    """For n bodies and m lists; a list is a ring of bodies that begins and ends with n + its number."""

    stripe: Records  # (n,) the stripe that each body is in
    after: Records  # (n + m,) the next in the ring
    before: Records  # (n + m,) the one before
    width: Records  # (2,) what was asked for, and what it is


def arrange(k: Kernel, s: State) -> None:
    """Choose the width, for reaches may have grown, and see which stripe each body is in now."""
    s.width[1] = max(s.width[0], 2.0 * k.bodies.reach.max(initial=0.0))
    s.stripe[:] = np.floor(positions_now(k)[:, 0] / s.width[1])


@hook
def watch(k: Kernel, s: State, body: int) -> None:
    """Schedule the crossing of the border ahead."""
    b = k.bodies[body]
    left = s.stripe[body] * s.width[1]
    gap = b.x - left if b.vx < 0.0 else left + s.width[1] - b.x
    schedule(k, body, falls(k, b.anchor, gap, -abs(b.vx)))


@hook
def pair_with(k: Kernel, s: State, body: int, stripe: int, near: bool) -> None:
    """Make pairs of a body and all in a stripe, or unmake them."""
    end = len(s.stripe) + stripe % (len(s.after) - len(s.stripe))
    other = s.after[end]
    while other != end:
        if s.stripe[other] == stripe:
            if near:
                add_pair(k, body, other)
            else:
                remove_pair(k, body, other)
        other = s.after[other]


@hook
def enter(s: State, body: int) -> None:
    """Put a body into the ring of its stripe."""
    end = len(s.stripe) + s.stripe[body] % (len(s.after) - len(s.stripe))
    s.after[body] = s.after[end]
    s.before[body] = end
    s.before[s.after[end]] = body
    s.after[end] = body


@hook
def build(k: Kernel, s: State) -> None:
    """Enter the bodies one by one; each makes pairs with those that are near and there already."""
    for end in range(len(s.stripe), len(s.after)):
        s.after[end] = end
        s.before[end] = end
    for body in range(len(s.stripe)):
        for step in range(-1, 2):
            pair_with(k, s, body, s.stripe[body] + step, True)
        enter(s, body)
        watch(k, s, body)


@hook
def repair(k: Kernel, s: State, body: int) -> None:
    """A body crosses the border ahead of it."""
    step = -1 if k.bodies[body].vx < 0.0 else 1
    s.before[s.after[body]] = s.before[body]
    s.after[s.before[body]] = s.after[body]
    pair_with(k, s, body, s.stripe[body] - step, False)
    s.stripe[body] += step
    enter(s, body)
    pair_with(k, s, body, s.stripe[body] + step, True)
    watch(k, s, body)


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A body's plan changed: another border may lie ahead, or the same at another time."""
    watch(k, s, body)


class Stripes:
    """Vertical stripes.

    Args:
        width: of a stripe, at least; never less is used than the diameter of the largest body with its skin.
    """

    def __init__(self, *, width: float = 0.0) -> None:
        if not 0.0 <= width < math.inf:
            raise BadOption(f"stripes: width must be a finite number, 0 or greater, not {width!r}")
        self.width = width

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        """Return the parts; any scene will do."""
        n = len(scene)
        rings = np.zeros(n + max(n, 1), dtype=np.int64)
        state = State(np.zeros(n, dtype=np.int64), rings, rings.copy(), np.array([self.width, 0.0]))
        return BroadPhaseParts(state, n, build, repair, replan, arrange)
