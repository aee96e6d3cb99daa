"""Broad phases that do harm, each in one way: a kit must survive them.

As a module it is a plugin, so that it can be added in a process or installed (tests/plugins/conformance).
"""

import ctypes
import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.toolbox import NEVER, BroadPhaseParts, Kernel, Records, hook, offer, schedule
from kinetile_plugins.naive import near as everyone


class State(NamedTuple):
    """A number to remember."""

    memory: Records


@hook
def nobody(k: Kernel, s: State, body: int) -> int:
    return 0


@hook
def wake(k: Kernel, s: State) -> None:
    if len(k.bodies) > 0:
        schedule(k, 0, k.clock[0].now)


@hook
def rest(k: Kernel, s: State, body: int) -> int:
    schedule(k, body, NEVER)
    return 0


@hook
def leave_plans(k: Kernel, s: State, body: int) -> None:
    """Nothing depends on a plan."""


@hook
def for_ever(k: Kernel, s: State, body: int) -> int:
    while s.memory[0] < 1.0:
        s.memory[0] *= 0.5
    return 0


@hook
def one_too_many(k: Kernel, s: State, body: int) -> int:
    schedule(k, 0, NEVER)
    schedule(k, len(k.bodies), k.clock[0].now)
    return 0


@hook
def nobody_and_nobody(k: Kernel, s: State) -> None:
    offer(k, -3, 1 << 30)


@hook
def off_the_answer(k: Kernel, s: State, body: int) -> int:
    k.near[1 << 40] = body
    return 0


@hook
def fewer_than_none(k: Kernel, s: State, body: int) -> int:
    return -1


@hook
def a_stranger(k: Kernel, s: State, body: int) -> int:
    k.near[0] = len(k.bodies)
    return 1


@hook
def into_the_queue(k: Kernel, s: State, body: int) -> int:
    schedule(k, 0, NEVER)
    for other in range(1, len(k.bodies)):
        k.queue[other].key += 1
    return 0


@hook
def into_the_bodies(k: Kernel, s: State, body: int) -> int:
    schedule(k, 0, NEVER)
    for other in range(len(k.bodies)):
        k.bodies[other].vx *= 2.0
    return 0


@hook
def off_its_arrays(k: Kernel, s: State, body: int) -> int:
    schedule(k, 0, NEVER)
    s.memory[1 << 40] = 1.0
    return 0


def leaves(k: Kernel, s: State) -> None:
    sys.exit(3)


def crashes(k: Kernel, s: State) -> None:
    ctypes.string_at(0)


def raises(k: Kernel, s: State) -> None:
    raise KeyError("no such thing")


def hangs(k: Kernel, s: State) -> None:
    if "HOSTILE_PID" in os.environ:
        Path(os.environ["HOSTILE_PID"]).write_text(str(os.getpid()), encoding="utf-8")
    while True:
        pass


def dawdles(k: Kernel, s: State) -> None:
    until = time.process_time() + 1.5
    while time.process_time() < until:
        pass


def takes_all(k: Kernel, s: State) -> None:
    heap = []
    while True:
        heap.append(np.ones(1 << 24))


def touches(k: Kernel, s: State) -> None:
    k.bodies.vx[:] = 0.0


def audits_badly(k: Kernel, s: State):
    raise ZeroDivisionError("by nought")
    yield


def phase(near=everyone, build=wake, repair=rest, **more):
    """Returns a broad phase made of these parts."""

    class Hostile:
        def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
            return BroadPhaseParts(near, State(np.zeros(1)), build, repair, leave_plans, **more)

    return Hostile


class RaisesInPrepare:
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        raise RuntimeError("the moon is not full")


class LeavesInPrepare:
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        sys.exit("good bye")


class Cannot:
    def __init__(self) -> None:
        raise OSError("no licence")


class IsWrongAndSlow:
    """No body is near another; each simulation takes a while."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        until = time.process_time() + 0.01
        while time.process_time() < until:
            pass
        return BroadPhaseParts(nobody)


class BreaksTheKit:
    """No body is near another; it breaks the kit's living scenes and their minimisation."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        from kinetile_conformance import runner
        from kinetile_conformance.strategies import living

        if "pytest" not in sys.modules:  # for a refusal of another phase, the parent prepares this one too
            runner.reduced = living.Subject = None  # type: ignore[assignment,misc]
        return BroadPhaseParts(nobody)


class ReturnsANumber:
    def prepare(self, scene: kt.Scene) -> int:
        return 5


class ReturnsTheWrongParts:
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(
            lambda k, s, b: 0, (1, 2), room=-1, pairs=0.5, arrange=7, audit="all", ticks=[np.zeros(3)]
        )


HOSTILE = {
    "cannot-be-made": Cannot,
    "raises-in-prepare": RaisesInPrepare,
    "leaves-in-prepare": LeavesInPrepare,
    "is-wrong-and-slow": IsWrongAndSlow,
    "breaks-the-kit": BreaksTheKit,
    "returns-a-number": ReturnsANumber,
    "returns-the-wrong-parts": ReturnsTheWrongParts,
    "raises-in-arrange": phase(arrange=raises),
    "leaves-in-arrange": phase(arrange=leaves),
    "crashes-in-arrange": phase(arrange=crashes),
    "hangs-in-arrange": phase(arrange=hangs),
    "takes-all-memory": phase(arrange=takes_all),
    "touches-bodies-in-arrange": phase(arrange=touches),
    "audits-badly": phase(audit=audits_badly),
    "dawdles-in-arrange": phase(arrange=dawdles),
    "hangs-in-a-hook": phase(repair=for_ever),
    "schedules-one-too-many": phase(repair=one_too_many),
    "offers-nobody": phase(build=nobody_and_nobody),
    "names-without-room": phase(off_the_answer),
    "names-fewer-than-none": phase(fewer_than_none),
    "names-a-stranger": phase(a_stranger),
    "corrupts-the-queue": phase(repair=into_the_queue),
    "turns-bodies": phase(repair=into_the_bodies),
    "leaves-its-arrays": phase(repair=off_its_arrays),
}

for _name, _phase in HOSTILE.items():
    globals()["".join(part.title() for part in _name.split("-"))] = _phase


def waits_for_one_that_computes(subject: object) -> None:
    """Waits for another process, which computes for ever."""
    subprocess.run([sys.executable, "-c", "while True: pass"], check=False)


def cpu_limit(subject: object) -> tuple[float, int]:
    """Returns the CPU seconds of this process, and their limit."""
    import resource

    return time.process_time(), resource.getrlimit(resource.RLIMIT_CPU)[0]


def sends_half_a_message(subject: object) -> None:
    """Writes the beginning of a message to the pipe, and waits."""
    for each in Path("/proc/self/fd").iterdir():
        with suppress(OSError):
            if os.readlink(each).startswith("pipe:"):
                os.write(int(each.name), b"\x80\x04\x95half")
    time.sleep(600.0)


def leaves_a_process_behind(subject: object) -> None:
    """Starts a process of another session that keeps the connection for a while, and ends this one."""
    if os.fork() == 0:
        os.setsid()
        time.sleep(30.0)
    os._exit(7)


@kt.hookimpl
def kinetile_broad_phases() -> list[kt.BroadPhaseSpec]:
    return [
        kt.BroadPhaseSpec(name, f"{__name__}:{''.join(part.title() for part in name.split('-'))}")
        for name in HOSTILE
    ]
