"""The flight plans in force at one moment, and what they foretell of the rows that follow.

A page begins with the plans at the start of its window and goes on from row to row, as a run does. Most of a
row can be foretold by the plans before it: a body is where its plan has brought it, and mostly to the last
bit. So a page holds only what differs from that, as bits (exclusive or), and this is mostly nothing: the page
is half as large. The same foretelling is in ``script/rows.mjs``, operation by operation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import TICKS
from kinetile.kernel.log import INSERTED, REMOVED
from kinetile.scene import Insert, Scene

__all__ = ["KINDS", "Plans", "kinds_of", "residuals"]

Floats = npt.NDArray[np.float64]
_PLACES = {"x": ("ax", "bx"), "y": ("ay", "by")}
_SPEEDS = {"vx": ("avx", "bvx"), "vy": ("avy", "bvy")}

KINDS = ("structural", "disc", "wall", "turn", "insert", "remove", "pass", "part", "anchor")
"""Kinds of events by the number that a page has for them; "anchor" is a plan that the clock has written down
anew."""


@dataclass(frozen=True)
class Plans:
    """The bodies by number, (n,) each: radius (NaN where it is not known) and mass; whether each is there,
    and its plan: (epoch, tick) of its anchor, where it was then, and its velocity."""

    radius: Floats
    mass: Floats
    there: Floats
    epoch: Floats
    tick: Floats
    x: Floats
    y: Floats
    vx: Floats
    vy: Floats

    @classmethod
    def of(cls, scene: Scene, rows: npt.NDArray[Any]) -> Self:
        """Return the plans at a scene's start, with room for all bodies of the scene and of rows."""
        comers = [each for each in scene.commands if isinstance(each, Insert)]
        last = max([*(each.body for each in comers), int(rows["a"].max(initial=-1)), len(scene) - 1])
        last = max(last, int(rows["b"].max(initial=-1)))
        n = len(scene)
        columns = {name: np.zeros(last + 1) for name in cls.__dataclass_fields__}
        columns["radius"][n:] = np.nan
        columns["mass"][n:] = 1.0
        columns["radius"][:n], columns["mass"][:n], columns["there"][:n] = scene.radius, scene.mass, 1.0
        columns["x"][:n], columns["y"][:n] = scene.position.T
        columns["vx"][:n], columns["vy"][:n] = scene.velocity.T
        for each in comers:
            columns["radius"][each.body], columns["mass"][each.body] = each.radius, each.mass
        return cls(**columns)

    def after(self, rows: npt.NDArray[Any]) -> Plans:
        """Return the plans after the events of rows (dtype LOG), in their order."""
        flights = _Flights.of(rows)
        columns = {name: array.copy() for name, array in vars(self).items()}
        body, row = flights.body, flights.row
        columns["there"][body] = rows["b"][row] != REMOVED  # of one body's flights the last one stays
        columns["epoch"][body], columns["tick"][body] = rows["epoch"][row], rows["tick"][row]
        for name, pair in (_PLACES | _SPEEDS).items():
            columns[name][body] = flights.value(rows, pair)
        return Plans(**columns)


@dataclass(frozen=True)
class _Flights:
    """The plans that rows give to bodies, in the order of events, a before b: whose, in which row, whether as
    b."""

    body: npt.NDArray[np.int64]
    row: npt.NDArray[np.int64]
    is_b: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, rows: npt.NDArray[Any]) -> Self:
        bodies = np.stack([rows["a"], rows["b"]], axis=1).ravel().astype(np.int64)
        flat = np.flatnonzero((bodies >= 0) & np.repeat(~np.isnan(rows["ax"]), 2))
        return cls(bodies[flat], flat // 2, (flat % 2).astype(bool))

    def value(self, rows: npt.NDArray[Any], pair: tuple[str, str]) -> Floats:
        found: Floats = np.where(self.is_b, rows[pair[1]][self.row], rows[pair[0]][self.row])
        return found


def kinds_of(rows: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Return the kind of each row as its place in ``KINDS``."""
    a, b = rows["a"], rows["b"]
    kinds = np.where(b >= 0, np.where(np.isnan(rows["ax"]), np.where(a < b, 6, 7), 1), 2)
    for code, kind in ((-5, 3), (-6, 8), (INSERTED, 4), (REMOVED, 5)):
        kinds[b == code] = kind
    return kinds.astype(np.uint8)


def residuals(plans: Plans, rows: npt.NDArray[Any], unit: float) -> dict[str, npt.NDArray[np.uint64]]:
    """Return columns ax .. bvy, (rows,) each: the bits in which a row differs from what is foretold.

    A body is where its plan has brought it and keeps its velocity; but where two bodies of one mass meet, b
    gets what a has lost. What gives no plan (b of a wall, say) is 0.
    """
    flights = _Flights.of(rows)
    order = np.argsort(flights.body, kind="stable")
    body = flights.body[order]
    first = np.append(True, body[1:] != body[:-1])[: len(body)]

    def before(of_plan: Floats, of_flight: Floats) -> Floats:
        """Return in the order of flights what was in force before each: of the body's flight before it."""
        now = of_flight[order]
        found = np.empty(len(order))
        found[order] = np.where(first, of_plan[body], np.roll(now, 1))
        return found

    epoch, tick = (rows[name][flights.row].astype(np.float64) for name in ("epoch", "tick"))
    ticks = (epoch - before(plans.epoch, epoch)) * float(TICKS) + (tick - before(plans.tick, tick))
    elapsed = ticks * (unit / TICKS)
    columns = {name: np.zeros(len(rows), np.uint64) for pair in _ALL for name in pair}
    for place, speed in (("x", "vx"), ("y", "vy")):
        was, flew = (
            before(getattr(plans, name), flights.value(rows, _BOTH[name])) for name in (place, speed)
        )
        found, flies = flights.value(rows, _BOTH[place]), flights.value(rows, _BOTH[speed])
        keeps = flew.copy()
        second = np.flatnonzero(flights.is_b)  # its row's a comes right before it
        same = second[plans.mass[flights.body[second]] == plans.mass[flights.body[second - 1]]]
        keeps[same] = flew[same] + (flew[same - 1] - flies[same - 1])
        for name, bits in (
            (place, _bits(found) ^ _bits(was + flew * elapsed)),
            (speed, _bits(flies) ^ _bits(keeps)),
        ):
            for side, column in enumerate(_BOTH[name]):
                mine = flights.is_b == bool(side)
                columns[column][flights.row[mine]] = bits[mine]
    return columns


_BOTH = _PLACES | _SPEEDS
_ALL = tuple(_BOTH.values())


def _bits(numbers: Floats) -> npt.NDArray[np.uint64]:
    return np.ascontiguousarray(numbers, np.float64).view(np.uint64)
