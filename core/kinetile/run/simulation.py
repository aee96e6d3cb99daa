"""A simulation: a scene and its phases by name; run it, turn bodies, read it out."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.compiled import is_cached
from kinetile.kernel.flight import positions_now
from kinetile.kernel.loop import CONTACTS_REACHED, TIME_REACHED
from kinetile.run.composition import Composition, compose_phases
from kinetile.run.engine import UNLIMITED, Engine
from kinetile.run.explanation import explanation
from kinetile.run.interrupts import Interrupts
from kinetile.run.ledger import Recorder
from kinetile.run.readings import Readings, energy
from kinetile.scene import Scene

__all__ = ["Progress", "Simulation"]

IDLE_SPANS = 1 << 12
"""A run without an end in time gives up after so many spans of the clock in which nothing happened."""


class Progress(NamedTuple):
    """How far a run is.

    ``time`` of ``until`` (None: no end in time); contacts and events since the start; CPU seconds of this
    run.
    """

    time: float
    until: float | None
    contacts: int
    events: int
    cpu_seconds: float


class Simulation:
    """Bodies in motion under a choice of phases.

    Args:
        scene: what is simulated.
        broad_phase: its name; None: what the scene says, or the default.
        narrow_phases: names, or a mapping from names to options; None: what the scene says, or what it needs.
        options: options of the broad phase.
        keep_contacts: False to keep only their fingerprint, for runs of very many contacts.
        audit: check everything that must hold every so many contacts, and at the end of each run (slow:
            O(n^2)
            an audit); None: never.
        turning: True to compile turns into the loop though the scene has none, so that ``set_velocity`` need
            not compile it anew.

    Raises:
        UnknownName: no phase is registered under a name.
        BadOption: a phase has no such option.
        Refused: a phase cannot do this scene.
    """

    def __init__(
        self,
        scene: Scene,
        broad_phase: str | None = None,
        *,
        narrow_phases: Sequence[str] | Mapping[str, Mapping[str, Any]] | None = None,
        options: Mapping[str, Any] | None = None,
        keep_contacts: bool = True,
        audit: int | None = None,
        turning: bool = False,
    ) -> None:
        if audit is not None and audit < 1:
            raise ValueError(f"audit is a number of contacts, at least 1; found {audit}")
        self.scene = scene
        self.composition: Composition = compose_phases(scene, broad_phase, narrow_phases, options)
        self._engine = Engine(scene, self.composition, keep_contacts, turning)
        self._audit = audit
        self._running = False
        self._asked: float | None = None
        self._start_energy = energy(self._engine.k)

    # What it is

    @property
    def broad_phase(self) -> str:
        """Name of the broad phase."""
        return self.composition.broad_phase

    @property
    def narrow_phases(self) -> tuple[str, ...]:
        """Names of the narrow phases."""
        return tuple(self.composition.narrow_phases)

    @property
    def options(self) -> Mapping[str, Any]:
        """Options of the broad phase."""
        return self.composition.options

    @property
    def time_unit(self) -> float:
        """The power of two in which ``epoch`` and ``tick`` count, in the scene's time."""
        return self._engine.clock.unit

    @property
    def cached(self) -> bool | None:
        """Whether the loop's machine code lies on disk; None when it runs interpreted."""
        return is_cached(self._engine.loop)

    @property
    def state(self) -> Any:
        """The broad phase's state (a NamedTuple of arrays): its structure, to be looked at between runs."""
        return self._engine.state

    def explain(self) -> dict[str, Any]:
        """Return what is modelled and what is left out, in sentences, with the numbers behind them."""
        engine = self._engine
        return explanation(
            self.scene, self.composition, engine.turning, engine.skin, self.time_unit, engine.speed
        )

    # Running

    def compile(self) -> float:
        """Compile the loop, or load it from the disk cache; return the seconds this has taken so far."""
        self._engine.compile()
        return self._engine.compile_seconds

    def run(
        self,
        until: float | None = None,
        *,
        max_contacts: int | None = None,
        progress: Callable[[Progress], None] | None = None,
        recorder: Recorder | None = None,
    ) -> None:
        """Run on until a time, or for so many more contacts, whichever comes first.

        Args:
            until: the time to run to, in the scene's time; all events up to and at it have then happened.
                None: the scene's own ``until``, if it has one.
            max_contacts: stop after so many further contacts of discs and walls, at the time of the last one.
                Without ``until``, stop as well when nothing has happened for two million time units.
            progress: called after each chunk (a fraction of a second).
            recorder: called with the log rows of each chunk, before a fault is raised.

        Raises:
            ZenoError: the bodies are jammed.
            MissedContactError: a contact was missed or found too late.
            PhaseError: a phase broke the protocol.
            AuditError: an audit found something that does not hold.
            ValueError: ``until`` is not a finite time, or lies in the past.
        """
        engine = self._engine
        if engine.ledger.recorder is not None or self._running:
            raise RuntimeError(
                "this simulation is running: run cannot be called from its own progress or recorder"
            )
        until, end = self._end(until, max_contacts)
        engine.compile()
        last_contact = UNLIMITED
        if max_contacts is not None:
            last_contact = min(engine.contacts + operator.index(max_contacts), UNLIMITED)
        began = engine.cpu_seconds
        idle, seen, audited = 0, -1, engine.contacts
        engine.ledger.recorder = recorder
        self._running = True
        try:
            with Interrupts() as interrupts:
                engine.ledger.hand_over()
                while True:
                    rest = SPAN if end is None else engine.clock.relative(end)
                    before = engine.now
                    stop = last_contact if self._audit is None else min(last_contact, audited + self._audit)
                    reason = engine.chunk(min(rest, SPAN - 1), stop)
                    arrived = reason == TIME_REACHED and rest < SPAN
                    if arrived:
                        self._asked = until
                    elif engine.now != before:
                        self._asked = None
                    if progress is not None:
                        cpu = engine.cpu_seconds - began
                        progress(Progress(self.time, until, engine.contacts, engine.events, cpu))
                    finished = arrived or engine.contacts >= last_contact
                    if self._audit is not None and (finished or reason == CONTACTS_REACHED):
                        engine.audit()
                        audited = engine.contacts
                    if finished:
                        break
                    if reason == TIME_REACHED:
                        happened = engine.contacts + int(engine.k.counts[0].turns)
                        idle = idle + 1 if happened == seen and not engine.agenda.turns else 0
                        seen = happened
                        if end is None and idle > IDLE_SPANS:
                            break
                        engine.move_base()
                    interrupts.check()
        finally:
            self._running = False
            engine.ledger.recorder = None

    def set_velocity(self, body: int, velocity: tuple[float, float]) -> None:
        """Turn a body now: from here on it flies with this velocity.

        Raises:
            IndexError: there is no such body.
            ValueError: the velocity is not two finite numbers.
        """
        body = operator.index(body)
        if not 0 <= body < len(self.scene):
            raise IndexError(f"there is no body {body}: this scene has {len(self.scene)}, numbered from 0")
        vx, vy = (float(v) for v in velocity)
        if not (math.isfinite(vx) and math.isfinite(vy)):
            raise ValueError(f"a velocity is two finite numbers; found ({vx}, {vy})")
        if math.hypot(vx, vy) * float(self._engine.k.clock[0].tick) > 2.0**-20 * float(
            self.scene.radius.min()
        ):
            raise ValueError(
                f"at the speed {math.hypot(vx, vy):.3g} body {body} would fly too far in one tick of this "
                "scene's clock: schedule the turn in the scene, which chooses its clock by its speeds"
            )
        self._engine.turn(body, vx, vy)

    # Reading out

    @property
    def time(self) -> float:
        """The present time: what ``run`` was asked for, or that of the last event where it stopped before."""
        return self._asked if self._asked is not None else self._engine.clock.time(self._engine.now)

    def positions(self) -> npt.NDArray[np.float64]:
        """Return the positions now, (n, 2)."""
        return positions_now(self._engine.k)

    def velocities(self) -> npt.NDArray[np.float64]:
        """Return the velocities now, (n, 2)."""
        return np.column_stack([self._engine.k.bodies.vx, self._engine.k.bodies.vy])

    def candidate_pairs(self) -> npt.NDArray[np.int32]:
        """Return the candidate pairs now, (k, 2), a < b, sorted."""
        self._engine.build()
        table = self._engine.k.certificates
        live = table[table.a >= 0]
        pairs = np.column_stack([live.a, live.b])
        return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]

    @property
    def contacts(self) -> npt.NDArray[np.void]:
        """All contacts so far, in canonical order (``kinetile.kernel.log.CONTACT``)."""
        return self._engine.ledger.contacts

    @property
    def fingerprint(self) -> str:
        """Hex digest of the list of contacts (epoch, tick, a, b): equal under every broad phase."""
        return self._engine.ledger.fingerprint

    @property
    def readings(self) -> Readings:
        """The instruments, now."""
        walls = len(self.scene) if self.composition.wall is not None else 0
        return Readings.take(
            self._engine.k,
            start_energy=self._start_energy,
            certificates_created=self.composition.broad.certificates + walls,
            cpu_seconds=self._engine.cpu_seconds,
            compile_seconds=self._engine.compile_seconds,
            audits=self._engine.audits,
            fingerprint=self.fingerprint,
        )

    # Checking the end

    def _end(self, until: float | None, max_contacts: int | None) -> tuple[float | None, int | None]:
        """Check the arguments of ``run``; return the end as a time and as ticks since the start."""
        if until is None:
            until = self.scene.settings.until
        if until is None and max_contacts is None:
            raise ValueError("run needs an end: until=, max_contacts= or an until in the scene")
        if max_contacts is not None and max_contacts < 0:
            raise ValueError(f"max_contacts must not be negative; found {max_contacts}")
        if until is None:
            return None, None
        until = float(until)
        if not math.isfinite(until):
            raise ValueError(f"until must be a finite time; found {until}")
        if until == self.time:
            return until, self._engine.clock.base * TICKS + self._engine.now
        end = self._engine.clock.ticks(until)
        if self._engine.clock.relative(end) < self._engine.now:
            raise ValueError(f"until={until} lies in the past: the time is {self.time}")
        return until, end
