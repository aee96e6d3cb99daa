"""Features: the constants that a loop is composed with. Each is declared once, here; templates import it.

In a composed loop a feature is a constant, which ``run.compose`` derives from the scene and its phases. Code
under a test of a feature that is 0 is not compiled, nor is a call of a function marked ``only_with`` that
feature. Outside of a composed loop a feature has no value. CONTRIBUTING.md has this table.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, NoReturn, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])


class Feature(NamedTuple):
    """The loop's work with a feature, and the part of a scene or phase that sets it."""

    name: str
    does: str
    set_by: str

    def __bool__(self) -> NoReturn:
        raise TypeError(f"{self.name} has a value in a composed loop only")


FEATURES: dict[str, Feature] = {}


def _declare(name: str, does: str, set_by: str) -> bool:
    if name in FEATURES:
        raise TypeError(f"{name} is declared twice")
    FEATURES[name] = Feature(name, does, set_by)
    return cast(bool, FEATURES[name])


PAIRS = _declare("PAIRS", "predicts contacts of pairs", "a narrow phase for pairs")
BOUNDS = _declare(
    "BOUNDS", "computes ticks of contacts at the head of the queue only", "`soonest` of that phase"
)
WALLED = _declare("WALLED", "predicts contacts with walls", "a narrow phase for walls")
PERIODIC = _declare("PERIODIC", "counts images, and anchors old plans", "`periodic`")
ACCELERATIONS = _declare("ACCELERATIONS", "lays chords", "`gravity` or `acceleration`")
UNEQUAL = _declare("UNEQUAL", "lets two that have met meet again", "accelerations that differ")
RESTING = _declare("RESTING", "holds bodies on supports", "a response with the option `settle`")
RULES = _declare("RULES", "looks up the rule of a contact", "`responses`")
RESPONSES = _declare(
    "RESPONSES", "calls hooks of responses: it is their number", "responses that have a hook"
)
FOREIGN = _declare("FOREIGN", "ends at the fault of a response", "a response of another plugin")
PASSINGS = _declare("PASSINGS", "begins and ends passings", "the response `pass`")
SHAPES = _declare("SHAPES", "computes gaps between shapes", "`shapes`, with commands or the response `pass`")
COMMANDS = _declare("COMMANDS", "runs commands", "`commands`, or the first one by hand")
LIVING = _declare("LIVING", "inserts and removes bodies", "such commands, and `enter` of the broad phase")
AHEAD = _declare(
    "AHEAD", "prefetches what the next events read", "8,192 bodies, and `soon` of the broad phase"
)


NONE: Mapping[str, Any] = dict.fromkeys(FEATURES, 0)
"""The values of a loop without any feature."""


def values(**given: Any) -> dict[str, Any]:
    """Returns the features of a loop; raises TypeError if one is missing or unknown."""
    if given.keys() != FEATURES.keys():
        raise TypeError(f"features set: {sorted(given)}; there are {sorted(FEATURES)}")
    return given


def only_with(feature: bool) -> Callable[[F], F]:
    """Marks a hook or a template that returns nothing, above ``hook`` or ``template``: a loop without the
    feature does not call it."""

    def decorated(function: F) -> F:
        cast(Any, function).feature = cast(Any, feature).name
        return function

    return decorated
