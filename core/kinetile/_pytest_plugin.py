"""What pytest learns from kinetile: the option --broad-phase of the conformance suite.

It stands outside the package of the kit, because pytest imports it in every run, wherever kinetile is
installed.
"""

from __future__ import annotations

from typing import Any

import pytest

__all__ = ["pytest_addoption", "pytest_collection_modifyitems", "pytest_generate_tests"]

SUITE = "kinetile.conformance.suite"

MISTAKE = pytest.StashKey[str]()
"""What is wrong with the suite's options: raised while tests are made, it would look like an error of the
suite."""


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
        "--conformance-examples", type=int, default=100, metavar="N", help="Scenes drawn for each check."
    )


def pytest_generate_tests(metafunc: Any) -> None:
    """Make one test of each check and phase; only for the suite."""
    if metafunc.module.__name__ != SUITE and not metafunc.module.__name__.endswith("conformance.suite"):
        return
    from kinetile._cli_values import read_phase
    from kinetile.conformance.doors import checks_of
    from kinetile.errors import KinetileError

    config = metafunc.config
    names = config.getoption("--broad-phase")
    if not names:
        config.stash[MISTAKE] = "the conformance suite needs to know whom to judge: --broad-phase NAME"
    cases = []
    for name in names:
        try:
            phase, options = read_phase(name)
            tests = checks_of(phase, options=options, examples=config.getoption("--conformance-examples"))
        except KinetileError as error:
            config.stash[MISTAKE] = str(error)
            break
        cases += [pytest.param(run, id=f"{name}-{check}") for check, run in tests.items()]
    metafunc.parametrize("check", cases)


def pytest_collection_modifyitems(config: Any) -> None:
    """End the run with a usage error (exit code 4) where the suite's options are of no use."""
    if MISTAKE in config.stash:
        raise pytest.UsageError(config.stash[MISTAKE])
