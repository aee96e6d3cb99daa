"""Broad phases that are right but write to forbidden places, or access values outside an array.

As a module it is a plugin. ``python -m trespassing_phases`` prints as JSON the faults that are found in each
with interpreted hooks.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import kinetile as kt
from kinetile.toolbox import (
    NEVER,
    BroadPhaseParts,
    Kernel,
    Records,
    add_pair,
    falls,
    hook,
    is_there,
    offer,
    schedule,
)

STEP = 1 << 51


class State(NamedTuple):
    """The number of failures of each body's certificate; the array beyond which a phase strays; the values
    that it was given."""

    failed: Records  # (n,)
    astray: Records  # (1,)
    radius: Records  # (n,)


@hook
def everyone(k: Kernel, s: State, body: int) -> int:
    for other in range(len(k.bodies)):
        k.near[other] = other
    return len(k.bodies)


@hook
def build(k: Kernel, s: State) -> None:
    for body in range(len(k.bodies)):
        schedule(k, body, k.clock[0].now + STEP)


@hook
def wait_on(k: Kernel, s: State, body: int) -> int:
    s.failed[body] += 1
    schedule(k, body, k.clock[0].now + STEP)
    return 0


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """No certificate depends on a plan."""


# Forbidden writes


@hook
def uncount(k: Kernel, s: State, body: int) -> int:
    k.counts[0].structural -= 1
    return wait_on(k, s, body)


@hook
def brake_the_fourth(k: Kernel, s: State, body: int) -> int:
    if len(k.bodies) > 3:
        k.bodies[3].vx = 0.0625
    return everyone(k, s, body)


@hook
def set_own(k: Kernel, s: State, body: int) -> int:
    k.queue[body].certificate = k.clock[0].now + STEP
    return 0


@hook
def set_anothers(k: Kernel, s: State, body: int) -> int:
    k.queue[(body + 1) % len(k.bodies)].certificate = NEVER
    return wait_on(k, s, body)


@hook
def answer_for_near(k: Kernel, s: State, body: int) -> None:
    k.near[0] = 0
    k.near[1] = 0


@hook
def drop_offers(k: Kernel, s: State, body: int) -> int:
    schedule(k, (body + 1) % len(k.bodies), k.clock[0].now + STEP + body)
    k.clock[0].lists.offered = 0
    return wait_on(k, s, body)


@hook
def schedule_in_near(k: Kernel, s: State, body: int) -> int:
    schedule(k, body, k.clock[0].now + 3 * STEP)
    return everyone(k, s, body)


def arrange_the_scene(k: Kernel, s: State) -> None:
    s.radius.flags.writeable = True
    s.radius[:] *= 1.0 + 2.0**-50


def audit_and_mend(k: Kernel, s: State) -> Iterator[str]:
    s.failed[:] = 0
    yield from ()


# Outside an array


@hook
def stray(k: Kernel, s: State, body: int) -> int:
    s.failed[len(s.failed)] = 1
    return everyone(k, s, body)


@hook
def stray_where_told(k: Kernel, s: State, body: int) -> int:
    if s.astray[0] != 0:
        s.failed[s.astray[0]] = 1
    return everyone(k, s, body)


@hook
def stray_in_the_kernel(k: Kernel, s: State, body: int) -> int:
    if s.astray[0] != 0:
        k.mass[s.astray[0]] = 1.0
    return everyone(k, s, body)


@hook
def ask_the_last(k: Kernel, s: State, body: int) -> int:
    s.failed[body] = int(k.bodies[-1].x < 0.0)
    return everyone(k, s, body)


@hook
def schedule_too_far(k: Kernel, s: State, body: int) -> int:
    falls(k, k.bodies[len(k.bodies)].anchor, 1.0, 1.0)
    return wait_on(k, s, body)


@hook
def misspell(k: Kernel, s: State, body: int) -> None:
    s.failed[body] = k.bodies[body].vz


# Allowed calls


@hook
def use_the_toolbox(k: Kernel, s: State, body: int) -> int:
    others = len(k.bodies)
    schedule(k, body, NEVER)
    schedule(k, body, k.clock[0].now + STEP)
    schedule(k, (body + 1) % others, k.clock[0].now + STEP + 1)
    if others > 1:
        offer(k, body, (body + 1) % others)
        add_pair(k, body, (body + 1) % others)
    s.failed[-1] += 1
    k.near[0] = body
    return 1


# With insertions and removals


@hook
def those_there(k: Kernel, s: State, body: int) -> int:
    named = 0
    for other in range(len(k.bodies)):
        if is_there(k, other):
            k.near[named] = other
            named += 1
    return named


@hook
def build_for_those_there(k: Kernel, s: State) -> None:
    for body in range(k.clock[0].bodies):
        schedule(k, body, k.clock[0].now + STEP)


@hook
def take_in(k: Kernel, s: State, body: int) -> None:
    s.failed[body] = 0
    schedule(k, body, k.clock[0].now + STEP)


@hook
def let_go(k: Kernel, s: State, body: int) -> None:
    """No other body's certificate depends on a body."""


@hook
def take_in_uncounted(k: Kernel, s: State, body: int) -> None:
    take_in(k, s, body)
    k.counts[0].structural -= 1


@hook
def let_go_one_further(k: Kernel, s: State, body: int) -> None:
    s.failed[len(s.failed) + 3] = body


@hook
def move_ahead(k: Kernel, s: State, body: int, stage: int) -> None:
    k.places[body].x += 1.0


def living(**parts: Any) -> dict[str, Any]:
    """Returns the parts of a phase that accepts insertions and removals."""
    return {"near": those_there, "build": build_for_those_there, "enter": take_in, "leave": let_go, **parts}


class Trespasser:
    """A phase that is right, but for some of its parts."""

    parts: dict[str, Any]

    def __init__(self, *, astray: int = 0) -> None:
        self.astray = astray

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        state = State(np.zeros(scene.capacity, dtype=np.int64), np.array([self.astray]), scene.radius)
        parts = {"near": everyone, "build": build, "repair": wait_on, "replan": replan, **self.parts}
        return BroadPhaseParts(state=state, pairs=64, **parts)


ALL: dict[str, dict[str, Any]] = {
    "uncounts": {"repair": uncount},
    "brakes-the-fourth": {"near": brake_the_fourth},
    "sets-its-own": {"repair": set_own},
    "sets-anothers": {"repair": set_anothers},
    "answers-for-near": {"replan": answer_for_near},
    "drops-offers": {"repair": drop_offers},
    "schedules-in-near": {"near": schedule_in_near},
    "arranges-the-scene": {"arrange": arrange_the_scene},
    "moves-who-comes-soon": {"soon": move_ahead},
    "mends-in-audit": {"audit": audit_and_mend},
    "strays": {"near": stray},
    "asks-the-last": {"near": ask_the_last},
    "asks-one-too-many": {"repair": schedule_too_far},
    "misspells": {"replan": misspell},
    "takes-in-uncounted": living(enter=take_in_uncounted),
    "lets-go-one-further": living(leave=let_go_one_further),
    "strays-where-told": {"near": stray_where_told},
    "strays-in-the-kernel": {"near": stray_in_the_kernel},
    "uses-the-toolbox": {"repair": use_the_toolbox},
    "takes-in-and-lets-go": living(),
}

CLASSES = {
    name: type(name.title().replace("-", ""), (Trespasser,), {"parts": parts}) for name, parts in ALL.items()
}
globals().update({phase.__name__: phase for phase in CLASSES.values()})


@kt.hookimpl
def kinetile_broad_phases() -> list[kt.BroadPhaseSpec]:
    return [
        kt.BroadPhaseSpec(name, f"trespassing_phases:{phase.__name__}") for name, phase in CLASSES.items()
    ]
