"""TOML from anywhere: a file that may be anything becomes tables of bounded size and depth, or a sentence.

tomllib reads well-meant files well. It does not end in a sensible time on keys of many thousand parts, which
it looks up anew from the root for each, and what it returns may be nested as deeply as the stack is. So a
file is measured before it is read, its keys before they are parsed, and its tables before anybody walks
through them.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption, Mistake, SceneError
from kinetile.scene.checks import abridged, shown
from kinetile.scene.text.schema import Place, written

__all__ = ["MOST_BYTES", "read_bytes", "read_tables"]

MOST_BYTES = 64 * 2**20
"""How large a scene file may be, unless its reader says otherwise: about 400,000 bodies."""

DEEPEST = 32
"""How many tables and lists may lie in each other, and how many parts a key may have."""

MOST_BITS = 8192
"""How large a whole number may be: such as Python still writes out."""

_LIMIT = "KINETILE_MAX_SCENE_BYTES"
_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DEEP_KEY = re.compile(rf"(?:^|[\[{{,])[ \t]*+(?:{_PART}[ \t]*+\.[ \t]*+){{{DEEPEST}}}", re.MULTILINE)
_WHERE = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)


def read_bytes(path: str | os.PathLike[str], max_bytes: int | None) -> bytes:
    """Return what a regular file holds; ``max_bytes`` is None for the limit that holds otherwise.

    Raises OSError if it is no regular file (a pipe or a device may never end) or cannot be read, SceneError
    if it is larger, and BadOption if the environment's limit is no number.
    """
    mode = Path(path).stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is no regular file, so it is not read", os.fspath(path))
    most = _most_bytes() if max_bytes is None else max_bytes
    with open(path, "rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise SceneError([Mistake("the file", f"more than {most:,} bytes", _larger(most))], os.fspath(path))
    return data


def _most_bytes() -> int:
    text = os.environ.get(_LIMIT, "").strip()
    if text and not (text.isascii() and text.isdigit() and len(text) < 19):
        raise BadOption(f"the environment variable {_LIMIT} is {shown(text)}; expected a number of bytes")
    return int(text or MOST_BYTES)


def _larger(most: int) -> str:
    return f"at most so many; max_bytes of load_scene, or the environment variable {_LIMIT}, allows more"


def read_tables(text: str, source: str | None) -> dict[str, Any]:
    """Return the tables of a TOML text; ``source`` is what messages call it. Raises SceneError."""
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
    """Return the places of tables and lists that lie too deep, and of whole numbers that are too large."""
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
    """Turn tomllib's message into a mistake that shows the line."""
    match = _WHERE.fullmatch(message)
    what, line, column = match.groups() if match else (message, None, None)
    lines = text.splitlines()
    number = int(line or len(lines))
    where = f"line {number}" + (f", column {column}" if column else "")
    found = shown(lines[number - 1]) if 0 < number <= len(lines) else "the end of the file"
    return Mistake(where, found, f"TOML ({what})")
