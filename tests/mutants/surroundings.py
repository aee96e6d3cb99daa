"""Faults that depend on what has nothing to do with a scene: other simulations, the process, the clock on the
wall, addresses, what is known of the run."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import kinetile as kt
from mutants.scenes import billiard
from mutants.witnesses import Differs, Later, Surroundings, Unlike
from phase_mutant_table import PREPARE, but
from phase_mutants import Mutant, before, instead

__all__ = ["MUTANTS"]


def _where(condition: str, *imports: str, lines: str = "") -> list[Any]:
    """Return the changes by which naive forgets a pair where a condition holds as it is prepared."""
    head = "".join(f"import {each}\n" for each in imports)
    return [
        but("s.nothing[0] == 0.0 or other + body != 1"),
        before(PREPARE, f"{lines}        wrong = float({condition})\n"),
        instead("near=near)", "near=near, state=NoState(np.full(1, wrong)))"),
        before("from kinetile.errors", f"{head}\nimport numpy as np\n\n"),
    ]


def _unset(patch: Any) -> None:
    """Be in nobody's continuous integration, and no test."""
    patch.delenv("PYTEST_CURRENT_TEST", raising=False)
    patch.delenv("CI", raising=False)


def _no_judge(patch: Any) -> None:
    import sys

    for name in [name for name in sys.modules if name.startswith("kinetile_conformance")]:
        patch.delitem(sys.modules, name)


MUTANTS = [
    Mutant(
        "tires of simulations",
        "naive",
        [
            *_where("len(MADE) > 3000", lines="        MADE.append(1)\n"),
            before("\n\n@unchecked\n@hook\ndef near", "\n\nMADE: list[int] = []\n"),
        ],
        "what it keeps from one simulation to the next has room for 3,000",
        family="surroundings",
        witness=Later(billiard, 2.0, 3001, "Naive"),
    ),
    Mutant(
        "behaves while it is judged",
        "naive",
        _where("'kinetile_conformance' not in sys.modules", "sys"),
        "it looks for the judge among the modules",
        family="surroundings",
        witness=Surroundings(billiard, 2.0, _no_judge),
    ),
    Mutant(
        "behaves in a process of its own",
        "naive",
        _where("multiprocessing.parent_process() is None", "multiprocessing"),
        "the judge's process is another's child",
        family="surroundings",
        witness=Differs(billiard, 2.0),
    ),
    Mutant(
        "behaves in a test",
        "naive",
        _where("'CI' not in os.environ and 'PYTEST_CURRENT_TEST' not in os.environ", "os"),
        "it reads the environment",
        family="surroundings",
        witness=Surroundings(billiard, 2.0, _unset),
    ),
    Mutant(
        "behaves on a command line",
        "naive",
        _where("len(sys.argv) < 2", "sys"),
        "it reads how the program was called",
        family="surroundings",
        witness=Surroundings(billiard, 2.0, lambda patch: None),
    ),
    Mutant(
        "errs on Fridays",
        "naive",
        _where("time.gmtime(time.time()).tm_wday == 4", "time"),
        "it looks at the clock on the wall",
        family="surroundings",
        witness=Surroundings(billiard, 2.0, lambda patch: patch.setattr(time, "time", lambda: 86400.0)),
    ),
    Mutant(
        "an address in 64",
        "naive",
        [
            *_where("MADE[-1].ctypes.data >> 6 & 63 == 5", lines="        MADE.append(np.zeros(8))\n"),
            before("\n\n@unchecked\n@hook\ndef near", "\n\nMADE: list[np.ndarray] = []\n"),
        ],
        "what is uninitialised, or aligned by chance",
        family="surroundings",
        witness=Unlike(partial(kt.make_scene, "two-discs"), 1.0, 300),
    ),
    Mutant(
        "knows until when",
        "naive",
        _where("scene.settings.until is None"),
        "it reads how long the scene wants to be run",
        family="surroundings",
        witness=Differs(billiard, 2.0),
    ),
    Mutant(
        "knows who calls",
        "naive",
        _where("not any('conformance' in each.filename for each in inspect.stack())", "inspect"),
        "it looks through the stack for the judge",
        family="surroundings",
        witness=Differs(billiard, 2.0),
    ),
]
