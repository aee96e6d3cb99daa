"""Arrays that look at every index: what compiled code would read or write outside of them has a name here.

Compiled, nothing looks: an index too large is other memory. Interpreted, NumPy raises for most of these; but
an index below zero it counts from the end. So does compiled code, down to the beginning of the array, and no
further: in a phase's own state that is Python's meaning and the author's business. In the kernel's tables, of
which bodies are numbered from 0, it is a mistake; and what reads eight numbers at once (``kernel.vectors``)
takes an index as it is, so that there it is outside.

``guarded`` gives views of a named tuple's arrays that raise ``Breach`` with the array, the index, and the
line of the phase's author, be it that a function of the toolbox, called from there, used the index.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from inspect import currentframe
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from kinetile.kernel import vectors
from kinetile.plugin.calling import line_of_author

__all__ = ["Breach", "guarded"]

Tables = TypeVar("Tables", bound=NamedTuple)

if TYPE_CHECKING:
    _Arrays = np.ndarray[Any, Any]  # what _Looked is mixed into
else:
    _Arrays = object

EIGHT_AT_ONCE = str(Path(vectors.__file__).parent)


class Breach(Exception):
    """A hook does what it must not; the message names the hook, what it touched, and where."""


def frames_above(frame: FrameType | None) -> Iterable[tuple[str, int]]:
    """Yield file and line of a frame and of those that called it."""
    while frame is not None:
        yield frame.f_code.co_filename, frame.f_lineno
        frame = frame.f_back


class _Looked(_Arrays):
    """What an array does that looks at every index. ``called`` is what messages call it; None: it does not
    look, being what a computation has made."""

    called: str | None
    strict: bool

    def __array_finalize__(self, made_from: Any) -> None:
        super().__array_finalize__(made_from)
        self.called, self.strict = None, False

    def __getitem__(self, index: Any) -> Any:
        called = self.called
        if called is None:
            return super().__getitem__(index)
        if not isinstance(index, int | np.integer) or not 0 <= index < self.shape[0]:
            self._look(index, currentframe())
        found = super().__getitem__(index)
        if isinstance(found, _Looked) and isinstance(index, int | np.integer):
            found.called, found.strict = f"{called}[{index}]", self.strict
        return found

    def __iter__(self) -> Iterator[Any]:
        return (self[index] for index in range(self.shape[0]))

    def __setitem__(self, index: Any, value: Any) -> None:
        if self.called is not None:
            self._look(index, currentframe())
        super().__setitem__(index, value)

    def _look(self, index: Any, here: FrameType | None) -> None:
        """Raise Breach where an index is outside that the caller of this frame has used."""
        frame = here.f_back if here is not None else None
        raw = frame is not None and frame.f_code.co_filename.startswith(EIGHT_AT_ONCE)
        for length, each in zip(self.shape, index if isinstance(index, tuple) else (index,), strict=False):
            if isinstance(each, bool | np.bool_):
                continue
            if isinstance(each, int | np.integer):
                low = high = int(each)
            elif isinstance(each, slice) and raw:
                low, high = int(each.start), int(each.stop) - 1
            elif isinstance(each, list) or (isinstance(each, np.ndarray) and each.dtype.kind in "iu"):
                many = np.asarray(each).ravel().tolist()
                low, high = min(many, default=0), max(many, default=-1)
            else:
                continue  # a slice is cut to what there is, compiled too; of the rest NumPy will tell
            if high >= length:
                self._tell(high, length, frame)
            if low < (0 if raw or self.strict else -length):
                self._tell(low, length, frame)

    def _tell(self, index: int, length: int, frame: FrameType | None) -> None:
        side = f"and it has {length}" if index >= 0 else "which is before its beginning"
        where = line_of_author(frames_above(frame))
        raise Breach(f"used {self.called}[{index}], {side}{where}")


class _Array(_Looked, np.ndarray[Any, Any]):
    """Numbers."""


class _Table(_Looked, np.recarray):
    """Records."""


def guarded(tables: Tables, called: str, strict: bool) -> Tables:
    """Return a named tuple of arrays, each as a view of the same memory that looks at every index.

    Messages call an array ``called.field``. ``strict``: an index below zero is a breach too.
    """
    views = []
    for name, array in zip(type(tables)._fields, tables, strict=True):
        view = array.view(_Table if isinstance(array, np.recarray) else _Array)
        view.called, view.strict = f"{called}.{name}", strict
        views.append(view)
    return type(tables)(*views)
