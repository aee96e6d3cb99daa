"""What ``kinetile new-plugin`` writes works at once, and breaking any line of it is found out."""

import importlib.util
import re
import runpy
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import kinetile as kt
from command_line import kinetile, refused
from installing import run
from kinetile.plugin.new_plugin import new_plugin
from messages import table
from registering import registered


def text(folder: Path, name: str) -> str:
    return (folder / name).read_text(encoding="utf-8")


def test_a_complete_package_is_written(tmp_path):
    folder = new_plugin("Sorted_Cells", tmp_path)
    assert folder == tmp_path / "kinetile-sorted-cells"
    files = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    modules = {f"kinetile_sorted_cells/{name}" for name in ("__init__.py", "phase.py", "py.typed")}
    assert {*files} == modules | {"LICENSE", "README.md", "pyproject.toml", "tests/test_conformance.py"}
    project = tomllib.loads(text(folder, "pyproject.toml"))["project"]
    assert project["name"] == "kinetile-sorted-cells"
    assert project["entry-points"]["kinetile"] == {"sorted_cells": "kinetile_sorted_cells"}
    assert project["optional-dependencies"]["test"] == ["kinetile[conformance]"]
    assert '= "kinetile_sorted_cells.phase:SortedCellsPhase", ' in text(
        folder, "kinetile_sorted_cells/__init__.py"
    )
    assert "\nclass SortedCellsPhase:\n" in text(folder, "kinetile_sorted_cells/phase.py")
    lines = [line for line in text(folder, "tests/test_conformance.py").splitlines() if line.strip()]
    assert len(lines) == 4
    assert not [name for name in files if re.search(r"Template|\$name", text(folder, name))]
    assert [line for line in text(folder, "README.md").splitlines() if line.startswith("$ p")] == [
        "$ pip install -e '.[test]'",
        "$ pytest",
    ]


def test_the_command_says_what_to_do_next(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = kinetile("new-plugin demo", code=0)
    assert result.stdout.splitlines()[-3:] == ["  cd kinetile-demo", "  pip install -e '.[test]'", "  pytest"]
    assert "is there already" in refused("new-plugin demo")
    refused("new-plugin demo --into", tmp_path / "nowhere")


@pytest.mark.small
@pytest.mark.parametrize("kind", ["response", "observable", "recipe"])
def test_a_broad_phase_was_all_that_could_be_begun_with(kind, tmp_path, monkeypatch):
    name = f"trial-{kind}"
    folder = new_plugin(name, tmp_path, kind)
    slips = r"Template|\$\w|\bA [aeio]"
    assert not [each for each in folder.rglob("*.*") if re.search(slips, text(folder, each))]
    monkeypatch.syspath_prepend(str(folder))
    with registered(importlib.import_module(f"kinetile_trial_{kind}")):
        if kind != "response":
            runpy.run_path(str(folder / "tests/test_run.py"))["test_all_broad_phases_agree"]()
            return
        begun = kt.make_scene("grid", bodies=4)
        kept = []
        for left in (1.0, 0.5):
            scene = begun.replace(responses=kt.Response(name, left=left))
            assert kt.compare(scene, ["naive", "cells"], until=1.0).identical
            sim = kt.Simulation(scene, "naive")
            sim.run(until=1.0)
            kept.append((sim.velocities() ** 2).sum() / (begun.velocity**2).sum())
        assert kept[0] == pytest.approx(1.0, rel=1e-12)
        assert kept[1] < 0.9


def nothing_written(name: str, kind: str = "broad-phase") -> None:
    Path("kinetile-demo").mkdir()
    try:
        new_plugin(name, Path(), kind)
    finally:
        assert [*Path().rglob("*")] == [Path("kinetile-demo")]


test_message = table(globals())


@pytest.mark.long
@pytest.mark.compiled
@pytest.mark.skipif(importlib.util.find_spec("hatchling") is None, reason="installing needs hatchling here")
def test_two_commands_lead_to_a_conforming_phase(tmp_path):
    folder = new_plugin("trial", tmp_path)
    pip = ["-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation", "--no-deps"]
    subprocess.run([sys.executable, *pip, "--target", str(tmp_path / "site"), str(folder)], check=True)
    paths = [str(tmp_path / "site")]
    tests = run("-q", folder=folder, paths=paths, interpreted=False, module="pytest")
    assert tests.returncode == 0, tests.stdout
    judged = run("conform", "trial", folder=folder, paths=paths, interpreted=False)
    assert judged.returncode == 0, judged.stdout
    assert "trial conforms" in judged.stdout
