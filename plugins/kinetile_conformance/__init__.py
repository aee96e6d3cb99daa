"""The conformance kit: judges anybody's broad phase.

Three doors to one engine: ``check_broad_phase(name)`` returns a report; ``parametrize_with_checks(name)``
makes one pytest test of each check; ``kinetile conform NAME`` prints. At each the phase is judged in a
process of its own. ``strategies.scenes()`` draws the kit's scenes for others. The kit needs the extra
``conformance`` (Hypothesis, and pytest for the second door), so a name is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinetile_conformance.checks import CHECKS as CHECKS
    from kinetile_conformance.checks import check_named as check_named
    from kinetile_conformance.checks.check import Check as Check
    from kinetile_conformance.checks.check import Disagreement as Disagreement
    from kinetile_conformance.court.court import EXAMPLES as EXAMPLES
    from kinetile_conformance.court.doors import check_broad_phase as check_broad_phase
    from kinetile_conformance.court.report import KIT_VERSION as KIT_VERSION
    from kinetile_conformance.court.report import Report as Report
    from kinetile_conformance.court.report import Result as Result
    from kinetile_conformance.pytest_door import parametrize_with_checks as parametrize_with_checks

_HOME = {
    "CHECKS": "checks",
    "EXAMPLES": "court.court",
    "KIT_VERSION": "court.report",
    "Check": "checks.check",
    "Disagreement": "checks.check",
    "Report": "court.report",
    "Result": "court.report",
    "check_broad_phase": "court.doors",
    "check_named": "checks",
    "parametrize_with_checks": "pytest_door",
}

__all__ = [
    "CHECKS",
    "EXAMPLES",
    "KIT_VERSION",
    "Check",
    "Disagreement",
    "Report",
    "Result",
    "check_broad_phase",
    "check_named",
    "parametrize_with_checks",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
