"""Commands given by hand: turn bodies, have them come and go, and write it all down."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager

import numpy.typing as npt

from kinetile.kernel.log import REMOVED
from kinetile.run.arguments import read_body, read_insertion, read_turns
from kinetile.run.engine import Command, Engine, carry_out
from kinetile.scene import Scene, with_commands

__all__ = ["TakesCommands"]


class TakesCommands:
    """What of a simulation takes commands. They are carried out at once, between two runs, between two steps,
    or from the ``progress`` of a run."""

    scene: Scene
    _engine: Engine
    _given: list[Command]

    def _alone(self, what: str) -> AbstractContextManager[None]:
        raise NotImplementedError

    def set_velocity(self, body: int, velocity: tuple[float, float]) -> None:
        """Turn a body now: from here on it flies with this velocity. As ``set_velocities``."""
        self.set_velocities([body], [velocity])

    def set_velocities(self, bodies: npt.ArrayLike, velocities: npt.ArrayLike) -> None:
        """Turn bodies now, in the order given: (n,) their numbers, and (n, 2) velocities or one for all.

        Between two runs, between two steps, or from the ``progress`` of a run. What is refused leaves
        everything as it was.

        Raises:
            IndexError: there is no such body, or it has gone.
            ValueError: a velocity is not two finite numbers, or too fast for the clock.
            Refused: the broad phase is not right with bodies as fast as this.
            BusyError: a chunk of a run is under way: this comes from a recorder, or from another thread.
        """
        turns = read_turns(self._engine, bodies, velocities)
        with self._alone("turn a body"):
            self._obey(*turns)

    def insert(
        self,
        position: Sequence[float],
        velocity: Sequence[float] = (0.0, 0.0),
        radius: float = 0.0,
        mass: float = 1.0,
    ) -> int:
        """Have a disc come now, and return its number, which no other body of this run has or had.

        It may touch others and the walls. What is refused leaves everything as it was.

        Raises:
            Refused: it would reach into a body or beyond a wall (the error says into whom, and how deep), or
                the broad phase cannot do a scene with it.
            ValueError: a number is not such as a scene may have, or the speed is too fast for the clock.
            BusyError: as ``set_velocities``.
        """
        with self._alone("take a body in"):
            command = read_insertion(self._engine, position, velocity, radius, mass)
            self._engine.number(command.body + 1)
            self._obey(command)
            self._engine.numbers = command.body + 1
        return command.body

    def remove(self, body: int) -> None:
        """Have a body go now, and whatever was scheduled for it with it.

        Raises IndexError where there is no such body, BusyError as ``set_velocities``.
        """
        number = read_body(self._engine, body)
        with self._alone("let a body go"):
            engine = self._engine
            ticks, after = engine.moment
            self._obey(Command(ticks, number, REMOVED, after=after))
            engine.forget_commands()
            engine.agenda.cancel(number)
            engine.load_commands()

    def _obey(self, *commands: Command) -> None:
        """Carry commands out, and write them down."""
        carry_out(self._engine, *commands)
        self._given += commands

    def recorded(self) -> Scene:
        """Return the scene together with all commands that were given by hand, each at its exact time: run
        under any phase it has the contacts of this run."""
        engine = self._engine
        return with_commands(self.scene, [given.as_scene_has_it(engine.clock) for given in self._given])
