"""The commands of a scene file: ``[[commands]]`` tables, in the order in which they are carried out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from kinetile.errors import Mistake
from kinetile.scene.commands import Command, Insert, Remove, Turn
from kinetile.scene.scene import Scene
from kinetile.scene.text.schema import Place

__all__ = ["read_commands", "written_commands"]

_KINDS = ("turn", "insert", "remove")


def read_commands(tables: Mapping[str, Any], faults: set[Place], mistakes: list[Mistake]) -> list[Command]:
    """Return the commands of a file's tables; append those that say not what is to be done, or say it twice.

    What cannot be read is left out: it has been told.
    """
    if ("commands",) in faults:
        return []
    found: list[Command] = []
    for k, row in enumerate(tables.get("commands", ())):
        if any(place[:2] == ("commands", k) for place in faults):
            continue
        where = f"commands[{k}]"
        given = [kind for kind in _KINDS if kind in row]
        if len(given) != 1:
            said = " and ".join(given) or "none of them"
            mistakes.append(Mistake(where, said, f"one of {', '.join(_KINDS)}"))
        elif ("velocity" in row) != (given == ["turn"]):
            there = "velocity" in row
            wanted = "none beside this: that of a new body stands in insert" if there else "[vx, vy]"
            mistakes.append(Mistake(f"{where}.velocity", "a velocity" if there else "nothing", wanted))
        else:
            found.append(_command(row))
    return found


def _command(row: Mapping[str, Any]) -> Command:
    time = row["time"]
    at = tuple(row["at"]) if "at" in row else None
    if "remove" in row:
        return Remove(row["remove"], time, at)
    if "turn" in row:
        return Turn(row["turn"], time, tuple(row["velocity"]), at)
    new = {"velocity": (0.0, 0.0), "mass": 1.0, "body": -1} | row["insert"]
    place, flies = tuple(new["position"]), tuple(new["velocity"])
    return Insert(time, place, flies, new["radius"], new["mass"], new["body"], at, new.get("kind"))


def written_commands(scene: Scene, toml: Callable[[Any], str]) -> list[str]:
    """Return the lines for a scene's commands; none where all are turns that stand with their bodies.

    ``toml`` writes a value.
    """
    turns = [each for each in scene.commands if isinstance(each, Turn) and each.at is None]
    sorted_turns = sorted(turns, key=lambda turn: (turn.time, turn.body))  # as they are read with bodies
    if len(turns) == len(scene.commands) and turns == sorted_turns:
        return []
    lines = []
    for each in scene.commands:
        lines += ["", "[[commands]]", f"time = {toml(each.time)}"]
        if each.at is not None:
            lines.append(f"at = {toml(list(each.at))}")
        if isinstance(each, Remove):
            lines.append(f"remove = {toml(each.body)}")
        elif isinstance(each, Turn):
            lines += [f"turn = {toml(each.body)}", f"velocity = {toml(each.velocity)}"]
        else:
            fields = ["position", "velocity", "radius", "mass", "body"]
            fields += ["kind"] if each.kind is not None else []
            inside = ", ".join(f"{name} = {toml(getattr(each, name))}" for name in fields)
            lines.append(f"insert = {{ {inside} }}")
    return lines
