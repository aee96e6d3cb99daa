"""Tests that run with plain Python hooks, in one child; their reports are repeated here.

Each choice of phases, commands and responses has a loop of its own, which takes 8 to 17 CPU seconds to
compile: too much for a test of some milliseconds. So the child has NUMBA_DISABLE_JIT=1. It runs

- ``interpreted``: phases that are written to be wrong, which can end a process when they are compiled;
- ``small``: few events, with a loop that hardly any other test needs. That such loops compile, and give the
  contacts of the rules, is tested in ``tests/plugins/test_compiled_loops.py``.

Where hooks are interpreted already, all of them run as any other test.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

from kinetile.kernel.compiled import INTERPRETED

REPORTS = "KINETILE_TEST_REPORTS"
"""The variable that names the file for a child's reports."""

_reports: dict[str, list[dict[str, Any]]] = {}


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Repeat the reports of a marked test from the child of its file."""
    if INTERPRETED or not _is_marked(item):
        return None
    if item.nodeid not in _reports:
        _run_interpreted([each for each in item.session.items if _shares(each, item)])
    hook = item.ihook
    hook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    for data in _reports[item.nodeid]:
        if data["outcome"] == "skipped":
            data["longrepr"] = tuple(data["longrepr"])  # the summary of skipped tests refuses JSON's list
        report = hook.pytest_report_from_serializable(config=item.config, data=data)
        hook.pytest_runtest_logreport(report=report)
    hook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    # The test before has left standing what it shares with this one, a file's fixtures for instance. They end
    # here if the next test is of another file.
    item.session._setupstate.teardown_exact(nextitem)
    return True


def _is_marked(item: pytest.Item) -> bool:
    """Return whether a test is to run in the child."""
    return any(item.get_closest_marker(name) is not None for name in ("small", "interpreted"))


def _shares(one: pytest.Item, other: pytest.Item) -> bool:
    """Return whether two tests share a child: marked ones do, and under pytest-xdist those of one file."""
    return _is_marked(one) and (one.path == other.path or not hasattr(other.config, "workerinput"))


def _run_interpreted(items: list[pytest.Item]) -> None:
    """Run tests in a child, and keep their reports; a test without any gets the child's output instead."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "reports"
        file.touch()
        words = ["-q", "-m", "", "-p", "no:cacheprovider", *(item.nodeid for item in items)]
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *words],
            cwd=items[0].config.rootpath,
            env={**os.environ, "NUMBA_DISABLE_JIT": "1", REPORTS: str(file)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        lines = file.read_text(encoding="utf-8").splitlines()
    for data in map(json.loads, lines):
        _reports.setdefault(data["nodeid"], []).append(data)
    for item in items:
        if _reports.get(item.nodeid, [{}])[-1].get("when") != "teardown":
            said = f"the child with interpreted hooks ended with {done.returncode} before it\n{done.stdout}"
            lost = pytest.TestReport(item.nodeid, item.location, {}, "failed", said, "call")
            data = item.ihook.pytest_report_to_serializable(config=item.config, report=lost)
            _reports.setdefault(item.nodeid, []).append(data)


@pytest.hookimpl(trylast=True)
def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Write a child's report down, as soon as there is one."""
    if path := os.environ.get(REPORTS):
        data = {"nodeid": report.nodeid, **_serializable(report)}
        with open(path, "a", encoding="utf-8") as file:
            file.write(json.dumps(data) + "\n")


def _serializable(report: pytest.TestReport) -> dict[str, Any]:
    return {**report._to_json(), "$report_type": "TestReport"}
