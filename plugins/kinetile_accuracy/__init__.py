"""Speed against error: the certified oracle, certified logs, baselines in steps, and the report of them.

Each name below is imported when it is first used: the oracle needs python-flint, the figures matplotlib.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinetile_accuracy.oracle.agreement import Agreement as Agreement
    from kinetile_accuracy.oracle.agreement import FirstDifference as FirstDifference
    from kinetile_accuracy.oracle.agreement import certify as certify
    from kinetile_accuracy.oracle.oracle import CertifiedContact as CertifiedContact
    from kinetile_accuracy.oracle.oracle import CertifiedRun as CertifiedRun
    from kinetile_accuracy.oracle.oracle import Undecidable as Undecidable
    from kinetile_accuracy.oracle.oracle import oracle_contacts as oracle_contacts
    from kinetile_accuracy.report import AccuracyReport as AccuracyReport
    from kinetile_accuracy.report import measure_parts as measure_parts
    from kinetile_accuracy.report import write_report as write_report
    from kinetile_accuracy.specification.certify import CertifiedLog as CertifiedLog
    from kinetile_accuracy.specification.certify import LogProgress as LogProgress
    from kinetile_accuracy.specification.certify import WrongLine as WrongLine
    from kinetile_accuracy.specification.certify import certify_log as certify_log

_HOMES = {
    "oracle.agreement": ("Agreement", "FirstDifference", "certify"),
    "oracle.oracle": ("CertifiedContact", "CertifiedRun", "Undecidable", "oracle_contacts"),
    "report": ("AccuracyReport", "measure_parts", "write_report"),
    "specification.certify": ("CertifiedLog", "LogProgress", "WrongLine", "certify_log"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
