"""When a body reaches a bent wall: ticks against whole numbers of Python."""

import math
from fractions import Fraction

import numpy as np
import pytest

import lanes
from encounters import compiled
from kinetile.kernel.certificates.falling import Fall, falls_at, falls_at_by_integers
from kinetile.kernel.tables import NEVER

UNLIMITED = 1 << 62


def right(f: Fall) -> int:
    """Returns the tick by rule 6g: of the quadratic's roots, by a whole square root."""
    q = Fraction(f.tick)
    a = Fraction(f.pull) * q * q / 2
    b = Fraction(f.slope) * q + 2 * a * f.since
    c = Fraction(f.far) - Fraction(f.near) - Fraction(f.radius) + a * f.since * f.since
    scale = math.lcm(a.denominator, b.denominator, c.denominator)
    a, b, c = (int(each * scale) for each in (a, b, c))
    inside = b * b - 4 * a * c
    if a < 0:
        found = b // (-2 * a) if inside < 0 else (b + math.isqrt(inside)) // (-2 * a)
        return clipped(max(found, 0), f)
    if b >= 0:
        return NEVER
    if c <= 0:
        return 0
    if inside <= 0:
        return NEVER
    root = math.isqrt(inside)
    return clipped((-b - root - (root * root < inside)) // (2 * a), f)


def clipped(found: int, f: Fall) -> int:
    return found if found < f.end else NEVER


def falls(rng: np.random.Generator, family: str) -> Fall:
    """Returns a question: of a lattice with ties, of doubles of one size, or of any size."""
    pull = 1 if rng.random() < 0.5 else -1
    bits = int(rng.integers(0, 12)) if family == "any" else 0
    tick = 2.0 ** -(52 + bits)
    since = int(rng.integers(0, 1 << 52)) if rng.random() < 0.8 else 0
    if family == "lattice":
        tick, since = 2.0**-52, int(rng.integers(0, 64)) << 46
        far, near, radius, slope = (float(each) / 8 for each in rng.integers([0, 0, 1, -16], [17, 9, 3, 17]))
        pull *= 2.0 ** rng.integers(-3, 2)
    else:
        far, near, radius = rng.random(3) * [2.0, 1.0, 0.25]
        slope, pull = rng.normal() * 2.0, pull * (0.125 + rng.random())
    if family == "any":
        near, radius, slope, pull = (x * 2.0 ** rng.integers(-60, 4) for x in (near, radius, slope, pull))
    if family == "near":  # a vertex at the wall, or what touches it at its anchor, by a rounding
        w = since * tick
        far = near + radius
        far -= 0.5 * pull * w * w if rng.random() < 0.5 else 0.0
        slope = -pull * w if rng.random() < 0.5 else slope
        if rng.random() < 0.5:
            far += slope * slope / (2.0 * pull) * (rng.random() < 0.5)
        far = math.nextafter(far, rng.choice([-9.0, 9.0])) if rng.random() < 0.5 else far
    end = UNLIMITED if rng.random() < 0.3 else int(rng.integers(1, (1 << 53) - since))
    return Fall(far, near, radius, slope, float(pull), since, end, tick)


@compiled
def ask_all(rows, counts, found):
    """Writes what ``falls_at`` returns for each row, and whole numbers alone from a wrong guess."""
    for i in range(len(rows)):
        far, near, radius, slope, pull, tick = rows[i]
        fall = Fall(far, near, radius, slope, pull, counts[i, 0], counts[i, 1], tick)
        found[i, 0] = falls_at(fall)
        found[i, 1] = falls_at_by_integers(fall, 0) if i % 16 == 0 else found[i, 0]


def answers(questions: list[Fall]) -> list[list[int]]:
    rows = np.array([(f.far, f.near, f.radius, f.slope, f.pull, f.tick) for f in questions])
    counts = np.array([(f.since, f.end) for f in questions])
    found = np.zeros((len(questions), 2), dtype=np.int64)
    ask_all(rows, counts, found)
    return [
        [tick if tick < f.end else NEVER for tick in each]
        for each, f in zip(found.tolist(), questions, strict=True)
    ]


@pytest.mark.parametrize("family", ["lattice", "doubles", "near", "any"])
@pytest.mark.parametrize("seed", lanes.first(1, range(26)))
def test_the_tick_is_that_of_whole_numbers(family, seed):
    rng = np.random.default_rng([seed, len(family)])
    questions = [falls(rng, family) for _ in range(lanes.examples(10_000 if seed else 500))]
    truth = [right(each) for each in questions]
    both = zip(answers(questions), truth, questions, strict=True)
    assert [(*found, true, each) for found, true, each in both if found != [true, true]] == []
    assert 20 * sum(tick != NEVER for tick in truth) > len(truth)
