"""Cases as files: a scene in TOML that replays exactly, and what was on trial in comments at its head."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kinetile.plugin.by_name import load_scene
from kinetile.scene import Scene
from kinetile.scene.text.files import dumps_scene
from kinetile_conformance.cases.runs import Subject

__all__ = ["Case", "load_case", "not_saved", "save_case"]


def save_case(scene: Scene, path: Path, check: str, subject: Subject, said: str) -> None:
    """Write a case as a scene file; what was on trial, with its options, and what was said stand in comments
    at its head."""
    head = [f"check: {check}", f"broad phase: {subject.name}"]
    if subject.options:
        head.append(f"options: {json.dumps(dict(subject.options), default=repr)}")
    if subject.narrow:
        head.append(f"narrow phases: {json.dumps(subject.narrow, default=repr)}")
    head += [f"said: {line}" for line in said.splitlines()[:6]]
    text = "".join(f"# {line}\n" for line in head)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text + dumps_scene(scene), encoding="utf-8")


def not_saved(what: str, error: OSError) -> str:
    """Return the line of a report that says why a file is missing: no fault of the phase on trial."""
    return f"(the {what} could not be saved: {error.strerror or error})"


@dataclass(frozen=True)
class Case:
    """A case as it was saved: the scene, and the check, phases and options that its file names; None, where
    it names none."""

    scene: Scene
    check: str | None
    name: str | None
    options: Mapping[str, Any]
    narrow_phases: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


def load_case(path: Path) -> Case:
    """Read a case; a scene file that the kit has not written is one as well."""
    head: dict[str, str] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("# "):
            break
        key, _, value = line[2:].partition(":")
        head.setdefault(key, value.strip())
    said: dict[str, Any] = {"options": {}, "narrow phases": {}}
    if "check" in head:
        for key in said:
            with contextlib.suppress(ValueError):
                said[key] = json.loads(head.get(key, "{}"))
    check = head.get("check")
    return Case(load_scene(path), check, head.get("broad phase") if check else None, *said.values())
