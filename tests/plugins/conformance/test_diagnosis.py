"""The diagnosis: what authors usually did wrong ends a failure, and is right of mutants."""

import re
import tomllib
from contextlib import contextmanager
from pathlib import Path

import pytest

from installing import loaded
from kinetile import BroadPhaseSpec, Response
from kinetile.errors import NotJudged
from kinetile.kernel.compiled import NOTHING_IS_COMPILED, composer
from kinetile.scene import Scene, Settings
from kinetile_conformance import CHECKS, check_broad_phase, parametrize_with_checks
from kinetile_conformance.api import replay
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks import check_named
from kinetile_conformance.drawing import Drawing
from kinetile_conformance.reporting import OFTEN, SYMPTOMS, diagnosed, likely
from kinetile_conformance.runner import CheckRun, JudgingPlan, Runner, reference_of
from lanes import first
from registering import registered

SEEN = (
    ("one-sided", "naive-names-the-later-ones-only", "its-structure-is-true"),
    ("index", "sap-1d-writes-past-its-own-array", "writes-only-where-it-may"),
    ("scene", "naive-writes-into-the-scene", "writes-only-where-it-may"),
    ("writes", "naive-brakes-a-body-that-has-a-new-plan", "writes-only-where-it-may"),
    pytest.param(
        *("shared", "sap-1d-one-state-for-all-instances", "state-is-not-kept"), marks=pytest.mark.slow
    ),
    ("start", "naive-tires-of-a-late-clock", "same-contacts-after-a-change-of-view"),
    ("anew", "sap-1d-makes-its-pairs-at-the-first-building-only", "its-structure-is-true"),
    ("turns", "sap-1d-ignores-turns", "same-contacts-with-turns"),
    pytest.param(*("stalled", "sap-1d-an-exchange-that-is-none", "same-contacts"), marks=pytest.mark.slow),
    ("empty", "naive-cannot-do-without-bodies", "same-contacts-in-the-gallery"),
    ("pair-set", "sap-1d-adds-where-it-should-remove", "same-contacts"),
    ("claims", "sap-1d-says-that-its-pairs-are-boxes", "pairs-are-overlapping-boxes"),
    ("missed", "sap-1d-the-true-radius", "same-contacts"),
    ("newcomer", "naive-only-one-pair-a-body", "same-contacts"),
)
"""The row, a mutant, and the check that fails and ends with it."""


def meeting() -> Scene:
    """Returns a column of three, each touching the next; one of them stands still."""
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
    """None of six drawn scenes shows it, so it is run on a scene that does."""
    label, check = "cells-truncates-where-it-should-round-down", "same-contacts-after-a-change-of-view"
    load_mutant(label)
    run = CheckRun(check_named(check), Subject(label, {}))
    assert not run.holds(meeting())
    assert likely(check, str(run.message)) == often("floor")


def often(row: str) -> str:
    return SYMPTOMS[row]["often"] if row else ""


BEGINNERS = tomllib.loads((Path(__file__).parent / "beginners.toml").read_text(encoding="utf-8"))
PAGE = Path(__file__).parents[3] / "docs" / "tutorial.md"
BLOCK = re.compile(r"^<!-- file: \S+/phase.py -->\n```python\n(.*?)```$", re.DOTALL | re.MULTILINE)


@contextmanager
def grid_with(error, folder):
    """Registers the grid of the page with an error; yields its row."""
    row, text = BEGINNERS[error], "\n\n".join(BLOCK.findall(PAGE.read_text(encoding="utf-8")))
    for old, new in row["edits"]:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "grid.py").write_text(text, encoding="utf-8")
    with loaded(folder / "grid.py") as module, registered(BroadPhaseSpec("grid", module.GridPhase)):
        yield row


@pytest.mark.interpreted
@pytest.mark.parametrize("error", first(14, [*BEGINNERS]))
def test_an_error_of_a_beginner_is_told_truly(error, tmp_path):
    with grid_with(error, tmp_path) as row:
        runner = Runner(JudgingPlan(Subject("grid", {}), examples=12, shrink=False, explains=False))
        check, found = "", ""
        try:
            runner.smoke_test()
        except NotJudged as refusal:
            found, _, ends = str(refusal).partition(f"\n{OFTEN}")
        else:
            failed = runner.run("same-contacts")
            check, found, ends = failed.check, failed.said, likely(failed.check, failed.said)
    assert re.search(row["says"], found), found
    assert (check, ends) == (row.get("check", ""), often(row.get("often", "")))


QUICKLY = {"shrink": False, "explains": False}
ON_FEW = {
    "a-helper-that-is-no-hook": (),
    "one-more-than-near-has-written": ("same-contacts",),
    "a-hook-moves-a-body": ("writes-only-where-it-may", "same-contacts-in-a-swarm"),
    "repair-names-nobody": ("its-structure-is-true", "its-features-are-known"),
}
"""The checks; the first fails on few small scenes, if there is one: else nothing is judged."""


@pytest.mark.skipif(NOTHING_IS_COMPILED, reason="nothing is compiled")
@pytest.mark.parametrize("error", first(3, [*ON_FEW]))
def test_the_compiler_came_before_a_fault_that_few_scenes_show(error, monkeypatch, tmp_path):
    monkeypatch.setattr(composer._Composed, "made", property(lambda _: pytest.fail("a loop is compiled")))
    checks = ON_FEW[error] or ("same-contacts",)
    how = {"checks": checks, "in_process": True, "save_to": tmp_path} | QUICKLY
    with grid_with(error, tmp_path) as row:
        if not ON_FEW[error]:
            with pytest.raises(NotJudged, match=row["says"]):
                check_broad_phase("grid", **how)
            return
        report = check_broad_phase("grid", **how)
        assert [(each.check, each.status) for each in report.results] == [(checks[0], "failed")]
        assert report.notes == ("the others are not run until this error is gone",) * (len(checks) > 1)
        case = report.results[0].case
        assert not check_named(checks[0]).strategy or not replay("grid", case).ok
        (mark,) = parametrize_with_checks("grid", **how | {"checks": checks[:1]}).args[1]
        with pytest.raises(AssertionError, match=checks[0]):
            mark.values[0]()


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
        ("floor", "same-contacts-after-a-change-of-view", "moved, contact 1 is missing: body 0 with body 1"),
        ("sizes", "same-contacts-beside-giants", "contact 3 is missing: body 0 with body 9"),
        ("many", "same-contacts-in-a-swarm", "contact 61 is missing: body 33 with body 34"),
        ("late", "its-structure-is-true", "bodies 0 and 1 touch (gap -2.2e-16) and are not a candidate pair"),
    ],
)
def test_other_rows_are_told_by_the_check_and_its_words(row, check, words):
    assert likely(check, words) == often(row)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("response", "at the start respond wrote bodies.x; there are 2"),
        ("response", "body 0 and body 1 leave with [1.0]; with the two exchanged, body 1 and body 0 leave"),
        ("response", "a meeting of body 0 and body 1 adds 1e-07 of energy"),
        ("division", "respond raised ZeroDivisionError: float division by zero"),
        ("", "contact 4 is missing: body 0 with body 1"),
    ],
)
def test_of_a_response_no_advice_was_for_broad_phases(row, words):
    """`near`, `repair` and `since_anchor` were named, which a response does not have."""
    subject = Subject("naive", {}, {}, Response("trial"))
    found = diagnosed("a-response-depends-on-the-meeting-alone", words, subject)
    assert found == ([f"{OFTEN}{often(row)}"] if row else [])


def test_nothing_is_told_where_no_row_applies():
    assert likely("its-features-are-known", "it declares a feature") == ""


def test_rows_are_few_and_name_checks_that_there_are():
    kinds = [kind for row in SYMPTOMS.values() for kind in row.get("kinds", ["broad"])]
    assert kinds.count("broad") <= 24
    assert {*kinds} <= {"broad", "pair", "response"}
    most = {"often", "checks", "kinds", "pattern"}
    assert all({"often", "pattern"} <= {*row} <= most for row in SYMPTOMS.values())
    named = {check for row in SYMPTOMS.values() for check in row.get("checks", ())}
    assert named <= {check.name for check in CHECKS}
