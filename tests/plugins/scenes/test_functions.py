"""Functions that have the same bits everywhere are also right."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinetile_plugins.scenes.numerics import Draws, cosine_and_sine, logarithms, powers

flint = pytest.importorskip("flint")

ANGLES = st.floats(-(2.0**16), 2.0**16) | st.integers(-40000, 40000).map(lambda k: k * math.pi / 4.0)


def exact(name: str, value: float) -> Fraction:
    """Returns the middle of a ball of 300 bits that holds the function's value."""
    flint.ctx.prec = 300
    mantissa, exponent = getattr(flint.arb(value), name)().mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


@given(st.lists(ANGLES | st.floats(0.0, 2.0 * math.pi), min_size=1, max_size=20))
def test_cosine_and_sine_are_right_to_0_55_units_in_the_last_place(angles: list[float]) -> None:
    for name, values in zip(("cos", "sin"), cosine_and_sine(np.array(angles)), strict=True):
        for angle, value in zip(angles, values.tolist(), strict=True):
            right = exact(name, angle)
            assert abs(Fraction(value) - right) <= Fraction(55, 100) * Fraction(math.ulp(float(right)))


def test_cosine_and_sine_of_quarters_of_a_turn_and_of_nothing() -> None:
    cosine, sine = cosine_and_sine(np.array([0.0, -0.0, math.pi / 2.0, -math.pi]))
    assert cosine.tolist() == [1.0, 1.0, 6.123233995736766e-17, -1.0]
    assert sine.tolist() == [0.0, 0.0, 1.0, -1.2246467991473532e-16]


@given(st.floats(1.0, 2.0**100), st.floats(0.0, 1.0))
def test_powers_are_the_nearest_doubles(base: float, exponent: float) -> None:
    flint.ctx.prec = 300
    mantissa, power = (flint.arb(base) ** flint.arb(exponent)).mid().man_exp()
    assert powers(base, np.array([exponent])).tolist() == [
        float(Fraction(int(mantissa)) * Fraction(2) ** int(power))
    ]


@given(st.floats(2.0**-1022, 1.0) | st.integers(0, 2**53 - 1).map(lambda k: 1.0 - k * 2.0**-53))
def test_logarithms_are_right_to_2_units_in_the_last_place(number: float) -> None:
    value, right = logarithms(np.array([number])).item(), exact("log", number)
    assert abs(Fraction(value) - right) <= 2 * Fraction(math.ulp(float(right)))


def test_draws_are_the_numbers_that_a_generator_of_numpy_has_given_so_far() -> None:
    for seed in range(20):
        ours, theirs = Draws(np.random.SeedSequence(seed)), np.random.default_rng(seed)
        for number in (1, 2, 7, 30):
            assert np.array_equal(ours.uniform(number, 2), theirs.random((number, 2)))
            assert np.array_equal(
                ours.below(2 * number + 3, number), theirs.integers(2 * number + 3, size=number)
            )
            assert np.array_equal(ours.order(number), theirs.permutation(number))
            assert int(ours.below(5)) == theirs.integers(5)
