"""The pytest door: one test for each check, named after it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from kinetile._registry import registry
from kinetile.composition import check_options
from kinetile.conformance.cases import Subject
from kinetile.conformance.checks import CHECKS
from kinetile.conformance.engine import EXAMPLES, run_check
from kinetile.conformance.report import Report

__all__ = ["checks_of", "parametrize_with_checks"]


def checks_of(
    name: str,
    *,
    options: Mapping[str, Any] | None = None,
    examples: int = EXAMPLES,
    save_to: Path | None = None,
    unshrunk: Collection[str] = (),
) -> dict[str, Callable[[], None]]:
    """Return a function for each check, by its name, that raises AssertionError unless the check passes.

    For the checks named in ``unshrunk`` no smallest scene is looked for.
    """
    subject = Subject(name, dict(options or {}))
    phase = registry().broad_phase(name)
    check_options("broad phase", name, phase, subject.options)
    phase(**subject.options)

    def test(each: Any) -> Callable[[], None]:
        def run() -> None:
            result = run_check(each, subject, examples, None, save_to, each.name not in unshrunk, 0)
            if result.status == "skipped":
                import pytest

                pytest.skip(result.reason)
            assert result.ok, str(Report(name, subject.options, "this environment", (result,)))

        return run

    return {each.name: test(each) for each in CHECKS}


def parametrize_with_checks(
    name: str,
    *,
    options: Mapping[str, Any] | None = None,
    examples: int = EXAMPLES,
    expected_failures: Mapping[str, str] | None = None,
    save_to: Path | None = None,
) -> Any:
    """Return a pytest decorator for ``def test_conformance(check): check()``, one test a check.

    ``expected_failures`` maps names of checks to reasons; they are marked xfail (strict: a pass is an error).

    Raises ValueError for a check that does not exist, UnknownName for a phase that does not.
    """
    import pytest

    from kinetile.conformance.checks import check_named

    expected = dict(expected_failures or {})
    for each in expected:
        check_named(each)
    tests = checks_of(name, options=options, examples=examples, save_to=save_to, unshrunk=expected)
    cases = [
        pytest.param(
            run,
            id=check,
            marks=[pytest.mark.xfail(reason=expected[check], strict=True)] if check in expected else [],
        )
        for check, run in tests.items()
    ]
    return pytest.mark.parametrize("check", cases)
