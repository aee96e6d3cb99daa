"""The house: what judges and shows uses what is public, rooms are small, and so are files."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

import kinetile as kt

CORE = Path(__file__).parents[1] / "core" / "kinetile"
USERS = ("accuracy", "bench", "cli", "conformance", "records", "show")
"""Rooms above ``run``: users of the public interface like anybody."""

MARKERS = {"__init__.py", "__main__.py", "py.typed"}
"""Of the package itself: no rooms."""

NAMED_TUPLE = {"_replace", "_fields", "_asdict", "_make"}
"""Public names, whatever they look like."""


def private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


@pytest.mark.parametrize("room", USERS)
def test_what_judges_and_shows_uses_nothing_private(room):
    found = []
    for path in sorted((CORE / room).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        own = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)} | NAMED_TUPLE
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and private(node.attr) and node.attr not in own:
                mine = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls", "os")
                found += [] if mine else [f"{path.relative_to(CORE)}:{node.lineno} {node.attr}"]
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("kinetile"):
                names = [*node.module.split("."), *(alias.name for alias in node.names)]
                found += [f"{path.relative_to(CORE)}:{node.lineno} {name}" for name in names if private(name)]
    assert not found


def test_a_room_has_at_most_sixteen_entries():
    rooms = [CORE, *(path for path in CORE.rglob("*") if path.is_dir() and path.name != "__pycache__")]
    for room in rooms:
        entries = {path.name for path in room.iterdir()} - {"__pycache__"}
        entries -= MARKERS if room == CORE else set()
        assert len(entries) <= 16, f"{room.relative_to(CORE.parent)}: {sorted(entries)}"


def test_no_file_is_longer_than_450_lines():
    for tree in (CORE, CORE.parents[1] / "plugins"):
        for path in tree.rglob("*.py"):
            assert len(path.read_text(encoding="utf-8").splitlines()) <= 450, path.name


def test_no_test_judges_how_long_it_takes():
    """A busy machine failed tests with "Input generation is slow". What a test itself suppresses takes the
    place of what all suppress, and a deadline of its own that of none."""
    assert settings.default.deadline is None
    assert HealthCheck.too_slow in settings.default.suppress_health_check
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.keyword) and node.arg in ("suppress_health_check", "deadline"):
                said = ast.unparse(node.value)
                assert said in ("None", "list(HealthCheck)") or path.name == "conftest.py", path


def test_public_names_are_where_they_were():
    from kinetile import trajectory
    from kinetile.conformance.isolation.hearing import Hearing
    from kinetile.conformance.strategies import scenes
    from kinetile.records import EventRecorder, read_events
    from kinetile.scene import Scene

    assert (trajectory.Trajectory, Scene) == (kt.Trajectory, kt.Scene)
    assert (EventRecorder, read_events) == (kt.EventRecorder, kt.read_events)
    assert callable(Hearing)
    assert callable(scenes)
    with pytest.raises(AttributeError):
        _ = trajectory.nothing
