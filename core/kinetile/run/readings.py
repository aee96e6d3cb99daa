"""Readings of a run: its cost and accuracy."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from kinetile.kernel.flight import positions_now, whole_pulls
from kinetile.kernel.tables import COUNTS, Kernel
from kinetile.run.engine.bounds import squares_of_bodies
from kinetile.run.engine.engine import Engine


@dataclass(frozen=True)
class Readings:
    """The instruments after a run; counts are totals since the start of the simulation.

    After ``resume`` or ``restore`` the broad phase's structure is built again: counts of its work, such as
    structural events, may then differ from a run without interruption. Contacts do not. The measures of a
    kinetic data structure (thesis, section 2.1) are among them. Responsiveness: events a CPU second.
    Efficiency: structural events for each contact. Compactness: the length of the queue. Locality: the number
    of rescheduled certificates. Candidate checks and exact times for each contact measure the quality of the
    broad phase; deepest overlap, unaccounted energy and lateness the accuracy of the run.

    Attributes:
        contacts: number of contacts of all kinds, the length of ``Simulation.contacts``.
        contacts_disc: contacts of two discs, beginnings and ends of passings among them.
        contacts_wall: contacts of a body with a wall.
        passings: number of times that two discs began to pass through each other.
        turns: commands that change a body: its velocity, acceleration, kind or place.
        inserted: inserted bodies.
        removed: removed bodies.
        structural_events: failures of the broad phase's own certificates.
        events: contacts, commands and structural events together.
        certificates_updated: number of times that the broad phase scheduled a body's certificate.
        newcomers: pairs that the broad phase reported as newly near, without the static construction.
        partners_asked: candidate checks: bodies that the broad phase named as near another one, checked by a
            bound if the narrow phase has one.
        contacts_computed: exact contact times.
        queue_max: largest number of queued bodies; a body has one entry, so at most the number of bodies.
        pairs_max: largest number of pairs in the broad phase's pair set; 0 if it keeps no set.
        deepest_overlap: deepest overlap found at a contact, in radii of the smaller body (``scene.radius``).
        unaccounted_energy: relative change of kinetic and potential energy by no command and no response.
        lateness: largest delay of a structural event, in the scene's time.
        cpu_seconds: processor time inside the loop, without compilation.
        python_seconds: the part of ``cpu_seconds`` during which the loop ran as Python.
        compile_seconds: processor time to compile the loop, or to load it.
        audits: number of audits without a violation.
        events_per_cpu_second: events / cpu_seconds of the compiled loop; of Python's if it never ran.
        contacts_per_cpu_second: contacts / cpu_seconds, likewise.
        fingerprint: digest of the list of contacts; equal under every broad phase.
    """

    contacts: int
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
    unaccounted_energy: float
    lateness: float
    cpu_seconds: float
    python_seconds: float
    compile_seconds: float
    audits: int
    events_per_cpu_second: float
    contacts_per_cpu_second: float
    fingerprint: str

    def as_dict(self) -> dict[str, Any]:
        """Returns the readings by name, fit for JSON."""
        return asdict(self)


_COUNTS = [name for name in Readings.__annotations__ if name in (COUNTS.names or ())]


def readings_of(engine: Engine, start_energy: float) -> Readings:
    """Reads the instruments of an engine; ``start_energy`` is the energy of its bodies at the start."""
    k, counts = engine.k, engine.k.counts[0]
    seconds, events, contacts = engine.cpu_seconds, engine.events, engine.contacts
    if seconds > engine.python_seconds:
        seconds -= engine.python_seconds
        events, contacts = events - engine.python_events, contacts - engine.python_contacts
    commanded, answered = float(counts.commanded_energy), float(counts.answered_energy)
    expected = start_energy + commanded + answered
    scale = max(map(abs, (start_energy, expected, commanded, answered)))  # expected may be mere rounding
    same: Any = {name: int(counts[name]) for name in _COUNTS}
    return Readings(
        **same,
        contacts=engine.contacts,
        structural_events=int(counts.structural),
        events=engine.events,
        certificates_updated=int(counts.updated),
        partners_asked=int(counts.asked),
        contacts_computed=int(counts.exact),
        deepest_overlap=max(float(counts.deepest), 0.0),
        unaccounted_energy=abs(energy(k) - expected) / scale if scale > 0.0 else 0.0,
        lateness=float(counts.late) * float(k.clock[0].per_tick),
        cpu_seconds=engine.cpu_seconds,
        python_seconds=engine.python_seconds,
        compile_seconds=engine.compile_seconds,
        audits=engine.audits,
        events_per_cpu_second=events / seconds if seconds > 0.0 else 0.0,
        contacts_per_cpu_second=contacts / seconds if seconds > 0.0 else 0.0,
        fingerprint=engine.ledger.fingerprint,
    )


def energy(k: Kernel) -> float:
    """Returns the kinetic energy of all movable bodies, summed exactly, and for accelerated bodies also the
    potential energy of their present acceleration, 0 in the corner (0, 0)."""
    found = 0.5 * squares_of_bodies(k)
    there = np.flatnonzero((k.queue.number >= 0) & np.isfinite(k.mass))
    pulls = whole_pulls(k, there, held=True)
    if pulls.any():
        heights = (positions_now(k, there) * pulls).sum(axis=1)
        found -= math.fsum((k.mass[there] * heights).tolist())
    return found
