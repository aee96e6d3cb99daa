"""The kit is judged by mutants of the built-in phases: it must kill all that do wrong, and no other.

The whole table of docs/conformance.md takes minutes (``pytest -m slow``). What Hypothesis draws depends on
its release and on numbers that stand in kinetile's own source, so which check is the first to fail, and with
how many bodies, may change with them: such a row is a warning, and the table is to be printed anew.
"""

from __future__ import annotations

import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import mutants
from kinetile_conformance import CHECKS
from mutant_table import ALL, FIRST
from phase_mutant_table import MUTANTS
from phase_mutants import KILLED, judge

TESTS = Path(__file__).parents[2]
PAGE = (TESTS.parent / "docs" / "conformance.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    """Return what stands under a title of the page, down to the next one of any height."""
    return re.split(r"^##+ ", PAGE.partition(f"\n{title}\n")[2], flags=re.MULTILINE)[0]


SECTION = section("## The judge is judged")
NOT_YET = "not judged yet"
MORE_BODIES = {
    "misses one gap of a new plan",
    "makes its pairs at the first building only",
    "one state for all instances",
}
"""Mutants whose first check to fail needs more than three bodies."""

QUICK = (
    pytest.param("naive-only-one-pair-a-body", marks=pytest.mark.slow),
    pytest.param("naive-loses-a-pair-that-has-collided", marks=pytest.mark.slow),
    pytest.param("naive-writes-into-the-scene", marks=pytest.mark.slow),
    "naive-crashes-with-three-bodies",
    pytest.param("sap-1d-does-not-watch-the-middle-at-the-start", marks=pytest.mark.slow),
    pytest.param("sap-1d-takes-the-other-end-of-the-right-body", marks=pytest.mark.slow),
    pytest.param("sap-1d-an-exchange-that-is-none", marks=pytest.mark.slow),
    pytest.param("sap-2d-starts-without-its-pairs", marks=pytest.mark.slow),
)


def rows(text: str) -> list[list[str]]:
    """Return the cells of all tables in a text, without their heads."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    heads = ("| phase |", "|---")
    cells = [line.strip("|").split("|") for line in lines if not line.startswith(heads)]
    return [[cell.strip() for cell in row] for row in cells]


def judged(*labels: str) -> list[list[str]]:
    """Return the rows of mutants, or of all, as the program prints them."""
    done = subprocess.run(
        [sys.executable, str(TESTS / "mutant_table.py"), *labels],
        capture_output=True,
        text=True,
        check=True,
    )
    return rows(done.stdout)


@pytest.mark.interpreted
@pytest.mark.parametrize("label", QUICK)
def test_a_mutant_is_killed_with_three_bodies_at_most(label, load_mutant, tmp_path):
    result = judge(load_mutant(label), tmp_path, FIRST)
    assert result is not None
    assert not result.unjudged
    assert int(result.bodies or 0) <= 3


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("label", "check"),
    [
        pytest.param("naive-cannot-be-drawn-with-four-bodies", "can-be-drawn", marks=pytest.mark.slow),
        ("naive-draws-into-its-tables", "can-be-drawn"),
        ("sap-1d-has-a-state-as-long-as-its-process", "resumes-in-another-process"),
        ("naive-prints-what-it-prepares", "leaves-the-process-alone"),
        ("naive-seeds-the-random-numbers-of-everybody", "leaves-the-process-alone"),
        pytest.param(
            "naive-keeps-half-a-mib-of-each-simulation", "memory-does-not-grow", marks=pytest.mark.slow
        ),
    ],
)
def test_what_is_not_a_contact_is_observed_too(label, check, load_mutant, tmp_path):
    result = judge(load_mutant(label), tmp_path, [check])
    assert result is not None
    assert (result.check, result.status) == (check, "failed")


def test_every_mutant_can_be_made_of_the_present_source(load_mutant):
    for mutant in ALL:
        load_mutant(mutant.label)


def test_the_table_has_every_mutant():
    said = [row[:3] for row in rows(SECTION)]
    assert said == [[f"`{mutant.base}`", mutant.name, mutant.why] for mutant in MUTANTS]
    for mutant, (_, name, _, by, bodies) in zip(MUTANTS, rows(SECTION), strict=True):
        assert by.startswith("`") == (mutant.fate == KILLED), name
        assert int(bodies or 0) <= 3 or name in MORE_BODIES, name
    killed = [mutant for mutant in MUTANTS if mutant.fate == KILLED]
    assert f"{len(killed) - len(MORE_BODIES)} of them by a scene of at most three bodies" in SECTION
    assert f"{len(killed)} of {len(killed)}" in SECTION
    assert len(killed) >= 15


@pytest.mark.parametrize(
    ("title", "these"), [("### Made to fool it", mutants.MUTANTS), ("### Harmless", mutants.HARMLESS)]
)
def test_the_tables_below_have_every_mutant(title, these):
    said = rows(section(title))
    assert [row[:3] for row in said] == [[f"`{each.base}`", each.name, each.why] for each in these]
    for mutant, (_, name, _, by, bodies) in zip(these, said, strict=True):
        if by != NOT_YET:
            assert by.startswith("`") == (mutant.fate == KILLED), name
            assert int(bodies or 0) <= 400, name
            assert by.strip("`") in [check.name for check in CHECKS] or by == f"nothing: {mutant.fate}", name
    assert section(title).startswith(f"\n{len(these)} ")


@pytest.mark.long
@pytest.mark.compiled
def test_the_table_is_what_the_kit_makes_of_the_mutants():
    found = judged()
    assert [row[:3] for row in found] == [row[:3] for row in rows(SECTION)]
    for mutant, row, said in zip(MUTANTS, found, rows(SECTION), strict=True):
        *_, by, bodies = row
        assert by.startswith("`") == (mutant.fate == KILLED), row
        assert int(bodies or 0) <= 3 or mutant.name in MORE_BODIES, row
        if row != said:
            warnings.warn(f"docs/conformance.md has {said}, and found is {row}", stacklevel=1)
