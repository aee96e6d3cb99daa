"""What ``kinetile new-plugin`` writes works at once, and breaking any line of it is found out."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

from command_line import kinetile, refused
from installing import install, run
from kinetile.plugin.new_plugin import new_plugin
from messages import table


def text(folder: Path, name: str) -> str:
    return (folder / name).read_text(encoding="utf-8")


def test_a_complete_package_is_written(tmp_path):
    folder = new_plugin("Sorted_Cells", tmp_path)
    assert folder == tmp_path / "kinetile-sorted-cells"
    assert {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()} == {
        "LICENSE",
        "README.md",
        "pyproject.toml",
        "kinetile_sorted_cells/__init__.py",
        "kinetile_sorted_cells/phase.py",
        "kinetile_sorted_cells/py.typed",
        "tests/test_conformance.py",
    }
    project = tomllib.loads(text(folder, "pyproject.toml"))["project"]
    assert project["name"] == "kinetile-sorted-cells"
    assert project["entry-points"]["kinetile"] == {"sorted_cells": "kinetile_sorted_cells"}
    assert project["optional-dependencies"]["test"] == ["kinetile[conformance]"]
    assert '"sorted-cells", "kinetile_sorted_cells.phase:SortedCellsPhase"' in text(
        folder, "kinetile_sorted_cells/__init__.py"
    )
    assert "\nclass SortedCellsPhase:\n" in text(folder, "kinetile_sorted_cells/phase.py")
    lines = [line for line in text(folder, "tests/test_conformance.py").splitlines() if line.strip()]
    assert len(lines) == 4
    for path in folder.rglob("*"):
        if path.is_file():
            assert "Template" not in path.read_text(encoding="utf-8")
            assert "$name" not in path.read_text(encoding="utf-8")
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


# The generated phase, judged with interpreted hooks: nothing has to be compiled


def nothing_written(name: str) -> None:
    """Write a plugin that cannot be, beside one that is there."""
    Path("kinetile-demo").mkdir()
    try:
        new_plugin(name, Path())
    finally:
        assert [*Path().rglob("*")] == [Path("kinetile-demo")]


test_message = table(globals())


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """An installed package kinetile-demo, fresh from the template, and how to run commands beside it."""
    folder = tmp_path_factory.mktemp("demo")
    package = new_plugin("demo", folder)
    paths = install(package, folder / "site")

    def command(*words: object, module: str = "kinetile"):
        return run(*words, folder=folder, paths=paths, module=module, interpreted=True)

    phase = package / "kinetile_demo" / "phase.py"
    return SimpleNamespace(folder=folder, package=package, phase=phase, run=command)


@pytest.mark.slow
def test_its_tests_pass_at_once(demo):
    chosen = ("-k", "(can-be-drawn and not drawn-) or features-are")
    done = demo.run("-q", "-p", "no:cacheprovider", "kinetile-demo", *chosen, module="pytest")
    assert done.returncode == 0, done.stdout
    assert "2 passed" in done.stdout


BROKEN = {
    "replan leaves out its schedule": (
        'another end of its leash."""\n    watch(k, s, body)',
        'another end of its leash."""\n    s.leash[0] = 0.0',
        "its-structure-is-true",
        "from its home, and its leash is",
    ),
    "repair leaves out its schedule": (
        "b.vy * time\n    watch(k, s, body)\n    return",
        "b.vy * time\n    return",
        "same-contacts",
        "does not get on",
    ),
    "repair names nobody": (
        "    watch(k, s, body)\n    return near(k, s, body)\n",
        "    watch(k, s, body)\n    return 0\n",
        "its-structure-is-true",
        r"the contact of bodies \d and \d is awaited",
    ),
    "near forgets a neighbour": (
        "for other in range(k.clock[0].bodies):",
        "for other in range(1, k.clock[0].bodies):",
        "its-structure-is-true",
        r"body \d is near body 0, but body 0 is not near body \d",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("which", BROKEN)
def test_a_broken_line_is_found_with_three_bodies_at_most(which, demo):
    right, wrong, check, said = BROKEN[which]
    whole = text(demo.phase.parent, "phase.py")
    assert whole.count(right) == 1
    demo.phase.write_text(whole.replace(right, wrong), encoding="utf-8")
    try:
        done = demo.run("conform", "demo", "--check", check, "--json")
    finally:
        demo.phase.write_text(whole, encoding="utf-8")
    assert done.returncode == 1, done.stderr
    (result,) = json.loads(done.stdout.splitlines()[-1])["checks"]
    assert result["bodies"] <= 3
    assert re.search(said, result["said"])
    assert result["verdict"].startswith("only demo; ")


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
