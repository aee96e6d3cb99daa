"""A check: a cell of the table of strategies and observations. A strategy draws scenes; an observation runs
one of them under a phase, and raises ``Disagreement`` for a fault."""

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
"""The most bodies for a decision by exact arithmetic: with hundreds it takes a second a scene."""


class DoesNotApply(Refused):
    """A phase does not claim the property that a check tests."""


class Disagreement(AssertionError):
    """A phase fails a check; ``scene`` is the observation's scene, if it is another one."""

    def __init__(self, text: str, scene: Scene | None = None) -> None:
        super().__init__(text)
        self.scene = scene


@dataclass(frozen=True)
class Case:
    """The phases under test, a scene, the reference's outcomes, the limit of contacts of a run, and the
    ``number`` of the scene, which selects one of an observation's stages; None: all stages are run."""

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
    """A column of the table: a property to observe.

    Attributes:
        sentence: the property that must hold, without a full stop.
        look: called with a case; raises ``Disagreement``.
        feature: it applies only to phases that declare this feature; None: to all.
        compares: True if a failure is compared with kinetile's other phases; some concern this phase alone.
        judges: the only part that it judges: "broad" without a named part, else a named one; None: all.
        replayed_by: the check that replays a scene after a failure of this one; "": this one itself.
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
    """A cell of the table: one observation on the scenes of one strategy, None if it has its own scenes.
    ``share`` is their number for each of ``--examples``, at least one. A check ``at_home`` has the name of
    the observation; any other has the suffix of its strategy as well."""

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
        """The property that must hold, and the kind of scenes."""
        where = f", {self.strategy.where}" if self.strategy and not self.at_home else ""
        return f"{self.observation.sentence}{where}."

    @property
    def judges(self) -> str | None:
        """The judged part; "broad" if the scenes are for broad phases only."""
        return self.observation.judges or ("broad" if self.strategy and self.strategy.broad else None)

    @property
    def replay(self) -> str:
        """The name of the check that replays a scene after a failure of this one; "" without one."""
        return self.observation.replayed_by or (self.name if self.strategy else "")

    def count(self, examples: int) -> int:
        """Returns its number of scenes for a number of small ones."""
        if self.strategy is None:
            return 1
        return self.strategy.fixed or max(1, round(self.share * examples))

    def run(self, subject: Subject, scene: Scene, reference: Reference, number: int | None = None) -> None:
        """Observes a scene; raises Disagreement for a fault."""
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
    """Returns a line that names the right contacts by the specification at the first difference."""
    at = first_difference(found.contacts, expected.contacts)
    if at is None or len(case.scene) > JUDGED:
        return ""
    lists = {case.subject.name: found.contacts, REFERENCE: expected.contacts}
    named = case.subject.narrow_phases(case.scene) or ()
    narrow = [name for name in named if case.scene.arena is not None or name != "wall"] or None
    text = explain_difference(case.scene, lists, at, narrow)
    return f"\n{text}" if text else ""
