"""Tables of a scene file: from bytes to TOML of bounded size and depth, with known keys and types.

tomllib reads ordinary files well. It does not end in a sensible time on keys of many thousand parts, which
it searches from the root for each, and its result may be nested as deeply as the stack is. So the size of a
file is checked before it is read, its keys before they are parsed, and its tables before they are
traversed.

Then pydantic compares the tables with the models below, strictly: no text for a number, no true for 1, whole
numbers where numbers are wanted, and no key that is not here. Its findings become mistakes in the words of
the file, one for each key.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections import Counter
from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias, cast, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kinetile.errors import Mistake, SceneError, key_of, nearest, one_of
from kinetile.scene.checks import LIMIT, abridged, shown
from kinetile.sources import open_regular

_PLAIN = re.compile(r"[A-Za-z0-9_-]{1,60}")

Place: TypeAlias = tuple[str | int, ...]
"""The place of a value in a file: ("bodies", 3, "radius")."""

_MOST = 100
"""The most entries of a table of options or parameters, and of a list of phases."""

_LISTS = ("bodies", "turns", "commands", "responses", "shapes", "obstacles")

_Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
_Velocity = Annotated[_Pair, Field(description="[vx, vy], two finite numbers")]
_Whole = Annotated[int, Field(ge=-(2**62), le=2**62)]  # arrays have whole numbers of 64 bits
_Moment = Annotated[
    list[_Whole],
    Field(min_length=3, max_length=3, description="[epoch, tick, contacts], three whole numbers"),
]
_Time = Annotated[float, Field(description="a finite number")]
_Number = Annotated[_Whole, Field(description="the number of a body")]
_Kind: TypeAlias = Any  # the scene decides which values are kinds
_Few = Field(max_length=_MOST)
_ABSENT: Any = None  # the default of a key that may be left out: it is never read, and TOML has no null


class _FileTable(BaseModel):
    """A table of a file: its keys, each with the description that messages give of a right value."""

    model_config = ConfigDict(
        extra="forbid", strict=True, alias_generator=lambda name: name.replace("_", "-"), defer_build=True
    )


class _Turn(_FileTable):
    time: _Time
    velocity: _Velocity


class _OneBody(_FileTable):
    position: _Pair = Field(description="[x, y], two finite numbers")
    velocity: _Velocity = _ABSENT
    radius: float = Field(description="a finite number greater than 0")
    mass: float = Field(_ABSENT, description="a number greater than 0, or inf")
    kind: _Kind = Field(_ABSENT, description="the name of a kind, or a whole number")
    shape: _Number = Field(_ABSENT, description="the number of one of [[shapes]], from 0")


class _Body(_OneBody):
    turns: list[_Turn] = Field(_ABSENT, description="[[bodies.turns]] tables")


class _Insertion(_OneBody):
    body: _Number = _ABSENT


class _Command(_FileTable):
    time: _Time
    at: _Moment = _ABSENT
    insert: _Insertion = Field(
        _ABSENT, description="a table with position, velocity, radius or shape, and mass"
    )
    remove: _Number = _ABSENT
    turn: _Number = _ABSENT
    velocity: _Velocity = _ABSENT


class _Shape(_FileTable):
    kind: str = Field(description='"disc", "box", "capsule", "segment" or "polygon"')
    radius: float = Field(_ABSENT, description="a finite number greater than 0")
    width: float = Field(_ABSENT, description="a finite number greater than 0")
    height: float = Field(_ABSENT, description="a finite number greater than 0")
    from_: _Pair = Field(_ABSENT, alias="from", description="[x, y], two finite numbers")
    to: _Pair = Field(_ABSENT, description="[x, y], two finite numbers")
    corners: list[_Pair] = Field(_ABSENT, description="a list of corners, each [x, y]")


class _Polyline(_FileTable):
    points: list[_Pair] = Field(description="a list of points, each [x, y]")
    closed: bool = Field(_ABSENT, description="true or false")
    kind: _Kind = Field(_ABSENT, description="the name of a kind, or a whole number")


class _Response(_FileTable):
    between: Annotated[list[_Kind], Field(min_length=2, max_length=2)] = Field(
        description='two kinds, or one and "wall"; "*" for any'
    )
    response: str = Field(description="the name of a response")
    options: Annotated[dict[str, Any], _Few] = Field(_ABSENT, description="a table of the response's options")


class _File(_FileTable):
    arena: _Pair = Field(_ABSENT, description="[width, height], two finite numbers greater than 0")
    periodic: str = Field(_ABSENT, description='"x", "y" or "xy"')
    gravity: _Pair = Field(_ABSENT, description="[gx, gy], two finite numbers")
    start: _Time = _ABSENT
    until: _Time = _ABSENT
    end: _Moment = _ABSENT
    broad_phase: str = Field(_ABSENT, description="the name of a broad phase; options are in [options.NAME]")
    narrow_phases: Annotated[list[str], _Few] = Field(
        _ABSENT, description="a list of names of narrow phases; options are in [options.NAME]"
    )
    options: Annotated[dict[str, Annotated[dict[str, Any], _Few]], _Few] = Field(
        _ABSENT, description="a table for each phase, such as [options.sap-1d]"
    )
    recipe: str = Field(_ABSENT, description="the name of a recipe")
    parameters: Annotated[dict[str, Any], _Few] = Field(
        _ABSENT, description="a table of the recipe's parameters"
    )
    unit: float = Field(_ABSENT, description="a power of two from 2**-900 to 1")
    shapes: list[_Shape] = Field(_ABSENT, description="[[shapes]] tables")
    obstacles: list[_Polyline] = Field(_ABSENT, description="[[obstacles]] tables")
    bodies: list[_Body] = Field(_ABSENT, description="[[bodies]] tables")
    commands: list[_Command] = Field(_ABSENT, description="[[commands]] tables")
    responses: list[_Response] = Field(_ABSENT, description="[[responses]] tables")
    kinds: list[_Kind] = Field(_ABSENT, description="a list of all kinds of bodies")


def find_faults(tables: Mapping[str, Any]) -> tuple[list[Mistake], set[Place]]:
    """Compares a file's tables with the model of a scene.

    Returns the mistakes, and the places of the values that are missing or of a wrong type, and so unusable.
    """
    found: list[tuple[str, Place]] = []
    try:
        _File.model_validate(tables)
    except ValidationError as error:
        details = error.errors(include_url=False, include_input=False)
        found = [(each["type"], each["loc"]) for each in details]
    mistakes: dict[Place, Mistake] = {}
    meant: set[Place] = set()
    unknown: Counter[Place] = Counter()
    for kind, place in found:
        if kind == "extra_forbidden":
            key, known = str(place[-1]), _keys(place)
            belongs = _belongs(place)
            table = tuple(step for step in place[:-1] if isinstance(step, str))
            unknown[table] += 1
            if unknown[table] <= LIMIT:
                mistakes[place] = Mistake(written(place), UNKNOWN, belongs or key_of(key, known))
                if not belongs:
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
        if kind == "missing" and place[-1] == "radius" and _has_shape(tables, place[:-1]):
            continue
        while isinstance(place[-1], int) and place[-2] not in _LISTS:
            place = place[:-1]  # the message is about a position, not its second number
        faults.add(place)
        if kind != "missing":
            mistakes[place] = Mistake(written(place), *_wrong_value(kind, place, _at(tables, place)))
        elif place not in meant:  # otherwise it is there, and misspelt
            also = ", or a recipe by name" if place == ("bodies",) else ""
            mistakes[place] = Mistake(written(place), "nothing", expected(place) + also)
    return list(mistakes.values()), faults


UNKNOWN = "a key that is not known here"


def _belongs(place: Place) -> str:
    """Returns what is expected of a key that another table has, one around that of ``place`` or one in it;
    "" if none has it."""
    key = str(place[-1])
    for at in reversed(range(len(place) - 1)):
        if isinstance(place[at], str) and key in _keys((*place[:at], key)):
            header = ".".join(step for step in place[: at + 1] if isinstance(step, str))
            if not isinstance(place[at + 1], int):
                return f"it beside {header.rpartition('.')[2]}, not within"
            return f"it before the first [[{header}]]: what stands below a header belongs to its table"
    path = [step for step in place[:-1] if isinstance(step, str)]
    within = []
    for name, field in _model(place).model_fields.items():
        inner = next(iter(get_args(field.annotation)), field.annotation)
        if isinstance(inner, type) and issubclass(inner, _FileTable) and key in _keys_of(inner):
            is_list = inner is not field.annotation
            within.append(f"[[{'.'.join([*path, name])}]]" if is_list else f"{name} = {{ ... }}")
    return f"it in {' or '.join(within)}" if within and not nearest(key, _keys(place)) else ""


def _has_shape(tables: Mapping[str, Any], place: Place) -> bool:
    """Whether a body, or one that is inserted, has a shape, or lacks one as other bodies have."""
    rows = [row for row in tables.get("bodies", ()) if isinstance(row, dict)] if place[0] == "bodies" else []
    return any("shape" in row for row in (_at(tables, place), *rows))


def written(place: Place) -> str:
    """Returns a place as messages write it: ``bodies[3].radius``; keys that are no plain ones are quoted."""
    text = ""
    for step in place:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            key = step if _PLAIN.fullmatch(step) else shown(step)
            text += f".{key}" if text else key
    return text


def _wrong_value(kind: str, place: Place, value: Any) -> tuple[str, str]:
    """Returns what was found at a place, and what was expected."""
    if kind == "too_long" and place[0] in ("narrow-phases", "options", "parameters"):
        return f"{len(value):,} entries", f"at most {_MOST}"
    return shown(value), expected(place)


def _keys(place: Place) -> dict[str, str]:
    """Returns the keys of the table that has the last step of ``place``, and what is expected of each."""
    return _keys_of(_model(place))


def _keys_of(model: type[_FileTable]) -> dict[str, str]:
    return {field.alias or name: field.description or "" for name, field in model.model_fields.items()}


def _model(place: Place) -> type[_FileTable]:
    """Returns the table that has the last step of ``place``."""
    model: Any = _File
    for step in place[:-1]:
        if isinstance(step, str):
            inner = model.model_fields[step].annotation
            model = next(iter(get_args(inner)), inner)  # of a list of tables, that of each
    return cast("type[_FileTable]", model)


def expected(place: Place) -> str:
    """Returns what is expected of the value at a place."""
    if isinstance(place[-1], int) or len(place) == 2:
        return "a table"
    return _keys(place)[place[-1]]


def _at(tables: Any, place: Place) -> Any:
    for step in place:
        tables = tables[step]
    return tables


MOST_BYTES = 64 * 2**20
"""The default limit of a scene file: about 400,000 bodies."""

DEEPEST = 32
"""The most tables and lists in each other, and the most parts of a key."""

MOST_BITS = 8192
"""The bits of the largest whole number: Python still writes it out."""

_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DEEP_KEY = re.compile(rf"(?:^|[\[{{,])[ \t]*+(?:{_PART}[ \t]*+\.[ \t]*+){{{DEEPEST}}}", re.MULTILINE)
_WHERE = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)


def read_bytes(path: str | os.PathLike[str], max_bytes: int = MOST_BYTES) -> bytes:
    """Returns the content of a regular file.

    Raises OSError if it is no regular file (a pipe or a device may never end) or cannot be read, and
    SceneError if it is larger.
    """
    with open_regular(path) as file:
        data = file.read(max_bytes + 1)
    if len(data) > max_bytes:
        more = "at most so many; max_bytes of kinetile.load_scene allows more"
        raise SceneError([Mistake("the file", f"more than {max_bytes:,} bytes", more)], os.fspath(path))
    return data


def read_tables(text: str, source: str | None) -> dict[str, Any]:
    """Returns the tables of a TOML text; ``source`` is its name in messages. Raises SceneError."""
    deep = _DEEP_KEY.search(text)
    if deep:
        line = text.count("\n", 0, deep.end()) + 1
        found = f"a key of more than {DEEPEST} parts"
        raise SceneError([Mistake(f"line {line}", found, "the keys of a scene")], source)
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError([_syntax_mistake(text, str(error))], source) from error
    except RecursionError as error:
        raise SceneError([_too_deep("the file")], source) from error
    except ValueError as error:  # of Python itself, which reads no number of more than some thousand digits
        found = "a whole number of too many digits to be read"
        raise SceneError([Mistake("the file", found, _SMALLER)], source) from error
    mistakes = _beyond_bounds(tables)
    if mistakes:
        raise SceneError(abridged(mistakes), source)
    return tables


_SMALLER = f"a whole number of at most {MOST_BITS:,} bits"


def _too_deep(where: str) -> Mistake:
    return Mistake(where, f"tables or lists in each other, more than {DEEPEST} deep", "the keys of a scene")


def _beyond_bounds(tables: dict[str, Any]) -> list[Mistake]:
    """Returns the places of tables and lists that lie too deep, and of whole numbers that are too large."""
    mistakes = []
    open_places: list[tuple[Place, Any]] = [((), tables)]
    while open_places:
        place, value = open_places.pop()
        if len(place) > DEEPEST:
            mistakes.append(_too_deep(written(place[:1])))
            continue
        for key, child in value.items() if isinstance(value, dict) else enumerate(value):
            if isinstance(child, (dict, list)):
                open_places.append(((*place, key), child))
            elif isinstance(child, int) and child.bit_length() > MOST_BITS:
                found = f"a whole number of {child.bit_length():,} bits"
                mistakes.append(Mistake(written((*place, key)), found, _SMALLER))
    return mistakes


def _syntax_mistake(text: str, message: str) -> Mistake:
    """Turns tomllib's message into a mistake that shows the line."""
    match = _WHERE.fullmatch(message)
    what, line, column = match.groups() if match else (message, None, None)
    lines = text.splitlines()
    number = int(line or len(lines))
    where = f"line {number}" + (f", column {column}" if column else "")
    found = shown(lines[number - 1]) if 0 < number <= len(lines) else "the end of the file"
    return Mistake(where, found, f"TOML ({what})")
