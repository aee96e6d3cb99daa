"""The certified oracle: the list of contacts as it is in exact arithmetic, or as far as that can be proved.

An event-driven simulator of its own, which shares nothing with the kernel but the scene as data. It computes
with balls, intervals that are certain to hold the true number, and leaves nothing out: after each contact its
bodies are compared with every other body, through each image that is near, and every wall. Whatever decides
the order is certified. What does not come out is tried again from the start with twice the bits; what ties
exactly is settled in rational arithmetic where the bodies still fly on rational lines (walls, lanes, contacts
in line, and whatever flies there for the first time); and what neither settles is reported as undecidable,
with the time and the bodies. Nothing is guessed.

Contacts at one time come in the order that docs/one-answer.md gives: commands, then walls, then pairs, then
ends of passings, by the numbers of the bodies, of one pair by image. Contact means approach; tangency is no
contact, and bodies that touch and approach meet at once. What happens then is rule 11 of
docs/specification.md, with exact times in the place of ticks (``rules``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Context
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from kinetile.errors import Refused
from kinetile.scene import Scene
from kinetile_accuracy.sections import needed

if TYPE_CHECKING:
    from kinetile_accuracy.oracle.attempt import Attempt, BallContact


CAP_BITS = 1 << 13
"""Bits at which the oracle gives up, if nothing else is said."""

FIRST_BITS = 1 << 7
STUCK = 4
"""Precisions in a row at which the same comparison may fail: after that it is taken for an exact tie."""

MOST_BODIES = 1000

IDLE = 1 << 17
"""Computations of images since the last contact after which a run without an end in time is given up."""

Ending = Literal[
    "until", "contacts", "quiet", "stopped", "undecidable", "jammed", "crowded", "idle", "interrupted"
]
"""Why a certified run ended: at the given time, after this many contacts, because nothing can
happen any more, because the caller had seen enough, because an order could not be decided, because contacts
followed each other without end in hardly any time, because an inserted body had no room, because bodies flew
on and on and met nobody, or because it was interrupted."""


class Enclosure(NamedTuple):
    """A number that is certain to lie within ``radius`` of ``middle``; both exact."""

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
    """A contact of body ``a`` with body ``b`` > a, or with a wall (-1 left, -2 right, -3 bottom, -4 top).

    Of two bodies that pass through each other it is the beginning; the end has 0 <= ``b`` < ``a``.
    ``time`` is the scene's; ``tied`` is whether the contact before it was at the very same time; ``head_on``
    is about which part of the relative velocity is along the line of centres, or across the wall: near 0 it
    is a graze (and 1 for discs that overlapped before they approached each other, or in a command's passing).
    ``speed`` is about the relative speed before it.
    """

    time: Enclosure
    a: int
    b: int
    tied: bool
    head_on: float
    speed: float


class Undecidable(NamedTuple):
    """What could not be decided, about when, and for which bodies."""

    what: str
    time: float
    bodies: tuple[int, ...]


@dataclass(frozen=True)
class CertifiedRun:
    """The certified part of a run.

    Attributes:
        contacts: the contacts in order; none is missing before the last.
        bits: the precision in which they were computed.
        ended: why there are no more.
        until: the time at which it was to end.
        undecidable: what could not be decided, where that is why.
        images: for each contact of two discs the periods along x and y from where b is to the image through
            which a met it; of places that are never wrapped. (0, 0) for a contact with a wall.
    """

    contacts: tuple[CertifiedContact, ...]
    bits: int
    ended: Ending
    until: float | None = None
    undecidable: Undecidable | None = None
    images: tuple[tuple[int, int], ...] = ()

    @property
    def complete(self) -> bool:
        """Returns whether the run came to the end that it was given."""
        return self.ended in ("until", "contacts", "quiet", "stopped")

    def __str__(self) -> str:
        return f"{len(self.contacts):,} contacts certified in {self.bits} bits; {self.ending}"

    @property
    def ending(self) -> str:
        """Why it ended, in words."""
        if self.undecidable is not None:
            what, time, bodies = self.undecidable
            which = ", ".join(map(str, bodies))
            said = f"{what} (near time {time:.17g}, bodies {which})"
            return f"not decidable at {self.bits} bits: {said}"
        last = self.contacts[-1].time.nearest if self.contacts else None
        return {
            "until": f"complete up to time {self.until!r}",
            "contacts": "complete up to the last of them",
            "quiet": "nothing happens after that",
            "stopped": "complete up to the last of them",
            "jammed": f"the bodies are jammed near time {last!r}: contacts follow each other without end",
            "crowded": "a body that is inserted next has no room",
            "idle": "the bodies fly on and meet nobody for very long: give an end in time",
            "interrupted": "interrupted",
        }.get(self.ended, self.ended)


class OracleProgress(NamedTuple):
    """How far a run of the oracle is: its precision, the contacts so far at it, the scene's time, and which
    share that is of what it was given to do."""

    bits: int
    contacts: int
    time: float
    share: float


class Oracle:
    """The oracle of one scene.

    Args:
        scene: the scene, taken as data.
        narrow_phases: which contacts there are: of discs ("disc"), with walls ("wall"), both or none. None:
            what the scene says, or both.

    Raises:
        MissingExtra: python-flint is not installed.
        Refused: a narrow phase is neither of the two, not all bodies are discs, there are too many to
            compute all pairs, a response is not of the specification, or a command comes after contacts of
            its tick.

    ``certified`` is the certified part so far; after an interruption too.
    """

    def __init__(self, scene: Scene, narrow_phases: Sequence[str] | None = None) -> None:
        _flint()
        names = narrow_phases if narrow_phases is not None else scene.settings.narrow_phases
        if names is None:
            names = ("disc", "wall")
        strange = [name for name in names if name not in ("disc", "wall")]
        if strange:
            raise Refused(
                f"the oracle knows the narrow phases disc and wall, and not {', '.join(strange)}: certify "
                "what those two do"
            )
        if scene.shapes:
            raise Refused("the oracle certifies contacts of discs, and this scene has bodies of other shapes")
        from kinetile_accuracy.oracle.rules import Rules

        self._rules = Rules(scene)
        if self._rules.count > MOST_BODIES:
            raise Refused(
                f"the oracle looks at all pairs after each contact and takes up to {MOST_BODIES} bodies, and "
                f"this scene has {self._rules.count}, inserted ones included: certify a smaller one"
            )
        self.scene = scene
        self.certified = CertifiedRun((), FIRST_BITS, "interrupted")
        self._discs = "disc" in names
        self._walls = "wall" in names
        self._start = Fraction(scene.start)

    def run(
        self,
        until: float | None = None,
        *,
        max_contacts: int | None = None,
        cap_bits: int = CAP_BITS,
        stop: Callable[[int, int, int], bool] | None = None,
        progress: Callable[[OracleProgress], None] | None = None,
    ) -> CertifiedRun:
        """Finds the contacts from the start on, certified; returns them.

        Args:
            until: up to and at which time; None: the scene's own ``until``, unless ``max_contacts`` is given.
                If the scene has an exact end at that time, the run ends there, before contacts.
            max_contacts: up to how many contacts.
            cap_bits: the highest precision to try.
            stop: called with the index, a and b of each contact; True: that is enough.
            progress: called after every few contacts.
        """
        from kinetile_accuracy.oracle.attempt import Attempt
        from kinetile_accuracy.oracle.event_queue import Undecided

        if until is None and max_contacts is None:
            until = self.scene.settings.until
            if until is None:
                raise ValueError("the oracle needs an end: until=, max_contacts= or an until in the scene")
        if until is not None and not self.scene.start <= until < math.inf:
            raise ValueError(f"until must be a time from the scene's start on; found {until}")
        self.certified = CertifiedRun((), FIRST_BITS, "interrupted", until)
        most = math.inf if max_contacts is None else max_contacts
        end = None if until is None else self._rules.end(self.scene, until)
        span = (0.0 if until is None else until - self.scene.start) or math.inf
        bits, failures = FIRST_BITS, []

        def told(found: list[CertifiedContact]) -> None:
            if progress is not None and len(found) % 16 == 0:
                time = found[-1].time.nearest
                share = max(len(found) / most, (time - self.scene.start) / span)
                progress(OracleProgress(bits, len(found), time, min(share, 1.0)))

        while True:
            found: list[CertifiedContact] = []
            images: list[tuple[int, int]] = []
            ended: Ending = "interrupted"
            undecidable = None
            with _flint().ctx.workprec(bits):
                try:
                    attempt = Attempt(self.scene, self._rules, end, self._discs, self._walls)
                    ended = self._carry_out(attempt, found, images, most, stop, told)
                except Undecided as doubt:
                    # What stays undecided at the same contact is an exact tie: no number of bits settles it.
                    failures.append((len(found), doubt.what))
                    stuck = failures[-STUCK:] == failures[-1:] * STUCK
                    if stuck or 2 * bits > max(cap_bits, FIRST_BITS):
                        ended = "undecidable"
                        time = float(self._start + Fraction(doubt.time))
                        undecidable = Undecidable(doubt.what, time, doubt.bodies)
                finally:  # an interrupted attempt may have come less far than the one before it
                    if ended != "interrupted" or len(found) >= len(self.certified.contacts):
                        self.certified = CertifiedRun(
                            tuple(found), bits, ended, until, undecidable, tuple(images)
                        )
            if ended != "interrupted":
                return self.certified
            bits *= 2

    def _carry_out(
        self,
        attempt: Attempt,
        found: list[CertifiedContact],
        images: list[tuple[int, int]],
        most: float,
        stop: Callable[[int, int, int], bool] | None,
        told: Callable[[list[CertifiedContact]], None],
    ) -> Ending:
        """Runs an attempt to its end, adding to what was found."""
        while len(found) < most:
            if len(attempt.met) == len(found):
                if attempt.ended is not None:
                    return attempt.ended
                if attempt.idle > IDLE and self.certified.until is None:
                    return "idle"
                attempt.step()
                continue
            met = attempt.met[len(found)]
            found.append(self._contact(met))
            images.append(met.image)
            if stop is not None and stop(len(found) - 1, found[-1].a, found[-1].b):
                return "stopped"
            told(found)
        return "contacts"

    def _contact(self, met: BallContact) -> CertifiedContact:
        time = Enclosure(self._start + _fraction(met.ball.mid()), _fraction(met.ball.rad()))
        return CertifiedContact(time, met.a, met.b, met.tied, met.head_on, met.speed)


def oracle_contacts(
    scene: Scene,
    until: float | None = None,
    *,
    max_contacts: int | None = None,
    cap_bits: int = CAP_BITS,
    narrow_phases: Sequence[str] | None = None,
) -> CertifiedRun:
    """Returns the certified contacts of a scene: see ``Oracle``."""
    return Oracle(scene, narrow_phases).run(until, max_contacts=max_contacts, cap_bits=cap_bits)


def _flint() -> Any:
    return needed("The certified oracle", "python-flint", "exact", "flint")


def _fraction(exact: Any) -> Fraction:
    """Returns an exact ball as a fraction."""
    mantissa, exponent = map(int, exact.man_exp())
    return Fraction(mantissa << exponent) if exponent >= 0 else Fraction(mantissa, 1 << -exponent)
