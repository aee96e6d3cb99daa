"""Every command in a shell: a terminal or a pipe that is ASCII, a pipe that nobody reads, and the forms of
results that scripts read."""

import csv
import io
import json
import os
import shlex
import signal
from pathlib import Path

import pytest
import typer

import kinetile as kt
import studies
from command_line import kinetile, refused
from kinetile.cli import app, main
from kinetile.scene.files import dumps_scene
from kinetile_bench import Study
from lanes import first

LINES = {
    "run": "ü.toml --observe temperature",
    "compare": "ü.toml --phases naive,cells",
    "resume": "ü.kt --until 2",
    "study table": "ü/study.toml",
    "certify-log": "ü.toml ü.txt --until 1",
    "choose": "ü.toml --phases naive,cells --seconds 0.0001 --repeats 1",
    "scenes": "grid",
    "plugins": "",
    "recover": "ü.partial",
    "draw": "ü.toml --out ü.svg",
    "view": "ü.toml --until 0.5 --out ü.html",
    "export": "ü.toml --until 0.5 --to ü.xyz",
    "new-plugin": "--help",
    "cache": "--help",
    "cache warm": "--help",
    "oracle": "ü.toml --until 1",
    "replay": "naive ü.toml",
    "conform": "naive --list",
    "judge": "--help",
    "accuracy": "--help",
    "bench": "",
    "bench events": "--phases naive,cells --bodies 4 --densities 0.5 --seconds 0.001 --repeats 1",
    "bench scene": "ü.toml --phases naive,cells --until 1 --repeats 1",
    "bench thesis": "--help",
    "study": "",
    "study run": "ü/study.toml",  # all its tasks are done
    "study rows": "ü/study.toml",
}
"""A line for each command, of files whose names are not ASCII."""


def all_commands(group=None, before=""):
    for name in group.list_commands(None):
        command = group.get_command(None, name)
        yield before + name
        if hasattr(command, "commands"):
            yield from all_commands(command, f"{before}{name} ")


def test_every_command_is_tried():
    assert {*LINES} == {*all_commands(typer.main.get_command(app))}


def ended(line, monkeypatch, stdout):
    """Runs a command as a process does; returns its exit code."""
    monkeypatch.setattr("sys.argv", ["kinetile", *shlex.split(line)])
    monkeypatch.setattr("sys.stdout", stdout)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(), "ascii"))
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code or 0


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = "until = 2.0\n" + dumps_scene(kt.make_scene("cradle"))
    Path("ü.toml").write_text(scene, encoding="utf-8")
    kinetile("run ü.toml --until 1 --checkpoint ü.kt --contacts ü.txt", code=0)


@pytest.mark.parametrize("command", first(5, [*LINES]))
def test_where_stdout_is_ascii_or_a_pipe_that_nobody_reads(command, files, monkeypatch, capsys):
    """There was a traceback in the one, or UTF-8, and the exit code of a fault in the other."""
    line = f"{command} {LINES[command]}"
    if "study.toml" in line:
        text = 'phases = ["naive", "cells"]\nuntil = 0.1\n[[scenes]]\nrecipe = "two-discs"\n'
        studies.run_here(Study(str(studies.write(Path("ü").absolute(), text))))
    printed = io.BytesIO()
    code = ended(line, monkeypatch, io.TextIOWrapper(printed, "ascii"))
    text = printed.getvalue().decode("ascii")
    assert "Traceback" not in capsys.readouterr().err
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "w", encoding="utf-8") as unread:
        again = ended(
            f"{line}{' --overwrite' if '--out' in line or '--to' in line else ''}", monkeypatch, unread
        )
    assert again == (128 + signal.SIGPIPE if text else code)
    assert "Traceback" not in capsys.readouterr().err


def test_a_run_as_a_row_or_without_a_word(tmp_path):
    line = "run two-discs --until 1 --broad-phase naive"
    (row,) = csv.DictReader(io.StringIO(kinetile(f"{line} --csv", code=0).stdout))
    found = json.loads(kinetile(f"{line} --json", code=0).stdout)
    assert row["readings.fingerprint"] == found["readings"]["fingerprint"]
    quiet = kinetile(f"{line} --quiet", code=0)
    assert (quiet.stdout, quiet.stderr) == ("", "")
    assert "expected one of the two" in refused(f"{line} --quiet --csv")


def test_contacts_go_to_stdout_and_have_the_unit_of_the_clock(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("late.toml").write_text(dumps_scene(kt.make_scene("cradle").replace(start=8.0, unit=0.25)), "utf-8")
    line = "late.toml --until 11"
    text = kinetile(f"run {line} --contacts -", code=0).stdout
    *contacts, fingerprint, clock = text.splitlines()
    assert not Path("-").exists()
    assert (len(contacts), clock, fingerprint[:12]) == (9, "unit 0.25 start 8.0", "fingerprint ")
    assert kinetile("certify-log late.toml - --until 11", stdin=text, code=0)
    assert "prints contacts alone: no --json, --csv, --explain beside it" in refused(
        f"run {line} --contacts - --json"
    )


def test_what_is_observed_is_written_where_nobody_reads_the_result(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "w", encoding="utf-8") as unread:
        code = ended("run cradle --until 1 --observe temperature --observe-to o.csv", monkeypatch, unread)
    assert (code, Path("o.csv").exists()) == (128 + signal.SIGPIPE, True)


def test_whole_numbers_are_written_as_shells_have_them():
    assert "complete" in kinetile("run two-discs --max-contacts 1e3 --until 1", code=0).stdout
    assert "found 1.5; expected a whole number" in refused("run two-discs --max-contacts 1.5")
    assert "found 1.5; expected a whole number" in refused("bench thesis --seeds 1.5")


def test_dash_is_no_file():
    options = (
        "run two-discs --checkpoint",
        "judge naive --out",
        "new-plugin row --into",
        "study run s --results",
    )
    for line in options:
        assert "found '-'; expected a path" in " ".join(refused(f"{line} -").replace("│", " ").split())


def test_options_of_a_phase_that_is_not_chosen_were_not_mentioned(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(dumps_scene(kt.make_scene("two-discs")) + '[options.sap-1d]\naxis = "y"\n', "utf-8")
    told = kinetile("run --broad-phase naive", path, code=0).stderr
    assert "options of sap-1d are not used: the phases are naive, disc, wall" in told
    assert "not used" not in kinetile("run --broad-phase sap-1d", path, code=0).stderr


def test_the_end_of_a_scene_is_minded(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text("until = 2.0\n" + dumps_scene(kt.make_scene("cradle")), "utf-8")
    assert "the scene's start on, 0.0, to its end, 2.0" in refused("draw s.toml --at 2.5 --out d.svg")
    kinetile("draw s.toml --at 2 --out d.svg", code=0)
    line = "choose s.toml --phases naive,cells --seconds 0.0001 --repeats 1 --until"
    told = kinetile(f"{line} 3", code=0)
    assert "--until 3.0 is after the scene's own end, 2.0" in told.stderr
    assert "the first 9 contacts" in told.stdout
    assert "expected a time from the scene's start on" in refused(f"{line} -3")
