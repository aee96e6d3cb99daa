"""Checking a list of contacts against docs/specification.md, line by line, in exact arithmetic.

The certifier runs the scene itself (``course.Course``: integers, no tolerance, nothing of the kernel's
contact times) and compares each line with what happens next. So a list is right to the end or wrong at one
line; what is behind that line is not judged. It is not bound to how far two arithmetics agree before chaos
parts them: the specification fixes every rounding.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import BadOption
from kinetile.kernel.log import TURNED
from kinetile_accuracy.answer.course import Course, Happening
from kinetile_accuracy.answer.exact import tick_of, unit_bits
from kinetile_accuracy.answer.reasons import Row, named, reason, row_of, when

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["CertifiedLog", "LogCertifier", "LogProgress", "WrongLine", "certify_log"]

_OFTEN = 256
"""Lines between two calls of ``progress``."""

_PLAN = ("x", "y", "vx", "vy")
_NAMES = ["epoch", "tick", "a", "b"]
_ENTRY = np.dtype([("epoch", "<i8"), ("tick", "<i8"), ("a", "<i4"), ("b", "<i4")])
_AT_ONCE = 1 << 14


class LogProgress(NamedTuple):
    """How far a certifier is: lines found right, of how many; time of the last."""

    lines: int
    total: int
    time: float


@dataclass(frozen=True)
class WrongLine:
    """The first line that is not as the specification has it.

    Attributes:
        index: its place, counted from 0; the number of lines where one is missing at the end.
        found: what it says, as (epoch, tick, a, b); None where it is missing.
        expected: what should stand there; None where nothing should.
        why: the reason, in a sentence.
    """

    index: int
    found: Row | None
    expected: Row | None
    why: str


@dataclass(frozen=True)
class CertifiedLog:
    """What came of a check.

    Attributes:
        lines: how many lines are right, from the first one on.
        total: how many there are.
        until: the time up to and at which there must be no further contact; None: the lines alone were
            checked.
        finished: False where the check was broken off.
        wrong: the first line that is wrong, or None.
        fingerprint: the digest of the contacts (rule 10), where all lines are right.
    """

    lines: int
    total: int
    until: float | None
    finished: bool
    wrong: WrongLine | None = None
    fingerprint: str | None = None

    @property
    def right(self) -> bool:
        """Whether all lines are right, and none is missing up to ``until``."""
        return self.finished and self.wrong is None

    def __str__(self) -> str:
        if self.wrong is not None:
            return f"line {self.wrong.index + 1:,} is wrong: {self.wrong.why}"
        if not self.finished:
            return f"the first {self.lines:,} of {self.total:,} lines are right; broken off there"
        end = "what comes after them was not asked" if self.until is None else f"to time {self.until!r}"
        return f"all lines are right: {self.total:,}, {end}"

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types, fit for JSON."""
        wrong = self.wrong and vars(self.wrong)
        return {**vars(self), "right": self.right, "wrong": wrong, "sentence": str(self)}


class LogCertifier:
    """A check under way; ``report`` says how far it is at any moment.

    See ``certify_log`` for the arguments and errors.
    """

    def __init__(
        self,
        scene: Scene,
        contacts: NDArray[Any],
        until: float | None = None,
        *,
        max_contacts: int | None = None,
        fingerprint: str | None = None,
    ) -> None:
        names = contacts.dtype.names or ()
        if contacts.ndim != 1 or not set(_NAMES) <= set(names):
            raise BadOption(
                "a list of contacts is an array with the fields epoch, tick, a and b, such as sim.contacts; "
                f"found an array of shape {contacts.shape}, fields {', '.join(names) or 'none'}"
            )
        if until is not None and not scene.start <= until < float("inf"):
            raise BadOption(f"until is {until!r}; expected a time from the scene's start on, {scene.start!r}")
        self.scene = scene
        self._rows = contacts
        self._whole = {"ax", "ay", "avx", "avy", "bx", "by", "bvx", "bvy"} <= set(names)
        self._until = until
        self._most = max_contacts
        self._said = fingerprint
        self._print: str | None = None
        self._lines = 0
        self._finished = False
        self._wrong: WrongLine | None = None

    @property
    def report(self) -> CertifiedLog:
        """What has been found so far."""
        found = self._lines, len(self._rows), self._until, self._finished, self._wrong, self._print
        return CertifiedLog(*found)

    def run(self, progress: Callable[[LogProgress], None] | None = None) -> CertifiedLog:
        """Go through all lines, or to the first that is wrong."""
        self._wrong = self._first_wrong(progress)
        self._finished = True
        return self.report

    def _first_wrong(self, progress: Callable[[LogProgress], None] | None) -> WrongLine | None:
        """Return the first line that is wrong."""
        scene, bits = self.scene, unit_bits(self.scene)
        course = Course(scene)
        end = None if self._until is None else tick_of(self._until, scene.start, bits)
        before, contacts = None, 0
        for index, found in enumerate(self._found()):
            epoch, tick, a, b = found
            line = Happening((epoch << 52) + tick, a, b)
            if progress is not None and index % _OFTEN == 0:
                progress(LogProgress(index, len(self._rows), scene.start + course.now * course.tick))
            contacts += b > TURNED
            if self._most is not None and contacts > self._most:
                return WrongLine(index, found, None, f"there are to be {self._most:,} contacts and no more")
            due = self._due(course, line.tick if end is None else end)
            if due != line or not 0 <= tick < 1 << 52:
                why, due = reason(course, found, due, before, self._rows[_NAMES][index + 1 :], end)
                return WrongLine(index, found, due and row_of(due), why)
            course.happen()
            if self._whole and (said := self._other_plans(course, index, line)):
                return WrongLine(index, found, found, said)
            before = line
            self._lines = index + 1
        due = None if end is None or contacts == self._most else self._due(course, end)
        if due is not None:
            why = f"there is one more before the end: {named(due)} at {when(due.tick)}"
            return WrongLine(len(self._rows), None, row_of(due), why)
        self._print = _fingerprint(self._rows)
        if self._said not in (None, self._print):
            why = f"the fingerprint of the lines before it is {self._print}, and not {self._said}"
            return WrongLine(len(self._rows), None, None, why)
        return None

    def _found(self) -> Iterator[Row]:
        """Yield the lines in plain numbers."""
        for first in range(0, len(self._rows), _AT_ONCE):
            some = self._rows[first : first + _AT_ONCE]
            yield from zip(*(some[name].tolist() for name in _NAMES), strict=True)

    def _due(self, course: Course, end: int) -> Happening | None:
        """Return the next event that the list must have; those that it does not have, happen."""
        due = course.next(end)
        while due is not None and due.b <= TURNED and not self._whole:
            course.happen()
            due = course.next(end)
        return due

    def _other_plans(self, course: Course, index: int, line: Happening) -> str | None:
        """Return where a row's plans are not those of rule 9; the sign of a zero is not looked at."""
        row = self._rows[index]
        for side, body in (("a", line.a), ("b", line.b)):
            for name in _PLAN:
                right = float("nan") if body < 0 else getattr(course.plans[body], name)
                found = float(row[side + name])
                if found != right and not (body < 0 and np.isnan(found)):
                    what = f"{name} of body {body} after {named(line)} is {found!r}"
                    return f"{what}; by rules 4 and 9 it is {right!r}"
        return None


def certify_log(
    scene: Scene,
    contacts: NDArray[Any],
    until: float | None = None,
    *,
    max_contacts: int | None = None,
    fingerprint: str | None = None,
    progress: Callable[[LogProgress], None] | None = None,
) -> CertifiedLog:
    """Check that a list of contacts is the one that docs/specification.md gives a scene.

    Args:
        scene: what was simulated, by discs that exchange momentum and walls that reflect.
        contacts: (m,) rows with the fields epoch, tick, a, b, in their order, such as ``sim.contacts``. Where
            rows have the fields of ``kinetile.LOG``, turns are among them, and the plans after each event are
            compared.
        until: the time up to and at which all contacts must be there, and after which none; None: the lines
            are checked, and not what comes after the last.
        max_contacts: the list is of a run that was ended after so many contacts, if not before.
        fingerprint: what the list says is its own; None: it says none.
        progress: told now and then how far the check is.

    Returns:
        What was found: all lines right, or the first that is wrong, and why.

    Raises:
        BadOption: the array has other fields, or ``until`` is before the start.
    """
    certifier = LogCertifier(scene, contacts, until, max_contacts=max_contacts, fingerprint=fingerprint)
    return certifier.run(progress)


def _fingerprint(rows: NDArray[Any]) -> str:
    """Return the fingerprint of rule 10, of the contacts among rows."""
    contacts = rows[rows["b"] > TURNED]
    exact = np.zeros(len(contacts), _ENTRY)
    for name in _NAMES:
        exact[name] = contacts[name]
    return hashlib.sha256(exact.tobytes()).hexdigest()
