"""What a check is: a sentence, and a function that sees whether a broad phase makes it true.

A check is given a subject and a scene, and raises ``Disagreement`` where the sentence does not hold. Nothing
is compared with a tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np

from kinetile.errors import Refused
from kinetile.scene import Scene
from kinetile_accuracy.answer.judgement import judged
from kinetile_conformance.cases import CONTACTS, REFERENCE, Outcome, Subject, difference, outcome

__all__ = ["Check", "Disagreement", "DoesNotApply", "Reference", "Run", "agree", "agree_by_hand", "check"]


class Reference(Protocol):
    """Returns what the reference makes of a scene, in so many contacts at most."""

    def __call__(self, scene: Scene, contacts: int = CONTACTS) -> Outcome:
        """Return it."""
        ...


JUDGED = 20
"""Bodies up to which exact arithmetic says who is right: with hundreds it takes a second a scene."""

Run = Callable[[Subject, Scene, Reference], None]
Strategy = Callable[[], Any]
"""Returns a Hypothesis strategy of scenes; a function, for Hypothesis is imported when something is drawn."""


class DoesNotApply(Refused):
    """A phase does not claim what a check puts to the test."""


class Disagreement(AssertionError):
    """A phase does not do what a check says; the message is what was seen.

    ``scene`` is the one on which it was seen, where that is not the one that the check was given.
    """

    def __init__(self, said: str, scene: Scene | None = None) -> None:
        super().__init__(said)
        self.scene = scene


@dataclass(frozen=True)
class Check:
    """One thing that a broad phase must do.

    Attributes:
        name: how it is called on the command line.
        sentence: what it says.
        run: called with the subject, a scene, and the reference's outcome on that scene (made when asked
            for).
        draws: whether it is run on drawn scenes; if not, it is run once, on an empty scene.
        turns: whether the scenes that it draws have turns.
        feature: it applies only to phases that declare this feature; None: to all.
        since: the version of the kit that it came with.
        scenes: what it draws; None: the small scenes, which are drawn once for all checks that look at them.
        share: how many of these to one of the small ones; at least one is drawn.
        compares: whether a failure is held against kinetile's other phases; some speak of this one alone.
        judges: "broad" where it looks at the broad phase alone, which it does where no narrow phase is named;
            "pair" where it looks at the narrow phase for pairs, which it does where one is named; None: at
            all phases together.
        replayed_by: the check that replays a scene on which this one has failed; "": this one itself.
    """

    name: str
    sentence: str
    run: Run
    draws: bool = True
    turns: bool = False
    feature: str | None = None
    since: str = "1.0"
    scenes: Strategy | None = None
    share: float = 1.0
    compares: bool = True
    judges: Literal["broad", "pair"] | None = None
    replayed_by: str = ""

    @property
    def replay(self) -> str:
        """The name of the check that replays a scene on which this one has failed; "" where none does."""
        return self.replayed_by or (self.name if self.draws else "")


def check(**how: Any) -> Callable[[Run], Check]:
    """Make a check of a function: it has the function's name, and its docstring is the sentence."""

    def made(function: Run) -> Check:
        sentence = " ".join((function.__doc__ or "").split())
        return Check(function.__name__.replace("_", "-"), sentence, function, **how)

    return made


def agree(
    subject: Subject, scene: Scene, reference: Reference, how: str = "", contacts: int = CONTACTS
) -> None:
    """Raise unless the subject's outcome on a scene is the reference's, bit for bit."""
    expected = reference(scene, contacts)  # first, lest the subject change the scene for both
    found = outcome(subject, scene, contacts)
    said = difference(found, expected, subject.name)
    if said is not None:
        raise Disagreement(f"{how}{said}{_who_is_right(subject, scene, found, expected)}", scene)


def agree_by_hand(subject: Subject, ran: Callable[[Subject], Outcome]) -> None:
    """Raise unless what is done by hand has the same outcome under the subject as under the reference."""
    expected = ran(subject.under(REFERENCE))
    said = difference(ran(subject), expected, subject.name)
    if said is not None:
        raise Disagreement(said)


def _who_is_right(subject: Subject, scene: Scene, found: Outcome, expected: Outcome) -> str:
    """Return a line that says whose contacts are the specification's, where they differ."""
    if len(scene) > JUDGED:
        return ""
    rows = min(len(found.contacts), len(expected.contacts))
    parted = np.flatnonzero(found.contacts[:rows] != expected.contacts[:rows])
    if not len(parted) and len(found.contacts) == len(expected.contacts):
        return ""
    lists = {subject.name: found.contacts, REFERENCE: expected.contacts}
    narrow = list(subject.narrow_phases(scene) or ()) or None
    said = judged(scene, lists, int(parted[0]) if len(parted) else rows, narrow)
    return f"\n{said}" if said else ""
