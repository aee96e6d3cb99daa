"""Lanes of tests: the first cases of many run always, all of them with ``pytest -m slow`` besides."""

from __future__ import annotations

from typing import Any

import pytest


def first(count: int, cases: range) -> list[Any]:
    """Return all cases, as parameters of a test: those after the first ``count`` are slow."""
    return [*cases[:count], *(pytest.param(case, marks=pytest.mark.slow) for case in cases[count:])]
