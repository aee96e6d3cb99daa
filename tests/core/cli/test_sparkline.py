"""The course of a run on a terminal: bars that tell something, the same run, and nothing of it elsewhere."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from itertools import pairwise

import pytest

import kinetile as kt
from kinetile.cli.sparkline import LEAST, MOST, Course, bars

pty = pytest.importorskip("pty", reason="a terminal is made with pty, which this system does not have")

BARS = "[▁▂▃▄▅▆▇█ ]"
QUICK = {"NUMBA_DISABLE_JIT": "1"}


def on_a_terminal(*words, columns=100, encoding="utf-8"):
    """Run a command with a terminal as its stdout; return its lines, without colours, and its exit code."""
    ours, theirs = pty.openpty()
    given = {"COLUMNS": str(columns), "PYTHONIOENCODING": encoding, "TERM": "xterm", **QUICK}
    command = [sys.executable, "-m", "kinetile", *map(str, words)]
    started = subprocess.Popen(
        command, stdout=theirs, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, env=os.environ | given
    )
    os.close(theirs)
    said = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # nobody holds the other end any more
            break
        if not piece:
            break
        said += piece
    os.close(ours)
    code = started.wait(60)
    assert started.stderr is not None
    started.stderr.close()
    text = re.sub(r"\x1b\[[0-9;]*m", "", said.decode(encoding)).replace("\r\n", "\n")
    return text.splitlines(), code


def course(lines):
    """Return the lines that show the course of a run, and the others."""
    shown = [line for line in lines if line.endswith(" a time unit")]
    return shown, [line for line in lines if line not in shown]


RUN = ("run", "random", "-s", "bodies=12", "--broad-phase", "sap-1d", "--until", 2)


@pytest.fixture(scope="module")
def drawn():
    return on_a_terminal(*RUN)


def test_a_terminal_sees_the_course_of_the_run_and_else_what_everybody_sees(drawn):
    lines, code = drawn
    assert code == 0
    (contacts, structural), others = course(lines)
    assert re.fullmatch(rf"over time +{BARS}{{8,40}}  [\d,]+ to [\d,]+ contacts a time unit", contacts)
    assert re.fullmatch(rf" +{BARS}{{8,40}}  [\d,]+ to [\d,]+ structural a time unit", structural)
    plain, code = on_a_terminal(*RUN, "--plain")
    assert code == 0
    measured = ("CPU time", "speed")
    assert [each for each in others if not each.startswith(measured)] == [
        each for each in plain if not each.startswith(measured)
    ]


@pytest.mark.parametrize(("columns", "count"), [(60, 0), (80, 2), (200, 2)])
def test_its_lines_are_not_broken(columns, count):
    shown, _ = course(on_a_terminal(*RUN, columns=columns)[0])
    assert len(shown) == count  # a narrow terminal has no room for any
    assert all(len(line) <= columns for line in shown)


def test_it_is_in_letters_where_blocks_cannot_be_said():
    (contacts, _), _ = course(on_a_terminal(*RUN, encoding="ascii")[0])
    assert re.fullmatch(r"over time +[.:=+*#@ -]{8,40}  [\d,]+ to [\d,]+ contacts a time unit", contacts)


def test_a_pipe_and_json_and_a_run_of_few_events_have_none():
    done = subprocess.run(
        [sys.executable, "-m", "kinetile", *map(str, RUN)],
        capture_output=True,
        text=True,
        env=os.environ | QUICK,
        check=True,
    )
    assert "over time" not in done.stdout
    assert "over time" not in "\n".join(on_a_terminal(*RUN, "--json")[0])
    few = on_a_terminal("run", "two-discs", "--until", 2)[0]
    assert few[0].startswith("scene")
    assert not course(few)[0]


def test_an_audited_run_is_audited_as_often_as_elsewhere():
    lines, _ = on_a_terminal(*RUN, "--audit", 100)
    assert not course(lines)[0]


@pytest.mark.parametrize(("until", "most"), [(2.0, None), (None, 100), (2.0, 100), (0.01, 100), (None, 0)])
def test_a_run_in_slices_ends_where_the_whole_one_does(until, most):
    scene = kt.make_scene("random", bodies=12)
    whole, sliced = kt.Simulation(scene, "sap-1d"), kt.Simulation(scene, "sap-1d")
    whole.run(until, max_contacts=most)
    ends = []

    def run(stop, left):
        ends.append(sliced.time)
        sliced.run(stop, max_contacts=left)

    Course(sliced).follow(run, until, most)
    assert 1 <= len(ends) <= MOST
    assert (sliced.exact_time, sliced.time, sliced.fingerprint) == (
        whole.exact_time,
        whole.time,
        whole.fingerprint,
    )
    assert (sliced.positions() == whole.positions()).all()
    counts = [
        {name: value for name, value in sim.readings.as_dict().items() if not re.search("seconds?$", name)}
        for sim in (whole, sliced)
    ]
    assert counts[0] == counts[1]


def test_a_run_in_which_nothing_is_to_come_ends_all_the_same():
    alone = kt.Simulation(kt.Scene([[0.0, 0.0]], [[0.0, 0.0]], 1.0))
    calls = []

    def run(stop, left):
        calls.append(alone.run(max_contacts=left))

    Course(alone).follow(run, None, 1000)
    assert len(calls) == 1


def test_the_bars_follow_what_happens():
    # Discs in a row, hit one after the other, a contact for each half unit of time; then peace.
    row = kt.Scene([[4.0 * k, 0.0] for k in range(121)], [[4.0, 0.0]] + [[0.0, 0.0]] * 120, 1.0)
    sim = kt.Simulation(row, "naive")
    course = Course(sim)
    course.follow(lambda stop, left: sim.run(stop, max_contacts=left), 120.0, None)
    (line,) = course.lines(100, "utf-8")
    shown, _, words = line.partition("  0 to ")
    assert words.endswith(" contacts a time unit")
    half = len(shown) // 2
    assert half >= LEAST // 2
    assert set(shown[:half]) <= {"▇", "█"}
    assert set(shown[half + 1 :]) == {" "}


def test_a_run_that_is_taken_up_shows_its_course_from_there_on():
    sim = kt.Simulation(kt.make_scene("random", bodies=12), "sap-1d")
    sim.run(until=0.5)
    course = Course(sim)
    course.follow(lambda stop, left: sim.run(stop, max_contacts=left), 2.5, None)
    lines = course.lines(80, "utf-8")
    assert len(lines) == 2
    assert all(line.endswith(" a time unit, from 0.5 on") and len(line) <= 80 for line in lines)


def test_a_bar_is_as_high_as_its_value():
    assert bars([0.0, 1e-9, 1.0, 2.0, 4.0, 8.0], "utf-8") == " ▁▁▂▄█"
    assert bars([0.0, 4.0, 8.0], "latin-1") == " =@"
    assert bars([0.0, 0.0], "no such encoding") == "  "
    assert bars([], "utf-8") == ""
    heights = [bars([k, 100.0], "utf-8")[0] for k in range(101)]
    assert all(one <= two for one, two in pairwise(heights[1:]))
