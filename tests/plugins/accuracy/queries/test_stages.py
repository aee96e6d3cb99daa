"""What decides a query: stages are told apart by the kernel's own code, and the row says what each costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kinetile_accuracy.queries.families import FAMILIES
from kinetile_accuracy.queries.forms import KERNEL, ask, forms
from kinetile_accuracy.queries.questions import Queries
from kinetile_accuracy.queries.stages import FEWEST, STAGES, deciding, stage_finding, stage_row


def draw(name: str, count: int) -> Queries:
    return next(family for family in FAMILIES if family.name == name).draw(count)


def pair(x: float, y: float, vx: float, radius: float) -> Queries:
    """A disc at rest at the origin, and one that comes along the x-axis."""
    return Queries(
        np.array([[[0.0, 0.0], [x, y]]]),
        np.array([[[0.0, 0.0], [vx, 0.0]]]),
        np.array([[radius, radius]]),
        np.zeros((1, 2), dtype=np.int64),
    )


@pytest.mark.parametrize(
    ("query", "stage"),
    [
        (pair(3.1, 0.2, -0.7, 0.5), "filter"),
        (pair(3.1, 5.0, -0.7, 0.5), "filter"),  # refused
        (pair(3.0, 0.0, -1.0, 0.5), "closer look"),  # a contact at a tick
        (pair(3.1, 0.7, -0.3, 0.35), "integers"),  # tangent
        (pair(2.0**300, 0.0, -(2.0**300), 2.0**290), "integers"),  # too large for doubles to square
    ],
)
def test_it_is_told_what_decides(query: Queries, stage: str) -> None:
    assert STAGES[deciding(query)[0]] == stage


def test_telling_leaves_the_kernel_as_it_is() -> None:
    queries = draw("grazing, ulps", 50)
    before = ask(forms()[KERNEL], queries)
    assert set(deciding(queries)) == {1, 2}
    assert (ask(forms()[KERNEL], queries) == before).all()


def test_a_row_says_how_many_each_stage_decides_and_what_that_costs() -> None:
    generic = next(family for family in FAMILIES if family.name == "generic")
    row = stage_row(generic, generic.draw(60), 20, 2)
    assert (row.by_filter, row.by_closer, row.by_integers) == (100.0, 0.0, 0.0)
    assert row.ns_filter is not None
    assert row.ns_closer is None
    ulps = next(family for family in FAMILIES if family.name == "grazing, ulps")
    row = stage_row(ulps, ulps.draw(40 * FEWEST), 100, 3)
    assert row.by_filter + row.by_closer + row.by_integers == pytest.approx(100.0)
    assert row.ns_closer is not None
    assert row.ns_integers is not None
    assert row.ns_integers > row.ns_closer > 0.0
    assert row.ns_closer < row.ns < row.ns_integers


def test_the_finding_names_the_dearest_family() -> None:
    generic = FAMILIES[0]
    usual = replace(stage_row(generic, generic.draw(40), 20, 2), ns=40.0)
    assert stage_finding([usual, replace(usual, ns=50.0)]) == (
        "The filter decides 99 % or more of the queries in 2 of 2 families, at 40 to 50 ns a query."
    )
    dear = replace(usual, family="grazes", by_filter=1.0, by_closer=39.0, by_integers=60.0, ns=1500.0)
    said = stage_finding([usual, dear])
    assert "in 1 of 2 families, at 40 to 40 ns" in said
    assert "grazes: the filter decides 1 %, the closer look 39 % and integers 60 %, at 1,500 ns" in said
