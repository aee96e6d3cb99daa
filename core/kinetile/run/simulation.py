"""A simulation: a scene and its phases by name; run it, turn bodies, read it out."""

from __future__ import annotations

import operator
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.errors import AuditError, BusyError, MissedContactError, PhaseError, ZenoError
from kinetile.kernel.clock import TICKS
from kinetile.kernel.compiled import is_cached
from kinetile.run.advance import End, Event, advance, advance_one, next_event
from kinetile.run.arguments import StopAt, read_body, read_end, read_stop, watch, watch_no_more
from kinetile.run.commanding import TakesCommands
from kinetile.run.composition import Commands, compose_phases
from kinetile.run.engine import Engine, Given
from kinetile.run.engine.ledger import Recorder
from kinetile.run.interrupts import Unbroken
from kinetile.run.questions import Moment, Questions
from kinetile.run.questions.reading_out import ReadsOut
from kinetile.run.readings import Readings, energy, explanation
from kinetile.run.saving import CanBeSaved
from kinetile.scene import Scene, Turn, spacious

__all__ = ["Progress", "Simulation"]

_FAULTS = (ZenoError, MissedContactError, PhaseError, AuditError)
_RUNS = ("run", "step", "be built", "be built anew")


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


class Simulation(TakesCommands, CanBeSaved, ReadsOut, Questions):
    """Bodies in motion under a choice of phases.

    Args:
        scene: what is simulated.
        broad_phase: its name; None: what the scene says, or the default.
        narrow_phases: names, or a mapping from names to options; None: what the scene says, or what it needs.
        options: options of the broad phase.
        keep_contacts: False to keep only their fingerprint, for runs of very many contacts.
        audit: check everything that must hold every so many contacts, and at the end of each run (slow:
            O(n^2) an audit); None: never.
        turning: True to compile turns into the loop though the scene has none, so that ``set_velocity`` need
            not compile it anew.
        live: True for a program that gives all kinds of commands: they are compiled into the loop though the
            scene has none, and there is room for bodies that come, so that the first need not do either.

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
        live: bool = False,
    ) -> None:
        if audit is not None and audit < 1:
            raise ValueError(f"audit is a number of contacts, at least 1; found {audit}")
        self.scene = scene
        lives = live or any(not isinstance(command, Turn) for command in scene.commands)
        room = spacious(scene) if lives else scene
        composition = compose_phases(room, broad_phase, narrow_phases, options)
        commands = Commands.ALL if live else Commands.TURNS if turning else Commands.NONE
        self._engine = Engine(room, composition, keep_contacts, commands)
        self._given = Given()
        self._audit = audit
        self._running = False
        self._fault: str | None = None
        self._lock = threading.RLock()
        self._start_energy = energy(self._engine.k)

    # What it is

    def __repr__(self) -> str:
        bodies = len(self.bodies)
        what = f"{self.broad_phase}, {bodies} {'body' if bodies == 1 else 'bodies'}, time {self.time!r}"
        ended = "" if self._fault is None else f", ended by {self._fault.partition(':')[0]}"
        return f"<Simulation: {what}, {self._engine.contacts} contacts{ended}>"

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

    def explain(self) -> dict[str, Any]:
        """Return what is modelled and what is left out, in sentences, with the numbers behind them."""
        engine = self._engine
        return explanation(
            self.scene, self.composition, engine.commands, engine.skin, self.time_unit, engine.speed
        )

    # Running

    def compile(self) -> float:
        """Compile the loop, or load it from the disk cache; return the CPU seconds this has taken so far."""
        self._engine.compile()
        return self._engine.compile_seconds

    def build(self) -> None:
        """Build the broad phase's structure, where that is still to be done, and run no event.

        Raises as ``run`` does.
        """
        if not self._engine.built:
            with self._alone("be built"):
                self._engine.build()

    def rebuild(self) -> None:
        """Build the broad phase's structure anew as of now; no contact can change by it."""
        with self._alone("be built anew"):
            with Unbroken():
                self._engine.lay_out(self._engine.speed)
            self._engine.build()

    def run(
        self,
        until: float | None = None,
        *,
        max_contacts: int | None = None,
        max_events: int | None = None,
        progress: Callable[[Progress], None] | None = None,
        recorder: Recorder | None = None,
        stop_at: StopAt | None = None,
    ) -> Event | None:
        """Run on until a time, or for so many more contacts or events, whichever comes first; return the
        contact at which the run stopped before that, where it did.

        Args:
            until: the time to run to, in the scene's time; all events up to and at it have then happened.
                None: the scene's own ``until``, if it has one.
            max_contacts: stop after so many further contacts of discs and walls, at the time of the last one.
                Without ``until``, stop as well when nothing has happened for two million time units.
            max_events: stop after so many further events of all kinds, at the time of the last one.
            progress: called after each chunk (a fraction of a second); it may turn bodies.
            recorder: called with the log rows of each chunk, before a fault is raised.
            stop_at: contacts to stop at, at their exact time (``StopAt``).

        Raises:
            ZenoError: the bodies are jammed.
            MissedContactError: a contact was missed or found too late.
            PhaseError: a phase broke the protocol.
            AuditError: an audit found something that does not hold.
            BusyError: this simulation is running already.
            ValueError: ``until`` is not a finite time, or lies in the past; ``stop_at`` names a kind that
                there is not.
            IndexError: ``stop_at`` names a body that is not there, nor still to come.
            TypeError: ``stop_at`` is no ``StopAt``.
        """
        with self._alone("run"):
            end = read_end(self._engine, self.scene, until, max_contacts, max_events)
            stop_at = read_stop(stop_at)
            engine = self._engine
            engine.compile()
            if stop_at is not None:
                watch(engine, self.scene, stop_at)
            self._running = True
            engine.ledger.recorder = recorder
            began = engine.cpu_seconds
            try:

                def after_chunk() -> None:
                    if progress is not None:
                        cpu = engine.cpu_seconds - began
                        progress(Progress(self.time, end.until, engine.contacts, engine.events, cpu))

                introduce = getattr(recorder, "introduce", None)
                if introduce is not None:  # an event file says of which kinds bodies are that come by hand
                    introduce(self.kinds_of, engine.numbers)
                with Unbroken():
                    engine.ledger.hand_over()
                return self._with_kinds(advance(engine, end, self._audit, after_chunk))
            finally:
                self._running = False
                watch_no_more(engine)
                engine.ledger.recorder = None
                reached = getattr(recorder, "reached", None)
                if reached is not None:  # an event file says how far its rows go
                    reached(self.time)

    def step(self) -> Event | None:
        """Run the next event, of whatever kind, and return it; None, with nothing run, where there is none.

        None as well, two million time units later, where none comes before that. Raises as ``run`` does.
        """
        with self._alone("step"):
            return self._with_kinds(advance_one(self._engine, End()))

    def steps(self, until: float | None = None) -> Iterator[Event]:
        """Run event by event, and yield each after it has happened, up to and at a time.

        Between two events the simulation is the caller's: to be looked at, turned, run. None: the scene's own
        ``until``; where there is none either, for as long as there are events.

        Raises as ``run`` does.
        """
        until = self.scene.settings.until if until is None else until
        end = End() if until is None else read_end(self._engine, self.scene, until)
        while True:
            with self._alone("step"):
                event = self._with_kinds(advance_one(self._engine, end))
            if event is None:
                return
            yield event

    @property
    def next_event(self) -> Event | None:
        """The event that ``step`` would run, as scheduled now; None where nothing is awaited.

        A body that flies for more than a thousand time units without an event is written down anew on the
        way, which can move what comes later by its rounding.

        Raises BusyError while a chunk of a run is under way: to look ahead, the loop asks who meets first.
        """
        with self._alone("look ahead"):
            return self._with_kinds(next_event(self._engine))

    def audit(self) -> None:
        """Check now everything that must hold between two events; O(n^2).

        Raises:
            AuditError: the first thing that does not hold.
        """
        with self._alone("be audited"):
            self._engine.audit()

    def _moment(self) -> Moment:
        engine = self._engine
        return Moment(engine.k, engine.taken.astype(np.int64), engine.clock, self.composition)

    def _slot_of(self, body: int) -> int:
        return int(self._engine.k.slots[read_body(self._engine, body)])

    def _bodies_of(self, slots: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        numbers: npt.NDArray[np.int64] = self._engine.k.queue["number"][slots].astype(np.int64)
        return numbers

    def _with_kinds(self, event: Event | None) -> Event | None:
        """Return an event with the kinds of its bodies, where the scene has kinds."""
        if event is None or self.scene.kinds == (0,):
            return event
        return event._replace(kinds=tuple(self.kinds_of(event.bodies).tolist()))

    def _planned(self) -> Mapping[int, int]:
        engine = self._engine
        return engine.agenda.first_of_each(engine.k, engine.clock)

    @contextmanager
    def _alone(self, what: str) -> Iterator[None]:
        """Within this context nobody else changes the simulation; BusyError where somebody does already."""
        if not self._lock.acquire(blocking=False):
            raise BusyError(f"this simulation is running in another thread: it cannot {what} meanwhile")
        try:
            if self._engine.busy or (self._running and what in ("run", "step")):
                raise BusyError(
                    f"this simulation is running: it cannot {what} from its own recorder, progress or hooks"
                )
            if what in ("run", "step", "be restored"):
                self._fault = None
            yield
        except _FAULTS as error:
            if what in _RUNS:
                self._fault = f"{type(error).__name__}: {error}"
            raise
        finally:
            self._lock.release()

    # Reading out

    @property
    def time(self) -> float:
        """The present time: what ``run`` was asked for, or that of the last event where it stopped before."""
        return self._engine.time

    @property
    def exact_time(self) -> tuple[int, int]:
        """The tick that the simulation is at, as (epoch, tick): see ``Event``."""
        return divmod(self._engine.clock.total(self._engine.now), TICKS)

    @property
    def contacts(self) -> npt.NDArray[np.void]:
        """All contacts so far, in canonical order (dtype ``kinetile.CONTACT``), to be read.

        Asking costs a copy of those that came since it was last asked. Raises ValueError where none are kept.
        """
        return self._engine.ledger.contacts

    def contacts_since(self, count: int) -> npt.NDArray[np.void]:
        """Return the contacts after the first ``count``: those that are new since there were so many.

        Raises ValueError where no contacts are kept, or for a negative number.
        """
        if operator.index(count) < 0:
            raise ValueError(f"count is a number of contacts, at least 0; found {count}")
        return self._engine.ledger.contacts_since(count)

    @property
    def fingerprint(self) -> str:
        """Hex digest of the list of contacts (epoch, tick, a, b): equal under every broad phase."""
        return self._engine.ledger.fingerprint

    @property
    def readings(self) -> Readings:
        """The instruments, now."""
        return Readings.take(
            self._engine.k,
            start_energy=self._start_energy,
            cpu_seconds=self._engine.cpu_seconds,
            compile_seconds=self._engine.compile_seconds,
            audits=self._engine.audits,
            fingerprint=self.fingerprint,
        )
