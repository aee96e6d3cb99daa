"""Parameters of named choices: the options of phases, responses and observables, and the parameters of
recipes. The signature of the class or function gives all of them: names, types and defaults.
"""

import inspect
import re
from typing import Any, NamedTuple

from kinetile.errors import PhaseError
from kinetile.plugin.calling import calling
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import PluginKind

REQUIRED = inspect.Parameter.empty
"""The default of a parameter without one."""


class Parameter(NamedTuple):
    """A parameter: its name, its type as written ("int", "tuple[float, ...]", "" without one), its default,
    and its line under ``Args:`` of the docstring: meaning, unit, allowed values."""

    name: str
    type: str
    default: Any
    meaning: str = ""


def parameters_of(kind: PluginKind, name: str) -> tuple[Parameter, ...]:
    """Returns the options of a phase, response or observable, or a recipe's parameters, as in its signature.
    Raises UnknownName, and PhaseError if it does not import, or if a recipe's signature hides some."""
    target = registry().target(kind, name)
    with calling(kind, name, "its signature"):
        signature = inspect.signature(target)
    meanings, parameters = _meanings(target), []
    for each in signature.parameters.values():
        if each.kind in (each.KEYWORD_ONLY, each.POSITIONAL_OR_KEYWORD):
            annotation = "" if each.annotation is REQUIRED else each.annotation
            written = annotation.__name__ if isinstance(annotation, type) else str(annotation)
            parameters.append(Parameter(each.name, written, each.default, meanings.get(each.name, "")))
        elif kind == "scene":
            raise PhaseError(
                f"the recipe of the scene {name!r} gathers its parameters in {each.name!r}; "
                "expected parameters that can each be given by name"
            )
    return tuple(parameters)


def _meanings(target: object) -> dict[str, str]:
    """Returns the lines under ``Args:`` of a docstring, by the names before their colons."""
    _, _, section = inspect.cleandoc(target.__doc__ or "").partition("\nArgs:\n")
    lines = re.findall(r"^    (\w+): (.+(?:\n {5,}.+)*)", section.partition("\n\n")[0], re.MULTILINE)
    return {name: " ".join(text.replace("``", "").split()) for name, text in lines}
