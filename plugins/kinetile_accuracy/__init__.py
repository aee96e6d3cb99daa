"""Speed against error: the certified oracle, certified logs, time-stepped baselines, and their report.

Each name below is imported when it is first used: the oracle needs python-flint, the figures matplotlib.
"""

from typing import TYPE_CHECKING

from kinetile.lazy import lazy_names

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

__all__, __getattr__ = lazy_names(__name__)
