"""The engine: the Python side of the kernel, which works between two chunks of the compiled loop.

``layout`` and ``bounds`` return tables and bounds for it. The layer above has commands by hand (``by_hand``),
spans of the clock (``spans``), and the return to a snapshot (``kept``).

There is one way to make a structure: build it at the present moment (``lay_out``), as at the start. This
happens if a run continues from a saved state (``RunState``), pairs outgrow their table, a command adds more
energy than the skin allows for, bodies without walls fly far, or a body is inserted without a slot. It costs
time, and cannot change an answer (docs/one-answer.md).
"""

import math
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Integers, Rows
from kinetile.errors import PhaseError, Refused, ZenoError
from kinetile.kernel.chords import as_seen, lay_all
from kinetile.kernel.clock import Clock
from kinetile.kernel.compiled import (
    NOTHING_IS_COMPILED,
    NotCompiled,
    bound,
    compose,
    default,
    is_cached,
    make_ready,
    python_of,
)
from kinetile.kernel.flight import positions_now
from kinetile.kernel.loop import (
    BLOCKED,
    BUDGET_SPENT,
    COMMAND_DUE,
    CROWDED,
    FASTER,
    FAULT,
    LOG_FULL,
    NO_ROOM,
    TIME_REACHED,
    WATCHED,
)
from kinetile.kernel.loop.bookkeeping import log_is_full
from kinetile.kernel.loop.responses import begin_at_start
from kinetile.kernel.passings import MOST_IMAGES
from kinetile.kernel.skin import Skin, too_thick
from kinetile.kernel.tables import (
    JAMS,
    NEVER,
    NOBODY,
    OFFER,
    Kernel,
    clear,
    pair_set,
    read_only,
    record_table,
)
from kinetile.plugin.calling import calling, place_of
from kinetile.plugin.registry import sentence
from kinetile.run.audit import check_all
from kinetile.run.compose import CommandSupport, Composition
from kinetile.run.engine import layout
from kinetile.run.engine.bounds import MOST_FLOWN, Bounds
from kinetile.run.engine.commands import COMMAND_ROWS, Agenda, Command, to_the_front
from kinetile.run.engine.failures import blocked, failure
from kinetile.run.engine.fields import Tables, all_ticks
from kinetile.run.engine.ledger import Ledger
from kinetile.run.engine.meanwhile import NO_PROCESS, compile_meanwhile
from kinetile.run.engine.state import RunState, numbers_of
from kinetile.run.interrupts import Interruptible, let_signals_through
from kinetile.run.prepared import widened
from kinetile.scene import Scene
from kinetile.toolbox.reach import SPANS, chord_speed, drop_of, extent_of, margin_of

UNLIMITED = 2**62
NONE_BEHIND = 2**62
"""The value of ``_behind`` unless the scene's own commands run, one at a time."""

MOST_UNITS = 2**62
"""Units of the clock that a run with bodies can have: contacts have them in 64 bits."""

_ACTED_ON = {FAULT, BLOCKED, NO_ROOM, LOG_FULL, FASTER, CROWDED, COMMAND_DUE}
"""The reasons of the loop that the engine acts on; the other reasons are ends that a run has requested."""

CHUNK_SECONDS = 0.2
FIRST_BUDGET, FIRST_AS_PYTHON = 1 << 12, 1 << 6

UNNOTICED = 0.2
"""After so many CPU seconds as Python, another process begins to compile the loop."""


class WatchedContacts(NamedTuple):
    """Contacts to stop at, or ``before`` them: of ``kinds``, flags (kinds, kinds + 1) with walls in the last
    column; of bodies with ``flags``, by their numbers; and of ``pairs`` of numbers."""

    kinds: npt.NDArray[np.uint8]
    flags: Mapping[int, int] = {}
    pairs: Sequence[tuple[int, int]] = ()
    before: bool = False


class Engine(Tables):
    """Tables, clock, agenda and loop of one simulation.

    Attributes:
        scene: the scene, with the shapes and the accelerations that were added by hand.
        bounds: limits that no body exceeds, and the skin that follows from them.
        commands, history: the commands that the loop supports, and the interactive ones so far.
        numbers: the number of body numbers in use, also of bodies that the scene will insert.
        cpu_seconds, compile_seconds: processor time in the loop, and for compiling or loading it.
        python_seconds, python_events, python_contacts: the part of these, and of the run, as Python.
        audits: number of audits without a violation.
        busy: a chunk is under way, including the transfer of its log.
        broken: the error that keeps this engine from continuing, or None.
        passed: the number of moves of the clock's base, by a span or many.
        overlapping: (m, 2) the pairs that overlap at the start and have not begun to pass yet.
    """

    def __init__(
        self,
        scene: Scene,
        composition: Composition,
        keep_contacts: bool = True,
        commands: CommandSupport = CommandSupport.NONE,
        state: RunState | None = None,
        keep_commands: bool = True,
    ) -> None:
        """An engine of a scene, at its start or in a ``state``; the composition is prepared for it."""
        self.scene = scene if state is None else widened(scene, state.shapes, state.pull)
        self._listed = len(scene.shapes)
        self.composition = composition
        self.state = composition.broad.state
        self.clock = Clock(scene.start, scene.time_unit)
        if state is None:
            state = RunState.at_start(scene, self.clock, keep_contacts, keep_commands)
        self.clock.base = state.base
        self.ledger = Ledger(self.clock, state.entries)
        self.agenda = Agenda(state.later)
        self.history = state.history
        self.bounds = state.bounds
        self.commands = max(commands, state.commands)
        self.loop = composition.loop(self.commands)
        self.cpu_seconds, self.compile_seconds = state.cpu_seconds, state.compile_seconds
        self.python_seconds, self.python_events = state.python_seconds, state.python_events
        self.python_contacts = state.python_contacts
        self.audits = state.audits
        self.passed = 0
        self.busy = False
        self.broken: Exception | None = None
        self.walled = scene.arena is not None and composition.wall is not None
        self.bounded = self.walled or scene.periodic == "xy"
        self.numbers = numbers_of(scene, self.history)
        self.fall_bounds = drop_of(self.scene), chord_speed(self.scene)
        self._requested = state.requested
        self.is_ready = False
        self._behind = NONE_BEHIND
        self._budget = FIRST_BUDGET
        self.overlapping = state.overlapping
        tables = layout.tables_of(state.contents, self.numbers, composition, self.clock.unit)
        self.k = self.agenda.load(tables, self.clock)
        self.lay_out(self.speed)

    @property
    def time(self) -> float:
        """The present time, in the scene's time: the requested time, if the run has ended there."""
        return self._requested if self._requested is not None else self.clock.time(self.now)

    @property
    def total(self) -> int:
        """Ticks since the start."""
        return self.clock.total(self.now)

    @property
    def jammed(self) -> bool:
        """True if it has ended with a jam; a command may resolve it."""
        return self.fields.fault.code[0] in JAMS

    @property
    def can_go_on(self) -> bool:
        """True if no fault other than a jam has ended it."""
        return self.broken is None and (self.jammed or not self.fields.fault.code[0])

    @property
    def speed(self) -> float:
        """A speed that no body exceeds."""
        return self.bounds.speed

    @property
    def next_command(self) -> Command | None:
        """The first command still to come, of the scene or interactive."""
        return self.agenda.next(self.k, self.clock)

    # Running

    @property
    def runs_compiled(self) -> bool:
        """True if the loop is machine code already."""
        return self.is_ready and not self.as_python

    def compile(self, wholly: bool = False) -> None:
        """Compiles the loop, or loads it from the disk cache, and the search for room if a run may need it.
        If the run begins as Python, it compiles nothing unless ``wholly``."""
        if self.runs_compiled:
            return
        loop = self.loop
        may_start = self._wanted is None and not (wholly or loop.stays) and loop.spent > UNNOTICED
        # Looked up last: another thread may have started a process by now.
        if may_start and not is_cached(loop) and loop.meanwhile is None:
            loop.meanwhile = NO_PROCESS
            loop.meanwhile = compile_meanwhile(loop, self.composition, self.commands)
        if NOTHING_IS_COMPILED or (not wholly and self.begins_as_python):
            if not self.is_ready:
                self._use_hooks(as_python=True)
            return
        self._use_hooks(as_python=False)
        began = time.thread_time()
        try:
            self._make_ready()
            self.is_ready = True
        except NotCompiled as error:
            message = f"the hooks of {self.composition.author_of(str(error))} do not compile: {error}"
            if wholly or self._wanted:
                raise PhaseError(message) from error
            loop.stay(message)
            self._use_hooks(as_python=True)
        self.compile_seconds += time.thread_time() - began

    def _use_hooks(self, as_python: bool) -> None:
        self.is_ready, self.as_python, self._enter, self._search = as_python, as_python, None, None
        self._budget = FIRST_AS_PYTHON if as_python else FIRST_BUDGET

    @property
    def begins_as_python(self) -> bool:
        """True if the next events run as Python."""
        wanted = self._wanted
        if wanted is None:
            return not self.loop.is_worth(self.packed)
        return NOTHING_IS_COMPILED or not wanted

    @property
    def _wanted(self) -> bool | None:
        own = self.composition.compiled
        return default() if own is None else own

    def _make_ready(self) -> None:
        with Interruptible():
            if self.commands == CommandSupport.ALL:  # first: a run switches once its loop is on the disk
                found = np.zeros(0, dtype=np.int64)
                make_ready(self.composition.find_room, self.packed[0], np.zeros(0, COMMAND_ROWS), found)
            make_ready(self.loop, *self.packed, 0, 0, 0, 0)

    def chunk(self, until: int, contacts: int, most: int = UNLIMITED, quota: int = UNLIMITED) -> int:
        """Runs one chunk of the loop, takes over its log, acts on its reason, and returns the reason.

        ``contacts`` is the largest total number of contacts, ``most`` the largest number of events now,
        ``quota`` the largest number of contacts at tick ``until``. No signal interrupts between the loop and
        its log (``Unbroken``). Raises ZenoError, MissedContactError or PhaseError for a fault.
        """
        if self.as_python or not self.is_ready:
            self.compile()
        self._demand_whole()
        self.busy = True
        try:
            fields, rows = self.fields, 0
            if self.jammed and self.due:
                fields.fault.code[0] = 0  # a command may end the jam
            if self.ledger.reads:
                if len(self.k.log) < len(self.k.met):  # with passings, more bodies need more room
                    self.k = self.k._replace(log=layout.with_room(self.k.log, len(self.k.met)))
                rows = len(self.k.log)
            fields.lists.rows[0] = rows
            if len(self.overlapping):
                self._begin_passings()
                self._take_over(self.now)
                return BUDGET_SPENT
            return self._respond(self._run_loop(until, contacts, most, quota))
        finally:
            self.busy = False

    def _run_loop(self, until: int, contacts: int, most: int, quota: int) -> int:
        """Runs the loop for a budget, adapted to ``CHUNK_SECONDS``, of events; returns its reason."""
        began = time.thread_time()
        budget = most if most < self._budget else self._budget
        before, heads = self.fields.now[0], layout.steps(self.count)
        had = (self.events, self.contacts) if self.as_python else (0, 0)
        try:
            reason = int(self.enter(until, budget, contacts, quota))
        except Exception as error:  # a hook that raises, or one that leaves its arrays, as Python
            where = place_of(error)
            text = f"a hook of {self.composition.author_of(where)} raised {sentence(error)}{where}"
            self.broken = PhaseError(f"at time {self.clock.time(self.now)!r} {text}")
            self._take_over(before)
            if type(error).__name__ == "BdbQuit":  # its user has left the debugger
                raise
            raise self.broken from error
        took = time.thread_time() - began
        self.cpu_seconds += took
        if self.as_python:
            self.python_seconds += took
            self.python_events += self.events - had[0]
            self.python_contacts += self.contacts - had[1]
        self._take_over(before)
        self._demand_rules()
        went = self.fields.now[0] - before
        if went > 0:
            layout.fit(self.k, self.fields, went, layout.steps(self.count) - heads)
        if reason == BUDGET_SPENT and budget == self._budget and took < CHUNK_SECONDS / 2:
            self._budget *= 2
        elif took > 2 * CHUNK_SECONDS:
            self._budget = max(self._budget // 2, FIRST_AS_PYTHON if self.as_python else FIRST_BUDGET)
        return reason

    def _respond(self, reason: int) -> int:
        """Acts on the reason of the loop's stop; returns a reason for the caller: BUDGET_SPENT after a chunk
        that only made room, COMMAND_DUE if it made room for a command that has not run yet."""
        if reason not in _ACTED_ON:
            return reason
        if reason == FAULT:
            raise failure(self.k, self.composition, self.clock.time(self.now))
        if reason == BLOCKED:
            command = self.k.commands.view(np.ndarray)[self.fields.lists.command[0]]
            raise blocked(self.k, self.clock, command.copy(), int(self.fields.fault.b[0]))
        watched = self.fields.stops.due[0]  # an event that needs room or skin may be one to stop at, too
        if reason == NO_ROOM:
            self._grow_pairs()
        elif reason == FASTER:
            self._widen_skin()
        elif reason == CROWDED:
            room = 2 * int(self.k.clock[0].lists.passings) + MOST_IMAGES * len(self.k.bodies) + 64
            self.k = layout.more_passings(self.k, room)
            return COMMAND_DUE
        elif reason == COMMAND_DUE:
            before = self.now
            if self._make_slot():
                return COMMAND_DUE
            self._take_over(before)  # passings that the command began or ended: they count already
            watched = self.fields.stops.due[0]
        self.fields.stops.due[0] = 0
        return WATCHED if watched else BUDGET_SPENT

    def _demand_rules(self) -> None:
        """Raises PhaseError if a response has written into its rule: saved runs do not contain rules."""
        rules = self.composition.rules
        if rules is not None and rules.foreign and self.k.rules.tobytes() != rules.table.tobytes():
            changed = (np.asarray(self.k.rules) != np.asarray(rules.table)).tolist().index(True)
            row, column = divmod(changed, rules.kinds + 1)
            who = rules.named(self.composition.prepared.meets[row][column].name)
            self.broken = PhaseError(f"{who} has written into its rule: expected a hook that only reads it")
            raise self.broken

    def _demand_whole(self) -> None:
        if self.broken is not None:
            raise PhaseError(f"this simulation cannot go on: {self.broken}") from self.broken

    def _take_over(self, before: int) -> None:
        if self.fields.now[0] != before:
            self._requested = None
        self.ledger.take(self.k, self.fields, self.count.logged[0])

    def arrive(self, until: float | None) -> None:
        """Sets the end of a run: ``time`` is now the requested time, until the next event."""
        self._requested = until

    def watch(self, stop: WatchedContacts | None) -> None:
        """Sets the contacts that stop the loop; None: it does not stop."""
        self.fields.stops.watching[0] = stop is not None
        if stop is None:
            return
        k, sizes = self.k, (len(self.k.slots), stop.kinds.size, len(stop.pairs))
        if sizes != (len(k.watch), len(k.watched_kinds), len(k.watched)):  # the tables are packed again
            watch, kinds = (np.zeros(size, np.uint8) for size in sizes[:2])
            k = k._replace(watch=watch, watched_kinds=kinds, watched=record_table(OFFER, sizes[2]))
            self.k = k
        k.watched_kinds[:], k.watch[:] = stop.kinds.reshape(-1), 0
        for number, flags in stop.flags.items():
            k.watch[number] = flags
        for row, (a, b) in zip(k.watched, stop.pairs, strict=True):
            row.a, row.b = a, b
        self.fields.stops.before[0] = stop.before

    def audit(self) -> None:
        """Checks every invariant between two events; AuditError or UnawaitedContactError at a violation."""
        self.build()
        skin = self.bounds.skin.delta
        with Interruptible():
            taken = self.k, self.packed[0]
            check_all(*taken, self.composition, skin, self.clock.time(self.now), self.events)
        self.audits += 1

    # The structure

    @property
    def built(self) -> bool:
        """True if structure and calendar are built, with all requested pairs."""
        fields = self.fields
        return bool(fields.built[0] and fields.calendar.filed[0] and not fields.lists.wanted[0])

    def build(self) -> None:
        """Builds the structure, if necessary, and runs no event."""
        while not self.built:
            let_signals_through()
            self.chunk(self.now - 1, UNLIMITED)

    def lay_out(self, speed: float) -> None:
        """Enlarges the bodies for this speed and arranges the present structure; the loop builds it next.
        Raises Refused, with nothing changed, if the broad phase does not accept the skin."""
        if self.k.clock[0].present != self.k.clock[0].bodies:  # some slots are empty
            before = self.bounds
            self.bounds = before._replace(speed=speed)
            try:
                self.renew()
            except Refused:
                self.bounds = before
                raise
            return
        k = self.k
        clock = k.clock[0]
        self.bounds = self.bounds_for(speed)
        layout.set_limits(k, self.bounds, self.composition)
        if self.scene.accelerated:
            lay_all(k, self.bounds.skin.delta, float(clock.limits.margin))
        if clock.calendar.shift == 0:
            clock.calendar.shift = layout.first_shift(k, self.bounds.extent)
        clear(k)
        if len(k.bodies):  # without bodies, only the base has moved on
            clock.epoch = self.clock.base
        if self.composition.broad.arrange is not None:
            there, only = int(clock.bodies), read_only(as_seen(k))
            bodies = as_seen(k)._replace(bodies=only.bodies[:there], mass=only.mass[:there])
            try:
                with calling("broad phase", self.composition.broad_phase, "arrange"):
                    self.composition.broad.arrange(bodies, self.state)
            except Exception as error:
                self.broken = error
                raise

    def bounds_for(self, speed: float) -> Bounds:
        """Returns the bounds with this speed; Refused if the broad phase does not accept their skin."""
        extent = self.reach_of_flight(speed, SPANS if len(self.k.bodies) else 0)
        if not self.bounded:
            extent = max(self.bounds.extent, extent)
        limit = self.composition.broad.skin_limit
        margin = margin_of(self.composition.prepared, limit)
        skin = Skin.of(len(self.k.bodies), extent, speed, float(self.k.clock[0].per_tick), margin)
        if limit is not None and skin.delta > limit:
            raise too_thick(self.composition.broad_phase, skin.delta, limit)
        return self.bounds._replace(speed=speed, extent=extent, skin=skin)

    def reach_of_flight(self, speed: float, spans: int) -> float:
        """Returns the largest distance of a body from the origin, at this speed, within some spans."""
        far = np.abs(positions_now(self.k)).max(axis=0, initial=0.0)
        return extent_of(self.scene, self.walled, speed, far, spans)

    def _grow_pairs(self) -> None:
        self.bounds_for(self.speed)  # a refusal must come before the tables change
        lists = self.k.clock[0].lists
        room = max(2 * len(self.k.pairs), int(1.25 * (int(lists.pairs) + int(lists.wanted))))
        self.k = pair_set(self.k, room)
        self.lay_out(self.speed)

    def _widen_skin(self) -> None:
        """Lays the tables out for bodies that a response has made faster than the bound. PhaseError for an
        impossible velocity, Refused if the broad phase does not accept the skin."""
        k = self.k
        there = np.flatnonzero(k.queue.number >= 0)
        speed = np.hypot(k.bodies.vx[there], k.bodies.vy[there])
        most = float(speed.max(initial=0.0))
        if not most * float(k.clock[0].per_tick) <= MOST_FLOWN * self.bounds.smallest:
            rules = self.composition.rules
            body = int(k.queue.number[there[int(np.argmax(np.where(np.isnan(speed), math.inf, speed)))]])
            raise PhaseError(
                f"at time {self.time!r} {rules.named() if rules else 'a response'} left body {body} with a "
                f"speed of {most:.3g}, at which it would fly too far in one tick of this scene's clock: so "
                "ends one that adds energy at each contact; have it add less, or to slow bodies alone"
            )
        self.lay_out(2.0 * max(most, self.speed))

    def _begin_passings(self) -> None:
        k, pair = self.k, self.composition.pair
        rows = min(len(k.met), len(k.log) or len(k.met)) // MOST_IMAGES
        now, self.overlapping = self.overlapping[:rows], self.overlapping[rows:]
        if pair is None or not self.composition.passing:
            return
        begun = int(k.clock[0].lists.passings)
        self.k = layout.more_passings(k, begun + MOST_IMAGES * len(now) + len(k.bodies))
        compose(begin_at_start, self.composition.parts(), "begin", Kernel)(self.k, now)
        self.k.clock[0].stops.due = 0  # ``advance`` looks among them for a watched one

    # Phases prepared again

    def renew(self) -> None:
        """Prepares the phases for the present bodies, and lays the tables out for them. Raises Refused, with
        nothing changed, if a phase refuses."""
        self._go_on_with(layout.renewed(self.k, self.scene, self.composition))

    def _go_on_with(self, new: layout.Renewed) -> None:
        was = self.composition, self.k, self.state, self.loop, self.is_ready
        self.composition, self.k, self.state = new.composition, new.k, new.composition.broad.state
        self._take_loop(self.commands)
        try:
            self.lay_out(self.speed)
        except Refused:  # because of the skin: the previous tables are unchanged
            self.composition, self.k, self.state, self.loop, self.is_ready = was
            raise

    def _take_loop(self, commands: CommandSupport) -> None:
        loop = self.composition.loop(commands)
        self.is_ready = self.is_ready and loop is self.loop
        self.commands, self.loop = commands, loop

    def _make_slot(self) -> bool:
        """Prepares the phases again for an insertion or removal; returns True if that has still to run."""
        k, composition = self.k, self.composition
        first, many = int(k.clock[0].lists.command), max(self._waiting - self._behind, 1)
        if composition.living:
            before, coming = self.now, k.commands[first : first + many]
            self._go_on_with(layout.renewed(k, self.scene, composition, coming))
            if self.now > before:
                self._requested = None  # the tables are at the tick of the command
        else:
            if composition.passing or python_of(log_is_full)(k, many):
                many = 1
            self._go_on_with(layout.carried_out(k, self.scene, composition, many))
        return composition.living

    def make_numbers(self, numbers: int) -> None:
        """Makes room for so many numbers of bodies."""
        if numbers > len(self.k.slots):
            more, watch = (0, numbers + 64), self.k.watch
            self.k = self.k._replace(slots=np.pad(self.k.slots, more, constant_values=NOBODY))
            if len(watch):
                self.k = self.k._replace(watch=np.pad(watch, more))

    def allow(self, commands: CommandSupport) -> None:
        """Takes a loop with these commands, and free slots if they may insert bodies."""
        if commands > self.commands:
            self._take_loop(commands)
            if commands == CommandSupport.ALL and self.composition.living:
                self._go_on_with(layout.renewed(self.k, self.scene, self.composition, roomy=True))

    # Commands by hand (``by_hand``)

    def demand_a_run(self) -> None:
        """Raises the error that has ended the run, unless a command may resolve it."""
        self._demand_whole()
        if not self.can_go_on:
            raise failure(self.k, self.composition, self.clock.time(self.now))

    def widen(self, scene: Scene) -> None:
        """Continues in a scene with more shapes, or larger accelerations."""
        self.scene, self.fall_bounds = scene, (drop_of(scene), chord_speed(scene))
        self.bounds = self.bounds._replace(squares=math.inf)
        self.renew()

    def fit(self, bounds: Bounds, commands: CommandSupport, speed: float | None) -> None:
        """Takes these bounds and a loop with these commands, ready to run; lays the tables out for a speed,
        unless it is None."""
        self.bounds = bounds
        self.allow(commands)
        self.compile()
        if speed is not None:
            self.lay_out(speed)

    def run_first(self, rows: Rows) -> None:
        """Runs these commands now, before any contact; after the scene's commands of this moment, but before
        a scene's insertion that waits for room. Raises Refused for the first of these without room."""
        self.ledger.holds_rows = True
        try:
            if self.due:
                with suppress(Refused):  # an insertion without room
                    self._run_commands()
                rows["after"], rows["overtakes"] = self.met_now, self.due
            self._behind = self._waiting
            to_the_front(self, rows)
            self._run_commands()
        except Refused:
            refused = self._waiting - self._behind
            if refused > 0:
                self.fields.lists.command[0] += refused  # they only waited: nothing else has changed
                raise
        finally:
            self._behind, self.ledger.holds_rows = NONE_BEHIND, False

    def blockers(self, rows: Rows) -> Integers:
        """Returns the blocker of each body that these commands insert, one by one: a slot or a wall that it
        would reach into, NO_BLOCKER - 1 - i if the body of command i blocks it, or NO_BLOCKER. The loop would
        find the same, but it needs a copy of all tables."""
        found = np.empty(len(rows), dtype=np.int64)
        if self._search is None:
            compiled = not (self.as_python if self.is_ready else self.begins_as_python)
            self._search = bound(
                self.composition.find_room, self.packed[0], given=(rows, found), compiled=compiled
            )
        self._search(rows, found)
        return found

    @property
    def _waiting(self) -> int:
        return int(self.fields.lists.commands[0] - self.fields.lists.command[0])

    def _run_commands(self) -> None:
        """Runs now all that precedes the next contact; Refused at an insertion that waits for room."""
        quota = self.met_now
        while True:
            try:
                if self.chunk(self.now, UNLIMITED, quota=quota) == TIME_REACHED:
                    return
            except ZenoError:  # a command begins and ends passings, which may fill a window of contacts
                if not self.due:
                    return  # all commands have run; the next run reports the jam

    @property
    def ticks(self) -> list[Integers]:
        """The columns of all ticks, of the tables and of the phase."""
        if self._ticks is None:
            self._ticks = all_ticks(self.k, self.composition.broad.ticks)
        return self._ticks

    @property
    def rests(self) -> bool:
        """True if nothing is scheduled and no body is accelerated: accelerated bodies never rest."""
        return bool((self.k.queue.key == NEVER).all())
