"""The filters' claims on their own errors, against fractions: never too little, and not idly much."""

from fractions import Fraction
from math import isqrt

import numpy as np
import pytest

from encounters import TICK, compiled, plans, reached, rows, true_reach
from kinetile.kernel.certificates.discs import gap_at, newton
from kinetile.kernel.certificates.plans import Axis
from kinetile.kernel.certificates.separation import ULP, along, plus, seen, separations

pytestmark = pytest.mark.small

COUNT = 1_000
NEVER = (1 << 63) - 1


@compiled
def claim(table, times, claims):
    for i in range(len(table)):
        row = table[i]
        x, y = separations(plans(row))
        reach, reach_low = plus(row.radius, row.radius2)
        bend, bend_error = along(x, x.u, y, y.u)
        cross, cross_error = along(x, y.u, y, -x.u)
        q, q_error, slope, slope_error = gap_at(times[i], x, y, reach, reach_low)
        claims[i, 0] = bend
        claims[i, 1] = bend_error
        claims[i, 2] = cross
        claims[i, 3] = cross_error
        claims[i, 4] = q
        claims[i, 5] = q_error
        claims[i, 6] = slope
        claims[i, 7] = slope_error
        if slope > 8.0 * slope_error:
            step, bound, curve = newton(q, q_error, slope, slope_error, x.u * x.u + y.u * y.u, 1.0 / row.tick)
            claims[i, 8] = step
            claims[i, 9] = bound
            claims[i, 10] = curve


def truth(row, t: float) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, *_ = map(Fraction, row)
    ux, uy = vx2 - vx, vy2 - vy
    dx, dy = x2 - x - vx * elapsed * tick, y2 - y - vy * elapsed * tick
    ex, ey = dx + ux * Fraction(t), dy + uy * Fraction(t)
    q = ex * ex + ey * ey - (radius + radius2) ** 2
    return dx * ux + dy * uy, dx * uy - dy * ux, q, -(ex * ux + ey * uy)


def claimed(table, times) -> np.ndarray:
    claims = np.zeros((len(table), 11))
    claims[:, 10] = 1.0
    claim(table.view(np.recarray), times, claims)
    return claims


def excess(table, times) -> np.ndarray:
    """Returns by how much of its bound each claim is off: of bend, cross, slope, and q beyond its last
    rounding."""
    claims = claimed(table, times)
    shares = []
    for row, t, said in zip(table.tolist(), times.tolist(), claims.tolist(), strict=True):
        bend, cross, q, slope = truth(row, t)
        last = ULP * abs(said[4])
        shares.append(
            [
                float(abs(Fraction(said[0]) - bend) / Fraction(said[1])),
                float(abs(Fraction(said[2]) - cross) / Fraction(said[3])),
                float(abs(Fraction(said[6]) - slope) / Fraction(said[7])),
                float((abs(Fraction(said[4]) - q) - Fraction(last)) / Fraction(said[5] - last)),
            ]
        )
    return np.array(shares)


def drawn(seed: int, n: int, far: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Returns encounters with numbers of all sizes near 1, and times when the discs nearly touch; moved up
    to 2^far away from the origin."""
    rng = np.random.default_rng(seed)

    def number(low: int, high: int) -> np.ndarray:
        return np.ldexp(rng.uniform(0.5, 1.0, n) * rng.choice([-1.0, 1.0], n), rng.integers(low, high, n))

    names = ("x", "y", "vx", "vy", "x2", "y2", "vx2", "vy2")
    table = rows(n, **{name: number(-3, 4) for name in names})
    table["elapsed"] = (2.0 ** rng.uniform(0.0, 62.0, n)).astype(np.int64)
    times = np.abs(number(-8, 9))
    away = np.exp2(rng.uniform(0.0, far, n)) if far else 0.0
    table["x"] += away
    table["x2"] += away
    for row, t, part in zip(table, times.tolist(), rng.uniform(0.1, 0.9, n).tolist(), strict=True):
        reach = Fraction(isqrt(int(truth(row.tolist(), t)[2] * 2**240)), 2**120)
        row["radius"] = float(reach * Fraction(part))
        row["radius2"] = float(reach - Fraction(row["radius"].item()))
    return table, times


CLIMBED = {
    **{"x": -0.4756047937948521, "y": 0.07073578693398076, "vx": 0.08254203811807892},
    **{"vy": -0.6819085424470388, "elapsed": 236028944, "x2": 0.22551941533590406},
    **{"y2": -9.537336259624357, "vx2": 0.5933569563229633, "vy2": -5.990729611903607},
    **{"radius": 277.3342766354295, "radius2": 3.623471413674307},
}
"""An encounter found by climbing: q is off by 13 ulps of an ulp at ``CLIMBED_AT``."""

CLIMBED_AT = 50.873677427592696


def test_no_claim_is_too_small_and_none_is_eight_times_too_large():
    table, times = drawn(1, COUNT)
    table[:1], times[0] = rows(1, **CLIMBED), CLIMBED_AT
    found = excess(table, times).max(axis=0)
    assert (found <= 1.0).all(), found
    assert (found > [1 / 8, 1 / 8, 1 / 8, 1 / 32]).all(), found


@compiled
def claim_through(numbers, turns, period, t, claims):
    for i in range(len(numbers)):
        x, vx, x2, vx2, time, rest, reach = numbers[i]
        found = seen(Axis(x, vx, 0.0, x2, vx2, 0.0, turns[i], period[i], 0.0, 0.0), time, rest)
        q, q_error, _, _ = gap_at(t[i], found, found, reach, 0.0)
        claims[i, 0] = found.d
        claims[i, 1] = found.low
        claims[i, 2] = found.size
        claims[i, 3] = q
        claims[i, 4] = q_error


@pytest.mark.parametrize("most", [1, 2**6, 2**32 - 1])
def test_what_an_image_adds_is_within_the_claims(most):
    """Images up to some periods away, that are near at the anchor: of the size 9 ulps of an ulp are lost
    at most, as the docstring of contact.py derives, and the bound of q covers them."""
    rng, n = np.random.default_rng(3), COUNT // 4
    period, turns = rng.uniform(0.5, 8.0, n), np.rint(rng.uniform(-most, most, n))
    x, x2 = rng.uniform(-0.5, 0.5, (2, n)) * period
    time = rng.uniform(0.0, 4.0, n)
    rest = time * ULP * rng.uniform(-1.0, 1.0, n)
    vx = (x2 - x + turns * period + np.ldexp(rng.uniform(-1.0, 1.0, n), rng.integers(-50, 3, n))) / time
    vx2 = rng.uniform(-1.0, 1.0, n)
    t = np.ldexp(rng.uniform(0.5, 1.0, n), rng.integers(-20, 2, n))
    there = 2.0 * ((x2 - x + turns * period - vx * time) + (vx2 - vx) * t) ** 2
    numbers = np.column_stack([x, vx, x2, vx2, time, rest, np.sqrt(there)])
    claims = np.zeros((n, 5))
    claim_through(numbers, turns, period, t, claims)
    worst = 0.0
    for row, m, P, at, said in zip(
        numbers.tolist(), turns.tolist(), period.tolist(), t.tolist(), claims.tolist(), strict=True
    ):
        x_, vx_, x2_, vx2_, time_, rest_, reach = map(Fraction, row)
        dx, low, size, q, q_error = map(Fraction, said)
        exact = x2_ - x_ + Fraction(m) * Fraction(P) - vx_ * (time_ + rest_)
        ulp = Fraction(ULP)
        lost = abs(exact - dx - low) / (ulp * ulp * size)
        assert lost <= 9
        assert abs(low) <= 3 * ulp * size
        worst = max(worst, float(lost))
        true = 2 * (exact + (vx2_ - vx_) * Fraction(at)) ** 2 - reach * reach
        assert abs(q - true) <= q_error
    assert worst > 0.5


@pytest.mark.parametrize("far", [0.0, 40.0])
def test_a_newton_step_ends_as_near_the_root_as_it_says(far):
    """From a little before and behind the root; as curved as is allowed, and hardly; near and far."""
    table, times = drawn(2, COUNT, far)
    times *= 1.0 + np.exp2(np.random.default_rng(2).uniform(-50.0, -1.0, COUNT)) * np.sign(table["x"])
    shares = []
    for row, t, said in zip(table.tolist(), times.tolist(), claimed(table, times).tolist(), strict=True):
        step, bound, curve = said[8:]
        if curve < 0.125:
            _, _, q, slope = truth(row, t)
            speed2 = (Fraction(row[7]) - Fraction(row[2])) ** 2 + (Fraction(row[8]) - Fraction(row[3])) ** 2
            root = Fraction(isqrt(int((slope * slope - speed2 * q) * 2**400)), 2**200)
            ticks = q / (slope + root) / Fraction(TICK)
            shares.append((float(abs(ticks - Fraction(step)) / Fraction(bound)), curve))
    share, bends = np.array(shares).T
    assert len(share) > COUNT / 20
    assert (share <= 1.0).all(), share.max()
    assert share[bends > 1e-3].max() > 1 / 8


def test_a_wall_reached_just_before_the_last_tick():
    """Two roundings away from a gap, and the estimate is 512 ticks early; as doubles, 2^62 - 1 is 2^62."""
    rng = np.random.default_rng(1)
    ulp = 2.0**-41
    speed = rng.uniform(2.0, 4.0, 200)
    size = rng.integers(1, 1000, 200) * 2.0**-31
    radius = size - rng.uniform(0.3, 0.49, 200) * ulp
    near = -rng.uniform(0.3, 0.49, 200) * ulp
    table = np.column_stack(
        [1024 * speed - ulp + size, near, radius, -speed, np.zeros(200), np.full(200, TICK)]
    )
    truth = [true_reach(*row) for row in table.tolist()]
    assert all((1 << 62) - 1024 < tick < 1 << 62 for tick in truth)
    assert reached(table) == truth
