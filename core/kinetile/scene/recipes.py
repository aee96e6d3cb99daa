"""Recipes: a recipe is a function that makes a scene, and its keyword arguments are the scene's parameters.

A recipe's signature is all there is to know about it: names, types (``int``, ``float``, ``str`` or ``bool``)
and defaults are read from it, for checking what a user gives and for telling what he could give. Which recipe
has which name is for ``kinetile.plugin.by_name`` to say.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, TypeAlias

from kinetile.errors import BadOption, Mistake, PhaseError, one_of
from kinetile.scene.checks import is_number, shown
from kinetile.scene.scene import Scene
from kinetile.scene.variants import relabelled

__all__ = [
    "REQUIRED",
    "Parameter",
    "Recipe",
    "complete_parameters",
    "follow_recipe",
    "parameter_mistakes",
    "parse_parameters",
    "recipe_parameters",
]

Recipe: TypeAlias = Callable[..., Scene]

REQUIRED = inspect.Parameter.empty
"""Stands where a parameter has no default."""

_NEEDED = {"int": "a whole number", "float": "a number", "str": "text", "bool": "true or false"}
_WORDS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


class Parameter(NamedTuple):
    """A parameter of a recipe: its name, its type ("int", "float", "str", "bool" or another), its default."""

    name: str
    type: str
    default: Any


def follow_recipe(name: str, recipe: Recipe, given: Mapping[str, Any]) -> Scene:
    """Return the scene that a recipe, called ``name``, makes of these parameters (its defaults for the rest).

    Raises BadOption for a parameter that it does not have or cannot use, SceneError for a scene with
    mistakes, PhaseError for what is no scene, and whatever the recipe itself raises.
    """
    mistakes = parameter_mistakes(name, recipe, given)
    if mistakes:
        raise BadOption("\n".join(f"scene {name!r}: {_as_sentence(mistake)}" for mistake in mistakes))
    parameters = complete_parameters(name, recipe, given)
    scene = recipe(**{key: value for key, value in parameters.items() if key in given})
    if not isinstance(scene, Scene):
        raise PhaseError(
            f"the recipe of the scene {name!r} returned {shown(scene)}; expected a kinetile.Scene"
        )
    return relabelled(scene, origin={"recipe": name, "parameters": parameters})


def complete_parameters(name: str, recipe: Recipe, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return all parameters of a recipe: the given ones, as its types have them, and defaults for the rest.

    They must be such as it has and can use (``parameter_mistakes``).
    """
    return {
        each.name: _convert(each, given[each.name]) if each.name in given else each.default
        for each in recipe_parameters(name, recipe)
    }


def recipe_parameters(name: str, recipe: Recipe) -> tuple[Parameter, ...]:
    """Return the parameters of a recipe, called ``name``, in the order of its signature.

    Raises PhaseError for a recipe whose signature hides its parameters.
    """
    parameters = []
    for each in inspect.signature(recipe).parameters.values():
        if each.kind not in (each.KEYWORD_ONLY, each.POSITIONAL_OR_KEYWORD):
            raise PhaseError(
                f"the recipe of the scene {name!r} gathers its parameters in {each.name!r}; "
                "expected parameters that can each be given by name"
            )
        annotation = each.annotation
        written = (
            annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
        )
        parameters.append(Parameter(each.name, written, each.default))
    return tuple(parameters)


def parse_parameters(name: str, recipe: Recipe, texts: Iterable[str]) -> dict[str, Any]:
    """Return the parameters that ``texts``, each "name=value", give to a recipe, called ``name``.

    Values are read as their parameter's type says. Raises BadOption, with a sentence for each mistake, for
    what cannot be read.
    """
    known = {each.name: each for each in recipe_parameters(name, recipe)}
    parameters: dict[str, Any] = {}
    sentences = []
    for text in texts:
        left, equals, value = text.partition("=")
        key = left.strip().replace("-", "_")
        if not equals or not key:
            sentences.append(f"a parameter is written name=value; found {text!r}")
        elif key not in known:
            sentences.append(_as_sentence(_unknown(left.strip(), list(known))))
        elif key in parameters:
            sentences.append(f"the parameter {key!r} is given twice; expected one value")
        else:
            parameters[key] = _parse(known[key], value.strip())
            if parameters[key] is REQUIRED:  # which here stands for "cannot be read"
                sentences.append(_as_sentence(_misfit(known[key], value.strip())))
    if sentences:
        raise BadOption("\n".join(f"scene {name!r}: {sentence}" for sentence in sentences))
    return parameters


def parameter_mistakes(name: str, recipe: Recipe, parameters: Mapping[str, Any]) -> list[Mistake]:
    """Return what is wrong with these parameters for a recipe, called ``name``."""
    known = {each.name: each for each in recipe_parameters(name, recipe)}
    mistakes = []
    for key, value in parameters.items():
        if key not in known:
            mistakes.append(_unknown(key, list(known)))
        elif _convert(known[key], value) is REQUIRED:
            mistakes.append(_misfit(known[key], value))
    for each in known.values():
        if each.default is REQUIRED and each.name not in parameters:
            needed = _NEEDED.get(each.type, "a value")
            mistakes.append(Mistake(f"parameters.{each.name}", "nothing", f"{needed}; it has no default"))
    return mistakes


def _as_sentence(mistake: Mistake) -> str:
    name = mistake.where.removeprefix("parameters.")
    return f"parameter {name!r}: found {mistake.found}; expected {mistake.expected}"


def _unknown(name: str, known: list[str]) -> Mistake:
    return Mistake(f"parameters.{name}", "no parameter of this name", one_of(name, known))


def _misfit(parameter: Parameter, value: object) -> Mistake:
    return Mistake(f"parameters.{parameter.name}", shown(value), _NEEDED[parameter.type])


def _convert(parameter: Parameter, value: Any) -> Any:
    """Return ``value`` as the parameter's type, or REQUIRED if it is not of that type."""
    if parameter.type == "int" and not isinstance(value, bool):
        try:
            return operator.index(value)
        except TypeError:
            return REQUIRED
    if parameter.type == "float" and is_number(value):
        try:
            return float(value)
        except OverflowError:
            return REQUIRED
    fits = {"int": False, "float": False, "str": isinstance(value, str), "bool": isinstance(value, bool)}
    return value if fits.get(parameter.type, True) else REQUIRED


def _parse(parameter: Parameter, text: str) -> Any:
    """Return the value that ``text`` stands for, or REQUIRED if it cannot be read."""
    try:
        if parameter.type == "int":
            return int(text) if text.lstrip("+-").isdigit() else _whole(float(text))
        if parameter.type == "float":
            return float(text)
    except (ValueError, OverflowError):
        return REQUIRED
    if parameter.type == "bool":
        return _WORDS.get(text.casefold(), REQUIRED)
    return text


def _whole(number: float) -> int:
    """Return the integer that 1e4 is; raise ValueError for 1.5."""
    if not number.is_integer():
        raise ValueError(number)
    return int(number)
