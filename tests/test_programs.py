"""Programs that are no Python are found, tried, then used; tests skip what does not run, and say why."""

import os
import re
import sys
from pathlib import Path

import pytest

import programs

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="its programs are no scripts")

SHIM = "error: rustup could not choose a version of rustc to run, because one wasn't specified"
BROKEN = {
    "a shim of nothing": (f"#!/bin/sh\necho {SHIM!r} >&2\nexit 1\n", "rustup could not choose"),
    "a program that runs and makes nothing": ("#!/bin/sh\n", "No such file|its answer is ''"),
    "a program that ends by a signal": ("#!/bin/sh\nkill -SEGV $$\n", "exit code -11"),
    "a file that is no program": ("\x7fELF", "Exec format error"),
}


@pytest.mark.parametrize("name", programs.TRIALS)
@pytest.mark.parametrize("case", BROKEN)
def test_a_program_that_is_there_and_does_not_run_was_used(name, case, tmp_path, monkeypatch):
    text, reason = BROKEN[case]
    file = tmp_path / programs.TRIALS[name].names[0]
    file.write_text(text, encoding="utf-8")
    file.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}/nowhere")
    programs.found_and_tried.cache_clear()
    try:
        found = re.escape(str(file))
        with pytest.raises(pytest.skip.Exception, match=f"(?s){found} does not run: .*({reason})"):
            programs.program(name)
        file.unlink()
        programs.found_and_tried.cache_clear()
        with pytest.raises(pytest.skip.Exception, match=f"there is no {re.escape(name)} here"):
            programs.program(name)
    finally:
        programs.found_and_tried.cache_clear()


def test_no_other_test_looks_for_a_program():
    tests = Path(programs.__file__).parent
    found = {each.name for each in tests.rglob("*.py") if ".which(" in each.read_text(encoding="utf-8")}
    assert found <= {"programs.py", "test_programs.py"}
