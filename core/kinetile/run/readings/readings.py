"""Readings: what a run cost and how true it stayed, as numbers with units."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

import kinetile
from kinetile.kernel.tables import Kernel

__all__ = ["Readings", "energy"]


@dataclass(frozen=True)
class Readings:
    """The instruments after a run; counts are totals since the start of the simulation.

    Attributes:
        contacts_disc: contacts of two discs, beginnings and ends of passings among them.
        contacts_wall: contacts of a disc with a wall.
        passings: times that two discs began to pass through each other.
        turns: changes of velocity by the user or the scene.
        inserted: bodies that came.
        removed: bodies that went.
        structural_events: failures of the broad phase's own certificates.
        events: all of the above together.
        certificates_updated: times the broad phase set anew when a body's certificate fails.
        newcomers: pairs that the broad phase said have become near, those of the static construction apart.
        partners_asked: bodies that another looked at for their contact, by a bound where the narrow phase has
            one: all that the broad phase named.
        contacts_computed: contact times worked out exactly.
        queue_max: most bodies queued at one time; a body has one entry, so it is at most their number.
        pairs_max: most pairs in the broad phase's pair set; 0 where it keeps none.
        deepest_overlap: deepest overlap found at a contact, in radii of the smaller body.
        energy_drift: relative change of kinetic energy, apart from what commands and responses change.
        lateness: how far in the past a structural event was found, in the scene's time.
        cpu_seconds: processor time inside the loop, compilation apart.
        compile_seconds: processor time to compile the loop, or to load it.
        audits: times an audit looked at everything and found nothing.
        events_per_cpu_second: events / cpu_seconds.
        contacts_per_cpu_second: contacts / cpu_seconds.
        fingerprint: digest of the list of contacts; equal under every broad phase.
    """

    contacts_disc: int
    contacts_wall: int
    passings: int
    turns: int
    inserted: int
    removed: int
    structural_events: int
    events: int
    certificates_updated: int
    newcomers: int
    partners_asked: int
    contacts_computed: int
    queue_max: int
    pairs_max: int
    deepest_overlap: float
    energy_drift: float
    lateness: float
    cpu_seconds: float
    compile_seconds: float
    audits: int
    events_per_cpu_second: float
    contacts_per_cpu_second: float
    fingerprint: str

    def as_dict(self) -> dict[str, Any]:
        """Return the readings by name, fit for JSON."""
        return asdict(self)

    def _repr_html_(self) -> str:
        return kinetile.as_html(self)  # made above this room: by its public name

    @classmethod
    def take(
        cls,
        k: Kernel,
        *,
        start_energy: float,
        cpu_seconds: float,
        compile_seconds: float,
        audits: int,
        fingerprint: str,
    ) -> Readings:
        """Read the instruments of a kernel."""
        counts = k.counts[0]
        contacts = int(counts.contacts_disc) + int(counts.contacts_wall)
        commands = int(counts.turns) + int(counts.inserted) + int(counts.removed)
        events = contacts + commands + int(counts.structural)
        expected = start_energy + float(counts.commanded_energy) + float(counts.answered_energy)
        scale = max(abs(start_energy), abs(expected))
        return cls(
            contacts_disc=int(counts.contacts_disc),
            contacts_wall=int(counts.contacts_wall),
            passings=int(counts.passings),
            turns=int(counts.turns),
            inserted=int(counts.inserted),
            removed=int(counts.removed),
            structural_events=int(counts.structural),
            events=events,
            certificates_updated=int(counts.updated),
            newcomers=int(counts.newcomers),
            partners_asked=int(counts.asked),
            contacts_computed=int(counts.exact),
            queue_max=int(counts.queue_max),
            pairs_max=int(counts.pairs_max),
            deepest_overlap=max(float(counts.deepest), 0.0),
            energy_drift=abs(energy(k) - expected) / scale if scale > 0.0 else 0.0,
            lateness=float(counts.late) * float(k.clock[0].tick),
            cpu_seconds=cpu_seconds,
            compile_seconds=compile_seconds,
            audits=audits,
            events_per_cpu_second=events / cpu_seconds if cpu_seconds > 0.0 else 0.0,
            contacts_per_cpu_second=contacts / cpu_seconds if cpu_seconds > 0.0 else 0.0,
            fingerprint=fingerprint,
        )


def energy(k: Kernel) -> float:
    """Return the kinetic energy of all bodies that can be moved, summed exactly."""
    mass = np.where(np.isinf(k.mass), 0.0, k.mass)
    return 0.5 * math.fsum(np.asarray(mass * (k.bodies.vx**2 + k.bodies.vy**2)))
