"""Plan of a study: the keys of a study file, and the meaning of their values.

A file is read as scenes are: first the syntax, then the keys and the types of their values (by pydantic,
strictly), then what the values mean: ranges, recipes and their parameters, phases and their options, seeds,
ends. A part that fails one step is left out of the next, the rest continues, so one error lists every mistake
of the file, each with its place.

A range is a table: ``{ from = 10, to = 50, step = 10 }``, or ``{ from = 100, to = 10000, count = 5, scale =
"log" }``. Its numbers are computed in decimal, so that 0.1 to 0.5 by 0.1 contains exactly 0.3.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kinetile import registry
from kinetile.errors import BadOption, KinetileError, Mistake, SceneError, StudyError, one_of
from kinetile.plugin.choices import read_phase
from kinetile.run.observing import check_observable
from kinetile.scene.by_name import (
    complete_parameters,
    holds_several,
    option_mistakes,
    parameter_mistakes,
    recipe_parameters,
)
from kinetile.scene.checks import abridged, check_name, is_finite, shown
from kinetile.scene.files import loads_scene
from kinetile.scene.schema import Place, read_bytes, read_tables, written

MEASURES = {
    "timings": "the run is done again until there is enough CPU time to measure",
    "rate": "a run of so many seconds of CPU time is done, and its events and contacts a second are noted",
    "stages": "time and memory of another run are noted stage by stage, in a process of its own",
    "pairs": "candidate pairs are counted at 17 moments of the run",
    "construction": "what the static construction did is counted apart",
    "certified": "the list of contacts is checked by the specification, in exact arithmetic",
}
"""Optional measurements beside the readings, which every row has."""

AXES = ("bodies", "density")
"""The parameters that a figure's axis and a fit prefer, where a study has them."""

_Texts = Annotated[list[str], Field(min_length=1, max_length=1000)]


class _Keys(BaseModel):
    """Keys of a table; the description of a field is what messages say was expected."""

    model_config = ConfigDict(
        extra="forbid", strict=True, alias_generator=lambda name: name.replace("_", "-"), defer_build=True
    )


def _key(expected: str, **limits: Any) -> Any:
    return Field(description=expected, **limits)


_Until = Annotated[float | None, _key("a finite number")]
_Contacts = Annotated[int | None, _key("a whole number, at least 1", ge=1)]


class SceneTable(_Keys):
    """``[[scenes]]``: a recipe, with values, lists and ranges of its parameters; or a scene file."""

    recipe: Annotated[str | None, _key("the name of a recipe")] = None
    file: Annotated[str | None, _key("the name of a scene file")] = None
    parameters: Annotated[dict[str, Any], _key("a table of the recipe's parameters", max_length=100)] = {}
    together: Annotated[
        list[_Texts], _key('lists of parameters that go together, such as [["bodies", "density"]]')
    ] = []
    until: _Until = None
    contacts: _Contacts = None


class FigureTable(_Keys):
    """``[[figures]]``: a figure of the rows."""

    name: Annotated[str, _key("the name of the figure's file, without its ending")]
    kind: Annotated[Literal["lines", "shares"], _key('"lines" or "shares"')] = "lines"
    y: Annotated[str, _key("the name of a column")] = "cpu_seconds"
    x: Annotated[str | None, _key("the name of a parameter")] = None
    logarithmic: Annotated[bool, _key("true or false")] = True
    title: Annotated[str | None, _key("text")] = None


class StudyTable(_Keys):
    """A whole study file."""

    results: Annotated[str | None, _key("the name of a folder")] = None
    phases: Annotated[_Texts, _key('a list of broad phases, such as ["naive", "sap-1d:axis=y"]')]
    seeds: Any = None
    repeats: Annotated[int, _key("a whole number, at least 1", ge=1, le=1_000_000)] = 1
    until: _Until = None
    contacts: _Contacts = None
    measure: Annotated[list[str], _key(f"a list of some of {', '.join(MEASURES)}", max_length=100)] = []
    observe: Annotated[
        list[str], _key('a list of observables, such as ["pressure", "msd:every=0.1"]', max_length=100)
    ] = []
    seconds: Annotated[
        float, _key("a number greater than 0, at most 3600", gt=0, le=3600, allow_inf_nan=False)
    ] = 0.05
    limit: Annotated[float | None, _key("CPU seconds, greater than 0", gt=0, allow_inf_nan=False)] = None
    scenes: Annotated[list[SceneTable], _key("[[scenes]] tables", min_length=1, max_length=1000)]
    figures: Annotated[list[FigureTable], _key("[[figures]] tables", max_length=100)] = []


_MOST = 100_000
"""How many values a list or range may have."""

_FORM = "{ from, to, step } or { from, to, count, scale }"
_Finite = Annotated[float, _key(f"a finite number, as in {_FORM}", allow_inf_nan=False)]


class RangeTable(_Keys):
    """A range; its model has the names of its keys, of which one is a word of Python."""

    model_config = ConfigDict(alias_generator=lambda name: name.removesuffix("_"))

    from_: _Finite
    to: _Finite
    step: _Finite = 1
    count: Annotated[int | None, _key(f"a whole number from 2 to {_MOST:,}", ge=2, le=_MOST)] = None
    scale: Annotated[Literal["linear", "log"], _key('"linear" or "log"')] = "linear"


def find_faults(
    tables: Mapping[str, Any], model: type[_Keys] = StudyTable
) -> tuple[list[Mistake], set[Place]]:
    """Compares tables with a model.

    Returns the mistakes, and the places of the values that are missing or of a wrong type, and so unusable.
    """
    try:
        model.model_validate(tables)
        return [], set()
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)
    mistakes: dict[Place, Mistake] = {}
    faults: set[Place] = set()
    for detail in found:
        kind, place = detail["type"], detail["loc"]
        if kind == "extra_forbidden":
            expected = one_of(str(place[-1]), _fields(model, place))
            mistakes[place] = Mistake(written(place), "a key that is not known here", expected)
            continue
        while isinstance(place[-1], int) and (len(place) > 2 or place[0] not in ("scenes", "figures")):
            place = place[:-1]  # the whole list is meant, not its second entry
        faults.add(place)
        expected = "a table" if isinstance(place[-1], int) else _fields(model, place)[str(place[-1])]
        value = "nothing" if kind == "missing" else shown(_at(tables, place))
        mistakes[place] = Mistake(written(place), value, expected)
    return list(mistakes.values()), faults


def _fields(model: type[_Keys], place: Place) -> dict[str, str]:
    """Returns the keys of the table in which ``place`` ends, each with what is expected there."""
    if len(place) > 1:
        model = SceneTable if place[0] == "scenes" else FigureTable
    return {field.alias or name: field.description or "" for name, field in model.model_fields.items()}


def _at(tables: Any, place: Place) -> Any:
    for step in place:
        tables = tables[step]
    return tables


def values_of(given: Any, where: str, mistakes: list[Mistake], *, whole: bool = False) -> list[Any]:
    """Returns the given values of a parameter; appends their mistakes.

    ``whole``: numbers of a logarithmic range are rounded to whole ones.
    """
    if isinstance(given, Mapping):
        return _range(given, where, mistakes, whole)
    if not isinstance(given, list):
        return [given]
    if not given:
        mistakes.append(Mistake(where, "an empty list", f"a value, a list of values, or a range {_FORM}"))
    if len(given) > _MOST:
        mistakes.append(Mistake(where, f"{len(given):,} values", f"at most {_MOST:,}"))
        return []
    kept = list({(type(each), repr(each)): each for each in given}.values())
    if len(kept) < len(given):
        mistakes.append(Mistake(where, "a value that is there twice", "each value once"))
    return kept


def _cell(value: Any) -> Any:
    """Returns a parameter's value as a row has it: several numbers are the text that means them."""
    return ", ".join(map(repr, value)) if isinstance(value, tuple) else value


def _range(given: Mapping[str, Any], where: str, mistakes: list[Mistake], whole: bool) -> list[Any]:
    known = len(mistakes)

    def wrong(key: str, found: str, expected: str) -> None:
        mistakes.append(Mistake(where + key, found, expected))

    mistakes += [each._replace(where=f"{where}.{each.where}") for each in find_faults(given, RangeTable)[0]]
    if "step" in given and {"count", "scale"} & given.keys():
        wrong("", "step beside count or scale", f"one of {_FORM}")
    if len(mistakes) > known:
        return []
    first, last = Fraction(repr(given["from"])), Fraction(repr(given["to"]))
    count: Any = given.get("count")
    logarithmic = given.get("scale") == "log"
    ends = f"from {given['from']!r} to {given['to']!r}"
    if first >= last or (logarithmic and first <= 0):
        wrong("", ends, "from below to" + (", both above 0" if logarithmic else ""))
        return []
    if logarithmic:
        ratio = float(last) / float(first)
        if count is None:
            wrong(".count", "nothing", "a whole number: how many values there are")
        elif not math.isfinite(ratio):
            wrong("", ends, "numbers whose ratio is at most 1.8e308")
        if len(mistakes) > known:
            return []
        numbers = [float(first) * math.pow(ratio, k / (count - 1)) for k in range(count - 1)] + [float(last)]
        return list(dict.fromkeys(map(round, numbers))) if whole else numbers
    step = Fraction(repr(given.get("step", 1))) if count is None else (last - first) / (count - 1)
    if step <= 0 or (last - first) / step >= _MOST:
        wrong(".step", shown(given.get("step")), f"at most {_MOST:,} steps upwards")
        return []
    exact = [first + k * step for k in range(math.floor((last - first) / step) + 1)]
    integers = all(isinstance(given.get(key, 1), int) for key in ("from", "to", "step"))
    return [int(each) if integers and each.denominator == 1 else float(each) for each in exact]


_MOST_TASKS = 200_000
"""All tasks of a study are in memory while it runs: some hundred megabytes."""

_CONTROL = re.compile(r"[\x00-\x1f\x7f]")


@dataclass(frozen=True)
class SceneSet:
    """Scenes of one recipe: ``combinations`` are all the parameters of each, defaults among them.

    Or one scene, of a file: ``recipe`` is the file's name as the study has it, ``combinations`` has one entry
    without parameters, ``content`` is the file's text, ``made_by`` the recipe that the text names.
    """

    recipe: str
    combinations: tuple[dict[str, Any], ...]
    varied: tuple[str, ...]
    until: float | None
    contacts: int | None
    content: str | None = None
    made_by: str | None = None


@dataclass(frozen=True)
class StudyPlan:
    """The content of a study file: ``file`` is all of it, ``scenes`` and ``phases`` (name and options) are
    what two of its keys mean."""

    file: StudyTable
    scenes: tuple[SceneSet, ...]
    phases: tuple[tuple[str, Mapping[str, Any]], ...]

    @property
    def size(self) -> int:
        """The number of tasks."""
        return sum(len(each.combinations) for each in self.scenes) * len(self.phases) * self.file.repeats


def read_plan_file(path: str | os.PathLike[str]) -> StudyPlan:
    """Reads a study from a TOML file.

    Raises OSError if the file cannot be read, and StudyError, with every mistake in it, if it is no study.
    """
    source = os.fspath(path)
    try:
        text = read_bytes(path, None).decode("utf-8-sig")
        tables = read_tables(text, source)
    except UnicodeDecodeError as error:
        mistake = Mistake(
            f"byte {error.start}", f"bytes that are not UTF-8 ({error.reason})", "a file in UTF-8"
        )
        raise StudyError([mistake], source) from error
    except SceneError as error:  # what reads TOML for scenes
        raise StudyError(error.mistakes, source) from error
    return read_plan(tables, source)


def read_plan(tables: Mapping[str, Any], source: str | None = None) -> StudyPlan:
    """Reads a study from a file's tables; ``source`` is what messages call it. Raises StudyError."""
    return _PlanReader(tables, source).plan()


class _PlanReader:
    """Reads the values of a study file whose keys and types have been compared, and collects mistakes.

    A method that finds a mistake adds it to ``mistakes``; its return value is then unusable.
    """

    def __init__(self, tables: Mapping[str, Any], source: str | None) -> None:
        self.source = source
        self.mistakes, self.faults = find_faults(tables)
        self.tables = {key: value for key, value in tables.items() if (key,) not in self.faults}
        self.seeds: list[int] | None = None

    def wrong(self, where: str, found: str, expected: str) -> None:
        self.mistakes.append(Mistake(where, found, expected))

    def plan(self) -> StudyPlan:
        """Returns the plan. Raises StudyError with all mistakes."""
        tables = self.tables
        phases = self.phases(tables.get("phases", []))
        for k, name in enumerate(tables.get("measure", [])):
            if name not in MEASURES:
                self.wrong(f"measure[{k}]", shown(name), one_of(name, MEASURES))
        self.check_observables(tables.get("observe", []), "pairs" in tables.get("measure", []))
        self.seeds = self.read_seeds(tables.get("seeds"))
        scenes = [
            self.scenes(k) for k in range(len(tables.get("scenes", []))) if ("scenes", k) not in self.faults
        ]
        seeded = any(each is None or "seed" in each.varied for each in scenes)
        if self.seeds is not None and scenes and not seeded:
            self.wrong("seeds", "seeds", "a recipe with a parameter 'seed', or no seeds")
        results = tables.get("results")
        if results is not None and (not results or _CONTROL.search(results)):
            self.wrong("results", shown(results), "the name of a folder")
        elif results is not None and not Path(results).is_absolute():
            here = Path(os.path.realpath(Path(self.source or "").parent))
            if not Path(os.path.realpath(here / results)).is_relative_to(here):
                expected = "a folder within that of the study, or an absolute path"
                self.wrong("results", f"{shown(results)}, which is outside of the study's folder", expected)
        self.check_figures(tables.get("figures", []))
        if self.mistakes:
            raise StudyError(abridged(self.mistakes), self.source)
        file = StudyTable.model_validate(self.tables)
        plan = StudyPlan(file, tuple(each for each in scenes if each is not None), tuple(phases))
        if plan.size > _MOST_TASKS:
            self.wrong("scenes", f"{plan.size:,} tasks in all", f"at most {_MOST_TASKS:,}")
            raise StudyError(self.mistakes, self.source)
        return plan

    def phases(self, texts: list[str]) -> list[tuple[str, Mapping[str, Any]]]:
        """Returns name and options of each phase."""
        found: dict[str, tuple[str, Mapping[str, Any]]] = {}
        for k, text in enumerate(texts):
            where = f"phases[{k}]"
            try:
                name, options = read_phase(text)
            except BadOption as error:
                self.wrong(where, shown(text), f"a phase ({error})")
                continue
            mistakes = check_name(where, name, "broad phase")
            if not mistakes:
                name = registry().spec("broad phase", name).name
                mistakes = [
                    each._replace(where=f"{where}: {each.where}")
                    for each in option_mistakes(name, options, f"options.{name}")
                ]
            if repr((name, options)) in found:
                mistakes = [Mistake(where, f"{shown(text)}, which is there already", "each phase once")]
            found[repr((name, options))] = name, options
            self.mistakes += mistakes
        return list(found.values())

    def check_observables(self, texts: list[str], counts_pairs: bool) -> None:
        """Checks names and options of observables."""
        for k, text in enumerate(texts):
            try:
                check_observable(text)
            except KinetileError as error:
                self.wrong(f"observe[{k}]", shown(text), f"an observable ({error})")
            if text in texts[:k]:
                self.wrong(f"observe[{k}]", f"{shown(text)}, which is there already", "each once")
        if texts and counts_pairs:
            self.wrong("observe", "observables beside the measure pairs", "one of the two")

    def read_seeds(self, given: Any) -> list[int] | None:
        """Returns the seeds, None without any."""
        if given is None:
            return None
        known = len(self.mistakes)
        seeds = values_of(given, "seeds", self.mistakes, whole=True)
        for seed in seeds:
            if isinstance(seed, bool) or not isinstance(seed, int):
                self.wrong("seeds", shown(seed), "whole numbers, a list of them, or a range")
                return None
        return seeds if len(self.mistakes) == known else None

    def scenes(self, k: int) -> SceneSet | None:
        """Returns the scenes of one table, None where it has mistakes."""
        known, where = len(self.mistakes), f"scenes[{k}]"
        table = {key: value for key, value in self.tables["scenes"][k].items() if value is not None}
        clean = {key: value for key, value in table.items() if ("scenes", k, key) not in self.faults}
        ended = not any((*of, "until") in self.faults for of in ((), ("scenes", k)))
        if not {"recipe", "file"} & table.keys():
            self.wrong(where, "neither recipe nor file", "one of the two")
            return None
        found = (self.scene_file if "file" in table else self.recipe)(clean, where, ended)
        return found if len(self.mistakes) == known else None

    def recipe(self, table: Mapping[str, Any], where: str, ended: bool) -> SceneSet | None:
        """Returns the scenes of a recipe."""
        known = len(self.mistakes)
        until, contacts = self.end(table, where, None, ended)
        if "recipe" not in table:  # or of a wrong type, which is a mistake already
            return None
        recipe = table["recipe"]
        if mistakes := check_name(f"{where}.recipe", recipe, "scene"):
            self.mistakes += mistakes
            return None
        known_parameters = {each.name: each for each in recipe_parameters(recipe)}
        given = dict(table.get("parameters", {}))
        if self.seeds is not None and "seed" in known_parameters:
            if "seed" in given:
                self.wrong(f"{where}.parameters.seed", "a seed beside seeds", "one of the two")
            given["seed"] = self.seeds
        lists: dict[str, list[Any]] = {}
        for key, value in given.items():
            place = f"{where}.parameters.{key}"
            parameter = known_parameters.get(key)
            flat = isinstance(value, list) and not all(isinstance(each, list | tuple | str) for each in value)
            if flat and parameter is not None and holds_several(parameter):
                found = f"{shown(value)}, one list for a parameter whose value is a list itself"
                self.wrong(place, found, "a list of lists, such as [[0.5, 0.7]], each a value")
                lists[key] = []
                continue
            whole = parameter is not None and parameter.type == "int"
            lists[key] = values_of(value, place, self.mistakes, whole=whole)
            for each in lists[key]:
                self.mistakes += [
                    mistake._replace(where=f"{where}.{mistake.where}")
                    for mistake in parameter_mistakes(recipe, {key: each})
                    if mistake.where == f"parameters.{key}"
                ]
        missing = [each for each in parameter_mistakes(recipe, {}) if each.where[11:] not in given]
        self.mistakes += [each._replace(where=f"{where}.{each.where}") for each in missing]
        if len(self.mistakes) == known:
            for key, values in lists.items():  # as the types of the parameters have them
                lists[key] = [_cell(complete_parameters(recipe, {key: each})[key]) for each in values]
        combined = self.combined(lists, table.get("together", []), where)
        if len(self.mistakes) > known:
            return None
        varied = tuple(key for key, values in lists.items() if len(values) > 1 or key == "seed")
        defaults = {key: _cell(value) for key, value in complete_parameters(recipe, {}).items()}
        return SceneSet(recipe, tuple({**defaults, **each} for each in combined), varied, until, contacts)

    def scene_file(self, table: Mapping[str, Any], where: str, ended: bool) -> SceneSet | None:
        """Returns the scene of a file, with its text."""
        known, place = len(self.mistakes), f"{where}.file"
        for key in ("recipe", "parameters", "together"):
            if key in table:
                found = "a file beside a recipe" if key == "recipe" else f"{key} of a file"
                at = place if key == "recipe" else f"{where}.{key}"
                self.wrong(at, found, "a file alone, or a recipe with its parameters")
        if "file" not in table or len(self.mistakes) > known:
            return None
        name, expected = table["file"], "the name of a scene file"
        if _CONTROL.search(name):
            self.wrong(place, shown(name), expected)
            return None
        try:
            text = read_bytes(Path(self.source or "").parent / name, None).decode("utf-8-sig")
            scene = loads_scene(text, name)
        except OSError as error:
            self.wrong(place, f"{shown(name)}, which cannot be read ({error.strerror or error})", expected)
            return None
        except UnicodeDecodeError as error:
            reason = f"which is not UTF-8 ({error.reason} at byte {error.start})"
            self.wrong(place, f"{shown(name)}, {reason}", expected)
            return None
        except SceneError as error:
            self.mistakes += [each._replace(where=f"{place}: {each.where}") for each in error.mistakes]
            return None
        until, contacts = self.end(table, where, scene.settings.until, ended)
        return SceneSet(name, ({},), (), until, contacts, text, scene.origin.get("recipe"))

    def end(
        self, table: Mapping[str, Any], where: str, of_scene: float | None, ended: bool
    ) -> tuple[float | None, int | None]:
        """Returns until and contacts of a table's runs: the table's, the file's, or the scene's own.

        ``ended`` False: there is an end of a wrong type, which is a mistake already.
        """
        file = self.tables
        until, contacts = (table.get(key, file.get(key)) for key in ("until", "contacts"))
        if until is None and contacts is None:
            until = of_scene
        if until is not None and not is_finite(until):
            self.wrong(f"{where}: until", shown(until), "a finite number")
        if until is None and ended:
            if "pairs" in file.get("measure", ()):
                self.wrong(f"{where}.until", "nothing", "a time: pairs are counted at moments up to it")
            elif contacts is None:
                self.wrong(f"{where}.until", "nothing", "until or contacts, here or for all scenes")
        return None if until is None else float(until), contacts

    def combined(
        self, lists: Mapping[str, list[Any]], together: list[list[str]], where: str
    ) -> list[dict[str, Any]]:
        """Returns all combinations of values; lists named in ``together`` advance together."""
        group_of: dict[str, tuple[str, ...]] = {}
        for k, group in enumerate(together):
            place = f"{where}.together[{k}]"
            for name in group:
                if name not in lists:
                    self.wrong(place, shown(name), one_of(name, lists))
                elif name in group_of:
                    self.wrong(place, f"{shown(name)} a second time", "each parameter once")
                group_of[name] = tuple(group)
            lengths = {len(lists[name]) for name in group if lists.get(name)}
            if len(lengths) > 1:
                found = f"lists of {', '.join(map(str, sorted(lengths)))} values"
                self.wrong(place, found, "as many in each")
        groups = list(dict.fromkeys(group_of.get(name, (name,)) for name in lists))
        if any(name not in lists for group in groups for name in group):
            return []
        choices = [
            [dict(zip(g, row, strict=False)) for row in zip(*map(lists.get, g), strict=False)] for g in groups
        ]
        size = math.prod(map(len, choices))
        if size > _MOST_TASKS:
            self.wrong(where, f"{size:,} scenes", f"at most {_MOST_TASKS:,}")
            return []
        return [{key: value for part in parts for key, value in part.items()} for parts in product(*choices)]

    def check_figures(self, figures: list[Any]) -> None:
        """Compares the names of the figures: each is that of a file."""
        seen: set[str] = set()
        for k, figure in enumerate(figures):
            if not {("figures", k), ("figures", k, "name")} & self.faults:
                name = figure["name"]
                if not name or Path(name).name != name or _CONTROL.search(name) or name in seen:
                    self.wrong(
                        f"figures[{k}].name", shown(name), "a name for a file, another for each figure"
                    )
                seen.add(name)
