"""The diagnosis: what authors usually did wrong ends a failure, and is right of mutants."""

import pytest

from kinetile.scene import Scene, Settings
from kinetile_conformance import CHECKS
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks import check_named
from kinetile_conformance.drawing import Drawing
from kinetile_conformance.reporting import OFTEN, SYMPTOMS, diagnosed, likely
from kinetile_conformance.runner import CheckRun, reference_of
from lanes import first

SEEN = (
    ("one-sided", "naive-names-the-later-ones-only", "its-structure-is-true"),
    ("index", "sap-1d-writes-past-its-own-array", "writes-only-where-it-may"),
    ("scene", "naive-writes-into-the-scene", "writes-only-where-it-may"),
    ("writes", "naive-brakes-a-body-that-has-a-new-plan", "writes-only-where-it-may"),
    pytest.param(
        *("shared", "sap-1d-one-state-for-all-instances", "state-is-not-kept"), marks=pytest.mark.slow
    ),
    ("start", "naive-tires-of-a-late-clock", "same-contacts-after-a-change-of-view"),
    ("anew", "sap-1d-makes-its-pairs-at-the-first-building-only", "resumes"),
    ("turns", "sap-1d-ignores-turns", "same-contacts-with-turns"),
    pytest.param(*("stalled", "sap-1d-an-exchange-that-is-none", "same-contacts"), marks=pytest.mark.slow),
    ("empty", "naive-cannot-do-without-bodies", "same-contacts-in-the-gallery"),
    ("pair-set", "sap-1d-adds-where-it-should-remove", "same-contacts"),
    ("claims", "sap-1d-says-that-its-pairs-are-boxes", "pairs-are-overlapping-boxes"),
    ("late", "sap-1d-the-true-radius", "same-contacts"),
    ("newcomer", "naive-only-one-pair-a-body", "same-contacts"),
)
"""The row, a mutant, and the check that fails and ends with it."""


def meeting() -> Scene:
    """Return a column of three, each touching the next, of which one stands still."""
    velocity = [[0.0, 0.5], [0.0, -0.5], [0.0, 0.0]]
    return Scene([[0.5, 0.5], [0.5, 1.5], [0.5, 2.5]], velocity, 0.5, settings=Settings(until=1.0))


@pytest.fixture(scope="module")
def shared():
    """Some scenes for all mutants, and their outcomes under the reference."""
    return Drawing(100, 0), reference_of(Subject("naive", {}))


@pytest.mark.interpreted
@pytest.mark.parametrize(("row", "label", "check"), first(1, SEEN))
def test_a_failure_ends_with_what_authors_usually_did_wrong(row, label, check, shared, load_mutant):
    load_mutant(label)
    drawing, reference = shared
    run = CheckRun(check_named(check), Subject(label, {}), reference)
    assert not all(map(run.holds, drawing.scenes(run.each)))
    assert diagnosed(check, str(run.message), run.subject) == [f"{OFTEN}{often(row)}"]


@pytest.mark.interpreted
def test_truncation_for_floor_is_named(load_mutant):
    """Among six drawn scenes there is none that shows it, so it is run on one that does."""
    label, check = "cells-truncates-where-it-should-round-down", "same-contacts-after-a-change-of-view"
    load_mutant(label)
    run = CheckRun(check_named(check), Subject(label, {}))
    assert not run.holds(meeting())
    assert likely(check, str(run.message)) == often("floor")


def often(row: str) -> str:
    return SYMPTOMS[row]["often"]


def test_many_rows_are_shown_on_mutants():
    assert len({getattr(each, "values", each)[0] for each in SEEN}) >= 12


@pytest.mark.parametrize(
    ("row", "check", "words"),
    [
        (
            "surroundings",
            "does-not-see-who-asks",
            "in another thread, the run ran, with 3 events; before it ran",
        ),
        ("ticks", "same-contacts-after-a-change-of-view", "256 times as slow, contact 4 is missing: body 0"),
        ("long", "same-contacts-in-a-marathon", "contact 70311 is missing: body 0 with body 1"),
        (
            "absolute",
            "same-contacts-after-a-change-of-view",
            "32 times as large, contact 2 is missing: body 0",
        ),
        (
            "floor",
            "same-contacts-after-a-change-of-view",
            "moved, contact 1 is missing: body 0 with body 1",
        ),
        ("sizes", "same-contacts-beside-giants", "contact 3 is missing: body 0 with body 9"),
        ("many", "same-contacts-in-a-swarm", "contact 61 is missing: body 33 with body 34"),
    ],
)
def test_other_rows_are_told_by_the_check_and_its_words(row, check, words):
    assert likely(check, words) == often(row)


def test_nothing_is_told_where_no_row_applies():
    assert likely("its-features-are-known", "it declares a feature") == ""


def test_rows_are_few_and_name_checks_that_there_are():
    assert len(SYMPTOMS) <= 21
    assert all({*row} <= {"often", "checks", "pattern"} for row in SYMPTOMS.values())
    named = {check for row in SYMPTOMS.values() for check in row.get("checks", ())}
    assert named <= {check.name for check in CHECKS}
