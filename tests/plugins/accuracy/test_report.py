"""The report: one page that needs nothing else, rows as CSV, parts that are missing named."""

import csv
import json
import math
import re
import sys
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import pytest
from hypothesis import given
from hypothesis import strategies as st

import kinetile as kt
from accessibility import install_axe, violations
from chromium import Browser, needs_chromium
from command_line import kinetile
from kinetile.errors import MissingExtra
from kinetile.run import compose
from kinetile_accuracy import report
from kinetile_accuracy.drawing import new_figure
from kinetile_accuracy.long_runs import drift
from kinetile_accuracy.report import command, measure_parts, verdict, write_report
from kinetile_accuracy.sections import Claim, Column, ReportFigure, Section, Table, cell, number


@dataclass(frozen=True)
class Row:
    what: Annotated[str, Column("which queries", "family")]
    error: Annotated[float | None, Column("of the time, in <R>", "error / R")]
    count: Annotated[int, Column("how many", "n")]
    fine: Annotated[bool, Column("whether it holds")]


ROWS = (Row("grazing <hits>", 1.25e-15, 12345, True), Row("generic", None, 0, False))
CLAIMS = (Claim("No <contact> is missed", "0 of 12", True), Claim("Rates are exact", "2 of 6", False))
CONDITIONS = {"versions": {"python": "3.11"}, "processor": "a processor", "processors": 2, "system": "Linux"}


def draw():
    figure, panel = new_figure()
    panel.plot([1, 2], [3, 4])
    return figure


def section(name: str = "queries") -> Section:
    pictures = (ReportFigure("depth", "What is seen.", draw),)
    return Section(
        name,
        "A title",
        "About it.",
        ("It holds & stays.",),
        (Table("rows", "Rows.", ROWS),),
        pictures,
        CLAIMS,
    )


def write(folder: Path, *sections: Section) -> Path:
    pytest.importorskip("matplotlib", reason="figures are drawn with matplotlib")
    page, *_ = write_report(sections or [section()], folder, budget="quick", conditions=CONDITIONS)
    return page


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return write(tmp_path_factory.mktemp("report")).parent


@pytest.fixture(scope="module")
def page(folder) -> str:
    return (folder / "accuracy.html").read_text(encoding="utf-8")


def test_the_page_needs_nothing_else(folder, page):
    names = {"accuracy.html", "accuracy.json", "queries-rows.csv", "queries-depth.svg", "queries-depth.png"}
    assert {path.name for path in folder.iterdir()} == names
    assert "data:image/svg+xml;base64," in page
    for outside in ("http:", "https:", "<script", 'src="queries'):
        assert outside not in page
    assert "It holds &amp; stays." in page
    assert "grazing &lt;hits&gt;" in page
    assert "1.25e-15" in page
    assert "Measured with <code>kinetile accuracy --quick --part queries</code> on a processor" in page


def test_the_page_begins_with_a_verdict_and_its_tables_are_folded_and_explained(page):
    folded = page.index("<details>")
    assert page.index("<summary>Rows.</summary>") > folded
    assert page.index("All columns: queries-rows.csv") > folded > page.index("<figure>")
    summary = page[page.index("<body>") : page.index("<ol>")]
    assert "1 of 2 statements do not hold in these measurements." in summary
    assert "No &lt;contact&gt; is missed" in summary
    assert summary.count(">holds</td>") == summary.count(">does not hold</td>") == 1
    assert '<a href="#queries">A title</a>' in page[page.index("<ol>") : page.index("</ol>")]
    assert '<section id="queries">' in page
    columns = page[page.index("The columns") :]
    assert ">error / R</td>" in columns
    assert ">of the time, in &lt;R&gt;</td>" in columns
    assert ">fine (in the file)</td>" in columns


FEW = {
    "kinetile_accuracy.oracle.horizon": {"SEEDS": {"quick": 1}, "LONG_ENOUGH": 20},
    "kinetile_accuracy.long_runs.whole_runs": {
        "CONTACTS": {"quick": 40},
        "SCENES": {"ties": ("lattice", {})},
    },
    "kinetile_accuracy.long_runs.drift": {"MOST": {"quick": 1_000}},
}


@pytest.mark.slow
@pytest.mark.small
def test_the_report_named_a_phase_that_had_not_run(monkeypatch, tmp_path):
    """Every statement of the page is made from the run that it describes."""
    phase = "naive"
    monkeypatch.setattr(compose, "DEFAULT_BROAD_PHASE", phase)
    for module, sizes in FEW.items():
        for name, size in sizes.items():
            monkeypatch.setattr(f"{module}.{name}", size)
    monkeypatch.setitem(drift.PARAMETERS, "bodies", 9)
    parts = ["specification", "drift"]
    if find_spec("flint") is not None:
        parts.append("oracle")
    sections = measure_parts("quick", parts)
    assert all(picture.draw().axes for each in sections for picture in each.pictures)
    drawn = [replace(each, pictures=tuple(replace(p, draw=draw) for p in each.pictures)) for each in sections]
    page = write(tmp_path, *drawn).read_text(encoding="utf-8")
    text = re.sub(r"data:image/\S+", "", page)
    assert all(f"under {phase}" in section.about for section in sections)
    assert "The recipe grid with bodies 9, density 0.5, seed 1, under " in text
    others = {each.spec.name for each in kt.registry() if each.kind == "broad phase"} - {phase}
    assert [name for name in others if re.search(rf"\b{name}\b", text)] == []
    rows = [row for section in sections for table in section.tables for row in table.rows]
    assert {row.phase for row in rows} == {phase}


def test_all_columns_are_in_the_file(folder):
    with (folder / "queries-rows.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert rows[0] == {"what": "grazing <hits>", "error": "1.25e-15", "count": "12345", "fine": "true"}
    found = json.loads((folder / "accuracy.json").read_text(encoding="utf-8"))
    assert found["parts"][0]["tables"]["rows"][0]["error"] == 1.25e-15


def test_the_same_rows_make_the_same_figures(folder, tmp_path):
    write(tmp_path)
    name = "queries-depth.svg"
    assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


def test_a_notebook_shows_what_the_page_shows(monkeypatch):
    pytest.importorskip("matplotlib", reason="figures are drawn with matplotlib")
    missing = Section("drift", "Drift", "", (), (), left_out=("needs <this>",))
    page = report.AccuracyReport([section(), missing])._repr_html_()
    assert "1 of 2 statements do not hold" in page
    for said in ("No &lt;contact&gt; is missed", "It holds &amp; stays.", "grazing &lt;hits&gt;", "1.25e-15"):
        assert said in page
    assert "needs &lt;this&gt;" in page
    assert page.count("data:image/svg+xml;base64,") == 1


@pytest.mark.parametrize("budget", ["quick", "full"])
def test_the_commands_on_the_page_can_be_given(one_part, tmp_path, budget):
    words = [*command(budget, [section("queries")]).split()[1:], "--out", str(tmp_path)]
    done = kinetile(*words, code=0)
    assert "It holds & stays." in done.stdout
    assert json.loads((tmp_path / "accuracy.json").read_text(encoding="utf-8"))["budget"] == budget


def test_a_report_is_not_written_over_unasked(one_part, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("accuracy-report", "accuracy-report-2"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "accuracy.html").touch()
    words = ["accuracy", "--part", "queries", "--part", "queries", "--json"]
    done = kinetile(*words, code=0)
    assert len(json.loads(done.stdout)["parts"]) == 1, "a part named twice is measured once"
    assert (tmp_path / "accuracy-report-3" / "accuracy.html").is_file()
    assert not (tmp_path / "accuracy-report" / "accuracy.json").exists()


def test_a_folder_that_cannot_be_written_to_is_reported_before_anything_is_measured(tmp_path, monkeypatch):
    def refuse(*words, **more):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    monkeypatch.setattr(report, "import_module", lambda name: pytest.fail("it was measured"))
    done = kinetile("accuracy --out", tmp_path, code=2)
    assert "Permission denied" in done.stderr


def test_what_was_measured_is_printed_when_it_cannot_be_written(one_part, tmp_path, monkeypatch):
    def full(*words, **more):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(report, "as_csv", full)
    words = ["accuracy", "--part", "queries", "--out", str(tmp_path), "--json"]
    done = kinetile(*words, code=2)
    assert "No space left" in done.stderr
    assert json.loads(done.stdout)["parts"][0]["tables"]["rows"][0]["count"] == 12345


@pytest.mark.parametrize(
    ("module", "package", "part"),
    [("matplotlib", "matplotlib", "queries"), ("flint", "python-flint", "oracle")],
)
def test_a_missing_package_is_reported_with_its_extra_before_anything_is_measured(
    module, package, part, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr(report, "import_module", lambda name: pytest.fail("it was measured"))
    done = kinetile("accuracy --part", part, "--out", tmp_path / "report", code=2)
    assert f"needs {package}, which is not installed" in done.stderr
    assert "kinetile[accuracy]" in done.stderr
    assert not (tmp_path / "report").exists()
    if part == "queries":
        with pytest.raises(MissingExtra, match="accuracy"):
            write_report([section()], tmp_path / "report", budget="quick", conditions=CONDITIONS)
        assert not (tmp_path / "report").exists()


@pytest.mark.slow
@needs_chromium
@pytest.mark.parametrize("width", [390, 1280])
def test_a_checker_of_accessibility_finds_nothing(width, tmp_path):
    # A table that is wider than the page could not be scrolled by keyboard.
    long = replace(ROWS[0], what="grazing" * 60)
    wide = replace(section(), tables=(Table("rows", "Rows.", (long, *ROWS)),))
    page = write(tmp_path, wide)
    axe = install_axe(tmp_path / "axe")
    with Browser(width) as browser:
        browser.visit(page)
        if width == 390:
            browser.value("document.querySelectorAll('details').forEach(each => each.open = true)")
            assert browser.value("document.querySelector('details div').scrollWidth > innerWidth")
        assert violations(browser, axe) == []


def test_a_verdict_counts_what_fails():
    assert verdict(CLAIMS[:1]) == "All 1 statements hold in these measurements."
    assert verdict(()) == "Nothing was measured that could hold or fail."


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (True, "yes"),
        (12345, "12,345"),
        (0.0, "0"),
        (1.23456e-15, "1.23e-15"),
        (4096.0, "4,096"),
        (1146.5, "1,146"),
        (math.nan, "–"),
        ("x", "x"),
    ],
)
def test_values_are_shown_as_people_read_them(value, text):
    assert cell(value) == text


@given(st.floats(min_value=-1e300, max_value=1e300), st.integers(1, 6))
def test_a_number_is_written_within_its_digits(value, digits):
    near = pytest.approx(value, rel=0.5001 * 10.0 ** (1 - digits), abs=5e-324)
    text = number(value, digits)
    assert float(text.replace(",", "")) == near
    assert "e+" not in text
    assert "e-0" not in text


@pytest.fixture
def one_part(monkeypatch):
    class Part:
        @staticmethod
        def measure(budget, progress):
            progress("rows", 1, 2)
            return section("queries")

    class Stopped:
        @staticmethod
        def measure(budget, progress):
            raise KeyboardInterrupt

    monkeypatch.setattr(report, "import_module", lambda name: Stopped if name.endswith("drift") else Part)


def test_ctrl_c_keeps_the_parts_that_are_done(one_part, tmp_path):
    words = ["accuracy", "--quick", "--part", "queries", "--part", "drift", "--out", str(tmp_path), "--json"]
    done = kinetile(*words, code=130)
    assert [part["name"] for part in json.loads(done.stdout)["parts"]] == ["queries"]
    assert (tmp_path / "queries-rows.csv").is_file()
