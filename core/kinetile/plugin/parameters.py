"""Parameters of what is chosen by name: the options of phases, responses and observables, and the parameters
of recipes. The signature of the class or function contains all that is needed: names, types and defaults.
"""

from __future__ import annotations

import inspect
from typing import Any, NamedTuple

from kinetile.errors import PhaseError
from kinetile.plugin.calling import calling
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import Kind

REQUIRED = inspect.Parameter.empty
"""The default of a parameter without one."""


class Parameter(NamedTuple):
    """A parameter: its name, its type as written ("int", "tuple[float, ...]", "" for none), its default."""

    name: str
    type: str
    default: Any


def parameters_of(kind: Kind, name: str) -> tuple[Parameter, ...]:
    """Returns the options of a phase, response or observable, or a recipe's parameters, as in its signature.
    Raises UnknownName, and PhaseError for what does not import, or a recipe whose signature hides some."""
    target = registry().target(kind, name)
    with calling(kind, name, "its signature"):
        signature = inspect.signature(target)
    parameters = []
    for each in signature.parameters.values():
        if each.kind in (each.KEYWORD_ONLY, each.POSITIONAL_OR_KEYWORD):
            annotation = "" if each.annotation is REQUIRED else each.annotation
            written = annotation.__name__ if isinstance(annotation, type) else str(annotation)
            parameters.append(Parameter(each.name, written, each.default))
        elif kind == "scene":
            raise PhaseError(
                f"the recipe of the scene {name!r} gathers its parameters in {each.name!r}; "
                "expected parameters that can each be given by name"
            )
    return tuple(parameters)
