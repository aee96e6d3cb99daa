"""Speed against error: the certified oracle, error measures, the discrete-time baseline, and their report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinetile_accuracy.answer.certify import CertifiedLog, certify_log
    from kinetile_accuracy.certified.certify import Agreement, certify
    from kinetile_accuracy.certified.oracle import CertifiedRun, oracle_contacts
    from kinetile_accuracy.report import measure_parts, write_report

_HOMES = {
    "Agreement": "certified.certify",
    "CertifiedLog": "answer.certify",
    "CertifiedRun": "certified.oracle",
    "certify": "certified.certify",
    "certify_log": "answer.certify",
    "measure_parts": "report",
    "oracle_contacts": "certified.oracle",
    "write_report": "report",
}

__all__ = [
    "Agreement",
    "CertifiedLog",
    "CertifiedRun",
    "certify",
    "certify_log",
    "measure_parts",
    "oracle_contacts",
    "write_report",
]


def __getattr__(name: str) -> Any:
    """Import what is asked for only then: the oracle needs python-flint, the figures matplotlib."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
