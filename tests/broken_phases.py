"""Broad phases with one defect each, to test that the kernel names it."""

from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.toolbox import BroadPhaseParts, Kernel, Records, hook, offer, remove_pair, schedule


class State(NamedTuple):
    """One number to remember."""

    memory: Records


@hook
def all_but_one(k: Kernel, s: State, body: int) -> int:
    count = 0
    for other in range(len(k.bodies)):
        if body > 1 or other > 1 or s.memory[0] > 0.0:
            k.near[count] = other
            count += 1
    return count


@hook
def nothing(k: Kernel, s: State) -> None:
    """Changes nothing."""


@hook
def offer_after_a_change(k: Kernel, s: State, body: int) -> None:
    if body < 2 and s.memory[0] == 0.0:
        s.memory[0] = 1.0
        offer(k, 0, 1)


@hook
def leave_plans(k: Kernel, s: State, body: int) -> None:
    """Nothing depends on a plan."""


@hook
def near_printed(k: Kernel, s: State, body: int) -> int:
    print("near", body)
    return all_but_one(k, s, body)


@hook
def remember_late(k: Kernel, s: State) -> None:
    schedule(k, 0, k.clock[0].now + (1 << 51))


@hook
def name_too_late(k: Kernel, s: State, body: int) -> int:
    schedule(k, 0, (1 << 63) - 1)
    s.memory[0] = 1.0
    k.near[0] = 1
    return 1


@hook
def keep_it_to_itself(k: Kernel, s: State, body: int) -> int:
    schedule(k, 0, (1 << 63) - 1)
    s.memory[0] = 1.0
    return 0


@hook
def soon(k: Kernel, s: State) -> None:
    schedule(k, 0, k.clock[0].now + (1 << 49))


@hook
def no_such_pair(k: Kernel, s: State) -> None:
    offer(k, 0, len(k.bodies))


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
def again(k: Kernel, s: State, body: int) -> int:
    schedule(k, 0, k.clock[0].now)
    return 0


@hook
def not_again(k: Kernel, s: State, body: int) -> int:
    return 0


@hook
def the_later_ones(k: Kernel, s: State, body: int) -> int:
    count = 0
    for other in range(body + 1, len(k.bodies)):
        k.near[count] = other
        count += 1
    return count


def phase(near=all_but_one, build=nothing, repair=again, replan=leave_plans):
    """Returns a broad phase made of these hooks."""

    class Broken:
        def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
            return BroadPhaseParts(near, State(np.zeros(1)), build, repair, replan)

    return Broken


BROKEN = {
    "adds-when-deep": phase(replan=offer_after_a_change),
    "adds-too-late": phase(build=remember_late, repair=name_too_late),
    "keeps-a-newcomer-to-itself": phase(build=soon, repair=keep_it_to_itself),
    "is-near-one-way": phase(the_later_ones),
    "names-nobody": phase(build=no_such_pair),
    "removes-nothing": phase(build=was_never_there),
    "does-not-compile": phase(build=no_such_field),
    "prints": phase(near_printed),
    "never-gets-on": phase(build=wake),
    "does-not-reschedule": phase(build=wake, repair=not_again),
}


SPECS = [kt.BroadPhaseSpec(name, target) for name, target in BROKEN.items()]


class Blind:
    """A plugin with a broad phase that never sees bodies 0 and 1 meet."""

    @kt.hookimpl
    def kinetile_broad_phases(self):
        return [kt.BroadPhaseSpec("blind", phase())]
