"""Observations of narrow phases: what the tick of a contact depends on, bounds, energy.

The reference runs with the narrow phase under test. Where that is wrong in the same way under every broad
phase, no comparison shows it: the bodies of a pair, for example, always come in the same order. So ticks are
computed again on copies of the kernel's tables that differ in all but the flight plans.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.flight import note_all_places, position_at
from kinetile.kernel.log import WALLS
from kinetile.kernel.tables import column, fields_in
from kinetile.plugin.registry import registry
from kinetile.run.audit import said_tick
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.toolbox import NEVER, NOBODY, Kernel, PairParts, WallParts, inside_arena
from kinetile_conformance.cases import GENERAL, RunOutcome, difference, outcome
from kinetile_conformance.checks.check import Case, Disagreement, DoesNotApply, compare, observation
from kinetile_conformance.checks.runs import watch_some

Integers = npt.NDArray[np.integer]
Ticks = npt.NDArray[np.int64]

ROUNDED = 2.0**-44
"""The part of the energy that rounding may add."""

LATER = 2**44 + 977
"""Ticks, some 1/256 of a time unit, and odd: what is computed from there is rounded otherwise."""

OF_BODIES = ("bodies", "mass", "radii", "sides", "places", "queue", "traits")
OF_THE_SCENE = (
    *("tick", "per_time", "epoch", "kinds"),
    *(f"limits.{name}" for name in ("skin", "theta", "tolerance", "width", "height", "fat")),
)
"""Fields of the clock that stay as they are, or move with all ticks alike."""


@observation(judges="pair", compares=False)
def a_contact_depends_on_two_plans_alone(case: Case) -> None:
    """The tick of a contact, and the velocities after it, follow from two flight plans: the present time, the
    numbers of the bodies and what else the kernel holds make no difference, and computing a tick changes
    nothing"""
    _at_some_moments(case, _check_ticks)


def _at_some_moments(case: Case, look: Callable[[Simulation, PairParts, Kernel, Integers], None]) -> None:
    """Call a function with a simulation at some moments of a run, its narrow phase for pairs, a copy of its
    tables, and all pairs."""

    def see(sim: Simulation) -> None:
        pair = sim.composition.pair
        if pair is not None:
            pairs = np.column_stack(np.triu_indices(len(sim.tables.bodies), 1)).astype(np.int32)
            look(sim, pair, copied(sim.tables), pairs)

    watch_some(case, see)


def _check_ticks(sim: Simulation, pair: PairParts, aside: Kernel, pairs: Integers) -> None:
    """Compute the contact of each pair again, in other surroundings; raise unless it is the same."""
    k = sim.tables
    expected = _ticks(pair, aside, pairs)
    changed = changed_field(k, aside)
    if changed is not None:
        raise Disagreement(f"at time {sim.time!r} meet wrote {changed}")
    after = _collided(pair, aside, pairs, expected)
    for how, other, numbered in _variants(k, pairs):
        _same_ticks(sim, expected, _ticks(pair, other, numbered), pairs, f"; {how}, ")
        found = _collided(pair, other, numbered, expected)
        found = found if numbered is pairs else found[:, [2, 3, 0, 1]]  # the second comes first there
        for at in np.flatnonzero((found != after).any(axis=1))[:1].tolist():
            said = f"at time {sim.time!r} bodies {pairs[at].tolist()} leave with {after[at].tolist()}"
            raise Disagreement(f"{said}; {how}, with {found[at].tolist()}")


def _same_ticks(sim: Simulation, one: Ticks, other: Ticks, pairs: Integers, how: str) -> None:
    """Raise for the first pair whose contact is at another tick."""
    for at in np.flatnonzero(one != other):
        a, b = pairs[at].tolist()
        said = f"at time {sim.time!r} bodies {a} and {b} meet {said_tick(int(one[at]))}"
        raise Disagreement(f"{said}{how}{said_tick(int(other[at]))}")


SLOWER = (0, 4, 8)
"""By which powers of 1/2 velocities are scaled: bodies then meet late, up to the 1,024 units within which
contacts are foreseen."""


@observation(judges="pair", compares=False)
def its_bounds_are_never_late(case: Case) -> None:
    """No contact is before the bound of `soonest` for its pair, however late it is"""
    parts = case.subject.composition(case.scene).pair
    if parts is None or parts.soonest is None:
        raise DoesNotApply("it has no bounds")

    def look(sim: Simulation, pair: PairParts, k: Kernel, pairs: Integers) -> None:
        for power in SLOWER:
            k.bodies.vx[:] = sim.tables.bodies.vx * 0.5**power
            k.bodies.vy[:] = sim.tables.bodies.vy * 0.5**power
            now, per_time = int(k.clock[0].now), float(k.clock[0].per_time)
            note_all_places(k, now)
            met = _ticks(pair, k, pairs)
            bounds = np.zeros((len(pairs), 4))
            compose(bound_all, {"soonest": pair.soonest}, "conformance", Kernel)(k, pairs, bounds)
            delay = (met - now) * (1.0 + 2.0**-50) / per_time
            late = (bounds.max(axis=1) > delay) & (met >= now) & (met < NEVER)
            late &= bounds.max(axis=1) * per_time >= 1.0  # a bound within this tick is never late
            for at in np.flatnonzero(late):
                a, b = pairs[at].tolist()
                met_after, bound = float(delay[at]), float(bounds[at].max())
                said = f"bodies {a} and {b} meet after {met_after!r}, and the bound is {bound!r}"
                raise Disagreement(f"at time {sim.time!r}, 2^{power} times as slow, {said}")

    _at_some_moments(case, look)


@observation(judges="pair", compares=False)
def discs_meet_at_the_tick_of_the_specification(case: Case) -> None:
    """Where it says that bodies touch at the sum of their radii, they meet at the tick of `disc`"""
    parts = case.subject.composition(case.scene).pair
    if parts is None or parts.contact_distance != "sum of radii":
        raise DoesNotApply("it does not say that bodies touch at the sum of their radii")
    usual = registry().target("narrow phase", "disc")(**GENERAL).prepare(case.scene)

    def look(sim: Simulation, pair: PairParts, k: Kernel, pairs: Integers) -> None:
        _same_ticks(sim, _ticks(pair, k, pairs), _ticks(usual, k, pairs), pairs, "; by the specification ")

    _at_some_moments(case, look)


@observation(judges="wall", compares=False)
def walls_are_met_at_the_tick_of_the_specification(case: Case) -> None:
    """Where it takes `inside_arena`, so that walls are at the arena's edges, bodies meet them at the tick of
    `wall`"""
    (name, options), *_ = case.subject.of_role("wall").items() or [("", {})]
    if case.scene.arena is None or _walls(name, options, case.scene).inside is not inside_arena:
        raise DoesNotApply("it does not say that walls are at the edges of an arena")
    named, usual = (_walls(each, how, case.scene) for each, how in ((name, options), ("wall", GENERAL)))

    def look(sim: Simulation) -> None:
        found, right = (_met_walls(walls, sim.tables) for walls in (named, usual))
        for body in np.flatnonzero((found != right).any(axis=1))[:1].tolist():
            one, other = (f"{WALLS[row[1]]} {said_tick(row[0])}" for row in (found[body], right[body]))
            said = f"at time {sim.time!r} body {body} meets the wall"
            raise Disagreement(f"{said} {one}; by the specification {other}")

    watch_some(case, look)


@observation(judges="pair", compares=False)
def a_contact_adds_no_energy(case: Case) -> None:
    """Two bodies that collide have no more energy than before, but for what rounding adds"""

    def look(sim: Simulation, pair: PairParts, k: Kernel, pairs: Integers) -> None:
        after = _collided(pair, k, pairs, _ticks(pair, k, pairs))
        before = _collided(pair, k, pairs, np.full(len(pairs), NEVER))
        mass = k.mass[pairs].repeat(2, axis=1)
        old, new = ((mass * each**2).sum(axis=1) for each in (before, after))
        for at in np.flatnonzero(new > old * (1.0 + ROUNDED)):
            a, b = pairs[at].tolist()
            said = f"bodies {a} and {b} gain {new[at] / old[at] - 1.0:.3g} of their energy"
            raise Disagreement(f"at time {sim.time!r} {said}")

    _at_some_moments(case, look)


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
    later = copied(k)
    later.clock.now += LATER
    yield "at a later present time", later, pairs
    yield "with nothing in the kernel's other tables", bared(k), pairs
    yield "with the bodies numbered the other way round", renumbered(k), len(k.bodies) - 1 - pairs[:, ::-1]


def bared(k: Kernel) -> Kernel:
    """Return tables with the bodies and the rules of a scene alone."""
    bare = Kernel(*map(np.zeros_like, k))
    for name in ("bodies", "mass", "radii", "sides", "traits", "rules", "numbers"):
        getattr(bare, name)[:] = getattr(k, name)
    bare.bodies.last = NOBODY
    for name in OF_THE_SCENE:
        column(bare.clock, name)[:] = column(k.clock, name)
    return bare


def renumbered(k: Kernel) -> Kernel:
    """Return tables with the bodies the other way round."""
    return copied(k)._replace(**{name: getattr(k, name)[::-1].copy() for name in OF_BODIES})


def copied(k: Kernel) -> Kernel:
    """Return copies of the tables."""
    return Kernel(*(table.copy() for table in k))


def changed_field(k: Kernel, aside: Kernel) -> str | None:
    """Return which field of which table is not as it was, but for a fault, which ``meet`` may report; None:
    none is."""
    for name, before, after in zip(k._fields, k, aside, strict=True):
        for field in fields_in(before.dtype) or [""]:
            one, two = (column(before, field), column(after, field)) if field else (before, after)
            if one.tobytes() != two.tobytes() and not field.startswith("fault"):
                return f"{name}.{field}" if field else name
    return None


def _collided(pair: PairParts, k: Kernel, pairs: Integers, ticks: Ticks) -> npt.NDArray[np.float64]:
    """Return the velocities of both bodies of each pair after their contact at a tick, (m, 4)."""
    found, numbers = np.zeros((len(pairs), 4)), np.ascontiguousarray(pairs, dtype=np.int32)
    compose(collide_all, {"collide": pair.collide}, "conformance", Kernel)(k, numbers, ticks, found)
    return found


def _walls(name: str, options: Mapping[str, Any], scene: Scene) -> WallParts:
    return cast(WallParts, registry().target("narrow phase", name)(**options).prepare(scene))


def _met_walls(walls: WallParts, k: Kernel) -> Ticks:
    """Return (tick, wall) of the next contact of each body with a wall."""
    found = np.zeros((len(k.bodies), 2), np.int64)
    compose(reach_all_walls, {"reach_wall": walls.reach_wall}, "conformance", Kernel)(k, found)
    return found


def _ticks(pair: PairParts, k: Kernel, pairs: Integers) -> npt.NDArray[np.int64]:
    """Return when the bodies of each pair meet."""
    ticks = np.zeros(len(pairs), dtype=np.int64)
    numbers = np.ascontiguousarray(pairs, dtype=np.int32)
    compose(meet_all, {"meet": pair.meet}, "conformance", Kernel)(k, numbers, ticks)
    return ticks


meet = soonest = collide = reach_wall = to_be_filled_in


def reach_all_walls(k: Kernel, found: Ticks) -> None:
    """Write down when each body meets a wall, and which; a template."""
    k = disowned(k)
    for body in range(len(found)):
        found[body, 0], found[body, 1] = reach_wall(k, k.bodies[body])


def bound_all(k: Kernel, pairs: Integers, bounds: npt.NDArray[np.float64]) -> None:
    """Write down the bounds of each pair, from either body, alone and beside the body itself: a narrow phase
    may have another way for one partner than for many; a template."""
    k = disowned(k)
    for i in range(len(pairs)):
        for j in range(4):
            body = pairs[i, j & 1]
            k.near[0] = pairs[i, 1 - (j & 1)]
            k.near[1] = body
            first, _, _ = soonest(k, body, 1 + (j >> 1), NOBODY, k.clock[0].now)
            bounds[i, j] = first


def collide_all(
    k: Kernel, pairs: Integers, ticks: npt.NDArray[np.int64], found: npt.NDArray[np.float64]
) -> None:
    """Write down the velocities of each pair after its contact, and leave all as it was; a template."""
    k = disowned(k)
    for i in range(len(pairs)):
        a, b = pairs[i, 0], pairs[i, 1]
        one, two = k.bodies[a], k.bodies[b]
        x, y, vx, vy, anchor = one.x, one.y, one.vx, one.vy, one.anchor
        u, v, wx, wy, other = two.x, two.y, two.vx, two.vy, two.anchor
        if ticks[i] < NEVER:
            one.x, one.y = position_at(k, one, ticks[i])
            two.x, two.y = position_at(k, two, ticks[i])
            one.anchor = two.anchor = ticks[i]
            collide(k, a, b)
        found[i, 0], found[i, 1], found[i, 2], found[i, 3] = one.vx, one.vy, two.vx, two.vy
        one.x, one.y, one.vx, one.vy, one.anchor = x, y, vx, vy, anchor
        two.x, two.y, two.vx, two.vy, two.anchor = u, v, wx, wy, other


def meet_all(k: Kernel, pairs: Integers, ticks: npt.NDArray[np.int64]) -> None:
    """Write down when the bodies of each pair meet; a template, as ``kernel.loop`` has."""
    k = disowned(k)
    for i in range(len(pairs)):
        ticks[i] = meet(k, pairs[i, 0], pairs[i, 1])
