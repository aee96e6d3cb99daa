"""A report as JUnit XML, which services that run tests know how to show."""

from __future__ import annotations

from xml.etree import ElementTree

from kinetile.plugin.choices import write_phase
from kinetile_conformance.court.report import Report, Result

__all__ = ["junit"]


def junit(report: Report) -> str:
    """Return a report as JUnit XML: a test case for each check."""
    results = report.results
    suite = ElementTree.Element(
        "testsuite",
        name=" --narrow-phase ".join(
            [
                f"kinetile conform {report.label}",
                *(write_phase(*each) for each in report.narrow_phases.items()),
            ]
        ),
        tests=str(len(results)),
        failures=str(len(report.failed)),
        errors=str(sum(result.unjudged for result in results)),
        skipped=str(sum(result.status in ("skipped", "xfailed") for result in results)),
        time=f"{sum(result.seconds for result in results):.3f}",
    )
    for result in results:
        suite.append(_case(report, result))
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(suite, encoding="unicode") + "\n"


def _case(report: Report, result: Result) -> ElementTree.Element:
    """Return the test case of a check."""
    case = ElementTree.Element(
        "testcase",
        classname=f"kinetile_conformance.{report.name}",
        name=result.check,
        time=f"{result.seconds:.3f}",
    )
    if result.unjudged:
        ElementTree.SubElement(case, "error", message=result.reason)
    elif result.status in ("skipped", "xfailed"):
        ElementTree.SubElement(case, "skipped", message=result.reason)
    elif not result.ok:
        first = (result.said or result.reason).partition("\n")[0]
        failure = ElementTree.SubElement(case, "failure", message=first, type=result.status)
        failure.text = "\n".join(report.lines(result, 0))
    return case
