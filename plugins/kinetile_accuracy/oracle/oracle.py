"""The certified oracle: the list of contacts in exact arithmetic, as far as it can be proved.

The oracle is an event-driven simulator that shares nothing with the kernel but the scene as data. It computes
with balls: after each contact its bodies are compared with every other body and every wall, and each
comparison that decides the order is certain, or the run begins again with twice the bits. Exact ties are
decided in rational arithmetic while the bodies fly on rational lines (walls, lanes, contacts in line, and
each first flight). A comparison that neither decides is undecidable, with its time and bodies.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Context
from fractions import Fraction
from itertools import islice
from typing import Any, Literal, NamedTuple

from kinetile import Scene, Turn
from kinetile.errors import Refused
from kinetile.lazy import needed
from kinetile_accuracy.sections import listed

CAP_BITS = 1 << 13
"""The most bits that the oracle tries by default."""

FIRST_BITS = 1 << 7
STUCK = 4
"""After this number of precisions in a row, the same failed comparison counts as an exact tie."""

MOST_BODIES = 1000

Ending = Literal["going on", "until", "quiet", "undecidable", "jammed"]
"""The reason for the end: no more contacts were requested, the given time was reached, no further contact is
possible, an order could not be decided, or contacts followed each other without end in hardly any time."""


class Enclosure(NamedTuple):
    """A number that certainly lies within ``radius`` of ``middle``; both exact."""

    middle: Fraction
    radius: Fraction

    @property
    def nearest(self) -> float:
        """The double nearest to the middle."""
        return float(self.middle)

    def decimal(self, digits: int = 25) -> str:
        """Returns the number in up to this many digits: all known ones, the last to within one."""
        if self.radius:
            size = max(abs(self.middle), self.radius)
            digits = max(1, min(digits, math.floor(math.log10(size / self.radius))))
        context = Context(prec=digits)
        return str(context.divide(self.middle.numerator, self.middle.denominator))


class CertifiedContact(NamedTuple):
    """A contact of body ``a`` with body ``b`` > a, or with a wall (-1 left, -2 right, -3 bottom, -4 top), at
    the scene's ``time``; ``tied``: at the time of the contact before it; ``head_on``: approximately the part
    of the relative velocity along the line of centres, or across the wall: near 0 it is a graze."""

    time: Enclosure
    a: int
    b: int
    tied: bool
    head_on: float


class Undecidable(NamedTuple):
    """An undecided comparison: its subject, its approximate time, and its bodies."""

    what: str
    time: float
    bodies: tuple[int, ...]


@dataclass(frozen=True)
class CertifiedRun:
    """The certified part of a run, with the highest precision that was needed: none of the ``contacts`` is
    missing before the last. ``ended`` is the reason for its end; ``undecidable`` is the undecided comparison,
    if that is the reason; ``until`` is the requested end."""

    contacts: tuple[CertifiedContact, ...]
    bits: int
    ended: Ending
    until: float | None = None
    undecidable: Undecidable | None = None

    @property
    def complete(self) -> bool:
        """Returns True if it has all contacts up to its end, or the requested number."""
        return self.ended not in ("undecidable", "jammed")

    def __str__(self) -> str:
        return f"{len(self.contacts):,} contacts certified in {self.bits} bits; {self.ending}"

    @property
    def ending(self) -> str:
        """The reason for its end, in words."""
        if self.undecidable is not None:
            what, time, bodies = self.undecidable
            which = ", ".join(map(str, bodies))
            return f"not decidable at {self.bits} bits: {what} (near time {time:.17g}, bodies {which})"
        last = self.contacts[-1].time.nearest if self.contacts else None
        return {
            "until": f"complete up to time {self.until!r}",
            "quiet": "nothing happens after that",
            "jammed": f"the bodies are jammed near time {last!r}: contacts follow each other without end",
        }.get(self.ended, "complete up to the last of them")


class Oracle:
    """The oracle of one scene: iterates over its certified contacts from the start on, up to and at a time,
    or to the last one, with ``cap_bits`` at most; ``certified`` is the certified part so far.

    Raises MissingExtra without python-flint, Refused if the scene has anything but elastic discs, walls and
    turns, or too many bodies, and ValueError if ``until`` is before its start, or not a number.
    """

    def __init__(self, scene: Scene, until: float | None = None, *, cap_bits: int = CAP_BITS) -> None:
        _flint()
        check_scope(scene)
        if until is not None and not scene.start <= until < math.inf:
            raise ValueError(f"until must be a time from the scene's start on; found {until}")
        self.scene, self.until, self.bits = scene, until, FIRST_BITS
        self._most_bits = max(cap_bits, FIRST_BITS)
        self._start = Fraction(scene.start)
        self._found: list[CertifiedContact] = []
        self._ended: Ending = "going on"
        self._undecidable: Undecidable | None = None
        self._contacts = self._follow()

    @property
    def certified(self) -> CertifiedRun:
        """The certified part so far."""
        return CertifiedRun(tuple(self._found), self.bits, self._ended, self.until, self._undecidable)

    def __iter__(self) -> Iterator[CertifiedContact]:
        return self._contacts

    def _follow(self) -> Iterator[CertifiedContact]:
        from kinetile_accuracy.oracle.attempt import Undecided

        failures: list[tuple[int, str]] = []
        while True:
            try:
                yield from self._attempt()
                return
            except Undecided as doubt:
                # Undecided again at the same contact: an exact tie, which no number of bits decides.
                failures.append((len(self._found), doubt.what))
                if failures[-STUCK:] == failures[-1:] * STUCK or 2 * self.bits > self._most_bits:
                    near = float(self._start + Fraction(doubt.time))
                    self._undecidable = Undecidable(doubt.what, near, doubt.bodies)
                    self._ended = "undecidable"
                    return
            self.bits *= 2

    def _attempt(self) -> Iterator[CertifiedContact]:
        from kinetile_accuracy.oracle.attempt import Attempt
        from kinetile_accuracy.oracle.times import exact

        def precisely(step: Any, *given: Any) -> Any:
            with _flint().ctx.workprec(self.bits):  # callers have their own precision between contacts
                return step(*given)

        end = None if self.until is None else exact(self.until) - exact(self.scene.start)
        attempt = precisely(Attempt, self.scene, end)
        contacts = attempt.contacts()
        number = 0
        while (met := precisely(next, contacts, None)) is not None:
            number += 1
            if number > len(self._found):
                time = Enclosure(self._start + _fraction(met.ball.mid()), _fraction(met.ball.rad()))
                self._found.append(CertifiedContact(time, *met[1:]))
                yield self._found[-1]
        self._ended = attempt.ended


def oracle_contacts(
    scene: Scene, until: float | None = None, *, max_contacts: int | None = None, cap_bits: int = CAP_BITS
) -> CertifiedRun:
    """Returns the certified contacts of a scene, up to and at a time, by default the scene's own, or to a
    number of contacts. Raises what ``Oracle`` raises, and ValueError without an end."""
    if until is None and max_contacts is None:
        until = scene.settings.until
        if until is None:
            raise ValueError("the oracle needs an end: until=, max_contacts= or an until in the scene")
    oracle = Oracle(scene, until, cap_bits=cap_bits)
    for _ in islice(oracle, max_contacts):
        pass
    return oracle.certified


def check_scope(scene: Scene, narrow_phases: Sequence[str] | None = None) -> None:
    """Raises Refused for anything but elastic discs, walls and turns, and for too many bodies."""
    names = narrow_phases if narrow_phases is not None else scene.settings.narrow_phases
    either = {"wall"} if scene.arena is None else set()  # without an arena both choices are the same
    usual = names is None or bool(scene.shapes) or {*names} | either == {"disc", "wall"}
    responses = {response.name for row in scene.meets for response in row} - {"elastic"}
    found = {
        "bodies of other shapes": scene.shapes,
        "periodic axes": any(scene.periods),
        "accelerations": scene.accelerated,
        "immovable bodies": not all(map(math.isfinite, scene.mass.tolist())),
        f"the responses {listed(sorted(responses))}": responses,
        "insertions or removals": any(not isinstance(each, Turn) for each in scene.commands),
        "commands at exact ticks": any(each.at is not None for each in scene.commands),
        "an end at an exact tick": scene.settings.end is not None,
        f"the narrow phases {listed(names or ['none'])}": not usual,
    }
    strange = [what for what, there in found.items() if there]
    if strange:
        raise Refused(
            "the oracle judges elastic discs that can move, between walls or without, and turns at their "
            f"times; this scene has {listed(strange)}: certify-log judges the contacts of such a scene"
        )
    if len(scene) > MOST_BODIES:
        raise Refused(
            f"the oracle compares all pairs and takes up to {MOST_BODIES:,} bodies, and this scene has "
            f"{len(scene):,}: certify a smaller one, or judge its contacts by certify-log"
        )


def _flint() -> Any:
    return needed("The certified oracle", "python-flint", "exact", "flint")


def _fraction(exact: Any) -> Fraction:
    mantissa, exponent = map(int, exact.man_exp())
    return Fraction(mantissa << exponent) if exponent >= 0 else Fraction(mantissa, 1 << -exponent)
