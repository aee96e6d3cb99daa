"""Tasks: one run each, with a key that is a hash of all that determines the result.

Tasks come scene by scene. On a scene the phases take turns, once for each repeat, forwards and backwards: so
a machine that slows down slows all of them, and tasks that run one by one have times that are pairs.

Two tasks have one *course* where they must have one list of contacts: the same scene to the same end, by the
same specification, whatever the phase. Their fingerprints are compared as rows arrive.

A result depends on the versions of kinetile and of the plugins too. A package under development keeps its
version while its code changes, so plugins go by their version and by a digest of their sources: no row of
yesterday's code is taken for one of today's.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from kinetile import ANSWER, __version__, make_scene, registry
from kinetile.errors import KinetileError, UnknownName
from kinetile.plugin.choices import read_phase, write_phase
from kinetile.plugin.specs import Kind
from kinetile.scene.files import loads_scene
from kinetile_bench.plan import StudyPlan

if TYPE_CHECKING:
    from kinetile import Scene

DONE, REFUSED, FAILED = "done", "refused", "failed"
OUT_OF_MEMORY, OUT_OF_TIME, LOST = "out of memory", "out of time", "lost"
DISAGREES = "disagrees"
STATUSES = (DONE, REFUSED, FAILED, OUT_OF_MEMORY, OUT_OF_TIME, LOST, DISAGREES)
"""The ends of a task, as its row has them. ``LOST``: its worker died."""

ANSWERED = f"{__version__}, answer {ANSWER}"
"""The version of kinetile, and of the specification that its contacts follow."""


class VersionsDiffer(KinetileError, RuntimeError):
    """A worker has other versions than those that the study was begun with."""

    def __init__(self, differences: str, where: str) -> None:
        super().__init__(
            f"{where} has other versions than this process: {differences}. Rows of different code would be "
            "mixed up; install the same there, or take this worker away",
        )


def source_of(kind: Kind, name: str) -> str:
    """Returns the package and version that a phase or recipe comes from. Raises UnknownName."""
    provided = registry().provided(kind, name)
    if provided.distribution == "kinetile":
        return f"kinetile {provided.version}"
    digest = _digest_of(provided.spec.target)
    if provided.distribution is None:
        return f"added in this process, sources {digest}"
    return f"{provided.distribution} {provided.version or 'of unknown version'}, sources {digest}"


def versions_here(wanted: Mapping[str, str]) -> dict[str, str]:
    """Returns the versions here of what a task needs: kinetile, phases, recipes."""
    found = {}
    for name in wanted:
        kind, _, of = name.rpartition(" ")
        if kind not in ("broad phase", "scene", "observable"):
            found[name] = ANSWERED
            continue
        try:
            found[name] = source_of(cast("Kind", kind), of)
        except UnknownName:
            found[name] = "not there"
    return found


def check_versions(wanted: Mapping[str, str], found: Mapping[str, str], where: str) -> None:
    """Raises VersionsDiffer where a process has other versions than those that are wanted."""
    odd = [name for name in wanted if found.get(name) != wanted[name]]
    if odd:
        differences = "; ".join(
            f"{name} is {found.get(name, 'not there')} there, {wanted[name]} here" for name in odd
        )
        raise VersionsDiffer(differences, where)


def _digest_of(target: Any) -> str:
    """Returns a digest of the sources of the package, or of the file, that a target stands in."""
    if isinstance(target, str):
        return _package_digest(target.partition(":")[0].partition(".")[0])
    try:
        file = inspect.getsourcefile(inspect.unwrap(target))
        text = Path(file).read_bytes() if file else b""
    except (OSError, TypeError):
        text = b""
    return _hash(text, 12)


@lru_cache
def _package_digest(package: str) -> str:
    spec = PathFinder.find_spec(package)
    if spec is None:
        return "unknown"
    files = [Path(spec.origin)] if spec.origin and not spec.submodule_search_locations else []
    for folder in spec.submodule_search_locations or ():
        files += sorted(Path(folder).rglob("*.py"))
    return _hash(b"".join(file.name.encode() + b"\0" + file.read_bytes() + b"\0" for file in files), 12)


def _hash(data: bytes, digits: int) -> str:
    return hashlib.sha256(data).hexdigest()[:digits]


class Task(NamedTuple):
    """One run.

    Attributes:
        key: the hash of all that determines the result.
        course: the hash of what determines the contacts.
        recipe, parameters: the scene.
        phase: the broad phase with its options, as it is written.
        broad_phase, options: the same as name and options.
        until, contacts: the end of the run.
        measure, seconds: the measurements beside the readings, and their duration.
        repeat: which of several equal runs this is, from 1.
        versions: of kinetile, of the phase, the recipe and the observables; a worker must have the same.
        content: the text of the scene file, which ``recipe`` is the name of then; None: a recipe makes it.
        scene_sha256: of that text.
        observe: the observables of the run.
    """

    key: str
    course: str
    recipe: str
    parameters: Mapping[str, Any]
    phase: str
    broad_phase: str
    options: Mapping[str, Any]
    until: float | None
    contacts: int | None
    measure: tuple[str, ...]
    seconds: float
    repeat: int
    versions: Mapping[str, str]
    content: str | None = None
    scene_sha256: str | None = None
    observe: tuple[str, ...] = ()


def tasks_of(plan: StudyPlan) -> Iterator[Task]:
    """Yields the tasks of a study: scene by scene, repeat by repeat, each under all phases."""
    measure = tuple(dict.fromkeys(plan.file.measure))
    seconds = plan.file.seconds
    observe = tuple(plan.file.observe)
    measured: tuple[Any, ...] = measure, seconds if {"timings", "rate", "stages"} & set(measure) else None
    measured += (observe,) if observe else ()  # without observables, keys are as they always were
    for scenes in plan.scenes:
        sha256 = None if scenes.content is None else hashlib.sha256(scenes.content.encode()).hexdigest()
        recipe = scenes.recipe if scenes.content is None else scenes.made_by
        versions = {"kinetile": ANSWERED}
        for each in observe:
            name = read_phase(each)[0]
            versions[f"observable {name}"] = source_of("observable", name)
        if recipe is not None:
            versions[f"scene {recipe}"] = source_of("scene", recipe)
        # The name of a scene file is in no key: what determines the result is its content.
        scene = sha256 or recipe, versions.get(f"scene {recipe}")
        turn = [
            (
                write_phase(*phase),
                *phase,
                versions | {f"broad phase {phase[0]}": source_of("broad phase", phase[0])},
            )
            for phase in plan.phases
        ]
        for parameters in scenes.combinations:
            course = _digest([*scene, parameters, scenes.until, scenes.contacts, ANSWER])
            for repeat in range(1, plan.file.repeats + 1):
                for label, name, options, found in turn if repeat % 2 else reversed(turn):
                    yield Task(
                        key=_digest([course, name, options, measured, repeat, found]),
                        course=course,
                        recipe=scenes.recipe,
                        parameters=parameters,
                        phase=label,
                        broad_phase=name,
                        options=options,
                        until=scenes.until,
                        contacts=scenes.contacts,
                        measure=measure,
                        seconds=seconds,
                        repeat=repeat,
                        versions=found,
                        content=scenes.content,
                        scene_sha256=sha256,
                        observe=observe,
                    )


def scene_of(order: Mapping[str, Any]) -> Scene:
    """Returns the scene of a task that is given as its fields: of its content, or as its recipe makes it."""
    if order["content"] is None:
        return make_scene(order["recipe"], **order["parameters"])
    return _scene_of_text(order["content"], order["recipe"])


@lru_cache(maxsize=2)
def _scene_of_text(text: str, name: str) -> Scene:
    return loads_scene(text, name)


def _digest(value: Any) -> str:
    return _hash(json.dumps(value, sort_keys=True, separators=(",", ":"), default=str).encode(), 32)
