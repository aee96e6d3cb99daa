"""The keys of a scene file and the types of their values.

pydantic compares a file's tables with the models below, strictly: no text for a number, no true for 1, whole
numbers where numbers are wanted, and no key that is not here. What it finds becomes mistakes in the words
of the file, one for each key.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kinetile.errors import Mistake, nearest, one_of
from kinetile.scene.checks import shown

__all__ = ["Place", "find_faults", "written"]

Place: TypeAlias = tuple[str | int, ...]
"""Where a value stands in a file: ("bodies", 3, "radius")."""

_Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


class _Table(BaseModel):
    model_config = ConfigDict(
        extra="forbid", strict=True, alias_generator=lambda name: name.replace("_", "-"), defer_build=True
    )


class _Turn(_Table):
    time: float
    velocity: _Pair


class _Body(_Table):
    position: _Pair
    velocity: _Pair = [0.0, 0.0]
    radius: float
    mass: float = 1.0
    turns: list[_Turn] = []


class _File(_Table):
    arena: _Pair | None = None
    start: float = 0.0
    until: float | None = None
    broad_phase: str | None = None
    narrow_phases: list[str] | None = None
    options: dict[str, dict[str, Any]] = {}
    recipe: str | None = None
    parameters: dict[str, Any] = {}
    bodies: list[_Body] | None = None


_EXPECTED = {
    "arena": "[width, height], two finite numbers greater than 0",
    "start": "a finite number",
    "until": "a finite number",
    "broad-phase": "the name of a broad phase",
    "narrow-phases": "a list of names of narrow phases",
    "options": "a table for each phase, such as [options.sap-1d]",
    "recipe": "the name of a recipe",
    "parameters": "a table of the recipe's parameters",
    "bodies": "[[bodies]] tables",
    "position": "[x, y], two finite numbers",
    "velocity": "[vx, vy], two finite numbers",
    "radius": "a finite number greater than 0",
    "mass": "a finite number greater than 0",
    "turns": "[[bodies.turns]] tables",
    "time": "a finite number",
}


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
    for kind, place in found:
        if kind == "extra_forbidden":
            key, known = str(place[-1]), _keys(place)
            mistakes[place] = Mistake(written(place), "a key that is not known here", one_of(key, known))
            meant.add((*place[:-1], nearest(key, known) or ""))
    if not {"recipe", "bodies"} & set(tables):
        found.append(("missing", ("bodies",)))
    faults: set[Place] = set()
    for kind, place in found:
        if kind == "extra_forbidden":
            continue
        place = _whole_value(place)
        faults.add(place)
        if kind != "missing":
            mistakes[place] = Mistake(written(place), shown(_at(tables, place)), _expected(place))
        elif place not in meant:  # otherwise it is there, and misspelt
            also = ", or a recipe by name" if place == ("bodies",) else ""
            mistakes[place] = Mistake(written(place), "nothing", _expected(place) + also)
    return list(mistakes.values()), faults


def written(place: Place) -> str:
    """Return a place as messages write it: ``bodies[3].radius``."""
    text = ""
    for step in place:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text


def _whole_value(place: Place) -> Place:
    """Return the place of the value that the message is about: a position, not its second number."""
    return place[:-1] if isinstance(place[-1], int) and place[-2] not in ("bodies", "turns") else place


def _keys(place: Place) -> list[str]:
    """Return the keys of the table in which the last step of ``place`` stands."""
    model: type[_Table] = _Turn if "turns" in place[:-1] else _Body if len(place) > 1 else _File
    return [field.alias or name for name, field in model.model_fields.items()]


def _expected(place: Place) -> str:
    if isinstance(place[-1], int) or len(place) == 2:
        return "a table"
    return _EXPECTED[place[-1]]


def _at(tables: Any, place: Place) -> Any:
    for step in place:
        tables = tables[step]
    return tables
