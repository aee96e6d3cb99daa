"""Means, ratios, exponents and crossovers, against numbers known from elsewhere."""

from __future__ import annotations

import math

import pytest

from kinetile_bench.results import crossover, exponent, fit_exponent, mean_of, ratio_of, student


@pytest.mark.parametrize(
    ("freedom", "t"),
    [(1, 12.7062), (2, 4.3027), (3, 3.1824), (4, 2.7764), (9, 2.2622), (24, 2.0639), (99, 1.9842)],
)
def test_students_t_is_that_of_the_tables(freedom, t):
    assert student(freedom) == pytest.approx(t, abs=5e-5)


def test_a_mean_has_an_interval_where_there_are_two_seeds():
    assert mean_of([2.0]).interval is None
    found = mean_of([1.0, 2.0, 3.0])
    assert found.value == 2.0
    assert found.interval == pytest.approx((2 - 4.3027 / math.sqrt(3), 2 + 4.3027 / math.sqrt(3)), abs=1e-4)


def test_a_ratio_is_paired_by_seed():
    found = ratio_of({1: 2.0, 2: 20.0, 3: 5.0}, {1: 1.0, 2: 10.0, 9: 1.0})
    assert found.value == pytest.approx(2.0)
    assert found.interval == pytest.approx((2.0, 2.0))
    assert found.seeds == 2
    assert ratio_of({1: 2.0}, {2: 1.0}) is None


def test_an_exponent_is_the_mean_slope_of_the_seeds_with_all_points():
    points = {1: {1: 1.0, 4: 8.0}, 2: {1: 2.0, 4: 32.0}, 3: {1: 7.0}}
    found = exponent(points)
    assert found.value == pytest.approx(1.75)
    assert found.seeds == 2
    assert found.interval == pytest.approx((1.75 - 12.7062 * 0.25, 1.75 + 12.7062 * 0.25), abs=1e-3)


def test_a_fitted_exponent_is_found_again():
    assert fit_exponent([25, 100, 400], [3.0 * n**1.7 for n in (25, 100, 400)]) == pytest.approx(1.7)


def test_with_one_seed_the_interval_is_that_of_a_line():
    exact = exponent({1: {x: x**1.5 for x in (1.0, 2.0, 4.0, 8.0)}})
    assert exact.value == pytest.approx(1.5)
    assert exact.interval == pytest.approx((1.5, 1.5), abs=1e-6)
    assert exponent({1: {1.0: 1.0, 2.0: 2.0}}).interval is None
    assert exponent({1: {1.0: 1.0}}) is None
    assert exponent({1: {1.0: 0.0, 2.0: 1.0}}) is None


def test_a_crossover_lies_where_the_ratio_is_one():
    one = {s: {0.01: 1.0, 0.1: 10.0 * f, 1.0: 100.0} for s, f in ((1, 1.0), (2, 1.1))}
    other = {s: {0.01: 10.0, 0.1: 10.0, 1.0: 10.0} for s in (1, 2)}
    estimate, first_below = crossover(one, other)
    assert first_below
    assert estimate.value == pytest.approx(0.1, rel=0.06)
    assert estimate.interval[0] < estimate.value < estimate.interval[1]
    assert crossover(other, one)[1] is False


def test_where_the_seeds_do_not_cross_there_is_no_crossover():
    one = {s: {1.0: 1.0, 2.0: 1.0} for s in range(5)}
    other = {s: {1.0: 2.0, 2.0: 3.0} for s in range(4)} | {4: {1.0: 1e9, 2.0: 1e-60}}
    assert crossover(one, one) is None
    assert crossover(one, other) is None
