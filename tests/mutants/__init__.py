"""More mutants, by family: made to fool the kit by somebody who has read it; and harmless variations.

Each has a witness where there can be one: a scene on which it is wrong, without the kit (``witnesses``).
"""

from __future__ import annotations

from mutants import (
    coming_and_going,
    contract,
    far_places,
    found_later,
    many_bodies,
    many_events,
    memory,
    surroundings,
)
from mutants.harmless import HARMLESS

__all__ = ["HARMLESS", "MUTANTS"]

MUTANTS = (
    *many_bodies.MUTANTS,
    *many_events.MUTANTS,
    *far_places.MUTANTS,
    *memory.MUTANTS,
    *contract.MUTANTS,
    *surroundings.MUTANTS,
    *coming_and_going.MUTANTS,
    *found_later.MUTANTS,
)
