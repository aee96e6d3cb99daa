"""Looking at scenes: what a check has seen of one phase, and whom a failure speaks against."""

from __future__ import annotations

from kinetile.errors import Refused
from kinetile.plugin.calling import place_of
from kinetile.plugin.choices import write_phase
from kinetile.plugin.registry import registry
from kinetile.scene import Scene
from kinetile_conformance.cases import CONTACTS, REFERENCE, Outcome, Subject, outcome
from kinetile_conformance.checks.check import Check, Disagreement, DoesNotApply
from kinetile_conformance.court.limits import Patience, begin_scene

__all__ = ["References", "Seen", "applicable", "verdict"]


class References:
    """What the reference, with the narrow phases on trial, makes of scenes; of those that many checks look at
    it is worked out once."""

    def __init__(self, subject: Subject | None = None) -> None:
        self._subject = Subject(REFERENCE, {}) if subject is None else subject.under(REFERENCE)
        self._kept: dict[int, tuple[Scene, dict[int, Outcome]]] = {}

    def keep(self, scenes: list[Scene]) -> None:
        """Work out once what the reference makes of each of these."""
        for scene in scenes:
            self._kept.setdefault(id(scene), (scene, {}))

    def __call__(self, scene: Scene, contacts: int = CONTACTS) -> Outcome:
        """Return what the reference makes of a scene, in so many contacts at most."""
        _, known = self._kept.get(id(scene), (scene, {}))
        if contacts not in known:
            known[contacts] = outcome(self._subject, scene, contacts)
        return known[contacts]


def applicable(subject: Subject, each: Check) -> str | None:
    """Return why a check does not apply to phases; None where it does."""
    if each.judges == "broad" and subject.narrow:
        return "for a broad phase alone: judge it without a narrow phase named"
    if each.judges == "pair" and subject.pair is None:
        return "for a narrow phase for pairs that is named"
    features: frozenset[str] = getattr(registry().spec("broad phase", subject.name), "features", frozenset())
    if each.feature is not None and each.feature not in features:
        return f"for phases that declare the feature {each.feature!r}"
    return None


class Seen:
    """What a check has seen so far of one phase; the smallest failing scene is seen last.

    ``fickle`` says that a failure did not come back when the same scene was shown once more.
    """

    def __init__(
        self,
        each: Check,
        subject: Subject,
        reference: References | None = None,
        patience: Patience | None = None,
    ) -> None:
        self.each = each
        self.subject = subject
        self.count = 0
        self.refused = 0
        self.refusal = ""
        self.inapplicable = ""
        self.fickle = False
        self.said: str | None = None
        self.scene: Scene | None = None
        self._reference = References(subject) if reference is None else reference
        self._patience = patience

    def look(self, scene: Scene) -> bool:
        """Run the check on a scene; return whether its sentence holds there.

        Raises TimeIsUp where the check has no time left.
        """
        if self._patience is not None:
            self._patience.check()  # before the scene counts
        self.count += 1
        begin_scene()
        try:
            self.each.run(self.subject, scene, self._reference)
        except Refused as error:
            self.refused += 1
            self.refusal = str(error)
            if isinstance(error, DoesNotApply):
                self.inapplicable = str(error)
        except Disagreement as error:
            self.said, self.scene = str(error), scene if self.each.draws else error.scene
            return False
        except Exception as error:  # whatever a foreign phase raises is its failure
            self.said, self.scene = f"{type(error).__name__}: {error}{_place(error)}", scene
            return False
        return True


def _place(error: Exception) -> str:
    """Return where an error came up that is none of kinetile's: those say it themselves."""
    return "" if type(error).__module__ == "kinetile.errors" else place_of(error)


def verdict(each: Check, subject: Subject, scene: Scene) -> str:
    """Run a failing case under kinetile's own other phases, and say whom it speaks against.

    Not under those of others: that would be to compile them all, and they may hang or crash.
    """
    named = ", ".join(write_phase(*each) for each in subject.narrow.items())
    suspect = f"suspect the narrow phase, {named}" if named else "the reference is in doubt"
    also: list[str] = []
    fine: list[str] = []
    for other in registry().names("broad phase"):
        own = registry().provided("broad phase", other).distribution == "kinetile"
        if not own or other in (subject.name, REFERENCE):
            continue
        if applicable(subject.under(other), each) is not None:
            continue
        judged = Seen(each, subject.under(other))
        holds = judged.look(scene)
        if judged.refused:
            continue
        (fine if holds else also).append(other)
    if also and not fine:
        return f"also {', '.join(also)}: {suspect}"
    if also:
        return f"also {', '.join(also)}, but not {', '.join(fine)}"
    return f"only {subject.name}" + (f"; {', '.join(fine)} agree with the reference" if fine else "")
