"""Calls into a phase's own Python: each exception, ``sys.exit`` among them, becomes a message with the phase,
its distribution and place. kinetile's own errors (a refusal, a bad option) and Ctrl-C pass unchanged; the
original error stays the cause."""

import sysconfig
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from kinetile.errors import KinetileError, PhaseError, UnknownName
from kinetile.plugin.registry import defined_at, registry, sentence
from kinetile.plugin.specs import PluginKind

LIBRARIES = ("numpy", "numba", "llvmlite", "hypothesis")
NOT_AUTHORS = {Path(__file__).parents[1]}
"""Folders without code of a phase's author: kinetile's. A kit that calls hooks adds its folder."""

STDLIB = Path(sysconfig.get_paths()["stdlib"])


def described(kind: PluginKind, name: str) -> str:
    """Returns a phase as messages name it, with its plugin and distribution."""
    try:
        return f"{kind} {name!r} of {registry().provided(kind, name).source}"
    except UnknownName:
        return f"{kind} {name!r}"


def place_of(error: BaseException, otherwise: str = "") -> str:
    """Returns the file and line that raised an error: in the phase's own code, if it is involved, or else
    ``otherwise``: NumPy and kinetile raise for a wrong use of an array or the toolbox in a hook."""
    trace = traceback.extract_tb(error.__traceback__)
    frames = [(frame.filename, frame.lineno or 0) for frame in reversed(trace)]
    return line_of_author(frames) or otherwise or "".join(map(_behind_a_sentence, frames[:1]))


def line_of_author(frames: Iterable[tuple[str, int]]) -> str:
    """Returns the first place outside of kinetile and libraries, as the end of a message; "" without one."""
    for frame in frames:
        path = Path(frame[0])
        if not any(map(path.is_relative_to, NOT_AUTHORS)) and not is_library(path):
            return _behind_a_sentence(frame)
    return ""


def _behind_a_sentence(frame: tuple[str, int]) -> str:
    return f" ({Path(frame[0]).name}, line {frame[1]})"


def is_library(path: Path) -> bool:
    """Returns True if a file belongs to the standard library, or to a library that kinetile uses."""
    if "site-packages" in path.parts:
        return path.parts[path.parts.index("site-packages") + 1] in LIBRARIES
    return STDLIB in path.parents or not path.suffix


@contextmanager
def calling(kind: PluginKind, name: str, what: str, *, may_refuse: bool = True) -> Iterator[None]:
    """A context for ``what`` of a phase: exceptions become PhaseError, refusals unless ``may_refuse``."""
    try:
        yield
    except (Exception, SystemExit) as error:
        if may_refuse and isinstance(error, KinetileError):
            raise
        where = place_of(error, _definition(kind, name, what))
        text = f"{described(kind, name)}: {what} raised {sentence(error)}{where}"
        # contextlib mistakes an error whose cause is a StopIteration for that StopIteration.
        raise PhaseError(text) from None if isinstance(error, StopIteration) else error


def _definition(kind: PluginKind, name: str, what: str) -> str:
    """Returns the place of the definition of ``what``, whose arguments may be wrong, or of ``prepare``."""
    with suppress(KinetileError):
        target: Any = registry().target(kind, name)
        method = "__init__" if what == "its constructor" else what
        return defined_at(getattr(target, method, getattr(target, "prepare", target)))
    return ""
