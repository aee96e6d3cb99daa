"""Swarms: scenes of many bodies, each of a kind that fills places, lists and counters of a phase.

A phase's list overflows in a crowd, entries of its table collide with many bodies, a number of 8 bits ends at
256 bodies, and truncation is not floor left of the origin. One drawn number gives a swarm's kind, its number
of bodies, a seed, and a variation. Every body begins in its own slot, so that none overlap. All masses are
equal, for few loops.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial

import numpy as np

from kinetile import Scene, Settings, Turn
from kinetile.arrays import Flags, Floats
from kinetile.errors import SceneError
from kinetile_conformance.strategies.changes import viewed
from kinetile_conformance.strategies.strategy import numbered


def swarm_of(
    position: Floats,
    velocity: Floats,
    radius: Floats,
    arena: tuple[float, float] | None,
    until: float,
    turns: Iterable[Turn] = (),
    aside: int = 0,
) -> Scene:
    """Returns the scene of these bodies, (n, 2) and (n,); ``aside``: with x and y exchanged."""
    way = slice(None, None, -1 if aside else 1)
    walls, settings = arena[::-1] if arena and aside else arena, Settings(until=until)
    return Scene(position[:, way], velocity[:, way], radius, arena=walls, turns=[*turns], settings=settings)


def slots(random: np.random.Generator, bodies: int, columns: int, rows: int) -> Floats:
    """Returns the middles of different unit squares of a lattice, one for each body, (n, 2)."""
    chosen = random.choice(columns * rows, bodies, replace=False)
    return np.column_stack([chosen % columns, chosen // columns]).astype(np.float64) + 0.5


def square(bodies: int, room: float) -> int:
    """Returns the side of a square lattice with ``room`` places for each body."""
    return int(np.ceil(np.sqrt(room * bodies)))


def radii(random: np.random.Generator, bodies: int, variation: int) -> Floats:
    """Returns radii of at most .45: all alike, of two sizes, or of any."""
    ratio = (1.0, 0.5, 0.125, 2.0**-6)[variation % 4]
    small: Flags = random.random(bodies) < 0.75
    fills = np.ones(bodies) if variation < 4 else random.uniform(0.5, 1.0, bodies)
    return np.where(small, 0.45 * ratio, 0.45) * fills


def jitter(random: np.random.Generator, radius: Floats) -> Floats:
    """Returns displacements that keep bodies in their unit squares, (n, 2)."""
    return (0.499 - radius)[:, None] * random.uniform(-1.0, 1.0, (len(radius), 2))


def anyhow(random: np.random.Generator, bodies: int) -> Floats:
    """Returns velocities in all directions, (n, 2)."""
    return random.normal(size=(bodies, 2))


def back_and_forth(velocity: Floats, moments: tuple[float, ...]) -> list[Turn]:
    """Returns turns that make each body fly back, and forth again."""
    there, back = velocity.tolist(), (-velocity).tolist()
    return [
        Turn(body, moment, (vx, vy))
        for turn, moment in enumerate(moments)
        for body, (vx, vy) in enumerate(there if turn % 2 else back)
    ]


def at_random(
    random: np.random.Generator, bodies: int, variation: int, room: float
) -> tuple[int, Floats, Floats]:
    """Returns the side of a square, and radii and places in it."""
    side, radius = square(bodies, room), radii(random, bodies, variation)
    return side, radius, slots(random, bodies, side, side) + jitter(random, radius)


# Kinds in an arena.


def gas(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Bodies of one or several sizes in a square."""
    side, radius, place = at_random(random, bodies, variation, 1.2)
    return swarm_of(place, anyhow(random, bodies), radius, (float(side), float(side)), 40.0)


def lattice(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Columns and rows: bodies with one coordinate in common, dyadic numbers, ties in bulk."""
    columns = (2, 4, square(bodies, 1.3), square(bodies, 3.0))[variation % 4]
    rows = -(-int(1.4 * bodies) // columns)
    radius = np.full(bodies, 0.25 if variation < 4 else 0.5)
    velocity = random.integers(-2, 3, (bodies, 2)) / 2.0
    velocity[np.arange(bodies), random.integers(0, 2, bodies)] = 0.0
    place, arena = slots(random, bodies, columns, rows), (float(columns), float(rows))
    return swarm_of(place, velocity, radius, arena, 100.0, aside=variation & 1)


def shear(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Rows that fly past each other, touching or just not, as trains."""
    side = square(bodies, 1.5)
    place = slots(random, bodies, side, side)
    speed = np.where(place[:, 1] % 2 < 1, 1.0, -1.0) * (1.0 + variation % 2)
    radius = np.full(bodies, (0.5, 0.375, 0.5 - 2.0**-30, 0.25)[variation % 4])
    velocity = np.column_stack([speed, np.zeros(bodies)])
    velocity[random.integers(0, bodies), 1] = 0.5
    return swarm_of(place, velocity, radius, (float(side), float(side)), 50.0)


def corridor(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """An arena a thousand times as long as it is wide."""
    length = 1024
    radius = 0.5 * radii(random, bodies, variation % 4)
    place = slots(random, bodies, length, 1) + jitter(random, radius)
    velocity = anyhow(random, bodies) * np.array([30.0, 1.0])
    return swarm_of(place, velocity, radius, (float(length), 1.0), 10.0, aside=variation & 1)


def resting(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Bodies at rest, and a few fast ones among them."""
    scene = gas(random, bodies, variation)
    fast = random.random(bodies) < 2.0 ** -(2 + variation % 4)
    fast[0] = True
    return scene.replace(velocity=np.where(fast[:, None], 8.0 * scene.velocity, 0.0))


def burst(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """All in the middle: leaving at one moment in all directions, or a gas in a few cells of a grid."""
    side, radius, place = at_random(random, bodies, variation, 1.2)
    inside, wide = place - side / 2.0, 3.0 * side
    velocity = anyhow(random, bodies) if variation & 2 else inside * (2.0, 8.0)[variation & 1]
    return swarm_of(inside + wide / 2.0, velocity, radius, (wide, wide), 8.0)


def crossings(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Small and fast, with much room: hardly any contact, and thousands of places passed."""
    side = square(bodies, 1.2)
    radius = np.full(bodies, (0.125, 2.0**-5, 2.0**-7, 0.25)[variation % 4])
    place = slots(random, bodies, side, side) + jitter(random, radius)
    velocity = side * anyhow(random, bodies)
    return swarm_of(place, velocity, radius, (float(side), float(side)), 512.0 / bodies)


# Kinds without an arena, which keep together by turns.


def cloud(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Without an arena, about the origin: bodies that fly together, or anywhere, and back."""
    side, radius, place = at_random(random, bodies, variation, 1.5)
    place -= side / 2.0
    velocity = -place * random.uniform(0.8, 1.2, (bodies, 1)) + 0.1 * anyhow(random, bodies)
    if random.random() < 0.5:
        velocity = anyhow(random, bodies)
    moments = tuple(2.0 * (turn + 1) for turn in range(1 + 300 // bodies))  # the more often, the fewer
    return swarm_of(place, velocity, radius, None, moments[-1] + 2.0, back_and_forth(velocity, moments))


def far(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """A cloud far from the origin, so fine that its lanes have numbers beyond 2^31."""
    scene = cloud(random, bodies, 0 if variation < 4 else 1)
    scale = 2.0 ** (-10 if variation & 1 else 0)
    away = (2.0**33, 2.0**12, 2.0**20, 2.0**32)[variation % 4] * random.choice([-1.0, 1.0], 2)
    return viewed(scene.replace(position=away + scene.position), scale)


def returning(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Without an arena: bodies leave for far away, and come back."""
    side, radius, place = at_random(random, bodies, variation, 1.5)
    place -= side / 2.0
    velocity = place * (2.0, 16.0)[variation & 1]
    # At 4 they are at their starting places, and fly on through each other's midst.
    return swarm_of(place, velocity, radius, None, 7.0, back_and_forth(velocity, (2.0, 5.0)))


# Kinds of few large bodies and many small ones: they use every level of a phase that has levels for sizes.


def _octaves(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Sizes over eight octaves, most of them the smallest: one fills most of the arena, four of a third of
    its size are beside it, and small ones of four sizes begin in a strip between."""
    large = min(5, bodies - 3)
    width, height, strip = 6.0, 4.5, (4.05, 0.5)
    beside = [(5.35, 0.5625 + 1.125 * at) for at in range(large - 1)]
    small = bodies - large
    columns = max(int(np.sqrt(1.3 * small * strip[1] / height)), 1)
    rows = -(-int(1.3 * small + 1) // columns)
    pitch = np.array([strip[1] / columns, height / rows])
    place = np.vstack([(2.0, 2.25), *beside, [strip[0], 0.0] + pitch * slots(random, small, columns, rows)])
    fine = 0.45 * min(pitch.min(), 0.0625) * 2.0 ** -random.integers(0, 4, small)
    radius = np.concatenate([[1.95], [0.55] * len(beside), fine])
    velocity = anyhow(random, bodies)
    velocity[:large] *= (variation & 1, 0.25)[variation >> 1 & 1]
    return swarm_of(place, velocity, radius, (width, height), 12.0)


def crowd(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """All small bodies in the place of one large body, among other large ones; or bodies of all sizes."""
    if variation >= 4:
        return _octaves(random, bodies, variation)
    small = bodies - 3
    side = square(small, 1.3)
    pitch = 1.5 / side
    radius = np.append([1.0] * 3, np.full(small, 0.4 * pitch))
    large = [[1.5, 5.5], [5.5, 1.5], [6.5, 6.5]]
    place = np.vstack([large, 0.25 + pitch * slots(random, small, side, side)])
    velocity = 0.1 * (1 + variation % 4) * anyhow(random, bodies)
    velocity[:3] *= 0.5 * (variation & 1)
    return swarm_of(place, velocity, radius, (8.0, 8.0), 30.0)


def giants(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Few large bodies, many that are up to a thousand times smaller between them; or bodies of all sizes."""
    if variation >= 4:
        return _octaves(random, bodies, variation)
    small, side = bodies - 4, square(bodies, 1.2)
    pitch = 20.0 / side
    fine = min(4.0 * 2.0 ** -(4 + 2 * (variation % 4)), 0.24 * pitch)
    radius = np.append([4.0] * 4, np.full(small, fine))
    large = [[5.0, 5.0], [15.0, 5.0], [5.0, 15.0], [15.0, 15.0]]
    place = np.vstack([large, [0.0, 20.0] + pitch * slots(random, small, side, side)])
    return swarm_of(place, 2.0 * anyhow(random, bodies), radius, (20.0, 40.0), 12.0)


def plough(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Four large bodies that plough through small ones at rest, one in each direction, past each other. The
    small ones have no new plans, so only the large body's certificate can make them near it."""
    small = bodies - 4
    side = square(small, 1.2)
    wide = (0.2, 0.1875, 0.175, 0.15)[variation % 4] * side
    radius = np.append(np.full(small, 0.25), [wide] * 4)
    field = slots(random, small, side, side) - side / 2.0
    aside, away = 0.3 * side, side * random.uniform(0.8, 1.2)
    ploughs = np.array([[-aside, away], [-away, -aside], [aside, -away], [away, aside]])
    ahead = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    place = np.vstack([field, ploughs]) + random.uniform(-side, side, 2) * (variation >> 2)
    velocity = np.vstack([2.0**-8 * anyhow(random, small), ahead])
    return swarm_of(place, velocity, radius, None, 2.5 * side)


def lanes(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Large bodies in lanes among few small ones that drift, beside a crowd that makes a grid fine: few
    contacts are between two changes of place, also over the axis."""
    large, crowd = 3, int(0.8 * (bodies - 3))
    few = bodies - large - crowd
    side = 0.475 * np.sqrt(bodies)
    pitch = 0.75 / square(crowd, 1.0)
    apart = side / square(few, 1.1)
    radius = np.concatenate([np.ones(large), np.full(crowd, 0.4 * pitch), np.full(few, 0.03125)])
    lanes = side * np.array([0.25, 0.5, 0.75])[random.permutation(3)]
    start = np.column_stack([lanes, [-1.5, side + 1.5, -4.0]])
    thick = side + 1.5 + pitch * slots(random, crowd, square(crowd, 1.0), square(crowd, 1.0))
    thin = apart * slots(random, few, square(few, 1.1), square(few, 1.1))
    place = np.vstack([start, thick, thin]) - side * (random.random(2) if variation & 4 else 0.5)
    velocity = 2.0**-8 * anyhow(random, bodies) + (variation & 1) * 0.25 * random.normal(size=2)
    velocity[:large] = np.array([[0.0, 1.0], [0.0, -1.0], [0.0, 1.0]])
    return swarm_of(place, velocity, radius, None, 4.0 * side, aside=variation & 2)


# Kinds with many events at one tick, or along one axis.


def front(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """A straight front of bodies that cross each border at one tick, towards others at rest or moving."""
    rows = bodies // 2
    apart = random.integers(4, 24, bodies - rows) / 4.0
    radius = np.full(bodies, (0.5, 0.25, 0.125, 0.0625)[variation % 4])
    front = np.column_stack([np.full(rows, 1.0), np.arange(rows) + 0.5])
    others = np.column_stack([1.5 + apart, np.arange(bodies - rows) + 0.5])
    velocity = np.zeros((bodies, 2))
    velocity[:rows, 0], velocity[rows:, 0] = 1.0, (0.0, -0.5)[variation & 1]
    arena = 10.0, float(max(rows, bodies - rows))
    return swarm_of(np.vstack([front, others]), velocity, radius, arena, 24.0, aside=variation & 4)


def fast_corridor(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """An arena a thousand times as long as it is wide, which its bodies cross in no time."""
    scene = corridor(random, bodies, variation)
    fast = 2.0 ** random.integers(4, 20)
    return scene.replace(velocity=scene.velocity * fast, settings=Settings(until=64.0 / fast))


def steep(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """A crowd at rest, and some that fly almost along an axis: each meets a body far away, only because it
    drifts sideways by a few widths. An arena would make the cells of a grid coarse, so it is absent."""
    fliers = min(bodies // 8, 8)
    crowd = bodies - 2 * fliers
    side = square(crowd, 1.3)
    radius = np.full(bodies, (0.5, 0.25, 0.375, 0.4375)[variation % 4])
    slight = 2.0 ** -random.uniform(5.0, 12.0, fliers)
    aside = random.uniform(2.5, 3.5, fliers)
    right = random.choice([-1.0, 1.0], fliers)
    start = np.column_stack([side + 8.0 * np.arange(1, fliers + 1), random.uniform(0.0, side, fliers)])
    goal = start + np.column_stack([right * aside, aside / slight])
    velocity = np.zeros((bodies, 2))
    velocity[:fliers] = np.column_stack([right * slight, np.ones(fliers)])
    place = np.vstack([start, goal, slots(random, crowd, side, side)])
    until = 1.25 * float((aside / slight).max())
    return swarm_of(place, velocity, radius, None, until, aside=variation & 4)


WIDTHS = ((8, 400), (64, 64), (1_000, 16))
"""The flight of a convoy until its parts meet, in its widths, and its largest number of bodies."""


def convoy(random: np.random.Generator, bodies: int, variation: int) -> Scene:
    """Two crowds that fly side by side, and meet far away from where they began, in the open plane."""
    widths, most = WIDTHS[variation % 3]
    one, two = (bodies := min(bodies, most)) // 2, bodies - bodies // 2
    side = square(two, 1.3)
    radius = radii(random, bodies, variation)
    place = np.vstack([slots(random, one, side, side), slots(random, two, side, side)])
    place += jitter(random, radius) - side / 2.0
    place[one:, 1] += side
    time = float(2 * side * widths)
    velocity = np.tile([-1.0 if variation & 4 else 1.0, 0.0], (bodies, 1))
    velocity[one:, 1] = -side / time
    return swarm_of(place, velocity, radius, None, time, aside=variation & 1)


FEWEST, MOST = 8, 400

DrawOfKind = Callable[[np.random.Generator, int, int], Scene]


def _named(*kinds: DrawOfKind) -> dict[str, DrawOfKind]:
    return {kind.__name__.replace("_", " "): kind for kind in kinds}


KINDS = _named(
    *(gas, cloud, crowd, far, lattice, shear, corridor, giants, resting, burst, crossings, returning)
)
"""The kinds of swarms, the simplest first."""

GIANTS = _named(plough, lanes, giants)
"""Kinds with few large bodies; one scene in four or five finds a fault."""

BURSTS = _named(front, burst)
CORRIDORS = _named(fast_corridor, steep, convoy)


def swarm(kind: str, bodies: int = 100, seed: int = 0, variation: int = 0) -> Scene:
    """Returns a swarm of a kind and at least 8 bodies; ``variation``, 0 to 7, is of its sizes or speeds."""
    return (KINDS | GIANTS | BURSTS | CORRIDORS)[kind](np.random.default_rng(seed), bodies, variation)


def swarm_numbered(kinds: Iterable[str], number: int) -> Scene:
    """Returns the swarm of a number: its kind is the remainder, the rest is drawn from the quotient."""
    names = tuple(kinds)
    seed, kind = divmod(number, len(names))
    random = np.random.default_rng(seed)
    bodies, variation = random.integers(FEWEST, MOST + 1), random.integers(8)
    return swarm(names[kind], int(bodies), seed, int(variation))


SCALED_MOST = 100  # bodies: more find no more faults of scale


def scaled(number: int) -> Scene:
    """Returns the scaled swarm of a number: slower or faster, larger or smaller, or far from the origin."""
    random = np.random.default_rng(number)
    kind = tuple(KINDS)[number % len(KINDS)]
    bodies, variation = int(random.integers(FEWEST, SCALED_MOST + 1)), int(random.integers(8))
    scene = swarm(kind, bodies, number, variation)
    if random.random() < 0.5:
        scene = scene.replace(arena=None, position=scene.position - np.round(scene.position.mean(axis=0)))
    if scene.arena is None and random.random() < 0.75:
        away = random.choice([-1.0, 0.0, 1.0], 2) * 2.0 ** random.integers(20, 48)
        with suppress(SceneError):  # so far away that rounded bodies overlap
            scene = scene.replace(position=scene.position + away, turns=scene.turns)
    # Not much slower: while nothing happens the kernel moves the base of its clock every 4,096 time units.
    slower, larger = 2.0 ** float(random.integers(-40, 5)), 2.0 ** float(random.integers(-40, 41))
    return viewed(scene, larger, slower)


DRAWS = {
    "swarms": numbered(partial(swarm_numbered, KINDS)),
    "giants": numbered(partial(swarm_numbered, GIANTS)),
    "bursts": numbered(partial(swarm_numbered, BURSTS)),
    "corridors": numbered(partial(swarm_numbered, CORRIDORS)),
    "scaled swarms": numbered(scaled),
}
