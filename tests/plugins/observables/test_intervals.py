"""Coverage of 95 % intervals, on fewer runs than the table of docs/observables.md."""

from __future__ import annotations

import math

import pytest

from intervals import CASES, rows

RUNS, LEAST = 60, 0.9


def fewest(runs: int, share: float) -> int:
    """The number of runs that fewer than one sample of ten thousand falls below, if each is covered with this
    probability: by the binomial law."""
    below = 0.0
    for covered in range(runs + 1):
        below += math.comb(runs, covered) * share**covered * (1.0 - share) ** (runs - covered)
        if below > 1e-4:
            return covered
    raise AssertionError("a share is below 1")


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.compiled
@pytest.mark.own_loop
@pytest.mark.parametrize("case", [CASES[2], CASES[6]], ids=lambda case: case.quantity)
def test_about_nineteen_of_twenty_runs_have_the_true_mean_in_their_interval(case):
    ((_, given, covered, scatter, _),) = rows(RUNS, cases=[case])
    assert given > 0.9 * RUNS
    assert round(covered / 100.0 * given) >= fewest(given, LEAST)
    assert scatter < 1.5
