"""``Simulation``, the public class: a scene and its named phases, which users run, change, read and save. The
engine, ``advance``, ``asked`` and ``saving/`` do the work."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from types import TracebackType
from typing import Any, NamedTuple, NoReturn, Self, cast

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Flags, Integers, Rows
from kinetile.errors import (
    FAULTS,
    BadOption,
    BusyError,
    NoRoom,
    PhaseError,
    RecordError,
    ZenoError,
    answering,
)
from kinetile.explanation import explanation
from kinetile.kernel.clock import TICKS
from kinetile.kernel.compiled import is_cached
from kinetile.kernel.log import ACCELERATED, INSERTED, MOVED, OF_KIND, REMOVED, TURNED, WALLS
from kinetile.kernel.tables import NOBODY, Kernel, read_only
from kinetile.plugin.drawing import Item
from kinetile.run import arguments
from kinetile.run.advance import End, Ended, Event, advance, advance_one, next_event
from kinetile.run.arguments import StopAt
from kinetile.run.asked import QueryableMoment
from kinetile.run.callbacks import OnContact, read_calls
from kinetile.run.candidates import by_number, drawn, named_near, pairs_of_named
from kinetile.run.compose import CommandSupport, Composition, Named, compose_phases
from kinetile.run.engine.by_hand import carry_out, command_rows, insert_those_with_room
from kinetile.run.engine.engine import Engine
from kinetile.run.engine.kept import Kept, unchanged_if
from kinetile.run.engine.ledger import RowFunction
from kinetile.run.engine.state import passings_of
from kinetile.run.interrupts import Interruptible, Unbroken
from kinetile.run.moment import Moment, Recorder, told
from kinetile.run.observing import Observers
from kinetile.run.prepared import Prepared
from kinetile.run.questions import meetings
from kinetile.run.readings import Readings, energy, readings_of
from kinetile.run.saving.files import no_simulation, read_whole, unpack, write_whole
from kinetile.run.saving.snapshot import SavedPhases, Snapshot, resumed
from kinetile.scene import Insert, Scene, relabelled, with_commands
from kinetile.scene.bodies import Coordinates
from kinetile.scene.checks import read_count
from kinetile.scene.commands import name_like
from kinetile.scene.responses import Kind
from kinetile.scene.scene import Radii
from kinetile.scene.shapes import Shape
from kinetile.statistics import Observed


class Progress(NamedTuple):
    """Progress of a run: the present ``time`` and its end ``until`` (or None); all contacts and events; its
    CPU seconds; ``compiled``, False if its loop runs as Python."""

    time: float
    until: float | None
    contacts: int
    events: int
    cpu_seconds: float
    compiled: bool = True


class Inserted(NamedTuple):
    """The result of ``insert_many``: the ``numbers`` of the bodies, (n,), -1 without room; ``refused``, (n,),
    True for bodies without room; and ``reasons``, errors by the place in the call (texts are made lazily)."""

    numbers: Integers
    refused: Flags
    reasons: Mapping[int, Exception]


class _Alone(Unbroken):
    """A context that keeps other threads and callbacks from changing a simulation; BusyError if one does
    already. Signals wait until it ends, except at the places where a long step can be interrupted.

    The message of BusyError names ``what``, the refused action. A context that ``runs`` is also refused
    during another run. ``Simulation.fault`` is the error that ends a context that ``runs`` or ``builds``."""

    def __init__(
        self, simulation: Simulation, what: str, *, runs: bool = False, builds: bool = False
    ) -> None:
        self._simulation, self._what, self._runs, self._faults = simulation, what, runs, runs or builds

    def __enter__(self) -> Self:
        Unbroken.__enter__(self)  # super() takes longer
        simulation, what = self._simulation, self._what
        if not simulation._lock.acquire(False):
            self._refuse(f" in another thread: it cannot {what} meanwhile")
        if simulation._engine.busy or (simulation._running and self._runs):
            simulation._lock.release()
            self._refuse(f": it cannot {what} from its own recorder, on_contact, progress or hooks")
        if self._runs:
            simulation._fault = None
        return self

    def _refuse(self, why: str) -> NoReturn:
        error = BusyError(f"this simulation is running{why}")
        super().__exit__(BusyError, error, None)
        raise error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        simulation = self._simulation
        if error is not None and isinstance(error, FAULTS) and self._faults:
            simulation._fault = f"{type(error).__name__}: {error}"
        simulation._lock.release()
        Unbroken.__exit__(self, kind, error, trace)


class Simulation(QueryableMoment):
    """Bodies in motion under a choice of phases.

    Args:
        broad_phase: name, with options if needed (``sap-1d:axis=y``); None: the scene's, or the default.
        narrow_phases: names, with options if needed, or a mapping from names to options; None: the scene's,
            or the phases that it needs.
        options: options of the broad phase; they replace options in its name.
        keep_contacts: False to keep only the fingerprint of the contacts, for runs of very many contacts.
        keep_commands: False to forget commands by hand that have run: saved runs do not grow by them, and
            ``recorded`` raises ValueError.
        audit: number of contacts between two audits, which check every invariant in O(n^2); each run ends
            with an audit, too. None: no audits.
        turning: True to compile turns into the loop though the scene plans no turns, so that ``set_velocity``
            need not compile it again.
        live: True for a program that gives all kinds of commands: they are compiled into the loop, and slots
            are free for inserted bodies, though the scene needs neither.
        room: with ``live``, or if the scene inserts and removes bodies: the number of bodies that can be
            present before tables grow, at least the number in the scene; None: twice as many.
        compiled: True to compile the loop before the first event; False to run hooks as Python, for a
            debugger; None: a run of at most 1,100 bodies whose loop has not been compiled yet begins as
            Python at once, and continues in machine code when another process has compiled the loop; if none
            can (hooks of ``__main__``, say), it is compiled here after a second. Contacts are bitwise equal.

    Raises UnknownName, BadOption for an option that a phase does not have, and Refused.
    """

    # Construction and properties

    @answering
    def __init__(
        self,
        scene: Scene,
        broad_phase: str | None = None,
        *,
        narrow_phases: Sequence[str] | Named | None = None,
        options: Mapping[str, Any] | None = None,
        keep_contacts: bool = True,
        keep_commands: bool = True,
        audit: int | None = None,
        turning: bool = False,
        live: bool = False,
        room: int | None = None,
        compiled: bool | None = None,
    ) -> None:
        if audit is not None:
            audit = read_count(audit, "audit", "contacts", 1)
        if room is not None:
            room = max(read_count(room, "room"), len(scene))
        prepared = (
            Prepared.of(scene, room) if live or CommandSupport.of(scene) == CommandSupport.ALL else scene
        )
        if scene.changing and not keep_commands:
            raise BadOption(
                "keep_commands=False is for scenes that plan no SetKind: expected set_kind by hand"
            )
        composition = compose_phases(prepared, broad_phase, narrow_phases, options)
        if not (compiled is None or isinstance(compiled, bool)):
            raise TypeError(f"compiled is {compiled!r}; expected True (first), False (never) or None")
        composition = replace(composition, compiled=compiled)
        commands = CommandSupport.ALL if live else CommandSupport.TURNS if turning else CommandSupport.NONE
        super().__init__(scene, Engine(prepared, composition, keep_contacts, commands, None, keep_commands))
        self._audit = audit
        self._running: End | None = None
        self._fault: str | None = None
        self._told = False
        self._lock = threading.RLock()
        self._start_energy = energy(self._engine.k)
        self._observed: Observed | None = Observed()
        self._observers: Observers | None = None
        self._saved_observed: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        bodies = len(self.bodies)
        what = f"{self.broad_phase}, {bodies} {'body' if bodies == 1 else 'bodies'}, time {self.time!r}"
        ended = "" if self._fault is None else f", ended by {self._fault.partition(':')[0]}"
        return f"<Simulation: {what}, {self._engine.contacts} contacts{ended}>"

    @property
    def broad_phase(self) -> str:
        """Name of the broad phase."""
        return self._engine.composition.broad_phase

    @property
    def narrow_phases(self) -> tuple[str, ...]:
        """Names of the narrow phases."""
        return tuple(self._engine.composition.narrow_phases)

    @property
    def options(self) -> Mapping[str, Any]:
        """Options of the broad phase."""
        return self._engine.composition.options

    @property
    def cached(self) -> bool | None:
        """True if the loop's machine code is on the disk; None if nothing is compiled."""
        return is_cached(self._engine.loop)

    @property
    def compiled(self) -> bool:
        """True if the next events run in machine code, False if they run as Python."""
        return self._engine.runs_compiled or not self._engine.begins_as_python

    @property
    def keeps_contacts(self) -> bool:
        """True if ``contacts`` are kept, False if only their fingerprint is."""
        return self._engine.ledger.keeps

    @property
    def fault(self) -> str | None:
        """The error that ended the last run or step, in words; None if it ended well."""
        return self._fault

    def explain(self) -> dict[str, Any]:
        """Returns sentences about the model and its limits, with the numbers behind them."""
        return explanation(self._engine)

    # Running

    def compile(self) -> float:
        """Compiles the loop, or loads it from the disk cache; returns the CPU seconds spent on it so far."""
        self._engine.compile(wholly=self._engine.composition.compiled is not False)
        return self._engine.compile_seconds

    def build(self) -> None:
        """Builds the broad phase's structure, if necessary, and runs no event. Raises as ``run`` does."""
        if not self._engine.built:
            with _Alone(self, "be built", builds=True):
                self._engine.build()

    def rebuild(self) -> None:
        """Builds the broad phase's structure again at the present moment; contacts stay the same."""
        with _Alone(self, "be built again", builds=True):
            self._engine.lay_out(self._engine.speed)
            self._engine.build()

    @answering
    def run(  # in one piece: most of it documents its arguments
        self,
        until: float | None = None,
        *,
        max_contacts: int | None = None,
        max_events: int | None = None,
        progress: Callable[[Progress], None] | None = None,
        recorder: Recorder | RowFunction | None = None,
        stop_at: StopAt | None = None,
        on_contact: OnContact | None = None,
        on_part: OnContact | None = None,
        on_jam: Callable[[ZenoError], object] | None = None,
        observe: Sequence[str] | Observed = (),
        duration: float | None = None,
    ) -> Ended:
        """Runs until a time, or for a number of further contacts or events, whichever comes first; returns
        the reason of the end, which is true if the time was reached.

        Args:
            until: the end of the run, in the scene's time; all events up to and at it have then happened.
                None: the scene's own ``until``, if it has one. If a given time is the present one, the log
                ``kinetile`` says so once.
            max_contacts: stop after this many further contacts of discs and walls, at the time of the last
                one. Without ``until``, stop as well when nothing has happened for two million time units.
            max_events: stop after this many further events of all kinds, at the time of the last one.
            progress: called after each chunk (a fraction of a second); it may turn bodies.
            recorder: a function of the log rows of each chunk, before a fault is raised; or a ``Recorder``.
            stop_at: contacts to stop at, at their exact time (``StopAt``).
            on_contact: a function of one ``Event``, called right after each contact, in order, and when two
                bodies begin to pass through each other. Or functions by kinds: ``{"ball": f, ("bullet",
                "bottom"): g, ("coin", "*"): h}``, for two kinds, or for one and "wall" or a side; bodies are
                then in the order of the key. It may give commands, which happen at exactly that time; if it
                returns True, the run stops there. An error ends the run at that contact.
            on_part: the same for two bodies that end to pass through each other, also because one is removed.
            on_jam: a function of the error, called if bodies are jammed or squeezed. The run continues if the
                function gives a command, such as one that moves, turns or removes a body, unless the same
                bodies are jammed again at the same time.
            observe: observables to measure from here on, such as ``["pressure", "msd:every=0.1"]``; results
                are in ``observed``. To continue the measurements of the last run: ``observe=sim.observed``.
            duration: instead of ``until``: the time span to run, from the present time on.

        Raises:
            ZenoError: the bodies are jammed, or one is squeezed, and ``on_jam`` has not changed that.
            MissedContactError: a contact was missed or found too late.
            PhaseError: a phase broke the protocol.
            AuditError: an audit found a violation.
            BusyError: this simulation is running already.
            ValueError: ``until`` or ``duration`` is not finite, or in the past; an unknown kind is named.
            IndexError: ``stop_at`` names a body that is neither present nor to be inserted.
            TypeError: ``stop_at`` is no ``StopAt``, ``recorder`` or ``on_contact`` is no function; or
                ``stop_at`` is given together with ``on_contact`` or ``on_part``.
            UnknownName, BadOption, Refused: no observable has this name; it does not have these options; or
                it does not accept this scene.
        """
        with _Alone(self, "run", runs=True):
            engine = self._engine
            alone = until is not None and max_contacts is max_events is None  # the run goes to a given time
            until = arguments.read_until(engine, until, duration)
            end = arguments.read_end(engine, until, max_contacts, max_events)
            arguments.tell_of_late_commands(engine, end)
            idle = alone and self.scene.start < engine.time == end.until and not self._told
            here = engine.events if idle else None
            calls = read_calls(on_contact, on_part, self.scene.kinds)
            if calls is not None and stop_at is not None:
                raise TypeError("a run has stop_at or on_contact: a function of on_contact stops it by True")
            stop = arguments.read_stop(engine, self.scene, stop_at) if calls is None else calls.watched
            moment = Moment(self.scene, engine)
            observers = self._observers_for(observe)
            if observers:
                (observers.go_on if isinstance(observe, Observed) else observers.begin)(moment, engine, end)
            engine.compile()
            run_to = partial(self._run_to, calls, on_jam, progress and self._reporting(progress, end))
            self._running = end
            if observers:
                self._observers = observers
            if stop is not None:
                engine.watch(stop)
            try:
                read_by = observers.readers if observers else (None, None)
                with told(recorder, moment, engine.ledger), engine.ledger.recording(recorder, *read_by):
                    ended = observers.advance(end, run_to) if observers else run_to(end)
            except BaseException:
                with suppress(PhaseError):  # the error that ended the run is raised, not this one
                    self._observe(observers)
                raise
            finally:
                self._running = None
                if observers:
                    observers.leave()
                if stop is not None:
                    engine.watch(None)
            self._observe(observers)
            if here == engine.events:
                self._told = True
                what = "kinetile: until=%r is the present time: nothing is left to run. Expected a later one"
                logging.getLogger("kinetile").warning(what + ", or duration=", end.until)
            return ended

    def _reporting(self, progress: Callable[[Progress], None], end: End) -> Callable[[], None]:
        """Returns a function that reports the progress of a run that begins now."""
        engine, began = self._engine, self._engine.cpu_seconds

        def report() -> None:
            cpu, compiled = engine.cpu_seconds - began, not engine.as_python
            progress(Progress(self.time, end.until, engine.contacts, engine.events, cpu, compiled))

        return report

    def _run_to(
        self,
        calls: Callable[[Event], object] | None,
        on_jam: Callable[[ZenoError], object] | None,
        report: Callable[[], None] | None,
        end: End,
    ) -> Ended:
        """Runs to an end, past resolved jams, and past contacts whose function does not return True."""
        last: object = None
        while True:
            try:
                ended = advance(self._engine, end, self._audit, report)
            except ZenoError as jam:
                if on_jam is None or (jam.time, jam.bodies) == last:
                    raise
                last = jam.time, jam.bodies
                with Interruptible():
                    on_jam(jam)
                if self._engine.jammed:  # no command was given
                    raise
                continue
            event = self._with_kinds(ended.event)
            if event is None or calls is None:
                return Ended(ended.reason, event)
            with Interruptible():
                if calls(event):
                    return Ended("on_contact", event)

    @answering
    def step(self) -> Event | None:
        """Runs the next event, of any kind, and returns it. Returns None, and runs nothing, if no event is
        scheduled; and None two million time units later if none happens before. Raises as ``run`` does.

        Each row of ``contacts`` is one event. Passings that begin at the start, or begin or end together with
        a command, happen with it and are returned one by one; ``run`` skips passings that still wait.
        """
        with _Alone(self, "step", runs=True):
            return self._with_kinds(advance_one(self._engine, End()))

    @answering
    def steps(self, until: float | None = None) -> Iterator[Event]:
        """Runs event by event, as ``step`` does, and yields each after it has happened, up to and at a time;
        None: until the scene's own ``until``, or while there are events. Between two events the caller may
        read, turn or run the simulation. Raises as ``run`` does."""
        until = self.scene.settings.until if until is None else until
        end = End() if until is None else arguments.read_end(self._engine, until)
        arguments.tell_of_late_commands(self._engine, end)
        scene = self._engine.scene
        while True:
            with _Alone(self, "step", runs=True):
                if until is not None and self._engine.scene is not scene:  # by hand, which may set an end
                    arguments.read_end(self._engine, until)
                event = self._with_kinds(advance_one(self._engine, end))
            if event is None:
                return
            yield event

    @property
    def next_event(self) -> Event | None:
        """The event that ``step`` would run, as scheduled now, without an impulse yet; None if nothing is
        scheduled. It can change: a body that flies for more than a thousand time units without an event is
        anchored again meanwhile, with rounding; and if tables grow for an insertion, the new structure may
        have an event before it. Raises BusyError during a chunk of a run: to look ahead, the loop computes
        the first contact."""
        with _Alone(self, "look ahead"):
            event = next_event(self._engine)
            if event is not None and event.kind == "wall" and event.wall is None:
                wall = meetings.wall_of(self._query(), self._slot_of(event.bodies[0]))[1]
                event = event._replace(wall=WALLS[wall])
            return self._with_kinds(event)

    @property
    def passings(self) -> Integers:
        """The pairs of bodies that pass through each other now: (m, 2), each once, a < b, ascending."""
        found = passings_of(self._engine.k)
        begun = np.stack([found["a"], found["b"]], axis=-1).astype(np.int64)
        waiting = self._bodies_of(meetings.waiting(self._query()))  # until the first run
        return np.unique(np.sort(np.concatenate([begun, waiting])), axis=0)

    def audit(self) -> None:
        """Checks every invariant between two events, in O(n^2); AuditError at the first violation."""
        with _Alone(self, "be audited"):
            self._engine.audit()

    @answering
    def number(self, name: str) -> int:
        """Returns the number of a body named by the scene or by ``insert``; ValueError for another name."""
        if name not in self._names:
            meant = name_like(name, self._names)
            raise ValueError(f"no body of this scene is called {name!r}: expected {meant}")
        return self._names[name]

    @property
    def _names(self) -> dict[str, int]:
        """The numbers of bodies by their names."""
        return {**self.scene.numbers, **self._engine.history.names}

    # Commands: run at once, between two runs, between two steps, or from the ``progress`` of a run

    def set_velocity(self, body: int, velocity: Coordinates) -> None:
        """Gives a body a new velocity now, as ``set_velocities`` does."""
        self.set_velocities([body], cast("npt.ArrayLike", [velocity]))

    def set_velocities(self, bodies: npt.ArrayLike, velocities: npt.ArrayLike) -> None:
        """Gives bodies new velocities now, in the given order: (n,) numbers of bodies, and (n, 2) velocities
        or one for all; between two runs, between two steps, or from the ``progress`` of a run. If a body is
        given twice, its last velocity counts. A refused call leaves everything unchanged.

        Raises:
            IndexError: there is no such body, or it has been removed.
            ValueError: a velocity is not two finite numbers, or too fast for the clock.
            Refused: the broad phase does not accept bodies as fast as this.
            BusyError: a chunk of a run is under way: a recorder or another thread made the call.
        """
        with _Alone(self, "turn a body"):
            carry_out(self._engine, TURNED, arguments.read_turns(self._engine, bodies, velocities))

    def set_acceleration(self, body: int, acceleration: Coordinates) -> None:
        """As ``set_accelerations``, for one body."""
        self.set_accelerations([body], cast("npt.ArrayLike", [acceleration]))

    @answering
    def set_kind(self, body: int, kind: Kind) -> None:
        """Gives a body another of the scene's kinds from now on: this kind's responses apply.

        So bodies can pass a platform from below and meet it from above (docs/living-scenes.md). A refused
        call leaves everything unchanged.

        Raises:
            IndexError, BusyError: as ``set_velocities``.
            ValueError: the scene has no such kind.
            Refused: the body passes through one that it would meet with this kind (the error names it).
        """
        with _Alone(self, "give a body another kind"):
            carry_out(self._engine, OF_KIND, arguments.read_kind(self._engine, body, kind))

    @answering
    def set_position(self, body: int, position: Coordinates) -> None:
        """Moves a body now: it flies on from there with its velocity, as if it were removed and inserted at
        once with the same number. Its passings end, and so does its rest on other bodies.

        A refused call leaves everything unchanged.

        Raises:
            IndexError, BusyError: as ``set_velocities``.
            ValueError: a position is not two finite numbers.
            Refused: it would overlap a body or reach beyond a wall (the error names it, with the depth).
        """
        with _Alone(self, "move a body"):
            carry_out(self._engine, MOVED, arguments.read_move(self._engine, body, position))

    @answering
    def set_accelerations(self, bodies: npt.ArrayLike, accelerations: npt.ArrayLike) -> None:
        """Gives bodies other accelerations from now on, in the given order: (n,) numbers of bodies, and (n,
        2) accelerations or one for all. If a body is given twice, its last acceleration counts.

        Refused are accelerations along a periodic axis, of an immovable body, and, without an arena, after
        the scene's end. The first acceleration, and each that is larger than all before, prepares the phases
        again; the first compiles another loop. A refused call leaves everything unchanged.

        Raises:
            IndexError, BusyError: as ``set_velocities``.
            ValueError: an acceleration is not two such numbers, or too large for the clock.
            Refused: a narrow phase does not support accelerations, or the broad phase does not accept them.
        """
        with _Alone(self, "accelerate a body"):
            given = arguments.read_accelerations(self._engine, bodies, accelerations, self._goes_to)
            carry_out(self._engine, ACCELERATED, *given)

    @answering
    def insert(
        self,
        position: Coordinates,
        velocity: Coordinates = (0.0, 0.0),
        radius: float | None = None,
        mass: float = 1.0,
        kind: Kind | None = None,
        shape: Shape | int | None = None,
        acceleration: Coordinates | None = None,
        name: str | None = None,
        lifetime: float | None = None,
    ) -> int:
        """Inserts a disc now, or a body of a ``shape``, given as it is or by its number in the scene's table;
        returns its own number, which no other body of this run has or had.

        A shape that the scene's table does not list is added to it: the tables are made again, which takes
        longer. The body may touch other bodies and walls, and overlap bodies that it passes through. ``kind``
        is one of the scene's, by default the first; ``acceleration`` is by default gravity; ``name``, for
        ``number``, is unique. After a ``lifetime``, in the scene's time, the body is removed if it is still
        present. A refused call leaves everything unchanged.

        Raises:
            Refused: it would overlap a body or reach beyond a wall (the error names it, with the depth), or
                the broad phase does not accept a scene with it.
            ValueError: a scene would refuse a number, or the speed is too fast for the clock.
            TypeError: there is neither radius nor shape.
            BusyError: as ``set_velocities``.
        """
        if radius is None and shape is None:
            raise TypeError(
                "insert() needs the radius of the body that comes, or its shape: insert(position, radius=...)"
            )
        with _Alone(self, "take a body in"):
            engine, size = self._engine, cast("float", radius)
            own = position, velocity, size, mass, -1, None, kind, shape, acceleration
            insertion = Insert(0.0, *own, lifetime=lifetime)
            rows, scene = arguments.read_insertion(engine, insertion, self._goes_to)
            if name is not None:
                arguments.check_name(name, self._names)
            carry_out(engine, INSERTED, rows, scene)
            if name is not None:  # the history is new, and no snapshot has it yet
                engine.history.names = {**engine.history.names, name: int(rows["body"][0])}
        return int(rows["body"][0])

    @answering
    def insert_many(
        self,
        positions: npt.ArrayLike,
        velocities: npt.ArrayLike = (0.0, 0.0),
        radius: Radii = None,
        mass: npt.ArrayLike = 1.0,
        kind: Kind | Sequence[Kind] | None = None,
        shape: Shape | int | Sequence[Shape | int] | None = None,
        acceleration: Coordinates | None = None,
        lifetime: Radii = None,
    ) -> Inserted:
        """Inserts now all bodies that have room, one after the other, as ``insert`` does.

        (n, 2) positions; velocities, (n, 2), or one for all; one ``acceleration`` for all; the others one for
        all, or a sequence of n. A body without room is left out, and ``Inserted`` gives the reason; an
        earlier body of this call may be the reason. The broad phase's structure is built again at most once.
        A call that raises leaves everything unchanged.

        Raises:
            ValueError: a scene would refuse a number, or a speed is too fast for the clock; it names the
                body by its place in the call.
            Refused: the broad phase does not accept a scene with them.
            TypeError: there is neither radius nor shape.
            BusyError: as ``set_velocities``.
        """
        if radius is None and shape is None:
            raise TypeError("insert_many() needs the radius of the bodies that come, or their shapes")
        each = {"radius": radius, "mass": mass, "kind": kind, "shape": shape, "acceleration": acceleration}
        each["lifetime"] = lifetime
        with _Alone(self, "take bodies in"):
            engine, reasons = self._engine, dict[int, Exception]()
            rows, wider = arguments.read_insertions(engine, positions, velocities, each, self._goes_to)
            if not (engine.due or wider):
                reasons.update(insert_those_with_room(engine, rows))
            else:  # a command of the scene comes first, or there are new shapes or accelerations
                columns = [arguments.column(name, given, len(rows)) for name, given in each.items()]
                with unchanged_if(engine, Exception):  # a phase may refuse the tenth of them
                    for at, (row, *own) in enumerate(zip(rows, *columns, strict=True)):
                        try:
                            values = dict(zip(each, own, strict=True))
                            row["body"] = self.insert((row["x"], row["y"]), (row["vx"], row["vy"]), **values)
                        except NoRoom as error:
                            reasons[at] = error
            refused = np.zeros(len(rows), dtype=np.bool_)
            refused[[*reasons]] = True
            numbers = np.where(refused, NOBODY, rows["body"]).astype(np.int64)
            return Inserted(numbers, refused, reasons)

    def remove(self, body: int) -> None:
        """Removes a body now, with its events. Raises IndexError if it is not present, and BusyError."""
        with _Alone(self, "let a body go"):
            number = arguments.read_body(self._engine, body)
            carry_out(self._engine, REMOVED, command_rows(self._engine, REMOVED, body=number))

    def recorded(self) -> Scene:
        """Returns the scene with all interactive commands, each at its exact time, and the present moment as
        its exact end. It has the contacts of this run, under any phase. ValueError without kept commands."""
        engine = self._engine
        if not engine.history.kept:
            raise ValueError(
                "no commands are kept: this, or its snapshot's simulation, has keep_commands=False"
            )
        commands = engine.history.played(engine.scene, engine.clock)
        played = with_commands(engine.scene, commands, kinds=engine.scene.kinds)
        end = (*divmod(engine.total, TICKS), engine.met_now)
        origin = dict(played.origin, contacts=engine.contacts - engine.met_now)  # present ones may lack rows
        settings = replace(played.settings, until=engine.time, end=end)
        return relabelled(played, settings=settings, origin=origin)

    # Results

    @property
    def contacts(self) -> Rows:
        """All contacts so far, in canonical order (dtype ``kinetile.CONTACT``), read-only. Reading copies the
        contacts since the last reading. Raises ValueError if contacts are not kept."""
        return self._engine.ledger.contacts

    def contacts_since(self, count: int) -> Rows:
        """Returns the contacts after the first ``count``; ValueError if none are kept, or ``count`` < 0."""
        return self._engine.ledger.contacts_since(read_count(count, "count", "contacts"))

    @property
    def fingerprint(self) -> str:
        """Hex digest of the list of contacts (epoch, tick, a, b): equal under every broad phase."""
        return self._engine.ledger.fingerprint

    @property
    def state_fingerprint(self) -> str:
        """Hex digest of bodies, passings, clock and commands to come: equal under every broad phase. Runs of
        one scene with equal digests continue alike, whatever came before. Raises as ``snapshot``."""
        return self.snapshot().state_fingerprint

    @property
    def readings(self) -> Readings:
        """The instruments, now."""
        return readings_of(self._engine, self._start_energy)

    @property
    def observed(self) -> Observed:
        """The measurements of the last run with ``observe``: estimates by observable and quantity; after
        ``restore`` or ``resume``, those in the snapshot or file. Raises as ``run`` if an observable of a
        saved run is not installed here."""
        if self._observed is None:
            assert self._saved_observed is not None
            with no_simulation("what was observed in this saved run"):
                self._observers = Observers.of(self._saved_observed, self.scene)
            self._observed = self._observers.results()
        return self._observed

    @property
    def rows(self) -> int:
        """The number of log rows so far, as a recorder that is present from the start gets them."""
        return self._engine.ledger.rows

    # The structure of the broad phase

    @property
    def built(self) -> bool:
        """True if the broad phase's structure is built: reading it then compiles and builds nothing."""
        return self._engine.built

    @property
    def state(self) -> Any:
        """The broad phase's state, a NamedTuple of read-only arrays: its present structure."""
        self.build()
        return read_only(self._engine.state)

    @property
    def tables(self) -> Kernel:
        """The kernel's tables (``kinetile.kernel.tables``) now, read-only: bodies, certificates, queue."""
        self.build()
        return read_only(self._engine.k)

    def candidate_pairs(self) -> npt.NDArray[np.int32]:
        """Returns the present candidate pairs: (k, 2), a < b, sorted."""
        return pairs_of_named(self.near())

    def near(self) -> npt.NDArray[np.int32]:
        """Returns the near bodies of each body now: (k, 2), (a, b) if the broad phase names b as near a."""
        self.build()
        engine = self._engine
        return by_number(engine.k, named_near(engine.k, engine.composition, engine.packed[0]))

    def drawing(self) -> tuple[Item, ...]:
        """Returns the present structure of the broad phase as shapes of ``kinetile.plugin.drawing``; () if
        the phase draws nothing. They move with their bodies, and are valid until the next event. A pair of
        immovable bodies has no line, because the two never meet.

        Bodies have their numbers, and ``fails`` counts ticks since the start: ``divmod(fails, 2**52)`` is
        (epoch, tick), as for ``contacts`` and ``exact_time``. Raises PhaseError if the phase's ``draw`` is
        wrong, and BusyError while a chunk of a run is under way.
        """
        with _Alone(self, "be drawn"):
            self.build()
            engine = self._engine
            return drawn(engine.k, engine.composition, engine.clock)

    # Saving

    def snapshot(self) -> Snapshot:
        """Returns the complete state of this simulation, for ``restore``. Raises RecordError if a fault other
        than a jam has ended a run, BusyError while a chunk of a run is under way."""
        with _Alone(self, "be saved"):
            engine, of = self._engine, self._observers
            if not engine.can_go_on:
                raise RecordError(
                    "this simulation has ended with a fault and cannot go on, so it is not saved: an "
                    "earlier save can be resumed"
                )
            observed = self._saved_observed if of is None else of.state
            phases = SavedPhases.of(engine.composition)
            return Snapshot(self.scene, phases, Kept.of(engine), self._audit, self._start_energy, observed)

    @answering
    def restore(self, snapshot: Snapshot) -> None:
        """Continues from a snapshot of this simulation, or of another one of the same scene, as ``resume``
        does. Raises RecordError for a snapshot of another scene or of other narrow phases, Refused if the
        broad phase does not accept it, BusyError during a run; then nothing has changed."""
        with _Alone(self, "be restored"):
            if self._running:
                raise BusyError(
                    "this simulation is running: it cannot be restored from its own on_contact or progress"
                )
            self._go_on_from(snapshot)

    @answering
    def save(self, path: str | os.PathLike[str], note: Mapping[str, Any] | None = None) -> None:
        """Writes a file that ``kinetile.resume`` reads to continue this simulation, in any process. The file
        gets its name when it is completely on the disk; until then an old file of this name stays.

        ``note`` is any value for JSON; ``kinetile.run.saving.files.note`` reads it back. Raises RecordError
        if the file cannot be written, if it would replace a file of another kind, and as ``snapshot``.
        """
        write_whole(path, self.snapshot(), note)

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        make, given = self.__reduce__()
        return make(*given)  # else the snapshot would be copied as well

    def __reduce__(self) -> tuple[Any, ...]:
        return simulation_of, (self.snapshot(), None, None, self._engine.composition.compiled)

    # Within

    def _go_on_from(self, snapshot: Snapshot) -> None:
        kept, engine = snapshot.whole, self._engine
        if isinstance(kept, Kept) and kept.engine is engine:
            kept.go_back()
            engine.watch(None)
            engine.ledger.complete = True
        else:
            self._engine = resumed(snapshot, self.scene, engine.composition)
        self._audit, self._start_energy, self._fault = snapshot.audit, snapshot.start_energy, None
        self._observers, self._saved_observed = None, snapshot.observed
        self._observed = None if snapshot.observed else Observed()

    def _observers_for(self, observe: Sequence[str] | Observed) -> Observers | None:
        """Returns the observables of a run: new ones, or the last ones, which measure on; or None."""
        if not isinstance(observe, Observed):
            return None if isinstance(observe, tuple) and not observe else Observers(self.scene, observe)
        if observe is not self.observed:
            raise BadOption(
                "observe is the result of another run: expected observables by their names, or "
                "observe=sim.observed of this simulation, to continue its last measurements"
            )
        if not observe:
            raise BadOption(
                "observe=sim.observed continues the last observation, and there is none: expected "
                "observables by their names, such as observe=['pressure']"
            )
        return self._observers

    def _observe(self, observers: Observers | None) -> None:
        if observers:
            self._observers, self._observed = None, Observed()  # if there are no results, for an error
            self._observed = observers.results()
            self._observers = observers

    def _with_kinds(self, event: Event | None) -> Event | None:
        if event is None or self.scene.kinds == (0,):
            return event
        k = self._engine.k
        slots = [int(k.slots[body]) for body in event.bodies]
        if not len(k.rules) or min(slots, default=0) < 0:  # removed, or not yet inserted
            return event._replace(kinds=tuple(self.kinds_of(event.bodies).tolist()))
        numbers = np.asarray(k.traits)["kind"]
        return event._replace(kinds=tuple([self.scene.kinds[numbers[slot]] for slot in slots]))

    @property
    def _goes_to(self) -> float:
        """The end of the run that is under way, or the present time."""
        until = self._running.until if self._running else None
        return self.time if until is None else until


def composition_of(simulation: Simulation) -> Composition:
    """Returns the phases of a simulation, and their parts."""
    return simulation._engine.composition


@answering
def resume(
    path: str | os.PathLike[str],
    broad_phase: str | None = None,
    *,
    options: Mapping[str, Any] | None = None,
    compiled: bool | None = None,
) -> Simulation:
    """Returns the simulation that ``Simulation.save`` has written to a file; ``compiled``: as for it.

    It continues from the plans, the clock, the commands still to come and the contacts so far, under the same
    broad phase, or under ``broad_phase`` (with ``options`` for it), whose structure is built again: contacts
    are the same, bit for bit, but perhaps not the number of structural events. Raises RecordError, which
    names the fault of the file, and UnknownName, BadOption and Refused as ``Simulation``.
    """
    if broad_phase is None and options is not None:
        raise BadOption(
            "options are for a broad phase that goes on, and none is named: expected broad_phase="
        )
    name = os.fspath(path)
    snapshot = unpack(read_whole(path), name)
    with no_simulation(name):
        return simulation_of(snapshot, broad_phase, options, compiled)


def simulation_of(
    snapshot: Snapshot,
    broad_phase: str | None = None,
    options: Mapping[str, Any] | None = None,
    compiled: bool | None = None,
) -> Simulation:
    """Returns a new simulation that continues from a snapshot, under its or another broad phase."""
    phases = snapshot.phases
    simulation = Simulation(
        snapshot.scene,
        phases.broad_phase if broad_phase is None else broad_phase,
        narrow_phases=phases.narrow_phases,
        options=phases.options if broad_phase is None else options,
        live=snapshot.state.commands == CommandSupport.ALL,
        compiled=compiled,
    )
    simulation._go_on_from(snapshot)
    return simulation
