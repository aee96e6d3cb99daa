"""What the loop writes down of an event: what is digested of a contact, and for whoever records the plans
after it. Rows speak of bodies by their numbers."""

from __future__ import annotations

from kinetile.kernel.compiled import hook
from kinetile.kernel.log import TURNED
from kinetile.kernel.tables import Kernel

__all__ = ["log", "log_is_full"]


@hook
def log(k: Kernel, tick: int, a: int, b: int) -> None:
    """Log an event of the body in slot a, and of the one in slot b or of what a number below 0 stands for."""
    clock = k.clock[0]
    k.counts[0].logged += 1
    first = k.queue[a].number
    second = k.queue[b].number if b >= 0 else b
    if b > TURNED:
        met = k.met[clock.logged]
        clock.logged += 1
        met.epoch = clock.epoch + (tick >> 52)
        met.tick = tick & ((1 << 52) - 1)
        met.a = first
        met.b = second
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
def log_is_full(k: Kernel) -> bool:
    """Whether there is no room for another event."""
    clock = k.clock[0]
    return bool(clock.logged >= len(k.met) or (len(k.log) > 0 and clock.written >= len(k.log)))
