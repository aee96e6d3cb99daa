"""What a scene of the oracle says beside flight: masses, responses by kinds, commands at exact times.

The oracle has no ticks, and none of its times is rounded. So a command at a time comes at that time, and one
at an exact tick at the beginning of that tick. That a command, or the end, comes after some contacts of its
tick means nothing here: which contacts those are depends on the roundings of a run.

Needs python-flint.
"""

from __future__ import annotations

import math

from flint import fmpq

from kinetile.errors import Refused
from kinetile.scene import Insert, Remove, Response, Scene, Turn
from kinetile_accuracy.oracle.flights import ZERO, exact

KNOWN = ("elastic", "pass", "restitution", "stop")

UNIT_TICKS = 1 << 52

DEEP = exact(1.0 - 1e-12)
"""Bodies nearer than this part of the sum of their radii overlap; those between touch (rules 9 and 11 of
docs/specification.md)."""


class Rules:
    """What holds for the bodies of a scene, by their numbers, those to be inserted included.

    Attributes:
        count: one more than the largest number of a body.
        radius: of each body.
        commands: all commands in their order, each with its time since the start, or that of the command
            before it if that is later: a tick begins before the times in it.
        passing: whether some bodies may pass through each other.

    Raises Refused for a response that the specification does not have, and for commands after contacts.
    """

    def __init__(self, scene: Scene) -> None:
        self._meets = scene.meets
        used = {response.name for row in self._meets for response in row}
        other = sorted(used.difference(KNOWN))
        if other:
            raise Refused(f"the oracle knows the responses {', '.join(KNOWN)}, and not {', '.join(other)}")
        self.passing = "pass" in used
        inserted = [each for each in scene.commands if isinstance(each, Insert)]
        self.count = max([len(scene) - 1, *(each.body for each in inserted)]) + 1
        more = self.count - len(scene)
        self.radius = [*map(exact, scene.radius.tolist()), *[ZERO] * more]
        self._kind = scene.kind_numbers.tolist() + [0] * more
        mass = scene.mass.tolist() + [1.0] * more
        for each in inserted:
            self.radius[each.body] = exact(each.radius)
            mass[each.body] = each.mass
            self._kind[each.body] = 0 if each.kind is None else scene.kinds.index(each.kind)
        self._mass = [None if math.isinf(each) else exact(each) for each in mass]
        self._start, self._tick = exact(scene.start), exact(scene.time_unit) / UNIT_TICKS
        self.commands: list[tuple[fmpq, Turn | Insert | Remove]] = []
        for command in scene.commands:
            time = exact(command.time) - self._start
            if command.at is not None:
                time = self.time_of(command.at, f"the command for body {command.body}")
            before = self.commands[-1][0] if self.commands else time
            self.commands.append((max(time, before), command))

    def time_of(self, moment: tuple[int, int, int], what: str) -> fmpq:
        """Returns the time since the start of (epoch, tick, contacts); raises Refused where that comes after
        contacts."""
        epoch, tick, contacts = moment
        if contacts:
            raise Refused(
                f"{what} comes at {moment}, after contacts of its tick, and the oracle has no ticks: which "
                "contacts those are depends on the roundings of a run. Give it a time of its own"
            )
        return (epoch * UNIT_TICKS + tick) * self._tick

    def end(self, scene: Scene, until: float) -> tuple[fmpq, bool]:
        """Returns the time of an end since the start, and whether it comes before the contacts of its time:
        so does the scene's own end, where that is exact."""
        if until == scene.settings.until and scene.settings.end is not None:
            return self.time_of(scene.settings.end, "the end of the scene"), True
        return exact(until) - self._start, False

    def response(self, a: int, b: int) -> Response:
        """Returns the response of two bodies, or of a body and a wall (b below 0)."""
        response: Response = self._meets[self._kind[a]][self._kind[b] if b >= 0 else -1]
        return response

    def passes(self, a: int, b: int) -> bool:
        """Returns whether two bodies pass through each other."""
        return self.passing and self.response(a, b).name == "pass"

    def gains(self, a: int, b: int, back: fmpq) -> tuple[fmpq, fmpq]:
        """Returns by which parts of the closing speed two bodies change theirs, if ``back`` of it comes
        back."""
        one, two = self._mass[a], self._mass[b]
        if one is None or two is None:
            part = fmpq(1, 2) if one is two else fmpq(two is None)
        else:
            part = two / (one + two)
        return (1 + back) * part, (1 + back) * (1 - part)

    def immovable_of(self, a: int, b: int) -> int | None:
        """Returns which of two bodies the other stops beside, since only that one is immovable."""
        still = [body for body in (a, b) if self._mass[body] is None]
        return still[0] if len(still) == 1 else None
