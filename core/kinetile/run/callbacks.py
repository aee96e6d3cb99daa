"""Functions that a run calls at contacts, in their order, each at its exact time.

The loop stops after such a contact (``StopAt``), the function is called, and the run goes on. What it orders
is an order of that very moment, as between two runs, so a recorded run is replayed without it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.kernel.tables import OFFER, record_table
from kinetile.run.advance import Event
from kinetile.run.arguments import meetings
from kinetile.run.engine.engine import WatchedContacts
from kinetile.scene.checks import WALL, shown
from kinetile.scene.responses import Kind, find_kind

AtContact: TypeAlias = Callable[[Event], object]
OnContact: TypeAlias = AtContact | Mapping[Any, AtContact]
"""A function of every contact; or functions by kinds: of one kind, or two, or a kind and ``"wall"``."""


@dataclass(frozen=True)
class Calls:
    """The functions, each with the contacts for which it is called (``WatchedContacts.kinds``)."""

    functions: tuple[tuple[npt.NDArray[np.bool_], AtContact], ...]
    kinds: Sequence[Kind]

    def watched(self, numbers: int) -> WatchedContacts:
        """Returns the contacts of all functions; ``numbers`` of bodies have been given."""
        many = len(self.kinds)
        of_any = np.any([np.zeros((many, many + 1)), *(those for those, _ in self.functions)], axis=0)
        return WatchedContacts(np.zeros(numbers, dtype=np.uint8), record_table(OFFER, 0), False, of_any)

    def __call__(self, event: Event) -> bool:
        """Calls what there is for a contact; returns whether one of them says that the run is to stop."""
        there = [*map(self.kinds.index, event.kinds or (0,) * len(event.bodies)), len(self.kinds)]
        said = [function(event) for those, function in self.functions if those[there[0], there[1]]]
        return any(isinstance(each, bool | np.bool_) and bool(each) for each in said)


def read_calls(given: OnContact | None, known: Sequence[Kind]) -> Calls | None:
    """Returns the functions of ``on_contact``. TypeError for what is none, ValueError for unknown kinds."""
    if given is None:
        return None
    if not isinstance(given, Mapping):
        return Calls(((np.ones((len(known), len(known) + 1), dtype=np.bool_), given),), known)
    functions, all_kinds = list[tuple[npt.NDArray[np.bool_], AtContact]](), (*known, WALL)
    for key, function in given.items():
        two = key if isinstance(key, tuple) else (key,)
        places = [all_kinds.index(find_kind(kind, all_kinds, "on_contact")) for kind in two]
        if not 0 < len(places) <= 2 or min(places) == len(known):
            raise ValueError(f"on_contact: expected a kind, two, or a kind and {WALL!r}; found {shown(key)}")
        if not callable(function) or isinstance(function, type):
            raise TypeError(f"on_contact: for {shown(key)} it has {shown(function)}, which is no function")
        functions.append((meetings(len(known), *places), function))
    return Calls(tuple(functions), known)
