"""Scenes by name: recipes that plugins bring, and files that name recipes and phases."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from kinetile.errors import KinetileError, Mistake, UnknownName, one_of
from kinetile.plugin.calling import calling
from kinetile.plugin.registry import Kind, registry
from kinetile.scene import Scene, recipes
from kinetile.scene.checks import shown
from kinetile.scene.recipes import REQUIRED, Parameter

__all__ = [
    "REQUIRED",
    "Parameter",
    "Registered",
    "complete_parameters",
    "load_scene",
    "loads_scene",
    "make_scene",
    "parse_parameters",
    "recipe_parameters",
]


def make_scene(name: str, /, **parameters: Any) -> Scene:
    """Return the scene that the recipe called ``name`` makes of these parameters (its defaults for the rest).

    The scene's ``origin`` is {"recipe": name, "parameters": {...}}, defaults included. Raises UnknownName for
    a recipe that is not there, BadOption for a parameter that it does not have or cannot use, SceneError for
    a scene with mistakes, and PhaseError for a recipe that breaks.
    """
    recipe = registry().scene(name)
    with calling("scene", name, "the recipe"):
        return recipes.follow_recipe(name, recipe, parameters)


def recipe_parameters(name: str) -> tuple[Parameter, ...]:
    """Return the parameters of the recipe called ``name``, in the order of its signature.

    Raises UnknownName for a recipe that is not there, and PhaseError for one whose signature hides its
    parameters.
    """
    return recipes.recipe_parameters(name, registry().scene(name))


def parse_parameters(name: str, texts: Iterable[str]) -> dict[str, Any]:
    """Return the parameters that ``texts``, each "name=value", give to the recipe called ``name``.

    Values are read as their parameter's type says. Raises UnknownName for a recipe that is not there, and
    BadOption, with a sentence for each mistake, for what cannot be read.
    """
    return recipes.parse_parameters(name, registry().scene(name), texts)


def complete_parameters(name: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return all parameters of the recipe called ``name``: these, as its types have them, and its defaults.

    They must be such as it has and can use. Raises UnknownName, and PhaseError for a recipe whose signature
    hides its parameters.
    """
    return recipes.complete_parameters(name, registry().scene(name), parameters)


def load_scene(path: str | os.PathLike[str], *, max_bytes: int | None = None) -> Scene:
    """Read a scene from a TOML file, a regular one of at most ``max_bytes``.

    Without ``max_bytes`` that is what the environment variable KINETILE_MAX_SCENE_BYTES says, or 64 MiB.
    Raises OSError if the file cannot be read, and SceneError, with every mistake in it, if it is no scene.
    """
    from kinetile.scene.text.files import read_file  # with what only files need

    return read_file(path, Registered(), max_bytes)


def loads_scene(text: str, source: str | None = None) -> Scene:
    """Read a scene from TOML text; ``source`` is what messages call it. Raises SceneError."""
    from kinetile.scene.text.files import read_text

    return read_text(text, source, Registered())


class Registered:
    """The names that this process's registry knows (``kinetile.scene.text.files.Names``)."""

    def mistakes(self, where: str, name: str, *kinds: Kind) -> list[Mistake]:
        """Return the mistake of naming something that none of these kinds has, if it is one."""
        names: list[str] = []
        not_loaded = ""
        for kind in kinds:
            try:
                registry().spec(kind, name)
            except UnknownName as error:
                names += error.available
                not_loaded = "".join(f"; not loaded: {failure}" for failure in error.failures)
            else:
                return []
        found = f"{shown(name)}, which is the name of no {' and no '.join(kinds)}"
        return [Mistake(where, found, one_of(name, names) + not_loaded)]

    def option_mistakes(self, name: str, options: Mapping[str, Any]) -> list[Mistake]:
        """Return the options that a phase or response does not have; if it has them all, why it cannot use a
        value."""
        found = registry()
        kinds: dict[Kind, Callable[[str], Any]] = {
            "broad phase": found.broad_phase,
            "narrow phase": found.narrow_phase,
            "response": found.response,
        }
        kind: Kind = next((each for each in kinds if not self.mistakes("", name, each)), "response")
        mistakes, what = [], "response" if kind == "response" else "phase"
        try:
            phase = kinds[kind](name)
            known = [parameter for parameter in inspect.signature(phase).parameters if parameter != "self"]
            for key in (key for key in options if key not in known):
                mistakes.append(
                    Mistake(f"options.{name}.{key}", "no option of this name", one_of(key, known))
                )
            if not mistakes:
                with calling(kind, name, "its constructor"):
                    phase(**options)
        except KinetileError as error:
            mistakes.append(Mistake(f"options.{name}", shown(options), f"what the {what} can use: {error}"))
        return mistakes

    def parameter_mistakes(self, name: str, parameters: Mapping[str, Any]) -> list[Mistake]:
        """Return what is wrong with these parameters for a recipe."""
        return recipes.parameter_mistakes(name, registry().scene(name), parameters)

    def make(self, name: str, parameters: Mapping[str, Any]) -> Scene:
        """Return the scene that a recipe makes."""
        return make_scene(name, **parameters)
