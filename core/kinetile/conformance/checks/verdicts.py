"""Looking at scenes: what a check has seen of one phase, and whom a failure speaks against."""

from __future__ import annotations

from kinetile.conformance.cases import CONTACTS, REFERENCE, Outcome, Subject, outcome
from kinetile.conformance.checks.check import Check, Disagreement
from kinetile.errors import Refused
from kinetile.plugin.registry import registry
from kinetile.scene import Scene

__all__ = ["Seen", "applicable", "reference", "verdict"]


def reference(scene: Scene, contacts: int = CONTACTS) -> Outcome:
    """Return what the reference makes of a scene."""
    return outcome(Subject(REFERENCE, {}), scene, contacts)


def applicable(subject: Subject, each: Check) -> str | None:
    """Return why a check does not apply to a phase; None where it does."""
    features: frozenset[str] = getattr(registry().spec("broad phase", subject.name), "features", frozenset())
    if each.feature is not None and each.feature not in features:
        return f"for phases that declare the feature {each.feature!r}"
    return None


class Seen:
    """What a check has seen so far; Hypothesis shows the smallest failing scene last."""

    def __init__(self, each: Check, subject: Subject) -> None:
        self.each = each
        self.subject = subject
        self.count = 0
        self.refused = 0
        self.refusal = ""
        self.said: str | None = None
        self.scene: Scene | None = None

    def look(self, scene: Scene) -> bool:
        """Run the check on a scene; return whether its sentence holds there."""
        self.count += 1
        try:
            self.each.run(self.subject, scene, reference)
        except Refused as error:
            self.refused += 1
            self.refusal = str(error)
        except Disagreement as error:
            self.said, self.scene = str(error), error.scene or scene
            return False
        except Exception as error:  # whatever a foreign phase raises is its failure
            self.said, self.scene = f"{type(error).__name__}: {error}", scene
            return False
        return True


def verdict(each: Check, subject: Subject, scene: Scene) -> str:
    """Run a failing case under kinetile's own other phases, and say whom it speaks against.

    Not under those of others: that would be to compile them all, and they may hang or crash.
    """
    also: list[str] = []
    fine: list[str] = []
    for other in registry().names("broad phase"):
        own = registry().provided("broad phase", other).distribution == "kinetile"
        if not own or other in (subject.name, REFERENCE):
            continue
        if applicable(Subject(other, {}), each) is not None:
            continue
        judged = Seen(each, Subject(other, {}))
        holds = judged.look(scene)
        if judged.refused:
            continue
        (fine if holds else also).append(other)
    if also and not fine:
        return f"also {', '.join(also)}: the reference is in doubt"
    if also:
        return f"also {', '.join(also)}, but not {', '.join(fine)}"
    return f"only {subject.name}" + (f"; {', '.join(fine)} agree with the reference" if fine else "")
