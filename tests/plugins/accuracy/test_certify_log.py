"""``kinetile certify-log``, and the text that ``kinetile run --contacts`` writes for it."""

import json
import re
import subprocess
import sys

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.records import EventRecorder, read_events
from kinetile.records.contacts import write_contacts

CRADLE = ["cradle", "--until", "5"]


@pytest.fixture(scope="module")
def cradle():
    sim = kt.Simulation(kt.make_scene("cradle"), "naive")
    sim.run(until=5.0)
    return sim


@pytest.fixture
def log(cradle, tmp_path):
    path = tmp_path / "contacts.txt"
    write_contacts(path, cradle.contacts, cradle.fingerprint, (1.0, 0.0))
    return path


def test_a_run_writes_its_contacts_and_they_are_certified(tmp_path, cradle):
    path = tmp_path / "contacts.txt"
    ran = kinetile("run", *CRADLE, "--broad-phase", "naive", "--contacts", path, "--json", code=0)
    assert json.loads(ran.stdout)["answer"] == kt.ANSWER
    lines = path.read_text().splitlines()
    assert lines[0] == "0 2251799813685248 0 1"
    assert lines[-2:] == [f"fingerprint {cradle.fingerprint}", "unit 1.0 start 0.0"]
    assert len(lines) == len(cradle.contacts) + 2
    found = kinetile("certify-log", "cradle", path, "--until", 5, code=0)
    assert f"all lines are right: {len(lines) - 2}, to time 5.0" in found.stdout
    assert f"answer {kt.ANSWER}, fingerprint {cradle.fingerprint}" in found.stdout


def test_a_list_of_fewer_contacts_than_the_run_had_is_wrong(tmp_path, cradle):
    path = tmp_path / "short.txt"
    path.write_text(
        "".join(f"{epoch} {tick} {a} {b}\n" for _, epoch, tick, a, b in cradle.contacts[:8].tolist())
    )
    kinetile("certify-log", "cradle", path, "--max-contacts", 8, code=0)
    short = kinetile("certify-log", "cradle", path, "--max-contacts", 9, code=1)
    assert "line 9 is wrong: there are to be 9 contacts" in short.stdout


def test_lines_come_from_stdin(log):
    text = "\n".join(log.read_text().splitlines()[:-2])
    found = kinetile("certify-log", "cradle", "-", "--until", 5, "--json", stdin=text, code=0)
    result = json.loads(found.stdout)
    assert result["right"] is True
    assert result["wrong"] is None
    assert result["answer"] == kt.ANSWER
    assert result["lines"] == result["total"] == 14


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (
            lambda lines: [lines[0].replace("8 0 1", "9 0 1"), *lines[1:]],
            "line 1 is wrong: body 0 with body 1",
        ),
        (lambda lines: lines[:-3], "line 14 is wrong: there is one more before the end"),
        (lambda lines: [*lines[:-2], "fingerprint " + "0" * 64], "line 15 is wrong: the fingerprint"),
    ],
)
def test_the_first_wrong_line_is_reported(log, change, why):
    log.write_text("\n".join(change(log.read_text().splitlines())))
    found = kinetile("certify-log", "cradle", log, "--until", 5, code=1)
    assert why in found.stdout
    assert "answer" not in found.stdout


def test_after_an_interrupt_it_says_how_far_the_log_was_right(log, monkeypatch):
    from kinetile_accuracy.specification.course import Course

    happen, seen = Course.carry_out, []

    def interrupted(self):
        seen.append(self)
        if len(seen) > 5:
            raise KeyboardInterrupt
        happen(self)

    monkeypatch.setattr(Course, "carry_out", interrupted)
    found = kinetile("certify-log", "cradle", log, "--until", 5, code=130)
    assert "the first 5 of 14 lines are right; broken off there" in found.stdout
    assert "interrupted" in found.stderr


@pytest.fixture
def events(tmp_path):
    scene = kt.make_scene("cradle")
    path = tmp_path / "events.parquet"
    with EventRecorder(path, scene) as recorder:
        kt.Simulation(scene, "naive").run(until=5.0, recorder=recorder)
    return path


def test_an_event_file_says_itself_how_far_it_goes(events):
    assert read_events(events).metadata["answer"] == kt.ANSWER
    found = kinetile("certify-log", "cradle", events, code=0)
    assert "14, to time 5.0" in found.stdout
    more = kinetile("certify-log", "cradle", events, "--until", 6, code=1)
    assert "there is one more before the end" in more.stdout


def test_what_a_killed_run_has_left_is_to_be_recovered_first(tmp_path):
    scene = kt.make_scene("cradle")
    with EventRecorder(tmp_path / "e", scene) as recorder:
        found = kinetile("certify-log", "cradle", recorder.partial, code=2)
    assert f"`kinetile recover {recorder.partial}` makes an event file of it" in found.stderr


def test_an_event_file_of_another_scene_is_refused(events):
    found = kinetile("certify-log", "cradle", "-s", "bodies=4", events, code=2)
    assert re.search("is of another scene", found.stderr)


@pytest.mark.parametrize("answer", [0, 2])
@pytest.mark.small
def test_an_event_file_of_another_answer_is_refused(tmp_path, monkeypatch, answer):
    monkeypatch.setattr(kt.Scene, "answer", answer)
    scene = kt.make_scene("cradle")
    path = tmp_path / "events.parquet"
    with EventRecorder(path, scene) as recorder:
        kt.Simulation(scene, "naive").run(until=5.0, recorder=recorder)
    monkeypatch.undo()
    assert read_events(path).metadata["answer"] == answer
    found = kinetile("certify-log", "cradle", path, code=2)
    assert f"is of answer {answer}, and this check is of answer {kt.ANSWER}" in found.stderr


WITHOUT = """
import sys
for name in {names!r}:
    sys.modules[name] = None  # as if it were not installed
"""

WITH_NUMPY_ALONE = """
import numpy as np
import kinetile as kt
from kinetile_accuracy import certify_log
shapes = [kt.box(0.25, 0.25), kt.capsule((-0.1, 0.0), (0.1, 0.0), 0.1)]
places, velocities = [[0.25, 0.5], [0.75, 0.5]], [[1.0, 0.0], [0.0, 0.0]]
scene = kt.Scene(places, velocities, shape={shape}, shapes=shapes, arena=(1.0, 1.0))
rows = np.array({rows}, dtype=[(name, "i8") for name in ("epoch", "tick", "a", "b")])
print(certify_log(scene, rows, max_contacts=1).right)
"""


def python(code, names, *words):
    source = WITHOUT.format(names=names) + code
    return subprocess.run([sys.executable, "-c", source, *map(str, words)], capture_output=True, text=True)


@pytest.mark.small
def test_the_certifier_needs_numpy_alone():
    scene = kt.Scene(
        [[0.25, 0.5], [0.75, 0.5]],
        [[1.0, 0.0], [0.0, 0.0]],
        shape=[0, 1],
        shapes=[kt.box(0.25, 0.25), kt.capsule((-0.1, 0.0), (0.1, 0.0), 0.1)],
        arena=(1.0, 1.0),
    )
    sim = kt.Simulation(scene, "naive")
    sim.run(max_contacts=1)
    (_, epoch, tick, a, b) = sim.contacts[0].tolist()
    others = ("numba", "llvmlite", "pluggy", "pydantic", "typer", "rich", "platformdirs", "pyarrow", "flint")
    for found, right in ((tick, "True"), (tick + 1, "False")):
        code = WITH_NUMPY_ALONE.format(shape=[0, 1], rows=[(epoch, found, a, b)])
        told = python(code, others)
        assert told.stdout.strip() == right, told.stderr


def test_the_command_needs_no_numba(log):
    code = "from kinetile.__main__ import main\nmain()\n"
    told = python(code, ("numba", "llvmlite"), "certify-log", "cradle", log, "--until", 5)
    assert told.returncode == 0, told.stderr
    assert "all lines are right" in told.stdout
