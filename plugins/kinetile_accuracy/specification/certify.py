"""The check of a list of contacts by docs/specification.md, line by line, in exact arithmetic. The certifier
runs the scene itself (``course.Course``: integers, no tolerance, no contact times of the kernel) and compares
each line with its next event: a list is right to the end or wrong at one line."""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple, cast

import numpy as np

from kinetile import Scene
from kinetile.arrays import Array
from kinetile.errors import BadOption, Refused
from kinetile.instruments import (
    ACCELERATED,
    COMMAND_KINDS,
    INSERTED,
    MOVED,
    REANCHORED,
    TURNED,
    Fingerprint,
    digestible,
    shown,
)
from kinetile.toolbox import WALLS
from kinetile_accuracy.specification.arithmetic import UNIT_BITS, UNIT_TICKS, tick_of, unit_bits
from kinetile_accuracy.specification.course import LEAVING, Course, CourseEvent

_OFTEN = 256
"""Lines between two calls of ``progress``."""

_PLAN = ("x", "y", "vx", "vy")
_NAMES, _TIMED = ["epoch", "tick", "a", "b"], ["time", "a", "b"]

_IDLE = UNIT_TICKS << 20
"""A run that ends by its number of contacts is given up after so many ticks without a contact."""

_FARTHEST = 20_000
"""The most contacts before a difference that ``explain_difference`` certifies, in some seconds."""

_OTHERS = {
    **{each.code: f"the {each.said[0]}" for each in COMMAND_KINDS},
    REANCHORED: "the anchoring",
    LEAVING: "the leaving",
}

Line = tuple[int, int, int, int]
"""A line of a list: epoch, tick, a, b."""


class LogProgress(NamedTuple):
    """The progress of a certifier: the number of right lines, of all lines, and the time of the last."""

    lines: int
    total: int
    time: float


@dataclass(frozen=True)
class WrongLine:
    """The first line that differs from the specification, with the reason in a sentence: its place, from 0;
    the line, (epoch, tick, a, b), None if missing; and the right line, or None."""

    index: int
    found: Line | None
    expected: Line | None
    why: str


@dataclass(frozen=True)
class CertifiedLog:
    """The result of a check: the number of right ``lines``, of the ``total``, before ``wrong``, if there is
    one. ``until``: no further contact is allowed up to and at this time; None: later contacts were
    not checked. ``finished`` is False if the check was interrupted. ``fingerprint`` is the digest of the
    contacts (rule 10), if all lines are right."""

    lines: int
    total: int
    until: float | None
    finished: bool
    wrong: WrongLine | None = None
    fingerprint: str | None = None

    @property
    def right(self) -> bool:
        """Returns True if all lines are right, and no line is missing up to ``until``."""
        return self.finished and self.wrong is None

    def __str__(self) -> str:
        if self.wrong is not None:
            return f"line {self.wrong.index + 1:,} is wrong: {self.wrong.why}"
        if not self.finished:
            return f"the first {self.lines:,} of {self.total:,} lines are right; broken off there"
        end = "later contacts were not checked" if self.until is None else f"to time {self.until!r}"
        return f"all lines are right: {self.total:,}, {end}"

    def as_dict(self) -> dict[str, Any]:
        """Returns all fields in plain types, fit for JSON."""
        wrong = self.wrong and vars(self.wrong)
        return {**vars(self), "right": self.right, "wrong": wrong, "sentence": str(self)}


@dataclass
class LogCertifier:
    """A check in progress, as by ``certify_log``; ``report`` is its result so far, at any moment."""

    scene: Scene
    contacts: Array | Sequence[Any]
    until: float | None = None
    _: KW_ONLY
    max_contacts: int | None = None
    fingerprint: str | None = None
    within: float | None = None

    def __post_init__(self) -> None:
        start, until, within = self.scene.start, self.until, self.within
        self._names = _NAMES if within is None else _TIMED
        self._rows = _as_rows(self.contacts, self._names)
        if until is not None and not start <= until < float("inf"):
            raise BadOption(f"until is {until!r}; expected a time from the scene's start on, {start!r}")
        if within is not None and not (0.0 < within < math.inf and np.isfinite(self._rows["time"]).all()):
            raise BadOption(f"within is {within!r}; expected a number above 0, and finite times")
        names = self._rows.dtype.names or ()
        self._whole = {side + name for side in "ab" for name in _PLAN} <= set(names)
        self._timed = "time" in names and within is None
        self.report = CertifiedLog(0, len(self._rows), until, finished=False)

    def run(self, progress: Callable[[LogProgress], None] | None = None) -> CertifiedLog:
        """Checks all lines, up to the first wrong one."""
        wrong, fingerprint = self._first_wrong(progress), None
        if wrong is None and self.within is None:
            contacts = Fingerprint()
            contacts.update(digestible(self._rows[self._rows["b"] > TURNED]))
            fingerprint = contacts.hexdigest()
            if self.fingerprint not in (None, fingerprint):
                why = f"the fingerprint of the lines before it is {fingerprint}, and not {self.fingerprint}"
                wrong = WrongLine(len(self._rows), None, None, why)
        self.report = replace(self.report, finished=True, wrong=wrong, fingerprint=fingerprint)
        return self.report

    def _first_wrong(self, progress: Callable[[LogProgress], None] | None) -> WrongLine | None:
        scene, bits, until, most = self.scene, unit_bits(self.scene), self.until, self.max_contacts
        exact = scene.settings.end
        last = exact and ((exact[0] << UNIT_BITS) + exact[1], exact[2])
        course = Course(scene, last if until == scene.settings.until else None)
        end = None if until is None else tick_of(until, scene.start, bits)
        contacts, held = 0, list[CourseEvent]()
        untimely = -1  # the first line whose time differs from its tick's, in doubles
        if self._timed:
            units = self._rows["epoch"] + self._rows["tick"] * 2.0**-UNIT_BITS
            off = self._rows["time"] != scene.start + units * 2.0**-bits
            untimely = int(off.argmax()) if off.any() else -1
        for index, row in enumerate(self._rows[self._names].tolist()):
            found = row if self.within is None else self._snapped(course, *row)
            epoch, tick, a, b = found
            line = CourseEvent((epoch << UNIT_BITS) + tick, a, b)
            if progress is not None and index % _OFTEN == 0:
                progress(LogProgress(index, len(self._rows), scene.start + course.now * course.tick))
            contacts += b > TURNED
            if most is not None and contacts > most:
                return WrongLine(index, found, None, f"there are to be {most:,} contacts and no more")
            is_told = bool(held)
            due = held.pop(0) if held else self._due(course, line.tick if end is None else end)
            if due != line or not 0 <= tick < UNIT_TICKS:
                why, due = _reason(course, found, due, end)
                return WrongLine(index, found, due and _line_of(due), why)
            if not is_told:
                held = self._carried_out(course, line)
            plans = self._wrong_plan(course, index, line) if self._whole else None
            if index == untimely:
                time = float(self._rows["time"][index])
                plans = f"the time of {_named(line)} is {time!r}, and not the time of its tick"
            if plans is not None:
                return WrongLine(index, found, found, plans)
            self.report = replace(self.report, lines=index + 1)
        if contacts == most or (end is None and most is None):
            return None
        due = held[0] if held else self._due(course, course.now + _IDLE if end is None else end)
        if due is None:
            return None
        there = "is one more before the end" if end is not None else f"are to be {most:,} contacts"
        why = f"there {there}: {_named(due)} at {_when(due.tick)}"
        return WrongLine(len(self._rows), None, _line_of(due), why)

    def _snapped(self, course: Course, time: float, a: int, b: int) -> Line:
        """Returns the next contact if it is of these bodies, and within the distance of a time; otherwise the
        written line, at the tick of the time."""
        start, unit = self.scene.start, self.scene.time_unit
        slack = cast(float, self.within) * max(abs(time - start), unit)
        early, tick, late = (tick_of(time + by, start, unit_bits(self.scene)) for by in (-slack, 0.0, slack))
        due = self._due(course, late)
        is_right = due is not None and due[1:] == (a, b) and due.tick >= early
        return _line_of(due if due and is_right else CourseEvent(tick, a, b))

    def _carried_out(self, course: Course, line: CourseEvent) -> list[CourseEvent]:
        """Carries an event out; returns the rows after it in a whole log: of held or released bodies."""
        before = [plan.pull for plan in course.plans]
        course.carry_out()
        if not self._whole or line.b in (LEAVING, ACCELERATED, INSERTED):
            return []
        own = [each for each in line[1:] if each >= 0]
        changed = [body for body, pull in enumerate(before) if pull != course.plans[body].pull]
        first = [body for body in own if body in changed and line.b != MOVED]
        others = [body for body in changed if body not in own]
        return [CourseEvent(line.tick, body, LEAVING) for body in (*first, *others)]

    def _due(self, course: Course, end: int) -> CourseEvent | None:
        """Returns the next event that the list must have; carries out the events that it leaves out."""
        while (due := course.next(end)) is not None and due.b <= TURNED and not self._whole:
            course.carry_out()
        return due

    def _wrong_plan(self, course: Course, index: int, line: CourseEvent) -> str | None:
        """Returns the first fault of a row's plans by rule 9, or by the command; zeros have any sign."""
        row, plan, nan = self._rows[index], course.plans[line.a], float("nan")
        one = two = (nan,) * len(_PLAN)
        if course.has_changed_plans(line):
            one = plan.x, plan.y, plan.vx, plan.vy
            if line.b >= 0:
                plan = course.plans[line.b]
                two = plan.x, plan.y, plan.vx, plan.vy
        if course.accelerated and line.b in (INSERTED, MOVED, ACCELERATED, LEAVING):
            two = *plan.pull, nan, nan
        for side, body, numbers in (("a", line.a, one), ("b", line.b, two)):
            for name, right in zip(_PLAN, numbers, strict=True):
                found = float(row[side + name])
                if found != right and not (np.isnan(right) and np.isnan(found)):
                    whose = f"{name} of body {body}" if body >= 0 else f"{side}{name}"
                    return f"{whose} after {_named(line)} is {found!r}; by rules 4 and 9 it is {right!r}"
        return None


def certify_log(
    scene: Scene,
    contacts: Array | Sequence[Any],
    until: float | None = None,
    *,
    max_contacts: int | None = None,
    fingerprint: str | None = None,
    within: float | None = None,
    progress: Callable[[LogProgress], None] | None = None,
) -> CertifiedLog:
    """Checks a list of contacts of a scene by docs/specification.md.

    Args:
        scene: the simulated scene, with ``disc`` or ``convex``, and ``wall``.
        contacts: (m,) rows with the fields epoch, tick, a, b, in their order, such as ``sim.contacts``. If
            rows have the fields of ``kinetile.LOG``, commands are among them, and the plans after each event
            are compared, and the field time too. Lists of such rows, or of [epoch, tick, a, b], are accepted.
        until: all contacts up to and at this time must be there, and no later ones; if it is the time in the
            scene's settings, their exact end counts. None: only the lines are checked.
        max_contacts: the list is of a run that was ended after this number of contacts; with ``until`` there
            may be fewer, and without it only if no more come for a million units.
        fingerprint: the fingerprint that the list gives; None: it has no fingerprint.
        within: rows have the fields time, a, b, in the order of the right ones, and a time is right within
            this distance, relative to the time since the start or the unit of time; None: compares ticks.
        progress: called now and then with the progress of the check.

    Raises BadOption for other fields, or ``until`` before the start; Refused for an unspecified response.
    """
    how: dict[str, Any] = {"max_contacts": max_contacts, "fingerprint": fingerprint, "within": within}
    return LogCertifier(scene, contacts, until, **how).run(progress)


def _as_rows(contacts: Array | Sequence[Any], names: list[str]) -> Array:
    """Returns a list of contacts, of any form, as an array with these fields, or more."""
    known = contacts.dtype.names if isinstance(contacts, np.ndarray) and contacts.ndim == 1 else None
    if known and {*names} <= {*known}:
        return np.asarray(contacts)
    kinds: list[Any] = [float if name == "time" else operator.index for name in names]
    try:
        rows: list[Any] = [row[names].item() if isinstance(row, np.void) else row for row in contacts]
        made = [tuple(kind(each) for kind, each in zip(kinds, row, strict=True)) for row in rows]
        return np.array(made, [(name, "f8" if name == "time" else "i8") for name in names])
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        fields = f"with the fields {', '.join(names[:-1])} and {names[-1]}, or a list of such rows"
        text = f"a list of contacts is an array {fields}, such as sim.contacts; found {shown(contacts)}"
        raise BadOption(text) from error


def explain_difference(
    scene: Scene, lists: Mapping[str, Array], index: int, narrow_phases: Sequence[str] | None = None
) -> str:
    """Returns a sentence that names the right lists among ``lists`` of contacts, by the names of their
    sources, which first differ at ``index``; "" without a specified answer, or after too many contacts."""
    names = scene.settings.narrow_phases if narrow_phases is None else narrow_phases
    known = {"convex" if scene.shapes else "disc", *(() if scene.arena is None else ("wall",))}
    if index > _FARTHEST or (names is not None and set(names) != known):
        return ""
    try:
        Course(scene)
    except Refused:
        return ""
    there = (contacts[index] for contacts in lists.values() if len(contacts) > index)
    latest = max(int(each["epoch"]) * UNIT_TICKS + int(each["tick"]) for each in there)
    tick = Fraction(2) ** -(UNIT_BITS + unit_bits(scene))
    # Just after the latest, and not before it.
    until = math.nextafter(float(Fraction(scene.start) + latest * tick), math.inf)

    def verdict(contacts: Array) -> str:
        """Returns the verdict on contacts; up to ``until``, if the list has ended before."""
        found = certify_log(scene, contacts[: index + 1], until=None if len(contacts) > index else until)
        if found.wrong is None:
            return "is right there"
        return f"is wrong in contact {found.wrong.index}: {found.wrong.why}"

    verdicts = (f"{name} {verdict(contacts)}" for name, contacts in lists.items())
    return f"by the specification {'; '.join(verdicts)}"


# Reasons for a wrong line: the motion of its bodies by the specification


def _line_of(event: CourseEvent) -> Line:
    return *divmod(event.tick, UNIT_TICKS), event.a, event.b


def _when(tick: int) -> str:
    return "epoch {}, tick {}".format(*divmod(tick, UNIT_TICKS))


def _named(event: CourseEvent) -> str:
    _, a, b = event
    if b in _OTHERS:
        return f"{_OTHERS[b]} of body {a}" + " by the clock" * (b == REANCHORED)
    if a > b >= 0:
        return f"the parting of body {b} and body {a}"
    return f"body {a} with body {b}" if b >= 0 else f"body {a} with the {WALLS[b]} wall"


def _reason(
    course: Course, found: Line, due: CourseEvent | None, end: int | None
) -> tuple[str, CourseEvent | None]:
    """Returns the reason why a line is wrong, and the right line, if known; ``course`` is the scene after all
    lines before it, and may be moved on; ``due`` is next up to the tick ``end``, or else the line's."""
    why = _malformed(course, found)
    if why is not None:
        return why, due
    line = CourseEvent((found[0] << UNIT_BITS) + found[1], *found[2:])
    own, why = _own_tick(course, line)
    if due is None and own is not None and end is None:
        due = course.next(own)
    if due is not None and due[1:] == line[1:]:
        off = abs(line.tick - due.tick)
        how = f"{off:,} tick{'s' if off > 1 else ''} {'earlier' if line.tick > due.tick else 'later'}"
        return f"{_named(line)}: its tick should be {_when(due.tick)}, {how}", due
    at = f"{_named(line)} at {_when(line.tick)}"
    if due is None and end is not None and line.tick > end:
        return f"{at} is after the end, which is at {_when(end)}", due
    if own == line.tick and due is not None:
        return f"{at} comes too early: before it comes {_named(due)} at {_when(due.tick)}", due
    follows = "" if due is None else f"; next is {_named(due)} at {_when(due.tick)}"
    return f"{at}: {why}{follows}", due


def _malformed(course: Course, found: Line) -> str | None:
    """Returns the reason why no list of this scene can have a line; None if one can."""
    _, tick, a, b = found
    count = len(course.plans)
    for body in (a, max(b, 0)):
        if not 0 <= body < count:
            wall = "; a wall is written as b, behind the body that meets it" if body in WALLS else ""
            return f"there is no body {body}: the scene has {count:,}{wall}"
        if not course.present[body] and b != INSERTED:
            return f"body {body} is not there: it is still to come, or has gone"
    if not 0 <= tick < UNIT_TICKS:
        return f"a tick is from 0 to 2^52 - 1, and this one is {tick}"
    if b >= 0:
        return None if a < b or course.ends(b, a) else f"the bodies {a} and {b} are not in ascending order"
    if b not in (*WALLS, *_OTHERS):
        return f"there is no wall {b}: the walls are -1 to -4"
    return "the scene has no walls" if b in WALLS and course.frame.arena is None else None


def _own_tick(course: Course, line: CourseEvent) -> tuple[int | None, str]:
    """Returns the tick of contact of a line's bodies by their present plans, or None; and a text."""
    tick, a, b = line
    if b < 0:
        if b not in WALLS:
            return tick if course.is_planned(line) else None, "nothing of the kind happens then"
        met = course.wall(a)
        if met is None:
            return None, "it flies towards no wall"
        if met[1] != b:
            return None, f"the wall that it meets first is the {WALLS[met[1]]} one, at {_when(met[0])}"
        own = met[0]
    else:
        image = course.meeting(a, b)
        if image is None and course.have_just_met(a, b):
            since = _when(course.plans[a].anchor)
            return None, f"these two have just met, at {since}, and do not meet again by their present plans"
        if image is None:
            return None, "by their present plans these two do not meet"
        own = image[0]
    return own, f"by the present plans that is at {_when(own)}"
