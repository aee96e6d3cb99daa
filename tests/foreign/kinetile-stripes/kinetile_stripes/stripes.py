"""Stripes: the plane cut into vertical stripes of one width; a body is in the stripe that its centre is in.

Two bodies are near each other while they are in one stripe or in neighbouring ones. Between the centres of
any others lies a whole stripe, and a stripe is at least as wide as two of the largest bodies with their
skin, so they do not touch. A crossing is rounded by far less than the skin, so it does not matter on which
side of a border a body counts that lies on it (see one-answer.md in kinetile's documentation).

A body's certificate says that it has not crossed the border that lies ahead. When it fails, the body meets
those in the stripe beyond. Stripes are numbered without bound, so a scene needs no arena; the list of a
stripe is found by its number modulo the number of lists, and one list may hold several stripes.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import kinetile as kt
import numpy as np
from kinetile.errors import BadOption
from kinetile.toolbox import (
    At,
    BroadPhaseParts,
    Item,
    Kernel,
    Records,
    Segment,
    falls,
    hook,
    positions_now,
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
    """Chooses the width, for reaches may have grown; everything is alone in its ring."""
    s.width[1] = max(s.width[0], 2.0 * k.bodies.reach.max(initial=0.0))
    s.stripe[:] = np.floor(positions_now(k)[:, 0] / s.width[1])
    s.after[:] = s.before[:] = np.arange(len(s.after))


@hook
def enter(s: State, body: int, stripe: int) -> None:
    """Moves a body from its ring to the ring of a stripe."""
    s.before[s.after[body]] = s.before[body]
    s.after[s.before[body]] = s.after[body]
    end = len(s.stripe) + stripe % (len(s.after) - len(s.stripe))
    s.after[body] = s.after[end]
    s.before[body] = end
    s.before[s.after[end]] = body
    s.after[end] = body
    s.stripe[body] = stripe


@hook
def watch(k: Kernel, s: State, body: int) -> None:
    """Schedules the crossing of the border ahead."""
    b = k.bodies[body]
    left = s.stripe[body] * s.width[1]
    gap = b.x - left if b.vx < 0.0 else left + s.width[1] - b.x
    schedule(k, body, falls(k, b.anchor, gap, -abs(b.vx)))


@hook
def name_all(k: Kernel, s: State, stripe: int, count: int) -> int:
    """Names the bodies of a stripe, after so many that are named already; returns how many are named then."""
    end = len(s.stripe) + stripe % (len(s.after) - len(s.stripe))
    body = s.after[end]
    while body != end:
        if s.stripe[body] == stripe:
            k.near[count] = body
            count += 1
        body = s.after[body]
    return count


@hook
def build(k: Kernel, s: State) -> None:
    """Puts each body into its ring."""
    for body in range(len(s.stripe)):
        enter(s, body, s.stripe[body])
        watch(k, s, body)


@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Names the bodies in the same stripe and in its neighbours."""
    count = 0
    for stripe in range(s.stripe[body] - 1, s.stripe[body] + 2):
        count = name_all(k, s, stripe, count)
    return count


@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A body crosses the border ahead of it, and meets those in the stripe after."""
    step = -1 if k.bodies[body].vx < 0.0 else 1
    enter(s, body, s.stripe[body] + step)
    watch(k, s, body)
    return name_all(k, s, s.stripe[body] + step, 0)


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draws the borders of the stripes with bodies, and for each body the border ahead of it, with the tick
    of its arrival."""
    if not len(s.stripe):
        return
    height = positions_now(k)[:, 1]
    low, high = float((height - k.bodies.reach).min()), float((height + k.bodies.reach).max())
    for border in sorted({stripe + side for stripe in s.stripe.tolist() for side in (0, 1)}):
        x = border * float(s.width[1])
        yield Segment("cell", (x, low), (x, high))
    for body, stripe in enumerate(s.stripe.tolist()):
        if k.bodies.vx[body] != 0.0:
            ahead = (stripe + int(k.bodies.vx[body] > 0.0)) * float(s.width[1])
            place = (At(body), At(body))
            yield Segment("certificate", place, (ahead, At(body)), int(k.queue.certificate[body]), "border")


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
        """Returns the parts; any scene will do."""
        n = len(scene)
        rings = np.zeros(n + max(n, 1), dtype=np.int64)
        state = State(np.zeros(n, dtype=np.int64), rings, rings.copy(), np.array([self.width, 0.0]))
        # A new plan leaves a body where it is: it only meets another border, or the same at another time.
        return BroadPhaseParts(near, state, build, repair, replan=watch, arrange=arrange, draw=draw)
