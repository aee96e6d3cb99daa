"""Margins: a broad phase as authors of game engines write it, for mutants that no built-in phase would suit.

Each body has an upright box that is wider than the body, and wider still in its direction of flight. Two
bodies are near each other if their boxes overlap. The certificate of a body is that it is within its box.
When it fails, the body gets a box around its present place, and the bodies whose boxes overlap this one are
the newcomers. This is a tree of wide boxes without the tree: ``near`` compares with all.

On a periodic axis a box stays in the frame that its body had then: ``turns`` are the periods that had been
taken off the body's place. Two boxes overlap if a whole number of periods brings one over the other.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    Box,
    BroadPhaseParts,
    Item,
    Kernel,
    Records,
    falls,
    hook,
    is_there,
    positions_now,
    reach_of,
    reach_to,
    reaches_of,
    schedule,
    since_anchor,
    smaller,
)

SHARE = 0.25
"""The margin of a box: a factor of what the widest body reaches,"""

SPACING = 16.0
"""or a part of the mean distance between bodies, if that is more."""

AHEAD = 2.0
"""The extra length of a box in the direction of flight, in margins."""


class State(NamedTuple):
    """The boxes of n bodies."""

    box: Records  # (n, 4) the left, right, lower and upper side
    turns: Records  # (n, 2) periods that were off the body's place, on x and on y, when it got its box
    width: Records  # (2,) the margin that the bodies want, and the one that is used


def arrange(k: Kernel, s: State) -> None:
    """Chooses the margin: more than rounding can move a body."""
    s.width[1] = max(s.width[0], 8.0 * float(k.clock[0].limits.skin))


def hooks(periodic: bool) -> dict[str, Callable[..., Any]]:
    """Returns the hooks by their names; ``periodic``: an axis of the scene is periodic."""

    @hook
    def period_of(k: Kernel, axis: int) -> float:
        if not periodic:
            return 0.0
        return float(k.clock[0].torus.x if axis == 0 else k.clock[0].torus.y)

    @hook
    def turns_of(k: Kernel, body: int, axis: int) -> int:
        if not periodic:
            return 0
        return int(k.images[body].kx if axis == 0 else k.images[body].ky)

    @hook
    def fatten(k: Kernel, s: State, body: int) -> None:
        """Gives a body a box around its present place."""
        b = k.bodies[body]
        skin = k.clock[0].limits.skin
        since = since_anchor(k, b, k.clock[0].now)
        margin = s.width[1]
        for axis in range(2):
            speed = b.vx if axis == 0 else b.vy
            place = (b.x if axis == 0 else b.y) + speed * since
            behind = AHEAD * margin if speed < 0.0 else 0.0
            ahead = AHEAD * margin if speed > 0.0 else 0.0
            s.box[body, 2 * axis] = place - reach_to(b, 2 * axis, skin) - margin - behind
            s.box[body, 2 * axis + 1] = place + reach_to(b, 2 * axis + 1, skin) + margin + ahead
            s.turns[body, axis] = turns_of(k, body, axis)

    @hook
    def watch(k: Kernel, s: State, body: int) -> None:
        """Schedules the exit of a body from its box."""
        b = k.bodies[body]
        skin = k.clock[0].limits.skin
        tick = NEVER
        for axis in range(2):
            speed = b.vx if axis == 0 else b.vy
            place = b.x if axis == 0 else b.y
            place += float(turns_of(k, body, axis) - s.turns[body, axis]) * period_of(k, axis)
            left = place - reach_to(b, 2 * axis, skin) - s.box[body, 2 * axis]
            right = s.box[body, 2 * axis + 1] - place - reach_to(b, 2 * axis + 1, skin)
            tick = smaller(tick, falls(k, b.anchor, left if speed < 0.0 else right, -abs(speed)))
        schedule(k, body, tick)

    @hook
    def overlap(k: Kernel, s: State, one: int, other: int) -> bool:
        """Returns True if the boxes of two bodies overlap."""
        for axis in range(2):
            period = period_of(k, axis)
            most = s.box[one, 2 * axis + 1] - s.box[other, 2 * axis]
            least = s.box[one, 2 * axis] - s.box[other, 2 * axis + 1]
            if period > 0.0:
                if math.floor(most / period) < math.ceil(least / period):
                    return False
            elif most < 0.0 or least > 0.0:
                return False
        return True

    @hook
    def near(k: Kernel, s: State, body: int) -> int:
        """Names the bodies whose boxes overlap a body's box."""
        count = 0
        for other in range(k.clock[0].bodies):
            if is_there(k, other) and overlap(k, s, body, other):
                k.near[count] = other
                count += 1
        return count

    @hook
    def build(k: Kernel, s: State) -> None:
        """Gives every body a box."""
        for body in range(k.clock[0].bodies):
            if is_there(k, body):
                fatten(k, s, body)
                watch(k, s, body)

    @hook
    def repair(k: Kernel, s: State, body: int) -> int:
        """A body leaves its box: it gets another one, and the bodies around it are newcomers."""
        fatten(k, s, body)
        watch(k, s, body)
        return near(k, s, body)

    @hook
    def replan(k: Kernel, s: State, body: int) -> None:
        """A body has another plan: it leaves its box elsewhere."""
        watch(k, s, body)

    @hook
    def enter(k: Kernel, s: State, body: int) -> None:
        """A body is inserted: it gets a box."""
        fatten(k, s, body)
        watch(k, s, body)

    @hook
    def leave(k: Kernel, s: State, body: int) -> None:
        """A body is removed: no comparison uses its box from now on."""

    return {each.__name__: each for each in (near, build, repair, replan, enter, leave)}


HOOKS = {periodic: hooks(periodic) for periodic in (False, True)}


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yields violations: each body must be within its box, or about to leave it."""
    there = np.flatnonzero(k.queue.number >= 0)
    reach, place = reaches_of(k)[there], positions_now(k)[there]
    if len(k.images):
        turns = np.stack([k.images.kx, k.images.ky], axis=1)[there] - s.turns[there]
        place = place + turns * np.array([float(k.clock[0].torus.x), float(k.clock[0].torus.y)])
    edges = np.stack([place[:, 0], place[:, 0], place[:, 1], place[:, 1]], axis=1)
    edges += reach * np.array([-1.0, 1.0, -1.0, 1.0])
    beyond = ((edges - s.box[there]) * np.array([-1.0, 1.0, -1.0, 1.0])).max(axis=1, initial=-math.inf)
    for at in np.flatnonzero(
        (beyond > k.clock[0].limits.skin) & (k.queue.certificate[there] > k.clock[0].now)
    ):
        yield f"body {there[at]} is {beyond[at]:.3g} outside of its box"


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draws each box, with the tick at which its body leaves it."""
    for body in np.flatnonzero(k.queue.number >= 0).tolist():
        left, right, low, high = s.box[body].tolist()
        yield Box("bound", (left, low), (right, high), int(k.queue.certificate[body]))


class Margins:
    """Boxes with a margin."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts, for any scene."""
        n = scene.capacity
        width, height = scene.arena or (0.0, 0.0)
        spacing = math.sqrt(width * height / max(n, 1)) / SPACING
        margin = max(SHARE * float(reach_of(scene).max(initial=0.0)), spacing)
        state = State(np.zeros((n, 4)), np.zeros((n, 2), np.int64), np.array([margin, 0.0]))
        return BroadPhaseParts(
            state=state,
            arrange=arrange,
            audit=audit,
            draw=draw,
            room=n,
            periodic=True,
            **HOOKS[bool(scene.periodic)],
        )
