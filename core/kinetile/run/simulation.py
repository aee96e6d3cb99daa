"""``Simulation``, the public class: a scene and its phases by name, to be run, changed, read and saved. The
work is done by the engine, ``advance``, ``questions/`` and ``saving/``."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from types import TracebackType
from typing import Any, NamedTuple, NoReturn, Self, cast

import numpy as np
import numpy.typing as npt

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
from kinetile.kernel.images import FORESEEN
from kinetile.kernel.log import ACCELERATED, INSERTED, MOVED, OF_KIND, REMOVED, TURNED, WALLS
from kinetile.kernel.tables import JAMS, NOBODY, Kernel, read_only
from kinetile.plugin.drawing import Item
from kinetile.run import arguments
from kinetile.run.advance import End, Ended, Event, advance, advance_one, next_event
from kinetile.run.arguments import StopAt
from kinetile.run.callbacks import OnContact, read_calls
from kinetile.run.candidates import by_number, drawn, named_near, pairs_of_named
from kinetile.run.compose import Commands, Composition, Named, compose_phases
from kinetile.run.engine.contacts import RowFunction
from kinetile.run.engine.engine import Engine, Kept
from kinetile.run.engine.state import passings_of
from kinetile.run.interrupts import Interruptible, Unbroken
from kinetile.run.moment import Moment, Recorder, told
from kinetile.run.observing import Observers
from kinetile.run.prepared import Prepared
from kinetile.run.questions import meetings, places
from kinetile.run.questions.meetings import CastHit, NextContact
from kinetile.run.questions.places import Query, RayHit
from kinetile.run.readings import Readings, energy, readings_of
from kinetile.run.saving.files import no_simulation, read_whole, unpack, write_whole
from kinetile.run.saving.snapshot import SavedPhases, Snapshot, resumed
from kinetile.scene import Insert, Scene, relabelled, with_commands
from kinetile.scene.bodies import Numbers
from kinetile.scene.checks import WALL, read_count
from kinetile.scene.commands import name_like
from kinetile.scene.differences import core_difference
from kinetile.scene.responses import Kind
from kinetile.scene.scene import Radii
from kinetile.scene.shapes import Ints, Shape
from kinetile.scene.values import body_numbers
from kinetile.statistics import Observed

OfKinds = Kind | Iterable[Kind] | None
Placed = Numbers | tuple[float, float, Shape]

_RUNS = ("run", "step", "be built", "be built again")


class Progress(NamedTuple):
    """Progress of a run: ``time`` of ``until`` (or None); all contacts and events; its CPU seconds; whether
    its loop is compiled, or runs as Python."""

    time: float
    until: float | None
    contacts: int
    events: int
    cpu_seconds: float
    compiled: bool = True


class Inserted(NamedTuple):
    """What ``insert_many`` has done: (n,) the ``numbers`` of the bodies, -1 without room; which are
    ``refused``; and ``reasons``, by the place in the call: errors, whose text is made when it is read."""

    numbers: npt.NDArray[np.int64]
    refused: npt.NDArray[np.bool_]
    reasons: Mapping[int, Exception]


class _Alone(Unbroken):
    """A context in which no other thread or callback changes a simulation; BusyError where one does already.
    It is one step for signals, with places in it where a long one can be interrupted."""

    def __init__(self, simulation: Simulation, what: str) -> None:
        self._simulation, self._what = simulation, what

    def __enter__(self) -> Self:
        Unbroken.__enter__(self)  # super() takes longer
        simulation, what = self._simulation, self._what
        if not simulation._lock.acquire(False):
            self._refuse(f" in another thread: it cannot {what} meanwhile")
        if simulation._engine.busy or (simulation._running and what in ("run", "step")):
            simulation._lock.release()
            self._refuse(f": it cannot {what} from its own recorder, on_contact, progress or hooks")
        if what in ("run", "step", "be restored"):
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
        if error is not None and isinstance(error, FAULTS) and self._what in _RUNS:
            simulation._fault = f"{type(error).__name__}: {error}"
        simulation._lock.release()
        Unbroken.__exit__(self, kind, error, trace)


class Simulation(Moment):
    """Bodies in motion under a choice of phases.

    Args:
        broad_phase: its name, with options if needed (``sap-1d:axis=y``); None: the scene's, or the default.
        narrow_phases: names, with options if needed, or a mapping from names to options; None: the scene's,
            or those that it needs.
        options: options of the broad phase, over those in its name.
        keep_contacts: False to keep only their fingerprint, for runs of very many contacts.
        keep_commands: False to forget commands by hand that have run: saved games do not grow by them, and
            there is no ``recorded``.
        audit: check everything that must hold at intervals of this many contacts, and at the end of each run
            (slow: O(n^2) an audit); None: never.
        turning: True to compile turns into the loop though the scene has none, so that ``set_velocity`` need
            not compile it again.
        live: True for a program that gives all kinds of commands: they are compiled into the loop, and slots
            are free for inserted bodies, though the scene needs neither.
        room: with ``live`` or a scene whose bodies come and go, how many bodies can be present before slots
            are made for more: at least those of the scene; None: twice as many.
        compiled: True to compile the loop before the first event; False to run hooks as Python, for a
            debugger; None: a run of at most 1,100 bodies whose loop has not been compiled yet begins as
            Python at once, and goes over when another process has compiled it, or, where that cannot be (for
            hooks of ``__main__`` say), is compiled here after a second. Contacts are the same, bit for bit.

    Raises UnknownName, BadOption for an option that a phase does not have, and Refused.
    """

    # What it is

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
        prepared = Prepared.of(scene, room) if live or Commands.of(scene) == Commands.ALL else scene
        if scene.changing and not keep_commands:
            raise BadOption(
                "keep_commands=False is for scenes that plan no SetKind: expected set_kind by hand"
            )
        composition = compose_phases(prepared, broad_phase, narrow_phases, options)
        if not (compiled is None or isinstance(compiled, bool)):
            raise TypeError(f"compiled is {compiled!r}; expected True (first), False (never) or None")
        composition = replace(composition, compiled=compiled)
        commands = Commands.ALL if live else Commands.TURNS if turning else Commands.NONE
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
    def time_unit(self) -> float:
        """The power of two in which ``epoch`` and ``tick`` count, in the scene's time."""
        return self._engine.clock.unit

    @property
    def cached(self) -> bool | None:
        """Whether the loop's machine code lies on disk; None where nothing is compiled."""
        return is_cached(self._engine.loop)

    @property
    def compiled(self) -> bool:
        """Whether the next events run in machine code, and not as Python."""
        return self._engine.runs_compiled or not self._engine.begins_as_python

    @property
    def keeps_contacts(self) -> bool:
        """Whether ``contacts`` are kept, or only their fingerprint."""
        return self._engine.ledger.keeps

    @property
    def fault(self) -> str | None:
        """The error with which the last run or step ended, in words; None if it ended well."""
        return self._fault

    def explain(self) -> dict[str, Any]:
        """Returns what is modelled and what is left out, in sentences, with the numbers behind them."""
        return explanation(self._engine)

    # Running

    def compile(self) -> float:
        """Compiles the loop, or loads it from the disk cache; returns the CPU seconds spent on it so far."""
        self._engine.compile(wholly=self._engine.composition.compiled is not False)
        return self._engine.compile_seconds

    def build(self) -> None:
        """Builds the broad phase's structure, if necessary, and runs no event. Raises as ``run`` does."""
        if not self._engine.built:
            with _Alone(self, "be built"):
                self._engine.build()

    def rebuild(self) -> None:
        """Builds the broad phase's structure again at the present moment; no contact can change by it."""
        with _Alone(self, "be built again"):
            self._engine.lay_out(self._engine.speed)
            self._engine.build()

    @answering
    def run(  # in one piece: most of it says what its arguments are
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
        why it has ended, which is true where the time was reached.

        Args:
            until: the time to run to, in the scene's time; all events up to and at it have then happened.
                None: the scene's own ``until``, if it has one. Where nothing is left to run to a given time,
                the log ``kinetile`` says so once.
            max_contacts: stop after this many further contacts of discs and walls, at the time of the last
                one. Without ``until``, stop as well when nothing has happened for two million time units.
            max_events: stop after this many further events of all kinds, at the time of the last one.
            progress: called after each chunk (a fraction of a second); it may turn bodies.
            recorder: called with the log rows of each chunk, before a fault is raised; or a ``Recorder``.
            stop_at: contacts to stop at, at their exact time (``StopAt``).
            on_contact: a function that is called with each contact (``Event``) right after it, in order, and
                where two begin to pass through each other; or functions by kinds: ``{"ball": f, ("bullet",
                "bottom"): g, ("coin", "*"): h}``, of two kinds, or one and "wall" or a side; bodies are then
                in the order of the key. It may give commands, which happen at that very time; if it returns
                True the run stops there. An error ends the run at that contact.
            on_part: the same where two end to pass through each other, or one of them is removed.
            on_jam: a function that is called with the error where bodies are jammed or squeezed. The run goes
                on if it gives a command, such as one that moves, turns or removes a body; unless the same
                bodies are jammed again at the same time.
            observe: what to measure from here on, such as ``["pressure", "msd:every=0.1"]``; results are in
                ``observed``. To go on with what the last run has measured, that: ``observe=sim.observed``.
            duration: instead of ``until``: for how long to run from the present time on.

        Raises:
            ZenoError: the bodies are jammed, or one is squeezed, and ``on_jam`` has not changed that.
            MissedContactError: a contact was missed or found too late.
            PhaseError: a phase broke the protocol.
            AuditError: an audit found a violation.
            BusyError: this simulation is running already.
            ValueError: ``until`` or ``duration`` is not finite, or in the past; an unknown kind is named.
            IndexError: ``stop_at`` names a body that is neither present nor to be inserted.
            TypeError: ``stop_at`` is no ``StopAt``, ``recorder`` or ``on_contact`` no function; or both
                ``stop_at`` and ``on_contact`` or ``on_part`` are given.
            UnknownName, BadOption, Refused: there is no such observable, or not with these options or in this
                scene.
        """
        with _Alone(self, "run"):
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
        """Returns what reports the progress of a run that begins now."""
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
        """Runs to an end, past jams that commands resolve and contacts whose function does not stop it."""
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
                if self._engine.fields.fault.code[0] in JAMS:  # no command was given
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
        """Runs the next event, of any kind, and returns it; None, with nothing run, without one, and two
        million time units later if none happens before that. Raises as ``run`` does.

        Each row of ``contacts`` is one event. Passings that begin at the start, or begin or end together with
        a command, happen with it and are returned one by one; ``run`` goes past those that wait.
        """
        with _Alone(self, "step"):
            return self._with_kinds(advance_one(self._engine, End()))

    @answering
    def steps(self, until: float | None = None) -> Iterator[Event]:
        """Runs event by event, as ``step`` does, and yields each after it has happened, up to and at a time;
        None: the scene's own ``until``, or for as long as there are events. Between two events the caller may
        read, turn or run the simulation. Raises as ``run`` does."""
        until = self.scene.settings.until if until is None else until
        end = End() if until is None else arguments.read_end(self._engine, until)
        arguments.tell_of_late_commands(self._engine, end)
        scene = self._engine.scene
        while True:
            with _Alone(self, "step"):
                if until is not None and self._engine.scene is not scene:  # by hand, which may set an end
                    arguments.read_end(self._engine, until)
                event = self._with_kinds(advance_one(self._engine, end))
            if event is None:
                return
            yield event

    @property
    def next_event(self) -> Event | None:
        """The event that ``step`` would run, as scheduled now; None if nothing is scheduled. It can change: a
        body that flies for more than a thousand time units without an event is anchored again meanwhile, with
        rounding, and where tables grow for an insertion the new structure may have an event before it. Raises
        BusyError during a chunk of a run: to look ahead, the loop computes the first contact."""
        with _Alone(self, "look ahead"):
            event = next_event(self._engine)
            if event is not None and event.kind == "wall" and event.wall is None:
                wall = meetings.wall_of(self._query(), self._slot_of(event.bodies[0]))[1]
                event = event._replace(wall=WALLS[wall])
            return self._with_kinds(event)

    @property
    def passings(self) -> Ints:
        """The pairs of bodies that pass through each other now, (m, 2), each once, a < b, ascending."""
        found = passings_of(self._engine.k)
        begun = np.stack([found["a"], found["b"]], axis=-1).astype(np.int64)
        waiting = self._bodies_of(meetings.waiting(self._query()))  # until the first run
        return np.unique(np.sort(np.concatenate([begun, waiting])), axis=0)

    def audit(self) -> None:
        """Checks now all that must hold between two events, in O(n^2); AuditError is the first violation."""
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

    def set_velocity(self, body: int, velocity: Numbers) -> None:
        """Turns a body now: from here on it flies with this velocity. As ``set_velocities``."""
        self.set_velocities([body], cast("npt.ArrayLike", [velocity]))

    def set_velocities(self, bodies: npt.ArrayLike, velocities: npt.ArrayLike) -> None:
        """Turns bodies now, in the order given: (n,) their numbers, and (n, 2) velocities or one for all;
        between two runs, between two steps, or from the ``progress`` of a run. A body that is given twice
        has the last one. A refused call leaves everything unchanged.

        Raises:
            IndexError: there is no such body, or it has been removed.
            ValueError: a velocity is not two finite numbers, or too fast for the clock.
            Refused: the broad phase does not accept bodies as fast as this.
            BusyError: a chunk of a run is under way: this comes from a recorder, or from another thread.
        """
        with _Alone(self, "turn a body"):
            self._engine.carry_out(TURNED, arguments.read_turns(self._engine, bodies, velocities))

    def set_acceleration(self, body: int, acceleration: Numbers) -> None:
        """As ``set_accelerations``, for one body."""
        self.set_accelerations([body], cast("npt.ArrayLike", [acceleration]))

    @answering
    def set_kind(self, body: int, kind: Kind) -> None:
        """Gives a body another of the scene's kinds from now on: its contacts have the responses of that.

        With that a platform can be passed from below and met from above (docs/living-scenes.md). A refused
        call leaves everything unchanged.

        Raises:
            IndexError, BusyError: as ``set_velocities``.
            ValueError: the scene has no such kind.
            Refused: the body is passing through one that it would meet then (the error names it).
        """
        with _Alone(self, "give a body another kind"):
            self._engine.carry_out(OF_KIND, arguments.read_kind(self._engine, body, kind))

    @answering
    def set_position(self, body: int, position: Numbers) -> None:
        """Moves a body now: it is there from here on, and flies on with its velocity, as if it had been
        removed and inserted at once, with the same number: what it passes through or rests on ends.

        A refused call leaves everything unchanged.

        Raises:
            IndexError, BusyError: as ``set_velocities``.
            ValueError: a position is not two finite numbers.
            Refused: it would reach into a body or beyond a wall (the error names it, with the depth).
        """
        with _Alone(self, "move a body"):
            self._engine.carry_out(MOVED, arguments.read_move(self._engine, body, position))

    @answering
    def set_accelerations(self, bodies: npt.ArrayLike, accelerations: npt.ArrayLike) -> None:
        """Gives bodies other accelerations from now on, in the order given: (n,) their numbers, and (n, 2)
        accelerations or one for all. A body that is given twice has the last one.

        None is possible along a periodic axis, of an immovable body, or without an arena after the scene's
        end. The first one, or a larger one than any so far, prepares the phases again, and the first compiles
        another loop. A refused call leaves everything unchanged.

        Raises:
            IndexError, BusyError: as ``set_velocities``.
            ValueError: an acceleration is not two such numbers, or too large for the clock.
            Refused: a narrow phase does not know accelerations, or the broad phase does not accept them.
        """
        with _Alone(self, "accelerate a body"):
            given = arguments.read_accelerations(self._engine, bodies, accelerations, self._goes_to)
            self._engine.carry_out(ACCELERATED, *given)

    @answering
    def insert(
        self,
        position: Numbers,
        velocity: Numbers = (0.0, 0.0),
        radius: float | None = None,
        mass: float = 1.0,
        kind: Kind | None = None,
        shape: Shape | int | None = None,
        acceleration: Numbers | None = None,
        name: str | None = None,
        lifetime: float | None = None,
    ) -> int:
        """Inserts a disc now, or a body of a ``shape``, given as it is or by its number in the scene's table;
        returns its own number, which no other body of this run has or had.

        A shape that the scene's table does not list is added to it: the tables are made again, which takes
        longer. It may touch others and the walls, and overlap those that it passes through. ``kind`` is one
        of the scene's, by default the first; ``acceleration`` is by default that of gravity; ``name`` is for
        ``number``, and no other body has it. After a ``lifetime``, in the scene's time, it is removed, if it
        has not been before. A refused call leaves everything unchanged.

        Raises:
            Refused: it would reach into a body or beyond a wall (the error names it, with the depth), or
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
            engine.carry_out(INSERTED, rows, scene)
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
        acceleration: Numbers | None = None,
        lifetime: Radii = None,
    ) -> Inserted:
        """Inserts bodies now, one after the other, as ``insert`` does: those that have room.

        (n, 2) positions; velocities, (n, 2), or one for all; one ``acceleration`` for all; the others one for
        all, or a sequence of n. A body without room is left out, and ``Inserted`` says why; it may have none
        because of a body of this call. The structure of a broad phase is built again once at most. A call
        that raises leaves everything unchanged.

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
                reasons.update(engine.insert_those_with_room(rows))
            else:  # a command of the scene comes first, or there are new shapes or accelerations
                columns = [arguments.column(name, given, len(rows)) for name, given in each.items()]
                with engine.unchanged_if(Exception):  # of a phase that does not accept the tenth of them
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
            self._engine.carry_out(REMOVED, self._engine.command_rows(REMOVED, body=number))

    def recorded(self) -> Scene:
        """Returns the scene with all interactive commands, each at its exact time, and the present moment as
        its exact end: it has the contacts of this run, under any phase. ValueError if they are not kept."""
        engine = self._engine
        if not engine.history.kept:
            raise ValueError(
                "no commands are kept: this, or its snapshot's simulation, has keep_commands=False"
            )
        commands = engine.history.played(engine.scene, engine.clock)
        played = with_commands(engine.scene, commands, kinds=engine.scene.kinds)
        end = (*divmod(engine.clock.total(engine.now), TICKS), engine.met_now)
        origin = dict(played.origin, contacts=engine.contacts - engine.met_now)  # some of now may have no row
        settings = replace(played.settings, until=engine.time, end=end)
        return relabelled(played, settings=settings, origin=origin)

    # Results

    @property
    def contacts(self) -> npt.NDArray[np.void]:
        """All contacts so far, in canonical order (dtype ``kinetile.CONTACT``), read-only. Reading copies
        those since the last reading. Raises ValueError if none are kept."""
        return self._engine.ledger.contacts

    def contacts_since(self, count: int) -> npt.NDArray[np.void]:
        """Returns the contacts after the first ``count``; ValueError if none are kept, or below 0."""
        return self._engine.ledger.contacts_since(read_count(count, "count", "contacts"))

    @property
    def fingerprint(self) -> str:
        """Hex digest of the list of contacts (epoch, tick, a, b): equal under every broad phase."""
        return self._engine.ledger.fingerprint

    @property
    def state_fingerprint(self) -> str:
        """Hex digest of bodies, passings, clock and commands to come: equal under every broad phase. Where it
        is equal, runs of one scene go on alike, whatever came before. Raises as ``snapshot``."""
        return self.snapshot().state_fingerprint

    @property
    def readings(self) -> Readings:
        """The instruments, now."""
        return readings_of(self._engine, self._start_energy)

    @property
    def observed(self) -> Observed:
        """What the last run with ``observe`` has measured, before a snapshot or a file that this goes on from
        as well: estimates by observable and quantity. Raises as ``run`` where an observable of a saved run is
        not installed here."""
        if self._observed is None:
            assert self._saved_observed is not None
            with no_simulation("what was observed in this saved run"):
                self._observers = Observers.of(self._saved_observed, self.scene)
            self._observed = self._observers.results()
        return self._observed

    @property
    def rows(self) -> int:
        """The number of log rows so far: those of a recorder present from the start."""
        return self._engine.ledger.rows

    # The structure of the broad phase

    @property
    def built(self) -> bool:
        """Whether the broad phase's structure is built: then reading it compiles and builds nothing."""
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
        """Returns the candidate pairs now, (k, 2), a < b, sorted."""
        return pairs_of_named(self.near())

    def near(self) -> npt.NDArray[np.int32]:
        """Returns the near bodies of each body now, (k, 2): (a, b) if the broad phase names b as near a."""
        self.build()
        engine = self._engine
        return by_number(engine.k, named_near(engine.k, engine.composition, engine.packed[0]))

    def drawing(self) -> tuple[Item, ...]:
        """Returns the present structure of the broad phase as shapes of ``kinetile.plugin.drawing``; nothing
        if the phase draws nothing. They move with their bodies, and are valid until the next event. Two
        immovable bodies never meet, and have no line as a pair.

        Bodies have their numbers, and ``fails`` counts ticks since the start: ``divmod(fails, 2**52)`` is
        (epoch, tick), as for ``contacts`` and ``exact_time``. Raises PhaseError if the phase's ``draw`` is
        wrong, and BusyError while a chunk of a run is under way.
        """
        with _Alone(self, "be drawn"):
            self.build()
            engine = self._engine
            return drawn(engine.k, engine.composition, engine.clock)

    # Questions about the present moment
    #
    # A question changes nothing, and the answers are the same under every broad phase: they follow from the
    # flight plans at the present tick. ``kinds``, one of the scene's or several, excludes bodies
    # of other kinds as if they were absent.

    @answering
    def next_contact(self, a: int, b: int, *, scheduled: bool = False) -> NextContact | None:
        """Returns when two bodies meet by their present flight plans, the future row of ``contacts``, to the
        tick; None if they do not.

        Walls and third bodies are ignored. A pair that has just met does not meet again until one of the two
        has a new plan. For two that are passing through each other it is the row of the end, with a > b.
        It is sought for 1,024 units of the clock (``time_unit``) from the later of their last changes. Where
        axes are periodic it is for 1,000 from now, or until a body has crossed 4,096 periods for another one.

        ``scheduled``: only without interference: by the present plans it is the first contact of either body,
        walls included, and no command changes one of them before. Raises ValueError if a and b are one body.
        """
        one, other = self._slot_of(a), self._slot_of(b)
        if one == other:
            raise ValueError(f"a contact is one of two bodies; found body {a} twice")
        planned = self._planned() if scheduled else None
        among = np.array([other], dtype=np.int64)
        return meetings.next_contact_of(self._query(), one, planned, among, walls=False)

    @answering
    def next_contact_of(
        self, body: int, *, scheduled: bool = False, kinds: OfKinds = None
    ) -> NextContact | None:
        """Returns the first contact of a body, with another one or a wall, by the present flight plans; None
        if it has none, by then where axes are periodic (``next_contact``). The end of a passing is one too.
        Ties go as in the run.

        With ``scheduled`` None as well if something comes before: an earlier contact of either body, with a
        body of any kind, or a command that changes the plan of one of them. ``kinds``: only with these, and
        "wall" for the walls.
        """
        slot = self._slot_of(body)
        planned = self._planned() if scheduled else None
        among, walls = self._among_and_walls(kinds)
        return meetings.next_contact_of(self._query(), slot, planned, among.slots, walls or kinds is None)

    def cast(
        self,
        body: Placed,
        velocity: Numbers,
        *,
        acceleration: Numbers | None = None,
        kinds: OfKinds = None,
        exclude: npt.ArrayLike = (),
    ) -> CastHit | None:
        """Returns the body that one which starts here and now would meet first, by the present plans.

        To the tick, as if it were a body that has not met others yet. None if it meets none; walls are
        ignored, unless "wall" is one of the ``kinds``. It meets at once a body that it overlaps at the start,
        or touches there if they approach, and a wall if it goes on into it. Of several at one tick the first
        by number. It looks as far ahead as ``next_contact``, along a periodic axis through any image.

        Args:
            body: (x, y, radius), a disc, or (x, y, shape); a radius of 0 is a point, which passes through
                segments. Where axes are periodic it is narrower than a period.
            velocity: (vx, vy); so that it crosses at most 4,096 periods in 8 units of the clock.
            acceleration: (ax, ay), 0 along periodic axes; by default that of gravity.
            kinds: only bodies of these kinds.
            exclude: not these bodies, by numbers, such as the one from whose place it is cast.

        Raises ValueError for what is no such body, or no velocity.
        """
        horizon = float(FORESEEN // TICKS) * self.time_unit
        thrown = arguments.read_cast(body, velocity, acceleration, self.scene, horizon)
        query, walls = self._among_and_walls(kinds, exclude)
        hit = meetings.cast(query, *thrown, walls)
        return hit if hit is None or hit.body < 0 else hit._replace(body=self._body_of(hit.body))

    @answering
    def bodies_in(self, box: Placed | Shape, *, whole: bool = False, kinds: OfKinds = None) -> Ints:
        """Returns the bodies in a box now, (m,), ascending: those with a point in common with it, or with
        ``whole`` those in it as a whole, touching it from within at most; only of these ``kinds``.

        ``box`` is (left, bottom, right, top), edges included; it may be a line or a point. Or it is a shape,
        such as a polygon with corners in the scene's coordinates, or one at a place, (x, y, shape). A body
        has its outline, and is about its position in ``positions()``. All is computed in doubles. Raises
        ValueError for what is no box, or upside down.
        """
        around, area = arguments.read_area(box)
        return self._bodies_of(places.bodies_in(self._among(kinds), around, whole, area))

    def bodies_near(
        self,
        point: Numbers,
        *,
        radius: float | None = None,
        k: int | None = None,
        kinds: OfKinds = None,
    ) -> Ints:
        """Returns the bodies near a point now, (m,), the nearest first and equally near ones by number: all
        within a ``radius``, at most ``k``, or both; with ``kinds`` only bodies of these kinds.

        A body's distance is that of its outline, below 0 where the point is within. For a disc it is that to
        its place in ``positions()`` less its radius; for another shape that to its core, or within the core
        that to the outline of the core, negated, less its radius. All is computed in doubles. Raises
        ValueError where neither is given, or for what is no point, no length or no number of bodies.
        """
        if radius is None and k is None:
            raise ValueError("bodies_near needs to know how far or how many: radius=, k= or both")
        centre = arguments.read_point(point, "a point")
        length = None if radius is None else arguments.read_length(radius, "radius")
        count = None if k is None else read_count(k, "k")
        return self._bodies_of(places.bodies_near(self._among(kinds), centre, length, count))

    def ray(
        self,
        origin: Numbers,
        direction: Numbers,
        *,
        within: float | None = None,
        most: int | None = None,
        kinds: OfKinds = None,
        exclude: npt.ArrayLike = (),
    ) -> list[RayHit]:
        """Returns the bodies that a ray meets now, the nearest first and equally near ones by number.

        A body has its outline, and is about its position in ``positions()``: a grazing ray meets it, and one
        that begins in it or at its outline meets it at once. All is computed in doubles. Along a periodic
        axis a body has an image at every whole number of periods from that position; it is reported once,
        where the ray first enters one of them.

        Args:
            origin, direction: (x, y), where the ray begins, and where it leads, whose length does not matter.
            within: only bodies that are met not further than this, a length above 0 in the scene's unit.
                Needed where an axis is periodic, of which the ray may cross at most 4,096 periods.
            most: the largest number of hits; 1 is the fastest.
            kinds, exclude: only bodies of these kinds; not these bodies, as for ``cast``.

        Raises ValueError for values that are none of these, and for no ``within`` where it is needed.
        """
        start, towards = arguments.read_point(origin, "an origin"), arguments.read_direction(direction)
        length = arguments.read_within(within, self.scene, towards)
        count = None if most is None else read_count(most, "most")
        hits = places.ray(self._among(kinds, exclude), start, towards, count, length)
        return [hit._replace(body=self._body_of(hit.body)) for hit in hits]

    # Saving

    def snapshot(self) -> Snapshot:
        """Returns the complete state of this simulation, for ``restore``. Raises RecordError where a run has
        ended with a fault other than a jam, BusyError while a chunk of a run is under way."""
        with _Alone(self, "be saved"):
            engine, of = self._engine, self._observers
            if engine.broken is not None or engine.fields.fault.code[0] not in (0, *JAMS):
                raise RecordError(
                    "this simulation has ended with a fault and cannot go on, so it is not saved: what was "
                    "saved before it can be taken up"
                )
            observed = self._saved_observed if of is None else of.state
            phases = SavedPhases.of(engine.composition)
            return Snapshot(self.scene, phases, engine.kept(), self._audit, self._start_energy, observed)

    @answering
    def restore(self, snapshot: Snapshot) -> None:
        """Continues from a snapshot of this simulation, or of another one of the same scene, as ``resume``
        does. Raises RecordError for one of another scene or of other narrow phases, Refused if the broad
        phase does not accept it, BusyError while it runs; then nothing has changed."""
        with _Alone(self, "be restored"):
            if self._running:
                raise BusyError(
                    "this simulation is running: it cannot be restored from its own on_contact or progress"
                )
            self._go_on_from(snapshot)

    @answering
    def save(self, path: str | os.PathLike[str], note: Mapping[str, Any] | None = None) -> None:
        """Writes a file from which ``kinetile.resume`` makes this simulation again, in any process. It gets
        its name when it is completely on the disk; until then an old file of this name stays.

        ``note`` is any value for JSON; ``kinetile.run.saving.files.note`` reads it back. Raises RecordError
        if it cannot be written, if there is a file that is no saved simulation, and as ``snapshot``.
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
            engine.go_back(kept)
            engine.watch(None)
            engine.ledger.complete = True
        else:
            self._engine = resumed(snapshot, self.scene, engine.composition)
        self._audit, self._start_energy = snapshot.audit, snapshot.start_energy
        self._observers, self._saved_observed = None, snapshot.observed
        self._observed = None if snapshot.observed else Observed()

    def _observers_for(self, observe: Sequence[str] | Observed) -> Observers | None:
        """Returns the observables of a run, if any: new ones, or those with whose measurements it goes on."""
        if not isinstance(observe, Observed):
            return None if isinstance(observe, tuple) and not observe else Observers(self.scene, observe)
        if observe is not self.observed:
            raise BadOption(
                "observe has what another run has observed: expected observables by their names, or "
                "observe=sim.observed of this simulation, to go on with what it has measured last"
            )
        if not observe:
            raise BadOption(
                "observe=sim.observed goes on with what was observed last, and nothing was: expected "
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
        if not len(k.rules) or min(slots, default=0) < 0:  # gone, or still to come
            return event._replace(kinds=tuple(self.kinds_of(event.bodies).tolist()))
        numbers = np.asarray(k.traits)["kind"]
        return event._replace(kinds=tuple([self.scene.kinds[numbers[slot]] for slot in slots]))

    def _query(self) -> Query:
        engine = self._engine
        slots, shapes = engine.taken.astype(np.int64), engine.scene.shapes
        tables = engine.k, engine.packed[0]
        return Query(*tables, slots, engine.clock, engine.composition, shapes, engine.overlapping)

    def _among(self, kinds: OfKinds, exclude: npt.ArrayLike = ()) -> Query:
        return self._among_and_walls(kinds, exclude, ())[0]

    def _among_and_walls(
        self, kinds: OfKinds, exclude: npt.ArrayLike = (), more: tuple[Kind, ...] = (WALL,)
    ) -> tuple[Query, bool]:
        """Returns the bodies of some kinds, and whether the walls are among these, as ``more`` may be."""
        query = self._query()
        if out := [self._slot_of(body) for body in body_numbers(exclude).ravel().tolist()]:
            query = replace(query, slots=query.slots[~np.isin(query.slots, out)])
        if kinds is None:
            return query, False
        known = query.composition.prepared.kinds
        chosen = arguments.read_kinds(kinds, (*known, *more), "kinds")
        wanted = [number for number, kind in enumerate(known) if kind in chosen]
        few = query.slots if wanted else query.slots[:0]
        if len(query.k.rules):  # else there is one kind for all
            few = few[np.isin(query.k.traits.kind[few], wanted)]
        return replace(query, slots=few), WALL in chosen

    @property
    def _goes_to(self) -> float:
        """The time to which the run that is under way goes, or the present one."""
        until = self._running.until if self._running else None
        return self.time if until is None else until

    def _slot_of(self, body: int) -> int:
        return int(self._engine.k.slots[arguments.read_body(self._engine, body)])

    def _bodies_of(self, slots: Ints) -> Ints:
        return np.asarray(self._engine.k.queue["number"][slots].astype(np.int64))

    def _body_of(self, slot: int) -> int:
        return int(self._bodies_of(np.array([slot]))[0])

    def _planned(self) -> Mapping[int, int]:
        engine = self._engine
        return engine.agenda.first_of_each(engine.k, engine.clock)


def distance(a: Placed, b: Placed) -> float:
    """Returns the distance of two outlines, each (x, y, radius) or (x, y, shape), in doubles: 0 where they
    touch, below 0 how deep they overlap. Raises ValueError for what is no outline."""
    (here, one), (there, other) = (arguments.read_outline(each, "an outline") for each in (a, b))
    core = np.array([core_difference(one[0], other[0])], dtype=np.float64)
    return float(places.gaps_to(core, np.array(one[1] + other[1]), np.array([there]) - here)[0])


def composition_of(simulation: Simulation) -> Composition:
    """Returns the phases of a simulation and their parts."""
    return simulation._engine.composition


@answering
def resume(
    path: str | os.PathLike[str],
    broad_phase: str | None = None,
    *,
    options: Mapping[str, Any] | None = None,
    compiled: bool | None = None,
) -> Simulation:
    """Returns the simulation that ``Simulation.save`` has written to a file; ``compiled`` is as there.

    It continues from the plans, the clock, the commands still to come and the contacts so far, under the same
    broad phase, or under ``broad_phase`` (with ``options`` for it), whose structure is built again: contacts
    are the same, bit for bit, but perhaps not the number of structural events. Raises RecordError, which says
    what is wrong with the file, and UnknownName, BadOption and Refused as ``Simulation``.
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
    """Returns a new simulation that goes on from a snapshot, under its own phases or another broad phase."""
    phases = snapshot.phases
    simulation = Simulation(
        snapshot.scene,
        phases.broad_phase if broad_phase is None else broad_phase,
        narrow_phases=phases.narrow_phases,
        options=phases.options if broad_phase is None else options,
        live=snapshot.state.commands == Commands.ALL,
        compiled=compiled,
    )
    simulation._go_on_from(snapshot)
    return simulation
