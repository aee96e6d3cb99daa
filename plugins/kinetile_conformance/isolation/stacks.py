"""Reading the stack that ``faulthandler`` has written: in whose code a process died."""

from __future__ import annotations

import re
from pathlib import Path

import kinetile
from kinetile.plugin.calling import is_library

__all__ = ["COMPILER", "where"]

COMPILER = "the compiler"

FRAME = re.compile(r'^  File "(?P<file>.*)", line (?P<line>\d+) in (?P<function>.*)$')
OWN = Path(str(kinetile.__file__)).parent


def where(words: str) -> str:
    """Return the innermost place that is no library's, such as "arrange (my_phase.py, line 12)"; "" if there
    is none.

    Compiled hooks have no stack of their own: what died in them is said to have died in "a compiled hook".
    """
    for thread in re.split(r"^(?:Current t|T)hread .*$", words, flags=re.MULTILINE)[1:]:
        frames = [found for line in thread.splitlines() if (found := FRAME.match(line))]
        if any(frame["function"] == "_listen" for frame in frames):
            continue
        for frame in frames:
            path = Path(frame["file"])
            if is_library(path):
                continue
            if path == OWN / "run" / "engine" / "engine.py" and frame["function"] == "_chunk":
                return "a compiled hook"
            if path.parent == OWN / "kernel" / "compiled":
                return COMPILER
            return f"{frame['function']} ({path.name}, line {frame['line']})"
    return ""
