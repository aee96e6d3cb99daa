"""The interfaces of the kit besides the command: a function, and a decorator for pytest."""

import tomllib
from pathlib import Path

import pytest

from kinetile_conformance import CHECKS, check_broad_phase, parametrize_with_checks

NAMES = [check.name for check in CHECKS if check.observation.judges in (None, "broad")]


@pytest.mark.small
def test_each_result_is_told_as_it_comes():
    told = []
    checks = ["its-features-are-known", "pairs-are-overlapping-boxes"]
    report = check_broad_phase("naive", checks=checks, on_result=told.append, in_process=True)
    assert tuple(told) == report.results
    assert [result.check for result in told] == checks
    assert [result.status for result in told] == ["passed", "skipped"]


@pytest.mark.small
def test_the_name_of_a_check_was_read_letter_by_letter():
    (result,) = check_broad_phase("naive", checks="its-features-are-known", in_process=True).results
    assert (result.check, result.status) == ("its-features-are-known", "passed")


def test_it_makes_a_test_of_each_check():
    mark = parametrize_with_checks("naive", expected_failures={"its-structure-is-true": "issue 7"}).mark
    cases = {case.id: case for case in mark.args[1]}
    assert list(cases) == NAMES
    assert cases["same-contacts"].marks == ()
    (expected,) = cases["its-structure-is-true"].marks
    assert expected.name == "xfail"
    assert expected.kwargs == {"reason": "issue 7", "strict": True}


def test_every_run_of_pytest_imported_the_kit():
    """To end its children, which end by themselves."""
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text(encoding="utf-8"))
    assert "pytest11" not in project["project"]["entry-points"]
