"""Rates: the formulas against known figures, the counting against the truth, and against a wrong one."""

from __future__ import annotations

import math

import pytest

from kinetile_accuracy.long_runs.rates import two_disc_rates, two_discs


def silent(what: str, done: int, total: int) -> None:
    """Show no progress."""


def test_the_formulas_give_the_published_rates():
    """Zapfe, Sanders, Rodriguez-Mota (arXiv 1908.04749) treat this box."""
    assert two_disc_rates(0.15, 1.0, 1.0, 2.0) == pytest.approx(
        (1.35906852, 2.12674818, 2.12674818), abs=5e-9
    )
    assert two_disc_rates(0.1, 1.5, 1.0, 2.0) == pytest.approx((0.43069435, 0.97152072, 1.57460666), abs=5e-9)


def test_rates_grow_with_the_speed_and_know_which_wall_is_which():
    slow, fast = two_disc_rates(0.1, 1.5, 1.0, 2.0), two_disc_rates(0.1, 1.5, 1.0, 8.0)
    assert fast == pytest.approx([2.0 * rate for rate in slow])
    pair, x, y = two_disc_rates(0.1, 1.0, 1.5, 2.0)
    assert (pair, y, x) == pytest.approx(slow)


def test_point_discs_only_meet_walls():
    """A disc of no size hits the walls of an axis |v| / W times, on average over directions 2/pi of that."""
    pair, x, y = two_disc_rates(1e-9, 1.0, 1.0, 2.0)
    assert pair == pytest.approx(0.0, abs=1e-7)
    one_disc = (
        4.0 / (3.0 * math.pi) * math.sqrt(2.0)
    )  # the mean of |vx| over directions of both, and energies
    assert x == pytest.approx(y) == pytest.approx(2.0 * one_disc, rel=1e-6)


def test_discs_that_cannot_pass_each_other_are_refused():
    with pytest.raises(ValueError, match="pass each other"):
        two_disc_rates(0.3, 1.0, 1.0, 2.0)


@pytest.mark.compiled
def test_two_discs_meet_at_these_rates():
    rates = two_discs(0.15, 1.0, 1.0, 300_000, silent)
    assert [rate.what for rate in rates] == ["disc-disc", "x walls", "y walls"]
    assert all(abs(rate.off) < 4.0 and rate.error < 0.02 for rate in rates)
    counted = sum(rate.rate for rate in rates)
    assert counted == pytest.approx(sum(rate.theory for rate in rates), rel=0.01)
    assert rates[0].contacts == pytest.approx(300_000, rel=0.02)
