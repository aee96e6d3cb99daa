"""A check: a cell of the table of strategies and observations. An observation looks at one scene, which a
strategy draws, under a phase, and raises ``Disagreement`` where something is not as it must be."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from kinetile import Scene
from kinetile.errors import Refused
from kinetile.instruments import first_difference
from kinetile_accuracy.specification.certify import explain_difference
from kinetile_conformance.cases import CONTACTS, REFERENCE, RunOutcome, Subject, difference
from kinetile_conformance.strategies.strategy import Strategy

Reference = Callable[[Scene, int], RunOutcome]
"""Returns the reference's outcome of a scene, with a number of contacts at most."""

JUDGED = 20
"""Bodies up to which exact arithmetic decides which is right: with hundreds it takes a second a scene."""


class DoesNotApply(Refused):
    """A phase does not claim what a check puts to the test."""


class Disagreement(AssertionError):
    """A phase does not do what a check says; ``scene`` is that of the observation, if it is another one."""

    def __init__(self, text: str, scene: Scene | None = None) -> None:
        super().__init__(text)
        self.scene = scene


@dataclass(frozen=True)
class Case:
    """The phases under test, a scene, the reference's outcomes, the limit of contacts of a run, and the
    ``number`` of the scene, by which an observation has turns; None: all that it does is done."""

    subject: Subject
    scene: Scene
    reference: Reference
    contacts: int = CONTACTS
    number: int | None = None

    @property
    def expected(self) -> RunOutcome:
        """The reference's outcome."""
        return self.reference(self.scene, self.contacts)


@dataclass(frozen=True)
class Observation:
    """A column of the table: what is looked at.

    Attributes:
        sentence: what must hold, without a full stop.
        look: called with a case; raises ``Disagreement``.
        feature: it applies only to phases that declare this feature; None: to all.
        compares: whether a failure is compared with kinetile's other phases; some concern this phase alone.
        judges: the part that it judges alone, "broad" where none is named, else one that is; None: all.
        replayed_by: the check that replays a scene on which this one has failed; "": this one itself.
    """

    name: str
    sentence: str
    look: Callable[[Case], None]
    feature: str | None = None
    compares: bool = True
    judges: Literal["broad", "pair", "wall", "response"] | None = None
    replayed_by: str = ""


def observation(**how: Any) -> Callable[[Callable[[Case], None]], Observation]:
    """Returns a decorator that makes a function an observation, with its docstring as the sentence."""

    def made(look: Callable[[Case], None]) -> Observation:
        sentence = " ".join((look.__doc__ or "").split()).removesuffix(".")
        return Observation(look.__name__.replace("_", "-"), sentence, look, **how)

    return made


@dataclass(frozen=True)
class Check:
    """A cell of the table: one observation on the scenes of one strategy, None where it has scenes of its
    own. ``share`` is their number for each of ``--examples``, at least one. The check of an observation
    ``at_home`` has its name; any other has that of its strategy as well."""

    observation: Observation
    strategy: Strategy | None = None
    share: float = 1.0
    at_home: bool = True

    @property
    def name(self) -> str:
        """The name on the command line."""
        return self.observation.name + ("" if self.at_home or not self.strategy else self.strategy.suffix)

    @property
    def sentence(self) -> str:
        """What must hold, and on what scenes."""
        where = f", {self.strategy.where}" if self.strategy and not self.at_home else ""
        return f"{self.observation.sentence}{where}."

    @property
    def judges(self) -> str | None:
        """What it judges; where only a broad phase can choose the scenes, the broad phase alone."""
        return self.observation.judges or ("broad" if self.strategy and self.strategy.broad else None)

    @property
    def replay(self) -> str:
        """The name of the check that replays a scene on which this one has failed; "" where none does."""
        return self.observation.replayed_by or (self.name if self.strategy else "")

    def count(self, examples: int) -> int:
        """Returns its number of scenes for a number of small ones."""
        if self.strategy is None:
            return 1
        return self.strategy.fixed or max(1, round(self.share * examples))

    def run(self, subject: Subject, scene: Scene, reference: Reference, number: int | None = None) -> None:
        """Looks at a scene; raises Disagreement where it does not hold."""
        contacts = self.strategy.contacts if self.strategy else CONTACTS
        turn = None if self.strategy and self.strategy.fixed else number
        self.observation.look(Case(subject, scene, reference, contacts, turn))


def compare(case: Case, found: RunOutcome, how: str = "") -> None:
    """Raises unless an outcome of the phases under test is the reference's, bit for bit."""
    expected = case.expected
    text = difference(found, expected, case.subject.name)
    if text is not None:
        raise Disagreement(f"{how}{text}{_who_is_right(case, found, expected)}", case.scene)


def _who_is_right(case: Case, found: RunOutcome, expected: RunOutcome) -> str:
    """Returns a line that names the contacts that are right by the specification, where they differ."""
    at = first_difference(found.contacts, expected.contacts)
    if at is None or len(case.scene) > JUDGED:
        return ""
    lists = {case.subject.name: found.contacts, REFERENCE: expected.contacts}
    named = case.subject.narrow_phases(case.scene) or ()
    narrow = [name for name in named if case.scene.arena is not None or name != "wall"] or None
    text = explain_difference(case.scene, lists, at, narrow)
    return f"\n{text}" if text else ""
