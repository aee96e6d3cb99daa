"""When accelerated bodies touch, part or reach a wall: ticks against whole numbers of Python."""

import math
from bisect import bisect_left
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

import lanes
from encounters import compiled
from kinetile.kernel.certificates.bent import BentAxis, BentPlans, bent_parting, bent_touch, bent_wall
from kinetile.kernel.certificates.quadratic import first_below
from kinetile.kernel.tables import NEVER

LIMIT = 1 << 62
UNIT = 1 << 52

PLAN = ("x", "v", "a", "x2", "v2", "a2")
QUESTION = np.dtype(
    [(axis + name, "f8") for axis in ("x_", "y_") for name in (*PLAN, "turns", "period")]
    + [("elapsed", "i8"), ("radius", "f8"), ("radius2", "f8"), ("tick", "f8"), ("since", "i8")]
)
Rng = np.random.Generator


def polynomial(row) -> list[int]:
    """Returns the coefficients of Q by ticks after the later anchor, times a number that makes them whole."""
    axes = [[Fraction(each) for each in row[:8]], [Fraction(each) for each in row[8:16]]]
    elapsed, tick = int(row[16]), Fraction(row[19])
    q = [Fraction(0)] * 5
    for x, v, a, x2, v2, a2, turns, period in axes:
        v, a, v2, a2 = v * tick, a * tick * tick, v2 * tick, a2 * tick * tick
        x2 = x2 + turns * period
        d = [x2 - x - v * elapsed - a * elapsed * elapsed / 2, v2 - v - a * elapsed, (a2 - a) / 2]
        for i in range(3):
            for j in range(3):
                q[i + j] += d[i] * d[j]
    q[0] -= (Fraction(row[17]) + Fraction(row[18])) ** 2
    return whole(q)


def whole(q: list[Fraction]) -> list[int]:
    scale = math.lcm(*(each.denominator for each in q))
    return [int(each * scale) for each in q]


def at(c: list[int], n: int) -> int:
    value = 0
    for each in reversed(c):
        value = value * n + each
    return value


def first_with(is_so, low: int, high: int) -> int:
    """Returns the first number after ``low`` of which something is so, as it is of all up to ``high``."""
    return low + 1 + bisect_left(range(low + 1, high), True, key=is_so)


def pieces(c: list[int]) -> list[int]:
    """Returns ticks between which a polynomial is monotone, or which are neighbours: beside each root of its
    derivative are two of them."""
    if len(c) <= 2:
        return [0, LIMIT]
    rate = [i * each for i, each in enumerate(c)][1:]
    inner = pieces(rate)
    ends = set(inner)
    for low, high in pairwise(inner):
        last = at(rate, high)
        if at(rate, low) * last < 0:
            change = first_with(lambda n, last=last: at(rate, n) * last > 0, low, high)
            ends |= {change - 1, change}
    return sorted(ends)


def right(c: list[int], met: bool = False, since: int = 0) -> int:
    """Returns the first tick, from ``since`` on, at which rule W holds."""
    first = [at(c, since + i) for i in range(3)]
    met = met and not first[2] - first[1] < first[1] - first[0] <= 0  # they press on each other
    for low, high in pairwise([since, *(each for each in pieces(c) if each > since)]):
        before, after = at(c, low), at(c, high)
        met = met and after <= before
        if after < before and after < 0 and not met:
            return low if before < 0 else first_with(lambda n: at(c, n) < 0, low, high) - 1
    return NEVER


@compiled
def plans_of(row):
    return BentPlans(
        BentAxis(
            row.x_x, row.x_v, row.x_a, row.x_x2, row.x_v2, row.x_a2, row.x_turns, row.x_period, 0.0, 0.0
        ),
        BentAxis(
            row.y_x, row.y_v, row.y_a, row.y_x2, row.y_v2, row.y_a2, row.y_turns, row.y_period, 0.0, 0.0
        ),
        row.elapsed,
        row.tick,
        1.0 / row.tick,
    )


@compiled
def ask_all(table, found):
    """Writes when the two of each row touch, touch again, and part, from ``since`` on; and touch, from two
    hints."""
    for i in range(len(table)):
        row = table[i]
        plans = plans_of(row)
        about = -1
        for k in range(4):
            guess = about if k > 1 else -1
            found[i, k] = bent_touch(plans, row.radius, row.radius2, k == 1, guess, row.since)
            about = max(min(found[i, 0], LIMIT) - (1 << (i % 50)), -1) if k < 2 else 1 << (i % 62)
        found[i, 4] = bent_parting(plans, row.radius, row.radius2, row.since)


@compiled
def ask_walls(table, since, found):
    """Writes when the gap of each row closes; or, from a tick ``since`` >= 0 on, is below zero at the end."""
    for i in range(len(table)):
        far, near, radius, slope, pull, tick = table[i]
        if since[i] < 0:
            found[i] = bent_wall(far, near, radius, slope, pull, tick, 1.0 / tick)
        else:
            found[i] = first_below(far, slope, pull, since[i], tick, 1.0 / tick)


def answers(table: np.ndarray) -> list[list[int]]:
    found = np.zeros((len(table), 5), dtype=np.int64)
    ask_all(table.view(np.recarray), found)
    return found.tolist()


def true_answer(row) -> list[int]:
    c = polynomial(row)
    since = row[20]
    touch = right(c, False, since)
    return [touch, right(c, True, since), touch, touch, right([-each for each in c], False, since)]


def gas(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs of discs near each other, each with an acceleration."""
    table = np.zeros(n, dtype=QUESTION)
    table["tick"] = 2.0**-52
    for axis in ("x_", "y_"):
        table[axis + "x"] = rng.uniform(0.0, 1.0, n)
        table[axis + "x2"] = table[axis + "x"] + rng.uniform(-0.2, 0.2, n)
        for name in ("v", "a", "v2", "a2"):
            table[axis + name] = rng.normal(size=n)
    table["radius"], table["radius2"] = rng.uniform(0.005, 0.1, (2, n))
    table["elapsed"] = (2.0 ** rng.uniform(0.0, 52.0, n)).astype(np.int64) * rng.integers(0, 2, n)
    return backed(table)


def backed(table: np.ndarray) -> np.ndarray:
    """Puts the first discs back to where they came from, some ``elapsed`` ticks ago."""
    time = table["elapsed"] * table["tick"]
    for axis in ("x_", "y_"):
        table[axis + "v"] -= table[axis + "a"] * time
        table[axis + "x"] -= (table[axis + "v"] + 0.5 * table[axis + "a"] * time) * time
    return table


def equal(rng: Rng, n: int) -> np.ndarray:
    table = gas(rng, n)
    for axis in ("x_", "y_"):
        table[axis + "a2"] = table[axis + "a"]
    return table


def immovable(rng: Rng, n: int) -> np.ndarray:
    table = gas(rng, n)
    which = "2" if rng.random() < 0.5 else ""
    for axis in ("x_", "y_"):
        table[axis + "v" + which] = table[axis + "a" + which] = 0.0
    return backed(table)


def lattice(rng: Rng, n: int) -> np.ndarray:
    """Returns dyadic numbers: roots of Q and of its derivatives at whole ticks, and several at once."""
    table = gas(rng, n)
    for axis in ("x_", "y_"):
        for name, most, size in zip(PLAN, (8, 4, 2) * 2, (0.25, 0.5, 1.0) * 2, strict=True):
            table[axis + name] = rng.integers(-most, most + 1, n) * size * (rng.random(n) < 0.7)
    table["elapsed"] = rng.integers(0, 5, n) << rng.choice([0, 50], n)
    table["radius"], table["radius2"] = rng.choice([0.125, 0.25, 0.5], (2, n))
    table["tick"] = rng.choice([2.0**-52, 2.0**-60, 2.0**-53], n)
    return table


def coarse(rng: Rng, n: int) -> np.ndarray:
    """Returns discs of the lattice at speeds that make ticks long: all happens within a few of them."""
    table = lattice(rng, n)
    size = rng.integers(48, 56, n)
    for axis in ("x_", "y_"):
        for name in ("v", "v2"):
            table[axis + name] = np.ldexp(table[axis + name], size)
        for name in ("a", "a2"):
            table[axis + name] = np.ldexp(table[axis + name], 2 * size)
    table["elapsed"] = rng.integers(0, 5, n)
    return table


def graze(rng: Rng, n: int) -> np.ndarray:
    """Returns paths that come as near as the radii and no nearer, but for last bits."""
    table = [gas, equal, immovable, old][rng.integers(0, 4)](rng, n)
    time = table["elapsed"] * table["tick"]
    t = rng.uniform(0.0, 1.0, n)
    for _ in range(12):
        d, v, b = (np.zeros((2, n)) for _ in range(3))
        for i, axis in enumerate(("x_", "y_")):
            x, v1, a, x2, v2, a2 = (table[axis + name] for name in PLAN)
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
    table = [gas, lattice][rng.integers(0, 2)](rng, n)
    table["elapsed"] = 0
    table["radius"], table["radius2"] = 0.25, rng.choice([0.25, 0.1], n)
    reach = table["radius"] + table["radius2"]
    angle = rng.integers(0, 8, n) * np.pi / 4 + rng.choice([0.0, 0.3], n)
    size = rng.choice([0.0, 2.0**-60, 2.0**-53, 1e-9, 1.0], n)
    for axis, way in (("x_", np.cos(angle)), ("y_", np.sin(angle))):
        table[axis + "x2"] = table[axis + "x"] + way * reach
        table[axis + "x2"] += np.spacing(table[axis + "x2"]) * rng.integers(-1, 2, n)
        table[axis + "v2"] = table[axis + "v"] + way * size * rng.choice([1.0, -1.0, 0.1], n)
        table[axis + "a2"] = np.where(rng.random(n) < 0.5, table[axis + "a"] - way, table[axis + "a2"])
    return table


def old(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs of which one was anchored up to 2^60 ticks ago."""
    table = gas(rng, n)
    table["tick"] = 2.0 ** rng.choice([-52.0, -60.0], n)
    table["elapsed"] = (2.0 ** rng.uniform(50.0, 60.0, n)).astype(np.int64) + rng.integers(0, 1 << 20, n)
    return backed(table)


def unlike(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs with ratios of up to 10^6 between their radii, speeds and accelerations."""
    table = [gas, equal][rng.integers(0, 2)](rng, n)
    table["radius"] *= 10.0 ** rng.uniform(-6.0, 6.0, n)
    for axis in ("x_", "y_"):
        for name in ("x2", "v", "a"):
            table[axis + name] *= 10.0 ** rng.uniform(-6.0, 6.0, n)
    return table


def anything(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs with numbers of any size that a scene may have, and ticks of any length."""

    def number() -> np.ndarray:
        size = np.where(rng.random(n) < 0.3, rng.integers(-199, 200, n), rng.integers(-40, 41, n))
        value = np.ldexp(rng.uniform(0.5, 1.0, n) * rng.choice([-1.0, 1.0], n), size)
        return np.where(rng.random(n) < 0.2, 0.0, value)

    table = np.zeros(n, dtype=QUESTION)
    for axis in ("x_", "y_"):
        for name in PLAN:
            table[axis + name] = number()
        table[axis + "period"] = np.abs(number()) * rng.integers(0, 2, n)
        table[axis + "turns"] = rng.integers(-(1 << 31), (1 << 31) + 1, n)
    table["radius"], table["radius2"] = np.abs(number()), np.abs(number())
    table["elapsed"] = (2.0 ** rng.uniform(0.0, 62.0, n)).astype(np.int64) * rng.integers(0, 2, n)
    table["tick"] = np.ldexp(1.0, np.where(rng.random(n) < 0.5, -52, rng.integers(-952, -51, n)))
    return table


def images(rng: Rng, n: int) -> np.ndarray:
    """Returns pairs of which the second is seen up to 2^31 periods further on."""
    table = [gas, equal, lattice, graze, resting, old][rng.integers(0, 6)](rng, n)
    for axis in ("x_", "y_"):
        turns = np.trunc(2.0 ** rng.uniform(0.0, 31.0, n)) * rng.integers(-1, 2, n)
        period = rng.choice([0.0, 0.7, 1.0, 3.0, 2.0**-20], n)
        table[axis + "turns"], table[axis + "period"] = turns, period
        table[axis + "x2"] -= turns * period
    return table


KINDS = (gas, equal, immovable, lattice, coarse, graze, resting, old, unlike, anything, images)
FAMILIES = {each.__name__: each for each in KINDS}


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", lanes.first(1, range(21), many=1))
def test_the_tick_is_the_first_of_rule_w(family, seed):  # long: a million questions
    count = lanes.examples(1_000 if seed else 60)
    rng = np.random.default_rng([seed, len(family)])
    table = FAMILIES[family](rng, count)
    for _ in range(2):
        found = answers(table)
        for each, row in zip(found, table.tolist(), strict=True):
            assert each == true_answer(row), row
        table["since"] = later(rng, found)


def later(rng: Rng, found: list[list[int]]) -> np.ndarray:
    """Returns ticks about these answers, or any."""
    count = len(found)
    about = np.array(found)[np.arange(count), rng.choice([0, 1, 4], count)] >> rng.choice([0, 0, 1], count)
    about = np.maximum(np.minimum(about, LIMIT) + rng.integers(-2, 3, count), 0)
    drawn = (2.0 ** rng.uniform(0.0, 62.0, count)).astype(np.int64)
    return np.where((about < LIMIT - 2) | (rng.random(count) < 0.1), about, drawn)


@pytest.mark.parametrize("met", [False, True])
def test_the_reference_is_the_rule_word_for_word(met):
    for i, c in enumerate(map(polynomial, coarse(np.random.default_rng(1), 200).tolist())):
        since = i % 2 * (i % 7)
        q = [at(c, n) for n in range(since, 200)]
        rises = [n for n in range(len(q) - 1) if q[n + 1] > q[n]]
        pressing = q[1] <= q[0] and q[2] - q[1] < q[1] - q[0]
        start = 0 if not met or pressing else rises[0] if rises else 199
        found = [since + n for n in range(start, len(q) - 1) if q[n + 1] < min(0, q[n])]
        assert min(right(c, met, since), 199) == (found[0] if found else 199)


def walls(rng: Rng, n: int) -> np.ndarray:
    """Returns rows of (far, near, radius, slope, pull, tick): of one size, of a lattice, touching but for
    last bits, of any size, and with long ticks."""
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


@pytest.mark.parametrize("seed", lanes.first(1, range(26), many=3))
def test_a_wall_is_reached_at_the_tick_of_rule_w_and_a_gap_is_below_zero_at_the_end_of_its_tick(seed):
    rng = np.random.default_rng(seed)
    table = walls(rng, lanes.examples(10_000 if seed else 1_000))
    since, found = np.full((2, len(table)), -1)
    for _ in range(4):
        ask_walls(table, since, found)
        for tick, first, row in zip(found.tolist(), since.tolist(), table.tolist(), strict=True):
            far, near, radius, slope, pull, unit = map(Fraction, row)
            c = whole([far - near - radius, slope * unit, pull * unit * unit / 2])
            below = first >= 0 and at(c, first + 1) < 0  # else it comes to be below zero by rule W
            assert tick == (first if below else right(c, since=max(first, 0))), row
        table[:, 0] -= table[:, 1] + table[:, 2]
        table[:, 1:3] = 0.0
        since = later(rng, np.repeat(found[:, None], 5, axis=1).tolist())
        since[since >= LIMIT] = 0


def test_a_ball_on_a_floor_and_one_at_a_ceiling_that_pulls_it_away():
    def tick(far: float, near: float, slope: float, pull: float) -> int:
        found = np.zeros(1, dtype=np.int64)
        ask_walls(np.array([[far, near, 0.25, slope, pull, 2.0**-52]]), np.array([-1]), found)
        return int(found[0])

    assert tick(2.25, 0.0, 0.0, -1.0) == 2 * UNIT
    assert tick(0.25, 0.0, 2.0, -2.0) == 2 * UNIT  # from the floor, and back at 4 and 6
    assert tick(0.25, 0.0, 0.0, 1.0) == NEVER
    assert tick(0.25, 0.0, 0.0, -1.0) == 0
    assert tick(1.25, 0.0, -1.0, 0.5) == NEVER  # comes to the wall, and no farther
    assert tick(1.25, 0.0, -1.0, 0.0) == UNIT
    assert tick(0.25, 0.0, 2.0**-53, -1.0) == 1  # rises by less than the rounding of its place
    assert tick(math.nextafter(1024.25, 0.0), 0.0, -1.0, 0.0) == LIMIT - 2**10
    assert tick(2.25, 0.0, -math.inf, 1.0) == tick(math.nan, 0.0, -1.0, 1.0) == NEVER


def test_two_discs_on_their_edges():
    def ticks(**fields) -> list[int]:
        """Returns when they touch, touch again and part: discs of radius 1/4, the first at rest at 0."""
        table = np.zeros(1, dtype=QUESTION)
        table["tick"], table["radius"], table["radius2"] = 2.0**-52, 0.25, 0.25
        for name, value in fields.items():
            table[name] = value
        touch, again, *_, part = answers(table)[0]
        return [touch, again, part]

    assert ticks(y_x2=2.5, y_a2=-1.0)[0] == 2 * UNIT  # falls on a peg
    assert ticks(y_x2=0.5, y_v2=1.0, y_a2=-1.0)[:2] == [2 * UNIT] * 2  # and again
    assert ticks(y_x2=0.5, y_v2=-1.0, y_a2=1.0)[:2] == [0, NEVER]  # just met, it comes out on this side again
    assert ticks(y_x2=0.5, y_v2=-1.0)[2] == UNIT  # through it
    assert ticks(y_x2=0.5, y_a2=-1.0)[:2] == [0, 0]  # rests on a peg: they press on each other
    assert ticks(y_x2=0.5, y_v2=2.0**-53, y_a2=-1.0)[:2] == [1, 1]  # level for a tick
    assert ticks(y_x2=0.5, y_v2=-(2.0**-60), y_a2=-1.0)[:2] == [0, 0]
    assert ticks(y_x2=0.5, y_v2=-1.0, y_a2=-1.0, y_a=-1.0)[:2] == [0, NEVER]  # they fall together
    assert ticks(y_x2=0.5, y_a2=-1.0, y_a=-1.0, x_v2=1.0)[:2] == [NEVER, NEVER]
    assert ticks(y_x2=0.5, y_v2=1.0, y_a2=-1.0, since=UNIT + 1)[:2] == [2 * UNIT] * 2  # when past its apex
    assert ticks(y_x2=1.0, y_v2=-1.0, since=UNIT // 2)[::2] == [UNIT // 2, UNIT + UNIT // 2]
    assert ticks(y_x2=1.0, y_v2=-1.0, since=UNIT // 2 + 1)[0] == UNIT // 2 + 1  # deeper in it in each
    assert ticks(y_x2=1.0, y_v2=-1.0, since=UNIT)[0] == NEVER
    assert ticks(y_x2=0.5, y_v2=-1.0, since=LIMIT) == [NEVER] * 3
    assert ticks(y_x2=0.25, y_v2=0.25, y_a2=-1.0)[0] == UNIT // 4  # stays in it, and turns back
    assert ticks(y_x2=0.5, x_v2=1.0, x_v=1.0, x_a=-1.0, x_a2=-1.0) == [NEVER] * 3
    assert ticks(y_x2=-(2.0**31), y_turns=2.0**30 + 1, y_period=2.0, y_a2=-4.0)[0] == UNIT * 0.75**0.5 // 1
    assert ticks(x_x2=1.0, y_x2=0.5 - 2.0**-50, x_v2=-(2.0**53))[0] == NEVER  # for less than a tick
    assert ticks(x_a2=math.inf) == ticks(y_x2=2.5, x_a2=math.nan) == [NEVER] * 3
