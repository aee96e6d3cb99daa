"""Lanes of tests: how many cases and examples a test has in each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from kinetile.kernel.compiled import INTERPRETED


def first(count: int, cases: Sequence[Any]) -> list[Any]:
    """Return all cases, as parameters of a test: those after the first ``count`` are slow."""
    return [*cases[:count], *(pytest.param(case, marks=pytest.mark.slow) for case in cases[count:])]


def examples(count: int) -> int:
    """Return a number of examples for Hypothesis; plain Python hooks take fifty times as long for each."""
    return max(1, count // 5) if INTERPRETED else count
