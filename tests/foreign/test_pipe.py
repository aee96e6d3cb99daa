"""Engines in other languages over a pipe: right ones conform, and faults in one of them are found."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from command_line import kinetile
from kinetile_conformance import check_engine
from kinetile_conformance.drawing import Drawing
from kinetile_conformance.pipe import EngineError, PipedEngine
from kinetile_conformance.questions import (
    Casts,
    Contacts,
    Moments,
    Pairs,
    compared_until,
    reference_contacts,
    touching,
)
from kinetile_conformance.strategies.shapes import DRAWS
from lanes import first
from programs import program

HERE = Path(__file__).parent
ENGINES = HERE.parents[1] / "docs" / "examples" / "engines"

needs_cc = pytest.mark.needs("cc")
OF_SHAPES = ["same-contacts-of-shapes", "same-contacts-in-a-swarm-of-shapes-on-a-torus"]
SMALL = ["same-contacts", "same-contacts-with-turns", "same-contacts-on-a-torus"]


def line_of(scene):
    """Returns the line of a scene, whose answer is not judged."""
    return Contacts().exchange(scene, kt.Simulation(kt.Scene([[0, 0]], [[0, 0]], 1)).contacts)


def compiled(folder: Path, *macros: str, source: str = "engine-in-c/engine.c", language: str = "c") -> str:
    """Compiles an engine in C or C++; returns the command."""
    made = folder / "engine"
    how = ("-O0", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", *macros, "-x", language)
    compiler = program({"c": "cc", "c++": "c++"}[language])
    subprocess.run([compiler, *how, "-o", str(made), str(HERE / source), "-lm"], check=True)
    return str(made)


def in_python(folder: Path, text: str) -> str:
    """Writes an engine in Python; returns the command. ``answer(line)`` is what it says to a line."""
    loop = "import os, sys, time\nfor line in sys.stdin:\n    print({}, flush=True)\n"
    file = folder / "engine.py"
    file.write_text(loop.format(text), encoding="utf-8")
    return shlex.join([sys.executable, str(file)])


@needs_cc
@pytest.mark.small
def test_the_engine_in_c_conforms(tmp_path):
    report = check_engine(compiled(tmp_path), examples=5, checks=SMALL)
    assert [result.status for result in report.results] == ["passed"] * 3
    assert report.conforms
    assert report.results[1].reason.startswith("it refuses ")
    assert "periodic" in report.results[2].asked
    unseen = ", by 3 of 9 checks, but for turns: no such line was answered"
    assert report.foot.endswith(unseen)


FAULTS_OF_CPP = {2: "off by one", 14: "strict <", 12: "float for double", 13: "the period is ignored"}


@pytest.mark.small
@pytest.mark.needs("c++")
@pytest.mark.parametrize("fault", first(1, [13, 2, 12, 14]), ids=FAULTS_OF_CPP.get)
def test_a_fault_of_an_engine_in_cpp_was_not_found_on_a_torus(fault, tmp_path):
    command = compiled(tmp_path, f"-DFAULT={fault}", language="c++")
    checks = ["same-contacts" if fault == 14 else "same-contacts-on-a-torus"]
    (result,) = check_engine(command, examples=100 if fault == 14 else 20, checks=checks).results
    assert result.status == "failed"
    assert fault != 12 or ", off by " in result.said


@pytest.mark.slow
@pytest.mark.own_loop
@needs_cc
def test_every_default_check_and_scene_is_judged(tmp_path, monkeypatch):
    """``conform`` and ``judge`` without ``--check``, of an engine in C."""
    monkeypatch.chdir(tmp_path)
    command = compiled(tmp_path, "-O2")
    result = kinetile("conform --examples 5 --scene-seconds 120 --command", command, code=0)
    assert "commands, responses: no such line was answered" in result.stdout
    kinetile("judge --examples 5 --repeats 1 --command", command, code=0)


@pytest.mark.small
def test_an_infinite_mass_of_a_body_that_is_inserted_was_no_json():
    wall = kt.Insert(0.5, (3.0, 3.0), (0.0, 0.0), radius=0.5, mass=np.inf)
    scene = kt.Scene([[1, 1]], [[0, 0]], 0.5, commands=[wall], settings=kt.Settings(until=1.0))
    (command,) = json.loads(asked(scene).line)["commands"]
    assert command["insert"]["mass"] == "inf"


@pytest.mark.small
def test_an_error_of_the_kit_was_a_failure_of_the_engine(tmp_path, monkeypatch):
    monkeypatch.setattr(Contacts, "exchanges", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        check_engine(in_python(tmp_path, "line"), examples=1, checks=["same-contacts"])


@pytest.mark.small
@pytest.mark.parametrize(
    ("asked", "answer", "within", "check", "status"),
    [
        ("contacts", "contacts", 1e-9, "same-contacts-on-lattices", "failed"),
        ("contacts", "contacts", 0.4, "same-contacts-on-lattices", "not judged"),
        ("contacts", "contacts", None, "same-contacts", "not judged"),
        ("contacts", "contacts", 1e-9, "same-contacts", "not judged"),
        ("pairs", "pairs", None, "pairs", "not judged"),
        ("casts", "time", 1e-9, "casts", "not judged"),
    ],
)
def test_an_engine_without_contacts_conformed_where_nothing_was_compared(
    asked, answer, within, check, status, tmp_path, monkeypatch
):
    if not check.endswith("lattices"):
        monkeypatch.setattr(Drawing, "scenes", lambda *_: iter([kt.Scene([[0, 0], [9, 0]], [[0, 0]] * 2, 1)]))
    command = in_python(tmp_path, f"""'{{"{answer}": {"null" if asked == "casts" else "[]"}}}'""")
    report = check_engine(command, asked=asked, within=within, examples=2, checks=[check], shrink=False)
    assert [each.status for each in report.results] == [status]
    assert status == "failed" or (report.exit_code, report.conforms) == (4, None)


@pytest.mark.small
def test_what_an_engine_refuses_by_its_key_is_not_sent_again(tmp_path):
    words = """'{"refused": ["turns"]}' if '"turns"' in line else '{"contacts": []}'"""
    checks = ["same-contacts-with-turns", "same-contacts-on-a-torus"]
    how = {"examples": 20, "checks": checks, "save_to": tmp_path, "shrink": False}
    report = check_engine(in_python(tmp_path, words), **how)
    assert [each.status for each in report.results] == ["failed", "failed"]
    for result in report.results:
        sent, *_ = result.case.with_suffix(".jsonl").read_text().splitlines()
        assert '"turns"' not in sent
        assert not json.loads(sent).keys() & {"responses", "kinds"}, "no body is of these kinds"
    assert report.untried == ["turns"]


@pytest.mark.small
@pytest.mark.needs("node")
def test_the_second_implementation_conforms():
    script = HERE.parent / "second" / "pipe.js"
    command = shlex.join([program("node"), str(script)])
    checks = [*SMALL, *OF_SHAPES, "same-contacts-with-responses"]
    report = check_engine(command, examples=5, checks=checks)
    assert [(result.status, result.reason) for result in report.results] == [("passed", "")] * 6


FAULTS = {
    4: "there is no top wall",
    1: "discs that touch and slide meet",
    2: "the last body meets no other",
    3: "of pairs at one tick the last comes first, and before walls",
    5: "ticks are rounded up",
    6: "all masses are equal",
    7: "the first radius counts twice",
    8: "momentum is exchanged without its low digits",
    9: "a wall ends no bar",
    10: "what happens at the end is left out",
    11: "bars are kept for the next scene",
}


@needs_cc
@pytest.mark.small
@pytest.mark.parametrize("fault", first(1, [*FAULTS]), ids=FAULTS.get)
def test_a_fault_is_found(fault, tmp_path):
    command = compiled(tmp_path, f"-DFAULT={fault}")
    examples = 20 if fault == 4 else 100
    report = check_engine(command, examples=examples, checks=["same-contacts"], save_to=tmp_path / "failures")
    (result,) = report.results
    assert (result.status, report.exit_code) == ("failed", 1)
    assert result.bodies <= (4 if fault == 3 else 3)  # two pairs at one tick
    assert "by the specification the engine is wrong in contact" in result.said

    assert len(kt.load_scene(result.case)) == result.bodies
    scene, found, right = result.case.with_suffix(".jsonl").read_text().splitlines()
    again = subprocess.run(command, input=f"{scene}\n", capture_output=True, text=True, check=True).stdout
    kept = "keeps something from one scene to the next" in result.said
    assert kept == (fault == 11)
    assert json.loads(again) == json.loads(right if kept else found)
    assert found != right


def asked(scene, within=None, most=50):
    (exchange,) = Contacts(within, most).exchanges(scene)
    return exchange


@needs_cc
@pytest.mark.small
def test_times_within_a_distance(tmp_path):
    """One tick is far below the distance, and a missing wall is not."""
    report = check_engine(compiled(tmp_path, "-DTIMES"), within=1e-12, examples=4, checks=["same-contacts"])
    assert report.conforms

    end = kt.Settings(until=7.5)
    scene = kt.Scene([[1, 1], [3, 1.2]], [[1.0, 0.25], [0, 0.3]], 0.5, arena=(4.0, 4.0), settings=end)
    for fault, distance, right in ((5, 1e-9, True), (5, 1e-18, False), (4, 1e-3, False)):
        exchange = asked(scene, distance)
        with PipedEngine(compiled(tmp_path, "-DTIMES", f"-DFAULT={fault}")) as engine:
            assert (exchange.judge(engine.answer(exchange)) is None) is right


@pytest.mark.small
def test_within_a_distance_of_the_end_a_contact_may_be_missing():
    """A disc that meets a wall at times 2.5 and 5.5, where the scene ends."""
    scene = kt.Scene([[1.0, 1.0]], [[1.0, 0.0]], 0.5, arena=(4.0, 4.0), settings=kt.Settings(until=5.5))
    exchange = asked(scene, 1e-9)
    one, two = exchange.right
    assert (one, two) == ((2.5, 0, -2), (5.5, 0, -1))
    assert exchange.judge([one]) is None
    assert exchange.judge([one, two, (5.5, 0, -3)]) is None
    assert exchange.judge([one, two, (5.6, 0, -3)]).endswith("at time 5.6, after the end at time 5.5")
    assert exchange.judge([one, two, (5.4, 0, -3)]).startswith("contact 2 is body 0 with the bottom wall at")
    assert exchange.judge([one, (5.4, 0, -3), two]).startswith("contact 1 is one too many: body 0 with the")
    assert exchange.judge([two]).startswith("contact 0 is missing: body 0 with the right wall at time 2.5")
    assert exchange.judge([(2.5 * (1 + 3e-9), 0, -2), two]).startswith("contact 0 is body 0 with the right")


@pytest.mark.small
def test_a_scene_that_has_too_many_contacts_ends_sooner():
    scene = kt.Scene([[1.0, 1.0]], [[4.0, 0.0]], 0.5, arena=(4.0, 4.0), settings=kt.Settings(until=1000.0))
    shorter, contacts = reference_contacts(scene, 10)
    assert shorter.settings.until < 8.0
    assert 3 <= len(contacts) < 10


BROKEN = {
    "line": '; expected {"contacts": [[epoch, tick, a, b], ...]} or {"refused": "reason"}',
    "'{\"refused\": []}'": "the engine refuses []; expected keys that the line has, of [",
    '\'{"refused": ["torus"]}\'': "the engine refuses ['torus']; expected keys that the line has, of [",
    '\'{"refused": ["turns"]}\'': "the engine refuses ['turns']; expected keys",
    "'{'": "the engine answered '{\\n' (Invalid JSON: ",
    "'[' * 10**5": "the engine answered '[[[",
    "'[1]'": "the engine answered '[1]\\n' (",
    "'{}'": "(it has no value, or both)",
    "'{\"contacts\": 1}'": "(contacts: Input should be a valid array)",
    "'{\"contacts\": [[0, 0.5, 0, 1]]}'": "(contacts: 0: 1: Input should be a valid integer)",
    "'{\"contacts\": [[0, 0, 2147483648, 1]]}'": "(contacts: 0: 2: Input should be less than 2147483648)",
    "'{\"contacts\": [[0.5, 0, 1]]}'": "(contacts: 0: ",
    "os._exit(3)": "the engine ended with exit code 3 without an answer",
    "os.abort()": "the engine ended by SIGABRT without an answer",
    "os.write(1, b'{') and os._exit(0)": "the engine ended with exit code 0 within a line",
    "os.close(1) or time.sleep(9)": "the engine closed its output without an answer",
    "time.sleep(99)": "the engine gave no answer within 2.5 s (--scene-seconds)",
}


@pytest.mark.small
@pytest.mark.parametrize(
    ("row", "said"),
    [
        ((0, 0, 99, -1), "body 99 with the left wall at epoch 0, tick 0"),
        ((0, 0, 0, -5), "body 0 with body -5 at"),
        ((0, 0, 0, 0), "body 0 with body 0 at"),
        ((0, -1, 0, 1), "body 0 with body 1 at epoch 0, tick -1"),
    ],
)
def test_a_contact_of_what_is_not_there_is_a_wrong_one(row, said):
    end = kt.Settings(until=7.5)
    scene = kt.Scene([[1, 1], [3, 1.2]], [[1.0, 0.25], [0, 0.3]], 0.5, arena=(4.0, 4.0), settings=end)
    found = asked(scene).judge([row])
    assert found.startswith(f"contact 0 is {said}")
    assert "by the specification the engine is wrong in contact 0" in found


@pytest.mark.small
@pytest.mark.parametrize("said", first(6, [*BROKEN]))
def test_what_is_no_answer_is_said(said, tmp_path):
    command = in_python(tmp_path, said)
    folder = tmp_path / "failures"
    line = "conform --examples 1 --check same-contacts --scene-seconds 2.5"
    result = kinetile(line, "--save-to", folder, "--command", command, code=2)
    assert BROKEN[said] in result.stderr
    where = folder / "engine-same-contacts.toml"
    assert f"(same-contacts, scene 1; the scene is saved: {where})\n" in result.stderr
    assert len(where.with_suffix(".jsonl").read_text().splitlines()) == 1


@pytest.mark.small
def test_the_report_as_json(tmp_path):
    command = in_python(tmp_path, """'{"refused": "no time"}'""")
    result = kinetile("conform --examples 2 --check same-contacts --json --within 1e-9 --command", command)
    row, report = map(json.loads, result.stdout.splitlines())
    assert (row["result"]["status"], row["result"]["scenes"]) == ("skipped", 2)
    assert row["result"]["reason"] == "it refuses 2 of 2 scenes, such as: no time"
    assert (report["command"], report["within"], report["conforms"]) == (command, 1e-9, None)
    assert "broad_phase" not in report


@pytest.mark.small
def test_a_program_that_refused_every_scene_conformed(tmp_path):
    command = in_python(tmp_path, """'{"refused": "no time"}'""")
    line = "conform --examples 2 --check same-contacts --check same-contacts-on-a-torus --command"
    result = kinetile(line, command, code=4)
    assert result.stdout.splitlines()[-1] == f"{command} is not judged: it refuses every scene"


HELD = """
import os, sys, time
pid = os.fork()
if pid == 0:
    os.setsid()
    time.sleep(600)
open(sys.argv[1], "w").write(str(pid))
"""


@pytest.mark.slow
@pytest.mark.small
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="there is no /proc to see processes in")
@pytest.mark.parametrize("then", first(1, ["time.sleep(600)", "sys.stdin.readline()", ""]))
def test_a_child_in_a_session_of_its_own_that_kept_the_pipe_hung_the_judge(then, tmp_path):
    """The limit ends the program, and the pipe stays open: the answer does not come, the line does not go."""
    program, file = tmp_path / "held.py", tmp_path / "pid"
    program.write_text(HELD + then, encoding="utf-8")
    scene = kt.Scene(np.arange(20_000).reshape(-1, 2) * 1.5, np.zeros((10_000, 2)), 0.5)
    try:
        with PipedEngine(shlex.join([sys.executable, str(program), str(file)]), seconds=2.0) as engine:
            for _ in range(2):
                with pytest.raises(EngineError, match="the engine gave no answer within 2 s"):
                    engine.answer(line_of(scene))
        assert is_running(file.read_text()), "the judge has waited for it"
    finally:
        os.kill(int(file.read_text()), signal.SIGKILL)


@pytest.mark.small
def test_control_characters_of_an_engine_reached_the_terminal(tmp_path):
    command = in_python(tmp_path, r"""'{"refused": "no\\u001b[31m \\u202etime"}'""")
    result = kinetile("conform --examples 1 --check same-contacts --command", command)
    assert r"such as: no\x1b[31m \u202etime" in result.stdout
    assert all(line.isprintable() for line in result.stdout.split("\n"))


def test_lines_longer_than_a_pipe(capfd, tmp_path):
    """Of a mebibyte each way; and what the engine writes to stderr is passed on."""
    command = in_python(
        tmp_path, """'{"refused": "' + 'x' * 2**20 + str(os.write(2, b'hello') * len(line)) + '"}'"""
    )
    scene = kt.Scene(np.arange(20_000).reshape(-1, 2) * 1.5, np.zeros((10_000, 2)), 0.5)
    line = line_of(scene)
    with PipedEngine(command) as engine:
        answers = {engine.answer(line) for _ in range(3)}
    (answer,) = answers
    assert int(answer.lstrip("x")) > 2**20
    assert capfd.readouterr().err == "hello" * 3


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.small
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="there is no /proc to see processes in")
def test_nothing_is_left_running(tmp_path):
    """Ctrl-C ends the engine, and what it has started."""
    engine = in_python(tmp_path, "open(sys.argv[1], 'w').write(str(os.getpid())) and '{\"refused\": \"\"}'")
    file = tmp_path / "pid"
    shell = f"sh -c {shlex.quote(f'{engine} {file}; true')}"  # the shell is one process, Python another

    def interrupt(check, count):
        if count == 2:
            assert is_running(file.read_text())
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check_engine(shell, examples=3, checks=["same-contacts"], on_scene=interrupt)
    late = time.monotonic() + 5.0
    while is_running(file.read_text()) and time.monotonic() < late:
        time.sleep(0.01)
    assert not is_running(file.read_text())


def in_python_as(name, *fault):
    program, *words = name.split()
    folder = ENGINES if (ENGINES / f"{program}.py").exists() else HERE / "engines"
    return shlex.join([sys.executable, str(folder / f"{program}.py"), *words, *fault])


BROAD_PHASES = {"plain": "sys", "chipmunk": "pymunk", "box2d": "Box2D"}
BROAD_PHASES |= {"indexes strtree": "shapely", "indexes rtree": "rtree", "indexes ckdtree": "scipy"}


@pytest.mark.small
@pytest.mark.parametrize("name", first(1, [*BROAD_PHASES]))
def test_candidate_pairs_of_a_broad_phase(name):
    """In plain Python, and of two engines that others wrote."""
    pytest.importorskip(BROAD_PHASES[name])
    checks = ["pairs", "pairs-as-bodies-come-and-go"]
    report = check_engine(in_python_as(name), asked="pairs", examples=2, checks=checks)
    assert [result.status for result in report.results] == ["passed", "passed"]
    assert report.limits == ", by 2 of 5 checks"
    for result in report.results:
        candidates, touch = (int(n.replace(",", "")) for n in re.findall(r"[\d,]*\d", result.said))
        assert 0 < touch <= candidates < 20 * touch


@pytest.mark.small
@pytest.mark.parametrize(
    ("name", "fault", "moments", "bodies"),
    first(
        2,
        [
            ("plain", "single", 1, 2),
            ("plain", "closed", 1, 2),
            ("plain", "gone", 2, 2),
            ("chipmunk", "stale", 2, 2),
            ("box2d", "sleepy", 2, 2),
            ("plain", "come", 2, 2),
            ("plain", "swap", 2, 4),
        ],
    ),
)
def test_a_fault_of_a_broad_phase_is_found_and_minimised(name, fault, moments, bodies, tmp_path):
    pytest.importorskip(BROAD_PHASES[name])
    living = fault in ("gone", "come", "swap")
    how = {"examples": 70 if living else 40, "checks": ["pairs-as-bodies-come-and-go" if living else "pairs"]}
    report = check_engine(in_python_as(name, fault), asked="pairs", save_to=tmp_path, **how)
    (result,) = report.results
    assert result.status == "failed"
    *sent, found, right = result.case.read_text().splitlines()
    assert len(sent) <= moments
    assert result.bodies <= bodies
    again = subprocess.run(
        report.replays(result.case), shell=True, capture_output=True, text=True, check=True
    )
    assert again.stdout.splitlines()[-1] == found != right


CLAIMS = {
    "[[0, 1]]": None,
    "[[1, 0], [0, 2]]": None,
    "[]": "at moment 0 bodies 0 and 1 touch, and are no pair: (0.0, 0.0, 1.0), (3.0, 4.0, 4.0)",
    "[[0, 1], [1, 0]]": "at moment 0 the engine names pair [1, 0], once more",
    "[[0, 1], [1, 1]]": "at moment 0 the engine names pair [1, 1], a body with itself",
    "[[0, 1], [0, 3]]": "at moment 0 the engine names pair [0, 3], and there is no body 3",
}


@pytest.mark.parametrize("found", CLAIMS)
def test_what_candidate_pairs_are_right(found):
    discs = Moments("discs", ({0: (0.0, 0.0, 1.0), 1: (3.0, 4.0, 4.0), 2: (9.0, 0.0, 0.5)},))
    (exchange,) = Pairs().exchanges(discs)
    assert exchange.judge(json.loads(found)) == CLAIMS[found]
    assert exchange.line == (
        b'{"moment": 0, "discs": [[0, 0.0, 0.0, 1.0], [1, 3.0, 4.0, 4.0], [2, 9.0, 0.0, 0.5]]}\n'
    )


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ((0.0, 0.0, 1.0), (3.0, 4.0, 4.0)),
        ((0.0, 0.0, 1.0), (3.0, 4.0, np.nextafter(4.0, 0.0))),
        ((0.0, 0.0, 0.1), (0.3, 0.0, 0.2)),
        ((0.0, 0.0, 0.1), (0.8, 0.0, 0.7)),
        ((0.1, 0.0, 0.1), (0.4, 0.0, 0.2)),
        ((1e150, 0.0, 1e150), (-1e150, 0.0, 1e150)),
        ((5e-324, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((0.0, 0.0, 1.0, 1.0), (1.0, 1.0, 2.0, 1.0)),
        ((0.0, 0.0, 1.0, 1.0), (np.nextafter(1.0, 2.0), 0.0, 2.0, 1.0)),
    ],
)
def test_two_discs_or_boxes_touch_exactly(one, other):
    (*here, r), (*there, s) = ([Fraction(number) for number in row] for row in (one, other))
    if len(one) == 3:
        touch = sum((x - z) ** 2 for x, z in zip(here, there, strict=True)) <= (r + s) ** 2
    else:
        touch = all(one[i] <= other[i + 2] and other[i] <= one[i + 2] for i in (0, 1))
    assert touching({3: one, 1: other}) == ([(1, 3)] if touch else [])


def in_doubles(language, fault, folder):
    if language == "c":
        return compiled(folder, f"-DFAULT={fault or 0}", source="engines/doubles.c")
    return shlex.join([program("node"), str(HERE / "engines" / "doubles.js"), *([fault] if fault else [])])


in_both = pytest.mark.parametrize(
    "language",
    first(1, [pytest.param("c", marks=needs_cc), pytest.param("js", marks=pytest.mark.needs("node"))]),
)


@pytest.mark.slow
@pytest.mark.small
@in_both
@pytest.mark.parametrize(
    ("asked", "within"), first(1, [("contacts", 1e-9), ("casts", 1e-11), ("pairs", None)])
)
def test_an_engine_in_floating_point_conforms(language, asked, within, tmp_path):
    if (language, asked) == ("c", "contacts"):
        command = compiled(tmp_path, "-DTIMES")
    else:
        command = in_doubles(language, None, tmp_path)
    check = "same-contacts" if asked == "contacts" else asked
    (result,) = check_engine(command, asked=asked, within=within, examples=5, checks=[check]).results
    assert result.status == "passed"
    few, many = sorted([int(n.replace(",", "")) for n in re.findall(r"[\d,]*\d", result.said)][:2])
    assert few > many / 10, "next to nothing was compared"


FAULTS_IN_DOUBLES = [
    pytest.param(language, *each, marks=needs_cc if language == "c" else pytest.mark.needs("node"))
    for language, *each in (
        ("js", "light", "contacts"),
        ("c", "1", "casts"),
        ("c", "2", "pairs"),
        ("js", "late", "contacts"),
        ("js", "late", "casts"),
        ("js", "narrow", "pairs"),
    )
]


@pytest.mark.slow
@pytest.mark.small
@pytest.mark.parametrize(("language", "fault", "asked"), first(1, FAULTS_IN_DOUBLES))
def test_a_fault_in_floating_point_is_found(language, fault, asked, tmp_path):
    command = in_doubles(language, fault, tmp_path)
    within, check = (None if asked == "pairs" else 1e-9), ("same-contacts" if asked == "contacts" else asked)
    report = check_engine(command, asked=asked, within=within, examples=60, checks=[check])
    (result,) = report.results
    assert result.status == "failed"
    assert result.bodies <= 4


@pytest.mark.slow
@pytest.mark.small
@pytest.mark.parametrize("within", first(1, [1e-9, 1e-6]))
def test_the_comparison_ends_before_a_run_in_doubles_parts_from_the_exact_one(within):
    pytest.importorskip("flint")
    from kinetile_accuracy.oracle.agreement import certify

    scene = kt.make_scene("grid", bodies=16, density=0.3, seed=1)
    sim = kt.Simulation(scene)
    sim.run(max_contacts=250)
    end = compared_until(scene.replace(settings=kt.Settings(until=sim.time)), sim.contacts, within)
    compared = int((sim.contacts["time"] < end).sum())
    assert 16 <= compared < certify(sim).contacts


@pytest.mark.small
def test_far_from_the_origin_an_engine_failed_by_what_its_places_round():
    places = np.array([[4.0, 0.0], [12.0, -6.0], [21.0, 3.0]])
    for far, fails in ((0.0, True), (-(2.0**30), False)):
        how = {"velocity": [[5.0, 0.0], [-0.5, 4.0], [-8.0, -2.0]], "radius": [1.0, 1.0, 0.25]}
        scene = kt.Scene(places + far, **how, settings=kt.Settings(until=1.2421875))
        exchange = asked(scene, 1e-10)
        first, (time, *bodies) = exchange.right
        assert (exchange.judge([first, (time - 5e-9, *bodies)]) is not None) is fails


@pytest.mark.small
def test_contacts_within_the_distance_of_each_other_come_in_either_order():
    """Two discs fly at the left and at the right wall, and arrive at once, or hardly later."""
    for later in (0.0, 2.0**-34):
        places = [[1.0, 1.0], [3.0 - later, 3.0]]
        end = kt.Settings(until=1.5)
        scene = kt.Scene(places, [[-1.0, 0.0], [1.0, 0.0]], 0.5, arena=(4.0, 4.0), settings=end)
        exchange = asked(scene, 1e-9)
        one, two = exchange.right
        assert exchange.judge([two, one]) is None
        assert (asked(scene, 1e-12).judge([two, one]) is None) is (later == 0.0)
        assert exchange.judge([one, (*two[:1], 0, -1)]).startswith("contact 1 is missing")


CASTS = {  # two discs of radius .5, the second at rest so far ahead and aside: right times, and wrong ones
    (3.0, 0.0): ([2.0, 2.0 + 1e-9], [None, 2.0 + 1e-7, 1.9]),
    (3.0, 1.0): ([None, 3.0], [2.9, 1.0]),  # they touch in passing
    (3.0, 1.0 + 1e-10): ([None, 3.0], [2.9, 1.0]),
    (3.0, 1.0 - 1e-10): ([None, 3.0], [2.9, 1.0]),
    (3.0, 1.0 + 1e-6): ([None], [3.0]),
    (3.0, 1.0 - 1e-6): ([3.0 - 2.0**0.5 * 1e-3], [None, 3.0]),
    (9.0, 0.0): ([None, 8.0], [7.9]),  # at the end
    (1.0, 0.0): ([0.0], [None, 1e-3]),
    (-3.0, 0.0): ([None], [0.0, 1.0]),
}


@pytest.mark.small
@pytest.mark.parametrize(("ahead", "aside"), CASTS)
def test_what_times_of_a_cast_are_right(ahead, aside):
    scene = kt.Scene([[0, 0], [ahead, aside]], [[1, 0], [0, 0]], 0.5, settings=kt.Settings(until=8.0))
    (case,) = Casts(1e-8).cases(scene)
    (exchange,) = Casts(1e-8).exchanges(case)
    right, wrong = CASTS[ahead, aside]
    assert [time for time in [*right, *wrong] if exchange.judge(time) is None] == right


@pytest.mark.slow
@pytest.mark.small
def test_casts_of_shapes_are_those_of_the_kernel():
    drawn = [scene for scene in DRAWS["shapes"](12, 0) if not scene.periodic]
    question = Casts(1e-9)
    met = 0
    for case in [case for scene in drawn for case in question.cases(scene)]:
        sim = kt.Simulation(case, "naive")
        sim.run(max_contacts=1)
        for exchange in question.exchanges(case):
            time = float(sim.contacts["time"][0]) if len(sim.contacts) else None
            met += time is not None
            assert exchange.judge(time) is None
            assert abs((exchange.right or 0.0) - (time or 0.0)) <= 1e-12
    assert met > 5
