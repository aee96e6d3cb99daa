"""What ``prepare`` returned is looked through before anything is allocated or compiled from it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields
from typing import Any, TypeAlias, get_args

import numpy as np

from kinetile.errors import PhaseError
from kinetile.kernel.compiled import is_hook
from kinetile.plugin.protocols import BroadPhaseParts, ContactDistance, PairParts, ResponseParts, WallParts

__all__ = ["check_parts"]

MOST = 2**31 - 1
"""Pairs and bodies are numbered in 32 bits."""

PLAIN = ("arrange", "audit", "draw")
OPTIONAL = ("soonest", "enter", "leave", "touch", "part", "respond")


Parts: TypeAlias = BroadPhaseParts | PairParts | WallParts | ResponseParts


def check_parts(who: str, parts: Parts) -> None:
    """Raise PhaseError, with everything that is wrong, unless the parts can be composed."""
    wrong = list(_mistakes(parts))
    if wrong:
        raise PhaseError(f"{who}: prepare returned parts that do not fit: {'; '.join(wrong)}")


def _mistakes(parts: Parts) -> Iterator[str]:
    hooks = tuple(field.name for field in fields(parts))
    if isinstance(parts, PairParts):
        hooks = ("meet", "collide", "soonest", "touch", "part")
        if parts.contact_distance not in get_args(ContactDistance):
            expected = " or ".join(map(repr, get_args(ContactDistance)))
            yield f"contact_distance is {_shown(parts.contact_distance)}; expected {expected}"
    if isinstance(parts, BroadPhaseParts):
        yield from _broad_mistakes(parts)
        hooks = ("near", "build", "repair", "replan", "enter", "leave")
    if isinstance(parts, ResponseParts):
        hooks = ("respond",)
        numbers: Any = parts.numbers
        fine = isinstance(numbers, tuple) and len(numbers) <= 4
        if not fine or not all(isinstance(n, int | float) and math.isfinite(n) for n in numbers):
            yield f"numbers is {_shown(numbers)}; expected a tuple of up to four finite numbers"
    for name in hooks:
        if name in OPTIONAL and getattr(parts, name) is None:
            continue
        if not is_hook(getattr(parts, name)):
            yield f"{name} is {_shown(getattr(parts, name))}; expected a function marked with toolbox.hook"


def _broad_mistakes(parts: BroadPhaseParts) -> Iterator[str]:
    if (parts.enter is None) != (parts.leave is None):
        there, missing = ("enter", "leave") if parts.leave is None else ("leave", "enter")
        yield f"there is {there} and no {missing}; expected both or neither"
    for name in ("pairs", "room"):
        number = getattr(parts, name)
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number <= MOST:
            yield f"{name} is {_shown(number)}; expected a whole number from 0 to {MOST}"
    state = parts.state
    if not isinstance(state, tuple) or not hasattr(state, "_fields"):
        yield f"state is {_shown(state)}; expected a NamedTuple of arrays"
    else:
        odd = [f for f, a in zip(state._fields, state, strict=True) if not isinstance(a, np.ndarray)]
        if odd or not state:
            found = f"{odd[0]} is {_shown(getattr(state, odd[0]))}" if odd else "it is empty"
            yield f"state is to be a NamedTuple of arrays, at least one, and {found}"
    for name in PLAIN:
        function = getattr(parts, name)
        if function is not None and not callable(function):
            yield f"{name} is {_shown(function)}; expected a function or None"
    for ticks in parts.ticks if isinstance(parts.ticks, tuple | list) else (parts.ticks,):
        if not isinstance(ticks, np.ndarray) or ticks.dtype != np.int64:
            yield f"ticks has {_shown(ticks)} in it; expected arrays of int64"
    faults: Any = parts.faults
    wanted = "expected a tuple of sentences, in which {a} and {b} stand for what blame was given"
    if not isinstance(faults, tuple | list):
        yield f"faults is {_shown(faults)}; {wanted}"
        return
    yield from (f"faults has {_shown(said)} in it; {wanted}" for said in faults if not _is_sentence(said))


def _is_sentence(sentence: object) -> bool:
    """Whether this is text that can be filled in with two numbers."""
    if not isinstance(sentence, str):
        return False
    try:
        return bool(sentence.format(a=0, b=0))
    except (LookupError, ValueError, AttributeError):
        return False


def _shown(value: Any) -> str:
    """Return a value briefly."""
    text = repr(value)
    return text if len(text) <= 60 else f"a {type(value).__name__}"
