"""What all tests share."""

from __future__ import annotations

import pytest

from kinetile.kernel.compiled import INTERPRETED


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests of many events run compiled only: NUMBA_DISABLE_JIT=1 runs the others, on small scenes."""
    if INTERPRETED:
        too_slow = pytest.mark.skip(reason="too many events for interpreted hooks")
        for item in items:
            if item.get_closest_marker("compiled"):
                item.add_marker(too_slow)


@pytest.fixture
def blind():
    """The name of a broad phase, registered for one test, that never sees bodies 0 and 1 meet."""
    import broken_phases
    import kinetile as kt

    plugin = broken_phases.Blind()
    kt.registry().add(plugin)
    yield "blind"
    kt.registry().remove(plugin)
