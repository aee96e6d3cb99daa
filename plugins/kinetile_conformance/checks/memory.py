"""Checks of memory: what hooks change that is not theirs, and what they touch outside of their arrays.

They look at fixed scenes. What they see is named with hook, field and line, and often has no effect on any
contact: another machine, or a larger scene, and it would have.
"""

from __future__ import annotations

from kinetile.errors import Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks.check import Disagreement, DoesNotApply, Reference, check
from kinetile_conformance.watch import canaries
from kinetile_conformance.watch.child import first_breach
from kinetile_conformance.watch.scenes import MANY, SMALL, titled

__all__ = ["stays_within_its_arrays", "writes_only_where_it_may"]


@check(draws=False, compares=False, since="3.0")
def writes_only_where_it_may(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Interpreted, its hooks change nothing that is not theirs, use no index outside of an array, and raise
    nothing."""
    said = first_breach(subject, titled(SMALL))
    if said is not None:
        raise Disagreement(said)


@check(draws=False, compares=False, since="3.0")
def stays_within_its_arrays(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It writes nothing just before or behind an array of its state or of the kernel."""
    if INTERPRETED:
        raise DoesNotApply("hooks are interpreted here: writes-only-where-it-may looks at every index")
    refusal: Refused | None = None
    looked_at = 0
    for title, each in titled(MANY):
        try:
            said = canaries.look(subject, each)
        except Refused as error:
            refusal = error
            continue
        looked_at += 1
        if said is not None:
            raise Disagreement(f"{said}, on {title}")
    if refusal is not None and not looked_at:
        raise refusal
