"""What the compiler says of a hook, in a sentence with the author's own file and line.

Numba tells the whole way from the loop down to the hook, once forwards and once backwards. Its first sentence
and the first place are what an author can do something about.
"""

from __future__ import annotations

import re
from itertools import pairwise

__all__ = ["brief", "complaint"]

PLACE = re.compile(r'^File "(?P<file>.*)", line (?P<line>\d+):$')
STEP = re.compile(r"^(Failed in nopython mode pipeline|During: |<source elided>|\s*\^)")
PLAIN = re.compile(r"Untyped global name '(?P<name>\w+)': .* type of <class 'function'>")
RECORD = re.compile(r"Record\([^)]*\)")


def complaint(error: Exception) -> str:
    """Return what the compiler says, with the place; some of its errors do not say where, but it knows."""
    said = brief(str(error))
    if said != str(error):
        return said
    return f"{type(error).__name__}: {RECORD.sub('records', said)}{_place(error)}"


def _place(error: Exception) -> str:
    """Return the file and line at which the compiler was: the innermost that it had in hand."""
    found, trace = "", error.__traceback__
    while trace is not None:
        for value in list(trace.tb_frame.f_locals.values()):
            loc = getattr(value, "loc", None)
            file, line = getattr(loc, "filename", None), getattr(loc, "line", None)
            if isinstance(file, str) and isinstance(line, int):
                found = f" ({file}, line {line})"
        trace = trace.tb_next
    return found


def brief(message: str) -> str:
    """Return what is wrong, where, and in which line of code; the message itself where it has no place."""
    lines = message.strip().splitlines()
    places = [at for at, line in enumerate(lines) if PLACE.match(line)]
    if not places:
        return RECORD.sub("records", message)
    said = " ".join(line.strip() for line in lines[: places[0]] if line.strip() and not STEP.match(line))
    plain = PLAIN.search(said)
    if plain is not None:
        said = f"{plain['name']} is a plain function, and hooks call only hooks: mark it with toolbox.hook"
    found = PLACE.match(lines[places[0]])
    assert found is not None
    number = int(found["line"])
    return f"{RECORD.sub('records', said)} ({found['file']}, line {number}){_code(lines[places[0] + 1 :])}"


def _code(lines: list[str]) -> str:
    """Return the line of code above the first caret, after a colon; "" where there is none."""
    for above, line in pairwise(lines):
        if line.strip() == "^":
            return f": {above.strip()}"
        if not above.strip():
            break
    return ""
