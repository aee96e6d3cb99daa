"""When two discs touch and part: ticks against integers, compiled and interpreted (rules 5, 7 and 11)."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import encounters
import lanes
from encounters import FAMILIES, FAR, TICK, answers, mirrored, reached, rows, touches, true_answers, walls
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.kernel.tables import NEVER

UNIT = 1 << 52


def assert_true(table: np.ndarray) -> None:
    found, truth = answers(table), true_answers(table)
    both = zip(found, truth, table.tolist(), strict=True)
    assert [f"{row}: {ticks}, not {true}" for ticks, true, row in both if ticks != true] == []


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", lanes.first(1, range(21), many=1))
def test_the_tick_is_that_of_the_rule(family, seed):  # long: a million questions
    count = lanes.examples(1_000 if seed else 60)
    rng = np.random.default_rng([seed, len(family)])
    table = FAMILIES[family](rng, count)
    for _ in range(2):
        assert_true(table)
        table["since"] = later(rng, answers(table))


def later(rng: np.random.Generator, found: list[list[int]]) -> np.ndarray:
    """Returns ticks about these answers, or any."""
    count = len(found)
    about = np.array(found)[np.arange(count), rng.choice([0, 2, 3], count)] >> rng.choice([0, 0, 1], count)
    about = np.maximum(np.minimum(about, FAR) + rng.integers(-2, 3, count), 0)
    drawn = (2.0 ** rng.uniform(0.0, 62.0, count)).astype(np.int64)
    return np.where((about < FAR - 2) | (rng.random(count) < 0.1), about, drawn)


@pytest.mark.parametrize("family", FAMILIES)
def test_both_orders_have_one_tick(family):
    """Where the anchors are one, neither body is the first."""
    table = FAMILIES[family](np.random.default_rng(2), lanes.examples(200))
    table["elapsed"] = 0
    assert touches(table) == touches(mirrored(table))


@pytest.mark.compiled
def test_interpreted_and_compiled_are_one(monkeypatch):
    def a_few_of_all() -> list[list[int]]:
        found = [touches(family(np.random.default_rng(5), 40)) for family in FAMILIES.values()]
        return [*found, reached(walls(np.random.default_rng(5), 200))]

    found = a_few_of_all()
    for name in ("plans", "answer_all", "reach_all"):
        monkeypatch.setattr(encounters, name, getattr(encounters, name).py_func)
    with np.errstate(all="ignore"):
        assert a_few_of_all() == found


def test_what_the_definition_says_of_edges():
    def tick(**plans: float) -> int:
        usual = {"x2": 3.0, "vx": 1.0, "radius": 0.5, "radius2": 0.5}
        return touches(rows(1, **{**usual, **plans}))[0]

    unit = 2**52
    assert tick() == 2 * unit
    assert tick(vx=0.0) == NEVER  # at rest
    assert tick(vx=-1.0) == NEVER  # receding
    assert tick(x2=1.0) == 0  # touching
    assert tick(x2=0.5) == 0  # overlapping
    assert tick(x2=1.0, vx=-1.0) == NEVER  # touching, but receding
    assert tick(x2=0.0, y2=1.0) == NEVER  # touching, and sliding
    assert tick(x2=0.0, y2=2.0**-600, vy=2.0**-600) == NEVER  # approaching, for less than a tick
    assert tick(x2=0.0, y2=2.0**-600, vx=0.0, vy=2.0**-600) == 0  # by less than a double
    assert tick(y2=1.0) == NEVER  # tangent
    assert tick(y2=math.nextafter(1.0, 0.0)) == 3 * unit - 2**26  # not by a rounding
    assert tick(x2=1025.0) == NEVER  # at 2^62
    assert tick(x2=math.nextafter(1025.0, 0.0)) == FAR - 2**10
    assert tick(vx=5e-324) == NEVER
    assert tick(x2=math.inf) == tick(vx=math.nan) == tick(radius=math.inf) == NEVER


finite = st.floats(-(2.0**900), 2.0**900)
near_one = st.floats(-2.0, 2.0)
coarse = st.integers(-64, 64).map(lambda number: number / 16)
numbers = st.one_of(near_one, coarse, finite)
sizes = numbers.map(abs)
ticks = st.one_of(st.integers(0, FAR), st.integers(0, 62).map(lambda power: 1 << power))


@settings(deadline=None, max_examples=30 if NOTHING_IS_COMPILED else 100)
@given(
    st.lists(numbers, min_size=8, max_size=8),
    st.lists(sizes, min_size=2, max_size=2),
    ticks,
    st.sampled_from([TICK, 2.0**-60, 2.0**-300, 2.0**-952]),
)
@example([0.0, 0.0, 1.0, 0.0, 3.0, 1.0, 0.0, 0.0], [0.5, 0.5], 0, TICK)
def test_of_any_numbers(places, radii, elapsed, tick):
    names = ("x", "y", "vx", "vy", "x2", "y2", "vx2", "vy2")
    plans = dict(zip(names, places, strict=True))
    table = rows(1, **plans, radius=radii[0], radius2=radii[1], elapsed=elapsed)
    table["tick"] = tick
    assert_true(table)


def test_two_discs_on_their_edges():
    def ticks(**fields) -> list[int]:
        """Returns ticks of contact, next contact and parting: discs of radius 1/4, the first at rest at 0."""
        table = rows(1)
        table["radius"] = table["radius2"] = 0.25
        for name, value in fields.items():
            table[name] = value
        touch, _, again, part, *_ = answers(table)[0]
        return [touch, again, part]

    assert ticks(y2=2.5, ay2=-1.0)[0] == 2 * UNIT  # falls on a peg
    assert ticks(y2=0.5, vy2=1.0, ay2=-1.0)[:2] == [2 * UNIT] * 2  # and again
    assert ticks(y2=0.5, vy2=-1.0, ay2=1.0)[:2] == [0, NEVER]  # just met, it comes out on this side again
    assert ticks(y2=0.5, vy2=-1.0)[2] == UNIT  # through it
    assert ticks(y2=0.5, ay2=-1.0)[:2] == [0, 0]  # rests on a peg: they press on each other
    assert ticks(y2=0.5, vy2=2.0**-53, ay2=-1.0)[:2] == [1, 1]  # level for a tick
    assert ticks(y2=0.5, vy2=-(2.0**-60), ay2=-1.0)[:2] == [0, 0]
    assert ticks(y2=0.5, vy2=-1.0, ay2=-1.0, ay=-1.0)[:2] == [0, NEVER]  # they fall together
    assert ticks(y2=0.5, ay2=-1.0, ay=-1.0, vx2=1.0)[:2] == [NEVER, NEVER]
    assert ticks(y2=0.5, vy2=1.0, ay2=-1.0, since=UNIT + 1)[:2] == [2 * UNIT] * 2  # when past its apex
    assert ticks(y2=1.0, vy2=-1.0, since=UNIT // 2)[::2] == [UNIT // 2, UNIT + UNIT // 2]
    assert ticks(y2=1.0, vy2=-1.0, since=UNIT // 2 + 1)[0] == UNIT // 2 + 1  # deeper in it in each
    assert ticks(y2=1.0, vy2=-1.0, since=UNIT)[0] == NEVER
    assert ticks(y2=0.5, vy2=-1.0, since=FAR) == [NEVER] * 3
    assert ticks(y2=0.25, vy2=0.25, ay2=-1.0)[0] == UNIT // 4  # stays in it, and turns back
    assert ticks(y2=0.5, vx2=1.0, vx=1.0, ax=-1.0, ax2=-1.0) == [NEVER] * 3
    assert ticks(y2=-(2.0**31), n=2.0**30 + 1, height=2.0, ay2=-4.0)[0] == UNIT * 0.75**0.5 // 1
    assert ticks(x2=1.0, y2=0.5 - 2.0**-50, vx2=-(2.0**53))[0] == NEVER  # for less than a tick
    assert ticks(ax2=math.inf) == ticks(y2=2.5, ax2=math.nan) == [NEVER] * 3
