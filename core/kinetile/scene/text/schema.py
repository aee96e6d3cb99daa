"""The keys of a scene file and the types of their values.

pydantic compares a file's tables with the models below, strictly: no text for a number, no true for 1, whole
numbers where numbers are wanted, and no key that is not here. What it finds becomes mistakes in the words
of the file, one for each key.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kinetile.errors import Mistake, nearest, one_of
from kinetile.scene.checks import LIMIT, shown

__all__ = ["Place", "expected", "find_faults", "written"]

_PLAIN = re.compile(r"[A-Za-z0-9_-]{1,60}")

Place: TypeAlias = tuple[str | int, ...]
"""Where a value stands in a file: ("bodies", 3, "radius")."""

_MOST = 100
"""How many entries a table of options or parameters, and a list of phases, may have."""

_LISTS = ("bodies", "turns", "commands", "responses")

_Few = Field(max_length=_MOST)
_Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
_Moment = Annotated[list[int], Field(min_length=3, max_length=3)]


class _Table(BaseModel):
    model_config = ConfigDict(
        extra="forbid", strict=True, alias_generator=lambda name: name.replace("_", "-"), defer_build=True
    )


_Kind: TypeAlias = Any  # which values are kinds is for the scene to say


class _Turn(_Table):
    time: float
    velocity: _Pair


class _Body(_Table):
    position: _Pair
    velocity: _Pair = [0.0, 0.0]
    radius: float
    mass: float = 1.0
    kind: _Kind = 0
    turns: list[_Turn] = []


class _Insertion(_Table):
    position: _Pair
    velocity: _Pair = [0.0, 0.0]
    radius: float
    mass: float = 1.0
    body: int = -1
    kind: _Kind | None = None


class _Command(_Table):
    time: float
    at: _Moment | None = None
    insert: _Insertion | None = None
    remove: int | None = None
    turn: int | None = None
    velocity: _Pair | None = None


class _Response(_Table):
    between: Annotated[list[_Kind], Field(min_length=2, max_length=2)]
    response: str
    options: Annotated[dict[str, Any], _Few] = {}


class _File(_Table):
    arena: _Pair | None = None
    start: float = 0.0
    until: float | None = None
    end: _Moment | None = None
    broad_phase: str | None = None
    narrow_phases: Annotated[list[str], _Few] | None = None
    options: Annotated[dict[str, Annotated[dict[str, Any], _Few]], _Few] = {}
    recipe: str | None = None
    parameters: Annotated[dict[str, Any], _Few] = {}
    unit: float | None = None
    bodies: list[_Body] | None = None
    commands: list[_Command] = []
    responses: list[_Response] = []
    kinds: list[_Kind] | None = None


_EXPECTED = {
    "arena": "[width, height], two finite numbers greater than 0",
    "start": "a finite number",
    "until": "a finite number",
    "end": "[epoch, tick, contacts], three whole numbers",
    "broad-phase": "the name of a broad phase",
    "narrow-phases": "a list of names of narrow phases",
    "options": "a table for each phase, such as [options.sap-1d]",
    "recipe": "the name of a recipe",
    "parameters": "a table of the recipe's parameters",
    "bodies": "[[bodies]] tables",
    "position": "[x, y], two finite numbers",
    "velocity": "[vx, vy], two finite numbers",
    "radius": "a finite number greater than 0",
    "mass": "a number greater than 0, or inf",
    "kind": "the name of a kind, or a whole number",
    "kinds": "a list of all kinds of bodies",
    "responses": "[[responses]] tables",
    "between": 'two kinds, or one and "wall"; "*" for any',
    "response": "the name of a response",
    "turns": "[[bodies.turns]] tables",
    "time": "a finite number",
    "unit": "a power of two from 2**-900 to 1",
    "commands": "[[commands]] tables",
    "at": "[epoch, tick, contacts], three whole numbers",
    "insert": "a table with position, velocity, radius and mass",
    "remove": "the number of a body",
    "turn": "the number of a body",
    "body": "the number of a body",
}


def expected(key: str) -> str:
    """Return what is expected of the value of a key."""
    return _EXPECTED[key]


def find_faults(tables: Mapping[str, Any]) -> tuple[list[Mistake], set[Place]]:
    """Compare a file's tables with what a scene may hold.

    Returns the mistakes, and the places of the values that are missing or of a wrong type, and so of no use.
    """
    try:
        _File.model_validate(tables)
    except ValidationError as error:
        found = [
            (detail["type"], detail["loc"]) for detail in error.errors(include_url=False, include_input=False)
        ]
    else:
        found = []
    mistakes: dict[Place, Mistake] = {}
    meant: set[Place] = set()
    unknown: Counter[Place] = Counter()
    for kind, place in found:
        if kind == "extra_forbidden":
            key, known = str(place[-1]), _keys(place)
            table = tuple(step for step in place[:-1] if isinstance(step, str))
            unknown[table] += 1
            if unknown[table] <= LIMIT:
                mistakes[place] = Mistake(written(place), "a key that is not known here", one_of(key, known))
                meant.add((*place[:-1], nearest(key, known) or ""))
            else:
                more = f"{unknown[table] - LIMIT:,} more keys that are not known here"
                mistakes[table] = Mistake(written(table) or "the file", more, one_of("", known))
    if not {"recipe", "bodies"} & set(tables):
        found.append(("missing", ("bodies",)))
    faults: set[Place] = set()
    for kind, place in found:
        if kind == "extra_forbidden":
            continue
        place = _whole_value(place)
        faults.add(place)
        if kind != "missing":
            mistakes[place] = Mistake(written(place), *_wrong_value(kind, place, _at(tables, place)))
        elif place not in meant:  # otherwise it is there, and misspelt
            also = ", or a recipe by name" if place == ("bodies",) else ""
            mistakes[place] = Mistake(written(place), "nothing", _expected(place) + also)
    return list(mistakes.values()), faults


def written(place: Place) -> str:
    """Return a place as messages write it: ``bodies[3].radius``; keys that are no plain ones are quoted."""
    text = ""
    for step in place:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            key = step if _PLAIN.fullmatch(step) else shown(step)
            text += f".{key}" if text else key
    return text


def _wrong_value(kind: str, place: Place, value: Any) -> tuple[str, str]:
    """Return what was found at a place, and what was expected."""
    if kind == "too_long" and place[0] in ("narrow-phases", "options", "parameters"):
        return f"{len(value):,} entries", f"at most {_MOST}"
    return shown(value), _expected(place)


def _whole_value(place: Place) -> Place:
    """Return the place of the value that the message is about: a position, not its second number."""
    return place[:-1] if isinstance(place[-1], int) and place[-2] not in _LISTS else place


def _keys(place: Place) -> list[str]:
    """Return the keys of the table in which the last step of ``place`` stands."""
    model: type[_Table] = _File
    if len(place) > 1:
        model = _Turn if "turns" in place[:-1] else _Body
    if place[0] == "commands" and len(place) > 1:
        model = _Insertion if "insert" in place[:-1] else _Command
    if place[0] == "responses" and len(place) > 1:
        model = _Response
    return [field.alias or name for name, field in model.model_fields.items()]


def _expected(place: Place) -> str:
    if isinstance(place[-1], int) or len(place) == 2:
        return "a table"
    return _EXPECTED[place[-1]]


def _at(tables: Any, place: Place) -> Any:
    for step in place:
        tables = tables[step]
    return tables
