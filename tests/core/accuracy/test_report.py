"""The report: one page that needs nothing else, rows as CSV, parts that are missing named."""

from __future__ import annotations

import csv
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.testing import CliRunner

from kinetile.accuracy import report
from kinetile.accuracy.drawing import new_figure
from kinetile.accuracy.page import command, shown
from kinetile.accuracy.parts import Picture, Section, Table
from kinetile.accuracy.report import PARTS, measure_parts, write_report
from kinetile.cli import app
from kinetile.errors import BadOption, MissingExtra


@dataclass(frozen=True)
class Row:
    """A row as the parts make them."""

    what: str
    error: float | None
    count: int
    fine: bool


ROWS = (Row("grazing <hits>", 1.25e-15, 12345, True), Row("generic", None, 0, False))
HEADS = {"what": "family", "error": "error / R", "count": "n", "fine": "fine"}
CONDITIONS = {"versions": {"python": "3.11"}, "processor": "a processor", "processors": 2, "system": "Linux"}


def draw():
    figure, panel = new_figure()
    panel.plot([1, 2], [3, 4])
    return figure


def section(name: str = "queries") -> Section:
    pictures = (Picture("depth", "What is seen.", draw),)
    return Section(
        name, "A title", "About it.", ("It holds & stays.",), (Table("rows", "Rows.", ROWS, HEADS),), pictures
    )


def written(folder: Path) -> str:
    pytest.importorskip("matplotlib", reason="figures are drawn with matplotlib")
    paths = write_report([section()], folder, budget="quick", conditions=CONDITIONS)
    assert all(path.is_file() for path in paths)
    assert {path.name for path in paths} == {
        "accuracy.html",
        "accuracy.json",
        "queries-rows.csv",
        "queries-depth.svg",
        "queries-depth.png",
    }
    return paths[0].read_text(encoding="utf-8")


def test_the_page_needs_nothing_else(tmp_path):
    page = written(tmp_path)
    assert "data:image/svg+xml;base64," in page
    for outside in ("http:", "https:", "<script", 'src="queries'):
        assert outside not in page
    assert "It holds &amp; stays." in page
    assert "grazing &lt;hits&gt;" in page
    assert "1.25e-15" in page
    assert "<code>kinetile accuracy --quick --part queries</code>" in page


@pytest.mark.parametrize("budget", ["quick", "normal", "full"])
def test_the_commands_on_the_page_can_be_given(one_part, tmp_path, budget):
    words = [*command(budget).split()[1:], "--part", "rates", "--out", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "accuracy.json").read_text(encoding="utf-8"))["budget"] == budget


def test_a_report_is_not_written_over_unasked(one_part, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for _ in range(3):
        assert CliRunner().invoke(app, ["accuracy", "--part", "rates"]).exit_code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "accuracy-report",
        "accuracy-report-2",
        "accuracy-report-3",
    ]


def test_a_part_named_twice_is_measured_once(one_part, tmp_path):
    words = ["accuracy", "--part", "rates", "--part", "rates", "--out", str(tmp_path), "--json"]
    assert len(json.loads(CliRunner().invoke(app, words).stdout)["parts"]) == 1


def test_a_folder_that_cannot_be_written_to_is_told_before_anything_is_measured(tmp_path, monkeypatch):
    def refuse(*words, **more):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    monkeypatch.setattr(report, "import_module", lambda name: pytest.fail("it was measured"))
    done = CliRunner().invoke(app, ["accuracy", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "Permission denied" in done.stderr


def test_what_was_measured_is_printed_when_it_cannot_be_written(one_part, tmp_path, monkeypatch):
    def full(*words, **more):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(report, "_write_rows", full)
    words = ["accuracy", "--part", "rates", "--out", str(tmp_path), "--json"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2
    assert "No space left" in done.stderr
    assert json.loads(done.stdout)["parts"][0]["tables"]["rows"][0]["count"] == 12345


def test_all_columns_are_in_the_file(tmp_path):
    written(tmp_path)
    with (tmp_path / "queries-rows.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert rows[0] == {"what": "grazing <hits>", "error": "1.25e-15", "count": "12345", "fine": "True"}
    found = json.loads((tmp_path / "accuracy.json").read_text(encoding="utf-8"))
    assert found["parts"][0]["tables"]["rows"][0]["error"] == 1.25e-15


def test_without_matplotlib_the_page_says_what_is_not_drawn(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    paths = write_report([section()], tmp_path, budget="quick", conditions=CONDITIONS)
    assert not [path for path in paths if path.suffix in (".svg", ".png")]
    assert "Not drawn for want of matplotlib: What is seen." in paths[0].read_text(encoding="utf-8")


def test_the_same_rows_make_the_same_figures(tmp_path):
    written(tmp_path / "one")
    written(tmp_path / "two")
    name = "queries-depth.svg"
    assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


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
        ("x", "x"),
    ],
)
def test_values_are_shown_as_people_read_them(value, text):
    assert shown(value) == text


def test_a_part_that_does_not_exist_is_refused():
    with pytest.raises(BadOption, match="its parts are chart, queries, oracle, drift, rates"):
        measure_parts("quick", ["speed"])


def test_a_part_that_lacks_its_package_says_so(monkeypatch):
    class Lacking:
        @staticmethod
        def measure(budget, progress):
            raise MissingExtra("The oracle", "python-flint", "exact")

    monkeypatch.setattr(report, "import_module", lambda name: Lacking)
    seen = []
    (found,) = measure_parts("quick", ["oracle"], finish=seen.append)
    assert seen == [found]
    assert "kinetile[exact]" in found.left_out[0]


def test_every_part_can_be_imported():
    from importlib import import_module

    for module in PARTS.values():
        assert callable(import_module(module).measure)


@pytest.fixture
def one_part(monkeypatch):
    class Part:
        @staticmethod
        def measure(budget, progress):
            progress("rows", 1, 2)
            return section("rates")

    class Stopped:
        @staticmethod
        def measure(budget, progress):
            raise KeyboardInterrupt

    monkeypatch.setattr(
        report, "import_module", lambda name: Stopped if name.endswith("drift_section") else Part
    )


def test_the_command_writes_and_prints(one_part, tmp_path):
    done = CliRunner().invoke(app, ["accuracy", "--quick", "--part", "rates", "--out", str(tmp_path / "r")])
    assert done.exit_code == 0, done.output
    assert "It holds & stays." in done.stdout
    assert (tmp_path / "r" / "accuracy.html").is_file()


def test_ctrl_c_keeps_the_parts_that_are_done(one_part, tmp_path):
    words = ["accuracy", "--quick", "--part", "rates", "--part", "drift", "--out", str(tmp_path), "--json"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 130
    assert [part["name"] for part in json.loads(done.stdout)["parts"]] == ["rates"]
    assert (tmp_path / "rates-rows.csv").is_file()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--quick", "--full"], "cannot both"),
        (["--part", "speed"], "the parts are chart"),
        (["--part", "rates", "--out", "/dev/null/x"], "--out /dev/null/x"),
    ],
)
def test_wrong_words_are_named(one_part, words, said):
    done = CliRunner().invoke(app, ["accuracy", *words])
    assert done.exit_code == 2
    assert said in done.stderr
