"""Lanes of tests: the numbers of cases and examples of a test in each, and the loops that tests share."""

import re
from collections.abc import Callable, Sequence
from typing import Any

import pytest

import kinetile_plugins
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile_plugins.disc import collide_equals

BUILT_IN = tuple(spec.name for spec in kinetile_plugins.kinetile_broad_phases())
"""The names of the built-in broad phases."""

GENERAL = ("naive", "cells", "sap-1d", "sap-2d")
"""The phases that accept every scene of not too many bodies."""

COMPILED = ("naive", "cells", "sap-1d", "sweep-tiling")
"""The phases whose loops the default lane compiles."""

ALIKE = COMPILED[:2]
"""The phases whose loops for bodies that are alike are shared too."""

SHARED = ("disc:general=true", "wall")
"""Narrow phases that run discs that are alike in the loops of all others, under each of COMPILED."""

slow_ones = True
"""True if this run may have slow tests: else they are not even collected. ``conftest.py`` sets it."""


def may_have_slow_ones(config: pytest.Config) -> bool:
    """Returns True if a run may have slow tests: its -m has them, or it names single tests."""
    marks = str(config.option.markexpr or "")
    named = any("::" in str(each) for each in config.args)
    return named or not marks or re.search(r"(?<!not )\b(slow|long)\b", marks) is not None


def is_default(config: pytest.Config) -> bool:
    """Returns True if a run has all tests of the default lane, and no others."""
    chosen = config.option.keyword or getattr(config.option, "lf", False)
    marks = config.option.markexpr in config.getini("addopts")
    return not chosen and marks and config.args_source is pytest.Config.ArgsSource.TESTPATHS


MANY = 24
"""Cases of a test in the second lane: later cases are long."""


def first(count: int, cases: Sequence[Any], many: int = MANY) -> list[Any]:
    """Returns all cases, as parameters of a test, tuples if it has several. Cases after the first ``count``
    are slow, and those after the first ``many`` of these are long."""
    others = cases[count:] if slow_ones else ()
    marks = [pytest.mark.slow] * many + [pytest.mark.long] * len(others)
    return [*cases[:count], *map(_marked, others, marks)]


def _marked(case: Any, mark: pytest.MarkDecorator) -> Any:
    """Returns a case with a mark, which may have marks already."""
    if hasattr(case, "marks"):
        return pytest.param(*case.values, marks=[*case.marks, mark], id=case.id)
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=mark)


def examples(count: int) -> int:
    """Returns a number of examples for Hypothesis; plain Python hooks take fifty times as long for each."""
    return max(1, count // 5) if NOTHING_IS_COMPILED else count


def is_shared(loop: Callable[..., Any]) -> bool:
    """Returns True if a loop is one of the nine that tests share: a built-in phase with walls and discs, or
    one of ``ALIKE`` with discs that are alike, and no other feature of a scene."""
    parts = loop.__globals__
    phases = ALIKE if parts.get("collide") is collide_equals else BUILT_IN
    names = tuple(f"advance_{phase.replace('-', '_')}_disc_wall_" for phase in phases)
    beyond = ("COMMANDS", "LIVING", "RULES", "PASSINGS", "PERIODIC", "AHEAD", "ACCELERATIONS")
    return loop.__qualname__.startswith(names) and not any(parts[each] for each in beyond)
