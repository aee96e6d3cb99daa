"""Functions that a run calls at contacts, in their order, each at its exact time.

The loop stops after such a contact, the run calls the function, and continues. Commands of the function are
commands of that moment, as between two runs, so a recorded run is replayed without the function.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.kernel.loop.bookkeeping import ANY_BEGIN, ENDS
from kinetile.run.advance import Event
from kinetile.run.arguments import FLAG_OF_SIDE, flags_between, is_wall, kinds_between
from kinetile.run.engine.engine import WatchedContacts
from kinetile.scene.checks import ANY_KIND as EVERY
from kinetile.scene.checks import shown
from kinetile.scene.responses import Kind

AtContact: TypeAlias = Callable[[Event], object]
OnContact: TypeAlias = AtContact | Mapping[Any, AtContact]
"""A function of every contact; or functions by kinds: one kind, or two, or a kind and ``"wall"`` or a side of
the arena; ``"*"`` is every kind. With two kinds, the body of the first kind comes first."""


class _Call(NamedTuple):
    """A function, the contacts that call it (``WatchedContacts.kinds``), and its key."""

    function: AtContact
    those: npt.NDArray[np.uint8]
    named: tuple[Kind, ...]

    def ordered(self, event: Event) -> Event:
        """Returns an event with its bodies in the order of the key."""
        if all(name in (EVERY, kind) for name, kind in zip(self.named, event.kinds, strict=False)):
            return event
        seen = event._replace(bodies=event.bodies[::-1], kinds=event.kinds[::-1])
        return seen._replace(normal=_turned(event.normal), impulse=_turned(event.impulse))


def _turned(vector: tuple[float, float] | None) -> tuple[float, float] | None:
    return None if vector is None else (0.0 - vector[0], 0.0 - vector[1])  # no -0.0


@dataclass(frozen=True)
class Calls:
    """The functions of a run, with all their contacts."""

    each: tuple[_Call, ...]
    kinds: tuple[Kind, ...]
    watched: WatchedContacts

    def __call__(self, event: Event) -> bool:
        """Calls all functions of a contact; returns True if one of them stops the run."""
        there = [*map(self.kinds.index, event.kinds or (0,) * len(event.bodies)), len(self.kinds)]
        flag = FLAG_OF_SIDE[event.wall] if event.wall else ENDS if event.kind == "part" else ANY_BEGIN
        called = [call for call in self.each if call.those[there[0], there[1]] & flag]
        said = [call.function(call.ordered(event)) for call in called]
        return any(isinstance(each, bool | np.bool_) and bool(each) for each in said)


def read_calls(
    on_contact: OnContact | None, on_part: OnContact | None, known: tuple[Kind, ...]
) -> Calls | None:
    """Returns the functions of a run. TypeError for anything else, ValueError for unknown kinds."""
    calls = [*_read("on_contact", on_contact, known), *_read("on_part", on_part, known)]
    if not calls:
        return None
    of_all = np.zeros((len(known), len(known) + 1), np.uint8)
    for call in calls:
        of_all |= call.those
    return Calls(tuple(calls), known, WatchedContacts(of_all))


def _read(where: str, given: OnContact | None, known: tuple[Kind, ...]) -> list[_Call]:
    if given is None:
        return []
    calls = []
    for key, function in given.items() if isinstance(given, Mapping) else [(EVERY, given)]:
        named = kinds_between(key, known, where)
        if not callable(function) or isinstance(function, type):
            raise TypeError(f"{where}: for {shown(key)} it has {shown(function)}, which is no function")
        those = flags_between(named, known)
        at_wall = any(is_wall(each, known) for each in named)
        if where == "on_part":
            if at_wall:
                raise ValueError(f"on_part: walls cannot be passed; found {shown(key)}")
            those = ENDS * those
            those[:, -1] = 0
        calls.append(_Call(function, those, () if at_wall else named))
    return calls
