"""The contacts of a scene by rationals alone: rules 2 to 11 of docs/specification.md, event by event."""

from __future__ import annotations

import kinetile as kt
from kinetile_accuracy.specification.course import Course


def contacts_of(scene: kt.Scene, most: int, until: int) -> list[tuple[int, int, int]]:
    """Return up to ``most`` contacts of a scene, (tick, a, b), up to and at a tick."""
    course = Course(scene)
    found: list[tuple[int, int, int]] = []
    while len(found) < most and (event := course.next(until)) is not None:
        if event.b >= -4:  # no command, nor an anchoring by the clock
            found.append(tuple(event))
        course.carry_out()
    return found
