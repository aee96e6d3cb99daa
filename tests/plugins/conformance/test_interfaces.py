"""The interfaces of the kit besides the command: a function, and a decorator for pytest."""

from itertools import product

import pytest

from installing import install_blind, run
from kinetile_conformance import CHECKS, check_broad_phase, parametrize_with_checks

NAMES = [check.name for check in CHECKS]

TESTS = """
from kinetile_conformance import parametrize_with_checks


@parametrize_with_checks("blind", examples=20, shrink=False, expected_failures={"same-contacts": "blind"})
def test_as_expected(check):
    check()


@parametrize_with_checks("blind", examples=2, expected_failures={"can-be-drawn": "it is blind"})
def test_not_as_expected(check):
    check()


@parametrize_with_checks("naive", examples=2)
def test_naive(check):
    check()
"""


def test_each_result_is_told_as_it_comes():
    told = []
    checks = ["its-features-are-known", "pairs-are-overlapping-boxes"]
    report = check_broad_phase("naive", checks=checks, on_result=told.append)
    assert tuple(told) == report.results
    assert [result.check for result in told] == checks
    assert [result.status for result in told] == ["passed", "skipped"]


def test_it_makes_a_test_of_each_check():
    mark = parametrize_with_checks("naive", expected_failures={"can-be-drawn": "issue 7"}).mark
    cases = {case.id: case for case in mark.args[1]}
    assert list(cases) == NAMES
    assert cases["same-contacts"].marks == ()
    (expected,) = cases["can-be-drawn"].marks
    assert expected.name == "xfail"
    assert expected.kwargs == {"reason": "issue 7", "strict": True}


@pytest.fixture(scope="module")
def blind(tmp_path_factory):
    """A folder with an installed broad phase that misses contacts, and TESTS."""
    folder = tmp_path_factory.mktemp("interfaces")
    paths = install_blind(folder)
    (folder / "test_blind.py").write_text(TESTS, encoding="utf-8")

    def pytest_(*words):
        return run("-p", "no:cacheprovider", *words, folder=folder, paths=paths, module="pytest")

    return pytest_


@pytest.mark.slow
def test_expected_failures_are_xfailed_and_may_not_pass(blind):
    checks = ("can-be-drawn", "pairs-are-overlapping-boxes", "its-features-are-known", "same-contacts")
    tests = product(("as_expected", "not_as_expected", "naive"), checks)
    done = blind("-rA", *(f"test_blind.py::test_{test}[{check}]" for test, check in tests))
    lines = [line.partition(" - ")[0] for line in done.stdout.splitlines()]
    assert done.returncode == 1, done.stderr
    for line in (
        "PASSED test_blind.py::test_as_expected[its-features-are-known]",
        "XFAIL test_blind.py::test_as_expected[same-contacts]",
        "FAILED test_blind.py::test_not_as_expected[can-be-drawn]",
        "PASSED test_blind.py::test_naive[same-contacts]",
    ):
        assert line in lines, done.stdout
    assert "[XPASS(strict)] it is blind" in done.stdout
    assert "for phases that declare the feature 'boxes'" in done.stdout
    assert "3 skipped" in lines[-1]
