"""The kit as a pytest suite: ``pytest --pyargs kinetile_conformance.suite --broad-phase NAME``."""

from __future__ import annotations

from collections.abc import Callable


def test_conformance(check: Callable[[], None]) -> None:
    """Run one check on one broad phase."""
    check()
