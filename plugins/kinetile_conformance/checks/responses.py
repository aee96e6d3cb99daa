"""Checks of responses: what a response reads and writes, and whether it adds energy.

All broad phases run a wrong response alike, so no comparison of contacts shows it. Its hook is called for
pairs of bodies, and for bodies and walls, on the kernel's tables and on copies that differ in what it may
not see. The normal is the line between two centres: any is as good as that of a contact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.log import WALLS
from kinetile.kernel.passings import FIRST, rule_of
from kinetile.plugin.registry import registry
from kinetile.run.simulation import Simulation
from kinetile.scene import Response
from kinetile.toolbox import BOTTOM, LEFT, RIGHT, TOP, Kernel
from kinetile_conformance.checks.check import Case, Disagreement, DoesNotApply, observation
from kinetile_conformance.checks.narrow_phases import (
    LATER,
    ROUNDED,
    bared,
    changed_field,
    copied,
    renumbered,
)
from kinetile_conformance.checks.runs import watch_some

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.integer]

NORMALS = {LEFT: (-1.0, 0.0), RIGHT: (1.0, 0.0), BOTTOM: (0.0, -1.0), TOP: (0.0, 1.0)}


ALONE = 4
"""Meetings of a moment that are tried with nobody else there."""


class Meetings(NamedTuple):
    """Who meets whom: (m, 2) numbers, a wall below 0, and (m, 2) normals from the first to the second."""

    who: Integers
    normal: Floats


def _meetings(sim: Simulation, name: str) -> tuple[Any, Meetings]:
    """Return the hook of the response of a name, and the meetings of bodies that approach to which it
    would be the answer; the hook is None where a scene does not use it."""
    rules, k = sim.composition.rules, sim.tables
    rows = [response.name == name for row in sim.scene.meets for response in row]
    if rules is None or not any(rows):
        return None, Meetings(np.zeros((0, 2), np.int64), np.zeros((0, 2)))
    n = len(k.bodies)
    between = np.column_stack(np.triu_indices(n, 1))
    walls = np.array([(body, wall) for body in range(n) for wall in WALLS], np.int64).reshape(-1, 2)
    place, velocity = (np.column_stack([k.bodies[x], k.bodies[y]]) for x, y in (("x", "y"), ("vx", "vy")))
    apart = place[between[:, 1]] - place[between[:, 0]]
    long = np.hypot(*apart.T)
    normal = np.where(long[:, None] > 0.0, apart / np.where(long > 0.0, long, 1.0)[:, None], (1.0, 0.0))
    who = np.concatenate([between, walls])
    normal = np.concatenate([normal, np.array([NORMALS[int(w)] for w in walls[:, 1]]).reshape(-1, 2)])
    other = np.where(who[:, 1:] < 0, 0.0, velocity[np.maximum(who[:, 1], 0)])
    closing = ((velocity[who[:, 0]] - other) * normal).sum(axis=1) > 0.0
    answered = np.array([rows[rule_of(k, a, b)] for a, b in who.tolist()], np.bool_)
    chosen = closing & answered
    number = {int(rules.table[row].response) for row, used in enumerate(rows) if used}.pop()
    hook = rules.hooks[number - FIRST] if number >= FIRST else None
    return hook, Meetings(who[chosen], normal[chosen])


respond = to_be_filled_in


def answer_all(k: Kernel, who: Integers, normal: Floats, found: Floats) -> None:
    """Write down the velocities after each meeting, and leave all as it was; a template."""
    k = disowned(k)
    for i in range(len(who)):
        a, b = who[i, 0], who[i, 1]
        one = k.bodies[a]
        two = k.bodies[b if b >= 0 else a]
        vx, vy, wx, wy = one.vx, one.vy, two.vx, two.vy
        respond(k, a, b, normal[i, 0], normal[i, 1], k.rules[rule_of(k, a, b)])
        found[i, 0], found[i, 1], found[i, 2], found[i, 3] = one.vx, one.vy, two.vx, two.vy
        one.vx, one.vy = vx, vy
        two.vx, two.vy = wx, wy


def _answers(hook: Any, k: Kernel, met: Meetings) -> Floats:
    """Return the velocities after the meetings, (m, 4): of the first, and of the second; with a wall, twice
    the first's."""
    found = np.zeros((len(met.who), 4))
    who, normal = np.ascontiguousarray(met.who, np.int64), np.ascontiguousarray(met.normal)
    compose(answer_all, {"respond": hook}, "conformance", Kernel)(k, who, normal, found)
    return found


def _variants(k: Kernel, met: Meetings, answers: Floats) -> Iterator[tuple[str, Kernel, Meetings, Floats]]:
    """Yield a difference in words, tables with it, the meetings there, and the answers they must have."""
    later = copied(k)
    for ticks in (later.clock.now, later.bodies.anchor, later.traits.touched):
        ticks += LATER
    yield "with another base of the clock", later, met, answers
    bare = bared(k)
    bare.clock.now[:] = k.clock.now
    yield "with nothing in the kernel's other tables", bare, met, answers
    n = len(k.bodies)
    numbers = np.where(met.who < 0, met.who, n - 1 - met.who)
    yield "with the bodies numbered the other way round", renumbered(k), met._replace(who=numbers), answers
    pairs = met.who[:, 1] >= 0
    exchanged = Meetings(met.who[pairs, ::-1], -met.normal[pairs])
    yield "with the two exchanged", k, exchanged, answers[pairs][:, [2, 3, 0, 1]]
    for at in range(0, len(met.who), 1 + len(met.who) // ALONE):
        alone, others = copied(k), np.setdiff1d(np.arange(n), met.who[at])
        for table in (alone.bodies, alone.mass, alone.radii, alone.traits):
            table[others] = np.zeros(1, table.dtype)[0]
        yield "with nobody else there", alone, Meetings(met.who[[at]], met.normal[[at]]), answers[[at]]


def _before(k: Kernel, met: Meetings) -> tuple[Floats, Floats]:
    """Return the masses of those that meet, (m, 2), and their velocities, as ``_answers`` has them. A wall is
    an immovable body at rest."""
    who, wall = np.maximum(met.who, 0), met.who < 0
    mass = np.where(wall, math.inf, k.mass[who])
    vx, vy = (np.where(wall, 0.0, column[who]) for column in (k.bodies.vx, k.bodies.vy))
    return mass, np.column_stack([vx[:, 0], vy[:, 0], vx[:, 1], vy[:, 1]])


def _energies(mass: Floats, velocity: Floats, frame: Floats) -> Floats:
    """Return twice the energy of each two that meet; as an immovable one sees it, where one is."""
    weights = np.where(np.isinf(mass), np.where(np.isinf(mass).all(axis=1), 1.0, 0.0)[:, None], mass)
    return np.asarray((weights * ((velocity - frame) ** 2).reshape(-1, 2, 2).sum(axis=2)).sum(axis=1))


def _at_some_moments(case: Case, look: Callable[[Any, Simulation, Meetings], None]) -> None:
    """Call a function with the hook of the response under test, a simulation at some moments of a run, and
    who may meet there. Raises DoesNotApply where the kernel itself answers."""
    name = cast(Response, case.subject.response).name
    parts = registry().target("response", name)(**cast(Response, case.subject.response).options)
    if parts.prepare(case.scene).respond is None:
        raise DoesNotApply("the kernel itself answers")

    def see(sim: Simulation) -> None:
        hook, met = _meetings(sim, name)
        if hook is not None and len(met.who):
            look(hook, sim, met)

    watch_some(case, see)


@observation(judges="response", compares=False)
def a_response_depends_on_the_meeting_alone(case: Case) -> None:
    """A response gives new velocities to the two that meet, by these two and the normal: the base of the
    clock, other bodies, the numbers of the two and their order make no difference. It changes nothing else,
    and no immovable body that meets a movable one"""

    def look(hook: Any, sim: Simulation, met: Meetings) -> None:
        k = sim.tables
        aside = copied(k)
        answers = _answers(hook, aside, met)
        if (changed := changed_field(k, aside)) is not None:
            raise Disagreement(f"at time {sim.time!r} respond wrote {changed}")
        mass, before = _before(k, met)
        alone = np.isinf(mass) & ~np.isinf(mass).all(axis=1, keepdims=True) & (met.who >= 0)
        pushed = alone.repeat(2, axis=1) & (answers != before)
        for a, b in met.who[pushed.any(axis=1)].tolist():
            raise Disagreement(
                f"at time {sim.time!r} one of {a} and {b} is immovable, and gets another velocity"
            )
        for how, tables, again, expected in _variants(k, met, answers):
            found = _answers(hook, copied(tables), again)
            for at in np.flatnonzero((found != expected).any(axis=1)):
                a, b = again.who[at].tolist()
                with_whom = f"body {b}" if b >= 0 else f"the {WALLS[b]} wall"
                said = f"at time {sim.time!r} body {a} and {with_whom} leave with {expected[at].tolist()}"
                raise Disagreement(f"{said}; {how}, with {found[at].tolist()}")

    _at_some_moments(case, look)


@observation(judges="response", compares=False)
def a_response_adds_no_energy_that_says_so(case: Case) -> None:
    """A response that declares the feature `dissipative` adds no energy, but for what rounding adds: of two,
    or of one as an immovable body or a wall sees it"""
    name = cast(Response, case.subject.response).name
    if "dissipative" not in registry().spec("response", name).features:
        raise DoesNotApply("it does not declare the feature 'dissipative'")

    def look(hook: Any, sim: Simulation, met: Meetings) -> None:
        mass, velocity = _before(sim.tables, met)
        heavy = np.isinf(mass).repeat(2, axis=1)
        heavy &= ~heavy.all(axis=1, keepdims=True)  # two immovable ones are alike
        shared = np.where(heavy, velocity, 0.0)
        frame = np.tile(shared[:, :2] + shared[:, 2:], 2)
        before, after, most = (
            _energies(mass, each, of)
            for each, of in (
                (velocity, frame),
                (np.where(heavy, velocity, _answers(hook, copied(sim.tables), met)), frame),
                (np.abs(velocity), -np.abs(frame)),
            )
        )
        for at in np.flatnonzero(after > before + ROUNDED * most):
            a, b = met.who[at].tolist()
            more = after[at] / before[at] - 1.0
            raise Disagreement(f"at time {sim.time!r} a meeting of {a} and {b} adds {more:.3g} of energy")

    _at_some_moments(case, look)
