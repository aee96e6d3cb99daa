"""Encounters of two discs that are hard to tell from misses, and their exact ticks.

An encounter is a row of ``ENCOUNTER``: the arguments of ``touch``, with the second disc m and n periods away,
with and without accelerations. A family is a function of a generator and a count; it returns so many rows.
The families of ``kinetile_accuracy.hard_cases`` are compared in ``test_queries.py`` there.
"""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np

from kinetile.kernel.certificates.discs import accelerated_touch_about, closely, parting, touch, touch_about
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.certificates.walls import reaches_edge
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.kernel.tables import NEVER
from kinetile_accuracy.specification.arithmetic import UNIT_BITS, FlightPlan, Frame, Separation
from kinetile_accuracy.specification.signs import first_fall
from kinetile_accuracy.specification.touching import parting_tick, touching_tick

FAR = 1 << 62
ENCOUNTER = np.dtype(
    [(name, "f8") for name in ("x", "y", "vx", "vy")]
    + [("elapsed", "i8")]
    + [(name, "f8") for name in ("x2", "y2", "vx2", "vy2", "radius", "radius2", "tick")]
    + [(name, "f8") for name in ("m", "n", "width", "height", "ax", "ay", "ax2", "ay2")]
    + [("since", "i8")]
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
    """Returns the plans of a row of encounters."""
    return Plans(
        Axis(row.x, row.vx, row.ax, row.x2, row.vx2, row.ax2, row.m, row.width, 0.0, 0.0),
        Axis(row.y, row.vy, row.ay, row.y2, row.vy2, row.ay2, row.n, row.height, 0.0, 0.0),
        row.elapsed,
        row.tick,
        1.0 / row.tick,
    )


@compiled
def answer_all(table, found):
    """Writes the ticks of each row: of contact, from ``since`` on, by all stages and without the first two;
    of contact if they have just met; of parting; and again of contact, from two guesses."""
    for i in range(len(table)):
        row = table[i]
        both = plans(row)
        found[i, 0] = touch(both, row.radius, row.radius2, 0, -1, row.since)
        found[i, 1] = closely(both, row.radius, row.radius2, 1, 0, -1, row.since)
        found[i, 2] = touch(both, row.radius, row.radius2, 1, -1, 0)
        found[i, 3] = parting(both, row.radius, row.radius2, row.since)
        for k in range(2):
            guess = max(min(found[i, 0], FAR) - (1 << (i % 61)), -k) if k == 0 else 1 << (i % 62)
            if row.ax == 0.0 and row.ax2 == 0.0 and row.ay == 0.0 and row.ay2 == 0.0 and row.since == 0:
                found[i, 4 + k] = touch_about(both, row.radius, row.radius2, guess)
            else:
                found[i, 4 + k] = accelerated_touch_about(both, row.radius, row.radius2, 0, guess, row.since)


@compiled
def reach_all(table, found):
    """Writes what ``reaches_edge`` returns for each row: far, near, radius, slope, pull, tick."""
    for i in range(len(table)):
        far, near, radius, slope, pull, tick = table[i]
        found[i] = reaches_edge(far, near, radius, slope, pull, tick, 1.0 / tick)


def answers(table: Rows) -> list[list[int]]:
    """Returns the values that ``answer_all`` writes for each row."""
    found = np.zeros((len(table), 6), dtype=np.int64)
    answer_all(table.view(np.recarray), found)
    return found.tolist()


def touches(table: Rows) -> list[int]:
    return [touch for touch, *_ in answers(table)]


def reached(table: Rows) -> list[int]:
    found = np.zeros(len(table), dtype=np.int64)
    reach_all(table, found)
    return found.tolist()


def true_answer(row: np.void) -> list[int]:
    """Returns the right values of ``answers`` for a row: rules 5, 7 and 11 of the specification."""
    of = dict(zip(ENCOUNTER.names, row.tolist(), strict=True))
    sides = of["width"], of["height"]
    frame = Frame(sides, 1 - math.frexp(of["tick"])[1] - UNIT_BITS, sides)
    one, two = (
        FlightPlan(
            of["x" + n], of["y" + n], of["vx" + n], of["vy" + n], at, of["radius" + n], frame, pull=pull
        )
        for n, at, pull in (("", 0, (of["ax"], of["ay"])), ("2", of["elapsed"], (of["ax2"], of["ay2"])))
    )
    pair = Separation(one, two, frame, (int(of["m"]), int(of["n"])))
    since = of["elapsed"] + of["since"]
    found = touching_tick(None, pair, False, since), touching_tick(None, pair, True)
    touch, again, part = (
        NEVER if tick is None else tick - of["elapsed"] for tick in (*found, parting_tick(None, pair, since))
    )
    return [touch, touch, again, part, touch, touch]


def true_reach(far: float, near: float, radius: float, slope: float, pull: float, tick: float) -> int:
    """Returns the right value of ``reaches_edge``: rule 6 of the specification."""
    numbers = map(Fraction, (far, near, radius, slope, pull, tick))
    far, near, radius, slope, pull, tick = numbers
    found = first_fall(whole([far - near - radius, slope * tick, pull * tick * tick / 2]))
    return NEVER if found is None else found


def whole(p: list[Fraction]) -> list[int]:
    """Returns a polynomial times a number that makes it whole."""
    common = math.lcm(*(each.denominator for each in p))
    return [int(each * common) for each in p]


def rows(n: int, /, **columns) -> Rows:
    made = np.zeros(n, dtype=ENCOUNTER)
    made["tick"] = TICK
    for name, values in columns.items():
        made[name] = values
    return made


def mirrored(table: Rows) -> Rows:
    """Returns the same encounters with the bodies in the other order; only rows with one anchor."""
    other = table.copy()
    for name in ("x", "y", "vx", "vy", "ax", "ay"):
        other[name], other[name + "2"] = table[name + "2"], table[name]
    other["radius"], other["radius2"] = table["radius2"], table["radius"]
    other["m"], other["n"] = -table["m"], -table["n"]
    return other


def aimed(rng: Rng, n: int, distance, reach, miss, speed=1.0, at=None) -> Rows:
    """Returns discs at a distance whose paths pass at ``miss`` times the sum of their radii."""
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
    """Anchors the first disc up to 2^most ticks earlier, on the same line."""
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
    """Touching or overlapping, and at rest or, up to last bits, moving along the line of contact."""
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
    """Makes lengths and speeds larger by powers of two, and the clock's unit to go with them."""
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


PLAN = ("x", "v", "a", "x2", "v2", "a2")


def of(axis: str, name: str) -> str:
    """Returns the column of a place, velocity, acceleration, number of periods or period along an axis."""
    named = {"x": axis, "x2": axis + "2", "turns": "mn"["xy".index(axis)]}
    named["period"] = ("width", "height")["xy".index(axis)]
    return named.get(name, name[0] + axis + name[1:])


def accelerated_gas(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs of discs near each other, each with an acceleration."""
    table = rows(n)
    table["tick"] = 2.0**-52
    for axis in "xy":
        table[of(axis, "x")] = rng.uniform(0.0, 1.0, n)
        table[of(axis, "x2")] = table[of(axis, "x")] + rng.uniform(-0.2, 0.2, n)
        for name in ("v", "a", "v2", "a2"):
            table[of(axis, name)] = rng.normal(size=n)
    table["radius"], table["radius2"] = rng.uniform(0.005, 0.1, (2, n))
    table["elapsed"] = (2.0 ** rng.uniform(0.0, 52.0, n)).astype(np.int64) * rng.integers(0, 2, n)
    return backed(table)


def backed(table: np.ndarray) -> np.ndarray:
    """Moves the first discs back to their places of some ``elapsed`` ticks ago."""
    time = table["elapsed"] * table["tick"]
    for axis in "xy":
        table[of(axis, "v")] -= table[of(axis, "a")] * time
        table[of(axis, "x")] -= (table[of(axis, "v")] + 0.5 * table[of(axis, "a")] * time) * time
    return table


def equal(rng: Rng, n: int) -> np.ndarray:
    table = accelerated_gas(rng, n)
    for axis in "xy":
        table[of(axis, "a2")] = table[of(axis, "a")]
    return table


def immovable(rng: Rng, n: int) -> np.ndarray:
    table = accelerated_gas(rng, n)
    which = "2" if rng.random() < 0.5 else ""
    for axis in "xy":
        table[of(axis, "v" + which)] = table[of(axis, "a" + which)] = 0.0
    return backed(table)


def accelerated_lattice(rng: Rng, n: int) -> np.ndarray:
    """Returns dyadic numbers: roots of Q and of its derivatives at whole ticks, and several at once."""
    table = accelerated_gas(rng, n)
    for axis in "xy":
        for name, most, size in zip(PLAN, (8, 4, 2) * 2, (0.25, 0.5, 1.0) * 2, strict=True):
            table[of(axis, name)] = rng.integers(-most, most + 1, n) * size * (rng.random(n) < 0.7)
    table["elapsed"] = rng.integers(0, 5, n) << rng.choice([0, 50], n)
    table["radius"], table["radius2"] = rng.choice([0.125, 0.25, 0.5], (2, n))
    table["tick"] = rng.choice([2.0**-52, 2.0**-60, 2.0**-53], n)
    return table


def accelerated_coarse(rng: Rng, n: int) -> np.ndarray:
    """Returns discs of the lattice at speeds that make ticks long: all is within a few of them."""
    table = accelerated_lattice(rng, n)
    size = rng.integers(48, 56, n)
    for axis in "xy":
        for name in ("v", "v2"):
            table[of(axis, name)] = np.ldexp(table[of(axis, name)], size)
        for name in ("a", "a2"):
            table[of(axis, name)] = np.ldexp(table[of(axis, name)], 2 * size)
    table["elapsed"] = rng.integers(0, 5, n)
    return table


def accelerated_graze(rng: Rng, n: int) -> np.ndarray:
    """Returns paths that come as near as the radii and no nearer, but for last bits."""
    table = [accelerated_gas, equal, immovable, under_way][rng.integers(0, 4)](rng, n)
    time = table["elapsed"] * table["tick"]
    t = rng.uniform(0.0, 1.0, n)
    for _ in range(12):
        d, v, b = (np.zeros((2, n)) for _ in range(3))
        for i, axis in enumerate("xy"):
            x, v1, a, x2, v2, a2 = (table[of(axis, name)] for name in PLAN)
            b[i] = a2 - a
            v[i] = v2 - v1 - a * time + b[i] * t
            d[i] = (x2 - x - (v1 + 0.5 * a * time) * time) + (v[i] - 0.5 * b[i] * t) * t
        bend = (v * v + d * b).sum(axis=0)
        t = np.maximum(t - np.clip((d * v).sum(axis=0) / np.where(bend == 0.0, 1.0, bend), -0.3, 0.3), 0.0)
    table["radius"] = np.hypot(*d) - table["radius2"]
    table["radius"] += np.spacing(table["radius"]) * rng.integers(-3, 4, n)
    table["radius"] = np.maximum(table["radius"], 1e-9)
    return table


def resting(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs that touch but for last bits, hardly move, and fall together, or slide."""
    table = [accelerated_gas, accelerated_lattice][rng.integers(0, 2)](rng, n)
    table["elapsed"] = 0
    table["radius"], table["radius2"] = 0.25, rng.choice([0.25, 0.1], n)
    reach = table["radius"] + table["radius2"]
    angle = rng.integers(0, 8, n) * np.pi / 4 + rng.choice([0.0, 0.3], n)
    size = rng.choice([0.0, 2.0**-60, 2.0**-53, 1e-9, 1.0], n)
    for axis, way in (("x", np.cos(angle)), ("y", np.sin(angle))):
        table[of(axis, "x2")] = table[of(axis, "x")] + way * reach
        table[of(axis, "x2")] += np.spacing(table[of(axis, "x2")]) * rng.integers(-1, 2, n)
        table[of(axis, "v2")] = table[of(axis, "v")] + way * size * rng.choice([1.0, -1.0, 0.1], n)
        table[of(axis, "a2")] = np.where(
            rng.random(n) < 0.5, table[of(axis, "a")] - way, table[of(axis, "a2")]
        )
    return table


def under_way(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs with one disc anchored up to 2^60 ticks ago."""
    table = accelerated_gas(rng, n)
    table["tick"] = 2.0 ** rng.choice([-52.0, -60.0], n)
    table["elapsed"] = (2.0 ** rng.uniform(50.0, 60.0, n)).astype(np.int64) + rng.integers(0, 1 << 20, n)
    return backed(table)


def unlike(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs with ratios of up to 10^6 between their radii, speeds and accelerations."""
    table = [accelerated_gas, equal][rng.integers(0, 2)](rng, n)
    table["radius"] *= 10.0 ** rng.uniform(-6.0, 6.0, n)
    for axis in "xy":
        for name in ("x2", "v", "a"):
            table[of(axis, name)] *= 10.0 ** rng.uniform(-6.0, 6.0, n)
    return table


def accelerated_anything(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs with numbers of any size that a scene may have, and ticks of any length."""

    def number() -> np.ndarray:
        size = np.where(rng.random(n) < 0.3, rng.integers(-199, 200, n), rng.integers(-40, 41, n))
        value = np.ldexp(rng.uniform(0.5, 1.0, n) * rng.choice([-1.0, 1.0], n), size)
        return np.where(rng.random(n) < 0.2, 0.0, value)

    table = rows(n)
    for axis in "xy":
        for name in PLAN:
            table[of(axis, name)] = number()
        table[of(axis, "period")] = np.abs(number()) * rng.integers(0, 2, n)
        table[of(axis, "turns")] = rng.integers(-(1 << 31), (1 << 31) + 1, n)
    table["radius"], table["radius2"] = np.abs(number()), np.abs(number())
    table["elapsed"] = (2.0 ** rng.uniform(0.0, 62.0, n)).astype(np.int64) * rng.integers(0, 2, n)
    table["tick"] = np.ldexp(1.0, np.where(rng.random(n) < 0.5, -52, rng.integers(-952, -51, n)))
    return table


def accelerated_images(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs with the second disc seen up to 2^31 periods further on."""
    kinds = accelerated_gas, equal, accelerated_lattice, accelerated_graze, resting, under_way
    table = kinds[rng.integers(0, 6)](rng, n)
    for axis in "xy":
        turns = np.trunc(2.0 ** rng.uniform(0.0, 31.0, n)) * rng.integers(-1, 2, n)
        period = rng.choice([0.0, 0.7, 1.0, 3.0, 2.0**-20], n)
        table[of(axis, "turns")], table[of(axis, "period")] = turns, period
        table[of(axis, "x2")] -= turns * period
    return table


def walls(rng: Rng, n: int) -> Rows:
    """Returns rows of (far, near, radius, slope, 0, tick): in a box, on a lattice, at ticks, touching, and of
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
    return np.column_stack([made[:, :3], -made[:, 3], np.zeros(n), made[:, 4]])


def accelerated_walls(rng: Rng, n: int) -> np.ndarray:
    """Returns rows of (far, near, radius, slope, pull, tick): of one size, on a lattice, touching up to last
    bits, of any size, and with long ticks."""
    kind = rng.integers(0, 5, n)
    made = np.zeros((n, 6))
    made[:, :3] = rng.random((n, 3)) * [2.0, 1.0, 0.25]
    made[:, 3:5] = rng.normal(size=(n, 2))
    made[:, 5] = 2.0**-52
    dyadic = rng.integers([0, 0, 1, -16, -4], [17, 9, 3, 17, 5], (n, 5)) / [8, 8, 8, 8, 2]
    vertex = made[:, 3] ** 2 / made[:, 4] / 2
    made[kind == 2, 0] = (made[:, 1] + made[:, 2] + vertex * rng.integers(0, 2, n))[kind == 2]
    made[kind == 2, 3] *= rng.choice([1.0, 1e-6, 1e-16, 0.0], n)[kind == 2]
    made[kind == 1, :5] = dyadic[kind == 1]
    sizes = np.where(rng.random((n, 5)) < 0.3, rng.integers(-200, 201, (n, 5)), rng.integers(-2, 3, (n, 5)))
    made[kind == 3, :5] = np.ldexp(made[:, :5], sizes)[kind == 3]
    made[kind == 3, 5] = np.ldexp(1.0, rng.choice([-952, -99, -70, -52], n))[kind == 3]
    made[kind == 4, :5] = np.ldexp(dyadic, [0, 0, 0, 51, 102])[kind == 4]
    return made


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
FAMILIES |= {
    each.__name__: each
    for each in (
        accelerated_gas,
        equal,
        immovable,
        accelerated_lattice,
        accelerated_coarse,
        accelerated_graze,
        resting,
        under_way,
        unlike,
        accelerated_anything,
        accelerated_images,
    )
}


def true_answers(table: Rows) -> list[list[int]]:
    return [true_answer(row) for row in table]
