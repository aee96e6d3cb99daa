"""A simulation made of a snapshot or of a file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from kinetile.errors import BadOption
from kinetile.run.saving.form import no_simulation, unpack
from kinetile.run.saving.restoring import put_back
from kinetile.run.saving.snapshot import Snapshot
from kinetile.run.saving.whole_file import read_whole
from kinetile.run.simulation import Simulation

__all__ = ["from_bytes", "resume", "simulation_of"]


def resume(
    path: str | os.PathLike[str],
    broad_phase: str | None = None,
    *,
    options: Mapping[str, Any] | None = None,
) -> Simulation:
    """Return the simulation that ``Simulation.save`` has written to a file.

    Without ``broad_phase`` it goes on as if it had never stopped: to the same contacts, structural events and
    readings, bit for bit. That asks for the same phases of the same version, on the same kinetile. With
    ``broad_phase`` (and ``options`` for it) that phase goes on from the plans, the clock, the commands still
    to come and the contacts so far; it builds its structure now, and has the same contacts.

    Raises:
        RecordError: the file cannot be read, is damaged, or is of another kinetile or another version of a
            phase; the message says which, and what can be done.
        UnknownName, BadOption: as ``Simulation``.
        Refused: the broad phase cannot do this scene.
    """
    if broad_phase is None and options is not None:
        raise BadOption(
            "options are for a broad phase that goes on, and none is named: expected broad_phase="
        )
    name = os.fspath(path)
    snapshot = unpack(read_whole(path), name)
    with no_simulation(name):
        return simulation_of(snapshot, broad_phase, options)


def from_bytes(content: bytes) -> Simulation:
    """Return a simulation that was pickled."""
    snapshot = unpack(content, "this pickle")
    with no_simulation("this pickle"):
        return simulation_of(snapshot)


def simulation_of(
    snapshot: Snapshot, broad_phase: str | None = None, options: Mapping[str, Any] | None = None
) -> Simulation:
    """Return a new simulation that goes on from a snapshot, under its own phases or another broad phase."""
    phases = snapshot.phases
    anew = broad_phase is not None
    simulation = Simulation(
        snapshot.scene,
        broad_phase if anew else phases.broad_phase,
        narrow_phases=phases.narrow_phases,
        options=options if anew else phases.options,
        keep_contacts=snapshot.entries.contacts is not None,
    )
    put_back(simulation, snapshot, anew)
    return simulation
