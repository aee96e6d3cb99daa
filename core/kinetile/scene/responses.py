"""Responses: what happens at a contact, said by kind of body.

Each body is of a *kind*, a name or a small whole number. A table says by name what happens where two kinds
meet, and where a kind meets a wall (``"wall"``); ``"*"`` stands for every kind. What is said of the very two
kinds counts first, then what is said of one and ``"*"``, then ``("*", "*")``; what nothing is said of is
elastic. A rule for walls is one with ``"wall"``: ``("*", "*")`` is about bodies.

``elastic`` and ``pass`` are the kernel's own. ``pass`` changes no plan: the contact is the beginning of a
passing, which ends when the two part or one of them goes; walls cannot be passed. All others are plugins
(``kinetile.plugin.specs.ResponseSpec``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.errors import Mistake
from kinetile.scene.checks import ANY, WALL, is_kind, shown

__all__ = ["ELASTIC", "PASS", "Kind", "Pair", "Response", "Rules", "read_rules", "table"]

Kind: TypeAlias = str | int
Pair: TypeAlias = tuple[Kind, Kind]

ELASTIC, PASS = "elastic", "pass"

_A_KIND = "the name of a kind, or a whole number from 0 to 2**31 - 1"


class Response:
    """A response by name, with its options: ``Response("restitution", e=0.9, contact_time=1e-6)``."""

    def __init__(self, name: str, /, **options: Any) -> None:
        self.name = name
        self.options: Mapping[str, Any] = dict(options)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Response) and (self.name, self.options) == (other.name, other.options)

    def __hash__(self) -> int:
        return hash((self.name, tuple(sorted(self.options))))

    def __repr__(self) -> str:
        options = "".join(f", {name}={value!r}" for name, value in sorted(self.options.items()))
        return f"Response({self.name!r}{options})"


class Rules(NamedTuple):
    """What a scene says of kinds.

    Attributes:
        kinds: the kinds there are.
        kind: (n,) which of them each body is of.
        responses: what is said of them, two kinds and a response.
        passing: (kinds, kinds + 1) which pass through each other; nobody through a wall.
    """

    kinds: tuple[Kind, ...]
    kind: npt.NDArray[np.int64]
    responses: tuple[tuple[Pair, Response], ...]
    passing: npt.NDArray[np.bool_]


def read_rules(
    kind: Any, responses: Any, bodies: int, coming: Iterable[Any], mistakes: list[Mistake]
) -> Rules:
    """Return what a scene of so many bodies says of kinds, and of the kinds of those who come later; append
    what is wrong with it."""
    rules = _read_responses(responses, mistakes)
    kinds, number = _read_kinds(
        kind, bodies, [*coming, *(each for pair, _ in rules for each in pair)], mistakes
    )
    rows = table(kinds, rules, mistakes)
    return Rules(kinds, number, rules, np.array([[each.name == PASS for each in row] for row in rows]))


def _read_kinds(
    given: Any, bodies: int, others: Iterable[Any], mistakes: list[Mistake]
) -> tuple[tuple[Kind, ...], npt.NDArray[np.int64]]:
    """Return the kinds there are, and (n,) which of them each body is of.

    ``given`` is a kind for all bodies, a sequence with one for each, or None; ``others`` are kinds that are
    named elsewhere. The kinds are in the order in which they come up; where none does there is one, 0.
    """
    none = given is None
    if none:
        each: list[Any] = []
    elif isinstance(given, str | int | np.integer):
        each = [given] * bodies
    else:
        try:
            each = list(given)
        except TypeError:
            each = [given]
    if not none and len(each) != bodies:
        said = f"{len(each)} {'kind' if len(each) == 1 else 'kinds'}"
        mistakes.append(Mistake("kind", said, f"one for each of the {bodies} bodies, or one for all"))
        each = []
    kinds: dict[Kind, int] = {}
    numbers = []
    for number, name in enumerate(each):
        if not is_kind(name):
            mistakes.append(Mistake(f"bodies[{number}].kind", shown(name), _A_KIND))
            name = 0
        name = name if isinstance(name, str) else int(name)
        numbers.append(kinds.setdefault(name, len(kinds)))
    for name in others:
        if is_kind(name):
            kinds.setdefault(name if isinstance(name, str) else int(name), len(kinds))
    kind = np.array(numbers if numbers else [0] * bodies, dtype=np.int64)
    return tuple(kinds) or (0,), kind


def _read_responses(given: Any, mistakes: list[Mistake]) -> tuple[tuple[Pair, Response], ...]:
    """Return the rules of a table, each with its two kinds in one order, sorted; append what is wrong with
    it."""
    if given is None:
        return ()
    if isinstance(given, str | Response):
        given = {(ANY, ANY): given}
    if isinstance(given, tuple):  # as a scene has them
        given = dict(given)
    if not isinstance(given, Mapping):
        wanted = "a mapping from two kinds to a response, such as {('ball', 'sensor'): 'pass'}"
        mistakes.append(Mistake("responses", shown(given), wanted))
        return ()
    rules: dict[Pair, Response] = {}
    for between, what in given.items():
        where = f"responses[{shown(between)}]"
        pair = between if isinstance(between, tuple) and len(between) == 2 else ()
        named = sum(each == WALL for each in pair)
        if not pair or named > 1 or not all(is_kind(each) or each in (WALL, ANY) for each in pair):
            mistakes.append(
                Mistake(where, shown(between), f"two kinds, or one and {WALL!r}; {ANY!r} for any")
            )
            continue
        response = Response(what) if isinstance(what, str) else what
        if not isinstance(response, Response):
            mistakes.append(Mistake(where, shown(what), "the name of a response, or kinetile.Response(...)"))
        elif response.name == PASS and WALL in pair:
            mistakes.append(Mistake(where, "pass", "another response: walls cannot be passed"))
        else:
            ordered = _ordered(*pair)
            if rules.setdefault(ordered, response) != response:
                mistakes.append(
                    Mistake(where, repr(response), f"one response, and {rules[ordered]!r} is another")
                )
    return tuple(sorted(rules.items(), key=lambda rule: [_order(each) for each in rule[0]]))


def _order(kind: Kind) -> tuple[bool, bool, int, str]:
    """Where a kind stands in a pair: whole numbers, names, "*", "wall"."""
    text = isinstance(kind, str)
    return kind == WALL, kind == ANY, 0 if text else int(kind), str(kind) if text else ""


def _ordered(a: Kind, b: Kind) -> Pair:
    return (a, b) if _order(a) <= _order(b) else (b, a)


def table(
    kinds: Sequence[Kind], rules: Iterable[tuple[Pair, Response]], mistakes: list[Mistake] | None = None
) -> list[list[Response]]:
    """Return what happens where each kind meets each, and a wall (the last column).

    Where two rules say different things of two kinds, each with "*", that is appended as a mistake.
    """
    said = dict(rules)
    elastic = Response(ELASTIC)
    rows = []
    for a in kinds:
        row = []
        for b in (*kinds, WALL):
            walls = said.get((ANY, WALL), elastic)
            one, two = said.get(_ordered(a, ANY)), None if b == WALL else said.get(_ordered(b, ANY))
            found = said.get(_ordered(a, b))
            if found is None and b == WALL:
                found = walls
            elif found is None:
                if mistakes is not None and one and two and one != two and _order(a) < _order(b):
                    where, what = f"responses[{(a, b)!r}]", f"nothing, {one!r} and {two!r} by their kinds"
                    mistakes.append(Mistake(where, what, "a response for these two"))
                found = one or two or said.get((ANY, ANY), elastic)
            row.append(found)
        rows.append(row)
    return rows
