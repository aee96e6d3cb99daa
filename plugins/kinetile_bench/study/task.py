"""Tasks: one run each, with a key that is a hash of all that determines the result.

Two tasks have one *course* where they must have one list of contacts: the same scene to the same end, by the
same code, whatever the broad phase and the observables.

A result depends on the versions of kinetile and of the plugins too. A package under development keeps its
version while its code changes, so plugins go by their version and by a digest of their sources: no row of
yesterday's code is taken for one of today's.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import platform
import time
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, NamedTuple

from kinetile import ANSWER, Scene, Simulation, __version__, make_scene, registry
from kinetile.errors import KinetileError, Refused, UnknownName, printable
from kinetile.kernel.compiled import INTERPRETED
from kinetile.plugin.choices import read_phase
from kinetile.plugin.specs import Kind
from kinetile.run.observing import Observed
from kinetile.scene.by_name import loads_scene
from kinetile_accuracy.environment import environment
from kinetile_bench.study.plan import Named, StudyPlan

DONE, REFUSED, FAILED, LOST, DISAGREES = "done", "refused", "failed", "lost", "disagrees"
STATUSES = (DONE, REFUSED, FAILED, LOST, DISAGREES)
"""The ends of a task, as its row has them. ``LOST``: its worker died."""

Source = tuple[Kind | Literal["framework"], str, str]
"""What a result depends on: its kind, its name, and the package and version that it comes from."""


class StudyStopped(KinetileError, RuntimeError):
    """A study cannot go on; the rows of all finished tasks are in its file."""


class Task(NamedTuple):
    """One run.

    Attributes:
        key: the hash of all that determines the result.
        course: the hash of what determines the contacts.
        recipe, parameters: the scene; ``recipe`` is the name of a file where there is ``content``, its text.
        phase: the broad phase with its options, as the study has it.
        until, contacts: the end of the run.
        observe: the observables of the run.
        repeat: which of several equal runs this is, from 1.
        sources: where kinetile and all plugins that the run names come from; a worker must have the same.
    """

    key: str
    course: str
    recipe: str
    parameters: Mapping[str, Any]
    content: str | None
    phase: str
    until: float | None
    contacts: int | None
    observe: tuple[str, ...]
    repeat: int
    sources: tuple[Source, ...]

    def scene(self) -> Scene:
        """Returns the scene: of the file's text, or as the recipe makes it."""
        if self.content is None:
            return make_scene(self.recipe, **self.parameters)
        return loads_scene(self.content, self.recipe)


def tasks_of(plan: StudyPlan) -> Iterator[Task]:
    """Yields the tasks of a study, scene by scene. On a scene the phases take turns, once for each repeat,
    forwards and backwards: so a machine that slows down slows all of them."""
    observed = _sources(("observable", read_phase(each)[0]) for each in plan.observe)
    phases = [(each, _sources([("broad phase", read_phase(each)[0])])) for each in plan.phases]
    for scenes in plan.scenes:
        end = scenes.until, scenes.contacts
        sources = (("framework", "kinetile", _source("framework", "kinetile")), *_sources(scenes.named))
        for parameters in scenes.combinations:
            # The name of a scene file is in no key: what determines the result is its content.
            course = _digest([scenes.content, parameters, sources, end])
            for repeat in range(1, plan.repeats + 1):
                for phase, source in phases if repeat % 2 else reversed(phases):
                    every = (*sources, *observed, *source)
                    key = _digest([course, read_phase(phase)[1], plan.observe, repeat, every])
                    scene = scenes.name, parameters, scenes.content
                    yield Task(key, course, *scene, phase, *end, plan.observe, repeat, every)


def run_task(task: Task) -> dict[str, Any]:
    """Runs a task; returns its row in plain types. An error of the run is a result too: the row has its
    sentence, and the readings up to there.

    Raises StudyStopped where this process has other versions than the one that runs the study.
    """
    for kind, name, source in task.sources:
        if (here := _source(kind, name)) != source:
            raise StudyStopped(
                f"the process on {platform.node()} has another {kind} {name} ({here}) than the study "
                f"({source}). Rows of different code would be mixed up: install the same there"
            )
    began = time.perf_counter()
    row: dict[str, Any] = {"status": DONE, "error": None}
    simulation = None
    try:
        name, options = read_phase(task.phase)
        simulation = Simulation(task.scene(), name, options=options, keep_contacts=False)
        simulation.run(task.until, max_contacts=task.contacts, observe=task.observe)
        row |= _readings(simulation)
    except Refused as error:
        row |= {"status": REFUSED, "error": printable(str(error))}
    except Exception as error:  # a plugin may raise anything, and that is the task's result
        row |= {"status": FAILED, "error": printable(f"{type(error).__name__}: {error}")}
        if simulation is not None and isinstance(error, KinetileError):
            row |= _readings(simulation)
    return row_of(task, row | {"seconds": time.perf_counter() - began, "environment": _environment()})


def row_of(task: Task, result: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the row of a task: what it is, and its result."""
    names = ("key", "course", "recipe", "parameters", "phase", "until", "repeat")
    row = {name: getattr(task, name) for name in names}
    row |= {"contacts_asked": task.contacts, "sources": [" ".join(each) for each in task.sources]}
    return row | dict(result)


def _readings(simulation: Simulation) -> dict[str, Any]:
    found: dict[str, Any] = simulation.readings.as_dict()
    found |= {"contacts": found["contacts_disc"] + found["contacts_wall"], "time": simulation.time}
    return found | {"compiled": not INTERPRETED} | _observed_columns(simulation.observed)


def _observed_columns(observed: Observed) -> dict[str, Any]:
    """Returns the columns of estimates: a number with its error, or a curve as a table of lists."""
    row: dict[str, Any] = {}
    for name, quantities in observed.items():
        for quantity, (mean, error, blocks, axis, at) in quantities.items():
            column = f"observed.{name}.{quantity}"
            if at is None:
                row |= {column: float(mean), f"{column}.error": float(error), f"{column}.blocks": blocks}
            else:
                row[column] = {axis: at.tolist(), "mean": mean.tolist(), "error": error.tolist()}
    return row


@cache
def _environment() -> dict[str, Any]:
    return environment() | {"host": platform.node()}


def _sources(named: Iterable[Named]) -> tuple[Source, ...]:
    """Returns where plugins come from: their packages with their versions, foreign ones with a digest."""
    return tuple((kind, name, _source(kind, name)) for kind, name in named)


def _source(kind: Kind | Literal["framework"], name: str) -> str:
    if kind == "framework":
        return f"{__version__}, answer {ANSWER}"
    try:
        provided = registry().provided(kind, name)
    except UnknownName:
        return "not there"
    package = provided.distribution or "added in this process"
    version = provided.version or "of unknown version"
    sources = "" if package == "kinetile" else f", sources {_digest_of(provided.spec.target)}"
    return f"{package} {version}{sources}"


def _digest_of(target: Any) -> str:
    """Returns a digest of the sources of the package, or of the file, that a target stands in."""
    if isinstance(target, str):
        return _package_digest(target.partition(":")[0].partition(".")[0])
    try:
        file = inspect.getsourcefile(inspect.unwrap(target))
        return _hash(Path(file).read_bytes() if file else b"")[:12]
    except (OSError, TypeError):
        return "unknown"


@cache
def _package_digest(package: str) -> str:
    try:
        spec = find_spec(package)
    except ValueError:  # of __main__, for one
        spec = None
    if spec is None:
        return "unknown"
    files = [Path(spec.origin)] if spec.origin and not spec.submodule_search_locations else []
    for folder in spec.submodule_search_locations or ():
        files += sorted(Path(folder).rglob("*.py"))
    return _hash(b"".join(file.name.encode() + b"\0" + file.read_bytes() + b"\0" for file in files))[:12]


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _digest(value: Any) -> str:
    return _hash(json.dumps(value, sort_keys=True, separators=(",", ":"), default=str).encode())[:32]
