"""``kinetile mutate`` as people and scripts meet it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from kinetile.cli import app
from kinetile_conformance.mutation.findings import Finding


def kinetile_(*arguments: object):
    """Run a command in this process."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def pretending(monkeypatch, *fates: str, error: type[BaseException] | None = None):
    """Put a campaign in place of the real one, which finds these fates; return the rounds that it was
    asked for."""
    rounds = []

    def campaign(phase, features, options, mutants, how, *, on_finding, **more):
        rounds.append((len(mutants), how.examples, how.compiled))
        for mutant, fate in zip(mutants, fates, strict=False):
            on_finding(Finding(mutant, fate, "same-contacts" if fate == "killed" else "", tightness=2.5))
        if error is not None:
            raise error
        return 1.5

    monkeypatch.setattr("kinetile_conformance.mutation.campaign.campaign", campaign)
    return rounds


def test_the_list_runs_nothing():
    result = kinetile_("mutate", "sap-1d", "--list", "--only", "dropped schedule")
    assert result.exit_code == 0
    head, before, after = result.stdout.splitlines()
    assert head.endswith("sweep_and_prune.py:102 dropped schedule(...)")
    assert before == "    -     schedule(k, left >> 2, min(due, s.bounds[left ^ 1]))"
    assert after == "    +     pass"
    (row,) = json.loads(
        kinetile_("mutate", "sap-1d", "--list", "--only", "dropped schedule", "--json").stdout
    )
    assert row["after"] == ["    pass"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nave"], "no broad phase is called 'nave'; did you mean 'naive'?"),
        (["naive", "--also", "exit 3"], "--also 'exit 3' ends with exit code 3 on the phase as it is"),
        (["naive", "--limit", "0"], "Invalid value"),
        (["naive", "cells"], "one phase at a time is changed, with one or several options"),
    ],
)
def test_what_cannot_be_done_is_exit_code_2(arguments, said):
    result = kinetile_("mutate", *arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.stderr.replace("│", " ").split())


def test_survivors_are_judged_thrice_and_shown(monkeypatch):
    rounds = pretending(monkeypatch, "survived", "killed", "hangs", "survived")
    result = kinetile_("mutate", "naive", "--examples", 7)
    assert result.exit_code == 0
    assert rounds == [(4, 10, False), (2, 10, False), (1, 7, True)]
    assert "naive.py:22 constant 4000 -> 3999  (2.50 pairs an overlap, not 1.50)" in result.stdout
    assert "    - LIMIT = 4000\n    + LIMIT = 3999" in result.stdout
    assert result.stdout.endswith("4 of 4 mutants judged, 1 survived\n")


def test_as_json(monkeypatch):
    pretending(monkeypatch, "survived", "killed", "hangs", "crashed")
    found = json.loads(kinetile_("mutate", "naive", "--examples", 0, "--json").stdout)
    assert (found["status"], found["mutants"], found["judged"]) == ("complete", 4, 4)
    assert found["counts"] == {"killed by same-contacts": 1, "hangs": 1, "crashed": 1, "survived": 1}
    assert [each["after"] for each in found["survivors"]] == [["LIMIT = 3999"]]


def test_the_authors_tests_are_run_on_what_survives(monkeypatch):
    pretending(monkeypatch, "survived", "survived", "killed", "killed")
    command = 'test -z "$(ls -d ${PYTHONPATH%%:*}/changed 2>/dev/null)"'
    result = kinetile_("mutate", "naive", "--examples", 0, "--also", command)
    assert result.exit_code == 0
    assert result.stdout.endswith("4 of 4 mutants judged, 0 survived\n")


def test_after_an_interrupt_what_is_known_is_printed(monkeypatch):
    pretending(monkeypatch, "survived", "killed", error=KeyboardInterrupt)
    result = kinetile_("mutate", "naive")
    assert result.exit_code == 130
    assert result.stdout.endswith("2 of 4 mutants judged, 1 survived\n")
    assert "interrupted" in result.stderr


def test_what_survives_with_some_options_is_judged_with_others(monkeypatch):
    rounds = pretending(monkeypatch, "survived", "killed")
    result = kinetile_("mutate", "sap-1d", "sap-1d:axis=y", "--examples", 0, "--limit", 2, "--json")
    assert [count for count, *_ in rounds] == [2, 1, 1, 1]
    found = json.loads(result.stdout)
    assert found["options"] == [{}, {"axis": "y"}]
    assert (found["judged"], len(found["survivors"])) == (2, 1)


def test_a_record_is_gone_on_with(monkeypatch, tmp_path):
    record = tmp_path / "naive.jsonl"
    arguments = ("mutate", "naive", "--examples", 0, "--json", "--record", record)
    pretending(monkeypatch, "survived", "killed", error=KeyboardInterrupt)
    assert kinetile_(*arguments).exit_code == 130
    with record.open("a") as file:
        file.write('{"round": 1, "as": 0, "numb')  # it was killed while it wrote
    rounds = pretending(monkeypatch, "hangs", "killed")
    found = json.loads(kinetile_(*arguments).stdout)
    assert [count for count, *_ in rounds] == [2, 1]
    assert found["counts"] == {"killed by same-contacts": 2, "hangs": 2, "crashed": 0, "survived": 0}
    rounds = pretending(monkeypatch)
    again = json.loads(kinetile_(*arguments).stdout)
    assert rounds == []
    assert again["found"] == found["found"]
    assert again["tightness"] == found["tightness"]


def test_a_record_of_something_else_is_refused(monkeypatch, tmp_path):
    record = tmp_path / "naive.jsonl"
    pretending(monkeypatch, "killed", "killed", "killed", "killed")
    assert kinetile_("mutate", "naive", "--record", record).exit_code == 0
    result = kinetile_("mutate", "naive", "--seed", 1, "--record", record)
    assert result.exit_code == 2
    assert "is not the record of this: it differs in seed" in " ".join(result.stderr.split())
    record.write_text("something else\n")
    assert kinetile_("mutate", "naive", "--record", record).exit_code == 2
    assert record.read_text() == "something else\n"


def test_time_is_up(monkeypatch):
    pretending(monkeypatch, "killed", "survived", "killed", "killed")
    result = kinetile_("mutate", "naive", "--minutes", 0, "--json")
    assert result.exit_code == 0
    found = json.loads(result.stdout)
    assert (found["status"], found["judged"]) == ("stopped", 1)


@pytest.mark.long
def test_ctrl_c_ends_the_children_too():
    command = [sys.executable, "-m", "kinetile", "mutate", "naive", "--examples", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            for line in process.stderr:
                if line.startswith("round 1"):
                    break
            time.sleep(3.0)
            os.kill(process.pid, signal.SIGINT)
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 130
    assert json.loads(out)["status"] == "interrupted"
    assert "Traceback" not in err
