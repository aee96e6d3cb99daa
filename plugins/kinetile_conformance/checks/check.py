"""A check: a sentence, and a function that raises ``Disagreement`` where a broad phase does not make it true.

Nothing is compared with a tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np

from kinetile.errors import Refused
from kinetile.run.compare import first_difference
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.toolbox import box_gaps, reaches_of
from kinetile_accuracy.specification.certify import explain_difference
from kinetile_conformance.cases import CONTACTS, REFERENCE, RunOutcome, Subject, difference, outcome
from kinetile_conformance.strategies.small import Strategy


class Reference(Protocol):
    """Returns the reference's outcome of a scene."""

    def __call__(self, scene: Scene, contacts: int = CONTACTS) -> RunOutcome:
        """Return the outcome, with a number of contacts at most."""
        ...


JUDGED = 20
"""Bodies up to which exact arithmetic decides which is right: with hundreds it takes a second a scene."""

LIVING = {
    "living": "living scenes",
    "solid": "living scenes with responses",
    "passing": "living scenes in which some pass",
    "shapes": "living scenes of shapes",
}
"""The kinds of living scenes, in words."""

Run = Callable[[Subject, Scene, Reference], None]


class DoesNotApply(Refused):
    """A phase does not claim what a check puts to the test."""


class Disagreement(AssertionError):
    """A phase does not do what a check says; the message is the observation.

    ``scene`` is the scene of the observation, where that is not the one that the check was given.
    """

    def __init__(self, said: str, scene: Scene | None = None) -> None:
        super().__init__(said)
        self.scene = scene


@dataclass(frozen=True)
class Check:
    """One thing that a broad phase must do.

    Attributes:
        name: its name on the command line.
        sentence: what must hold.
        run: called with the subject, a scene, and the reference's outcome on that scene (made when it
            is needed).
        draws: whether it is run on drawn scenes; if not, it is run once, on an empty scene.
        turns: whether the scenes that it draws have turns.
        feature: it applies only to phases that declare this feature; None: to all.
        scenes: what it draws; None: the small scenes, which are drawn once for all checks that use them.
        living: the kind of living scenes that it is shown, which are played once for all checks that use
            them.
        share: how many of these for one of the small ones; at least one is drawn.
        compares: whether a failure is compared with kinetile's other phases; some concern this phase alone.
        judges: "broad" where it judges the broad phase alone, and applies where no narrow phase is named;
            "pair" where it judges the narrow phase for pairs, and applies where one is named; None: it
            judges all phases together.
        replayed_by: the check that replays a scene on which this one has failed; "": this one itself.
    """

    name: str
    sentence: str
    run: Run
    draws: bool = True
    turns: bool = False
    feature: str | None = None
    scenes: Strategy | None = None
    living: str = ""
    share: float = 1.0
    compares: bool = True
    judges: Literal["broad", "pair"] | None = None
    replayed_by: str = ""

    def count(self, examples: int) -> int:
        """Return its number of scenes for a number of small ones."""
        return max(1, round(self.share * examples)) if self.draws else 1

    @property
    def strategy(self) -> str:
        """What draws its scenes, in words."""
        if not self.draws:
            return "fixed scenes"
        if self.scenes is not None:
            return self.scenes.name
        if self.living:
            return LIVING[self.living]
        return "small scenes with turns" if self.turns else "small scenes"

    @property
    def replay(self) -> str:
        """The name of the check that replays a scene on which this one has failed; "" where none does."""
        return self.replayed_by or (self.name if self.draws else "")


def check(**how: Any) -> Callable[[Run], Check]:
    """Return a decorator that makes a function a check of its name, with its docstring as the sentence."""

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


def agree_when_commanded(subject: Subject, ran: Callable[[Subject], RunOutcome]) -> None:
    """Raise unless commands given between runs have the same outcome under the subject as under the
    reference."""
    expected = ran(subject.reference)
    said = difference(ran(subject), expected, subject.name)
    if said is not None:
        raise Disagreement(said)


def near_fault(sim: Simulation) -> str | None:
    """Return what is wrong with the phase's `near` now, in a sentence; None: nothing, or a repair is due.

    Every two bodies that touch, each with its reach and with its reaches to the four sides, must be near each
    other, both ways, and every number must be a body's.
    """
    k = sim.tables
    n = len(k.bodies)
    if bool((k.queue.own <= k.clock[0].now).any()):
        return None
    named = sim.near()
    strange = np.flatnonzero((named[:, 1] < 0) | (named[:, 1] >= n))
    if len(strange):
        body, other = named[strange[0]].tolist()
        return f"{other} is near {body}, and is no body of the scene"
    near = np.eye(n, dtype=np.bool_)
    near[named[:, 0], named[:, 1]] = True
    for body, other in np.argwhere(near & ~near.T).tolist():
        return f"{other} is near {body}, but {body} is not near {other}"
    place, radius = sim.positions(), np.asarray(k.bodies.radius)
    between, sides = (place[:, None] - place[None]).transpose(2, 0, 1), reaches_of(k)
    skin = k.clock[0].limits.skin  # half of what their reaches leave
    circles = np.hypot(*between) - (radius[:, None] + radius)
    apart = np.maximum(circles, box_gaps(between, sides, sides) + 2.0 * skin)
    for a, b in np.argwhere((apart <= skin) & ~near).tolist():
        return f"bodies {a} and {b} touch (gap {apart[a, b]:.3g}) and are not near each other"
    return None


def _who_is_right(subject: Subject, scene: Scene, found: RunOutcome, expected: RunOutcome) -> str:
    """Return a line that names the contacts that are right by the specification, where they differ."""
    if len(scene) > JUDGED:
        return ""
    at = first_difference(found.contacts, expected.contacts)
    if at is None:
        return ""
    lists = {subject.name: found.contacts, REFERENCE: expected.contacts}
    named = subject.narrow_phases(scene) or ()
    narrow = [name for name in named if scene.arena is not None or name != "wall"] or None
    said = explain_difference(scene, lists, at, narrow)
    return f"\n{said}" if said else ""
