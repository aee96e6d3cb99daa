"""The conformance kit: judges any broad phase, alone or with narrow phases, in a child process with limits.

``check_broad_phase(name)`` returns a report; ``parametrize_with_checks(name)`` makes one pytest test of each
check; ``kinetile conform NAME`` prints. ``strategies.scenes()`` draws the kit's scenes for other tests. The
kit needs the extra ``conformance`` (Hypothesis, and pytest for the second interface).
"""

from typing import TYPE_CHECKING, Any

from kinetile.errors import MissingExtra
from kinetile.lazy import lazy_names

if TYPE_CHECKING:
    from kinetile_conformance.api import check_broad_phase as check_broad_phase
    from kinetile_conformance.api import check_engine as check_engine
    from kinetile_conformance.checks import CHECKS as CHECKS
    from kinetile_conformance.checks import check_named as check_named
    from kinetile_conformance.checks.check import Check as Check
    from kinetile_conformance.checks.check import Disagreement as Disagreement
    from kinetile_conformance.pipe import EngineError as EngineError
    from kinetile_conformance.pipe import EngineReport as EngineReport
    from kinetile_conformance.pytest_plugin import parametrize_with_checks as parametrize_with_checks
    from kinetile_conformance.reporting import KIT_VERSION as KIT_VERSION
    from kinetile_conformance.reporting import Report as Report
    from kinetile_conformance.reporting import Result as Result
    from kinetile_conformance.runner import EXAMPLES as EXAMPLES

__all__, _attribute = lazy_names(__name__)


def __getattr__(name: str) -> Any:
    try:
        return _attribute(name)
    except ModuleNotFoundError as error:
        if error.name not in ("hypothesis", "pytest"):
            raise
        raise MissingExtra("the conformance kit", error.name, "conformance") from error
