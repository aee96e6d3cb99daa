"""Scenes by name: recipes that plugins provide, and files that name recipes and phases. A recipe is a
function that makes a scene; the types of its keyword arguments (``int``, ``float``, ``str``, ``bool``,
``tuple[int, ...]`` or ``tuple[float, ...]``) serve to check a user's values."""

import operator
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from kinetile.errors import BadOption, KinetileError, Mistake, PhaseError, answering, key_of
from kinetile.plugin.calling import calling
from kinetile.plugin.choices import read_value
from kinetile.plugin.parameters import REQUIRED, Parameter, parameters_of
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import PluginKind
from kinetile.scene.checks import is_number, shown
from kinetile.scene.scene import Scene, relabelled

_SEVERAL = {"tuple[int, ...]": "int", "tuple[float, ...]": "float"}
"""Types of several numbers, and the type of one number."""

_NEEDED = {
    "int": "a whole number",
    "float": "a number",
    "str": "text",
    "bool": "true or false",
    "tuple[int, ...]": "whole numbers, such as [30, 70], or the text '30, 70'",
    "tuple[float, ...]": "numbers, such as [0.5, 0.7], or the text '0.5, 0.7'",
}


def holds_several(parameter: Parameter) -> bool:
    """Returns True if one value of a parameter is itself a list: of numbers, or by its annotation."""
    words = re.findall(r"\w+", parameter.type.lower())
    return any(word in words for word in ("tuple", "list", "sequence", "iterable", "collection", "ndarray"))


SHARED_PARAMETERS = (
    Parameter("periodic", "str", "", "axes along which the arena repeats, without walls: x, y or xy"),
    Parameter(
        "gravity", "tuple[float, ...]", (), "acceleration of all bodies, gx,gy: length per time squared"
    ),
)
"""Parameters of every recipe: the periodic axes of its arena, and gravity."""


@answering
def make_scene(name: str, /, **parameters: Any) -> Scene:
    """Returns the scene that a recipe makes from these parameters (its defaults for the rest); ``periodic``
    ("x", "y" or "xy") makes its arena periodic, and with ``gravity``, (gx, gy), its bodies fall. Its
    ``origin`` is {"recipe": name, "parameters": {...}}, defaults included. Raises UnknownName, BadOption for
    a parameter that the recipe cannot use, SceneError for mistakes, and PhaseError."""
    recipe = registry().target("scene", name)
    with np.errstate(all="ignore"), calling("scene", name, "the recipe"):  # the scene checks its numbers
        mistakes = parameter_mistakes(name, parameters)
        if mistakes:
            raise BadOption("\n".join(f"scene {name!r}: {_as_sentence(mistake)}" for mistake in mistakes))
        complete = complete_parameters(name, parameters)
        shared = {each.name for each in SHARED_PARAMETERS} - {each.name for each in recipe_parameters(name)}
        scene = recipe(**{key: complete[key] for key in complete if key in parameters and key not in shared})
        if not isinstance(scene, Scene):
            raise PhaseError(
                f"the recipe of the scene {name!r} returned {shown(scene)}; expected a kinetile.Scene"
            )
        given = {name: complete[name] for name in shared if complete.get(name)}
        scene = scene.replace(**given) if given else scene
        return relabelled(scene, origin={"recipe": name, "parameters": complete})


def complete_parameters(name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Returns all parameters of the recipe called ``name``: the given ones, which have no mistakes
    (``parameter_mistakes``), by type, and defaults. UnknownName; PhaseError if its signature hides them."""
    return {
        each.name: _convert(each, given[each.name]) if each.name in given else each.default
        for each in accepted_parameters(name)
        if not any(each is shared for shared in SHARED_PARAMETERS) or each.name in given
    }


def recipe_parameters(name: str) -> tuple[Parameter, ...]:
    """Returns the parameters of the recipe called ``name``, in the order of its signature; UnknownName, and
    PhaseError if its signature hides them."""
    return parameters_of("scene", name)


def accepted_parameters(name: str) -> tuple[Parameter, ...]:
    """Returns the parameters that a recipe accepts: its own, and the ``SHARED_PARAMETERS`` that it lacks."""
    own = recipe_parameters(name)
    names = {each.name for each in own}
    return (*own, *(each for each in SHARED_PARAMETERS if each.name not in names))


def parse_parameters(name: str, texts: Iterable[str]) -> dict[str, Any]:
    """Returns the parameters of the recipe called ``name`` from ``texts``, each "name=value", read by their
    types; UnknownName, and BadOption with a sentence for each unreadable one."""
    known = {each.name: each for each in accepted_parameters(name)}
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
            parameters[key] = _convert(known[key], _read(known[key], value))
            if parameters[key] is REQUIRED:  # here it means "cannot be read"
                sentences.append(_as_sentence(_misfit(known[key], value.strip())))
    if sentences:
        raise BadOption("\n".join(f"scene {name!r}: {sentence}" for sentence in sentences))
    return parameters


def parameter_mistakes(name: str, parameters: Mapping[str, Any]) -> list[Mistake]:
    """Returns the mistakes in these parameters for the recipe called ``name``."""
    known = {each.name: each for each in accepted_parameters(name)}
    mistakes = []
    for key, value in parameters.items():
        if key not in known:
            mistakes.append(_unknown(key, list(known), value))
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


def _unknown(name: str, known: list[str], value: Any = None) -> Mistake:
    return Mistake(f"parameters.{name}", "no parameter of this name", key_of(name, known, value))


def _misfit(parameter: Parameter, value: object) -> Mistake:
    return Mistake(f"parameters.{parameter.name}", shown(value), _NEEDED[parameter.type])


def _convert(parameter: Parameter, value: Any) -> Any:
    """Returns ``value`` as the parameter's type, or REQUIRED if it is not of that type."""
    if parameter.type in _SEVERAL:
        one = parameter._replace(type=_SEVERAL[parameter.type])
        if isinstance(value, str):
            value = [_read(one, text) for text in value.strip("()[] ").split(",") if text.strip()]
        values = value if isinstance(value, list | tuple) else [value]
        several = tuple(_convert(one, each) for each in values)
        return REQUIRED if REQUIRED in several else several
    try:
        if parameter.type == "int" and not isinstance(value, bool):
            return operator.index(value)
        if parameter.type == "float" and is_number(value):
            return float(value)
    except (TypeError, OverflowError):
        return REQUIRED
    fits = {"int": False, "float": False, "str": isinstance(value, str), "bool": isinstance(value, bool)}
    return value if fits.get(parameter.type, True) else REQUIRED


def _read(parameter: Parameter, text: str) -> Any:
    """Returns the value of a text for a parameter: 1e4 is a whole number if the type is."""
    value = read_value(text.strip()) if parameter.type in ("int", "float", "bool") else text.strip()
    is_whole = parameter.type == "int" and isinstance(value, float) and value.is_integer()
    return int(value) if is_whole else value


def known_options(name: str, *kinds: PluginKind) -> list[str]:
    """Returns the options of the plugin of this name and one of these kinds; [] without a plugin."""
    for kind in kinds:
        with suppress(KinetileError):
            return [each.name for each in parameters_of(kind, name)]
    return []
