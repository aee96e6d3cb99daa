"""Observations of narrow phases: lower bounds that say nothing, and what the tick of a contact depends on.

Between a body and its first contact the kernel has lower bounds, and computes the exact tick only when a
bound has come to the head of the queue. With the bounds of ``disc`` it seldom has to solve exactly for all
bodies near one, and so hardly ever calls a phase's ``near`` at a moment at which no other hook of it is
running. A narrow phase of the kit's own makes it do so at each event: it is ``disc``, or the narrow phase
under test, but for bounds that always say "perhaps now".

The reference runs with the narrow phase under test. Where that is wrong in the same way under every broad
phase, no comparison shows it: the bodies of a pair, for example, always come in the same order. So ticks are
computed again on copies of the kernel's tables that differ in all but the flight plans.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.tables import column, fields_in
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import NarrowPhaseSpec
from kinetile.run.audit import said_tick
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.toolbox import NOBODY, Kernel, PairParts, hook
from kinetile_conformance.cases import GENERAL, PhasePlugin, RunOutcome, difference, outcome
from kinetile_conformance.checks.check import Case, Disagreement, compare, observation
from kinetile_conformance.checks.runs import STEPS, STOPS, watch

NAME = "conformance-loose"

Integers = npt.NDArray[np.integer]

EVERY = 4
"""Events from one test of all pairs to the next."""

LATER = 2**44 + 977
"""Ticks, some 1/256 of a time unit, and odd: what is computed from there is rounded otherwise."""

OF_BODIES = ("bodies", "mass", "radii", "sides", "places", "queue", "traits")
OF_THE_SCENE = (
    *("tick", "per_time", "epoch", "kinds"),
    *(f"limits.{name}" for name in ("skin", "theta", "tolerance", "width", "height", "fat")),
)
"""Fields of the clock that stay as they are, or move with all ticks alike."""


@hook
def perhaps_now(
    k: Kernel, body: int, count: int, barred: int, known: int, at: int
) -> tuple[float, float, int]:
    """Return for every candidate that it may touch at once: a bound may be early."""
    for i in range(count):
        other = k.near[i]
        if other != body and other != barred and other != known:
            return 0.0, 0.0, int(other)
    return math.inf, math.inf, NOBODY


class LooseBounds:
    """A narrow phase for pairs with lower bounds that say nothing."""

    def __init__(self, of: str = "disc", options: Mapping[str, Any] | None = None) -> None:
        self._phase = registry().target("narrow phase", of)(**options or {})

    def prepare(self, scene: Scene) -> PairParts:
        """Return the parts."""
        parts: PairParts = self._phase.prepare(scene)
        return replace(parts, soonest=perhaps_now)


@contextmanager
def _registered() -> Iterator[str]:
    """Registers the narrow phase within this context, under the name that it yields."""
    summary = "a narrow phase with bounds as loose as they may be"
    plugin = PhasePlugin(NarrowPhaseSpec(NAME, LooseBounds, summary, role="pair"))
    registry().add(plugin)
    try:
        yield NAME
    finally:
        registry().remove(plugin)


@observation()
def same_contacts_with_loose_bounds(case: Case) -> None:
    """The reference's contacts with bounds as loose as they may be, so that all are computed exactly"""
    of, options = next(iter(case.subject.of_role("pair").items()), ("disc", GENERAL))
    with _registered() as name:
        narrow = case.subject.of_role("wall") | {name: {"of": of, "options": options}}
        found = outcome(replace(case.subject, narrow=narrow), case.scene, case.contacts)
    compare(case, found, "with bounds as loose as they may be, ")


@observation(judges="pair", compares=False)
def a_contact_depends_on_two_plans_alone(case: Case) -> None:
    """The tick of a contact follows from two flight plans: the present time, the numbers of the bodies and
    what else the kernel holds make no difference, and computing it changes nothing"""
    number = count()

    def look(sim: Simulation) -> None:
        if next(number) % EVERY == 0 and sim.composition.pair is not None:
            _check_ticks(sim, sim.composition.pair)

    watch(case, look, STOPS, STEPS)


def _check_ticks(sim: Simulation, pair: PairParts) -> None:
    """Compute the contact of each pair again, in other surroundings; raise unless it is the same."""
    k = sim.tables
    pairs = np.column_stack(np.triu_indices(len(k.bodies), 1)).astype(np.int32)
    aside = _copied(k)
    expected = _ticks(pair, aside, pairs)
    changed = _changed(k, aside)
    if changed is not None:
        raise Disagreement(f"at time {sim.time!r} meet wrote {changed}")
    for how, other, numbered in _variants(k, pairs):
        found = _ticks(pair, other, numbered)
        for at in np.flatnonzero(found != expected):
            a, b = pairs[at].tolist()
            said = f"at time {sim.time!r} bodies {a} and {b} meet {said_tick(int(expected[at]))}"
            raise Disagreement(f"{said}; {how}, {said_tick(int(found[at]))}")


@observation(judges="pair")
def same_contacts_as_convex(case: Case) -> None:
    """Where it takes bodies of other shapes, its contacts, and all places and velocities at the end, are
    those of `convex`, under the reference and under this broad phase"""
    subject = case.subject
    compare(case, outcome(subject, case.scene, case.contacts))
    convex = replace(subject, narrow=subject.of_role("wall") | {"convex": {}}).reference
    found, expected = (_answer_of(each) for each in (case.expected, outcome(convex, case.scene)))
    said = difference(found, expected, str(subject.pair))
    if said is not None:
        raise Disagreement(f"compared with convex, {said}")


def _answer_of(run: RunOutcome) -> RunOutcome:
    """Return what the specification says of a run: not how deep bodies overlap, nor the sign of a zero."""
    return replace(run, tables={}, positions=run.positions + 0.0, velocities=run.velocities + 0.0)


def _variants(k: Kernel, pairs: Integers) -> Iterator[tuple[str, Kernel, Integers]]:
    """Yield a difference in words, tables with it and the same flight plans, and the numbers of the pairs."""
    later = _copied(k)
    later.clock.now += LATER
    yield "at a later present time", later, pairs
    bare = Kernel(*map(np.zeros_like, k))
    for name in ("bodies", "mass", "radii", "sides", "traits", "rules", "numbers"):
        getattr(bare, name)[:] = getattr(k, name)
    bare.bodies.last = NOBODY
    bare.bodies.stamp = 0
    for name in OF_THE_SCENE:
        column(bare.clock, name)[:] = column(k.clock, name)
    yield "with nothing in the kernel's other tables", bare, pairs
    n = len(k.bodies)
    reversed_ = {name: getattr(k, name)[::-1].copy() for name in OF_BODIES}
    yield (
        "with the bodies numbered the other way round",
        _copied(k)._replace(**reversed_),
        n - 1 - pairs[:, ::-1],
    )


def _copied(k: Kernel) -> Kernel:
    return Kernel(*(table.copy() for table in k))


def _changed(k: Kernel, aside: Kernel) -> str | None:
    """Return which field of which table is not as it was, but for a fault, which ``meet`` may report; None:
    none is."""
    for name, before, after in zip(k._fields, k, aside, strict=True):
        for field in fields_in(before.dtype) or [""]:
            one, two = (column(before, field), column(after, field)) if field else (before, after)
            if one.tobytes() != two.tobytes() and not field.startswith("fault"):
                return f"{name}.{field}" if field else name
    return None


def _ticks(pair: PairParts, k: Kernel, pairs: Integers) -> npt.NDArray[np.int64]:
    """Return when the bodies of each pair meet."""
    ticks = np.zeros(len(pairs), dtype=np.int64)
    numbers = np.ascontiguousarray(pairs, dtype=np.int32)
    compose(meet_all, {"meet": pair.meet}, "conformance", Kernel)(k, numbers, ticks)
    return ticks


meet = to_be_filled_in


def meet_all(k: Kernel, pairs: Integers, ticks: npt.NDArray[np.int64]) -> None:
    """Write down when the bodies of each pair meet; a template, as ``kernel.loop`` has."""
    k = disowned(k)
    for i in range(len(pairs)):
        ticks[i] = meet(k, pairs[i, 0], pairs[i, 1])
