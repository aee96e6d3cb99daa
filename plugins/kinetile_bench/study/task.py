"""Tasks: one run each, with a key that is a hash of all that determines the result. Two tasks have one
*course* if they must have one list of contacts: the same scene to the same end, by the same code. Code
can change under one version, so foreign plugins are identified by a digest of their sources as well."""

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

from kinetile import ANSWER, Simulation, __version__, registry
from kinetile.errors import KinetileError, Refused, UnknownName, printable
from kinetile.instruments import NOTHING_IS_COMPILED, PluginKind, read_phase
from kinetile_accuracy.environment import environment
from kinetile_bench.study.plan import StudyPlan, StudyScene

Row = dict[str, Any]
"""A finished task with its result."""

DONE, REFUSED, FAILED, LOST, DISAGREES = "done", "refused", "failed", "lost", "disagrees"
STATUSES = (DONE, REFUSED, FAILED, LOST, DISAGREES)
"""The ends of a task, as in its row. ``LOST``: its worker died."""

Source = tuple[PluginKind | Literal["framework"], str, str]
"""A source of a result: its kind, its name, and its package with its version."""


class StudyStopped(KinetileError, RuntimeError):
    """A study cannot go on; the rows of all finished tasks are in its file."""


class Task(NamedTuple):
    """One run, of a phase with the study's options: ``key`` is the hash of all that determines the result,
    ``course`` the hash of all that determines the contacts; ``repeat`` counts equal runs from 1; ``sources``
    name the origins of kinetile and all named plugins: a worker must have the same."""

    key: str
    course: str
    scene: StudyScene
    phase: str
    observe: tuple[str, ...]
    repeat: int
    sources: tuple[Source, ...]


def tasks_of(plan: StudyPlan) -> Iterator[Task]:
    """Yields the tasks of a study, scene by scene. On a scene the phases take turns, once for each repeat,
    forwards and backwards, so a machine that slows down slows all of them."""
    observed = _sources(("observable", read_phase(each)[0]) for each in plan.observe)
    phases = [(each, _sources([("broad phase", read_phase(each)[0])])) for each in plan.phases]
    for scene in plan.scenes:
        sources = _sources([("framework", "kinetile"), *scene.named])
        # The name of a scene file is in no key: its content determines the result.
        course = digest([scene.content, scene.parameters, scene.until, scene.contacts, sources])
        for repeat in range(1, plan.repeats + 1):
            for phase, source in phases if repeat % 2 else reversed(phases):
                every = (*sources, *observed, *source)
                key = digest([course, read_phase(phase)[1], plan.observe, repeat, every])
                yield Task(key, course, scene, phase, plan.observe, repeat, every)


def run_task(task: Task) -> Row:
    """Runs a task; returns its row in plain types, with the sentence of an error of the run. Raises
    StudyStopped if this process has other versions than the process that runs the study."""
    for kind, name, source in task.sources:
        if (here := _source(kind, name)) != source:
            raise StudyStopped(
                f"the process on {platform.node()} has another {kind} {name} ({here}) than the study "
                f"({source}). Rows of different code would be mixed up: install the same there"
            )
    began = time.perf_counter()
    row: Row = {"status": DONE, "error": None}
    simulation = None
    try:
        name, options = read_phase(task.phase)
        simulation = Simulation(task.scene.make(), name, options=options, keep_contacts=False, compiled=True)
        simulation.run(task.scene.until, max_contacts=task.scene.contacts, observe=task.observe)
        row |= _readings(simulation)
    except Refused as error:
        row |= {"status": REFUSED, "error": printable(str(error))}
    except Exception as error:  # a plugin may raise any error, which is the task's result
        row |= {"status": FAILED, "error": printable(f"{type(error).__name__}: {error}")}
        if simulation is not None and isinstance(error, KinetileError):
            row |= _readings(simulation)
    return row_of(task, row | {"seconds": time.perf_counter() - began, "environment": _environment()})


def row_of(task: Task, result: Mapping[str, Any]) -> Row:
    """Returns the row of a task: the task and its result."""
    scene = task.scene
    return {
        "key": task.key,
        "course": task.course,
        "recipe": scene.name,
        "parameters": scene.parameters,
        "phase": task.phase,
        "until": scene.until,
        "contacts_asked": scene.contacts,
        "repeat": task.repeat,
        "sources": [" ".join(each) for each in task.sources],
        **result,
    }


def _readings(simulation: Simulation) -> Row:
    """Returns the columns of readings and of estimates: a number with its error, or a curve as a table."""
    row: Row = simulation.readings.as_dict()
    row |= {"time": simulation.time, "compiled": not NOTHING_IS_COMPILED}
    for name, quantity, each in simulation.observed.entries():
        column, mean, error = f"observed.{name}.{quantity}", each.mean, each.error
        if each.at is None:
            row |= {column: float(mean), f"{column}.error": float(error), f"{column}.blocks": each.blocks}
        else:
            row[column] = {each.axis: each.at.tolist(), "mean": mean.tolist(), "error": error.tolist()}
        if each.reason:
            row[f"{column}.reason"] = each.reason
    return row


@cache
def _environment() -> dict[str, Any]:
    return environment() | {"host": platform.node()}


def _sources(named: Iterable[tuple[PluginKind | Literal["framework"], str]]) -> tuple[Source, ...]:
    return tuple((kind, name, _source(kind, name)) for kind, name in named)


def _source(kind: PluginKind | Literal["framework"], name: str) -> str:
    """Returns the source of a plugin: its package with its version, a foreign one with a digest."""
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


@cache
def _digest_of(target: Any) -> str:
    try:
        if isinstance(target, str):
            files = _files_of(target.partition(":")[0].partition(".")[0])
        else:
            files = [Path(inspect.getsourcefile(inspect.unwrap(target)) or "")]
        sources = (file.name.encode() + b"\0" + file.read_bytes() + b"\0" for file in files)
        return hashlib.sha256(b"".join(sources)).hexdigest()[:12]
    except (OSError, TypeError, ValueError):  # it has no file
        return "unknown"


def _files_of(package: str) -> list[Path]:
    """Returns the files of a package or module, without importing it. Raises ValueError without files."""
    spec = find_spec(package)
    if spec is None:
        raise ValueError(package)
    folders = spec.submodule_search_locations or ()
    files = [file for folder in folders for file in sorted(Path(folder).rglob("*.py"))]
    return files or [Path(spec.origin or "")]


def digest(value: Any) -> str:
    """Returns a digest of plain values: 32 hexadecimal digits."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]
