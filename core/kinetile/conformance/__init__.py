"""The conformance kit: judges anybody's broad phase.

Three doors to one engine: ``check_broad_phase(name)`` returns a report; ``parametrize_with_checks(name)``
makes one pytest test of each check; ``kinetile conform NAME`` prints. ``strategies.scenes()`` draws the kit's
scenes for others. It needs the extra ``conformance`` (Hypothesis, and pytest for the second door).
"""

from __future__ import annotations

from kinetile.conformance.check import Check, Disagreement
from kinetile.conformance.checks import CHECKS, check_named
from kinetile.conformance.doors import parametrize_with_checks
from kinetile.conformance.engine import EXAMPLES, check_broad_phase, run_check
from kinetile.conformance.report import KIT_VERSION, Report, Result

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
    "run_check",
]
