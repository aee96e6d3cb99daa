"""What must hold of those who pass through each other: their lists, when they part, and who they are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.loop.rules import PASS
from kinetile.kernel.tables import NEVER, NOBODY, Kernel, Records
from kinetile.run.audit.tables import of_lists, said_tick
from kinetile.run.composition import Composition

__all__ = ["of_passings"]

part = to_be_filled_in


def ask_when_they_part(k: Kernel, pairs: Records, parting: Any) -> None:
    """Write down when each pair parts; a template, as ``kernel.loop`` has."""
    k = disowned(k)
    for at in range(len(pairs)):
        parting[at] = part(k, pairs[at].a, pairs[at].b)


def of_passings(k: Kernel, columns: Any, composition: Composition, place: Any) -> Iterator[str]:
    """The pairs that pass are those that overlap and may; each parts when its plans say so."""
    if composition.rules is None or composition.pair is None or not composition.rules.passing:
        return
    table, clock = columns.passings, columns.clock
    yield from of_lists(table, k.passers, "the passings", clock.passings, clock.passable)
    live = np.flatnonzero(table.a >= 0)
    asked, parting = k.passings[live], np.full(len(live), NEVER)
    compose(ask_when_they_part, {"part": composition.pair.part}, "parting", Kernel)(k, asked, parting)
    due = np.maximum(parting, table.begun[live] + 1)
    number, traits = columns.queue.number, columns.traits
    for at in np.flatnonzero(table.tick[live] != due).tolist():
        a, b = int(number[asked.a[at]]), int(number[asked.b[at]])
        said = f"bodies {a} and {b} part {said_tick(table.tick[live][at])} as noted"
        yield f"{said}, but by their plans {said_tick(due[at])}"
    leave = np.full(len(number), NEVER)
    np.minimum.at(leave, table.a[live], table.tick[live])
    for body in np.flatnonzero((leave != traits.leave) & (number != NOBODY)).tolist():
        yield f"body {number[body]} waits for a parting {said_tick(traits.leave[body])}, and none is due then"
    inside = np.bincount(table.a[live], minlength=len(number)) + np.bincount(
        table.b[live], minlength=len(number)
    )
    for body in np.flatnonzero((inside != traits.inside) & (number != NOBODY)).tolist():
        said = f"body {number[body]} is counted to pass {traits.inside[body]} others"
        yield f"{said}, and passes {inside[body]}"
    yield from _overlapping(columns, place, {(int(a), int(b)) for a, b in zip(asked.a, asked.b, strict=True)})


def _overlapping(k: Any, place: Any, passing: set[tuple[int, int]]) -> Iterator[str]:
    """Whoever overlaps by more than rounding, and may, is passing."""
    kinds, kind, radius = k.clock.kinds, k.traits.kind, k.bodies.radius
    for a in np.flatnonzero(k.queue.number >= 0).tolist():
        may = (k.rules.response[kind[a] * (kinds + 1) + kind] == PASS) & (k.queue.number > k.queue.number[a])
        apart = np.hypot(*(place - place[a]).T) - (radius + radius[a])
        for b in np.flatnonzero(may & (apart < -1e-9 * (radius + radius[a]))).tolist():
            if (a, b) not in passing:
                said = f"bodies {k.queue.number[a]} and {k.queue.number[b]} overlap"
                yield f"{said} and are not passing each other"
