"""What of a simulation can be saved: snapshots, copies, files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any

from kinetile.errors import BusyError
from kinetile.run.engine import Engine, Given
from kinetile.run.saving.restoring import put_back
from kinetile.run.saving.snapshot import Snapshot, take
from kinetile.scene import Scene

__all__ = ["CanBeSaved"]


class CanBeSaved:
    """What of a simulation can be saved: between two runs or steps, or from the ``progress`` of a run."""

    scene: Scene
    _engine: Engine
    _given: Given
    _audit: int | None
    _start_energy: float
    _running: bool

    def _alone(self, what: str) -> AbstractContextManager[None]:
        raise NotImplementedError

    @property
    def rows(self) -> int:
        """How many log rows there have been: those that a recorder got which was there from the start."""
        return self._engine.ledger.rows

    @property
    def keeps_contacts(self) -> bool:
        """Whether ``contacts`` are kept, or only their fingerprint."""
        return self._engine.ledger.keeps

    def snapshot(self) -> Snapshot:
        """Return everything that this simulation is now, to come back to with ``restore``.

        Raises RecordError where a run has ended with a fault, BusyError while a chunk of a run is under way.
        """
        with self._alone("be saved"):
            return take(self)

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot of this simulation, or of another one of the same scene.

        Under the same phases everything is as it was, to the last bit. Under another broad phase, or with
        other options, the structure is built anew, and the contacts are the same.

        Raises RecordError for a snapshot of another scene or of other narrow phases, Refused where the broad
        phase cannot do this, BusyError while it runs; then nothing has changed.
        """
        with self._alone("be restored"):
            if self._running:
                raise BusyError("this simulation is running: it cannot be restored from its own progress")
            put_back(self, snapshot)

    def save(self, path: str | os.PathLike[str], note: Mapping[str, Any] | None = None) -> None:
        """Write a file of which ``kinetile.resume`` makes this simulation again, in any process.

        It gets its name when all of it is on the disk: what is there under this name stays as it is until
        then, whatever happens. ``note`` is anything that JSON can say, for ``kinetile.run.saving.form.note``.

        Raises RecordError where it cannot be written, where something else than a saved simulation is there,
        and as ``snapshot``; and where contacts are not kept and their fingerprint cannot be written down.
        """
        from kinetile.run.saving.form import pack
        from kinetile.run.saving.whole_file import write_whole

        write_whole(path, pack(self.snapshot(), note))

    def __copy__(self) -> Any:
        return self.__deepcopy__({})

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        from kinetile.run.saving.resuming import simulation_of

        return simulation_of(self.snapshot())

    def __reduce__(self) -> tuple[Any, ...]:
        from kinetile.run.saving.form import pack
        from kinetile.run.saving.resuming import from_bytes

        return from_bytes, (b"".join(pack(self.snapshot())),)
