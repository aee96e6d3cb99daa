"""How far the times of a run in doubles and ticks may be from the certified ones, contact by contact.

Contacts multiply what roundings have done before them. Followed to first order: each body has a bound of
what its place is off, and of what its velocity is off. The first contact of two bodies on the plans that the
scene gives them is off by its tick alone; a contact of two bodies whose distance is off by P is off by

    (P + min((2 R P + P^2) / (R h), sqrt(2 R P + P^2))) / w

with R the sum of the radii, w the relative speed, and h the part of it that is head-on; it turns the line of
centres by 2 P / R at most, and with it the velocities. All of this is taken ``SURELY`` times. Where the
velocities are no longer known there is no bound: infinite.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from kinetile.scene import Scene
from kinetile_accuracy.oracle.oracle import CertifiedContact
from kinetile_accuracy.specification.arithmetic import SPAN, UNIT_TICKS

SURELY = 4.0
"""What the first order leaves out, and the solver's roundings, are less than the bound this many times."""


@dataclass
class _Off:
    """What a body is off: its place at a time, its velocity; and its last event, in time."""

    since: Fraction
    place: float = 0.0
    velocity: float = 0.0
    event: float = 0.0

    def advance(self, now: Fraction, anchored: float, span: float) -> None:
        """Advances to a time: a velocity that is off moves the place, and so does every new anchor on the
        way, one a ``span`` at most."""
        took = float(now - self.since)
        self.place += (self.velocity * took if took else 0.0) + anchored * (took // span)
        self.since = now


def allowed_errors(scene: Scene, contacts: Sequence[CertifiedContact], time_unit: float) -> list[float]:
    """Returns for each contact how far a run's time may be from the certified one, in the scene's time."""
    tick = time_unit / UNIT_TICKS
    start = Fraction(scene.start)
    turns = list(scene.turns)
    fastest = max(map(_size, [*scene.velocity, *(turn.velocity for turn in turns)]), default=0.0)
    fastest = max([fastest, *(each.speed for each in contacts)])
    if scene.arena is not None:
        farthest = max(scene.arena)
    else:
        took = float(contacts[-1].time.middle - start) if contacts else 0.0
        farthest = max(map(_size, scene.position), default=0.0) + fastest * took
    anchored = 4.0 * math.ulp(farthest) + 2.0 * fastest * tick
    bent, span = 16.0 * math.ulp(fastest), time_unit * (SPAN // UNIT_TICKS)
    bodies = [_Off(start) for _ in range(len(scene))]
    allowed = []
    for met in contacts:
        now = met.time.middle
        while turns and Fraction(turns[0].time) <= now:
            turn = turns.pop(0)
            off = bodies[turn.body]
            off.advance(Fraction(turn.time), anchored, span)
            off.place, off.velocity, off.event = off.place + anchored, 0.0, tick
        two = [bodies[each] for each in (met.a, met.b) if each >= 0]
        for off in two:
            off.advance(now, anchored, span)
        place, velocity = sum(off.place for off in two), sum(off.velocity for off in two)
        reach = float(scene.radius[met.a] + scene.radius[met.b]) if met.b >= 0 else math.inf
        late = max(off.event for off in two) + 2.0 * tick + float(met.time.radius)
        late += _late(place, velocity, reach, met)
        allowed.append(late)
        # The line of centres, and what the exchange makes of the velocities, at most twice the relative one.
        gap = place + met.speed * late
        kick = bent if met.b < 0 else bent + 4.0 * (velocity + 2.0 * met.speed * gap / reach)
        for off in two:
            off.place += anchored + 4.0 * met.speed * late
            off.velocity += kick
            off.event = late
    return allowed


def _late(place: float, velocity: float, reach: float, met: CertifiedContact) -> float:
    """Returns how far the time is off for a distance and a relative velocity that are off by so much."""
    if place == 0.0 and velocity == 0.0:
        return 0.0
    if not velocity < met.speed / SURELY or met.head_on == 0.0:
        return math.inf
    straight = place / met.head_on if met.b < 0 else place
    square = 2.0 * reach * place + place * place if met.b >= 0 else 0.0
    curved = min(square / (reach * met.head_on), math.sqrt(square)) if square else 0.0
    return SURELY * (straight + curved) / met.speed


def _size(vector: object) -> float:
    return float(np.abs(np.asarray(vector, dtype=float)).sum())
