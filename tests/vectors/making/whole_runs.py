"""Whole runs: rules 7, 8 and 10 of docs/specification.md, with every pair asked, slowly.

What is asked is kept until the plan of one of the two bodies is another; rules 5 and 6 are functions of the
plans, so that is the same as asking all of it after each event.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from .rules import (
    Arena,
    Plan,
    Velocity,
    anchored,
    exchange,
    meeting,
    tick_of,
    unit_exponent,
    wall_contact,
)

__all__ = ["BY_CLOCK", "PAIR", "TURN", "WALL", "Body", "Event", "Scene", "digest", "events", "unit_of"]

BY_CLOCK, TURN, WALL, PAIR = 1, 2, 3, 4
"""The classes of events."""

SPAN = 1 << 61
"""Ticks between two looks of the clock at who has flown for long."""

Turn = tuple[float, Velocity]


class Body(NamedTuple):
    """A disc at the start, and its turns: times and velocities."""

    position: tuple[float, float]
    velocity: Velocity
    radius: float
    mass: float = 1.0
    turns: tuple[Turn, ...] = ()


class Scene(NamedTuple):
    """What a run is a function of."""

    bodies: tuple[Body, ...]
    arena: Arena | None = None
    start: float = 0.0


class Event(NamedTuple):
    """What happens: ``b`` is the other body, the wall, or -1 at a turn. ``barred``: by rule 5 the two would
    meet again right away."""

    tick: int
    kind: int
    a: int
    b: int = -1
    barred: bool = False


def unit_of(scene: Scene) -> int:
    """Return e, where the unit is 2^-e."""
    return unit_exponent(
        [body.position for body in scene.bodies],
        [body.radius for body in scene.bodies],
        [body.velocity for body in scene.bodies],
        [velocity for body in scene.bodies for _, velocity in body.turns],
        scene.arena,
    )


def events(scene: Scene) -> Iterator[Event]:
    """Yield the events of a scene, in order. There is no last one, unless there are no bodies."""
    run = _Run(scene)
    while (event := run.next()) is not None:
        yield run.happen(event)


def digest(contacts: Sequence[Event]) -> str:
    """Return the fingerprint of contacts (rule 10)."""
    whole = hashlib.sha256()
    for contact in contacts:
        for value, size in zip(
            (*divmod(contact.tick, 1 << 52), contact.a, contact.b), (8, 8, 4, 4), strict=True
        ):
            whole.update(value.to_bytes(size, "little", signed=True))
    return whole.hexdigest()


class _Run:
    """A run at some moment: the plans, the turns to come, who is barred, and what is awaited."""

    def __init__(self, scene: Scene) -> None:
        self.e = e = unit_of(scene)
        self.arena = scene.arena
        self.plans = [Plan(*body.position, *body.velocity, body.radius, 0) for body in scene.bodies]
        self.masses = [body.mass for body in scene.bodies]
        self.equal = len(set(self.masses)) <= 1
        self.turns = [
            (tick_of(time, scene.start, e), body, time, number, velocity)
            for body, each in enumerate(scene.bodies)
            for number, (time, velocity) in enumerate(each.turns)
        ]
        self.turns.sort(key=lambda turn: turn[:4])
        self.met: set[tuple[int, int]] = set()
        self.walls: dict[int, tuple[int, int]] = {}
        self.pairs: dict[tuple[int, int], int] = {}
        for body in range(len(self.plans)):
            self._ask(body, range(body))

    def _ask(self, body: int, others: Sequence[int]) -> None:
        """Ask what a body will meet."""
        plan = self.plans[body]
        if self.arena is not None:
            wall = wall_contact(plan, self.arena, self.e)
            self.walls.pop(body, None)
            if wall is not None:
                self.walls[body] = wall
        for other in others:
            if other != body:
                pair = min(body, other), max(body, other)
                tick = meeting(self.plans[pair[0]], self.plans[pair[1]], self.e)
                self.pairs.pop(pair, None)
                if tick is not None and pair not in self.met:
                    self.pairs[pair] = tick

    def next(self) -> Event | None:
        """Return the next event (rule 8)."""
        due = [((plan.anchor // SPAN + 2) * SPAN, BY_CLOCK, body, -1) for body, plan in enumerate(self.plans)]
        due += [(tick, TURN, body, -1) for tick, body, *_ in self.turns[:1]]
        due += [(tick, WALL, body, wall) for body, (tick, wall) in self.walls.items()]
        due += [(tick, PAIR, a, b) for (a, b), tick in self.pairs.items()]
        return Event(*min(due)) if due else None

    def happen(self, event: Event) -> Event:
        """Let an event happen (rule 9); return it with what is only known then."""
        tick, kind, a, b, _ = event
        bodies = (a, b) if kind == PAIR else (a,)
        for body in bodies:
            self.plans[body] = anchored(self.plans[body], tick, self.e)
        one = self.plans[a]
        self.met = {pair for pair in self.met if not set(pair) & set(bodies)}  # rule 7
        if kind == TURN:
            (vx, vy) = self.turns.pop(0)[4]
            self.plans[a] = one._replace(vx=vx, vy=vy)
        elif kind == WALL:
            self.plans[a] = one._replace(vx=-one.vx) if b in (-1, -2) else one._replace(vy=-one.vy)
        elif kind == PAIR:
            two = self.plans[b]
            masses = None if self.equal else (self.masses[a], self.masses[b])
            (vxa, vya), (vxb, vyb) = exchange(one, two, masses)
            self.plans[a], self.plans[b] = one._replace(vx=vxa, vy=vya), two._replace(vx=vxb, vy=vyb)
            self.met.add((a, b))
            event = event._replace(barred=meeting(self.plans[a], self.plans[b], self.e) is not None)
        for body in bodies:
            self._ask(body, range(len(self.plans)))
        return event
