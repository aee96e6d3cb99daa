"""A case: one scene, how far to run it, and what a phase makes of it.

``runs`` runs one and compares two of its outcomes, ``tables`` says what of the kernel's tables belongs to an
outcome, ``saved`` writes a case down as TOML, ``brought`` registers a phase that has no plugin, and
``played`` opens a saved case in the player.
"""

from __future__ import annotations

from kinetile_conformance.cases.brought import Brought
from kinetile_conformance.cases.played import view_case
from kinetile_conformance.cases.runs import (
    CONTACTS,
    REFERENCE,
    Outcome,
    Subject,
    brief_outcome,
    difference,
    horizon,
    outcome,
    provided,
)
from kinetile_conformance.cases.saved import Case, load_case, not_saved, save_case

__all__ = [
    "CONTACTS",
    "REFERENCE",
    "Brought",
    "Case",
    "Outcome",
    "Subject",
    "brief_outcome",
    "difference",
    "horizon",
    "load_case",
    "not_saved",
    "outcome",
    "provided",
    "save_case",
    "view_case",
]
