"""When two discs part, against fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from kinetile.kernel.certificates.contact import last_touch
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.tables import NEVER

SOME = 150 if INTERPRETED else 750

part = getattr(last_touch, "py_func", last_touch)
"""Not compiled apart from a loop: whole numbers are the same either way."""


def drawn(seed: int, lattice: bool) -> list[float]:
    rng = np.random.default_rng(seed)
    if lattice:
        whole = [float(n) for n in rng.integers(-6, 7, 8)]
        return [*whole, float(rng.integers(1, 5)), float(rng.integers(1, 5))]
    size = 10.0 ** rng.uniform(-3, 3)
    return [*(rng.uniform(-1, 1, 8) * size).tolist(), *(rng.uniform(0.01, 1, 2) * size).tolist()]


@pytest.mark.parametrize("lattice", [True, False])
def test_the_tick_is_the_last_at_which_they_have_not_parted(lattice):
    parted_later = 0
    for seed in range(SOME):
        x, y, vx, vy, x2, y2, vx2, vy2, r, r2 = drawn(seed, lattice)
        elapsed = [0, 1, 1 << 52, (1 << 54) + seed][seed % 4]
        tick = 2.0 ** (-52 - seed % 9)
        m, n, width, height = [(0, 0, 0.0, 0.0), (1, -2, 3.0, 5.0), (-1, 1, abs(x) + 1.1, abs(y) + 0.7)][
            seed % 3
        ]
        across, up = Axis(x, vx, x2, vx2, float(m), width), Axis(y, vy, y2, vy2, float(n), height)
        found = part(Plans(across, up, elapsed, tick, 1.0 / tick), r, r2)
        dx, dy, ux, uy = (
            Fraction(x2) - Fraction(x) - Fraction(vx) * Fraction(tick) * elapsed + m * Fraction(width),
            Fraction(y2) - Fraction(y) - Fraction(vy) * Fraction(tick) * elapsed + n * Fraction(height),
            Fraction(vx2) - Fraction(vx),
            Fraction(vy2) - Fraction(vy),
        )
        reach = Fraction(r) + Fraction(r2)

        def parted(ticks: int, line=(dx, dy, ux, uy, reach, tick)) -> bool:
            dx, dy, ux, uy, reach, tick = line
            ex, ey = dx + ux * Fraction(tick) * ticks, dy + uy * Fraction(tick) * ticks
            return ex * ex + ey * ey > reach * reach and ex * ux + ey * uy >= 0

        meets = reach * reach * (ux * ux + uy * uy) > (dx * uy - dy * ux) ** 2
        apart = dx * dx + dy * dy > reach * reach
        if apart and (dx * ux + dy * uy >= 0 or not meets):
            assert found == 0
        elif ux == uy == 0:
            assert found == NEVER
        elif found == NEVER:
            assert not parted(1 << 62)
        else:
            assert not parted(found)
            assert parted(found + 1)
            parted_later += 1
    assert parted_later > SOME // 10
