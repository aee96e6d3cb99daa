"""Results on stdout: tables on terminals of any width, and rows as CSV and JSON."""

import dataclasses
import io
import json
import re
from pathlib import Path
from typing import NamedTuple

import pytest
from rich.console import Console

import kinetile as kt
from command_line import kinetile
from kinetile.cli.output import as_csv, as_json, empty_table, printed, show, show_labels, table_of
from kinetile.cli.terminal import echo
from kinetile.scene.files import dumps_scene


def test_a_narrow_terminal_cuts_no_name_without_a_mark():
    table = empty_table("| kind", "| name", "what it does", "| from")
    table.add_row("broad phase", "sweep-tiling", "s", "kinetile 1")
    console = Console(width=20, file=io.StringIO())
    console.print(table)
    (row,) = [line for line in console.file.getvalue().splitlines() if line.lstrip().startswith("b")]
    assert row.count("…") == 3


def wide_table():
    table = empty_table("what it is of", *["> number of things"] * 8, "fingerprint")
    table.add_row("a phase whose name is long", *["123,456.7"] * 8, "0123456789abcdef" * 4)
    return table


@pytest.mark.parametrize("columns", [None, "40", "80", "500"])
def test_where_there_is_no_terminal_nothing_is_broken_into_lines(monkeypatch, columns):
    # A fingerprint was broken after 63 characters, and the numbers and heads of a table of a study.
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setattr("sys.stdout", pipe := io.StringIO())
    text = empty_table("| one", "another")
    text.add_row("x" * 300, "a sentence of some words " * 20)
    show(wide_table(), text)
    lines = pipe.getvalue().splitlines()
    assert len([line for line in lines if line.strip()]) == 6
    assert lines[0].count("number of things") == 8
    assert "123,456.7" in lines[2]
    assert "0123456789abcdef" * 4 in lines[2]
    assert "a sentence of some words " * 19 in lines[-1]


@pytest.mark.parametrize("columns", [40, 100, 300])
def test_a_terminal_is_as_wide_as_it_says_but_for_tables_of_numbers(monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setattr("sys.stdout", terminal := io.StringIO())
    monkeypatch.setattr(terminal, "isatty", lambda: True, raising=False)
    text = empty_table("one", "another")
    text.add_row("a sentence of some words " * 20, "b")
    show(text)
    lines = re.sub(r"\x1b\[\d*m", "", terminal.getvalue()).splitlines()
    assert columns / 2 < max(map(len, lines)) <= columns
    show(wide_table())
    assert terminal.getvalue().splitlines()[-1].count("123,456.7") == 8
    assert terminal.getvalue().splitlines()[-1].endswith("0123456789abcdef" * 4)


@pytest.mark.parametrize(
    ("columns", "lines"), [(None, ["one    a b c d", "three"]), (10, ["one    a b", "       c d", "three"])]
)
def test_labels_are_beside_their_texts_which_a_narrow_terminal_wraps(monkeypatch, columns, lines):
    monkeypatch.setattr("sys.stdout", stdout := io.StringIO())
    if columns is not None:
        monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setattr(stdout, "isatty", lambda: True, raising=False)
    show_labels([("one", "a b c d"), ("three", "")])
    found = re.sub(r"\x1b\[\d*m", "", stdout.getvalue()).splitlines()
    assert [line.rstrip() for line in found] == lines


def test_rows_as_csv_have_every_digit_a_column_for_each_entry_and_nothing_for_what_is_not_there():
    rows = [
        {"phase": "a,b", "rate": 1 / 3, "parts": {"run": 1.5, "turns": 2}, "first": (1.0, 2.0), "ok": True},
        {"phase": 'c"d', "rate": float("inf"), "parts": None, "first": (), "ok": False},
    ]
    assert as_csv(rows).splitlines() == [
        "phase,rate,parts.run,parts.turns,first,ok",
        '"a,b",0.3333333333333333,1.5,2,"[1.0, 2.0]",true',
        '"c""d",,,,[],false',
    ]
    assert as_csv([]) == ""
    beside = [{"P": 1.5, "P.error": 0.5, "parts": {}}, {"P": None, "parts": {"run": 0}}]
    assert as_csv(beside) == "P,P.error,parts.run\n1.5,0.5,\n,,0\n"  # a mean was left out beside its error


@dataclasses.dataclass(frozen=True)
class Measured:
    phase: str
    seconds: float


class Counted(NamedTuple):
    phase: str
    contacts: int


def test_rows_of_a_dataclass_or_a_named_tuple_are_tables_csv_and_json():
    rows = [Measured("a", 1 / 3), Measured("b", 2.0)]
    assert as_csv(rows) == "phase,seconds\na,0.3333333333333333\nb,2.0\n"
    assert as_csv([Counted("a", 7)]) == "phase,contacts\na,7\n"
    assert json.loads(as_json({"rows": rows})) == {"rows": [dataclasses.asdict(row) for row in rows]}
    table = table_of(rows, {"| phase": lambda row: row.phase, "> s": lambda row: f"{row.seconds:.2f}"})
    assert [list(column.cells) for column in table.columns] == [["a", "b"], ["0.33", "2.00"]]


ODD = "a\x1b[31m\u202eb\x9b"
LEGIBLE = r"a\x1b[31m\u202eb\x9b"


def test_control_characters_reached_standard_output(monkeypatch):
    for prints in (
        lambda: show(ODD, table_of([ODD], {"head": str})),
        lambda: show_labels([(ODD, ODD)]),
        lambda: printed([], [{"name": ODD}], json=False, csv=True),
        lambda: echo(ODD),
    ):
        monkeypatch.setattr("sys.stdout", stdout := io.StringIO())
        prints()
        assert LEGIBLE in stdout.getvalue()
        assert all(line.isprintable() for line in stdout.getvalue().split("\n"))


def test_a_scene_file_of_an_odd_name_runs_and_is_named_legibly(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path(f"{ODD}.toml").write_text(dumps_scene(kt.make_scene("two-discs")))
    result = kinetile("run --explain", f"./{ODD}.toml", code=0)
    assert all(line.isprintable() for line in result.stdout.split("\n"))


def test_there_is_one_place_from_which_commands_print():
    """A text that is printed past the filter may have a control character in it."""
    for package in ("core/kinetile/cli", "plugins"):
        for path in (Path(__file__).parents[3] / package).rglob(
            "cli*/*.py" if package == "plugins" else "*.py"
        ):
            if path.name not in ("terminal.py", "output.py"):
                assert not re.search(r"typer\.echo|stdout\.write|\bprint\(", path.read_text()), path
