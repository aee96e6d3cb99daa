"""Commands given by hand: turn bodies, have them come and go, and write it all down."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import replace
from typing import cast, overload

import numpy.typing as npt

from kinetile.kernel.clock import TICKS
from kinetile.kernel.log import INSERTED, REMOVED, TURNED
from kinetile.run.arguments import read_insertion, read_removal, read_turns
from kinetile.run.engine import Engine, Given, Rows, carry_out
from kinetile.scene import Scene, relabelled
from kinetile.scene.arrays import Numbers
from kinetile.scene.responses import Kind

__all__ = ["TakesCommands"]


class TakesCommands:
    """What of a simulation takes commands. They are carried out at once, between two runs, between two steps,
    or from the ``progress`` of a run."""

    scene: Scene
    _engine: Engine
    _given: Given

    def _alone(self, what: str) -> AbstractContextManager[None]:
        raise NotImplementedError

    def set_velocity(self, body: int, velocity: Numbers) -> None:
        """Turn a body now: from here on it flies with this velocity. As ``set_velocities``."""
        self.set_velocities([body], cast("npt.ArrayLike", [velocity]))

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
        with self._alone("turn a body"):
            self._obey(TURNED, read_turns(self._engine, bodies, velocities))

    @overload
    def insert(
        self, position: Numbers, velocity: Numbers, radius: float, mass: float = 1.0, kind: Kind | None = None
    ) -> int: ...

    @overload
    def insert(
        self,
        position: Numbers,
        velocity: Numbers = (0.0, 0.0),
        *,
        radius: float,
        mass: float = 1.0,
        kind: Kind | None = None,
    ) -> int: ...

    def insert(
        self,
        position: Numbers,
        velocity: Numbers = (0.0, 0.0),
        radius: float | None = None,
        mass: float = 1.0,
        kind: Kind | None = None,
    ) -> int:
        """Have a disc come now, and return its number, which no other body of this run has or had.

        It may touch others and the walls, and overlap those that it passes through. ``kind`` is one of the
        scene's, the first where it is None. What is refused leaves everything as it was.

        Raises:
            Refused: it would reach into a body or beyond a wall (the error says into whom, and how deep), or
                the broad phase cannot do a scene with it.
            ValueError: a number is not such as a scene may have, or the speed is too fast for the clock.
            TypeError: there is no radius.
            BusyError: as ``set_velocities``.
        """
        if radius is None:
            raise TypeError("insert() needs the radius of the body that comes: insert(position, radius=...)")
        with self._alone("take a body in"):
            rows = read_insertion(self._engine, position, velocity, radius, mass, kind)
            self._obey(INSERTED, rows)
        return int(rows["body"][0])

    def remove(self, body: int) -> None:
        """Have a body go now, and whatever was scheduled for it with it.

        Raises IndexError where there is no such body, BusyError as ``set_velocities``.
        """
        with self._alone("let a body go"):
            self._obey(REMOVED, read_removal(self._engine, body))

    def _obey(self, code: int, rows: Rows) -> None:
        """Carry commands out, and write them down."""
        carry_out(self._engine, code, rows)
        self._given.note(rows, self._engine.clock.base)

    def recorded(self) -> Scene:
        """Return the scene together with all commands that were given by hand, each at its exact time, and
        with the present moment as its exact end: run under any phase it has the contacts of this run."""
        engine = self._engine
        played = self._given.in_scene(self.scene, engine.clock)
        end = (*divmod(engine.clock.total(engine.now), TICKS), engine.met_now)
        return relabelled(played, settings=replace(played.settings, until=engine.time, end=end))
