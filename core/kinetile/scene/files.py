"""Scenes as files: readable TOML that keeps every bit of a saved scene.

A file lists its bodies, each with its turns, or names a recipe and its parameters, and may have settings of
the run. Reading has three steps: the syntax, the keys and the types (``kinetile.scene.schema``), and the
values (``kinetile.scene.reader``). Each step leaves out the faults of the step before, so every mistake is
reported at once. Floats, written by ``repr``, are read back bit for bit. A file is replaced in one step.
"""

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kinetile.arrays import Flags, Integers
from kinetile.errors import BadOption, Mistake, SceneError, answering, printable
from kinetile.kernel.clock import Clock
from kinetile.plugin.specs import PluginKind as PluginKind
from kinetile.scene.by_name import accepted_parameters, known_options, make_scene, parameter_mistakes
from kinetile.scene.checks import abridged, check_name, option_mistakes, read_count, shown
from kinetile.scene.commands import COMMAND_KINDS, OF_CLASS, Command, Insert, Turn
from kinetile.scene.frame import check_frame
from kinetile.scene.reader import FilePlaces, Given
from kinetile.scene.responses import Response, Rule
from kinetile.scene.scene import Scene, arguments_of, declared_kinds, relabelled, scene_of
from kinetile.scene.schema import (
    MOST_BYTES,
    UNKNOWN,
    KeyPath,
    expected,
    find_faults,
    read_tables,
    read_text,
    written,
)
from kinetile.scene.settings import Settings, check_end
from kinetile.scene.shapes import Obstacle, Shape, polyline, read_shape, shape_row
from kinetile.scene.values import VALUES
from kinetile.targets import write_file

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


@answering
def load_scene(path: str | os.PathLike[str], *, max_bytes: int = MOST_BYTES) -> Scene:
    """Reads a scene from a TOML file, a regular one of at most ``max_bytes`` (64 MiB). Raises OSError if it
    cannot be read, and SceneError, with every mistake in it, if it is no scene."""
    return loads_scene(read_text(path, read_count(max_bytes, "max_bytes", "bytes")), os.fspath(path))


def loads_scene(text: str, source: str | None = None, *, look_up: bool = True) -> Scene:
    """Reads a scene from TOML text; ``source`` is its name in messages. Raises SceneError. Without
    ``look_up``, phases and responses may have any name and options, and a recipe is refused."""
    file = _File(text.removeprefix("\ufeff"), source, look_up)
    return file.scene_of_recipe() if "recipe" in file.tables else file.scene_of_bodies()


@answering
def save_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Writes a scene to a TOML file that ``load_scene`` reads as an equal scene; a link is followed. Raises
    OSError if it cannot be written (the old file stays) or is not regular, and BadOption for an option
    without a form in TOML."""
    write_file(path, dumps_scene(scene))


@answering
def dumps_scene(scene: Scene) -> str:
    """Returns a scene as TOML text. Raises BadOption for an option without a form in TOML."""
    settings = scene.settings
    lines = []
    if "recipe" in scene.origin:
        made = f"made by the recipe {scene.origin['recipe']!r}: {scene.origin.get('parameters', {})!r}"
        lines.append(f"# {printable(made)}")
    head = {
        "arena": scene.arena,
        "periodic": scene.periodic or None,
        "gravity": scene.gravity if any(scene.gravity) else None,
        "unit": scene.unit,
        "start": scene.start if repr(scene.start) != "0.0" else None,
        "until": settings.until,
        "end": settings.end,
        "broad-phase": settings.broad_phase,
        "narrow-phases": settings.narrow_phases,
        "kinds": declared_kinds(scene),
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
    lines += [*_written_bodies(scene, () if commands else scene.turns), *commands]
    for pair, response in scene.responses:
        lines += ["", "[[responses]]", f"between = {_toml(list(pair))}", f"response = {_toml(response.name)}"]
        if response.options:
            lines.append(f"options = {_toml(response.options, f'responses.{response.name}')}")
    text = "\n".join([*lines, ""])
    try:
        text.encode()
    except UnicodeEncodeError as error:
        odd = shown(error.object[error.start : error.end])
        raise BadOption(f"the scene has {odd} in an option, text that no file can hold") from error
    return text


def _written_bodies(scene: Scene, turns: Iterable[Turn]) -> list[str]:
    """Returns the lines of the bodies, each with the lines of its turns."""
    lines: list[str] = []
    turns_of: dict[int, list[Turn]] = {}
    for turn in turns:
        turns_of.setdefault(turn.body, []).append(turn)
    own = scene.own_acceleration
    columns = [column.tolist() for column in (scene.position, scene.velocity, scene.radius, scene.mass)]
    for body, (position, velocity, radius, mass) in enumerate(zip(*columns, strict=True)):
        lines += ["", "[[bodies]]", f"position = {_toml(position)}", f"velocity = {_toml(velocity)}"]
        shape = scene.shape[body].item()
        lines.append(f"radius = {_toml(radius)}" if shape < 0 else f"shape = {shape}")
        if mass != 1.0:
            lines.append(f"mass = {_toml(mass)}")
        if scene.names and scene.names[body] is not None:
            lines.append(f"name = {_toml(scene.names[body])}")
        if scene.kinds != (0,):
            lines.append(f"kind = {_toml(scene.kind[body])}")
        if own is not None and not np.isnan(own[body]).any():
            lines.append(f"acceleration = {_toml(own[body].tolist())}")
        for turn in turns_of.get(body, ()):
            lines += ["", "[[bodies.turns]]", f"time = {_toml(turn.time)}"]
            lines.append(f"velocity = {_toml(turn.velocity)}")
    return lines


_PHASES: tuple[PluginKind, ...] = ("broad phase", "narrow phase")


class _File:
    """A scene file: its tables, the places of unusable values, and the mistakes found so far."""

    def __init__(self, text: str, source: str | None, look_up: bool) -> None:
        self.source, self.look_up = source, look_up
        self.tables = read_tables(text, source)
        self.mistakes, self.faults = find_faults(self.tables)
        self.settings = self._settings()

    def scene_of_recipe(self) -> Scene:
        name, parameters = self.tables["recipe"], self.tables.get("parameters", {})
        wrong = [] if ("recipe",) in self.faults else self._unknown("recipe", name, "scene")
        known = not wrong and ("recipe",) not in self.faults
        taken = [each.name for each in accepted_parameters(name)] if known else []
        odd = self._odd()
        for key in self.tables:
            beside = key in ("arena", "periodic", "gravity", "start", "bodies", "unit", "shapes")
            tables = key == "bodies" and isinstance(self.tables[key], list)
            if key in taken and (beside or key in odd) and not tables:
                wanted = f"it in the table [parameters]: it is a parameter of the recipe {name!r}"
                self._instead(key, f"{key} beside a recipe", wanted)
            elif beside:
                wanted = "one of the two: the recipe makes them all, and [[commands]] insert more"
                self.mistakes.append(Mistake(key, f"{key} beside a recipe", wanted))
        if known and ("parameters",) not in self.faults:
            wrong = parameter_mistakes(name, parameters)
            if not wrong:
                return self._with_additions(self._made(name, parameters))
        raise self._error(wrong)

    def _made(self, name: str, parameters: Mapping[str, Any]) -> Scene:
        try:
            return make_scene(name, **parameters)
        except SceneError as error:
            raise self._error(error.mistakes) from error
        except BadOption as error:
            wanted = f"what the recipe can use: {error}"
            raise self._error([Mistake("parameters", shown(parameters), wanted)]) from error

    def _with_additions(self, scene: Scene) -> Scene:
        commands, responses, obstacles = self._commands(), self._responses(), self._obstacles()
        kinds, until, origin = self._usable("kinds"), self._usable("until"), self._origin(scene.origin)
        if until is None:  # the recipe may have an end
            self.settings = replace(self.settings, until=scene.settings.until)
        if not (commands or responses or kinds or obstacles):
            clock = Clock(scene.start, scene.time_unit)
            wrong = check_frame(None, scene.start, until) or check_end(self.settings, clock)
            if self.mistakes or wrong:
                raise self._error(wrong)
            return relabelled(scene, settings=self.settings, origin=origin)
        given = arguments_of(scene)._replace(settings=self.settings, origin=origin, until=until)
        if commands or responses or kinds:
            given = given._replace(unit=scene.time_unit, kinds=kinds or given.kinds)
        message = [[*rule.between] for rule in responses]
        rules = [
            Rule(f"responses[{pair!r}]", pair, response)
            for pair, response in scene.responses
            if [*pair] not in message and [*pair[::-1]] not in message
        ]
        made = [(f"recipe.commands[{k}]", each) for k, each in enumerate(scene.commands)]
        given = given._replace(responses=(*rules, *responses), obstacles=obstacles)
        return self._scene_of(given, [], [*made, *commands], {})

    def scene_of_bodies(self) -> Scene:
        if "parameters" in self.tables:
            wanted = "a recipe beside them, by name"
            self.mistakes.append(Mistake("parameters", "parameters without a recipe", wanted))
        rows = self._usable("bodies", [])
        columns, unread = self._columns(rows)
        shapes = self._shapes()
        if any("shape" in row for _, row in self._whole(rows)):
            numbers, unread["shape"] = self._shape_numbers(rows)
            if shapes is None:
                unread["shape"][:] = True
            columns |= {"radius": None, "shape": numbers}
        columns["shapes"] = shapes or ()
        given = Given(
            **columns,
            arena=self.tables.get("arena"),
            start=self.tables.get("start", 0.0),
            until=self._usable("until"),
            settings=self.settings,
            origin=self._origin({}),
            unit=self.tables.get("unit"),
            kind=[None if ("bodies", i) in self.faults else row.get("kind") for i, row in enumerate(rows)],
            responses=tuple(self._responses()),
            kinds=self._usable("kinds"),
            periodic=self.tables.get("periodic", ""),
            gravity=self._usable("gravity"),
            names=[row.get("name") if isinstance(row, dict) else None for row in rows] or None,
            obstacles=self._obstacles(),
        )
        turns = [turn for i, row in self._whole(rows) for turn in self._turns(i, row)]
        commands = self._commands()
        if shapes is None:
            commands = [each for each in commands if getattr(each[1], "shape", None) is None]
        return self._scene_of(given, turns, commands, unread)

    def _scene_of(
        self,
        given: Given,
        turns: Sequence[tuple[str, Turn]],
        commands: Sequence[tuple[str, Command]],
        unread: Mapping[str, Flags],
    ) -> Scene:
        unread_kinds = any(place[0] in ("bodies", "kinds") for place in self.faults)
        left_out = any(each.where.startswith(("commands", "obstacles")) for each in self.mistakes)
        places = FilePlaces(
            source=self.source,
            mistakes=self.mistakes,
            faults={written(place) for place in self.faults},
            unread=unread,
            complete=not (unread_kinds or left_out),
            turns=[where for where, _ in turns],
            commands={where: OF_CLASS[type(each)].word for where, each in commands},
        )
        given = given._replace(turns=[each for _, each in turns], commands=[each for _, each in commands])
        return scene_of(given, places)

    def _error(self, wrong: Sequence[Mistake]) -> SceneError:
        return SceneError(abridged([*self.mistakes, *wrong]), self.source)

    def _origin(self, origin: Mapping[str, Any]) -> Mapping[str, Any]:
        return origin if self.source is None else {**origin, "file": self.source}

    def _odd(self) -> set[str]:
        return {mistake.where for mistake in self.mistakes if mistake.found == UNKNOWN}

    def _instead(self, where: str, found: str, wanted: str) -> None:
        self.mistakes = [mistake for mistake in self.mistakes if mistake.where != where]
        self.mistakes.append(Mistake(where, found, wanted))

    def _usable(self, key: str, default: Any = None) -> Any:
        return default if (key,) in self.faults else self.tables.get(key, default)

    def _whole(self, rows: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Yields the bodies that are tables, with their numbers."""
        return ((i, row) for i, row in enumerate(rows) if ("bodies", i) not in self.faults)

    def _rows(self, key: str) -> Iterator[tuple[int, Any]]:
        """Yields the tables of a list that have the right form throughout, with their numbers."""
        faulty = {place[1] for place in self.faults if place[0] == key and len(place) > 1}
        return ((k, row) for k, row in enumerate(self._usable(key, ())) if k not in faulty)

    def _unknown(self, where: str, name: str, *kinds: PluginKind) -> list[Mistake]:
        if self.look_up:
            return check_name(where, name, *kinds)
        return [Mistake(where, shown(name), "the bodies themselves")] if "scene" in kinds else []

    def _unfit(self, name: str, options: Mapping[str, Any], where: str, *kinds: PluginKind) -> list[Mistake]:
        return option_mistakes(name, options, where, *kinds) if self.look_up else []

    def _settings(self) -> Settings:
        broad: str | None = self._usable("broad-phase")
        narrow: list[str] | None = self._usable("narrow-phases")
        if broad is not None:
            wrong = self._unknown("broad-phase", broad, "broad phase")
            self.mistakes, broad = self.mistakes + wrong, None if wrong else broad
        for k, name in enumerate(narrow or ()):
            wrong = self._unknown(f"narrow-phases[{k}]", name, "narrow phase")
            self.mistakes, narrow = self.mistakes + wrong, None if wrong else narrow
        options = self._usable("options", {})
        named = [each for each in (broad, *(narrow or ())) if each is not None]
        of_phase = f"[options.{named[0] if named else 'NAME'}]"
        for name, given in options.items():
            where = f"options.{name}"
            wrong = self._unknown(where, name, *_PHASES)
            if ("options", name) in self.faults:
                if wrong:
                    self._instead(where, shown(given), f"it in a table of the phase, {of_phase}")
                continue
            if wrong and named:
                wrong = [each._replace(expected=f"{each.expected}; here {of_phase}") for each in wrong]
            self.mistakes += wrong or self._unfit(name, given, where, *_PHASES)
        odd = self._odd() if self.look_up else ()
        for key in (key for key in self.tables if key in odd):
            owners = [key] if not check_name("", key, *_PHASES) else []
            owners += [each for each in named if key in known_options(each, *_PHASES)]
            if owners:
                self._instead(key, "options of a phase", f"them in the table [options.{owners[0]}]")
        options = {name: given for name, given in options.items() if ("options", name) not in self.faults}
        narrow_phases = None if narrow is None else tuple(narrow)
        return Settings(broad, narrow_phases, options, self._usable("until"), self._usable("end"))

    def _columns(self, rows: Sequence[Any]) -> tuple[dict[str, Any], dict[str, Flags]]:
        """Returns the arrays of the bodies, and the flags of unreadable values of each, which are NaN."""
        columns: dict[str, Any] = {}
        unread: dict[str, Flags] = {}
        none = (np.nan, np.nan)
        defaults = {"position": None, "velocity": (0.0, 0.0), "radius": None, "mass": 1.0}
        if any("acceleration" in row for _, row in self._whole(rows)):
            defaults["acceleration"] = none
        for key, default in defaults.items():
            blank: Any = np.nan if key in ("radius", "mass") else none
            bad = [bool({("bodies", i), ("bodies", i, key)} & self.faults) for i in range(len(rows))]
            values = [blank if bad[i] else row.get(key, default) for i, row in enumerate(rows)]
            unread[key] = np.array(bad, dtype=np.bool_)
            columns[key] = np.array(values, dtype=np.float64).reshape((len(rows), *np.shape(blank)))
        return columns, unread

    def _shapes(self) -> list[Shape] | None:
        """Returns the shapes of the file, or None if some have mistakes, which are appended."""
        made = [read_shape(f"shapes[{k}]", row, self.mistakes) for k, row in self._rows("shapes")]
        kept = [each for each in made if each is not None]
        return kept if len(kept) == len(self._usable("shapes", ())) else None

    def _shape_numbers(self, rows: Sequence[Any]) -> tuple[Integers, Flags]:
        """Returns the number of each body's shape, and True for bodies with an unreadable one."""
        index, unread = np.zeros(len(rows), dtype=np.int64), np.ones(len(rows), dtype=np.bool_)
        for i, row in self._whole(rows):
            place: KeyPath = ("bodies", i, "shape")
            if place in self.faults:
                continue
            if "radius" in row:
                found = "a radius where other bodies have shapes", "the shape of this one, a disc"
                if "shape" in row:
                    found = "a radius beside a shape", "one of the two: a shape has its own size"
                self.mistakes.append(Mistake(f"bodies[{i}].radius", *found))
            elif "shape" not in row:
                self.mistakes.append(Mistake(written(place), "nothing", expected(place)))
            else:
                index[i], unread[i] = row["shape"], False
        return index, unread

    def _turns(self, body: int, row: Any) -> Iterator[tuple[str, Turn]]:
        """Yields the turns of one body, with their places; unreadable values are NaN."""
        if ("bodies", body, "turns") in self.faults:
            return
        for k, turn in enumerate(row.get("turns", ())):
            place = ("bodies", body, "turns", k)
            if place not in self.faults:
                time = np.nan if (*place, "time") in self.faults else turn["time"]
                unread = (*place, "velocity") in self.faults
                velocity = (np.nan, np.nan) if unread else tuple(turn["velocity"])
                yield written(place), Turn(body, time, velocity)

    def _obstacles(self) -> list[Obstacle]:
        found: list[Obstacle] = []
        for k, row in self._rows("obstacles"):
            if wrong := VALUES["kind"].mistakes(row.get("kind", 0), f"obstacles[{k}].kind"):
                self.mistakes += wrong
                continue
            try:
                found += polyline(**{key: row[key] for key in ("points", "closed", "kind") if key in row})
            except SceneError as error:
                wrong = [each._replace(where=f"obstacles[{k}].{each.where}") for each in error.mistakes]
                self.mistakes += wrong
        return found

    def _commands(self) -> list[tuple[str, Command]]:
        """Returns the file's commands, with places; appends a mistake for each without exactly one action."""
        found: list[tuple[str, Command]] = []
        for k, row in self._rows("commands"):
            where = f"commands[{k}]"
            given = [word for word in _WORDS if word in row]
            if len(given) != 1:
                message = " and ".join(given) or "none of them"
                self.mistakes.append(Mistake(where, message, f"one of {', '.join(_WORDS)}"))
            elif wrong := _unfit(row, where, given[0]):
                self.mistakes += wrong
            else:
                found.append((where, _command(row)))
        return found

    def _responses(self) -> list[Rule]:
        found: list[Rule] = []
        odd = self._odd()
        for k, row in self._rows("responses"):
            where, name, options = f"responses[{k}]", row["response"], row.get("options", {})
            wrong = self._unknown(f"{where}.response", name, "response")
            beside = [
                key for key in row if f"{where}.{key}" in odd and key in known_options(name, "response")
            ]
            for key in beside:
                wanted = f"it in options = {{ {_key(key)} = ... }}"
                self._instead(f"{where}.{key}", f"an option of {name!r}", wanted)
            self.mistakes += wrong or (
                [] if beside else self._unfit(name, options, f"{where}.options", "response")
            )
            response = Response(name, **options)
            response.found = True  # or its mistake is reported here, with its place in the file
            if "between" in row:
                found.append(Rule(f"{where}.between", row["between"], response))
            elif not any(each.startswith(f"{where}.") for each in odd):
                found += [Rule(where, *rule) for rule in response.for_all.items()]
        return found


def _key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else _quoted(key)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _toml(value: Any, where: str = "") -> str:
    """Returns a value as TOML; raises BadOption if TOML has no form for it."""
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


_WORDS = {each.word: each for each in COMMAND_KINDS}


def _unfit(row: Mapping[str, Any], where: str, given: str) -> list[Mistake]:
    """Returns the mistakes of a command without its velocity, acceleration or kind, or with another's."""
    mistakes = []
    for word, (key, named, form) in ((each.word, each.gives) for each in COMMAND_KINDS if each.gives):
        there = key in row
        if there != (given == word):
            wanted = "none beside this: that of a new body is in insert" if there else form
            mistakes.append(Mistake(f"{where}.{key}", named if there else "nothing", wanted))
    return mistakes


def _command(row: Mapping[str, Any]) -> Command:
    word = next(each for each in _WORDS if each in row)
    kind = _WORDS[word].made
    own = {"velocity": (0.0, 0.0)} | row[word] if kind is Insert else {"body": row[word]}
    fields = {key: value for key, value in {**row, **own}.items() if key in kind._fields}
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in fields.items()}
    made: Command = kind(**values)
    return made


def _written_commands(scene: Scene) -> list[str]:
    """Returns the lines for a scene's commands; [] if all are turns that are written with their bodies."""
    turns = [each for each in scene.commands if isinstance(each, Turn) and each.at is None]
    sorted_turns = sorted(turns, key=lambda turn: (turn.time, turn.body))  # as they are read with bodies
    if len(turns) == len(scene.commands) and turns == sorted_turns:
        return []
    lines = []
    for each in scene.commands:
        given = {key: value for key, value in each._asdict().items() if value is not None}
        lines += ["", "[[commands]]"]
        lines += [f"{key} = {_toml(given.pop(key))}" for key in ("time", "at") if key in given]
        if isinstance(each, Insert):
            number = scene.shapes.index(given.pop("shape")) if "shape" in given else None
            size = {"radius": ("radius", each.radius) if number is None else ("shape", number)}
            given = {"insert": dict(size.get(key, (key, value)) for key, value in given.items())}
        else:
            given = {OF_CLASS[type(each)].word: given.pop("body"), **given}
        lines += [f"{key} = {_toml(value)}" for key, value in given.items()]
    return lines
