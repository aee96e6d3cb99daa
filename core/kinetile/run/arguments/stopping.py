"""Where a run is to stop besides its end: at the next contact of chosen bodies, pairs or kinds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kinetile.kernel.loop.counting import ANY, SOME
from kinetile.kernel.tables import NOBODY, OFFER, record_table
from kinetile.run.arguments.reading import read_body
from kinetile.run.engine import Engine
from kinetile.run.questions.asking import read_kinds
from kinetile.scene import Insert, Scene
from kinetile.scene.checks import WALL, shown
from kinetile.scene.responses import Kind

__all__ = ["StopAt", "read_stop", "watch", "watch_no_more"]


@dataclass(frozen=True)
class StopAt:
    """Contacts at which a run stops, at their exact time. With nothing chosen: at every contact.

    Attributes:
        bodies: numbers of bodies, at every contact of theirs, with others or walls.
        pairs: two numbers each, or a number and "wall".
        kinds: one kind of bodies or several, at every contact of theirs; those who come later among them,
            where the scene has them come.
        before: stop before the contact happens, and not after: it is still to come, if no command changes
        that.
    """

    bodies: Iterable[int] = field(default=())
    pairs: Iterable[tuple[int, int | str]] = field(default=())
    kinds: Kind | Iterable[Kind] = field(default=())
    before: bool = False


def read_stop(stop: Any) -> StopAt | None:
    """Return where a run is to stop; TypeError for what does not say so."""
    if stop is None or isinstance(stop, StopAt):
        return stop
    raise TypeError(
        "stop_at is kinetile.StopAt(...), which chooses contacts by bodies, pairs or kinds; "
        f"found {shown(stop)}"
    )


def watch(engine: Engine, scene: Scene, stop: StopAt) -> None:
    """Have the loop stop there. Raises IndexError for bodies that are not there nor still to come, ValueError
    for kinds that there are not, with nothing changed."""
    flags = np.zeros(len(engine.k.slots), dtype=np.uint8)
    kinds = read_kinds(stop.kinds, scene.kinds, "stop_at")
    bodies = _several(stop.bodies, "bodies", "their numbers")
    pairs = [_pair(engine, pair) for pair in _several(stop.pairs, "pairs", "two numbers each")]
    for body in bodies:
        flags[read_body(engine, body, or_coming=True)] = ANY
    for kind in kinds:
        flags[_of_kind(engine, scene, kind)] = ANY
    if not (bodies or kinds or pairs):
        flags[:] = ANY
    table = record_table(OFFER, len(pairs))
    for row, (a, b) in zip(table, pairs, strict=True):
        row.a, row.b = a, b
        flags[[each for each in (a, b) if each != NOBODY]] |= SOME
    engine.k = engine.k._replace(watch=flags, watched=table)
    engine.k.clock[0].before = stop.before


def watch_no_more(engine: Engine) -> None:
    """Have the loop stop nowhere but at its end."""
    engine.k = engine.k._replace(watch=np.zeros(0, dtype=np.uint8), watched=record_table(OFFER, 0))


def _several(given: Any, name: str, of: str) -> list[Any]:
    """Return what is given as a list; TypeError where it is no several."""
    try:
        return list(given)
    except TypeError:
        raise TypeError(f"stop_at: {name} are given by a list of {of}; found {shown(given)}") from None


def _pair(engine: Engine, pair: Any) -> tuple[int, int]:
    """Return the numbers of a pair, NOBODY for the walls."""
    two = tuple(pair) if isinstance(pair, tuple | list) else ()
    if len(two) != 2:
        raise ValueError(
            f"stop_at: a pair is two numbers of bodies, or one and {WALL!r}; found {shown(pair)}"
        )
    one = read_body(engine, two[0], or_coming=True)
    return one, NOBODY if two[1] == WALL else read_body(engine, two[1], or_coming=True)


def _of_kind(engine: Engine, scene: Scene, kind: Kind) -> list[int]:
    """Return the numbers of the bodies of a kind: those of the start, those given by hand, those to come."""
    of_it = scene.kinds.index(kind)
    found = np.flatnonzero(scene.kind_numbers == of_it).tolist()
    found += [each.body for each in scene.commands if isinstance(each, Insert) and each.kind == kind]
    k = engine.k
    if len(k.rules):
        there = k.queue.number[(k.queue.number >= 0) & (k.traits.kind == of_it)]
        found += there.tolist()
    return sorted(set(found))
