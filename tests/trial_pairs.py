"""A foreign narrow phase for pairs of discs, right but for a chosen fault; it is a plugin."""

from dataclasses import replace

import kinetile as kt
from kinetile.toolbox import NEVER, Kernel, PairParts, hook

WALLED = kt.Scene([[1.0, 1.0], [3.0, 1.25]], [[1.0, 0.5], [-1.0, 0.0]], 0.5, arena=(4.0, 4.0))
usual = kt.registry().target("narrow phase", "disc")(general=True).prepare(WALLED)


@hook
def later(k: Kernel, a: int, b: int, is_wrong: bool) -> int:
    tick = usual.meet(k, a, b)
    return tick + 1 if is_wrong and tick < NEVER else tick


@hook
def meet_by_now(k: Kernel, a: int, b: int) -> int:
    return int(later(k, a, b, k.clock[0].now > max(k.bodies[a].anchor, k.bodies[b].anchor)))


@hook
def meet_from_the_right(k: Kernel, a: int, b: int) -> int:
    return int(later(k, a, b, k.bodies[a].x > k.bodies[b].x))


@hook
def meet_for_who_asks(k: Kernel, a: int, b: int) -> int:
    return int(later(k, a, b, k.counts[0].exact % 3 == 1))


@hook
def meet_and_write(k: Kernel, a: int, b: int) -> int:
    k.stamps[a] += 2
    return int(usual.meet(k, a, b))


@hook
def meet_a_tick_late(k: Kernel, a: int, b: int) -> int:
    return int(later(k, a, b, True))


@hook
def collide_and_heat(k: Kernel, a: int, b: int) -> float:
    depth = usual.collide(k, a, b)
    k.bodies[a].vx *= 1.0 + 2.0**-20
    return depth


@hook
def late_beyond_a_time(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    first, second, who = usual.soonest(k, body, count, barred, at)
    return first if first < 100.0 else 2.0 * first, second, who


FAULTS = {
    "now": {"meet": meet_by_now},
    "order": {"meet": meet_from_the_right},
    "asked": {"meet": meet_for_who_asks},
    "writes": {"meet": meet_and_write},
    "late": {"meet": meet_a_tick_late},
    "heats": {"collide": collide_and_heat},
    "bounds": {"soonest": late_beyond_a_time},
    "": {},
}


class Trial:
    def __init__(self, fault: str = "", says: str = "closer") -> None:
        self.parts = replace(usual, contact_distance=says, **FAULTS[fault])

    def prepare(self, scene: kt.Scene) -> PairParts:
        return self.parts


@kt.hookimpl
def kinetile_narrow_phases() -> list[kt.NarrowPhaseSpec]:
    return [kt.NarrowPhaseSpec("trial", f"{__name__}:Trial", "discs under test", role="pair")]
