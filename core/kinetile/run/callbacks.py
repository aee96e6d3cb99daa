"""Functions that a run calls at contacts, in their order, each at its exact time.

The loop stops after such a contact (``StopAt``), the function is called, and the run goes on. What it orders
is an order of that very moment, as between two runs, so a recorded run is replayed without it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from kinetile.run.advance import Event
from kinetile.run.arguments import StopAt, read_kinds
from kinetile.scene.checks import WALL, shown
from kinetile.scene.responses import Kind

AtContact: TypeAlias = Callable[[Event], object]
OnContact: TypeAlias = AtContact | Mapping[Any, AtContact]
"""A function of every contact; or functions by kinds: of one kind, or two, or a kind and ``"wall"``."""


@dataclass(frozen=True)
class Calls:
    """The functions, each with what it is called for: None for every contact, else kinds, sorted."""

    functions: tuple[tuple[tuple[str, ...] | None, AtContact], ...]
    stop: StopAt

    def __call__(self, event: Event) -> bool:
        """Calls what there is for a contact; returns whether one of them says that the run is to stop."""
        there = [repr(kind) for kind in event.kinds or (0,) * len(event.bodies)]
        there += [WALL] if event.wall is not None else []
        stops = False
        for kinds, function in self.functions:
            met = kinds is None or (kinds[0] in there if len(kinds) == 1 else kinds == tuple(sorted(there)))
            said = function(event) if met else False
            stops = (isinstance(said, bool | np.bool_) and bool(said)) or stops
        return stops


def read_calls(given: OnContact | None, known: Sequence[Kind]) -> Calls | None:
    """Returns the functions of ``on_contact``. TypeError for what is none, ValueError for unknown kinds."""
    if given is None:
        return None
    if not isinstance(given, Mapping):
        return Calls(((None, given),), StopAt())
    functions, kinds = list[tuple[tuple[str, ...] | None, AtContact]](), list[Kind]()
    for key, function in given.items():
        two = key if isinstance(key, tuple) else (key,)
        of_bodies = read_kinds([kind for kind in two if kind != WALL], known, "on_contact")
        if not of_bodies or len(two) > 2:
            raise ValueError(f"on_contact: expected a kind, two, or a kind and {WALL!r}; found {shown(key)}")
        if not callable(function) or isinstance(function, type):
            raise TypeError(f"on_contact: for {shown(key)} it has {shown(function)}, which is no function")
        functions.append((tuple(sorted(kind if kind == WALL else repr(kind) for kind in two)), function))
        kinds.append(of_bodies[0])
    return Calls(tuple(functions), StopAt(kinds=kinds))
