"""The conformance kit kills every mutant by the check that the table names, and spares right variations.

All of them take hours; the default lane judges two, the second lane one in ten (``pytest -m slow``).
"""

import ast
import itertools
import re
from pathlib import Path

import pytest

import lanes
import mutants
from kinetile.kernel.tables import allocate
from kinetile_conformance import CHECKS, judging
from kinetile_conformance.checks import check_named

DOCS = Path(__file__).parents[2] / "docs"

DEFAULT = ("naive-draws-into-its-tables", "sap-1d-takes-the-other-end-of-the-right-body")
EVERY = 10
LARGE = ("does-not-see-who-asks", "skin-limit-holds-at-its-edge")


def on_few(check):
    """Returns True if a check uses small scenes, or its own scenes."""
    strategy = check_named(check).strategy
    return strategy is None or strategy.name.startswith("small scenes")


SMALL = [
    name
    for name, each in mutants.ALL.items()
    if each.killed_by and each.killed_by not in LARGE and on_few(each.killed_by)
]
"""Mutants that die on small scenes, so with plain hooks; the others take ten minutes with them."""

REST = [
    *(
        pytest.param(name, marks=[pytest.mark.interpreted, pytest.mark.long if at else pytest.mark.slow])
        for at, name in zip(itertools.cycle(range(EVERY)), SMALL)
        if name not in DEFAULT
    ),
    *(pytest.param(name, marks=pytest.mark.long) for name in mutants.ALL if name not in SMALL),
]
CASES = [
    *(pytest.param(name, marks=pytest.mark.interpreted) for name in DEFAULT),
    *(REST if lanes.slow_ones else []),
]


def test_every_mutant_can_be_made_of_the_present_source() -> None:
    for mutant in mutants.ALL.values():
        changed = {each.file for each in mutant.changes}
        for file, text in mutant.sources():
            if file in changed:
                assert text != mutants.FILES[file].read_text(encoding="utf-8"), mutant.name
                if lanes.slow_ones:
                    ast.parse(text)


FIELD = re.compile(r"\bk\.(\w+)\[[^][]*\]\.(\w+)")
"""A field of a table of the kernel, as a hook reads it."""


def test_faults_read_fields_that_there_are() -> None:
    """One read the stamps at their old place: it did not compile, so no check judged it."""
    tables = allocate(2, 2, 2, shaped=True)
    for mutant in mutants.ALL.values():
        for table, field in FIELD.findall(" ".join(change.new for change in mutant.changes)):
            assert field in getattr(tables, table).dtype.names, f"{mutant.name}: k.{table}[...].{field}"


def test_the_table_names_checks() -> None:
    named = {mutant.killed_by for mutant in mutants.ALL.values() if mutant.killed_by}
    assert named <= {check.name for check in CHECKS}


def test_the_page_counts_them() -> None:
    page = (DOCS / "conformance.md").read_text(encoding="utf-8")
    killed, faults = (sum(each) for each in zip(*judging.faults().values(), strict=True))
    variations = len(mutants.outcomes()["variations"])
    assert f"It finds {killed} of {faults} faults, and condemns none of {variations} " in page


def test_the_runner_has_written_what_becomes_of_every_mutant() -> None:
    written = mutants.outcomes()
    found = written["faults"] | written["variations"]
    assert found.keys() == mutants.ALL.keys()
    assert {name for name in found if mutants.ALL[name].right} == written["variations"].keys()
    by_table = {name: mutant.killed_by for name, mutant in mutants.ALL.items() if mutant.killed_by}
    assert by_table == {name: row["killed_by"] for name, row in found.items() if row.get("killed_by")}
    assert not any(row["condemned_by"] for row in written["variations"].values())


def test_the_table_beside_them_is_printed_from_it() -> None:
    assert (mutants.HERE / "README.md").read_text(encoding="utf-8") == mutants.table()


@pytest.mark.parametrize("name", CASES)
def test_a_mutant_is_killed_by_its_check_or_spared(name: str, tmp_path: Path) -> None:
    found = mutants.judge(name, tmp_path, shrink=False, explains=False)
    assert mutants.as_expected(name, found), found
