"""Broad phases that do harm, one way each: what a kit must survive.

As a module it is a plugin, so that it can be added in a process or installed (tests/core/conformance).
"""

from __future__ import annotations

import ctypes
import os
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.toolbox import NEVER, BroadPhaseParts, Kernel, Records, add_pair, hook, schedule


class State(NamedTuple):
    """A number to remember."""

    memory: Records


@hook
def nothing(k: Kernel, s: State, which: int) -> None:
    """Leave everything as it is."""


@hook
def every_pair(k: Kernel, s: State) -> None:
    for a in range(len(k.bodies)):
        for b in range(a + 1, len(k.bodies)):
            add_pair(k, a, b)
    if k.clock[0].structural > 0:
        schedule(k, 0, k.clock[0].now)


@hook
def no_such_field(k: Kernel, s: State) -> None:
    s.memory[0] = k.clock[0].weather


@hook
def for_ever(k: Kernel, s: State, which: int) -> None:
    while s.memory[0] < 1.0:
        s.memory[0] *= 0.5


@hook
def one_too_many(k: Kernel, s: State, which: int) -> None:
    schedule(k, 0, NEVER)
    schedule(k, k.clock[0].structural, k.clock[0].now)


@hook
def far_too_many(k: Kernel, s: State) -> None:
    for certificate in range(1 << 20):
        schedule(k, certificate * 1000, k.clock[0].now)


@hook
def below_zero(k: Kernel, s: State) -> None:
    schedule(k, -1, k.clock[0].now)


@hook
def nobody_and_nobody(k: Kernel, s: State) -> None:
    add_pair(k, -3, 1 << 30)


@hook
def into_the_queue(k: Kernel, s: State, which: int) -> None:
    schedule(k, 0, NEVER)
    for place in range(k.clock[0].queued - 1):
        if k.queue[place].tick != k.queue[place + 1].tick:
            k.queue[place], k.queue[place + 1] = k.queue[place + 1], k.queue[place]


@hook
def queue_without_end(k: Kernel, s: State, which: int) -> None:
    schedule(k, 0, NEVER)
    k.clock[0].queued = 1 << 40


@hook
def into_the_bodies(k: Kernel, s: State, which: int) -> None:
    schedule(k, 0, NEVER)
    for body in range(len(k.bodies)):
        k.bodies[body].vx *= 2.0


@hook
def off_its_arrays(k: Kernel, s: State, which: int) -> None:
    schedule(k, 0, NEVER)
    s.memory[1 << 40] = 1.0


def leaves(k: Kernel, s: State) -> None:
    sys.exit(3)


def crashes(k: Kernel, s: State) -> None:
    ctypes.string_at(0)


def aborts(k: Kernel, s: State) -> None:
    os.abort()


def exits(k: Kernel, s: State) -> None:
    os._exit(7)


def raises(k: Kernel, s: State) -> None:
    raise KeyError("no such thing")


def hangs(k: Kernel, s: State) -> None:
    if "HOSTILE_PID" in os.environ:
        Path(os.environ["HOSTILE_PID"]).write_text(str(os.getpid()), encoding="utf-8")
    while True:
        pass


def fails_slowly(k: Kernel, s: State) -> None:
    time.sleep(1.0)
    raise KeyError("at last")


def takes_all(k: Kernel, s: State) -> None:
    heap = []
    while True:
        heap.append(np.ones(1 << 24))


def touches(k: Kernel, s: State) -> None:
    k.bodies.vx[:] = 0.0


def audits_badly(k: Kernel, s: State):
    raise ZeroDivisionError("by nought")
    yield


def phase(build=every_pair, repair=nothing, replan=nothing, certificates=0, **more):
    """Return a broad phase made of these parts."""

    class Hostile:
        def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
            return BroadPhaseParts(State(np.zeros(1)), certificates, build, repair, replan, **more)

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


class ReturnsANumber:
    def prepare(self, scene: kt.Scene) -> int:
        return 5


class ReturnsTheWrongParts:
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(
            (1, 2), -1, every_pair, nothing, lambda k, s, b: None, arrange=7, ticks=[np.zeros(3)]
        )


class ReturnsTooMuch:
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(State(np.zeros(1)), 2**31 - 1, every_pair, nothing, nothing)


HOSTILE = {
    "cannot-be-made": Cannot,
    "raises-in-prepare": RaisesInPrepare,
    "leaves-in-prepare": LeavesInPrepare,
    "returns-a-number": ReturnsANumber,
    "returns-the-wrong-parts": ReturnsTheWrongParts,
    "wants-too-many-certificates": ReturnsTooMuch,
    "raises-in-arrange": phase(arrange=raises),
    "leaves-in-arrange": phase(arrange=leaves),
    "fails-slowly-in-arrange": phase(arrange=fails_slowly),
    "crashes-in-arrange": phase(arrange=crashes),
    "aborts-in-arrange": phase(arrange=aborts),
    "exits-in-arrange": phase(arrange=exits),
    "hangs-in-arrange": phase(arrange=hangs),
    "takes-all-memory": phase(arrange=takes_all),
    "touches-bodies-in-arrange": phase(arrange=touches),
    "audits-badly": phase(audit=audits_badly),
    "has-no-such-field": phase(build=no_such_field),
    "hangs-in-a-hook": phase(repair=for_ever, certificates=1),
    "schedules-one-too-many": phase(repair=one_too_many, certificates=1),
    "schedules-far-too-many": phase(build=far_too_many, certificates=1),
    "schedules-below-zero": phase(build=below_zero, certificates=1),
    "pairs-nobody": phase(build=nobody_and_nobody),
    "corrupts-the-queue": phase(repair=into_the_queue, certificates=1),
    "loses-the-queue": phase(repair=queue_without_end, certificates=1),
    "turns-bodies": phase(repair=into_the_bodies, certificates=1),
    "leaves-its-arrays": phase(repair=off_its_arrays, certificates=1),
}

for _name, _phase in HOSTILE.items():
    globals()["".join(part.title() for part in _name.split("-"))] = _phase


@kt.hookimpl
def kinetile_broad_phases() -> list[kt.BroadPhaseSpec]:
    return [
        kt.BroadPhaseSpec(name, f"{__name__}:{''.join(part.title() for part in name.split('-'))}")
        for name in HOSTILE
    ]
