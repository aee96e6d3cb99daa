"""Every rule of sweep-tiling matters, and the tests would notice if it were another: mutants are killed.

``pytest -s`` shows the table of who noticed what. The mutants are in ``tests/tiling_mutant_table.py``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import tiling_mutants
from tiling_mutant_table import MUTANTS, UNCHANGED

SAVES_WORK_ONLY = {
    "ties at a meeting by number alone",
    "ties at a meeting by the wrong velocity",
    "a flip parts and does not meet",
}
"""A wrong order at a meeting of two level bodies is put right by a flip at the same moment. The meeting that
a flip leaves out follows by itself, since the two bounds are a deep inversion."""


def results(*words: str, **environment: str) -> dict[str, dict[str, Any]]:
    """Run the mutants in a process of their own; return what it says, by name."""
    program = Path(str(tiling_mutants.__file__))
    path = os.pathsep.join([str(program.parent), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, str(program), *words],
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        timeout=3000,
    )
    assert done.returncode == 0, done.stderr
    return {line["name"]: line for line in map(json.loads, done.stdout.splitlines())}


NAMES = [mutant.name for mutant in MUTANTS if mutant.name != UNCHANGED]
EVERY = 5
"""One mutant in five is slow and runs in CI; the others are long: together they take minutes."""

MARKED = [
    pytest.param(name, marks=pytest.mark.slow if at % EVERY == 0 else pytest.mark.long)
    for at, name in enumerate(NAMES)
]


@pytest.fixture(scope="module")
def verdicts(request: pytest.FixtureRequest) -> dict[str, dict[str, Any]]:
    """What the mutants that are asked for do on the fixed scenes, interpreted."""
    here = [item for item in request.session.items if getattr(item, "module", None) is request.module]
    asked = [item.callspec.params["name"] for item in here if hasattr(item, "callspec")]
    found = results(UNCHANGED, *asked, NUMBA_DISABLE_JIT="1")
    print()
    for name, line in found.items():
        print(f"{name[:56]:56} | {line['contacts'][:36]:36} | {line['audit'][:72] or line['work']}")
    return found


@pytest.mark.slow
def test_what_is_not_changed_is_not_noticed(verdicts):
    line = verdicts[UNCHANGED]
    assert line["contacts"] == line["audit"] == line["work"] == ""


@pytest.mark.parametrize("name", MARKED)
def test_a_mutant_is_noticed(verdicts, name):
    line = verdicts[name]
    if name in SAVES_WORK_ONLY:
        assert line["work"]
    else:
        assert line["contacts"] or line["audit"]


COUNTED = (
    UNCHANGED,
    "the thesis's meeting: outer of b := upper of a",
    "no corner rule",
    "past events are dropped",
    "an epsilon is subtracted from times",
    "times decide, with an epsilon",
    "deep inversions are not repaired",
    "bounds without the skin",
)


@pytest.mark.compiled
@pytest.mark.long
def test_how_often_the_thesis_as_it_stands_goes_wrong(tmp_path):
    """The figures of docs/sweep-tiling.md: of 100 scenes of each kind, how many have other contacts than
    ``naive``, and on how many an audit fails that does not look at failure times."""
    found = results("--count", "100", *COUNTED, NUMBA_CACHE_DIR=str(tmp_path))
    print()
    for name, line in found.items():
        counts = [f"{kind} {line[kind]['contacts']:3} / {line[kind]['audit']:3}" for kind in KINDS]
        print(f"{name[:50]:50} | {' | '.join(counts)} | {line['seconds']:.0f} s")
    assert all(found[UNCHANGED][kind]["audit"] == 0 == found[UNCHANGED][kind]["contacts"] for kind in KINDS)
    for name in COUNTED[1:]:
        wrong = sum(found[name][kind]["contacts"] + found[name][kind]["audit"] for kind in KINDS)
        assert wrong > 0 or name == "deep inversions are not repaired"


KINDS = ("lattices", "jittered", "columns")
