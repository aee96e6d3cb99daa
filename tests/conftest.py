"""What all tests share."""

from __future__ import annotations

import signal

import pytest
from hypothesis import HealthCheck, settings

from kinetile.kernel.compiled import INTERPRETED

settings.register_profile(
    "any machine",
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("any machine")  # a busy machine is no failure: no test judges the time that it takes


@pytest.fixture(autouse=True)
def _signals_come():
    """Let SIGINT and SIGTERM come, here and in children, where a shell has this process ignore them."""
    yield from _not_ignored(signal.SIGINT, signal.SIGTERM)


@pytest.fixture
def hanging_up():
    """The same of SIGHUP, for one test: under nohup, the others are to go on when the terminal goes."""
    yield from _not_ignored(getattr(signal, "SIGHUP", signal.SIGTERM))


def _not_ignored(*numbers):
    ignored = [number for number in numbers if signal.getsignal(number) is signal.SIG_IGN]
    for number in ignored:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    yield
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What is long is slow as well. Tests of many events run compiled only: NUMBA_DISABLE_JIT=1 runs the
    others, on small scenes."""
    for item in items:
        if item.get_closest_marker("long"):
            item.add_marker(pytest.mark.slow)
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
