"""What is still to be done: commands in exact ticks since the start, handed to the kernel a span of the clock
at a time."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from kinetile.kernel.clock import SPAN, TICKS, Clock
from kinetile.kernel.log import INSERTED, REANCHORED, REMOVED, TURNED
from kinetile.kernel.tables import COMMAND, Kernel, record_table
from kinetile.scene import Insert, Remove, Scene, Turn

__all__ = ["Agenda", "Command", "planned"]


class Command(NamedTuple):
    """One command, at ``ticks`` since the start, for the body of a number; ``code`` says what it is
    (``kinetile.kernel.log``). ``mass`` is that of the body, whatever is done to it; ``after`` is how many
    contacts of this tick come before."""

    ticks: int
    body: int
    code: int
    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    radius: float = 0.0
    mass: float = 0.0
    after: int = 0

    @property
    def squares(self) -> float:
        """Mass times speed squared: twice the energy that it can bring in."""
        return self.mass * (self.vx * self.vx + self.vy * self.vy)

    def as_scene_has_it(self, clock: Clock) -> Turn | Insert | Remove:
        """Return the command as a scene has it, with its exact time."""
        time, epoch, tick = clock.moment(self.ticks)
        at = (epoch, tick, self.after)
        if self.code == REMOVED:
            return Remove(self.body, time, at)
        if self.code == TURNED:
            return Turn(self.body, time, (self.vx, self.vy), at)
        place, flies = (self.x, self.y), (self.vx, self.vy)
        return Insert(time, place, flies, self.radius, self.mass, self.body, at)


def planned(scene: Scene, clock: Clock) -> list[Command]:
    """Return the commands of a scene."""
    mass: dict[int, float] = dict(enumerate(scene.mass.tolist()))
    return [_command(each, clock, mass) for each in scene.commands]


def _command(command: Turn | Insert | Remove, clock: Clock, mass: dict[int, float]) -> Command:
    ticks = clock.tick_of(command.time, command.at)
    after = command.at[2] if command.at else 0
    if isinstance(command, Remove):
        return Command(ticks, command.body, REMOVED, after=after)
    vx, vy = command.velocity
    if isinstance(command, Turn):
        return Command(ticks, command.body, TURNED, vx=vx, vy=vy, mass=mass[command.body], after=after)
    mass[command.body] = command.mass
    x, y = command.position
    return Command(ticks, command.body, INSERTED, x, y, vx, vy, command.radius, command.mass, after)


_FIELDS = ("x", "y", "vx", "vy", "radius", "mass", "after")


class Agenda:
    """Commands in the order in which they happen: by tick, re-anchorings first, then as given."""

    def __init__(self, commands: Iterable[Command]) -> None:
        self._commands = list(commands)
        self._sort()
        self._squares: float | None = None

    def __bool__(self) -> bool:
        return bool(self._commands)

    def _sort(self) -> None:
        self._commands.sort(key=lambda command: (command.ticks, command.code != REANCHORED))

    def put(self, *commands: Command) -> None:
        """Add commands."""
        self._commands.extend(commands)
        self._sort()
        self._squares = None

    def cancel(self, body: int) -> None:
        """Forget all commands for a body that has gone."""
        self._commands = [command for command in self._commands if command.body != body]

    def take_back(self, *commands: Command) -> None:
        """Forget commands that could not be carried out."""
        self._commands = [command for command in self._commands if command not in commands]

    def next(self, made: int) -> Command | None:
        """Return the first command still to come but for re-anchorings, where ``made`` have been carried out
        and are not forgotten."""
        return next((command for command in self._commands[made:] if command.code != REANCHORED), None)

    def first_of_each(self, k: Kernel, clock: Clock) -> dict[int, int]:
        """Return for each slot with a body in it the kernel's tick of the first command for that body, where
        there is one."""
        first: dict[int, int] = {}
        for command in self._commands[int(k.clock[0].command) :]:
            slot = int(k.slots[command.body])
            if command.code != REANCHORED and slot >= 0:
                first.setdefault(slot, clock.relative(command.ticks))
        return first

    def squares(self) -> float:
        """Return the sum of mass * speed^2 over all commands: twice the energy they could bring in."""
        if self._squares is None:
            self._squares = math.fsum(command.squares for command in self._commands)
        return self._squares

    def done(self, count: int) -> None:
        """Forget the first ``count`` commands: they have been carried out."""
        if count:
            del self._commands[:count]
            self._squares = None

    def load(self, k: Kernel, clock: Clock) -> Kernel:
        """Return the tables with the commands before the next shift of the clock's base, and with slots for
        the numbers of the bodies in them."""
        end = clock.base * TICKS + SPAN
        due = [command for command in self._commands if command.ticks < end]
        table = record_table(COMMAND, len(due))
        if due:
            ticks, body, code, *fields = zip(*due, strict=True)
            table["tick"] = [clock.relative(tick) for tick in ticks]
            table["body"], table["code"] = body, code
            for name, column in zip(_FIELDS, fields, strict=True):
                table[name] = column
        k.clock[0].commands = len(due)
        return k._replace(commands=table)
