"""Broad phases with one defect each, to see that the kernel names it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.toolbox import (
    BroadPhaseParts,
    Kernel,
    Records,
    add_pair,
    hook,
    remove_pair,
    schedule,
)


class State(NamedTuple):
    """One number to remember."""

    memory: Records


@hook
def nothing(k: Kernel, s: State, which: int) -> None:
    """Leave everything as it is."""


@hook
def all_but_one(k: Kernel, s: State) -> None:
    for a in range(len(k.bodies)):
        for b in range(a + 1, len(k.bodies)):
            if a != 0 or b != 1:
                add_pair(k, a, b)


@hook
def add_after_a_change(k: Kernel, s: State, body: int) -> None:
    if body < 2 and s.memory[0] == 0.0:
        s.memory[0] = 1.0
        add_pair(k, 0, 1)


@hook
def remember_late(k: Kernel, s: State) -> None:
    for a in range(len(k.bodies)):
        for b in range(a + 1, len(k.bodies)):
            if a != 0 or b != 1:
                add_pair(k, a, b)
    schedule(k, 0, k.clock[0].now + (1 << 51))


@hook
def add_too_late(k: Kernel, s: State, certificate: int) -> None:
    add_pair(k, 0, 1)
    schedule(k, 0, (1 << 63) - 1)


@hook
def no_such_pair(k: Kernel, s: State) -> None:
    add_pair(k, 0, len(k.bodies))


@hook
def was_never_there(k: Kernel, s: State) -> None:
    remove_pair(k, 0, 1)


@hook
def wake(k: Kernel, s: State) -> None:
    schedule(k, 0, k.clock[0].now)


@hook
def no_such_field(k: Kernel, s: State) -> None:
    s.memory[0] = k.bodies[0].temperature


@hook
def again(k: Kernel, s: State, certificate: int) -> None:
    schedule(k, 0, k.clock[0].now)


def phase(build, repair=nothing, certificates=0, replan=nothing):
    """Return a broad phase made of these hooks."""

    class Broken:
        def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
            return BroadPhaseParts(State(np.zeros(1)), certificates, build, repair, replan)

    return Broken


BROKEN = {
    "adds-when-deep": phase(all_but_one, replan=add_after_a_change),
    "adds-too-late": phase(remember_late, add_too_late, 1),
    "names-nobody": phase(no_such_pair),
    "removes-nothing": phase(was_never_there),
    "does-not-compile": phase(no_such_field),
    "never-gets-on": phase(wake, again, 1),
}


class Plugin:
    """All of them, for the registry."""

    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        return [kt.BroadPhaseSpec(name, target) for name, target in BROKEN.items()]


class Blind:
    """Brings a broad phase that never sees bodies 0 and 1 meet."""

    @kt.hookimpl
    def kinetile_broad_phases(self):
        return [kt.BroadPhaseSpec("blind", phase(all_but_one))]
