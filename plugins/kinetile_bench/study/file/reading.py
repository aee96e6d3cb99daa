"""A study file is read: every mistake in it is told at once, with where it stands.

Reading goes as it does for scenes: the syntax, the keys and the types (``schema``), and what the values mean,
which is here: ranges, recipes and their parameters, phases and their options, seeds, ends. What fails one
step is left out of the next, and all the rest goes on.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption, Mistake, SceneError, StudyError, one_of
from kinetile.plugin.by_name import Registered, complete_parameters, loads_scene, recipe_parameters
from kinetile.plugin.choices import read_phase
from kinetile.plugin.registry import registry
from kinetile.scene.checks import abridged, is_finite, shown
from kinetile.scene.text.schema import Place
from kinetile.scene.text.toml import read_bytes, read_tables
from kinetile_bench.study.file.ranges import values_of
from kinetile_bench.study.file.schema import MEASURES, FigureTable, find_faults

__all__ = ["Plan", "SceneSet", "read_plan", "read_plan_file"]

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
class Plan:
    """What a study file asks for.

    Attributes:
        source: the file, or None.
        results: the folder of the rows, as the file has it, or None.
        scenes: the scenes.
        phases: (name, options) of each broad phase.
        repeats: how often each run is done.
        measure: what is measured beside the readings.
        seconds: CPU seconds of the runs of a task whose timings are measured, at least.
        limit: CPU seconds that a task may take, or None.
        figures: what is drawn.
    """

    source: str | None
    results: str | None
    scenes: tuple[SceneSet, ...]
    phases: tuple[tuple[str, Mapping[str, Any]], ...]
    repeats: int = 1
    measure: tuple[str, ...] = ()
    seconds: float = 0.05
    limit: float | None = None
    figures: tuple[FigureTable, ...] = field(default=())

    @property
    def size(self) -> int:
        """How many tasks there are."""
        return sum(len(each.combinations) for each in self.scenes) * len(self.phases) * self.repeats


def read_plan_file(path: str | os.PathLike[str]) -> Plan:
    """Read a study from a TOML file.

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


def read_plan(tables: Mapping[str, Any], source: str | None = None) -> Plan:
    """Read a study from a file's tables; ``source`` is what messages call it. Raises StudyError."""
    mistakes, faults = find_faults(tables)
    usable = {key: value for key, value in tables.items() if (key,) not in faults}
    phases = _read_phases(usable.get("phases", []), mistakes)
    for k, name in enumerate(usable.get("measure", [])):
        if name not in MEASURES:
            mistakes.append(Mistake(f"measure[{k}]", shown(name), one_of(name, MEASURES)))
    seeds = _read_seeds(usable.get("seeds"), mistakes)
    folder = Path(source or "").parent
    scenes = []
    for k, table in enumerate(usable.get("scenes", [])):
        if ("scenes", k) not in faults:
            table = {key: value for key, value in table.items() if value is not None}
            clean = {key: value for key, value in table.items() if ("scenes", k, key) not in faults}
            ended = any((*of, "until") in faults for of in ((), ("scenes", k)))  # wrongly, and that is told
            more = usable | {"ended": ended}
            if not {"recipe", "file"} & table.keys():
                mistakes.append(Mistake(f"scenes[{k}]", "neither recipe nor file", "one of the two"))
            elif "file" in table:
                scenes.append(_read_scene_file(clean, folder, f"scenes[{k}]", more, mistakes))
            else:
                scenes.append(_read_scenes(clean, f"scenes[{k}]", more, seeds, mistakes))
    if seeds is not None and scenes and not any(each is None or "seed" in each.varied for each in scenes):
        mistakes.append(Mistake("seeds", "seeds", "a recipe with a parameter 'seed', or no seeds"))
    results = usable.get("results")
    if results is not None and (not results or _CONTROL.search(results)):
        mistakes.append(Mistake("results", shown(results), "the name of a folder"))
    mistakes += _figure_mistakes(usable.get("figures", []), faults)
    if mistakes:
        raise StudyError(abridged(mistakes), source)
    plan = Plan(
        source,
        results,
        tuple(each for each in scenes if each is not None),
        tuple(phases),
        usable.get("repeats", 1),
        tuple(dict.fromkeys(usable.get("measure", ()))),
        float(usable.get("seconds", 0.05)),
        usable.get("limit"),
        tuple(FigureTable.model_validate(each) for each in usable.get("figures", [])),
    )
    if plan.size > _MOST_TASKS:
        raise StudyError(
            [Mistake("scenes", f"{plan.size:,} tasks in all", f"at most {_MOST_TASKS:,}")], source
        )
    return plan


def _read_phases(texts: list[str], mistakes: list[Mistake]) -> list[tuple[str, Mapping[str, Any]]]:
    """Return name and options of each phase; append what is wrong with them."""
    found: dict[str, tuple[str, Mapping[str, Any]]] = {}
    names = Registered()
    for k, text in enumerate(texts):
        where = f"phases[{k}]"
        try:
            name, options = read_phase(text)
        except BadOption as error:
            mistakes.append(Mistake(where, shown(text), f"a phase ({error})"))
            continue
        wrong = names.mistakes(where, name, "broad phase")
        if not wrong:
            name = registry().spec("broad phase", name).name
            wrong = [
                each._replace(where=f"{where}: {each.where}") for each in names.option_mistakes(name, options)
            ]
        if repr((name, options)) in found:
            wrong = [Mistake(where, f"{shown(text)}, which is there already", "each phase once")]
        found[repr((name, options))] = name, options
        mistakes += wrong
    return list(found.values())


def _read_seeds(given: Any, mistakes: list[Mistake]) -> list[int] | None:
    if given is None:
        return None
    known = len(mistakes)
    seeds = values_of(given, "seeds", mistakes, whole=True)
    for seed in seeds:
        if isinstance(seed, bool) or not isinstance(seed, int):
            mistakes.append(Mistake("seeds", shown(seed), "whole numbers, a list of them, or a range"))
            return None
    return seeds if len(mistakes) == known else None


def _read_scenes(
    table: Mapping[str, Any],
    where: str,
    file: Mapping[str, Any],
    seeds: list[int] | None,
    mistakes: list[Mistake],
) -> SceneSet | None:
    """Return the scenes of one table; append what is wrong with them, and return None then."""
    known = len(mistakes)
    until, contacts = _read_end(table, where, file, None, mistakes)
    if "recipe" not in table:  # or wrongly, and that is told
        return None
    recipe, names = table["recipe"], Registered()
    wrong = names.mistakes(f"{where}.recipe", recipe, "scene")
    if wrong:
        mistakes += wrong
        return None
    types = {each.name: each.type for each in recipe_parameters(recipe)}
    given = dict(table.get("parameters", {}))
    if seeds is not None and "seed" in types:
        if "seed" in given:
            mistakes.append(Mistake(f"{where}.parameters.seed", "a seed beside seeds", "one of the two"))
        given["seed"] = seeds
    lists: dict[str, list[Any]] = {}
    for key, value in given.items():
        place = f"{where}.parameters.{key}"
        lists[key] = values_of(value, place, mistakes, whole=types.get(key) == "int")
        for each in lists[key]:
            mistakes += [
                mistake._replace(where=f"{where}.{mistake.where}")
                for mistake in names.parameter_mistakes(recipe, {key: each})
                if mistake.where == f"parameters.{key}"
            ]
    missing = [each for each in names.parameter_mistakes(recipe, {}) if each.where[11:] not in given]
    mistakes += [each._replace(where=f"{where}.{each.where}") for each in missing]
    if len(mistakes) == known:
        for key, values in lists.items():  # as the types of the parameters have them
            lists[key] = [complete_parameters(recipe, {key: each})[key] for each in values]
    combined = _combined(lists, table.get("together", []), where, mistakes)
    if len(mistakes) > known:
        return None
    varied = tuple(key for key, values in lists.items() if len(values) > 1 or key == "seed")
    defaults = complete_parameters(recipe, {})
    combinations = tuple({**defaults, **each} for each in combined)
    return SceneSet(recipe, combinations, varied, until, contacts)


def _read_end(
    table: Mapping[str, Any],
    where: str,
    file: Mapping[str, Any],
    own: float | None,
    mistakes: list[Mistake],
) -> tuple[float | None, int | None]:
    """Return until and contacts of a table's runs: the table's, the file's, or the scene's own."""
    until, contacts = table.get("until", file.get("until")), table.get("contacts", file.get("contacts"))
    if until is None and contacts is None:
        until = own
    if until is not None and not is_finite(until):
        mistakes.append(Mistake(f"{where}: until", shown(until), "a finite number"))
    if until is None and not file["ended"]:
        if "pairs" in file.get("measure", ()):
            expected = "a time: pairs are counted at moments up to it"
            mistakes.append(Mistake(f"{where}.until", "nothing", expected))
        elif contacts is None:
            mistakes.append(Mistake(f"{where}.until", "nothing", "until or contacts, here or for all scenes"))
    return None if until is None else float(until), contacts


def _read_scene_file(
    table: Mapping[str, Any], folder: Path, where: str, file: Mapping[str, Any], mistakes: list[Mistake]
) -> SceneSet | None:
    """Return the scene of a file, with the text that its runs have; append what is wrong, and return None."""
    known = len(mistakes)
    for key in ("recipe", "parameters", "together"):
        if key in table:
            said = "a file beside a recipe" if key == "recipe" else f"{key} of a file"
            place = f"{where}.{'file' if key == 'recipe' else key}"
            mistakes.append(Mistake(place, said, "a file alone, or a recipe with its parameters"))
    if "file" not in table or len(mistakes) > known:
        return None
    name, expected = table["file"], "the name of a scene file"
    if _CONTROL.search(name):
        mistakes.append(Mistake(f"{where}.file", shown(name), expected))
        return None
    try:
        text = read_bytes(folder / name, None).decode("utf-8-sig")
        scene = loads_scene(text, name)
    except OSError as error:
        said = f"{shown(name)}, which cannot be read ({error.strerror or error})"
        mistakes.append(Mistake(f"{where}.file", said, expected))
        return None
    except UnicodeDecodeError as error:
        said = f"{shown(name)}, which is not UTF-8 ({error.reason} at byte {error.start})"
        mistakes.append(Mistake(f"{where}.file", said, expected))
        return None
    except SceneError as error:
        mistakes += [each._replace(where=f"{where}.file: {each.where}") for each in error.mistakes]
        return None
    until, contacts = _read_end(table, where, file, scene.settings.until, mistakes)
    return SceneSet(name, ({},), (), until, contacts, text, scene.origin.get("recipe"))


def _combined(
    lists: Mapping[str, list[Any]], together: list[list[str]], where: str, mistakes: list[Mistake]
) -> list[dict[str, Any]]:
    """Return all combinations of values; lists that go together are gone through side by side."""
    group_of: dict[str, tuple[str, ...]] = {}
    for k, group in enumerate(together):
        place = f"{where}.together[{k}]"
        for name in group:
            if name not in lists:
                mistakes.append(Mistake(place, shown(name), one_of(name, lists)))
            elif name in group_of:
                mistakes.append(Mistake(place, f"{shown(name)} a second time", "each parameter once"))
            group_of[name] = tuple(group)
        lengths = {len(lists[name]) for name in group if lists.get(name)}
        if len(lengths) > 1:
            mistakes.append(
                Mistake(place, f"lists of {', '.join(map(str, sorted(lengths)))} values", "as many in each")
            )
    groups = list(dict.fromkeys(group_of.get(name, (name,)) for name in lists))
    if any(name not in lists for group in groups for name in group):
        return []
    choices = [
        [dict(zip(g, row, strict=False)) for row in zip(*map(lists.get, g), strict=False)] for g in groups
    ]
    size = 1
    for each in choices:
        size *= len(each)
    if size > _MOST_TASKS:
        mistakes.append(Mistake(where, f"{size:,} scenes", f"at most {_MOST_TASKS:,}"))
        return []
    return [{key: value for part in parts for key, value in part.items()} for parts in product(*choices)]


def _figure_mistakes(figures: list[Any], faults: set[Place]) -> list[Mistake]:
    seen: set[str] = set()
    mistakes = []
    for k, figure in enumerate(figures):
        if ("figures", k) in faults or ("figures", k, "name") in faults:
            continue
        name = figure["name"]
        if not name or Path(name).name != name or _CONTROL.search(name) or name in seen:
            mistakes.append(
                Mistake(f"figures[{k}].name", shown(name), "a name for a file, another for each figure")
            )
        seen.add(name)
    return mistakes
