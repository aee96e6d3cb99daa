"""Tasks: one run each, with a key that is a hash of all that determines the result.

They come scene by scene. On a scene the phases take turns, once for each repeat, forwards and backwards: so a
machine that slows down slows all of them, and whoever runs the tasks one by one has times that are pairs.

Two tasks have one *course* where they must have one list of contacts: the same scene to the same end, by the
same specification, whatever the phase. Their fingerprints are compared as rows arrive.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from kinetile.kernel.log import ANSWER
from kinetile.plugin.by_name import loads_scene, make_scene
from kinetile_bench.choices import phase_label
from kinetile_bench.study.file.reading import Plan
from kinetile_bench.study.work.identity import ANSWERED, source_of

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["Task", "scene_of", "tasks_of"]


class Task(NamedTuple):
    """One run.

    Attributes:
        key: the hash of all that determines the result.
        course: the hash of what determines the contacts.
        recipe, parameters: the scene.
        phase: the broad phase with its options, as it is written.
        broad_phase, options: the same as name and options.
        until, contacts: the end of the run.
        measure, seconds: what is measured beside the readings, and for how long.
        repeat: which of several equal runs this is, from 1.
        versions: of kinetile, of the phase and of the recipe; a worker must have the same.
        content: the text of the scene file, which ``recipe`` is the name of then; None: a recipe makes it.
        scene_sha256: of that text.
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


def tasks_of(plan: Plan) -> Iterator[Task]:
    """Yield the tasks of a study: scene by scene, repeat by repeat, each under all phases."""
    phases = [(phase_label(*each), *each, source_of("broad phase", each[0])) for each in plan.phases]
    for scenes in plan.scenes:
        content, recipe, sha256 = scenes.content, scenes.made_by, None
        if content is None:
            recipe = scenes.recipe
        else:  # it goes by its content, whatever the file is called
            sha256 = hashlib.sha256(content.encode()).hexdigest()
        recipe_source = None if recipe is None else source_of("scene", recipe)
        versions = [
            {"kinetile": ANSWERED, f"broad phase {name}": source}
            | ({} if recipe_source is None else {f"scene {recipe}": recipe_source})
            for _, name, _, source in phases
        ]
        for parameters in scenes.combinations:
            course = _digest(
                [sha256 or recipe, parameters, scenes.until, scenes.contacts, ANSWER, recipe_source]
            )
            for repeat in range(1, plan.repeats + 1):
                turn = list(zip(phases, versions, strict=True))
                for (label, name, options, source), found in turn if repeat % 2 else reversed(turn):
                    measured = plan.measure, plan.seconds if "timings" in plan.measure else None
                    key = _digest([course, name, options, measured, repeat, ANSWERED, source])
                    yield Task(
                        key,
                        course,
                        scenes.recipe,
                        parameters,
                        label,
                        name,
                        options,
                        scenes.until,
                        scenes.contacts,
                        plan.measure,
                        plan.seconds,
                        repeat,
                        found,
                        content,
                        sha256,
                    )


def scene_of(order: Mapping[str, Any]) -> Scene:
    """Return the scene of a task that is given as its fields: of its content, or as its recipe makes it."""
    if order["content"] is None:
        return make_scene(order["recipe"], **order["parameters"])
    return _scene_of_text(order["content"], order["recipe"])


@lru_cache(maxsize=2)
def _scene_of_text(text: str, name: str) -> Scene:
    return loads_scene(text, name)


def _digest(value: Any) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]
