"""The answer of a scene by its rules, for tests: ``kinetile_accuracy.specification``, in exact numbers."""

from collections import Counter
from typing import NamedTuple

import kinetile as kt
from kinetile.kernel.log import WALLS
from kinetile_accuracy.specification.arithmetic import FlightPlan, tick_of, unit_bits
from kinetile_accuracy.specification.course import LEAVING, Course

Row = tuple[int, int, int]
"""A contact: its tick since the start, and its bodies, or a body and a wall."""


class Answer(NamedTuple):
    """The first contacts of a scene, and the plans after them."""

    contacts: list[Row]
    plans: list[FlightPlan]


def answer(
    scene: kt.Scene,
    contacts: int,
    until: int,
    last: tuple[int, int] | None = None,
    counts: Counter[str] | None = None,
) -> Answer:
    """Returns at most a number of contacts, up to and at a tick, or up to an exact end. ``counts`` gets the
    numbers of bodies that settled, settled between two supports, left one, or were released by a command."""
    course, rows = Course(scene, last), []
    while len(rows) < contacts and (event := course.next(until)) is not None:
        if event.b >= 0 or event.b in WALLS:
            rows.append(tuple(event))
        held = [*course.held]
        course.carry_out()
        for body, (before, after) in enumerate(
            zip(held, course.held, strict=True) if counts is not None else ()
        ):
            if after and after != before:
                counts["settled"] += 1
                counts["between two"] += len(after) == 2
            if before and not after and rows[-1:] != [(event.tick, event.a, event.b)]:
                counts["left" if body == event.a and event.b == LEAVING else "let go"] += 1
    return Answer(rows, course.plans)


def answer_of_game(game: kt.Scene, contacts: int, counts: Counter[str] | None = None) -> list[Row]:
    """Returns at most a number of contacts of a scene with its own end."""
    end, until = game.settings.end, game.settings.until
    if end is not None:
        tick = (end[0] << 52) + end[1]
        return answer(game, contacts, tick, (tick, end[2]), counts).contacts
    assert until is not None
    return answer(game, contacts, tick_of(until, game.start, unit_bits(game)), None, counts).contacts


def rows(sim: kt.Simulation) -> list[Row]:
    found = sim.contacts[["epoch", "tick", "a", "b"]].tolist()
    return [((epoch << 52) + tick, a, b) for epoch, tick, a, b in found]
