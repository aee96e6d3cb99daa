"""Encounters of two discs that are hard to tell from misses, and their exact ticks.

An encounter is a row of ``ENCOUNTER``: the arguments of ``touch``, the second disc seen m and n periods
away. A family is a function of a generator and a count that returns that many rows. The families of
``kinetile_accuracy.hard_cases`` are compared in ``test_queries.py`` there.
"""

import math
from collections.abc import Callable

import numpy as np

from kinetile.kernel.certificates.discs import closely, parting, touch, touch_about
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.certificates.walls import reaches
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.kernel.tables import NEVER
from kinetile_accuracy.specification.arithmetic import UNIT_BITS, FlightPlan, Frame, Separation, wall_tick
from kinetile_accuracy.specification.touching import parting_tick, touching_tick

FAR = 1 << 62
ENCOUNTER = np.dtype(
    [(name, "f8") for name in ("x", "y", "vx", "vy")]
    + [("elapsed", "i8")]
    + [(name, "f8") for name in ("x2", "y2", "vx2", "vy2", "radius", "radius2", "tick")]
    + [(name, "f8") for name in ("m", "n", "width", "height")]
)
Rng = np.random.Generator
Rows = np.ndarray
TICK = 2.0**-52

if NOTHING_IS_COMPILED:

    def compiled(function):
        return function

else:
    import numba

    def compiled(function):
        return numba.njit(error_model="numpy")(function)


@compiled
def plans(row):
    """Return the plans of a row of encounters."""
    return Plans(
        Axis(row.x, row.vx, 0.0, row.x2, row.vx2, 0.0, row.m, row.width, 0.0, 0.0),
        Axis(row.y, row.vy, 0.0, row.y2, row.vy2, 0.0, row.n, row.height, 0.0, 0.0),
        row.elapsed,
        row.tick,
        1.0 / row.tick,
    )


@compiled
def answer_all(table, found):
    """Write what ``touch``, ``closely``, ``parting`` and ``touch_about`` return for each row, the last from a
    guess that is earlier, by a tick or by half of all time."""
    for i in range(len(table)):
        row = table[i]
        found[i, 0] = touch(plans(row), row.radius, row.radius2, 0, -1, 0)
        found[i, 1] = closely(plans(row), row.radius, row.radius2, 1, 0, -1, 0)
        found[i, 2] = parting(plans(row), row.radius, row.radius2, 0)
        guess = min(found[i, 0], FAR) - (1 << (i % 61))
        found[i, 3] = touch_about(plans(row), row.radius, row.radius2, max(guess, 0))


@compiled
def reach_all(table, found):
    """Write what ``reaches`` returns for each row: far, near, radius, speed, tick."""
    for i in range(len(table)):
        far, near, radius, speed, tick = table[i]
        found[i] = reaches(far, near, radius, -speed, 0.0, tick, 1.0 / tick)


def answers(table: Rows) -> list[list[int]]:
    """Return of each row the ticks at which the discs touch, by all stages and by all but the first, at which
    they part, and again at which they touch, from a guess."""
    found = np.zeros((len(table), 4), dtype=np.int64)
    answer_all(table.view(np.recarray), found)
    return found.tolist()


def touches(table: Rows) -> list[int]:
    return [touch for touch, *_ in answers(table)]


def reached(table: Rows) -> list[int]:
    found = np.zeros(len(table), dtype=np.int64)
    reach_all(table, found)
    return found.tolist()


def true_answer(
    x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, m=0, n=0, *sides
) -> list[int]:
    """Return what ``answers`` must of a row: rules 5 and 11 of the specification."""
    frame = Frame(sides or None, 1 - math.frexp(tick)[1] - UNIT_BITS, sides or (0.0, 0.0))
    one = FlightPlan(x, y, vx, vy, 0, radius, frame)
    two = FlightPlan(x2, y2, vx2, vy2, int(elapsed), radius2, frame)
    pair = Separation(one, two, frame, (int(m), int(n)))
    found = touching_tick(None, pair), parting_tick(None, pair, pair.since)
    touch, part = (NEVER if tick is None else tick - int(elapsed) for tick in found)
    return [touch, touch, part, touch]


def true_reach(far: float, near: float, radius: float, speed: float, tick: float) -> int:
    """Return what ``reaches`` must: rule 6 of the specification."""
    frame = Frame((far, far), 1 - math.frexp(tick)[1] - UNIT_BITS)
    found = wall_tick(FlightPlan(near, 0.0, speed, 0.0, 0, radius, frame), frame)
    return NEVER if found is None else found[0]


def rows(n: int, /, **columns) -> Rows:
    made = np.zeros(n, dtype=ENCOUNTER)
    made["tick"] = TICK
    for name, values in columns.items():
        made[name] = values
    return made


def mirrored(table: Rows) -> Rows:
    """Return the same encounters with the bodies in the other order; only where the anchors are one."""
    other = table.copy()
    for name in ("x", "y", "vx", "vy"):
        other[name], other[name + "2"] = table[name + "2"], table[name]
    other["radius"], other["radius2"] = table["radius2"], table["radius"]
    other["m"], other["n"] = -table["m"], -table["n"]
    return other


def aimed(rng: Rng, n: int, distance, reach, miss, speed=1.0, at=None) -> Rows:
    """Return discs at a distance whose paths pass at ``miss`` times the sum of their radii."""
    angle = rng.uniform(0.0, 2.0 * np.pi, n)
    ahead = np.column_stack([np.cos(angle), np.sin(angle)])
    side = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    b = (np.broadcast_to(reach, n) * miss)[:, None]
    d = np.broadcast_to(distance, n)[:, None]
    apart = -ahead * np.sqrt(np.maximum(d * d - b * b, 0.0)) - side * b
    place = rng.uniform(0.0, 1.0, (n, 2)) if at is None else at
    drift = rng.normal(size=(n, 2)) * np.broadcast_to(speed, n)[:, None]
    second = place + apart
    fast = drift + ahead * (np.broadcast_to(speed, n) * rng.uniform(0.3, 2.0, n))[:, None]
    part = rng.uniform(0.2, 0.8, n)
    return rows(
        n,
        x=place[:, 0],
        y=place[:, 1],
        vx=drift[:, 0],
        vy=drift[:, 1],
        x2=second[:, 0],
        y2=second[:, 1],
        vx2=fast[:, 0],
        vy2=fast[:, 1],
        radius=reach * part,
        radius2=reach * (1.0 - part),
    )


def wait(rng: Rng, table: Rows, most: float) -> Rows:
    """Let the first disc have been under way for up to 2^most ticks, from where it came."""
    table["elapsed"] = (2.0 ** rng.uniform(30.0, most, len(table))).astype(np.int64)
    table["elapsed"] -= rng.integers(0, table["elapsed"] >> 20)  # else no count above 2^53 is odd
    time = table["elapsed"] * table["tick"]
    table["x"] -= table["vx"] * time
    table["y"] -= table["vy"] * time
    return table


def gas(rng: Rng, n: int, spacing: float = 3.0) -> Rows:
    reach = 0.02
    distance = reach * rng.uniform(1.0, spacing, n)
    return wait(rng, aimed(rng, n, distance, reach, rng.uniform(-1.2, 1.2, n)), 51.0)


def dyadic(rng: Rng, n: int) -> Rows:
    def some(most: int, size: float) -> np.ndarray:
        return rng.integers(-most, most + 1, n) * size

    return rows(
        n,
        **{name: some(16, 0.125) for name in ("x", "y", "x2", "y2")},
        **{name: some(4, 0.5) for name in ("vx", "vy", "vx2", "vy2")},
        elapsed=rng.integers(0, 9, n) << 50,
        radius=rng.choice([0.125, 0.25, 0.5], n),
        radius2=rng.choice([0.125, 0.25, 0.5], n),
    )


TRIPLES = np.array([(3, 4, 5), (5, 12, 13), (8, 15, 17), (7, 24, 25), (20, 21, 29)], dtype=float)


def sliding(rng: Rng, n: int) -> Rows:
    """Touching or overlapping, and moving along the line of contact but for last bits, if at all."""
    a, b, c = TRIPLES[rng.integers(0, len(TRIPLES), n)].T
    size = rng.choice([1.0, 0.1, 2.0**-7], n)
    speed = rng.choice([1.0, 0.3, -1.0, -0.7], n)
    ulps = rng.integers(-2, 3, (2, n)) * (rng.random(n) < 0.7)
    vx, vy = -b * speed, a * speed
    return rows(
        n,
        x2=size * a,
        y2=size * b,
        vx2=vx + ulps[0] * np.spacing(vx),
        vy2=vy + ulps[1] * np.spacing(vy),
        radius=size * c * rng.choice([1.0, 1.001], n),
    )


def graze(rng: Rng, n: int) -> Rows:
    """Passes the sum of the radii by a relative depth between powers of ten."""
    depth = 10.0 ** rng.uniform(-17.0, -3.0, n) * rng.choice([-1.0, 1.0], n)
    reach = 0.02
    table = aimed(rng, n, reach * 10.0 ** rng.uniform(0.01, 2.0, n), reach, 1.0 + depth)
    return wait(rng, table, 51.0)


def coarse(rng: Rng, n: int) -> Rows:
    """Far from the origin, fast, and nearly past each other: a Newton step has ticks to go, and bends."""
    at = rng.choice([-1.0, 1.0], (n, 2)) * 10.0 ** rng.uniform(3.0, 9.0, (n, 1))
    miss = 1.0 - 10.0 ** rng.uniform(-16.0, -6.0, n)
    speed = np.ldexp(1.0, rng.integers(8, 32, n))
    return aimed(rng, n, 0.02 * rng.uniform(1.0, 5.0, n), 0.02, miss, speed=speed, at=at)


def sized(table: Rows, length: np.ndarray, speed: np.ndarray, least: int) -> Rows:
    """Make lengths and speeds larger by powers of two, and the clock's unit to go with them."""
    for name in ("x", "y", "x2", "y2", "radius", "radius2"):
        table[name] = np.ldexp(table[name], length)
    for name in ("vx", "vy", "vx2", "vy2"):
        table[name] = np.ldexp(table[name], speed)
    table["tick"] = np.ldexp(1.0, np.clip(length - speed - 52, least, -52))
    return table


def scaled(rng: Rng, n: int) -> Rows:
    """The gas, with lengths and speeds up to 2^150 from 1."""
    length, speed = rng.integers(-150, 151, (2, n))
    return sized(gas(rng, n), length, np.minimum(speed, length + 60), -900)


def one_size(rng: Rng, n: int) -> Rows:
    """The gas at any scale at all: lengths of one size, subnormal to 2^900, and speeds of another."""
    return sized(gas(rng, n), *rng.integers(-1080, 901, (2, n)), -952)


def fast(rng: Rng, n: int) -> Rows:
    """A tick's flight is some part, or some times, of the discs: both roots may lie within one tick."""
    table = aimed(rng, n, 0.02 * 10.0 ** rng.uniform(0.0, 3.0, n), 0.02, rng.uniform(-1.001, 1.001, n))
    size = rng.integers(35, 60, n)
    for name in ("vx", "vy", "vx2", "vy2"):
        table[name] = np.ldexp(table[name], size)
    return table


def anything(rng: Rng, n: int) -> Rows:
    """Each number anywhere between a subnormal one and 2^900."""

    def number() -> np.ndarray:
        size = np.where(rng.random(n) < 0.3, rng.integers(-1074, 901, n), rng.integers(-60, 61, n))
        value = np.ldexp(rng.uniform(0.5, 1.0, n) * rng.choice([-1.0, 1.0], n), size)
        return np.where(rng.random(n) < 0.1, 0.0, value)

    table = rows(n, **{name: number() for name in ENCOUNTER.names[:4] + ENCOUNTER.names[5:11]})
    table["radius"], table["radius2"] = np.abs(table["radius"]), np.abs(table["radius2"])
    table["elapsed"] = (2.0 ** rng.uniform(0.0, 62.0, n)).astype(np.int64) * rng.integers(0, 2, n)
    table["tick"] = np.ldexp(1.0, rng.integers(-952, -51, n))
    return table


def at_ticks(rng: Rng, n: int) -> Rows:
    """Head on along an axis, touching exactly at a tick, or a last bit beside it; some at 2^62."""
    ticks = np.where(
        rng.random(n) < 0.2, FAR - rng.integers(-1, 3, n), 2.0 ** rng.uniform(0.0, 61.9, n)
    ).astype(np.int64)
    ticks = np.where(rng.random(n) < 0.5, ticks & -(1 << 20), ticks)
    speed = rng.integers(1, 64, n) * 2.0 ** rng.integers(-30, 20, n)
    reach = rng.integers(1, 64, n) * 2.0**-10
    small = rng.random(n) < 0.2  # a last bit of these is less than any bound
    ticks, reach = np.where(small, ticks & 63, ticks), np.where(small, reach * 2.0**-60, reach)
    distance = ticks * TICK * speed + reach
    table = rows(n, x2=distance, vx2=-speed, radius=reach)
    nudged = rng.random(n) < 0.3
    table["x2"] = np.where(nudged, np.nextafter(table["x2"], rng.choice([0.0, 1e300], n)), table["x2"])
    return table


def images(rng: Rng, n: int) -> Rows:
    """Seen up to three periods away, half of them on a lattice."""
    lattice = rng.random(n) < 0.5
    names = ("x", "y", "vx", "vy", "x2", "y2", "vx2", "vy2")
    made = {name: np.where(lattice, rng.integers(-6, 7, n) / 4, rng.uniform(-2.0, 2.0, n)) for name in names}
    sides = np.array([(1.5, 2.0), (0.1, 7.3), (1.0, 1.0)])[rng.integers(0, 3, n)].T
    return rows(
        n,
        **made,
        elapsed=rng.choice([0, 1 << 52, (1 << 53) + 12345], n),
        radius=np.where(lattice, rng.choice([0.25, 0.5], n), rng.uniform(0.1, 1.0, n)),
        radius2=np.where(lattice, 0.25, 0.3),
        **dict(zip("mn", rng.integers(-3, 4, (2, n)), strict=True)),
        **dict(zip(("width", "height"), sides, strict=True)),
    )


def walls(rng: Rng, n: int) -> Rows:
    """Return rows of (far, near, radius, speed, tick): of a box, of a lattice, at ticks, touching, and of
    any size."""
    kind = rng.integers(0, 5, n)
    far = rng.uniform(0.0, 1.0, n)
    near = np.where(rng.random(n) < 0.5, 0.0, far * rng.uniform(-0.5, 1.0, n))
    radius = rng.uniform(0.0, 0.1, n) + 1e-9
    speed = 10.0 ** rng.uniform(-4.0, 2.0, n)
    made = np.column_stack([far, near, radius, speed, np.full(n, TICK)])
    lattice = np.column_stack([rng.integers(1, 64, n), rng.integers(0, 16, n), rng.integers(1, 8, n)]) * 0.125
    at = (2.0 ** rng.uniform(0.0, 62.1, n)).astype(np.int64) * TICK * np.floor(1.0 + 8.0 * rng.random(n))
    made[kind == 1, :3] = lattice[kind == 1]
    made[kind == 1, 3] = np.ldexp(1.0, rng.integers(-3, 3, n))[kind == 1]
    made[kind == 2, 0] = (at + 0.25)[kind == 2]
    made[kind == 2, 1:3] = 0.0, 0.25
    made[kind == 2, 3] = rng.integers(1, 9, n)[kind == 2]
    made[kind == 3, 0] = (near + radius * (1.0 + rng.integers(-4, 5, n) * 2.0**-53))[kind == 3]
    sizes = np.where(rng.random((n, 4)) < 0.5, rng.integers(-1074, 901, (n, 4)), rng.integers(-2, 3, (n, 4)))
    made[kind == 4, :4] = np.ldexp(rng.uniform(0.5, 1.0, (n, 4)), sizes)[kind == 4]
    made[kind == 4, 4] = np.ldexp(1.0, rng.integers(-952, -51, n))[kind == 4]
    made[:, 2] = np.maximum(made[:, 2], 5e-324)
    return made


def true_reaches(table: Rows) -> list[int]:
    return [true_reach(*row) for row in table.tolist()]


FAMILIES: dict[str, Callable[[Rng, int], Rows]] = {
    "gas": gas,
    "dyadic": dyadic,
    "sliding": sliding,
    "graze": graze,
    "coarse": coarse,
    "scaled": scaled,
    "fast": fast,
    "anything": anything,
    "one size": one_size,
    "at ticks": at_ticks,
    "images": images,
}


def true_answers(table: Rows) -> list[list[int]]:
    return [true_answer(*row) for row in table.tolist()]
