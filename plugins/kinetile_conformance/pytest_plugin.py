"""One pytest test for each check, named after it, in an author's own tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack

import pytest

if TYPE_CHECKING:
    from kinetile_conformance.runner import Options


def parametrize_with_checks(
    name: str, expected_failures: Mapping[str, str] | None = None, **options: Unpack[Options]
) -> Any:
    """Returns a pytest decorator for ``def test_conformance(check): check()``, one test a check, with
    ``Options``, in one child process. ``expected_failures``, checks with reasons, are marked xfail (strict: a
    pass is an error). Raises ValueError for an unknown check, UnknownName for an unknown phase."""
    from kinetile import registry
    from kinetile.instruments import check_options
    from kinetile_conformance.checks import check_named
    from kinetile_conformance.isolated import IsolatedRunner
    from kinetile_conformance.runner import JudgingPlan

    plan = JudgingPlan.of_phase(name, options, "parametrize_with_checks")
    known = {check_named(each).name: why for each, why in (expected_failures or {}).items()}
    phase = registry().target("broad phase", name)
    check_options("broad phase", name, phase, plan.subject.options)
    phase(**plan.subject.options)
    runner = IsolatedRunner(plan)

    def case(check: str) -> Any:
        def run() -> None:
            runner.begin([check])
            result = runner.run(check)
            if result.status == "skipped":
                pytest.skip(result.reason)
            assert result.ok, str(plan.report(result))

        expected = known.get(check)
        marks = () if expected is None else (pytest.mark.xfail(reason=expected, strict=True),)
        return pytest.param(run, id=check, marks=marks)

    return pytest.mark.parametrize("check", [case(check) for check in plan.checks])
