"""``kinetile mutate`` as people and scripts meet it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from kinetile.cli import app


def kinetile_(*arguments: object):
    """Run a command in this process."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture
def pretending(monkeypatch):
    """Put a campaign in place of the real one, which finds these fates; return the number of mutants of each
    that was asked for."""
    asked: list[int] = []
    monkeypatch.setattr("kinetile.kernel.compiled.INTERPRETED", True)

    def pretend(*fates: str, error: type[BaseException] | None = None):
        def judge(self, mutants):
            asked.append(len(mutants))
            for mutant, fate in zip(mutants, fates, strict=False):
                check = "same-contacts" if fate == "killed" else ""
                yield {"number": mutant.number, "fate": fate, "check": check}
            if error is not None:
                raise error

        monkeypatch.setattr("kinetile_conformance.mutation.judging.Campaign.judge", judge)
        return asked

    return pretend


def test_the_list_runs_nothing():
    result = kinetile_("mutate", "sap-1d", "--list", "--only", "dropped schedule")
    assert result.exit_code == 0
    head, before, after = result.stdout.splitlines()[:3]  # those of the circular list come after
    assert re.search(r"sweep_and_prune\.py:\d+ dropped schedule\(\.\.\.\)$", head)
    assert before == "    -     schedule(k, left >> 2, min(due, s.bounds[left ^ 1]))"
    assert after == "    +     pass"
    row, *_ = json.loads(
        kinetile_("mutate", "sap-1d", "--list", "--only", "dropped schedule", "--json").stdout
    )
    assert row["after"] == ["    pass"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nave"], "no broad phase is called 'nave'; did you mean 'naive'?"),
        (["naive", "--also", "exit 3"], "--also 'exit 3' fails on the phase as it is"),
        (["naive", "--limit", "0"], "Invalid value"),
    ],
)
def test_what_cannot_be_done_is_exit_code_2(arguments, said, pretending):
    pretending()
    result = kinetile_("mutate", *arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.stderr.replace("│", " ").split())


def test_survivors_are_shown(pretending):
    pretending("survived", "killed", "hangs", "survived")
    result = kinetile_("mutate", "naive")
    assert result.exit_code == 0
    assert "#1 naive.py:22 constant 4000 -> 3999" in result.stdout
    assert "    - LIMIT = 4000\n    + LIMIT = 3999" in result.stdout
    assert result.stdout.endswith("4 of 6 mutants judged, 2 survived\n")


def test_as_json(pretending):
    pretending("survived", "killed", "hangs", "crashed")
    found = json.loads(kinetile_("mutate", "naive", "--json").stdout)
    assert (found["status"], found["mutants"], found["judged"]) == ("complete", 6, 4)
    assert found["counts"] == {"killed by same-contacts": 1, "hangs": 1, "crashed": 1, "survived": 1}
    assert [each["after"] for each in found["survivors"]] == [["LIMIT = 3999"]]


def test_the_authors_tests_are_run_on_what_survives(pretending):
    pretending("survived", "survived", "killed", "killed")
    command = 'test ! -e "${PYTHONPATH%%:*}/sitecustomize.py"'
    result = kinetile_("mutate", "naive", "--also", command)
    assert result.exit_code == 0
    assert result.stdout.endswith("4 of 6 mutants judged, 0 survived\n")


def test_after_an_interrupt_what_is_known_is_printed(pretending):
    pretending("survived", "killed", error=KeyboardInterrupt)
    result = kinetile_("mutate", "naive")
    assert result.exit_code == 130
    assert result.stdout.endswith("2 of 6 mutants judged, 1 survived\n")
    assert "interrupted" in result.stderr


def test_what_survives_in_a_record_is_judged_in_other_ways(pretending, tmp_path):
    asked = pretending("survived", "killed")
    options = ("--limit", 2, "--json", "--record", tmp_path / "sap.jsonl")
    kinetile_("mutate", "sap-1d", *options)
    kinetile_("mutate", "sap-1d", *options)
    assert asked == [2]  # nothing was left to judge
    kinetile_("mutate", "sap-1d:axis=y", *options)
    found = json.loads(kinetile_("mutate", "sap-1d", "--examples", 20, *options).stdout)
    assert asked == [2, 1, 1]
    assert (found["judged"], len(found["survivors"])) == (2, 1)


def test_a_record_is_gone_on_with(pretending, tmp_path):
    record = tmp_path / "naive.jsonl"
    arguments = ("mutate", "naive", "--json", "--record", record)
    asked = pretending("survived", "killed", error=KeyboardInterrupt)
    assert kinetile_(*arguments).exit_code == 130
    with record.open("a") as file:
        file.write('{"fate": "surv')  # it was killed while it wrote
    pretending("hangs", "killed")
    found = json.loads(kinetile_(*arguments).stdout)
    assert asked == [6, 4]
    assert found["counts"] == {"killed by same-contacts": 2, "survived": 1, "hangs": 1}


def test_a_record_of_something_else_is_refused(pretending, tmp_path):
    record = tmp_path / "naive.jsonl"
    pretending("killed", "killed", "killed", "killed")
    assert kinetile_("mutate", "naive", "--record", record).exit_code == 0
    result = kinetile_("mutate", "sap-1d", "--record", record)
    assert result.exit_code == 2
    assert "is not the record of this" in " ".join(result.stderr.split())
    record.write_text("something else\n")
    assert kinetile_("mutate", "naive", "--record", record).exit_code == 2
    assert record.read_text() == "something else\n"


@pytest.mark.long
def test_ctrl_c_ends_the_children_too():
    command = [sys.executable, "-m", "kinetile", "mutate", "naive", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            for line in process.stderr:
                if line.startswith("judging"):
                    break
            time.sleep(3.0)
            os.kill(process.pid, signal.SIGINT)
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 130
    assert json.loads(out)["status"] == "interrupted"
    assert "Traceback" not in err
