"""Query accuracy: the kernel's form holds, forms that are wrong are found out, and the findings say so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kinetile.toolbox import NEVER
from kinetile_accuracy.contact_times import queries as part
from kinetile_accuracy.contact_times.encounter import Deviation, Encounter, QueryRow, deviation, query_row
from kinetile_accuracy.contact_times.families import FAMILIES, UNIT, Family, Queries
from kinetile_accuracy.contact_times.forms import KERNEL, batch_times, forms, ticks_by
from kinetile_accuracy.specification.arithmetic import UNIT_TICKS, FlightPlan

COUNT = 400


def family(name: str) -> Family:
    return next(family for family in FAMILIES if family.name == name)


def measured(name: str, answers: Callable[[Queries], Any]) -> QueryRow:
    """Return the row of answers to a family."""
    queries = family(name).draw(COUNT)
    ticks = np.asarray(answers(queries)).tolist()
    found = [deviation(Encounter(*plans), tick) for plans, tick in zip(queries.plans(), ticks, strict=True)]
    return query_row(name, "some form", found, np.array([1.0, 2.0]))


def by(form: str) -> Callable[[Queries], Any]:
    return lambda queries: ticks_by(forms()[form], queries)


class Pairs:
    """Separation and relative velocity at the places of the plans, and what forms make of them."""

    def __init__(self, queries: Queries) -> None:
        d = queries.position[:, 1] - queries.position[:, 0]
        v = queries.velocity[:, 1] - queries.velocity[:, 0]
        self.reach, self.since = queries.radius.sum(axis=1), queries.anchor.max(axis=1)
        self.approach, self.speed2 = (d * v).sum(axis=1), (v * v).sum(axis=1)
        self.cross, self.distance = d[:, 0] * v[:, 1] - d[:, 1] * v[:, 0], np.hypot(*d.T)
        self.root = self.reach**2 * self.speed2 - self.cross**2

    def ticks(self, met: Any, time: Any) -> Any:
        return np.where(met, self.since + np.floor(np.where(met, time, 0.0) * UNIT_TICKS).astype(int), NEVER)

    def near_root(self) -> Any:
        gap = np.maximum((self.distance - self.reach) * (self.distance + self.reach), 0.0)
        return gap / (np.sqrt(np.maximum(self.root, 0.0)) - self.approach)


def half_the_plane(queries: Queries) -> Any:
    """Compares d x v with R|v| without its absolute value: misses every disc that passes on one side."""
    at = Pairs(queries)
    return at.ticks((at.approach < 0.0) & (at.root > 0.0) & (at.cross >= 0.0), at.near_root())


def without_anchors(queries: Queries) -> Any:
    """Takes both discs to be where they were at their anchors."""
    at = Pairs(queries)
    return at.ticks((at.approach < 0.0) & (at.root > 0.0), at.near_root())


def everything(queries: Queries) -> Any:
    """Finds a contact of every two discs, at once."""
    return Pairs(queries).since


@pytest.mark.parametrize("name", [family.name for family in FAMILIES])
def test_the_kernel_is_exact(name: str) -> None:
    row = measured(name, by(KERNEL))
    assert row.hits > 0
    assert (row.wrong, row.missed, row.false) == (0, 0, 0)
    assert (row.late, row.ticks_max, row.error_max) == (0.0, 0.0, 0.0)
    assert row.depth_rho < 1.0


def test_textbook_forms_lose_the_square_of_the_distance() -> None:
    ours = measured("far apart", by(KERNEL))
    straight = measured("far apart", by("cross product"))
    for name in ("naive", "citardauq"):
        theirs = measured("far apart", by(name))
        assert theirs.depth > 1e3 * ours.depth
        assert theirs.error_p99 is not None
        assert straight.error_p99 is not None
        assert theirs.error_p99 > 1e4 * straight.error_p99 > 0.0


def test_textbook_forms_find_contacts_that_are_none_and_miss_some() -> None:
    for name in ("naive", "citardauq", "cross product"):
        row = measured("grazing, ulps", by(name))
        assert row.missed > 0
        assert row.false > 0
        assert row.wrong > row.missed + row.false
        assert 0.0 < row.widest_false < 1e-14


@pytest.mark.parametrize(
    ("name", "answers", "missed", "invented"),
    [
        ("generic", half_the_plane, (0.3, 0.7), (0.0, 0.0)),
        ("generic", without_anchors, (0.0, 0.0), (0.0, 0.0)),
        ("anchors apart", without_anchors, (0.1, 1.0), (0.1, 1.0)),
        ("generic", everything, (0.0, 0.0), (1.0, 1.0)),
    ],
)
def test_forms_that_are_wrong_are_found_out(
    name: str,
    answers: Callable[[Queries], Any],
    missed: tuple[float, float],
    invented: tuple[float, float],
) -> None:
    """By the share of contacts that they miss, and of the others of which they make contacts."""
    row = measured(name, answers)
    assert missed[0] <= row.missed / row.hits <= missed[1]
    assert invented[0] <= row.false / (row.queries - row.hits) <= invented[1]
    assert row.wrong >= row.missed + row.false


def test_deviations() -> None:
    one = FlightPlan(0.0, 0.0, 0.0, 0.0, 0, 1.0, UNIT)
    hit = Encounter(one, FlightPlan(4.0, 0.0, -1.0, 0.0, 0, 1.0, UNIT))
    assert deviation(hit, 2 * UNIT_TICKS) == Deviation(True, True)
    late = deviation(hit, 2 * UNIT_TICKS + (UNIT_TICKS >> 10))
    assert (late.off, late.error) == (UNIT_TICKS >> 10, 2.0**-11)
    assert (late.depth, late.depth_rho) == (2.0**-11, 2.0**-10 / (16 * 2.0**-53 * 4.0))
    early = deviation(hit, 2 * UNIT_TICKS - 4)
    assert (early.off, early.error, early.depth) == (-4.0, 2.0**-51, 0.0)
    missed = deviation(hit, NEVER)
    assert (missed.hit, missed.found, missed.missed) == (True, False, 1.0)
    passing = Encounter(one, FlightPlan(4.0, 3.0, -1.0, 0.0, 0, 1.0, UNIT))
    assert deviation(passing, NEVER) == Deviation(False, False)
    assert deviation(passing, UNIT_TICKS) == Deviation(False, True, passing=0.5)
    far = Encounter(one, FlightPlan(4.0, 0.0, -(2.0**-12), 0.0, 0, 1.0, UNIT))
    assert deviation(far, NEVER) == Deviation(False, False), "2^62 ticks or more away"
    assert deviation(far, 8192 * UNIT_TICKS) == Deviation(False, True)


def test_rows_count_deviations() -> None:
    unseen = query_row("generic", "form", [Deviation(True, False, missed=0.5)], np.ones(1))
    assert (unseen.missed, unseen.late, unseen.ticks_p99, unseen.error_max) == (1, None, None, None)
    deviations = [
        Deviation(True, True, off=-1.0, error=1.0),
        Deviation(True, True, off=2.0, error=3.0, depth=0.25, depth_rho=7.0),
        Deviation(True, True),
        Deviation(True, False, missed=0.5),
        Deviation(True, False, missed=0.25),
        Deviation(False, True, passing=0.125),
        Deviation(False, False),
    ]
    row = query_row("generic", "form", deviations, np.array([1.0, 2.0, 9.0]))
    assert (row.queries, row.hits, row.wrong, row.missed, row.false) == (7, 5, 5, 2, 1)
    assert (row.deepest_missed, row.widest_false) == (0.5, 0.125)
    assert (row.error_max, row.ticks_max, row.late) == (3.0, 2.0, 1 / 3)
    assert (row.depth, row.depth_rho) == (0.25, 7.0)
    assert (row.ns_median, row.batches) == (2.0, 3)


def test_a_form_that_reports_a_fault_is_not_believed() -> None:
    inside = Queries(
        np.array([[[0.0, 0.0], [0.5, 0.0]]]),
        np.array([[[0.0, 0.0], [-1.0, 0.0]]]),
        np.ones((1, 2)),
        np.zeros((1, 2), dtype=np.int64),
    )
    with pytest.raises(RuntimeError, match="query 0"):
        ticks_by(forms()[KERNEL], inside)


def test_batches_are_timed_in_turn() -> None:
    times = batch_times(forms(), FAMILIES[0].draw(50), batch=20, least=3)
    assert list(times) == list(forms())
    assert all(len(each) == 3 and (each >= 0.0).all() for each in times.values())
    assert len(batch_times(forms(), FAMILIES[0].draw(100), batch=20, least=3)[KERNEL]) == 5


def test_findings_say_what_textbooks_get_wrong() -> None:
    good = query_row("generic", KERNEL, [Deviation(True, True)] * 2, np.ones(1))
    naive = replace(good, form="naive", depth=1e-4, wrong=1, missed=1)
    citardauq = replace(naive, form="citardauq", depth=2e-4, missed=0, false=1)
    of_naive, of_citardauq, cost = part.query_findings([good, naive, citardauq])
    assert "naive form: 50% to 50% of the answers" in of_naive
    assert "misses 1 contacts and finds 0 that are none; discs overlap by up to 1e-4 R (generic)" in of_naive
    assert "citardauq form: 50% to 50%" in of_citardauq
    assert "up to 2e-4 R" in of_citardauq
    assert "costs 1 to 1 ns" in cost
    assert all(claim.holds for claim in part.query_claims([good, naive]))
    bad = replace(good, wrong=7, missed=3, false=4, depth_rho=1.5)
    assert not any(claim.holds for claim in part.query_claims([bad, naive]))


def test_one_wrong_answer_of_the_kernel_is_a_claim_that_does_not_hold() -> None:
    good = query_row("generic", KERNEL, [Deviation(True, True)] * 2, np.ones(1))
    exact, *rest = part.query_claims([replace(good, wrong=1)])
    assert exact.measured == "1 of 2 queries differ from the integer one"
    assert not exact.holds
    assert all(claim.holds for claim in rest)


def test_the_part_measures_every_family_and_form(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(part.COUNTS, "quick", 40)
    monkeypatch.setitem(part.BATCHES, "quick", 1)
    monkeypatch.setattr(part, "BATCH", 20)
    told: list[tuple[str, int, int]] = []
    section = part.measure("quick", lambda *what: told.append(what))
    assert section.name == "queries"
    families, hardness = section.tables
    assert [row.family for row in hardness.rows] == [family.name for family in FAMILIES]
    assert [(row.family, row.form) for row in families.rows] == [
        (family.name, form) for family in FAMILIES for form in forms()
    ]
    for table in section.tables:
        assert all(set(table.heads) <= set(vars(row)) for row in table.rows)
    assert told[-1][1] == told[-1][2] == len(FAMILIES)
    assert all(claim.holds for claim in section.claims)


def test_the_pictures_can_be_drawn() -> None:
    pytest.importorskip("matplotlib")
    from kinetile_accuracy.drawing import house_style

    rows = [
        replace(measured(name, by(form)), form=form)
        for name in ("generic", "grazing, ulps", "far apart")
        for form in forms()
    ]
    with house_style():
        for picture in part._pictures(rows):
            figure = picture.draw()
            (panel,) = figure.axes
            assert [label.get_text() for label in panel.get_yticklabels()] == list(
                dict.fromkeys(row.family for row in rows)
            )
            figure.draw_without_rendering()
