"""What was given by hand, written down: the commands of a run, so that they can be given again.

An hour of a game has some ten million of them, so they are kept as bytes, a row after a row: as objects they
would take four times the memory, and Python's collector would look at them all now and then.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import Clock
from kinetile.kernel.log import INSERTED, REMOVED
from kinetile.kernel.tables import COMMAND
from kinetile.run.engine.commands.agenda import Rows, command_of
from kinetile.scene import Scene, with_commands

__all__ = ["Given"]


class Given:
    """Commands in the order in which they were given, all of them carried out."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._inserted = bytearray()  # of the same commands: whose kind is asked for is not to cost them all
        self._bases: list[tuple[int, int]] = []  # from which row on ticks count from which base of the clock

    @property
    def content(self) -> tuple[bytes, tuple[tuple[int, int], ...]]:
        """All that is written down, to come back to."""
        return bytes(self._bytes), tuple(self._bases)

    @classmethod
    def of(cls, content: tuple[bytes, Iterable[tuple[int, int]]]) -> Given:
        """Return what was written down."""
        given = cls()
        given._bytes, given._bases = bytearray(content[0]), [(first, base) for first, base in content[1]]
        given._note_inserted(np.frombuffer(content[0], COMMAND))
        return given

    def __len__(self) -> int:
        return len(self._bytes) // COMMAND.itemsize

    def note(self, rows: Rows, base: int) -> None:
        """Write commands down; ``base`` is that of the clock whose ticks they have."""
        if not self._bases or self._bases[-1][1] != base:
            self._bases.append((len(self), base))
        self._bytes += rows.tobytes()
        self._note_inserted(rows)

    def _note_inserted(self, rows: Rows) -> None:
        came = rows[rows["code"] == INSERTED]
        if len(came):
            self._inserted += np.column_stack([came["body"], came["kind"]]).astype(np.int64).tobytes()

    @property
    def inserted(self) -> npt.NDArray[np.int64]:
        """The bodies that came, each with the number of its kind, (m, 2)."""
        return np.frombuffer(bytes(self._inserted), np.int64).reshape(-1, 2)

    def in_scene(self, scene: Scene, clock: Clock) -> Scene:
        """Return a scene with these commands, at their exact times, and without those of its own for bodies
        that had gone by then."""
        rows = np.frombuffer(bytes(self._bytes), COMMAND)
        commands = []
        for at, (first, base) in enumerate(self._bases):
            end = self._bases[at + 1][0] if at + 1 < len(self._bases) else len(rows)
            commands += [command_of(row, base) for row in rows[first:end]]
        gone = {command.body: command.ticks for command in commands if command.code == REMOVED}
        own = [
            each
            for each in scene.commands
            if each.body not in gone or clock.tick_of(each.time, each.at) <= gone[each.body]
        ]
        done = [command.as_scene_has_it(clock, scene) for command in commands]
        return with_commands(scene, [*own, *done], kinds=scene.kinds)
