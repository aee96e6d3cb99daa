"""Tables of a scene file: from bytes to TOML of bounded size and depth, with known keys and types.

tomllib does not end in a sensible time on keys of many thousand parts, and its result may be nested as deeply
as the stack. So the size of a file is checked before reading, its keys before parsing, and its tables before
a traversal. Then they are compared with the tables below.
"""

import os
import re
import tomllib
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from typing import Any, TypeAlias, cast

from kinetile.errors import Mistake, SceneError, key_of, nearest, one_of
from kinetile.scene.checks import MOST_MISTAKES, abridged, shown
from kinetile.scene.commands import COMMAND_KINDS, Insert
from kinetile.scene.values import VALUES, Value, is_list, is_pair
from kinetile.sources import open_regular

_PLAIN = re.compile(r"[A-Za-z0-9_-]{1,60}")

KeyPath: TypeAlias = tuple[str | int, ...]
"""The place of a value in a file: ("bodies", 3, "radius")."""

_MOST = 100
"""The largest number of entries of a table of options or parameters, and of a list of phases."""


@dataclass(frozen=True)
class FileTable:
    """A table of a file, or each of a list of tables: its keys, and the needed keys."""

    what: str
    keys: "Mapping[str, Value | FileTable]"
    needed: Collection[str] = ()
    is_list: bool = True


def _named(*names: str) -> dict[str, Value | FileTable]:
    return {name: VALUES[name] for name in names}


def _are_places(value: Any) -> bool:
    return is_list(value, is_pair)


_ONE_BODY = _named("position", "velocity", "radius", "mass", "acceleration", "kind", "shape", "name")
_TURN = FileTable("[[bodies.turns]] tables", _named("time", "velocity"), ("time", "velocity"))
_INSERTED = [name for name in Insert._fields if name not in ("time", "at")]
_INSERT = FileTable(
    "a table with position, velocity, radius or shape, and mass",
    _named(*_INSERTED),
    ("position", "radius"),
    is_list=False,
)
_SHAPE: dict[str, Value | FileTable] = {
    "kind": Value('"disc", "box", "capsule", "segment" or "polygon"', str),
    **_named("radius", "width", "height", "from", "to"),
    "corners": Value("a list of corners, each [x, y]", _are_places),
}
_POLYLINE: dict[str, Value | FileTable] = {
    "points": Value("a list of points, each [x, y]", _are_places),
    "closed": Value("true or false", bool),
    **_named("kind"),
}
_RESPONSE: dict[str, Value | FileTable] = {
    "between": Value('two kinds, or one and "wall"; "*" for any', lambda two: is_list(two, length=2)),
    "response": Value("the name of a response", str),
    "options": Value("a table of the response's options", dict),
}
_FILE = FileTable(
    "",
    {
        **_named("arena", "periodic", "gravity", "start", "until", "end"),
        **_named("broad-phase", "narrow-phases", "options"),
        "recipe": Value("the name of a recipe", str),
        "parameters": Value("a table of the recipe's parameters", dict),
        **_named("unit"),
        "shapes": FileTable("[[shapes]] tables", _SHAPE, ("kind",)),
        "obstacles": FileTable("[[obstacles]] tables", _POLYLINE, ("points",)),
        "bodies": FileTable("[[bodies]] tables", _ONE_BODY | {"turns": _TURN}, ("position", "radius")),
        "commands": FileTable(
            "[[commands]] tables",
            _named("time", "at", *(each.gives[0] for each in COMMAND_KINDS if each.gives))
            | {each.word: VALUES["body"] for each in COMMAND_KINDS}
            | {"insert": _INSERT},
            ("time",),
        ),
        "responses": FileTable("[[responses]] tables", _RESPONSE, ("response",)),
        "kinds": Value("a list of all kinds of bodies", list),
    },
    is_list=False,
)


def find_faults(tables: Mapping[str, Any]) -> tuple[list[Mistake], set[KeyPath]]:
    """Returns the mistakes of a file's tables, and the places of missing values and of wrong types."""
    faults = _Faults(tables)
    faults.of_table((), _FILE, tables)
    if not {"recipe", "bodies"} & set(tables):
        faults.missing(("bodies",), ", or a recipe by name")
    return [*faults.unknown.values(), *faults.mistakes.values()], {*faults.mistakes, *faults.lacking}


class _Faults:
    """Mistakes of a file by their places, and the keys that unknown ones probably mean."""

    def __init__(self, tables: Mapping[str, Any]) -> None:
        self.tables = tables
        self.unknown: dict[KeyPath, Mistake] = {}
        self.mistakes: dict[KeyPath, Mistake] = {}
        self.meant: set[KeyPath] = set()
        self.lacking: set[KeyPath] = set()
        self._odd: Counter[KeyPath] = Counter()

    def of_table(self, place: KeyPath, table: FileTable, given: Any) -> None:
        if not isinstance(given, dict):
            self.mistakes[place] = Mistake(written(place), shown(given), expected(place))
            return
        self.meant |= {(*place, self._of_key((*place, key))) for key in given if key not in table.keys}
        for key, field in table.keys.items():
            where = (*place, key)
            if key in given:
                self._of_value(where, field, given[key])
            elif key in table.needed and not (key == "radius" and _has_shape(self.tables, place)):
                self.missing(where)

    def missing(self, place: KeyPath, also: str = "") -> None:
        """Reports a missing value, unless its key is there, misspelt."""
        self.lacking.add(place)
        if place not in self.meant:
            self.mistakes[place] = Mistake(written(place), "nothing", expected(place) + also)

    def _of_value(self, place: KeyPath, field: Value | FileTable, given: Any) -> None:
        if isinstance(field, FileTable) and field.is_list and isinstance(given, list):
            for k, row in enumerate(given):
                self.of_table((*place, k), field, row)
        elif isinstance(field, FileTable) and not field.is_list:
            self.of_table(place, field, given)
        elif isinstance(field, FileTable) or not field.has_form(given):
            self.mistakes[place] = Mistake(written(place), shown(given), expected(place))
        elif (isinstance(given, dict) or place[-1] == "narrow-phases") and len(given) > _MOST:
            self.mistakes[place] = Mistake(written(place), f"{len(given):,} entries", f"at most {_MOST}")
        elif place == ("options",):
            for name, options in given.items():
                self._of_value((*place, name), Value("a table", dict), options)

    def _of_key(self, place: KeyPath) -> str:
        """Reports an unknown key; returns the key that it probably means."""
        key, known, belongs = str(place[-1]), _keys(place), _belongs(place)
        table = tuple(step for step in place[:-1] if isinstance(step, str))
        self._odd[table] += 1
        if self._odd[table] <= MOST_MISTAKES:
            self.unknown[place] = Mistake(written(place), UNKNOWN, belongs or key_of(key, known))
            return "" if belongs else nearest(key, known) or ""
        more = f"{self._odd[table] - MOST_MISTAKES:,} more keys that are not known here"
        self.unknown[table] = Mistake(written(table) or "the file", more, one_of("", known))
        return ""


UNKNOWN = "a key that is not known here"


def _belongs(place: KeyPath) -> str:
    """Returns the text after "expected" for a key of another table, around ``place`` or in it; or ""."""
    key = str(place[-1])
    for at in reversed(range(len(place) - 1)):
        if isinstance(place[at], str) and key in _keys((*place[:at], key)):
            header = ".".join(step for step in place[: at + 1] if isinstance(step, str))
            if not isinstance(place[at + 1], int):
                return f"it beside {header.rpartition('.')[2]}, not within"
            return f"it before the first [[{header}]]: what stands below a header belongs to its table"
    path = [step for step in place[:-1] if isinstance(step, str)]
    within = [
        f"[[{'.'.join([*path, name])}]]" if field.is_list else f"{name} = {{ ... }}"
        for name, field in _table(place).keys.items()
        if isinstance(field, FileTable) and key in field.keys
    ]
    return f"it in {' or '.join(within)}" if within and not nearest(key, _keys(place)) else ""


def _has_shape(tables: Mapping[str, Any], place: KeyPath) -> bool:
    """True if a body, present or inserted, has a shape, or lacks one that other bodies have."""
    rows = [row for row in tables.get("bodies", ()) if isinstance(row, dict)] if place[0] == "bodies" else []
    return any("shape" in row for row in (reduce(getitem, place, cast(Any, tables)), *rows))


def written(place: KeyPath) -> str:
    """Returns a place as messages write it: ``bodies[3].radius``; keys that are not plain are quoted."""
    text = ""
    for step in place:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            key = step if _PLAIN.fullmatch(step) else shown(step)
            text += f".{key}" if text else key
    return text


def _keys(place: KeyPath) -> dict[str, str]:
    return {name: field.what for name, field in _table(place).keys.items()}


def _table(place: KeyPath) -> FileTable:
    table = _FILE
    for step in place[:-1]:
        if isinstance(step, str):
            table = cast(FileTable, table.keys[step])
    return table


def expected(place: KeyPath) -> str:
    """Returns the text after "expected" for the value at a place."""
    return "a table" if isinstance(place[-1], int) or len(place) == 2 else _keys(place)[place[-1]]


MOST_BYTES = 64 * 2**20
"""The default limit of a scene file: about 400,000 bodies."""

DEEPEST = 32
"""The largest depth of nested tables and lists, and the largest number of parts of a key."""

MOST_BITS = 8192
"""The bits of the largest whole number: Python still writes it out."""

_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DEEP_KEY = re.compile(rf"(?:^|[\[{{,])[ \t]*+(?:{_PART}[ \t]*+\.[ \t]*+){{{DEEPEST}}}", re.MULTILINE)
_WHERE = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)


def read_text(path: str | os.PathLike[str], max_bytes: int = MOST_BYTES) -> str:
    """Returns the text of a regular file, without a mark of byte order; OSError for another (a pipe),
    SceneError if it is too large or not UTF-8."""
    with open_regular(path) as file:
        size = max(os.fstat(file.fileno()).st_size, MOST_BYTES)  # the size of a buffer
        data = file.read(min(max_bytes, size) + 1)
    if len(data) > max_bytes:
        more = "at most so many; max_bytes of kinetile.load_scene allows more"
        raise SceneError([Mistake("the file", f"more than {max_bytes:,} bytes", more)], os.fspath(path))
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        where, found = data.count(b"\n", 0, error.start) + 1, f"bytes that are not UTF-8 ({error.reason})"
        mistake = Mistake(f"line {where}", found, "a TOML file in UTF-8")
        raise SceneError([mistake], os.fspath(path)) from error


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
    except ValueError as error:  # Python's own: it reads no number of more than some thousand digits
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
    open_places: list[tuple[KeyPath, Any]] = [((), tables)]
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
    match = _WHERE.fullmatch(message)
    what, line, column = match.groups() if match else (message, None, None)
    lines = text.splitlines()
    number = int(line or len(lines))
    where = f"line {number}" + (f", column {column}" if column else "")
    found = shown(lines[number - 1]) if 0 < number <= len(lines) else "the end of the file"
    return Mistake(where, found, f"TOML ({what})")
