"""Scenes as files: readable TOML that keeps every bit of a saved scene.

A file either lists its bodies, with the turns of each under it, or names a recipe and its parameters; it
may also have settings of the run. Reading has three steps, so that every mistake in a file is
reported at once: the syntax (``kinetile.scene.schema``), the keys and the types (pydantic), and the values
(the same checks that every Scene passes). A part that fails one step is left out of the next; the
rest continues.

Floats are written by ``repr``, the shortest text that reads back as the same bits, -0.0 and the smallest
denormal included. A file is replaced in one step: a reader sees the old scene or the new one, and a
full disk loses neither.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetile.errors import BadOption, Mistake, SceneError, printable
from kinetile.kernel.clock import Clock
from kinetile.scene.bodies import check_bodies
from kinetile.scene.checks import (
    ANY,
    WALL,
    Extent,
    abridged,
    check_frame,
    check_periodic,
    check_turn,
    is_kind,
    shown,
)
from kinetile.scene.commands import Command, Insert, Remove, Turn, kinds_of_inserted
from kinetile.scene.obstacles import Obstacle, polyline, with_obstacles
from kinetile.scene.responses import Pair, Response, read_rules
from kinetile.scene.scene import Scene, Settings, check_end, relabelled, with_commands
from kinetile.scene.schema import Place, expected, find_faults, read_bytes, read_tables, written
from kinetile.scene.shape_files import read_shapes, shape_row
from kinetile.scene.targets import replacing, writable_target

if TYPE_CHECKING:
    from kinetile.scene.by_name import Registered

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def read_file(path: str | os.PathLike[str], names: Registered, max_bytes: int | None = None) -> Scene:
    """Reads a scene from a TOML file of at most ``max_bytes`` (see ``load_scene``).

    Raises OSError if the file cannot be read, and SceneError, with every mistake in it, if it is no scene.
    """
    data = read_bytes(path, max_bytes)
    source = os.fspath(path)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        mistake = Mistake(
            f"line {line}", f"bytes that are not UTF-8 ({error.reason})", "a TOML file in UTF-8"
        )
        raise SceneError([mistake], source) from error
    return read_text(text, source, names)


def read_text(text: str, source: str | None, names: Registered) -> Scene:
    """Reads a scene from TOML text; ``source`` is what messages call it. Raises SceneError."""
    text = text.removeprefix("\ufeff")
    tables = read_tables(text, source)
    mistakes, faults = find_faults(tables)
    settings = _read_settings(tables, faults, mistakes, names)
    scene = None
    try:
        if "recipe" in tables:
            scene = _follow_recipe(tables, faults, mistakes, names)
        else:
            scene = _read_bodies(tables, faults, mistakes, names)
    except SceneError as error:
        mistakes += error.mistakes
    if scene is not None:
        scene = _with_polylines(scene, tables, faults, mistakes)
        mistakes += check_end(settings, Clock(scene.start, scene.time_unit))
    if mistakes or scene is None:
        raise SceneError(abridged(mistakes), source)
    origin = {**scene.origin, "file": source} if source is not None else scene.origin
    return relabelled(scene, settings=settings, origin=origin)


def save_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Writes a scene to a TOML file, from which ``load_scene`` makes an equal one.

    The text goes to a new file in the same folder, which then replaces the old one. Raises OSError
    if it cannot be written (the old file stays), and BadOption for an option that TOML has no form
    for. A link is followed; only regular files are replaced.
    """
    text = dumps_scene(scene)
    target = writable_target(path)
    with replacing(target) as file:
        file.write(text.encode())
        with suppress(FileNotFoundError):
            shutil.copymode(target, file.name)


def dumps_scene(scene: Scene) -> str:
    """Returns a scene as TOML text. Raises BadOption for an option that TOML has no form for."""
    settings = scene.settings
    lines = []
    if "recipe" in scene.origin:
        made = f"made by the recipe {scene.origin['recipe']!r}: {scene.origin.get('parameters', {})!r}"
        lines.append(f"# {printable(made)}")
    head = {
        "arena": scene.arena,
        "periodic": scene.periodic or None,
        "unit": scene.unit,
        "start": scene.start if repr(scene.start) != "0.0" else None,
        "until": settings.until,
        "end": settings.end,
        "broad-phase": settings.broad_phase,
        "narrow-phases": settings.narrow_phases,
        "kinds": scene.kinds if scene.declares_kinds else None,
    }
    lines += [f"{key} = {_toml(value)}" for key, value in head.items() if value is not None]
    if not len(scene):
        lines.append("bodies = []")
    for phase, options in settings.options.items():
        lines += ["", f"[options.{_key(phase)}]"]
        lines += [f"{_key(key)} = {_toml(value, f'options.{phase}.{key}')}" for key, value in options.items()]
    for shape in scene.shapes:
        lines += ["", "[[shapes]]", f"kind = {_toml(shape.kind)}"]
        lines += [f"{key} = {_toml(value)}" for key, value in shape_row(shape).items()]
    commands = _written_commands(scene)
    turns: dict[int, list[Turn]] = {}
    for turn in () if commands else scene.turns:
        turns.setdefault(turn.body, []).append(turn)
    columns = [column.tolist() for column in (scene.position, scene.velocity, scene.radius, scene.mass)]
    for body, (position, velocity, radius, mass) in enumerate(zip(*columns, strict=True)):
        lines += ["", "[[bodies]]", f"position = {_toml(position)}", f"velocity = {_toml(velocity)}"]
        shape = scene.shape[body].item()
        lines.append(f"radius = {_toml(radius)}" if shape < 0 else f"shape = {shape}")
        if mass != 1.0:
            lines.append(f"mass = {_toml(mass)}")
        if scene.kinds != (0,):
            lines.append(f"kind = {_toml(scene.kind[body])}")
        for turn in turns.get(body, ()):
            lines += ["", "[[bodies.turns]]", f"time = {_toml(turn.time)}"]
            lines.append(f"velocity = {_toml(turn.velocity)}")
    text = "\n".join([*lines, *commands, *_written_responses(scene), ""])
    try:
        text.encode()
    except UnicodeEncodeError as error:
        odd = shown(error.object[error.start : error.end])
        raise BadOption(f"the scene has {odd} in an option, text that no file can hold") from error
    return text


def _with_polylines(
    scene: Scene, tables: Mapping[str, Any], faults: set[Place], mistakes: list[Mistake]
) -> Scene:
    """Returns the scene with the obstacles of a file; appends the mistakes that prevent it."""
    if any(place[0] == "obstacles" for place in faults):
        return scene
    found: list[Obstacle] = []
    for k, row in enumerate(tables.get("obstacles", ())):
        try:
            found += polyline(**row)
        except SceneError as error:
            mistakes += [each._replace(where=f"obstacles[{k}].{each.where}") for each in error.mistakes]
    try:
        return with_obstacles(scene, found)
    except SceneError as error:
        mistakes += error.mistakes
    return scene


def _read_settings(
    tables: Mapping[str, Any], faults: set[Place], mistakes: list[Mistake], names: Registered
) -> Settings:
    """Returns the settings of the file; appends the phases that do not exist."""
    usable = {key: value for key, value in tables.items() if (key,) not in faults}
    broad: str | None = usable.get("broad-phase")
    narrow: list[str] | None = usable.get("narrow-phases")
    if broad is not None:
        mistakes += names.mistakes("broad-phase", broad, "broad phase")
    for k, name in enumerate(narrow or ()):
        mistakes += names.mistakes(f"narrow-phases[{k}]", name, "narrow phase")
    options = usable.get("options", {})
    for name, given in options.items():
        unknown = names.mistakes(f"options.{name}", name, "broad phase", "narrow phase")
        mistakes += unknown
        if not unknown and ("options", name) not in faults:
            mistakes += names.option_mistakes(name, given)
    narrow_phases = None if narrow is None else tuple(narrow)
    return Settings(broad, narrow_phases, options, usable.get("until"), usable.get("end"))


def _follow_recipe(
    tables: Mapping[str, Any], faults: set[Place], mistakes: list[Mistake], names: Registered
) -> Scene | None:
    """Returns the scene of the file's recipe; appends the mistakes that prevent it."""
    name, parameters = tables["recipe"], tables.get("parameters", {})
    known = ("recipe",) not in faults and not names.mistakes("recipe", name, "scene")
    taken = names.parameters(name) if known else ()
    odd = {mistake.where for mistake in mistakes}
    for key in tables:
        beside = key in ("arena", "periodic", "start", "bodies", "unit", "shapes")
        if key in taken and (beside or key in odd):
            mistakes[:] = [mistake for mistake in mistakes if mistake.where != key]
            wanted = f"it in the table [parameters]: it is a parameter of the recipe {name!r}"
            mistakes.append(Mistake(key, f"{key} beside a recipe", wanted))
        elif beside:
            wanted = "one of the two: the recipe makes them all"
            mistakes.append(Mistake(key, f"{key} beside a recipe", wanted))
    if faults & {("recipe",), ("parameters",)}:
        return None
    wrong = names.mistakes("recipe", name, "scene") or names.parameter_mistakes(name, parameters)
    if not wrong:
        try:
            scene = names.make(name, parameters)
        except BadOption as error:
            wrong = [Mistake("parameters", shown(parameters), f"what the recipe can use: {error}")]
        else:
            until = None if ("until",) in faults else tables.get("until")
            wrong = check_frame(None, scene.start, until)
            commands = _read_commands(tables, faults, wrong)
            responses = _read_responses(tables, faults, wrong, names)
            kinds = None if ("kinds",) in faults else tables.get("kinds")
            if not wrong and (commands or responses or kinds):
                return with_commands(scene, [*scene.commands, *commands], responses, kinds)
            if not wrong:
                return scene
    mistakes += wrong
    return None


def _read_bodies(
    tables: Mapping[str, Any], faults: set[Place], mistakes: list[Mistake], names: Registered
) -> Scene | None:
    """Returns the scene of the file's bodies; appends all of their mistakes."""
    if "parameters" in tables:
        mistakes.append(Mistake("parameters", "parameters without a recipe", "a recipe beside them, by name"))
    rows = [] if ("bodies",) in faults else tables["bodies"]
    columns, unknown = _columns(rows, faults)
    table = read_shapes(tables, rows, faults, mistakes)
    if table is not None:
        columns["radius"], unknown["radius"] = table.radius, table.unknown
        table = None if table.discs else table
    frame = {"arena": tables.get("arena"), "start": tables.get("start", 0.0), "until": tables.get("until")}
    off = {str(place[0]) for place in faults if len(place) == 1}
    framed = check_frame(**frame, unknown=off)
    framed += check_periodic(tables.get("periodic", ""), "arena" in tables) if "periodic" not in off else []
    off |= {mistake.where for mistake in framed}
    periodic = "" if "periodic" in off else tables.get("periodic", "")
    arena = None if "arena" in off or frame["arena"] is None else tuple(frame["arena"])
    mistakes += framed
    responses = _read_responses(tables, faults, mistakes, names)
    commands = _read_commands(tables, faults, mistakes)
    kinds = None if ("kinds",) in faults else tables.get("kinds")
    kind = [None if ("bodies", i) in faults else row.get("kind") for i, row in enumerate(rows)]
    whole = not any(place[0] in ("bodies", "commands", "kinds") for place in faults)
    coming = kinds_of_inserted(commands)
    rules = read_rules(kind, responses, len(rows), coming, mistakes, kinds, whole)
    sides = None if arena is None else Extent(arena, periodic)
    mistakes += check_bodies(
        **columns, extent=sides, unknown=unknown, passing=(rules.kind, rules.passing), table=table
    )
    turns = []
    for i, row in enumerate(rows):
        for place, turn in _turns(i, row, faults):
            start = None if "start" in off else float(frame["start"])
            unread = [key for key in ("time", "velocity") if (*place, key) in faults]
            mistakes += check_turn(turn, written(place), len(rows), start, unread)
            turns.append(turn)
    if mistakes:
        return None
    rest: dict[str, Any] = {"unit": tables.get("unit"), "kind": kind, "responses": responses, "kinds": kinds}
    rest["periodic"] = periodic
    if table is not None:
        columns["radius"] = None
        rest |= {"shape": table.index, "shapes": table.shapes}
    return Scene(**columns, arena=arena, turns=turns, start=frame["start"], commands=commands, **rest)


def _columns(rows: list[Any], faults: set[Place]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Returns the arrays of the bodies, and for each which of its values are unreadable: those are NaN."""
    columns, unknown = {}, {}
    defaults = {"position": None, "velocity": (0.0, 0.0), "radius": None, "mass": 1.0}
    for key, default in defaults.items():
        blank: Any = (np.nan, np.nan) if key in ("position", "velocity") else np.nan
        bad = [("bodies", i) in faults or ("bodies", i, key) in faults for i in range(len(rows))]
        values = [blank if bad[i] else row.get(key, default) for i, row in enumerate(rows)]
        unknown[key] = np.array(bad, dtype=np.bool_)
        columns[key] = np.array(values, dtype=np.float64).reshape((len(rows), *np.shape(blank)))
    return columns, unknown


def _turns(body: int, row: Any, faults: set[Place]) -> Iterator[tuple[Place, Turn]]:
    """Yields the turns of one body, with their places; unreadable values are NaN."""
    if ("bodies", body) in faults or ("bodies", body, "turns") in faults:
        return
    for k, turn in enumerate(row.get("turns", ())):
        place = ("bodies", body, "turns", k)
        if place not in faults:
            time = np.nan if (*place, "time") in faults else turn["time"]
            velocity = (np.nan, np.nan) if (*place, "velocity") in faults else tuple(turn["velocity"])
            yield place, Turn(body, time, velocity)


def _key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else _quoted(key)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _toml(value: Any, where: str = "") -> str:
    """Returns a value as TOML; raises BadOption if it has no form there."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_toml(each, where) for each in value)}]"
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(key)} = {_toml(each, where)}' for key, each in value.items())} }}"
    raise BadOption(f"{where} is {shown(value)}; expected a number, text, a list or a table to write to TOML")


_KINDS = ("turn", "insert", "remove")


def _read_commands(tables: Mapping[str, Any], faults: set[Place], mistakes: list[Mistake]) -> list[Command]:
    """Returns the commands of a file's tables; appends to ``mistakes`` those with no action or several.

    Unreadable commands are left out: their mistakes are there already.
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


def _written_commands(scene: Scene) -> list[str]:
    """Returns the lines for a scene's commands; none if all are turns that are written with their bodies."""
    turns = [each for each in scene.commands if isinstance(each, Turn) and each.at is None]
    sorted_turns = sorted(turns, key=lambda turn: (turn.time, turn.body))  # as they are read with bodies
    if len(turns) == len(scene.commands) and turns == sorted_turns:
        return []
    lines = []
    for each in scene.commands:
        lines += ["", "[[commands]]", f"time = {_toml(each.time)}"]
        if each.at is not None:
            lines.append(f"at = {_toml(list(each.at))}")
        if isinstance(each, Remove):
            lines.append(f"remove = {_toml(each.body)}")
        elif isinstance(each, Turn):
            lines += [f"turn = {_toml(each.body)}", f"velocity = {_toml(each.velocity)}"]
        else:
            fields = ["position", "velocity", "radius", "mass", "body"]
            fields += ["kind"] if each.kind is not None else []
            inside = ", ".join(f"{name} = {_toml(getattr(each, name))}" for name in fields)
            lines.append(f"insert = {{ {inside} }}")
    return lines


def _read_responses(
    tables: Mapping[str, Any], faults: set[Place], mistakes: list[Mistake], names: Registered
) -> dict[Pair, Response]:
    """Returns the rules of a file's tables; appends their mistakes. Unreadable rules are left
    out."""
    if ("responses",) in faults:
        return {}
    found: dict[Pair, Response] = {}
    for number, row in enumerate(tables.get("responses", ())):
        if any(place[:2] == ("responses", number) for place in faults):
            continue
        where = f"responses[{number}]"
        name, options = row["response"], row.get("options", {})
        wrong = names.mistakes(f"{where}.response", name, "response")
        wrong = wrong or names.option_mistakes(name, options, f"{where}.options")
        pair: Pair = (row["between"][0], row["between"][1])
        if not all(is_kind(each) or each in (WALL, ANY) for each in pair):
            place = ("responses", number, "between")
            mistakes.append(Mistake(f"{where}.between", shown(row["between"]), expected(place)))
            continue
        response = Response(name, **options)
        response.found = True  # or its mistake is reported here, in the place of the file
        if found.setdefault(pair, response) != response:
            wrong.append(
                Mistake(f"{where}.between", repr(list(pair)), "two kinds that nothing is said of yet")
            )
        mistakes += wrong
    return found


def _written_responses(scene: Scene) -> list[str]:
    """Returns the lines for a scene's responses."""
    lines = []
    for pair, response in scene.responses:
        lines += ["", "[[responses]]", f"between = {_toml(list(pair))}", f"response = {_toml(response.name)}"]
        if response.options:
            lines.append(f"options = {_toml(response.options, f'responses.{response.name}')}")
    return lines
