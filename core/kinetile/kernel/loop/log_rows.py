"""What the loop writes down of an event: what is digested of a contact, and for whoever records the plans
after it. Rows speak of bodies by their numbers."""

from __future__ import annotations

import math

from kinetile.kernel.compiled import hook
from kinetile.kernel.log import TURNED
from kinetile.kernel.tables import Kernel

__all__ = ["log", "log_is_full", "log_passing"]


@hook
def log(k: Kernel, tick: int, a: int, b: int) -> None:
    """Log an event of the body in slot a, and of the one in slot b or of what a number below 0 stands for."""
    clock = k.clock[0]
    k.counts[0].logged += 1
    first = k.queue[a].number
    second = k.queue[b].number if b >= 0 else b
    if b > TURNED:
        _log_contact(k, tick, first, second)
    if len(k.log) > 0:
        row = k.log[clock.written]
        clock.written += 1
        row.tick = tick
        row.a = first
        row.b = second
        one = k.bodies[a]
        row.ax = one.x
        row.ay = one.y
        row.avx = one.vx
        row.avy = one.vy
        if b >= 0:
            two = k.bodies[b]
            row.bx = two.x
            row.by = two.y
            row.bvx = two.vx
            row.bvy = two.vy


@hook
def _log_contact(k: Kernel, tick: int, first: int, second: int) -> None:
    """Write down for the digest who met, by numbers, and when."""
    clock = k.clock[0]
    met = k.met[clock.logged]
    clock.logged += 1
    met.epoch = clock.epoch + (tick >> 52)
    met.tick = tick & ((1 << 52) - 1)
    met.a = first
    met.b = second


@hook
def log_passing(k: Kernel, tick: int, a: int, b: int) -> None:
    """Log that the bodies in two slots begin to pass through each other, the elder given first, or end to,
    the younger first. No plan changes, so the long row has none."""
    clock = k.clock[0]
    k.counts[0].logged += 1
    _log_contact(k, tick, k.queue[a].number, k.queue[b].number)
    if len(k.log) > 0:
        row = k.log[clock.written]
        clock.written += 1
        row.tick = tick
        row.a = k.queue[a].number
        row.b = k.queue[b].number
        row.ax = math.nan
        row.ay = math.nan
        row.avx = math.nan
        row.avy = math.nan
        row.bx = math.nan
        row.by = math.nan
        row.bvx = math.nan
        row.bvy = math.nan


@hook
def log_is_full(k: Kernel, rows: int) -> bool:
    """Whether there is no room for so many rows more."""
    clock = k.clock[0]
    room = len(k.met) - clock.logged
    return bool(room < rows or (len(k.log) > 0 and len(k.log) - clock.written < rows))
