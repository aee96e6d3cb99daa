"""A toy grid, right but for a fault of choice, of a kind that six bodies and 150 contacts do not show.

Its near goes through all bodies and names those of the nine cells round about: slow, and short. Lists, tables
and numbers of few bits are imitated by what is lost when they overflow.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.toolbox import (
    NEVER,
    BroadPhaseParts,
    Kernel,
    Records,
    falls,
    hook,
    positions_now,
    schedule,
    smaller,
)

NONE, TRUNCATES, RING_OF_64, LIST_OF_4, LIST_OF_24, BODY_OF_7_BITS, COUNT_OF_16_BITS, LANE_OF_32_BITS = range(
    8
)

FAULTS = {
    "truncation for floor": TRUNCATES,
    "a table of 64 places": RING_OF_64,
    "lists of 4": LIST_OF_4,
    "lists of 24": LIST_OF_24,
    "numbers of bodies of 7 bits and a sign": BODY_OF_7_BITS,
    "a count of 16 bits": COUNT_OF_16_BITS,
    "numbers of lanes of 32 bits": LANE_OF_32_BITS,
}


class State(NamedTuple):
    cell: Records  # (n, 2) column and row of each body
    axis: Records  # (n,) which border it crosses first
    listed: Records  # (9,) how many of each cell round about have been named
    side: Records  # (1,) of a cell
    fault: Records  # (1,)
    crossings: Records  # (1,)


def arrange(k: Kernel, s: State) -> None:
    s.side[0] = 2.0 * float(np.max(k.bodies.reach, initial=0.0)) or 1.0
    lanes = positions_now(k) / s.side[0]
    lanes = np.trunc(lanes) if s.fault[0] == TRUNCATES else np.floor(lanes)
    s.cell[:] = lanes.astype(np.int64)
    if s.fault[0] == LANE_OF_32_BITS:
        s.cell[:] = s.cell.astype(np.int32)


@hook
def watch(k: Kernel, s: State, body: int) -> None:
    b = k.bodies[body]
    side = s.side[0]
    left = s.cell[body, 0] * side
    low = s.cell[body, 1] * side
    across = falls(k, b.anchor, b.x - left if b.vx < 0.0 else left + side - b.x, -abs(b.vx))
    along = falls(k, b.anchor, b.y - low if b.vy < 0.0 else low + side - b.y, -abs(b.vy))
    s.axis[body] = 0 if across <= along else 1
    schedule(k, body, smaller(across, along))


@hook
def build(k: Kernel, s: State) -> None:
    for body in range(len(s.axis)):
        watch(k, s, body)


@hook
def near(k: Kernel, s: State, body: int) -> int:
    n = len(s.axis)
    fault = s.fault[0]
    room = 4 if fault == LIST_OF_4 else (24 if fault == LIST_OF_24 else n)
    for place in range(9):
        s.listed[place] = 0
    count = 0
    for other in range(n):
        column = s.cell[other, 0] - s.cell[body, 0] + 1
        row = s.cell[other, 1] - s.cell[body, 1] + 1
        if 0 <= column <= 2 and 0 <= row <= 2:
            place = 3 * row + column
            s.listed[place] += 1
            lost = s.listed[place] > room or (fault == RING_OF_64 and other + 64 < n)
            if not lost:
                k.near[count] = other & 127 if fault == BODY_OF_7_BITS else other
                count += 1
    return count


@hook
def repair(k: Kernel, s: State, body: int) -> int:
    axis = s.axis[body]
    speed = k.bodies[body].vx if axis == 0 else k.bodies[body].vy
    s.crossings[0] += 1
    if s.fault[0] != COUNT_OF_16_BITS or s.crossings[0] & 0xFFFF != 0:
        s.cell[body, axis] += -1 if speed < 0.0 else 1
        watch(k, s, body)
    else:
        schedule(k, body, NEVER)
    return near(k, s, body)


class ToyGrid:
    """A grid with a fault of choice."""

    def __init__(self, *, fault: int = NONE) -> None:
        self.fault = fault

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        n = len(scene)
        state = State(
            np.zeros((n, 2), dtype=np.int64),
            np.zeros(n, dtype=np.int64),
            np.zeros(9, dtype=np.int64),
            np.ones(1),
            np.array([self.fault]),
            np.zeros(1, dtype=np.int64),
        )
        return BroadPhaseParts(near, state, build, repair, replan=watch, arrange=arrange)
