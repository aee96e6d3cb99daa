"""When accelerated convex bodies touch and part: ticks against whole numbers of Python (rules 5t to 11t)."""

import math
import random

import numpy as np
import pytest

from convex_questions import drawn_shape
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.certificates.shapes import enters, leaves
from kinetile.kernel.compiled import pointer
from kinetile.kernel.tables import NEVER
from kinetile.toolbox import hook
from kinetile.toolbox.differences import difference_row
from kinetile_accuracy.specification.arithmetic import FlightPlan, Frame, Separation
from kinetile_accuracy.specification.shapes import Difference
from kinetile_accuracy.specification.touching import parting_tick, touching_tick
from lanes import first
from two_forms import compiled

TICK = 2.0**-52


@compiled
@hook
def ask(numbers, x, y, elapsed, met, since):
    f = pointer(numbers)
    along = Axis(x[0], x[1], x[2], x[3], x[4], x[5], 0.0, 0.0, 0.0, 0.0)
    up = Axis(y[0], y[1], y[2], y[3], y[4], y[5], 0.0, 0.0, 0.0, 0.0)
    plans = Plans(along, up, elapsed, TICK, 1.0 / TICK)
    return enters(f, 0, plans, met, since), leaves(f, 0, plans, since)


def on_the_outline(rng: random.Random, m: Difference) -> tuple[float, float]:
    """Returns a place that is on the outline of a difference with its margin, but for rounding."""
    k = rng.randrange(len(m.corners))
    (x, y), (x2, y2) = ([c / 2**m.bits for c in m.corners[i]] for i in (k, k - 1))
    radius = m.radius / 2**m.bits
    part = rng.choice((0.0, 0.25, 0.5, 1.0, rng.random()))
    turn = 2.0 * math.pi * rng.choice((0.0, 0.25, 0.5, 0.75, rng.random()))
    place = x + (x2 - x) * part, y + (y2 - y) * part
    if m.radius:
        place = place[0] + radius * math.cos(turn), place[1] + radius * math.sin(turn)
    if rng.random() < 0.3:
        place = tuple(math.nextafter(each, rng.choice((-9.0, 9.0))) for each in place)
    return place[0], place[1]


def check(seed: int) -> tuple[int, int]:
    """Asks a drawn question; returns whether the two meet, and part."""
    rng = random.Random(f"bent shapes {seed}")
    lattice = rng.choice((0, 1, 2, 4, 16))
    one, two = (drawn_shape(rng, lattice, rng.random() < 0.5) for _ in range(2))

    def number(size: float) -> float:
        return rng.randint(-size * lattice, size * lattice) / lattice if lattice else rng.uniform(-size, size)

    m = Difference(one, two)
    met = rng.random() < 0.35
    place = on_the_outline(rng, m) if met or rng.random() < 0.3 else (number(4), number(4))
    paths = []
    for away in place:
        speeds, pulls = [number(2), number(2)], [number(2), number(2)]
        if rng.random() < 0.5:  # an obstacle
            speeds[1] = pulls[1] = 0.0
        if rng.random() < 0.4:
            pulls = rng.choice(([0.0, 0.0], [-1.0, 0.0], [-1.0, -1.0]))
        start = 0.0 if rng.random() < 0.6 else number(3)
        paths.append(np.array([start, speeds[0], pulls[0], start + away, speeds[1], pulls[1]]))
    elapsed = rng.choice((0, 0, 1, 1 << 52, rng.randint(0, 1 << 53)))
    since = 0 if met else rng.choice((0, 0, 1 << 51, rng.randint(0, 1 << 54)))
    frame = Frame(None, 0)
    (x, y), ends = (path.tolist() for path in paths), ((0, 0), (3, elapsed))
    plans = [
        FlightPlan(x[k], y[k], x[k + 1], y[k + 1], anchor, 0.0, frame, pull=(x[k + 2], y[k + 2]))
        for k, anchor in ends
    ]
    pair = Separation(*plans)
    wanted = touching_tick(m, pair, met, elapsed + since), parting_tick(m, pair, elapsed + since)
    row = np.array(difference_row((one.core, one.radius), (two.core, two.radius)))
    answers = ask(row, *paths, elapsed, int(met), since)
    found = tuple(None if each == NEVER else int(each) + elapsed for each in answers)
    assert found == wanted, seed
    return wanted[0] is not None, wanted[1] is not None


@pytest.mark.small
@pytest.mark.parametrize("part", first(1, range(40)))
def test_ticks_are_those_of_whole_numbers(part):
    """Shapes of up to eight corners, with a margin or not, on lattices or not; bodies that have just met, at
    or beside the outline; obstacles; and ticks that count from later on."""
    met, parted = np.sum([check(seed) for seed in range(30 * part, 30 * part + 30)], axis=0)
    assert met > 0
    assert parted > met


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.own_loop
def test_compiled_ticks_are_those_too():
    """In the first a count of ticks that is never was counted on, where integers have 64 bits."""
    for seed in (311459, *range(5_000, 7_000)):
        check(seed)
