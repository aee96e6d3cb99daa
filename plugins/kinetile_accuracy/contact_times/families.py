"""Hard families of queries: when do these two discs meet?

A family is drawn from a seed of its own. Lengths are those of a unit box with radii of 1/200 to 1/20, speeds
about 1, and the unit of time is 1, unless a family has other values. All values are rounded to
doubles, and those doubles are the query: whether the discs meet, and when, is computed by ``encounter``.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from kinetile_accuracy.specification.arithmetic import (
    SPAN,
    UNIT_TICKS,
    FlightPlan,
    Frame,
    exchanged,
    pair_tick,
)

Floats = npt.NDArray[np.float64]
Ticks = npt.NDArray[np.int64]
Draws = np.random.Generator
Range = tuple[float, float]

UNIT = Frame(None, 0)
"""No arena, and a unit of time of 1."""

TIED = 8
"""How many queries have the same exact time in the families of simultaneous contacts."""

LATER = SPAN - 2 * UNIT_TICKS
"""By how many ticks the late clock is later: as late as the kernel's clock gets before its base moves on."""


@dataclass(frozen=True, eq=False)
class Queries:
    """The flight plans of m pairs of discs.

    Attributes:
        position, velocity: (m, 2, 2), by query, disc and axis; the position is that at the disc's anchor.
        radius: (m, 2).
        anchor: (m, 2), in ticks of 2^-52.
        tied: this many successive queries have exactly the same time of contact.
    """

    position: Floats
    velocity: Floats
    radius: Floats
    anchor: Ticks
    tied: int = 1

    def __len__(self) -> int:
        return len(self.radius)

    def plans(self) -> list[tuple[FlightPlan, FlightPlan]]:
        """Returns the flight plans of every pair."""

        def of(disc: int) -> list[FlightPlan]:
            place, velocity = self.position[:, disc].T, self.velocity[:, disc].T
            columns = *place, *velocity, self.anchor[:, disc], self.radius[:, disc]
            rows = zip(*(column.tolist() for column in columns), strict=True)
            return [FlightPlan(x, y, vx, vy, anchor, radius, UNIT) for x, y, vx, vy, anchor, radius in rows]

        return list(zip(of(0), of(1), strict=True))


@dataclass(frozen=True)
class Family:
    """Queries of one kind.

    Attributes:
        name, about: what makes them hard, in a word and in a phrase.
        sampler: draws this many of them.
        like: the name of the family whose random numbers it takes; None: its own.
    """

    name: str
    about: str
    sampler: Callable[[Draws, int], Queries]
    like: str | None = None

    def draw(self, count: int) -> Queries:
        """Returns ``count`` queries, always the same."""
        return self.sampler(np.random.default_rng(zlib.crc32((self.like or self.name).encode())), count)


# Pairs that are aimed at each other: what most families are made of


def aimed(
    radius: Floats, base: Floats, drift: Floats, course: Floats, speed: Floats, run: Floats, miss: Floats
) -> Queries:
    """Returns pairs by their encounter: (m,) arrays, but radius, base, drift (m, 2).

    The first disc is at ``base`` with velocity ``drift``. The second comes with ``speed`` relative to it, in
    direction ``course``; it is nearest after a way of ``run``, and would then pass at distance ``miss``.
    """
    along = np.column_stack([np.cos(course), np.sin(course)])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    apart = miss[:, None] * across - run[:, None] * along
    position = np.stack([base, base + apart], axis=1)
    velocity = np.stack([drift, drift + speed[:, None] * along], axis=1)
    return Queries(position, velocity, radius, np.zeros((len(radius), 2), dtype=np.int64))


def usual(
    draws: Draws,
    count: int,
    run: Range | Callable[[Floats], Floats],
    miss: Range | Callable[[Floats], Floats],
    spread: float | None = None,
) -> Queries:
    """Returns pairs that are usual but for ``run`` and ``miss``.

    Each is a range of multiples of the sum of the radii, or a function of that sum. ``spread`` is within how
    many such sums of the origin the first disc is; None: in the unit box.
    """
    radius = draws.uniform(0.005, 0.05, (count, 2))
    reach = radius.sum(axis=1)

    def way(given: Range | Callable[[Floats], Floats]) -> Floats:
        return given(reach) if callable(given) else reach * draws.uniform(*given, count)

    base = draws.uniform(-0.5, 0.5, (count, 2))
    return aimed(
        radius,
        base if spread is None else base * (2.0 * spread * reach[:, None]),
        draws.uniform(-0.7, 0.7, (count, 2)),
        draws.uniform(0.0, 2.0 * np.pi, count),
        draws.uniform(0.1, 1.0, count),
        way(run),
        way(miss),
    )


def generic(draws: Draws, count: int) -> Queries:
    """Returns pairs 2 to 20 R away, about half of which meet."""
    return usual(draws, count, (2.0, 20.0), (-2.0, 2.0))


# The families


def _grazing(draws: Draws, count: int) -> Queries:
    off = 1.0 + 1e-12 * draws.uniform(-1.0, 1.0, count)
    return usual(
        draws, count, lambda reach: reach * 10.0 ** draws.uniform(0.2, 2.0, count), lambda reach: reach * off
    )


def _grazing_by_ulps(draws: Draws, count: int) -> Queries:
    def miss(reach: Floats) -> Floats:
        return reach * (1.0 + draws.integers(-4, 5, count) * 2.0**-52)

    return usual(draws, count, (1.5, 4.0), miss, spread=1.0)


def _tangent(draws: Draws, count: int) -> Queries:
    """The line of centres at the tangency is along an axis or a Pythagorean triple, so all is exact."""
    triples = np.array([(0, 1, 1), (3, 4, 5), (5, 12, 13), (8, 15, 17), (20, 21, 29)])
    chosen = triples[draws.integers(0, len(triples), count)] * draws.choice([-1, 1], (count, 1))
    size = 2.0 ** draws.integers(-12, 3, (count, 1))
    x, y, reach = (chosen * size).T
    run = draws.integers(1, 40, count)
    position = np.zeros((count, 2, 2))
    position[:, 1] = np.column_stack([x - run * y, y + run * x])
    velocity = np.repeat(draws.integers(-8, 9, (count, 1, 2)) * 2.0**-3, 2, axis=1)
    velocity[:, 1] += np.column_stack([y, -x]) * 2.0 ** draws.integers(-3, 3, (count, 1))
    off = draws.choice([-1, 0, 1, 1], count) * np.spacing(np.abs(reach))
    radius = np.abs(reach)[:, None] * np.array([0.25, 0.75]) + off[:, None] * np.array([0, 1])
    return Queries(position, velocity, radius, np.zeros((count, 2), dtype=np.int64))


def _touching(draws: Draws, count: int) -> Queries:
    """Half in any direction; half along the tangent, off it by 1e-17 to 1e-1."""
    angle = draws.uniform(-np.pi, np.pi, count)
    off = draws.choice([-1.0, 1.0], count) * 10.0 ** draws.uniform(-17.0, -1.0, count)
    angle = np.where(draws.random(count) < 0.5, angle, 0.5 * np.pi + off)
    gap = 1.0 + draws.integers(-8, 9, count) * 2.0**-53
    return usual(
        draws, count, lambda reach: reach * gap * np.cos(angle), lambda reach: reach * gap * np.sin(angle)
    )


def _almost_equal(draws: Draws, count: int) -> Queries:
    """As near as they must be to meet within 10 units of time."""
    slow = 10.0 ** draws.uniform(-15.0, -3.0, count)
    wait = draws.uniform(0.0, 10.0, count)
    miss = draws.uniform(-1.5, 1.5, count)
    pairs = usual(
        draws,
        count,
        lambda reach: reach * np.sqrt(np.maximum(1.0 - miss**2, 0.0)) + slow * wait,
        lambda reach: reach * miss,
    )
    drift = pairs.velocity[:, :1]
    return replace(
        pairs, velocity=drift + np.stack([np.zeros((count, 2)), slow[:, None] * _unit(pairs)], axis=1)
    )


def _unit(queries: Queries) -> Floats:
    """Returns (m, 2) the directions of the relative velocities."""
    relative = queries.velocity[:, 1] - queries.velocity[:, 0]
    return np.asarray(relative / np.hypot(*relative.T)[:, None])


def _sizes(draws: Draws, count: int) -> Queries:
    """A large disc and one up to 1e6 times smaller, from near its surface to a few radii away."""
    large = draws.uniform(0.1, 0.5, count)
    small = large * 10.0 ** -draws.uniform(0.0, 6.0, count)
    swap = draws.random(count) < 0.5
    radius = np.column_stack([np.where(swap, small, large), np.where(swap, large, small)])
    reach = large + small
    near = draws.random(count) < 0.5
    gap = np.where(near, small * draws.uniform(0.0, 10.0, count), reach * draws.uniform(0.1, 4.0, count))
    angle = draws.uniform(-0.5, 0.5, count) * np.pi
    pairs = usual(
        draws, count, lambda _: (reach + gap) * np.cos(angle), lambda _: (reach + gap) * np.sin(angle)
    )
    return replace(pairs, radius=radius)


def _struck(draws: Draws, count: int) -> tuple[Queries, Floats]:
    """Returns two discs of like energies that will collide, and their masses, of ratio 1 to 1e12."""
    ratio = 10.0 ** draws.uniform(0.0, 12.0, count)
    heavy = draws.integers(0, 2, count)[:, None] == np.arange(2)
    before = usual(draws, count, (2.0, 20.0), (-0.9, 0.9))
    slower = np.where(heavy, ratio[:, None] ** -0.5, 1.0)
    share = slower / slower.sum(axis=1)[:, None] * np.array([-1.0, 1.0])
    relative = before.velocity[:, 1] - before.velocity[:, 0]
    before = replace(before, velocity=relative[:, None] * share[..., None])
    return before, np.where(heavy, ratio[:, None], 1.0)


def _masses(draws: Draws, count: int) -> Queries:
    """Two discs of mass ratio up to 1e12 and like energies collide; either then comes towards a third."""
    before, mass = _struck(draws, count)
    one = draws.integers(0, 2, count)
    anchors, places, velocities = [], [], []
    for (a, b), masses, chosen in zip(before.plans(), mass.tolist(), one.tolist(), strict=True):
        tick = pair_tick(a, b)
        if tick is None:
            raise RuntimeError("two discs that are aimed at each other do not meet")
        where = a.rounded_place(tick, 1.0 / UNIT_TICKS), b.rounded_place(tick, 1.0 / UNIT_TICKS)
        after = exchanged(where, ((a.vx, a.vy), (b.vx, b.vy)), tuple(masses))
        anchors.append(tick)
        places.append(where[chosen])
        velocities.append(after[chosen])
    position, velocity = np.array(places).reshape(-1, 2), np.array(velocities).reshape(-1, 2)
    third = generic(draws, count)
    radius = np.column_stack([before.radius[np.arange(count), one], third.radius[:, 1]])
    size = radius.sum(axis=1) / third.radius.sum(axis=1)
    apart = (third.position[:, 1] - third.position[:, 0]) * size[:, None]
    relative = third.velocity[:, 1] - third.velocity[:, 0]
    return Queries(
        np.stack([position, position + apart], axis=1),
        np.stack([velocity, velocity + relative], axis=1),
        radius,
        np.repeat(np.array(anchors, np.int64)[:, None], 2, axis=1),
    )


def _far_apart(draws: Draws, count: int) -> Queries:
    """In a box of side 10, with radii of 1e-6 to 1e-4."""
    far = 10.0 ** draws.uniform(4.0, 6.0, count)
    way = draws.uniform(0.5, 2.0, count)
    share = draws.uniform(0.2, 0.8, count)
    reach = way / far
    miss = reach * draws.uniform(-1.2, 1.2, count)
    pairs = usual(draws, count, lambda _: way, lambda _: miss)
    return replace(pairs, radius=reach[:, None] * np.column_stack([share, 1.0 - share]))


def _far_out(draws: Draws, count: int) -> Queries:
    out = draws.uniform(-1.0, 1.0, (count, 1, 2)) * 10.0 ** draws.uniform(2.0, 6.0, (count, 1, 1))
    pairs = generic(draws, count)
    return replace(pairs, position=pairs.position + out)


def _anchored_apart(draws: Draws, queries: Queries) -> Queries:
    """Anchors one disc of each pair up to one unit of time before the other, and that in the second unit."""
    count = len(queries)
    first = draws.integers(0, 2, count)[:, None] == np.arange(2)
    earlier = np.where(first, draws.integers(0, UNIT_TICKS, count)[:, None], 0)
    flown = queries.velocity * (earlier / UNIT_TICKS)[..., None]
    since = UNIT_TICKS + draws.integers(0, UNIT_TICKS, count)[:, None]
    return replace(queries, position=queries.position - flown, anchor=since - earlier)


def _apart_in_time(draws: Draws, count: int) -> Queries:
    return _anchored_apart(draws, generic(draws, count))


def _late(draws: Draws, count: int) -> Queries:
    early = _apart_in_time(draws, count)
    return replace(early, anchor=early.anchor + LATER)


def _far_out_apart_in_time(draws: Draws, count: int) -> Queries:
    return _anchored_apart(draws, _far_out(draws, count))


def _copies(draws: Draws, count: int) -> Queries:
    """One encounter moved, turned by right angles, mirrored, its discs exchanged, one anchored earlier: all
    exact, on a grid of 2^-40."""
    groups = -(-count // TIED)
    one = usual(draws, groups, (2.0, 10.0), (-0.95, 0.95))
    each = np.repeat(np.arange(groups), TIED)
    position = np.round(one.position[each] * 2.0**40) * 2.0**-40
    velocity = np.round(one.velocity[each] * 2.0**30) * 2.0**-30
    mirror = draws.choice([-1.0, 1.0], (len(each), 1, 2))
    position, velocity = position * mirror, velocity * mirror
    turn = draws.random((len(each), 1, 1)) < 0.5
    position = np.where(turn, position[..., ::-1], position)
    velocity = np.where(turn, velocity[..., ::-1], velocity)
    position = position + draws.integers(-1024, 1025, (len(each), 1, 2)) * 2.0**-10
    swap = draws.random((len(each), 1)) < 0.5
    position = np.where(swap[..., None], position[:, ::-1], position)
    velocity = np.where(swap[..., None], velocity[:, ::-1], velocity)
    radius = np.where(swap, one.radius[each, ::-1], one.radius[each])
    earlier = np.where(
        draws.integers(0, 2, len(each))[:, None] == np.arange(2), draws.integers(0, 257, (len(each), 1)), 0
    )
    position = position - velocity * (earlier * 2.0**-8)[..., None]
    anchor = (1 << 53) - earlier * (UNIT_TICKS >> 8)
    return Queries(position[:count], velocity[:count], radius[:count], anchor[:count], TIED)


def _like_times(draws: Draws, count: int) -> Queries:
    """Different encounters that touch at the same multiple of 1/768: the line of centres is a Pythagorean
    triple, the velocity a multiple of 3, and all is exact on a grid of 2^-22."""
    groups = -(-count // TIED)
    wait = np.repeat(draws.integers(1, 768, groups), TIED)
    legs = np.sort(draws.integers(1, 512, (len(wait), 2)), axis=1) + np.array([0, 1])
    q, p = legs.T
    normal = np.column_stack([p * p - q * q, 2 * p * q])[..., None].swapaxes(1, 2)[:, 0]
    normal = np.where(draws.random((len(wait), 1)) < 0.5, normal[:, ::-1], normal)
    normal = normal * draws.choice([-1, 1], (len(wait), 2))
    steps = draws.integers(-2048, 2049, (len(wait), 2))
    steps = np.where((steps * normal).sum(axis=1)[:, None] > 0, -steps, steps)
    steps = np.where((steps * normal).sum(axis=1)[:, None] == 0, -np.sign(normal), steps)
    reach = (p * p + q * q) * 2.0**-22
    apart = normal * 2.0**-22 - steps * wait[:, None] * 2.0**-20
    velocity = 3 * steps * 2.0**-12
    base = draws.integers(-(2**19), 2**19, (len(wait), 2)) * 2.0**-22
    share = draws.integers(1, 8, len(wait)) / 8.0
    return Queries(
        np.stack([base, base + apart], axis=1)[:count],
        np.stack([np.zeros_like(velocity), velocity], axis=1)[:count],
        (reach[:, None] * np.column_stack([share, 1.0 - share]))[:count],
        np.zeros((count, 2), dtype=np.int64),
        TIED,
    )


FAMILIES = (
    Family("generic", "2 to 20 R away, both anchored at one tick", generic),
    Family("grazing, 1e-12", "passing at R within 1e-12 R, from 1.6 to 100 R away", _grazing),
    Family(
        "grazing, ulps", "passing at R within 4 ulps, before rounding, from 1.5 to 4 R away", _grazing_by_ulps
    ),
    Family(
        "tangent", "a quarter passing at R exactly, the others within an ulp of it on either side", _tangent
    ),
    Family("touching", "touching at the anchor within 4 ulps; half along the tangent", _touching),
    Family("almost equal velocities", "relative speed 1e-15 to 1e-3", _almost_equal),
    Family("size ratio to 1e6", "one disc up to 1e6 times smaller, half near the surface", _sizes),
    Family("mass ratio to 1e12", "a third disc, after the exchange of two of very different mass", _masses),
    Family("far apart", "1e4 to 1e6 R away", _far_apart),
    Family("far out", "generic, 100 to 1e6 from the origin", _far_out),
    Family("anchors apart", "generic, one disc anchored up to a unit of time earlier", _apart_in_time),
    Family("late clock", "the same queries, 510 units of time (2^61 ticks) later", _late, "anchors apart"),
    Family("far out, anchors apart", "both at once", _far_out_apart_in_time),
    Family(
        "simultaneous, copies",
        "groups of 8: one encounter moved, turned, mirrored, anchored elsewhere",
        _copies,
    ),
    Family("simultaneous, different", "groups of 8 different encounters with one rational time", _like_times),
)
"""All families, in the order of the tables."""
