"""Plan of a study: the content of its file, checked in full before anything runs.

A value of a parameter holds in every scene; each value of a list has scenes of its own. So a parameter that
takes several numbers itself, such as ``radii``, has lists in a list. All mistakes of a file are reported at
once, each with its path, and none twice: later checks omit unusable parts.
"""

import math
import os
from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from kinetile import Scene, make_scene, registry
from kinetile.errors import Mistake, SceneError, StudyError, UnknownName, one_of
from kinetile.instruments import (
    VALUES,
    Parameter,
    PluginKind,
    Value,
    abridged,
    check_observable,
    check_options,
    complete_parameters,
    holds_several,
    loads_scene,
    parameter_mistakes,
    read_phase,
    read_tables,
    read_text,
    recipe_parameters,
    shown,
)

MOST_TASKS = 200_000
"""All tasks of a study are in memory while it runs: some hundred megabytes."""

Named = tuple[PluginKind, str]


class StudyScene(NamedTuple):
    """A scene of a study, and the end of its runs: a time, a number of contacts, or whichever comes first.
    ``name`` is the recipe, or the file with ``content`` then; ``parameters`` are all of the recipe's.
    ``named`` is the recipe, or all plugins that a file names besides a broad phase."""

    name: str
    parameters: Mapping[str, Any]
    until: float | None
    contacts: int | None
    named: tuple[Named, ...]
    content: str | None = None

    def make(self) -> Scene:
        """Returns the scene from the file's text, or from the recipe."""
        if self.content is None:
            return make_scene(self.name, **self.parameters)
        return loads_scene(self.content, self.name)


class StudyPlan(NamedTuple):
    """The content of a study: every phase on every scene, ``repeats`` times, with these observables;
    ``results`` is the file of the rows, if the study names one."""

    scenes: tuple[StudyScene, ...]
    phases: tuple[str, ...]
    repeats: int
    observe: tuple[str, ...]
    results: Path | None


Keys = Mapping[str, Value]
"""Keys of a table, and the requirement on each value."""


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and value.isprintable() and bool(value)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_count(value: Any, most: int = 2**63 - 1) -> bool:
    return _is_whole(value) and 1 <= value <= most


def _is_list(value: Any, check: Callable[[Any], bool] = _is_text) -> bool:
    return isinstance(value, list | tuple | range) and len(value) > 0 and all(map(check, value))


_END: Keys = {"until": VALUES["until"], "contacts": Value("a whole number, at least 1", fit=_is_count)}
STUDY_KEYS: Keys = {
    "phases": Value('a list of broad phases, such as ["naive", "sap-1d:axis=y"]', fit=_is_list),
    "scenes": Value("[[scenes]] tables", fit=lambda value: _is_list(value, lambda _: True)),
    "seeds": Value(
        "how many seeds from 1 on, or a list of whole numbers, each once",
        fit=lambda value: (
            _is_count(value, MOST_TASKS) or (_is_list(value, _is_whole) and len({*value}) == len(value))
        ),
    ),
    "repeats": Value("a whole number, at least 1", fit=_is_count),
    "observe": Value('a list of observables, such as ["pressure", "msd:every=0.1"]', fit=_is_list),
    "results": Value("the name of a file, from the study's folder on, or an absolute path", fit=_is_text),
    **_END,
}
SCENE_KEYS: Keys = {
    "recipe": Value("the name of a recipe", fit=_is_text),
    "file": Value("the name of a scene file", fit=_is_text),
    "parameters": Value("a table of the recipe's parameters", fit=lambda value: isinstance(value, Mapping)),
    **_END,
}


def read_plan_file(path: str | os.PathLike[str]) -> StudyPlan:
    """Reads a study from a TOML file. Raises OSError, and StudyError with every mistake in it."""
    source = os.fspath(path)
    try:
        tables = read_tables(read_text(path), source)
    except SceneError as error:  # the reader of TOML for scenes
        raise StudyError(error.mistakes, source) from error
    return read_plan(tables, source)


def read_plan(tables: Mapping[str, Any], source: str | None = None) -> StudyPlan:
    """Reads a study from tables; ``source`` is the name of its file. Raises StudyError."""
    reader = _Reader(tables, Path(source or "").parent)
    plan = reader.plan()
    if reader.mistakes:
        raise StudyError(abridged(reader.mistakes), source)
    return plan


class _Reader:
    """Reads the tables of a study, and collects mistakes; after one, a method's result is unusable."""

    def __init__(self, tables: Mapping[str, Any], folder: Path) -> None:
        self.mistakes: list[Mistake] = []
        self.folder = folder
        self.tables = tables
        self.given = self.usable(tables, STUDY_KEYS, "")
        self.seeds = self.given.get("seeds")
        if isinstance(self.seeds, int):
            self.seeds = range(1, self.seeds + 1)

    def wrong(self, where: str, found: str, expected: str) -> None:
        self.mistakes.append(Mistake(where, found, expected))

    def usable(self, tables: Mapping[str, Any], keys: Keys, where: str) -> dict[str, Any]:
        """Returns the values that meet the requirements of their keys."""
        found = {}
        for key, value in tables.items():
            if key not in keys:
                self.wrong(f"{where}{key}", "a key that is not known here", one_of(str(key), keys))
            elif wrong := keys[key].mistakes(value, f"{where}{key}"):
                self.mistakes += wrong
            else:
                found[key] = value
        return found

    def plan(self) -> StudyPlan:
        for key in ("phases", "scenes"):
            if key not in self.tables:
                self.wrong(key, "nothing", STUDY_KEYS[key].what)
        phases = self.texts("phases", "broad phase", _check_phase)
        observe = self.texts("observe", "observable", check_observable)
        tables = self.given.get("scenes", ())
        scenes = [scene for k, each in enumerate(tables) for scene in self.scenes(each, k)]
        seeded = any("seed" in scene.parameters for scene in scenes)
        if self.seeds is not None and not self.mistakes and not seeded:
            self.wrong("seeds", "seeds", "a recipe with a parameter 'seed', or no seeds")
        repeats = self.given.get("repeats", 1)
        size = len(scenes) * len(phases) * repeats
        if size > MOST_TASKS:
            self.wrong("scenes", f"{size:,} tasks in all", f"at most {MOST_TASKS:,}")
        results = self.given.get("results")
        return StudyPlan(tuple(scenes), phases, repeats, observe, results and self.folder / results)

    def texts(self, key: str, kind: PluginKind, check: Callable[[str], None]) -> tuple[str, ...]:
        """Returns the texts of a key, each with the name of a plugin of this kind, and options."""
        texts = self.given.get(key, ())
        found: list[tuple[str, dict[str, Any]]] = []
        for k, text in enumerate(texts):
            try:
                check(text)
                name, options = read_phase(text)
                found.append((registry().spec(kind, name).name, options))
                if found[-1] in found[:-1]:
                    self.wrong(f"{key}[{k}]", f"{shown(text)}, which is there already", "each once")
            except Exception as error:  # it may be from a plugin
                self.wrong(f"{key}[{k}]", shown(text), f"a registered {kind}: {_reason(error)}")
        return tuple(texts)

    def scenes(self, given: Any, k: int) -> list[StudyScene]:
        """Returns the scenes of one table, [] if it has mistakes."""
        where = f"scenes[{k}]"
        if not isinstance(given, Mapping):
            self.wrong(where, shown(given), "a table with a recipe, or with a file")
            return []
        table = self.usable(given, SCENE_KEYS, f"{where}.")
        if ("recipe" in given) == ("file" in given):
            found = "a recipe and a file" if "file" in given else "neither recipe nor file"
            self.wrong(where, found, "one of the two")
        elif "recipe" in table:
            return self.recipe(table, given, where)
        elif "file" in table:
            return self.file(table, given, where)
        return []

    def recipe(self, table: Any, given: Any, where: str) -> list[StudyScene]:
        """Returns the scenes of a recipe: one for each combination of the values of its parameters."""
        known, name = len(self.mistakes), table["recipe"]
        end = self.end(table, given, where, None)
        try:
            own = {each.name: each for each in recipe_parameters(name)}
        except UnknownName as error:
            self.wrong(f"{where}.recipe", shown(name), f"a recipe: {_reason(error)}")
            return []
        parameters = dict(table.get("parameters", {}))
        if self.seeds is not None and "seed" in own:
            if "seed" in parameters:
                self.wrong(f"{where}.parameters.seed", "a seed beside seeds", "one of the two")
            parameters["seed"] = list(self.seeds)
        values = {
            key: self.values(name, key, value, own.get(key), f"{where}.parameters.{key}")
            for key, value in parameters.items()
        }
        for each in parameter_mistakes(name, {}):  # the parameters without a default
            if each.where.removeprefix("parameters.") not in parameters:
                self.mistakes.append(each._replace(where=f"{where}.{each.where}"))
        size = math.prod(map(len, values.values()))
        if size > MOST_TASKS:
            self.wrong(where, f"{size:,} scenes", f"at most {MOST_TASKS:,}")
        if len(self.mistakes) > known:
            return []
        rows = (dict(zip(values, row, strict=True)) for row in product(*values.values()))
        complete = (complete_parameters(name, row) for row in rows)
        cells = (  # several numbers of a parameter become their text
            {key: ", ".join(map(repr, v)) if isinstance(v, tuple) else v for key, v in row.items()}
            for row in complete
        )
        return [StudyScene(name, row, *end, (("scene", name),)) for row in cells]

    def values(self, recipe: str, key: str, given: Any, own: Parameter | None, where: str) -> list[Any]:
        values = given if isinstance(given, list | tuple | range) else [given]
        if not values:
            self.wrong(where, "an empty list", "a value, or a list of values")
        if len({(type(each), repr(each)) for each in values}) < len(values):
            self.wrong(where, "a value that is there twice", "each value once")
        flat = values is given and not all(isinstance(each, list | tuple | str) for each in values)
        if flat and own is not None and holds_several(own):
            expected = "a list of lists, for each entry is the value of a scene of its own"
            self.wrong(where, shown(given), f"{expected}: [{shown(given)}] is one scene with all of these")
            return []
        for each in values:
            self.mistakes += [
                mistake._replace(where=where)
                for mistake in parameter_mistakes(recipe, {key: each})
                if mistake.where == f"parameters.{key}"
            ]
        return list(values)

    def file(self, table: Any, given: Any, where: str) -> list[StudyScene]:
        """Returns the scene of a file, with its text: workers need not see the file."""
        name, place = table["file"], f"{where}.file"
        if "parameters" in given:
            self.wrong(f"{where}.parameters", "parameters of a file", "parameters of a recipe")
        try:
            text = read_text(self.folder / name)
            scene = loads_scene(text, name)
        except OSError as error:
            reason = f"{shown(name)}, which cannot be read ({error.strerror or error})"
            self.wrong(place, reason, SCENE_KEYS["file"].what)
            return []
        except SceneError as error:
            self.mistakes += [each._replace(where=f"{place}: {each.where}") for each in error.mistakes]
            return []
        end = self.end(table, given, where, scene.settings.until)
        named: list[Named] = [("response", each.name) for _, each in scene.responses]
        named += [("narrow phase", each) for each in scene.settings.narrow_phases or ()]
        named += [("scene", each) for key, each in scene.origin.items() if key == "recipe"]
        return [StudyScene(name, {}, *end, tuple(dict.fromkeys(named)), text)]

    def end(self, table: Any, given: Any, where: str, own: float | None) -> tuple[float | None, int | None]:
        """Returns until and contacts: the table's, the study's, or, without both, the scene's own."""
        until, contacts = (table.get(key, self.given.get(key)) for key in _END)
        until = own if until is None and contacts is None else until
        if until is None and contacts is None and not _END.keys() & {*given, *self.tables}:
            self.wrong(f"{where}.until", "nothing", "until or contacts, here or for all scenes")
        return None if until is None else float(until), contacts


def _check_phase(text: str) -> None:
    """Raises an error, of any kind, unless a broad phase has this name, and can use these options."""
    name, options = read_phase(text)
    phase = registry().target("broad phase", name)
    check_options("broad phase", name, phase, options)
    phase(**options)


def _reason(error: Exception) -> str:
    return " ".join(str(error).splitlines())
