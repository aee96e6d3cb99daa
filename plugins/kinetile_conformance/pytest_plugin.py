"""The pytest plugin: one test for each check, named after it, in an author's own tests or by the suite.

pytest imports this file in every run, wherever kinetile is installed, for the option --broad-phase of
``pytest --pyargs kinetile_conformance.suite``. So the kit itself is imported only when it is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Unpack

import pytest

if TYPE_CHECKING:
    from kinetile_conformance.runner import Options


SUITE = "kinetile_conformance.suite"

OPEN: list[Any] = []
"""The runners in use, each with a child process."""

MISTAKE = pytest.StashKey[str]()
"""What is wrong with the suite's options: raised while tests are made, it would look like an error of the
suite."""


def checks_of(name: str, **options: Unpack[Options]) -> dict[str, Callable[[], None]]:
    """Return a function for each check, by its name, that raises AssertionError unless the check passes.

    They share a child process, which judges the phase: an endless loop in a hook ends there. Failures that
    are expected are not minimised.
    """
    from kinetile.plugin.registry import registry
    from kinetile.run.compose import check_options
    from kinetile_conformance.api import runner_for
    from kinetile_conformance.runner import Plan

    plan = Plan.of(name, options)
    phase = registry().target("broad phase", name)
    check_options("broad phase", name, phase, plan.subject.options)
    phase(**plan.subject.options)
    begun: list[Any] = []

    def runner() -> Any:
        if not begun:
            begun.append(runner_for(plan))
            OPEN.append(begun[0])
            begun[0].smoke_test()
        return begun[0]

    def test(check: str) -> Callable[[], None]:
        def run() -> None:
            result = runner().run(check, plan.expected.get(check))
            if result.status == "skipped":
                pytest.skip(result.reason)
            passed = result.status in ("passed", "xpassed")  # pytest itself handles an expected failure
            assert passed, str(plan.report((result,), None))

        return run

    return {check: test(check) for check in plan.checks}


def parametrize_with_checks(name: str, **options: Unpack[Options]) -> Any:
    """Return a pytest decorator for ``def test_conformance(check): check()``, one test a check.

    ``options`` are as for ``check_broad_phase`` (``Options``). Checks that are expected to fail are marked
    xfail (strict: a pass is an error).

    Raises ValueError for a check that does not exist, UnknownName for a phase that does not.
    """
    tests = checks_of(name, **options)
    expected = options.get("expected_failures") or {}
    cases = [
        pytest.param(
            run,
            id=check,
            marks=[pytest.mark.xfail(reason=expected[check], strict=True)] if check in expected else [],
        )
        for check, run in tests.items()
    ]
    return pytest.mark.parametrize("check", cases)


def pytest_unconfigure() -> None:
    """End the children that judged; a worker of pytest-xdist runs nothing at its exit."""
    while OPEN:
        OPEN.pop().close()


def pytest_addoption(parser: Any) -> None:
    """Add the suite's options."""
    group = parser.getgroup("kinetile", "kinetile's conformance suite")
    group.addoption(
        "--broad-phase",
        action="append",
        default=[],
        metavar="NAME",
        help="A broad phase to judge, with options if need be: sap-1d:axis=y; may be given more than once.",
    )
    group.addoption(
        "--narrow-phase",
        action="append",
        default=[],
        metavar="NAME",
        help="A narrow phase to judge with each of them, with options if need be.",
    )
    group.addoption(
        "--conformance-examples", type=int, default=100, metavar="N", help="Scenes drawn for each check."
    )


def pytest_generate_tests(metafunc: Any) -> None:
    """Make one test of each check and phase; only for the suite."""
    if metafunc.module.__name__ != SUITE and not metafunc.module.__name__.endswith("conformance.suite"):
        return
    from kinetile.errors import KinetileError
    from kinetile.plugin.choices import read_phase

    config = metafunc.config
    names = config.getoption("--broad-phase")
    if not names:
        config.stash[MISTAKE] = "the conformance suite needs to know whom to judge: --broad-phase NAME"
    cases = []
    for name in names:
        try:
            phase, options = read_phase(name)
            tests = checks_of(
                phase,
                options=options,
                narrow_phases=dict(map(read_phase, config.getoption("--narrow-phase"))),
                examples=config.getoption("--conformance-examples"),
            )
        except KinetileError as error:
            config.stash[MISTAKE] = str(error)
            break
        cases += [pytest.param(run, id=f"{name}-{check}") for check, run in tests.items()]
    metafunc.parametrize("check", cases)


def pytest_collection_modifyitems(config: Any) -> None:
    """End the run with a usage error (exit code 4) where the suite's options are of no use."""
    if MISTAKE in config.stash:
        raise pytest.UsageError(config.stash[MISTAKE])
