"""Observations of narrow phases and responses: the answers of their hooks for the meetings of a moment.

All broad phases run a wrong narrow phase or response alike, so no comparison of contacts shows it. A hook is
called again on copies of the kernel's tables that differ in irrelevant values. Its answers are compared with
the answers of another hook, or with the allowed answers. At each moment bodies also get drawn velocities: the
velocities of the scenes are dyadic, and their grazes have few depths.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import combinations, product
from typing import Any, NamedTuple, cast

import numpy as np

from kinetile import Response, Scene, Simulation, registry, toolbox
from kinetile.arrays import Array, Flags, Floats, Integers
from kinetile.errors import ZenoError
from kinetile.instruments import (
    FIRST,
    TICKS,
    column,
    compose,
    composition_of,
    disowned,
    fields_in,
    note_all_places,
    position_at,
    rule_of,
    said_tick,
    to_be_filled_in,
)
from kinetile.toolbox import BOTTOM, LEFT, NEVER, NOBODY, RIGHT, TOP, WALLS, Kernel, PairParts, WallParts
from kinetile_conformance.cases import GENERAL, difference, horizon, outcome
from kinetile_conformance.checks.check import Case, Disagreement, DoesNotApply, compare, observation
from kinetile_conformance.checks.runs import EVERY, STEPS, watch

Ticks = Integers

ROUNDED = 2.0**-44
"""The part of the energy, or of all speeds, that rounding may add."""

ALONE = 4
"""Meetings of a moment that are tried without any other body."""

LATER = 2**44 + 977
"""Ticks, some 1/256 of a time unit, and odd: computations from this tick are rounded differently."""

NORMALS = {LEFT: (-1.0, 0.0), RIGHT: (1.0, 0.0), BOTTOM: (0.0, -1.0), TOP: (0.0, 1.0)}

OF_THE_SCENE = ("bodies", "mass", "radii", "sides", "traits", "rules", "numbers")
OF_BODIES = ("bodies", "mass", "radii", "sides", "places", "queue", "traits")
CLOCK = (
    *("now", "per_tick", "per_time", "epoch", "kinds"),
    *(f"limits.{name}" for name in ("skin", "theta", "tolerance", "width", "height", "fat")),
)
"""Tables of a scene, tables with a row for each body, and the clock's fields of a scene."""


class Met(NamedTuple):
    """Meetings, and the answers for them; None is not compared. ``who`` has the two bodies, (m, 2), a wall
    below 0; ``normal`` leads to the second, (m, 2); ``ticks``, (m,); ``after`` has the velocities, (m, 4)."""

    who: Integers
    normal: Floats | None = None
    ticks: Ticks | None = None
    after: Floats | None = None

    def in_words(self, at: int) -> str:
        """Returns a meeting in words."""
        a, b = self.who[at].tolist()
        text = f"body {a} and " + (f"body {b}" if b >= 0 else f"the {WALLS[b]} wall")
        when = "" if self.ticks is None else f"meet {said_tick(int(self.ticks[at]))}"
        then = "" if self.after is None else f"leave with {self.after[at].tolist()}"
        return f"{text} {' and '.join(each for each in (when, then) if each)}"

    def check(self, at: "PairMoment", found: "Met", how: str) -> None:
        """Raises for the first meeting with another answer; ``how`` says by which hook, or where."""
        differs = np.zeros(len(self.who), np.bool_)
        for one, other in zip(self, found, strict=True):
            if one is not None and other is not None:
                differs |= (one != other).reshape(len(one), -1).any(axis=1)
        for row in np.flatnonzero(differs)[:1].tolist():
            raise Disagreement(f"{at.when} {self.in_words(row)}; {how}, {found.in_words(row)}")

    def exchanged(self) -> "Met":
        """Returns the meetings with the second body as the first; walls stay the second."""
        two = self.who[:, 1:] >= 0
        normal = None if self.normal is None else np.where(two, -self.normal, self.normal)
        after = None if self.after is None else np.where(two, self.after[:, [2, 3, 0, 1]], self.after)
        return Met(np.where(two, self.who[:, ::-1], self.who), normal, self.ticks, after)

    def turned(self, bodies: int) -> "Met":
        """Returns the meetings with the bodies' numbers reversed; the lower number is first."""
        return self._replace(who=np.where(self.who < 0, self.who, bodies - 1 - self.who)).exchanged()


Answer = Callable[[Kernel, Met], Met]
"""Returns meetings with the answers of a hook, which leaves the tables unchanged."""


class PairMoment(NamedTuple):
    """A moment of a run, in words, and its tables, perhaps with other velocities of bodies."""

    sim: Simulation
    when: str
    tables: Kernel


SLOWER = (4, 8)
"""Powers of 1/2 that scale velocities: bodies then meet late, up to 1,024 units from now."""

DRAWN = 4
"""Draws of other velocities for a moment."""

GRAZES = 40
"""The most halvings of the depth of a graze."""


def _moments(sim: Simulation, random: np.random.Generator) -> Iterator[PairMoment]:
    """Yields a moment unchanged; with slower bodies; and, if paths are straight, with drawn velocities."""
    yield PairMoment(sim, f"at time {sim.time!r}", sim.tables)
    for power in SLOWER:
        k = copied(sim.tables)
        k.bodies.vx *= 0.5**power
        k.bodies.vy *= 0.5**power
        note_all_places(k, int(k.clock[0].now))
        yield PairMoment(sim, f"at time {sim.time!r}, 2^{power} times as slow,", k)
    fast = np.hypot(sim.tables.bodies.vx, sim.tables.bodies.vy).max(initial=0.0)
    for _ in range(0 if sim.scene.accelerated or sim.scene.periodic or fast == 0.0 else DRAWN):
        k = copied(sim.tables)
        place, velocity = toolbox.positions_now(k), fast * random.uniform(-0.5, 0.5, (len(k.bodies), 2))
        # The first half of these bodies just touch, or hardly overlap, one of the others as they pass.
        one, two = random.permutation(len(place) // 2 * 2).reshape(2, -1)
        apart, reach = place[two] - place[one], k.bodies.radius[one] + k.bodies.radius[two]
        aside = reach * (1.0 - 0.5 ** random.uniform(0.0, GRAZES, len(one))) / np.hypot(*apart.T)
        way = np.arctan2(*apart.T[::-1]) + random.choice([-1.0, 1.0], len(one)) * np.arcsin(
            np.minimum(aside, 1.0)
        )
        velocity[one] = velocity[two] + 0.25 * fast * np.column_stack([np.cos(way), np.sin(way)])
        k.bodies.x, k.bodies.y = place.T
        k.bodies.vx, k.bodies.vy = velocity.T
        k.bodies.anchor, k.bodies.last = k.clock[0].now, NOBODY
        note_all_places(k, int(k.clock[0].now))
        yield PairMoment(sim, f"at time {sim.time!r}, with the velocities {velocity.tolist()},", k)


def _at_some_moments(
    case: Case,
    meetings: Callable[[PairMoment], tuple[Answer, Met] | None],
    look: Callable[[PairMoment, Answer, Met], object],
) -> None:
    """Calls a function with some moments of a run, and with a function that answers meetings there."""
    random = np.random.default_rng(len(case.scene))

    def see(sim: Simulation) -> None:
        for moment in _moments(sim, random):
            found = meetings(moment)
            if found is not None:
                look(moment, *found)

    watch(case, see, steps=2 * STEPS, every=EVERY)


def _pairs(at: PairMoment) -> tuple[Answer, Met] | None:
    pair, two = composition_of(at.sim).pair, np.column_stack(np.triu_indices(len(at.tables.bodies), 1))
    return None if pair is None else (partial(_met, pair), Met(two.astype(np.int32)))


def _met(pair: PairParts, k: Kernel, met: Met) -> Met:
    ticks, after = np.zeros(len(met.who), np.int64), np.zeros((len(met.who), 4))
    who = np.ascontiguousarray(met.who, np.int32)
    _call(meet_all, k, who, ticks, after, meet=pair.meet, collide=pair.collide)
    return met._replace(ticks=ticks, after=after)


@observation(judges="pair", compares=False)
def a_contact_depends_on_two_plans_alone(case: Case) -> None:
    """The tick of a contact, and the velocities after it, follow from two flight plans: the present time, the
    numbers of the bodies and what else the kernel holds make no difference, and computing a tick changes
    nothing"""
    _at_some_moments(case, _pairs, partial(_check_surroundings, "meet or collide", ("clock.now",)))


@observation(judges="pair", compares=False)
def its_bounds_are_never_late(case: Case) -> None:
    """No contact is before the bound of `soonest` for its pair, however late it is"""
    parts = case.subject.composition(case.scene).pair
    if parts is None or parts.soonest is None:
        raise DoesNotApply("it has no bounds")

    def look(at: PairMoment, answer: Answer, met: Met) -> None:
        k, bound = copied(at.tables), np.zeros(len(met.who))
        now, per_time = int(k.clock[0].now), float(k.clock[0].per_time)
        note_all_places(k, now)
        _call(bound_all, k, met.who, bound, soonest=parts.soonest)
        ticks = cast(Ticks, answer(k, met).ticks)
        delay = (ticks - now) * (1.0 + 2.0**-50) / per_time
        # A bound within this tick is never late.
        late = (bound > delay) & (ticks >= now) & (ticks < NEVER) & (bound * per_time >= 1.0)
        if case.scene.accelerated:  # up to the end of the chord of either
            late &= ticks < k.bodies.end[met.who].min(axis=1)
        for row in np.flatnonzero(late)[:1].tolist():
            text = f"bodies {met.who[row].tolist()} meet after {delay[row].item()!r}"
            raise Disagreement(f"{at.when} {text}, and the bound is {bound[row].item()!r}")

    _at_some_moments(case, _pairs, look)


@observation(judges="pair", compares=False)
def discs_meet_at_the_tick_of_the_specification(case: Case) -> None:
    """Where it says that bodies touch at the sum of their radii, they meet at the tick of `disc`"""
    parts = case.subject.composition(case.scene).pair
    if parts is None or parts.contact_distance != "sum of radii":
        raise DoesNotApply("it does not say that bodies touch at the sum of their radii")
    usual = partial(_met, registry().target("narrow phase", "disc")(**GENERAL).prepare(case.scene))

    def look(at: PairMoment, answer: Answer, met: Met) -> None:
        found, right = (each(copied(at.tables), met)._replace(after=None) for each in (answer, usual))
        found.check(at, right, "by the specification")

    _at_some_moments(case, _pairs, look)


@observation(judges="wall", compares=False)
def walls_are_met_at_the_tick_of_the_specification(case: Case) -> None:
    """Where it takes `inside_arena`, so that walls are at the arena's edges, bodies meet them at the tick of
    `wall`"""
    (name, options), *_ = case.subject.of_role("wall").items() or [("", {})]
    inside = toolbox.inside_accelerated if case.scene.accelerated else toolbox.inside_arena
    if case.scene.arena is None or _walls(name, options, case.scene).inside is not inside:
        raise DoesNotApply("it does not say that walls are at the edges of an arena")
    named, usual = (_walls(each, how, case.scene) for each, how in ((name, options), ("wall", GENERAL)))

    def walls(at: PairMoment) -> tuple[Answer, Met]:
        return lambda k, _: _met_walls(named, k), _met_walls(usual, at.tables)

    def look(at: PairMoment, answer: Answer, met: Met) -> None:
        answer(at.tables, met).check(at, met, "by the specification")

    _at_some_moments(case, walls, look)


def _walls(name: str, options: Mapping[str, Any], scene: Scene) -> WallParts:
    return cast(WallParts, registry().target("narrow phase", name)(**options).prepare(scene))


def _met_walls(walls: WallParts, k: Kernel) -> Met:
    found = np.zeros((len(k.bodies), 2), np.int64)
    _call(reach_all_walls, k, found, reach_wall=walls.reach_wall)
    return Met(np.column_stack([np.arange(len(found)), found[:, 1]]), ticks=found[:, 0])


@observation(judges="pair", compares=False)
def a_contact_adds_no_energy(case: Case) -> None:
    """Two bodies that collide have no more energy than before, but for what rounding adds"""
    _at_some_moments(case, _pairs, _check_energy)


@observation(judges="pair")
def same_contacts_as_convex(case: Case) -> None:
    """Where it takes bodies of other shapes, its contacts, and all places and velocities at the end, are
    those of `convex`, under the reference and under this broad phase"""
    subject = case.subject
    compare(case, outcome(subject, case.scene, case.contacts))
    convex = replace(subject, narrow=subject.of_role("wall") | {"convex": {}}).reference
    found, expected = (  # not the depths of overlaps, nor the sign of a zero
        replace(run, tables={}, positions=run.positions + 0.0, velocities=run.velocities + 0.0)
        for run in (case.expected, outcome(convex, case.scene))
    )
    text = difference(found, expected, str(subject.pair))
    if text is not None:
        raise Disagreement(f"compared with convex, {text}")


def _meetings(name: str, at: PairMoment) -> tuple[Answer, Met] | None:
    """Returns the response of a name, and the meetings of approaching bodies that it answers."""
    rules, k = composition_of(at.sim).rules, at.tables
    rows = [response.name == name for row in at.sim.scene.meets for response in row]
    if rules is None or not any(rows):
        return None
    bodies = range(len(k.bodies))
    two = [*combinations(bodies, 2), *product(bodies, WALLS)]
    who = np.array([(a, b) for a, b in two if rows[rule_of(k, a, b)]], np.int64).reshape(-1, 2)
    normal = np.array([_normal(k, a, b) for a, b in who.tolist()]).reshape(-1, 2)
    *_, velocity = _before(k, who)
    closing = ((velocity[:, :2] - velocity[:, 2:]) * normal).sum(axis=1) > 0.0
    number = {int(rules.table[row].response) for row, used in enumerate(rows) if used}.pop()
    if number < FIRST or not closing.any():
        return None
    return partial(_answered, rules.hooks[number - FIRST]), Met(who[closing], normal[closing])


def _normal(k: Kernel, a: int, b: int) -> tuple[float, float]:
    """Returns the direction from one centre to the other, or to a wall: any is as good."""
    if b < 0:
        return NORMALS[b]
    x, y = (float(k.bodies[b][axis] - k.bodies[a][axis]) for axis in ("x", "y"))
    long = math.hypot(x, y)
    return (x / long, y / long) if long > 0.0 else (1.0, 0.0)


def _answered(hook: Any, k: Kernel, met: Met) -> Met:
    """Returns the velocities after the meetings; with a wall, the first body's velocity twice."""
    after = np.zeros((len(met.who), 4))
    _call(answer_all, k, np.ascontiguousarray(met.who), np.ascontiguousarray(met.normal), after, respond=hook)
    return met._replace(after=after)


@observation(judges="response", compares=False)
def a_response_depends_on_the_meeting_alone(case: Case) -> None:
    """A response gives new velocities to the two that meet, by these two and the normal: the base of the
    clock, other bodies, the numbers of the two and their order make no difference. It changes nothing else,
    and no immovable body that meets a movable one, and the two do not go on towards each other"""

    def look(at: PairMoment, answer: Answer, met: Met) -> None:
        moved = "clock.now", "bodies.anchor", "traits.touched"
        found = _check_surroundings("respond", moved, at, answer, met)
        exchanged = answer(copied(at.tables), found.exchanged()).exchanged()
        found.check(at, exchanged, "with the two exchanged")
        _, heavy, old = _before(at.tables, met.who)
        pushed = heavy & (met.who >= 0).repeat(2, axis=1) & (found.after != old)
        for a, b in met.who[pushed.any(axis=1)].tolist():
            text = f"{at.when} one of {a} and {b} is immovable"
            raise Disagreement(f"{text}, and gets another velocity")
        after = np.where(met.who.repeat(2, axis=1) < 0, 0.0, cast(Floats, found.after))
        closing = ((after[:, :2] - after[:, 2:]) * met.normal).sum(axis=1)
        most = np.where(met.who[:, 1] < 0, 0.0, ROUNDED * (abs(old) + abs(after)).sum(axis=1))
        for a, b in met.who[closing > most].tolist():
            raise Disagreement(f"{at.when} {a} and {b} go on towards each other after it")

    _at_some_moments(case, partial(_meetings, _response(case)[0]), look)


@observation(judges="response", compares=False)
def a_response_adds_no_energy_that_says_so(case: Case) -> None:
    """A response that declares the feature `dissipative` adds no energy, but for what rounding adds: of two,
    or of one as an immovable body or a wall sees it"""
    name, _ = _response(case, "dissipative")
    _at_some_moments(case, partial(_meetings, name), _check_energy)


@observation(judges="response", compares=False)
def nobody_is_faster_after_a_contact(case: Case) -> None:
    """In a run under a response that declares the feature `dissipative`, a contact adds no energy, but for a
    least hop of two that are pressed together, and for what rounding adds"""
    _, parts = _response(case, "dissipative")
    sim = case.subject.simulation(case.scene)
    lasting = max(parts.contact_time, 2.0**-14 * case.scene.time_unit)  # walls may have the default
    sim.build()
    before = copied(sim.tables)
    with suppress(ZenoError):  # a jam ends the run
        for event in sim.steps(horizon(case.scene)):
            after = copied(sim.tables)
            if event.kind in ("disc", "wall"):
                who = np.array([[*after.slots[list(event.bodies)], LEFT][:2]])
                _check_hop(PairMoment(sim, f"at time {sim.time!r}", before), after, who, lasting)
            if len(sim.contacts) >= case.contacts:
                return
            before = after


def _check_hop(at: PairMoment, after: Kernel, who: Integers, lasting: float) -> None:
    """Raises if bodies that have met gain more than a least hop; anchors their plans before that."""
    k, now = at.tables, after.clock[0]
    since = (now.now - k.bodies.anchor + (now.epoch - k.clock[0].epoch) * TICKS) * now.per_tick
    k.bodies.vx += k.bodies.ax * since
    k.bodies.vy += k.bodies.ay * since
    pull = np.column_stack([k.bodies.ax, k.bodies.ay])[who[0]] * (who.T >= 0)
    met = Met(who, after=_before(after, who)[2])
    _check_energy(at, lambda *_: met, met, 0.5 * lasting * math.hypot(*(pull[0] - pull[1])))


def _response(case: Case, feature: str = "") -> tuple[str, toolbox.ResponseParts]:
    """Returns the response's name and its parts; raises DoesNotApply if it does not declare a feature."""
    response = cast(Response, case.subject.response)
    parts = registry().target("response", response.name)(**response.options).prepare(case.scene)
    if parts.respond is None:
        raise DoesNotApply("the kernel itself answers")
    if feature and feature not in registry().spec("response", response.name).features:
        raise DoesNotApply(f"it does not declare the feature {feature!r}")
    return response.name, parts


def _check_surroundings(hook: str, moved: tuple[str, ...], at: PairMoment, answer: Answer, met: Met) -> Met:
    """Returns the answers of a hook; raises if it writes to a table, except to report a fault, or if its
    answers differ in other surroundings. ``moved`` names the ticks that are moved together."""
    k = copied(at.tables)
    right = answer(k, met)
    for name, was, table in zip(k._fields, at.tables, k, strict=True):
        for field in fields_in(was.dtype) or [""]:
            one, two = (column(was, field), column(table, field)) if field else (was, table)
            if one.tobytes() != two.tobytes() and not field.startswith("fault"):
                raise Disagreement(f"{at.when} {hook} wrote {name}.{field}".rstrip("."))
    for how, tables, expected in _surroundings(k, right, moved):
        expected.check(at, answer(tables, expected), how)
    turned = copied(k)._replace(**{name: getattr(k, name)[::-1].copy() for name in OF_BODIES})
    found = answer(turned, right.turned(len(k.bodies))).turned(len(k.bodies))
    right.check(at, found, "with the bodies numbered the other way round")
    return right


def _surroundings(k: Kernel, met: Met, moved: tuple[str, ...]) -> Iterator[tuple[str, Kernel, Met]]:
    """Yields a difference in words, tables with it, and meetings there."""
    later = copied(k)
    for name in moved:
        table, _, field = name.partition(".")
        column(getattr(later, table), field)[:] += LATER
    yield "at a later present time", later, met
    bare = Kernel(*map(np.zeros_like, k))
    for name in OF_THE_SCENE:
        getattr(bare, name)[:] = getattr(k, name)
    bare.bodies.last = NOBODY
    for name in CLOCK:
        column(bare.clock, name)[:] = column(k.clock, name)
    yield "with nothing in the kernel's other tables", bare, met
    for at in range(0, len(met.who), 1 + len(met.who) // ALONE):
        alone, others = copied(k), np.setdiff1d(np.arange(len(k.bodies)), met.who[at])
        for name in ("bodies", "mass", "radii", "traits"):
            rows = getattr(alone, name)
            rows[others[: len(rows)]] = np.zeros(1, rows.dtype)[0]  # some tables have no fields
        one = Met(*(cast(Any, each if each is None else each[[at]]) for each in met))
        yield "with nobody else there", alone, one


def copied(k: Kernel) -> Kernel:
    """Returns copies of the tables."""
    return Kernel(*(table.copy() for table in k))


def _before(k: Kernel, who: Integers) -> tuple[Floats, Flags, Floats]:
    """Returns the masses of two that meet, True for one that the other cannot move, and their velocities, (m,
    4) each. A wall is an immovable body at rest, also for another; two immovable bodies have equal masses."""
    body, wall = np.maximum(who, 0), who < 0
    mass = np.where(wall, math.inf, k.mass[body]).repeat(2, axis=1)
    heavy = np.isinf(mass)
    mass, heavy = np.where(heavy, 1.0, mass), heavy & (~heavy.all(axis=1, keepdims=True) | wall.repeat(2, 1))
    vx, vy = (np.where(wall, 0.0, speeds[body]) for speeds in (k.bodies.vx, k.bodies.vy))
    return mass, heavy, np.stack([vx, vy], axis=2).reshape(-1, 4)


def _check_energy(at: PairMoment, answer: Answer, met: Met, hop: float = 0.0) -> None:
    """Raises if two that meet gain more energy than rounding adds, relative to an immovable one of them, and
    more than the energy of parting at the speed ``hop``."""
    mass, heavy, old = _before(at.tables, met.who)
    shared = np.where(heavy, old, 0.0)
    frame = np.tile(shared[:, :2] + shared[:, 2:], 2)
    after = cast(Floats, answer(copied(at.tables), met).after)
    speeds = old - frame, np.where(heavy, old, after) - frame, np.abs(old) + np.abs(frame)
    had, has, most = (np.where(heavy, 0.0, mass * each**2).sum(axis=1) for each in speeds)
    least = hop**2 / np.where(heavy, 0.0, 1.0 / mass)[:, ::2].sum(axis=1)
    for row in np.flatnonzero(has > had + least + ROUNDED * (most + least))[:1].tolist():
        more = f"{has[row] / had[row] - 1.0 if had[row] else math.inf:.3g} of energy"
        raise Disagreement(f"{at.when} a meeting of {met.who[row].tolist()} adds {more}")


# Templates, as ``kernel.loop`` has them: each leaves all bodies as they were.

meet = soonest = collide = reach_wall = respond = to_be_filled_in


def _call(template: Any, k: Kernel, *arrays: Array, **hooks: Any) -> None:
    compose(template, hooks, "conformance", Kernel)(k, *arrays)


def meet_all(k: Kernel, pairs: Integers, ticks: Ticks, after: Floats) -> None:
    """Writes the ticks at which the bodies of each pair meet, and their velocities after that contact."""
    k = disowned(k)
    for i in range(len(pairs)):
        a, b = pairs[i, 0], pairs[i, 1]
        one, two = k.bodies[a], k.bodies[b]
        x, y, vx, vy, anchor = one.x, one.y, one.vx, one.vy, one.anchor
        u, v, wx, wy, other = two.x, two.y, two.vx, two.vy, two.anchor
        ticks[i] = meet(k, a, b)
        if ticks[i] < NEVER:
            one.x, one.y = position_at(k, one, ticks[i])
            two.x, two.y = position_at(k, two, ticks[i])
            one.anchor = two.anchor = ticks[i]
            collide(k, a, b)
        after[i, 0], after[i, 1], after[i, 2], after[i, 3] = one.vx, one.vy, two.vx, two.vy
        one.x, one.y, one.vx, one.vy, one.anchor = x, y, vx, vy, anchor
        two.x, two.y, two.vx, two.vy, two.anchor = u, v, wx, wy, other


def bound_all(k: Kernel, pairs: Integers, bounds: Floats) -> None:
    """Writes the latest bound of each pair, from either body, alone and beside the body itself."""
    k = disowned(k)
    for i in range(len(pairs)):
        bounds[i] = 0.0
        for j in range(4):
            body = pairs[i, j & 1]
            k.near[0] = pairs[i, 1 - (j & 1)]
            k.near[1] = body
            first, _, _ = soonest(k, body, 1 + (j >> 1), NOBODY, k.clock[0].now)
            bounds[i] = max(bounds[i], first)


def reach_all_walls(k: Kernel, found: Ticks) -> None:
    """Writes the tick at which each body meets a wall, and the wall."""
    k = disowned(k)
    for body in range(len(found)):
        found[body, 0], found[body, 1] = reach_wall(k, k.bodies[body])


def answer_all(k: Kernel, who: Integers, normal: Floats, after: Floats) -> None:
    """Writes the velocities after each meeting."""
    k = disowned(k)
    for i in range(len(who)):
        a, b = who[i, 0], who[i, 1]
        one = k.bodies[a]
        two = k.bodies[b if b >= 0 else a]
        vx, vy, wx, wy = one.vx, one.vy, two.vx, two.vy
        respond(k, a, b, normal[i, 0], normal[i, 1], k.rules[rule_of(k, a, b)])
        after[i, 0], after[i, 1], after[i, 2], after[i, 3] = one.vx, one.vy, two.vx, two.vy
        one.vx, one.vy = vx, vy
        two.vx, two.vy = wx, wy
