"""Fixtures and hooks that all tests share."""

import os
import shlex
import signal
import sys
import tempfile
import time
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

import cost
import lanes
from interpreting import of_this_process, pytest_runtest_logreport, pytest_runtestloop
from kinetile.kernel.compiled import NOTHING_IS_COMPILED, backend, composer
from lanes import is_shared
from programs import program

__all__ = ["pytest_runtest_logreport", "pytest_runtestloop"]

EVERYWHERE = {
    "deadline": None,  # a busy machine is not a failure: no test judges its own duration
    "suppress_health_check": [HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
}
settings.register_profile("many", **EVERYWHERE)
settings.register_profile("few", max_examples=20, **EVERYWHERE)
# ``--hypothesis-profile=many`` has a hundred, unless a test has its own number.
settings.load_profile("few")

if sys.dont_write_bytecode:
    # Tests start some hundred processes, and each would compile all modules again. Compiled modules are kept
    # as long as this process runs, and not beside the sources.
    _bytecode = tempfile.TemporaryDirectory()
    sys.pycache_prefix = os.environ["PYTHONPYCACHEPREFIX"] = _bytecode.name
    sys.dont_write_bytecode = False
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


IN_PLAIN_HOOKS = (
    "core/cli/",
    "core/records/",
    "core/run/",
    "core/show/",
    "core/test_comparison.py",
    "plugins/",
    "test_figures.py",
)
"""Folders and files whose tests are small unless they are marked ``compiled`` or ``own_loop``."""

OF_PAGES = ("core/show/player/",)
"""Folders whose tests open pages in a browser, or run their script under node: lane ``page``."""

OF_INSTRUMENTS = ("foreign/", "plugins/accuracy/", "plugins/bench/", "plugins/conformance/")
"""Folders whose tests are not, and may compile their own loops: they judge foreign phases, start processes,
and run loops of many events."""


QUICK = (
    "core/plugin/test_registry.py",
    "core/run/test_commands.py",
    "core/run/engine/test_failures.py",
    "core/run/test_kinds.py",
    "core/scene/",
    "plugins/cells/",
    "plugins/sweep_tiling/test_audit.py",
    "plugins/test_disc.py",
    "plugins/test_one_answer.py",
    "plugins/test_responses.py",
    "test_architecture.py",
    "test_completeness.py",
)
"""Files and folders whose tests are quick, but for those that are slow or compiled."""


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Reads only the files of quick tests if these are requested: to read all takes 10 CPU seconds."""
    others = collection_path.suffix == ".py" and not _is_below(collection_path, QUICK)
    return True if config.option.markexpr == "quick" and others else None


@cache
def _is_below(path: Path, folders: tuple[str, ...]) -> bool:
    """Returns True if a file of the tests is in one of some folders."""
    here = Path(__file__).parent
    return path.is_relative_to(here) and path.relative_to(here).as_posix().startswith(folders)


def _is_small(item: pytest.Item) -> bool:
    here = _is_below(item.path, IN_PLAIN_HOOKS) and not _is_below(item.path, OF_INSTRUMENTS)
    other = any(item.get_closest_marker(name) for name in ("compiled", "own_loop", "interpreted"))
    return item.get_closest_marker("small") is not None or (here and not other)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skips a test if a program that it needs does not run."""
    for mark in item.iter_markers("needs"):
        program(*mark.args)
    global _shares_loops
    own = any(item.get_closest_marker(name) for name in ("slow", "small", "own_loop", "page"))
    _shares_loops = not own and not _is_below(item.path, OF_INSTRUMENTS)


_shares_loops = False
"""True if the running test may not compile its own loop."""


def _compiled_apart(here, entry):
    """Compiles loops in forks; this process loads them from the forks' cache. The compiler leaves some 50 MB
    a loop behind, which a process that composes dozens of them would keep.

    The first loop is compiled here. Forks inherit what Numba needs for all loops, and read the hooks that
    their loops share from the disk: 9.6 CPU seconds for a loop of naive become 3.4 for one of cells.
    Returns the replacements of the composer's ``_compiling`` and of ``backend.entry``.
    """
    is_first = True

    def named(function, *arguments):
        made = entry(function, *arguments)
        compiles = made.compile

        def known(signature):
            if _shares_loops and function.__name__ == "advance" and not is_shared(function):
                pytest.fail(
                    f"this test compiles {function.__qualname__}, and tests share nine loops: mark it "
                    "small, slow or own_loop (CONTRIBUTING.md)"
                )
            cost.counts["loops"] += function.__name__ == "advance"
            return compiles(signature)

        made.compile = known
        return made

    @contextmanager
    def apart():
        nonlocal is_first
        if is_first:
            began = time.process_time()
            with here():
                yield
            is_first = time.process_time() - began < 2.0  # it was loaded
            return
        child = os.fork()
        if child == 0:
            try:
                with here():
                    yield
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        with here():
            yield

    return apart, named


composer._default = not NOTHING_IS_COMPILED  # here; commands in other processes begin as Python
_HERE = composer._compiling
if hasattr(os, "fork") and not NOTHING_IS_COMPILED:
    composer._compiling, backend.entry = _compiled_apart(_HERE, backend.entry)


def pytest_configure(config: pytest.Config) -> None:
    """Leaves slow cases out of a run that has none, and counts its cost."""
    lanes.slow_ones = lanes.may_have_slow_ones(config)
    cost.count_steps()


def pytest_pycollect_makeitem(
    collector: pytest.Collector, name: str, obj: object
) -> list[pytest.Item] | None:
    """Leaves slow tests out of a run that has none."""
    left_out = name.startswith("test_") and not lanes.slow_ones and _is_slow(collector, obj)
    return [] if left_out else None


def _is_slow(collector: pytest.Collector, test: object) -> bool:
    marks = [getattr(each, "pytestmark", ()) for each in (test, getattr(collector, "module", None))]
    names = [mark.name for each in marks for mark in (each if isinstance(each, (list, tuple)) else [each])]
    return "slow" in names or "long" in names


@pytest.fixture
def compiled_here(monkeypatch):
    """Compiles one test's loops in this process."""
    monkeypatch.setattr(composer, "_compiling", _HERE)


@pytest.fixture(autouse=True)
def _signals_come():
    """Enables SIGINT and SIGTERM, here and in children, if a shell has this process ignore them."""
    yield from _not_ignored(signal.SIGINT, signal.SIGTERM)


@pytest.fixture
def hanging_up():
    """The same for SIGHUP, in one test: under nohup, the others have to continue without the terminal."""
    yield from _not_ignored(getattr(signal, "SIGHUP", signal.SIGTERM))


def _not_ignored(*numbers):
    ignored = [number for number in numbers if signal.getsignal(number) is signal.SIG_IGN]
    for number in ignored:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    yield
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)


def _is_under_slow_phase(item: pytest.Item) -> bool:
    """Returns True if a parameter of a test is the name of a phase that is slow as plain Python."""
    cases = getattr(item, "callspec", None)
    given = cases.params.values() if cases is not None else ()
    return any(isinstance(each, str) and each in ("naive", "sap-2d") for each in given)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Marks long tests as slow, and so small tests under ``naive`` and ``sap-2d``, which take longest as
    plain Python: three other phases run the same. Tests of many events run only compiled:
    NUMBA_DISABLE_JIT=1 runs the others, on small scenes."""
    for item in items:
        small = _is_small(item)
        if small:
            item.add_marker(pytest.mark.small)
        if item.get_closest_marker("long") or (small and _is_under_slow_phase(item)):
            item.add_marker(pytest.mark.slow)
        if _is_below(item.path, OF_PAGES):
            item.add_marker(pytest.mark.page)
        if _is_below(item.path, QUICK) and not any(map(item.get_closest_marker, ("slow", "compiled"))):
            item.add_marker(pytest.mark.quick)
    items[:] = of_this_process(items)
    if not lanes.is_default(config):
        items[:] = [item for item in items if not cost.is_judged_by(item)]
    if NOTHING_IS_COMPILED:
        too_slow = pytest.mark.skip(reason="too many events for interpreted hooks")
        for item in items:
            if item.get_closest_marker("compiled"):
                item.add_marker(too_slow)


def pytest_report_collectionfinish(config: pytest.Config, items: list[pytest.Item]) -> str | None:
    """Prints the expected duration."""
    if not lanes.is_default(config):
        return None
    cpu, wall = cost.CPU_SECONDS, cost.WALL_SECONDS
    return f"{len(items):,} tests, by three processes at once: some {cpu} CPU seconds, in {wall} s"


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Prints a command for each failed test alone, as it ran here: with plain hooks or compiled."""
    failed = dict.fromkeys(report.nodeid for report in terminalreporter.getreports("failed"))
    if failed:
        terminalreporter.section("each of them again, alone")
    for name in failed:
        terminalreporter.line(f"python -m pytest -m '' {shlex.quote(name)}")


@pytest.fixture
def blind():
    """The name of a broad phase, registered for one test, that never sees bodies 0 and 1 meet."""
    import broken_phases
    from registering import registered

    with registered(broken_phases.Blind()):
        yield "blind"
