"""Hardware counters: how they are taken and read, with a ``perf`` of the test's own that makes up numbers."""

from __future__ import annotations

import csv
import io
import os
import sys

import pytest

import kinetile as kt
from command_line import kinetile, printed, refused
from kinetile.errors import PhaseError, Refused
from kinetile_bench import counters
from kinetile_bench.counters import EVENTS, CountersBench, CountersRow, bench_counters

pytestmark = pytest.mark.skipif(os.name != "posix", reason="puts a script on the path, and perf is Linux's")

# Runs the command behind --, then writes a line for each event of -e: its value, from VALUE.
PERF = """#!{python}
import subprocess, sys
words = sys.argv[1:]
command = words[words.index("--") + 1:]
contacts = int(command[command.index("--max-contacts") + 1]) if "--max-contacts" in command else 0
code = {code}
with open(words[words.index("-o") + 1], "w") as file:
    print("# started on a Monday\\n", file=file)
    for at, event in enumerate(words[words.index("-e") + 1].split(",")):
        print({value}, "", event, 1000, "100.00", "", "", sep=",", file=file)
sys.exit(code)
"""
MADE_UP = "'<not supported>' if at == 4 else 10**9 + (at + 1) * 25 * contacts"


@pytest.fixture
def perf(tmp_path, monkeypatch):
    """Puts a ``perf`` on the path that writes these values."""

    def put(value=MADE_UP, code="subprocess.call(command)"):
        script = tmp_path / "perf"
        script.write_text(PERF.format(python=sys.executable, value=value, code=code))
        script.chmod(0o755)
        monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)

    return put


def test_a_contact_costs_the_difference_of_two_runs(perf):
    perf()
    found = printed("bench counters --bodies 3 --densities .25 --contacts 40 --phases naive,sap-1d:axis=y")
    sim = kt.Simulation(kt.make_scene("grid", bodies=4, density=0.25, seed=1), "naive")
    sim.run(max_contacts=10 * 4 // 2 + 40)
    row = {"bodies": 4, "density": 0.25, "phase": "naive", "refused": None, "counted": 1.0}
    row["counts"] = dict(zip(EVENTS, (25.0, 50.0, 75.0, 100.0, None), strict=True))
    row["fingerprint"] = sim.fingerprint
    assert found["rows"] == [row, row | {"phase": "sap-1d:axis=y"}]
    assert found["identical"]
    assert found["conditions"]["contacts"] == 40


def test_a_phase_that_refuses_is_a_row_and_a_process_that_fails_an_error(perf, monkeypatch):
    def refuse(*_):
        raise Refused("not this one")

    perf(code="3 if contacts else 0")
    (row,) = next(bench_counters(["naive"], [4], [0.5], start=refuse)).rows
    assert row == CountersRow(4, 0.5, "naive", refused="not this one")
    with pytest.raises(PhaseError, match="naive: the counted process failed: exit code 3"):
        next(bench_counters(["naive"], [4], [0.5], start=lambda _: None))


@pytest.mark.parametrize(
    ("lines", "counts", "counted"),
    [
        ("7,,instructions:u,9,100.00,,\n2,,branch-misses:u,9,100.00,1.0,of all branches", (7, None, 2), 1.0),
        ("7,,instructions:u,9,75.00,,\n5,,branches:u,9,50.00,,", (7, 5, None), 0.5),
        (
            "7,,cpu_core/instructions/u,9,100.00,,\n4,,cpu_atom/instructions/u,9,100.00,,",
            (11, None, None),
            1.0,
        ),
        (
            "# started\n\n<not counted>,,instructions:u,0,0.00,,\n0,,branches:u,9,100.00,,",
            (None, 0, None),
            1.0,
        ),
    ],
)
def test_what_perf_writes_is_read(lines, counts, counted):
    expected = dict(zip(("instructions", "branches", "mispredicted"), counts, strict=True))
    found = {name: value for name, value in expected.items() if value is not None}
    assert counters._read_counts(lines) == (found, counted)


@pytest.mark.parametrize(
    ("value", "code", "said"),
    [
        ("'<not supported>'", "0", "the processor, or the virtual machine that this system runs in"),
        ("'<not counted>'", "0", "another program holds them"),
        ("'#'", "255", "exit code 255); kernel.perf_event_paranoid is 4, expected at most 2"),
    ],
)
def test_without_hardware_counters_the_command_says_why(perf, tmp_path, monkeypatch, value, code, said):
    level = tmp_path / "level"
    level.write_text("4\n")
    monkeypatch.setattr(counters, "_PARANOID", level)
    perf(value, code)
    message = refused("bench counters --bodies 4 --phases naive")
    assert message.startswith("kinetile: hardware counters cannot be read here: ")
    assert said in message
    assert message.count("\n") == 1


def test_without_perf_the_command_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "perf, which is not installed; install it with: apt install linux-perf" in refused(
        "bench counters"
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--contacts 0", "there are 0 contacts to count; expected at least 1"),
        ("--phases ,", "--phases names no phase"),
        ("--bodies ,", "--bodies names no number; expected whole numbers, with commas between"),
        ("--densities 0.5,x", "--densities: found 'x'; expected numbers greater than 0"),
    ],
)
def test_what_is_asked_for_and_cannot_be(options, said):
    assert said in refused(f"bench counters {options}")


def test_counts_are_printed_and_phases_that_differ_are_exit_code_1(monkeypatch):
    counts = dict.fromkeys(EVENTS, 2.5) | {"last_cache_misses": None}
    rows = [CountersRow(4, 0.5, name, None, counts, 0.75, name) for name in ("cells", "naive")]
    rows += [CountersRow(4, 0.5, "odd", "no"), CountersRow(9, 0.5, "naive", None, counts, 1.0, "other scene")]
    where = {"processor": "one", "contacts": 40, "contacts_before": 10}
    same, differing = (CountersBench(tuple(each), where) for each in (rows[1:], rows))
    monkeypatch.setattr(counters, "bench_counters", lambda *_, **__: [differing, same])
    shown = kinetile("bench counters")
    assert shown.exit_code == 0
    for part in ("2.5", "odd refuses: no", "40 contacts of each phase", "one counted 75% of the time"):
        assert part in shown.stdout
    first = next(csv.DictReader(io.StringIO(kinetile("bench counters --csv").stdout)))
    assert (first["counts.mispredicted"], first["counts.last_cache_misses"]) == ("2.5", "")
    monkeypatch.setattr(counters, "bench_counters", lambda *_, **__: [differing])
    shown = kinetile("bench counters")
    assert shown.exit_code == 1
    assert "NOT identical" in shown.stdout
