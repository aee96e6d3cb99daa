"""Hard families of queries for the contact time of two discs. A family draws a number of pairs from a random
generator. Unless a family has other values, a unit box holds discs with radii of 1/200 to 1/20 and speeds of
about 1, and the unit of time is 1. All values are rounded to doubles, which are the query."""

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from kinetile.arrays import Array, Floats, Integers
from kinetile_accuracy.specification.arithmetic import SPAN, UNIT_TICKS, FlightPlan, Frame

Ticks = Integers
Draws = np.random.Generator

UNIT = Frame(None, 0)
TIED = 8
"""The number of successive queries with one exact time in the family of simultaneous contacts."""

LATER = SPAN - 2 * UNIT_TICKS
"""The delay of the late clock in ticks: as late as the kernel's clock gets before its base moves on."""


@dataclass(frozen=True, eq=False)
class Queries:
    """The flight plans of m pairs of discs, by query, disc and axis: ``position``, at the disc's anchor, and
    ``velocity`` are (m, 2, 2); ``radius`` and ``anchor``, in ticks of 2^-52, are (m, 2)."""

    position: Floats
    velocity: Floats
    radius: Floats
    anchor: Ticks

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


Sampler = Callable[[Draws, int], Queries]


@dataclass(frozen=True)
class Family:
    """Queries of one kind: a name, a phrase on their difficulty, and the function that draws them."""

    name: str
    about: str
    sampler: Sampler

    def draw(self, count: int) -> Queries:
        """Returns ``count`` queries, always the same."""
        return self.sampler(np.random.default_rng(zlib.crc32(self.name.encode())), count)


FAMILIES: list[Family] = []


def _family(name: str, about: str) -> Callable[[Sampler], Sampler]:
    def enter(sampler: Sampler) -> Sampler:
        FAMILIES.append(Family(name, about, sampler))
        return sampler

    return enter


def aimed(
    draws: Draws,
    run: Array,
    miss: Array,
    radius: Array | None = None,
    speed: Array | None = None,
    spread: float | None = None,
) -> Queries:
    """Returns pairs by their encounter, anchored at tick 0: the second disc is nearest to the first after a
    way of ``run``, and would then pass at distance ``miss``: (m,) multiples of R, the sum of the radii.
    ``radius`` is (m, 2); ``speed`` (m,) is the relative speed; the first disc is within ``spread`` R of the
    origin; None: the usual values, and a unit box."""
    count = len(run)
    radius = draws.uniform(0.005, 0.05, (count, 2)) if radius is None else radius
    reach = radius.sum(axis=1)[:, None]
    speed = draws.uniform(0.1, 1.0, count) if speed is None else speed
    course = draws.uniform(0.0, 2.0 * np.pi, count)
    along = np.column_stack([np.cos(course), np.sin(course)])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    apart = reach * (miss[:, None] * across - run[:, None] * along)
    base = draws.uniform(-0.5, 0.5, (count, 2)) * (1.0 if spread is None else 2.0 * spread * reach)
    drift = draws.uniform(-0.7, 0.7, (count, 2))
    return Queries(
        np.stack([base, base + apart], axis=1),
        np.stack([drift, drift + speed[:, None] * along], axis=1),
        radius,
        np.zeros((count, 2), dtype=np.int64),
    )


@_family("generic", "2 to 20 R away, both anchored at one tick")
def _generic(draws: Draws, count: int) -> Queries:
    return aimed(draws, draws.uniform(2.0, 20.0, count), draws.uniform(-2.0, 2.0, count))


@_family("grazing, 1e-12", "passing at R within 1e-12 R, from 1.6 to 100 R away")
def _grazing(draws: Draws, count: int) -> Queries:
    off = 1e-12 * draws.uniform(-1.0, 1.0, count)
    return aimed(draws, 10.0 ** draws.uniform(0.2, 2.0, count), 1.0 + off)


@_family("grazing, ulps", "passing at R within 4 ulps, before rounding, from 1.5 to 4 R away")
def _grazing_by_ulps(draws: Draws, count: int) -> Queries:
    off = draws.integers(-4, 5, count) * 2.0**-52
    return aimed(draws, draws.uniform(1.5, 4.0, count), 1.0 + off, spread=1.0)


@_family("tangent", "a quarter passing at R exactly, the others within an ulp of it on either side")
def _tangent(draws: Draws, count: int) -> Queries:
    # The line of centres at the tangency is along an axis or a Pythagorean triple, so all values are exact.
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


@_family("touching", "touching at the anchor within 4 ulps; half along the tangent, off it by 1e-17 to 1e-1")
def _touching(draws: Draws, count: int) -> Queries:
    angle = draws.uniform(-np.pi, np.pi, count)
    off = draws.choice([-1.0, 1.0], count) * 10.0 ** draws.uniform(-17.0, -1.0, count)
    angle = np.where(draws.random(count) < 0.5, angle, 0.5 * np.pi + off)
    gap = 1.0 + draws.integers(-8, 9, count) * 2.0**-53
    return aimed(draws, gap * np.cos(angle), gap * np.sin(angle))


@_family("almost equal velocities", "relative speed 1e-15 to 1e-3, at most 10 units of time away")
def _almost_equal(draws: Draws, count: int) -> Queries:
    slow = 10.0 ** draws.uniform(-15.0, -3.0, count)
    miss = draws.uniform(-1.5, 1.5, count)
    radius = draws.uniform(0.005, 0.05, (count, 2))
    wait = slow * draws.uniform(0.0, 10.0, count) / radius.sum(axis=1)
    return aimed(draws, np.sqrt(np.maximum(1.0 - miss**2, 0.0)) + wait, miss, radius, slow)


@_family("size ratio to 1e6", "one disc up to 1e6 times smaller, half near the surface")
def _sizes(draws: Draws, count: int) -> Queries:
    large = draws.uniform(0.1, 0.5, count)
    small = large * 10.0 ** -draws.uniform(0.0, 6.0, count)
    radius = np.column_stack([small, large])
    swap = draws.random((count, 1)) < 0.5
    near = small / (large + small) * draws.uniform(0.0, 10.0, count)
    gap = 1.0 + np.where(draws.random(count) < 0.5, near, draws.uniform(0.1, 4.0, count))
    angle = draws.uniform(-0.5, 0.5, count) * np.pi
    return aimed(draws, gap * np.cos(angle), gap * np.sin(angle), np.where(swap, radius[:, ::-1], radius))


@_family("far apart", "1e4 to 1e6 R away, with radii of 1e-6 to 1e-4")
def _far_apart(draws: Draws, count: int) -> Queries:
    far, share = 10.0 ** draws.uniform(4.0, 6.0, count), draws.uniform(0.2, 0.8, count)
    reach = draws.uniform(0.5, 2.0, count) / far
    radius = reach[:, None] * np.column_stack([share, 1.0 - share])
    return aimed(draws, far, draws.uniform(-1.2, 1.2, count), radius)


@_family("far out", "generic, 100 to 1e6 from the origin")
def _far_out(draws: Draws, count: int) -> Queries:
    out = draws.uniform(-1.0, 1.0, (count, 1, 2)) * 10.0 ** draws.uniform(2.0, 6.0, (count, 1, 1))
    pairs = _generic(draws, count)
    return replace(pairs, position=pairs.position + out)


def _anchored_apart(draws: Draws, queries: Queries) -> Queries:
    """Anchors one disc of each pair up to one unit of time before the other, which is in the second unit."""
    count = len(queries)
    first = draws.integers(0, 2, count)[:, None] == np.arange(2)
    earlier = np.where(first, draws.integers(0, UNIT_TICKS, count)[:, None], 0)
    flown = queries.velocity * (earlier / UNIT_TICKS)[..., None]
    since = UNIT_TICKS + draws.integers(0, UNIT_TICKS, count)[:, None]
    return replace(queries, position=queries.position - flown, anchor=since - earlier)


@_family("anchors apart", "generic, one disc anchored up to a unit of time earlier")
def _apart_in_time(draws: Draws, count: int) -> Queries:
    return _anchored_apart(draws, _generic(draws, count))


@_family("late clock", "generic, anchors apart, 510 units of time (2^61 ticks) later")
def _late(draws: Draws, count: int) -> Queries:
    early = _apart_in_time(draws, count)
    return replace(early, anchor=early.anchor + LATER)


@_family("far out, anchors apart", "both at once")
def _far_out_apart_in_time(draws: Draws, count: int) -> Queries:
    return _anchored_apart(draws, _far_out(draws, count))


@_family("simultaneous", "groups of 8 different encounters with one rational time")
def _like_times(draws: Draws, count: int) -> Queries:
    # They touch at a multiple of 1/768: the line of centres is a Pythagorean triple, the velocity a multiple
    # of 3, and all values are exact on a grid of 2^-22.
    wait = np.repeat(draws.integers(1, 768, -(-count // TIED)), TIED)[:count]
    q, p = (np.sort(draws.integers(1, 512, (count, 2)), axis=1) + np.array([0, 1])).T
    normal = np.column_stack([p * p - q * q, 2 * p * q])
    normal = np.where(draws.random((count, 1)) < 0.5, normal[:, ::-1], normal)
    normal = normal * draws.choice([-1, 1], (count, 2))
    steps = draws.integers(-2048, 2049, (count, 2))
    towards = (steps * normal).sum(axis=1)[:, None]
    steps = np.where(towards > 0, -steps, np.where(towards == 0, -np.sign(normal), steps))
    apart = normal * 2.0**-22 - steps * wait[:, None] * 2.0**-20
    velocity = 3 * steps * 2.0**-12
    base = draws.integers(-(2**19), 2**19, (count, 2)) * 2.0**-22
    share = draws.integers(1, 8, count) / 8.0
    reach = (p * p + q * q) * 2.0**-22
    return Queries(
        np.stack([base, base + apart], axis=1),
        np.stack([np.zeros_like(velocity), velocity], axis=1),
        reach[:, None] * np.column_stack([share, 1.0 - share]),
        np.zeros((count, 2), dtype=np.int64),
    )
