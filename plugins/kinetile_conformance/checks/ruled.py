"""Checks of scenes with kinds of bodies: who passes whom, who stops, who loses what at a contact.

What a response does is none of a broad phase's business. But bodies that pass through each other lie on top
of one another in its structure, those that have stopped touch for good, and one between two that nothing can
move becomes faster than anybody was.
"""

from __future__ import annotations

from typing import Any

from kinetile.scene import Scene
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks.between_events import audit_between_events
from kinetile_conformance.checks.check import Reference, agree, check

__all__ = [
    "its_structure_is_true_while_some_pass",
    "same_contacts_while_some_pass",
    "same_contacts_with_responses",
]


def passing() -> Any:
    """Return the strategy; Hypothesis is imported when something is drawn."""
    from kinetile_conformance.strategies.ruled import ruled_scenes

    return ruled_scenes()


def solid() -> Any:
    """Return the strategy; Hypothesis is imported when something is drawn."""
    from kinetile_conformance.strategies.ruled import solid_scenes

    return solid_scenes()


@check(scenes=solid, share=0.25, since="3.2")
def same_contacts_with_responses(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts where bodies stop, lose energy, or cannot be moved."""
    agree(subject, scene, reference)


@check(scenes=passing, share=0.25, since="3.2")
def same_contacts_while_some_pass(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts where bodies pass through others; a phase that cannot do that says so."""
    agree(subject, scene, reference)


@check(scenes=passing, share=0.1, since="3.2")
def its_structure_is_true_while_some_pass(subject: Subject, scene: Scene, reference: Reference) -> None:
    """What must hold between events holds while bodies pass through others."""
    audit_between_events(subject, scene)
