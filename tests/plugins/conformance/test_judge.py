"""``kinetile judge``: one page and one JSON file about phases and programs, side by side."""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import kinetile as kt
import kinetile_conformance
from command_line import kinetile
from installing import OWN
from kinetile_conformance import Result, judging
from kinetile_conformance.cases import Subject
from kinetile_conformance.pipe import EngineReport
from lanes import first

pytestmark = pytest.mark.small

FEW = ("--examples", 3, "--repeats", 1, "--check", "same-contacts")
TINY = '# two discs\nrecipe = "two-discs"\nuntil = 2.0\n'


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    faults = {name: {"family": "late", "killed_by": check} for name, check in (("a", None), ("b", "x"))}
    (tmp_path / "faults.json").write_text(json.dumps({"faults": faults}))
    monkeypatch.setattr(judging, "FAULTS", tmp_path / "faults.json")
    (tmp_path / "tiny.toml").write_text(TINY)
    for name in [*judging.SCENES]:
        monkeypatch.delitem(judging.SCENES, name)
    monkeypatch.setitem(judging.SCENES, "tiny", tmp_path / "tiny.toml")


def program(name: str, answer: object) -> str:
    text = f"import sys\nfor line in sys.stdin: print({json.dumps(answer)!r}, flush=True)"
    Path(name).write_text(text, encoding="utf-8")
    return shlex.join([sys.executable, name])


@pytest.mark.slow
def test_one_that_conforms_one_that_fails_and_one_that_refuses_stand_side_by_side(blind, tmp_path):
    programs = program("demo.py", {"refused": "it is a <demo>"}), program("wrong.py", {"contacts": []})
    result = kinetile("judge naive", blind, "--command", programs[0], "--command", programs[1], *FEW)
    assert (result.exit_code, result.stderr.splitlines()[0].split()[0]) == (1, "judging")
    *said, _, _ = result.stdout.splitlines()
    verdicts = ["conforms", "does not conform", "not judged", "does not conform"]
    assert [line.rpartition(": ")[2] for line in said] == verdicts

    found = json.loads((tmp_path / "judged/judge.json").read_text())
    assert (found["status"], found["faults"]) == ("complete", {"late": [1, 2]})
    measured = [each["measured"][0] for each in found["judged"]]
    assert [row["of"] for row in measured] == ["tiny"] * 4
    assert measured[0]["structure_bytes"] > 0 < measured[0]["asked_per_contact"]
    assert [bool(row["differs"]) for row in measured] == [False, True, False, True]
    assert measured[2]["ended_by"] == "it is a <demo>"

    page = (tmp_path / "judged/judge.html").read_text()
    assert "✗ does not conform" in page
    assert "tiny: two discs" in page
    assert "it is a &lt;demo&gt;" in page
    assert f"replay: kinetile replay {blind} judged/failures/{blind}-same-contacts.toml" in page
    assert "it finds 1 by default" in page
    assert "<script" not in page
    assert "This page is partial" not in page
    assert str(tmp_path) not in page


def test_ctrl_c_keeps_what_is_done_and_the_page_says_that_it_is_partial(monkeypatch, tmp_path):
    def judge(name, *, on_result, **more):
        on_result(Result("same-contacts", "It gives them.", "passed", 3, 0.5))
        raise KeyboardInterrupt

    monkeypatch.setattr(kinetile_conformance, "check_broad_phase", judge)
    result = kinetile("judge naive cells --json", code=130)
    found = json.loads(result.stdout)
    assert found["status"] == "interrupted"
    assert [len(each["report"]["checks"]) for each in found["judged"]] == [1, 0]
    assert [each["verdict"] for each in found["judged"]] == ["not judged", "not judged"]
    assert "✗ This page is partial" in (tmp_path / "judged/judge.html").read_text()


@pytest.mark.slow
def test_a_narrow_phase_and_a_response_are_judged_and_measured_with_it(tmp_path):
    beside = "--narrow-phase disc --response restitution:e=0.5,contact_time=1e-6"
    kinetile(f"judge naive {beside} --examples 1 --repeats 1 --check same-contacts", code=0)
    found = json.loads((tmp_path / "judged/judge.json").read_text())
    assert found["beside"] == ["disc", "restitution:e=0.5,contact_time=1e-06"]
    (row,) = found["judged"][0]["measured"]
    assert (row["contacts"] > 0, row["differs"], row["ended_by"]) == (True, None, None)


def test_a_measurement_of_a_program_that_refuses_by_keys():
    report = EngineReport(Subject(program("keys.py", {"refused": ["arena", "mass"]}), {}), "")
    scene = kt.load_scene("tiny.toml")
    row = judging._program_measured(report, scene, judging._reference(Subject("naive", {}), scene)[0])
    assert row.ended_by == "it has arena or mass"


def test_a_program_may_be_asked_for_pairs(tmp_path):
    result = kinetile(
        "judge --examples 2 --check pairs --ask pairs --command", program("none.py", {"pairs": []})
    )
    assert result.exit_code == 1
    (found,) = json.loads((tmp_path / "judged/judge.json").read_text())["judged"]
    assert (found["report"]["asked"], found["measured"]) == ("pairs", [])
    assert "✗ failed" in (tmp_path / "judged/judge.html").read_text()


@pytest.mark.parametrize("line", first(1, ["judge naive", "conform --command true"]))
def test_a_missing_extra_is_said(line):
    without = "import sys; sys.modules['hypothesis'] = None; from kinetile.cli import app; app(sys.argv[1:])"
    words = [sys.executable, "-c", without, *line.split()]
    ran = subprocess.run(
        words, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": os.pathsep.join(OWN)}
    )
    assert (ran.returncode, ran.stdout) == (2, "")
    assert "pip install 'kinetile[conformance]'" in ran.stderr


def test_the_dozen_scenes_are_scenes(monkeypatch):
    monkeypatch.undo()
    scenes = {name: kt.load_scene(path) for name, path in judging.SCENES.items()}
    assert len(scenes) == 12
    assert all(scene.settings.until > 0.0 for scene in scenes.values())
    assert {"torus"} == {name for name, scene in scenes.items() if scene.periodic}
    assert {"shapes"} == {name for name, scene in scenes.items() if scene.shapes}
    assert {"come-and-go"} == {name for name, scene in scenes.items() if scene.commands}
    assert {"granular"} == {name for name, scene in scenes.items() if scene.responses}
