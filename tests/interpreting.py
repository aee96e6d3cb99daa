"""Tests that run with plain Python hooks, in children beside the compiled ones.

Each choice of phases, commands and responses has its own loop, which takes 3 to 6 CPU seconds to compile: too
much for a test of some milliseconds. So the children have NUMBA_DISABLE_JIT=1. They run

- ``interpreted``: phases that are wrong on purpose, which can end a process when they are compiled;
- ``small``: few events, with a loop that hardly any other test needs. Another test of such loops, that they
  compile and give the contacts of the rules, is in ``tests/plugins/test_compiled_loops.py``.

A child collects the tests and forks; both take some tests of a file at a time until none are left. The
session runs its compiled tests meanwhile, and a thread shows each report of a child as soon as it arrives.
If hooks are interpreted already, all tests run in the same way.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

import pytest

import cost
from kinetile.kernel.compiled import NOTHING_IS_COMPILED

CHILD = "KINETILE_TEST_CHILD"
"""The variable that names a child's folder: it has the tests to run, and gets the reports."""

_folder = Path(os.environ.pop(CHILD)) if CHILD in os.environ else None  # a test may start a pytest of its own

_one_at_a_time = threading.RLock()
"""Held while a report is shown: by the main thread here, or by the thread that reads the child's."""

AT_A_TIME = 32
WAIT_SECONDS = 0.1


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> bool | None:
    """Runs the tests, marked ones in children, if there are some."""
    if _folder is not None:
        _run_as_child(session)
        return True
    marked = [item for item in session.items if _is_marked(item)]
    if NOTHING_IS_COMPILED or not marked or session.testsfailed or session.config.option.collectonly:
        return None
    _print_beside_capture(session.config)
    with tempfile.TemporaryDirectory() as folder:
        child = _Child(marked, Path(folder))
        showing = threading.Thread(target=child.show_all, daemon=True)
        showing.start()
        try:
            others = [item for item in session.items if not _is_marked(item)]
            _run([item for item in others if not cost.is_judged_by(item)])
            while showing.is_alive():
                showing.join(WAIT_SECONDS)
                _stop_if_asked(session)
            _run([*filter(cost.is_judged_by, others)])
        finally:
            child.end()
            showing.join()
    return True


def _print_beside_capture(config: pytest.Config) -> None:
    """Makes the terminal's writer print to its own descriptor: stdout's is redirected while a test runs, and
    output of a thread then would be taken for output of the test."""
    writer = config.get_terminal_writer()
    with suppress(OSError):  # stdout is not a file
        own = os.dup(writer._file.fileno())
        writer._file = os.fdopen(own, "w", buffering=1, encoding=writer._file.encoding, errors="replace")


def of_this_process(items: list[pytest.Item]) -> list[pytest.Item]:
    if _folder is None:
        return items
    wanted = {*json.loads((_folder / "tests").read_text(encoding="utf-8"))}
    return [item for item in items if item.nodeid in wanted]


def _is_marked(item: pytest.Item) -> bool:
    return any(item.get_closest_marker(name) is not None for name in ("small", "interpreted"))


def _run(items: list[pytest.Item]) -> None:
    for item, following in pairwise([*items, None]):
        assert item is not None
        item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
        _stop_if_asked(item.session)


def _stop_if_asked(session: pytest.Session) -> None:
    """Raises the end of a session, for example after a failure with ``-x``."""
    if session.shouldfail:
        raise session.Failed(session.shouldfail)
    if session.shouldstop:
        raise session.Interrupted(session.shouldstop)


class _Child:
    """A process that runs tests, and its reports."""

    def __init__(self, items: list[pytest.Item], folder: Path) -> None:
        self._items = {item.nodeid: item for item in items}
        self._reports: dict[str, list[dict[str, Any]]] = {}
        self._half = ""  # of an unfinished line
        self._stopped = False
        (folder / "tests").write_text(json.dumps([*self._items]), encoding="utf-8")
        (folder / "reports").touch()
        self._lines = (folder / "reports").open(encoding="utf-8")
        self._printed = (folder / "printed").open("w+", encoding="utf-8")
        config, files = items[0].config, dict.fromkeys(str(item.path) for item in items)
        words = ["-q", "-m", str(config.option.markexpr or ""), "-p", "no:cacheprovider", *files]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "pytest", *words],
            cwd=config.rootpath,
            env={**os.environ, "NUMBA_DISABLE_JIT": "1", CHILD: str(folder)},
            stdout=self._printed,
            stderr=subprocess.STDOUT,
        )

    def show_all(self) -> None:
        """Shows the reports of tests as they end, then the lost tests, with the output of the process."""
        while self._process.poll() is None:
            self._show_ended()
            time.sleep(WAIT_SECONDS)
        self._show_ended()
        if not self._stopped:
            self._show_lost()

    def _show_ended(self) -> None:
        *lines, self._half = (self._half + self._lines.read()).split("\n")
        for data in map(json.loads, lines):
            if "cost" in data:
                cost.add(data["cost"])
                continue
            self._reports.setdefault(data["nodeid"], []).append(data)
            if data["when"] == "teardown":
                self._show(data["nodeid"])

    def _show_lost(self) -> None:
        self._printed.seek(0)
        said = f"the child with interpreted hooks ended with {self._process.returncode} before it"
        text = f"{said}\n{self._printed.read()}"
        for name, item in list(self._items.items()):
            report = pytest.TestReport(name, item.location, {}, "failed", text, "call")
            self._reports.setdefault(name, []).append(_serializable(report))
            self._show(name)

    def _show(self, name: str) -> None:
        item = self._items.pop(name)
        with _one_at_a_time:
            item.ihook.pytest_runtest_logstart(nodeid=name, location=item.location)
            for data in self._reports.pop(name):
                if data["outcome"] == "skipped":
                    data["longrepr"] = tuple(data["longrepr"])  # their summary refuses JSON's list
                report = item.ihook.pytest_report_from_serializable(config=item.config, data=data)
                item.ihook.pytest_runtest_logreport(report=report)
            item.ihook.pytest_runtest_logfinish(nodeid=name, location=item.location)

    def end(self) -> None:
        """Stops the process, if it still runs."""
        self._stopped = True
        self._process.terminate()
        self._process.wait()


def _run_as_child(session: pytest.Session) -> None:
    """Runs tests in this process and in a fork of it, which take them in turns."""
    groups = [
        tests[at : at + AT_A_TIME]
        for tests in (list(each) for _, each in groupby(session.items, key=lambda item: item.path))
        for at in range(0, len(tests), AT_A_TIME)
    ]
    taken, given = os.pipe()
    os.write(given, b"".join(number.to_bytes(2, "big") for number in range(len(groups))))
    os.close(given)
    fork = os.fork() if hasattr(os, "fork") else None
    try:
        while number := os.read(taken, 2):
            _run(groups[int.from_bytes(number, "big")])
        _write({"cost": cost.counts})
    finally:
        if fork == 0:
            os._exit(0)
        if fork is not None:
            os.waitpid(fork, 0)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_logreport(report: pytest.TestReport) -> Iterator[None]:
    """Writes a child's report down, as soon as there is one; shows one at a time."""
    if _folder is not None:
        _write({"nodeid": report.nodeid, **_serializable(report)})
    with _one_at_a_time:
        return (yield)


def _write(data: dict[str, Any]) -> None:
    """Writes a line of a child, in one piece: its fork writes to the same file."""
    assert _folder is not None
    file = os.open(_folder / "reports", os.O_WRONLY | os.O_APPEND)
    os.write(file, f"{json.dumps(data)}\n".encode())
    os.close(file)


def _serializable(report: pytest.TestReport) -> dict[str, Any]:
    return {**report._to_json(), "$report_type": "TestReport"}
