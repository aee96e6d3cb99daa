"""The text of a report, and the exit code that follows from it."""

import html
import json
from dataclasses import replace
from pathlib import Path

import pytest

from kinetile_conformance import KIT_VERSION, Report, Result
from kinetile_conformance.cases import Subject

PASSED = Result("can-be-drawn", "It gets on.", "passed", 100, 0.5)
FAILED = Result(
    "same-contacts",
    "The same contacts.",
    "failed",
    42,
    1.25,
    said="contact 0 is missing: bodies 0 and 1\nsecond line",
    verdict="only demo; naive agree with the reference",
    bodies=3,
    case=Path("conformance-failures/demo-same-contacts.toml"),
)
SMALLER = Result("can-be-drawn", "Drawn.", "died", 1, 0.0, said="SIGSEGV", bodies=1, case=Path("x.toml"))
SKIPPED = Result("boxes", "Boxes.", "skipped", 0, 0.0, reason="for phases that declare the feature 'boxes'")


def report(*results: Result, **more: object) -> Report:
    return Report(Subject("demo", {}), "kinetile-demo 0.1.0", results, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("status", "ok"), [("passed", True), ("skipped", True), ("failed", False), ("died", False)]
)
def test_what_conforms(status, ok):
    result = Result("some-check", "It does.", status, 1, 0.0)
    assert result.ok is ok
    assert report(PASSED, result).ok is ok
    assert report(PASSED, result).exit_code == (0 if ok else 1)


def test_a_report_without_results_conforms():
    assert report().ok
    assert str(report()).endswith("demo conforms (0 CPU s, 0 s)")


def test_the_reference_in_doubt_is_an_exit_code_of_its_own():
    doubt = Result("a", "b", "failed", 1, 0.0, verdict="also sap-1d: the reference is in doubt")
    assert report(PASSED, doubt).in_doubt
    assert report(PASSED, doubt).exit_code == 3
    assert not report(PASSED, FAILED).in_doubt


def test_the_text_has_all_there_is_to_know():
    text = str(report(PASSED, FAILED, SKIPPED, notes=("a note",), seconds=2.0))
    assert text == "\n".join(
        [
            f"conformance kit {KIT_VERSION}: broad phase 'demo', of kinetile-demo 0.1.0",
            "",
            "  passed     can-be-drawn       100 scenes    0.50 s  It gets on.",
            "  failed     same-contacts       42 scenes    1.25 s  The same contacts.",
            "             contact 0 is missing: bodies 0 and 1",
            "             second line",
            "             smallest scene found: 3 bodies",
            "             verdict: only demo; naive agree with the reference",
            "             replay: kinetile replay demo conformance-failures/demo-same-contacts.toml",
            "             see it: kinetile view conformance-failures/demo-same-contacts.toml",
            "",
            "  skipped, for phases that declare the feature 'boxes': boxes",
            "  a note",
            "  begin with same-contacts: kinetile replay demo conformance-failures/demo-same-contacts.toml",
            "demo does not conform: same-contacts",
        ]
    )


def test_it_advises_to_begin_with_the_fewest_bodies_or_the_phases_own_audit():
    assert "begin with can-be-drawn: kinetile replay demo x.toml" in str(report(FAILED, SMALLER))
    own = replace(FAILED, said="at time 0.5: the phase's own audit: body 3 is in no cell")
    found = report(SMALLER, own)
    assert found.failed == (own, SMALLER)  # the author's own words come before fewer bodies
    assert f"begin with {own.check}: " in str(found)
    assert "begin with" not in str(report(PASSED, SKIPPED))


def test_options_stand_where_the_command_line_takes_them():
    found = Report(Subject("sap-1d", {"axis": "y"}), "kinetile 0.1.0", (FAILED,))
    assert "broad phase 'sap-1d:axis=y'" in found.head
    assert "replay: kinetile replay sap-1d:axis=y conformance-failures" in str(found)


def test_as_json_it_is_all_there():
    found = json.loads(json.dumps(report(PASSED, FAILED).as_dict()))
    assert found["kit"] == KIT_VERSION
    assert (found["broad_phase"], found["distribution"]) == ("demo", "kinetile-demo 0.1.0")
    assert (found["conforms"], found["reference_in_doubt"]) == (False, False)
    passed, failed = found["checks"]
    assert passed == {
        "check": "can-be-drawn",
        "sentence": "It gets on.",
        "status": "passed",
        "scenes": 100,
        "seconds": 0.5,
    }
    assert failed["case"] == "conformance-failures/demo-same-contacts.toml"
    assert failed["bodies"] == 3


def test_a_notebook_shows_the_text():
    found = report(PASSED, FAILED, SKIPPED, notes=("a < b",))
    assert found._repr_html_() == f"<pre>{html.escape(str(found))}</pre>"
