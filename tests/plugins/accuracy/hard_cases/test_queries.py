"""Hard cases: the kernel is exact, answers that are wrong are found out, and the report says so."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from kinetile.toolbox import NEVER
from kinetile_accuracy.hard_cases import queries as part
from kinetile_accuracy.hard_cases.families import FAMILIES, UNIT, Family, Queries, Ticks
from kinetile_accuracy.hard_cases.queries import (
    KERNEL,
    TEXTBOOK,
    QueryRow,
    depth_at,
    kernel_ticks,
    query_row,
    textbook_ticks,
)
from kinetile_accuracy.report import measure_parts
from kinetile_accuracy.specification.arithmetic import UNIT_TICKS, FlightPlan

COUNT = 400


def family(name: str) -> Family:
    return next(family for family in FAMILIES if family.name == name)


def measured(name: str, answers: Callable[[Queries], Ticks]) -> QueryRow:
    queries = family(name).draw(COUNT)
    return query_row(family(name), "some form", queries, answers(queries))


@pytest.mark.parametrize("name", [family.name for family in FAMILIES])
def test_the_kernel_is_exact(name: str) -> None:
    row = measured(name, kernel_ticks)
    assert row.hits > 0
    assert (row.wrong, row.missed, row.false) == (0, 0, 0)
    assert row.depth_rho < 1.0


def test_the_textbook_loses_the_square_of_the_distance_and_grazes() -> None:
    assert measured("far apart", textbook_ticks).depth > 1e3 * measured("far apart", kernel_ticks).depth
    row = measured("grazing, ulps", textbook_ticks)
    assert row.missed > 0
    assert row.false > 0
    assert row.wrong > row.missed + row.false


def one_side(queries: Queries) -> Ticks:
    """Misses every disc that passes on one side."""
    d, v = (each[:, 1] - each[:, 0] for each in (queries.position, queries.velocity))
    return np.where(d[:, 0] * v[:, 1] > d[:, 1] * v[:, 0], textbook_ticks(queries), NEVER)


def without_anchors(queries: Queries) -> Ticks:
    """Takes both discs to be where they were at their anchors."""
    since = np.repeat(queries.anchor.max(axis=1)[:, None], 2, axis=1)
    return textbook_ticks(replace(queries, anchor=since))


def everything(queries: Queries) -> Ticks:
    """Finds a contact of every two discs, at once."""
    return queries.anchor.max(axis=1)


@pytest.mark.parametrize(
    ("name", "answers", "missed", "invented"),
    [
        ("generic", one_side, (0.3, 0.7), (0.0, 0.0)),
        ("generic", without_anchors, (0.0, 0.0), (0.0, 0.0)),
        ("anchors apart", without_anchors, (0.1, 1.0), (0.1, 1.0)),
        ("generic", everything, (0.0, 0.0), (1.0, 1.0)),
    ],
)
def test_answers_that_are_wrong_are_found_out(
    name: str, answers: Callable[[Queries], Ticks], missed: tuple[float, float], invented: tuple[float, float]
) -> None:
    """By the share of contacts that they miss, and of the others of which they make contacts."""
    row = measured(name, answers)
    assert missed[0] <= row.missed / row.hits <= missed[1]
    assert invented[0] <= row.false / (row.queries - row.hits) <= invented[1]
    assert row.wrong >= row.missed + row.false


def two(x: float, vx: float) -> tuple[FlightPlan, FlightPlan]:
    return FlightPlan(0.0, 0.0, 0.0, 0.0, 0, 1.0, UNIT), FlightPlan(x, 0.0, vx, 0.0, 0, 1.0, UNIT)


def test_a_depth_is_that_of_places_in_doubles_less_what_discs_overlap_already() -> None:
    late = UNIT_TICKS >> 10
    assert depth_at(two(4.0, -1.0), 2 * UNIT_TICKS) == (0.0, 0.0)
    assert depth_at(two(4.0, -1.0), 2 * UNIT_TICKS - late) == (0.0, 0.0)
    assert depth_at(two(4.0, -1.0), 2 * UNIT_TICKS + late) == (2.0**-11, 2.0**-10 / (16 * 2.0**-53 * 4.0))
    assert depth_at(two(1.5, -1.0), 0) == (0.0, 0.0)
    assert depth_at(two(1.5, -1.0), UNIT_TICKS // 4)[0] == 0.125


def test_a_fault_that_the_kernel_reports_is_not_believed() -> None:
    inside = Queries(
        np.array([[[0.0, 0.0], [0.5, 0.0]]]),
        np.array([[[0.0, 0.0], [-1.0, 0.0]]]),
        np.ones((1, 2)),
        np.zeros((1, 2), dtype=np.int64),
    )
    with pytest.raises(RuntimeError, match="query 0"):
        kernel_ticks(inside)


def test_claims_and_findings_say_what_the_rows_say() -> None:
    good = replace(measured("generic", kernel_ticks), form=KERNEL)
    poor = replace(good, form=TEXTBOOK, depth=1e-4, wrong=100, missed=1, false=2)
    assert all(claim.holds for claim in part.query_claims([good, poor]))
    (text,) = part.query_findings([good, poor])
    assert "25% to 25% of the answers" in text
    assert "misses 1 contacts and invents 2; discs overlap by up to 1e-4 R (generic)" in text
    exact, depth = part.query_claims([replace(good, wrong=3, missed=1, false=1), poor])
    assert exact.measured == "3 of 400 queries differ from the integer one: 1 contacts missed, 1 invented"
    assert (exact.holds, depth.holds) == (False, True)
    exact, depth = part.query_claims([replace(good, depth_rho=1.5), poor])
    assert (exact.holds, depth.holds) == (True, False)


def test_the_part_measures_every_family_and_can_be_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setitem(part.COUNTS, "quick", 40)
    told: list[tuple[str, int, int]] = []
    (section,) = measure_parts("quick", ["queries"], progress=lambda *what: told.append(what))
    (table,) = section.tables
    assert [(row.family, row.form) for row in table.rows] == [
        (family.name, form) for family in FAMILIES for form in (KERNEL, TEXTBOOK)
    ]
    assert told[-1][1] == told[-1][2] == len(FAMILIES)
    assert all(claim.holds for claim in section.claims)
    assert section.about.startswith("40 queries of each family")
    (panel,) = section.pictures[0].draw().axes
    assert [each.get_text() for each in panel.get_yticklabels()] == [each.name for each in FAMILIES]
