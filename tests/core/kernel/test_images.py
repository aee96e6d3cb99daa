"""Wrapping and images, against rationals."""

from __future__ import annotations

import math
import random
from fractions import Fraction

import numpy as np

from encounters import compiled
from kinetile.kernel.certificates.contact import first_touch_apart, look_closer
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.images import remainder, turns_of
from kinetile.kernel.tables import NEVER

LINE = np.dtype(
    [(name, "f8") for name in ("x", "y", "vx", "vy")]
    + [("elapsed", "i8")]
    + [(name, "f8") for name in ("x2", "y2", "vx2", "vy2", "radius", "radius2", "m", "n", "width", "height")]
)
TICK = 2.0**-52


@compiled
def wrap_all(table, found):
    """Write the remainder of each row, a place and a period, and how many periods are taken off."""
    for i in range(len(table)):
        times = turns_of(table[i, 0], table[i, 1])
        found[i, 0] = remainder(table[i, 0], table[i, 1], times)
        found[i, 1] = times


@compiled
def touch_all(table, found):
    """Write what ``first_touch_apart`` and ``look_closer`` say of each row."""
    for i in range(len(table)):
        at = table[i]
        across = Axis(at.x, at.vx, at.x2, at.vx2, at.m, at.width)
        up = Axis(at.y, at.vy, at.y2, at.vy2, at.n, at.height)
        plans = Plans(across, up, at.elapsed, TICK, 1.0 / TICK)
        found[i, 0] = first_touch_apart(plans, at.radius, at.radius2)
        found[i, 1] = look_closer(plans, at.radius, at.radius2)


def test_wrapping_is_the_remainder_of_ieee_754():
    rng = random.Random(1)
    drawn = []
    for _ in range(4000):
        period = rng.choice((1.0, 3.0, rng.uniform(1e-3, 1e3), 2.0 ** rng.randrange(-40, 40)))
        near = rng.randrange(-9, 10) / 2 * period
        place = rng.choice(
            (near, math.nextafter(near, math.inf), near + rng.uniform(-1, 1) * period, near * 1e6)
        )
        drawn.append((place, period))
    found = np.zeros((len(drawn), 2))
    wrap_all(np.array(drawn), found)
    for (place, period), (rest, times) in zip(drawn, found.tolist(), strict=True):
        assert rest == math.remainder(place, period)
        assert Fraction(rest) == Fraction(place) - Fraction(times) * Fraction(period)


def test_the_tick_through_an_image_is_the_floor_of_the_root():
    """Ties of lattices too, which need the exact stages."""
    rng = random.Random(2)
    drawn = []
    for case in range(1500):
        draw = (lambda: float(rng.randrange(-6, 7)) / 4) if case % 2 else (lambda: rng.uniform(-2.0, 2.0))
        path = [draw() for _ in range(8)]
        radii = (rng.choice((0.25, 0.5)), 0.25) if case % 2 else (rng.uniform(0.1, 1), 0.3)
        image = float(rng.randrange(-3, 4)), float(rng.randrange(-3, 4))
        sides = rng.choice(((1.5, 2.0), (0.1, 7.3), (1.0, 1.0)))
        elapsed = rng.choice((0, 1 << 52, (1 << 53) + 12345))
        drawn.append((*path[:4], elapsed, *path[4:], *radii, *image, *sides))
    found, met = np.zeros((len(drawn), 2), np.int64), 0
    touch_all(np.array(drawn, LINE).view(np.recarray), found)
    for row, (tick, closer) in zip(drawn, found.tolist(), strict=True):
        assert tick == closer
        x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, m, n, width, height = map(Fraction, row)
        path = (
            x2 - x + m * width - vx * elapsed * Fraction(TICK),
            y2 - y + n * height - vy * elapsed * Fraction(TICK),
            (vx2 - vx) * Fraction(TICK),
            (vy2 - vy) * Fraction(TICK),
        )
        met += check(path, radius + radius2, tick)
    assert met > 50


def check(path: tuple[Fraction, ...], reach: Fraction, tick: int) -> bool:
    """Compares a tick with rule 5; returns whether there is a contact after the later anchor."""
    dx, dy, ux, uy = path

    def state(at: int) -> tuple[Fraction, Fraction]:
        ex, ey = dx + ux * at, dy + uy * at
        return ex * ux + ey * uy, ex * ex + ey * ey - reach * reach

    bend, gap = state(0)
    misses = reach**2 * (ux * ux + uy * uy) <= (dx * uy - dy * ux) ** 2
    if bend >= 0 or (misses and gap > 0):
        assert tick == NEVER
        return False
    if gap <= 0:
        assert tick == 0
        return False
    assert state(tick)[0] < 0 <= state(tick)[1]
    after = state(tick + 1)
    assert after[0] >= 0 or after[1] < 0
    return True
