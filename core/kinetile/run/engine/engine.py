"""The Python side of the kernel: what has to be done between two chunks of the compiled loop.

It lays the tables out and fattens the bodies, makes room for more pairs and bodies, hands the loop its
commands a span at a time, moves the clock's base, and takes over the log. Inside a chunk none of that costs
anything.

There is one way to change the structure from outside: build it anew at the present moment (``lay_out``).
Whether pairs outgrow their table, a command brings in more energy than the skin allows for, bodies without
walls fly far, or somebody comes for whom there is no slot (``renewal``): the same static construction that
began the run begins again. That cannot change an answer, only take time (docs/one-answer.md).
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import numpy as np

from kinetile.errors import PhaseError, Refused
from kinetile.kernel.clock import Clock
from kinetile.kernel.compiled import INTERPRETED, NotCompiled, make_ready
from kinetile.kernel.faults import JAMMED
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
)
from kinetile.kernel.skin import Skin, too_thick
from kinetile.kernel.tables import NOBODY, ROW, clear, pair_set, read_only, record_table
from kinetile.plugin.calling import calling, described, place_of
from kinetile.plugin.discovery import sentence
from kinetile.run.audit import check_all
from kinetile.run.composition import Commands, Composition
from kinetile.run.engine.commands.agenda import Agenda, Command, is_due, planned
from kinetile.run.engine.commands.by_hand import UNLIMITED
from kinetile.run.engine.dials import Tables
from kinetile.run.engine.failures import blocked, failure
from kinetile.run.engine.layout import set_limits, tables_of
from kinetile.run.engine.ledger import Ledger
from kinetile.run.engine.pace import first_shift, fit, steps
from kinetile.run.engine.renewal import Renewed, carried_out, renewed
from kinetile.run.engine.responding import begin, make_way, overlapping, quicken
from kinetile.run.interrupts import Unbroken
from kinetile.scene import Insert, Scene
from kinetile.scene.reach import flown, speed_bound

__all__ = ["UNLIMITED", "Engine"]

CHUNK_SECONDS = 0.2
FIRST_BUDGET = 1 << (8 if INTERPRETED else 12)


class Engine(Tables):
    """Tables, clock, agenda and loop of one simulation.

    Attributes:
        state: the broad phase's state.
        clock: conversions between time and ticks.
        ledger: what was logged.
        skin: the skin in force.
        speed: a speed that no body can exceed.
        commands: which commands the loop is composed with.
        agenda: the commands that are still to come.
        squares: at least the sum of mass * speed^2 over all bodies and all commands to come.
        numbers: how many numbers bodies have been given, or will be by the scene.
        loop: the composed loop.
        cpu_seconds: processor time spent in the loop.
        compile_seconds: processor time spent compiling or loading it.
        audits: times an audit found nothing.
        asked: the time that was asked for, while the run stands there: ``time`` says it as it was said.
        busy: a chunk is under way, the taking over of its log included.
        broken: what went wrong in a call that left the tables unfit to go on with; None: nothing.
    """

    def __init__(
        self,
        scene: Scene,
        composition: Composition,
        keep_contacts: bool,
        commands: Commands = Commands.NONE,
    ) -> None:
        self.scene = scene
        self.composition = composition
        self.state = composition.broad.state
        self.clock = Clock(scene.start, scene.time_unit)
        self.ledger = Ledger(self.clock, keep_contacts)
        self.agenda = Agenda(planned(scene, self.clock))
        self.squares = math.inf
        self.commands = max(commands, Commands.of(scene))
        self.loop = composition.loop(self.commands)
        self.speed = speed_bound(scene)
        self.cpu_seconds = 0.0
        self.compile_seconds = 0.0
        self.busy = False
        self.broken: Exception | None = None
        self.asked: float | None = None
        self._ready = False
        self._budget = FIRST_BUDGET
        self.extent = 0.0
        self.audits = 0
        self.walled = scene.arena is not None and composition.wall is not None
        coming = [command for command in scene.commands if isinstance(command, Insert)]
        self.smallest = min(
            [*scene.radius.tolist(), *(command.radius for command in coming)], default=math.inf
        )
        self.lightest = min([*scene.mass.tolist(), *(command.mass for command in coming)], default=math.inf)
        self.numbers = max([len(scene) - 1, *(command.body for command in coming)]) + 1
        self.overlapping = overlapping(scene)
        self.k = self.agenda.load(tables_of(scene, composition, self.clock.unit), self.clock)
        self._long_log = self._no_log = self.k.log
        self.number(self.numbers)
        self.lay_out(self.speed)

    @property
    def time(self) -> float:
        """The present time, in the scene's time."""
        return self.asked if self.asked is not None else self.clock.time(self.now)

    @property
    def _phases(self) -> str:
        return ", ".join([self.composition.broad_phase, *self.composition.narrow_phases])

    def compile(self) -> None:
        """Compile the loop, or load it from the disk cache, where that has not been done."""
        if not self._ready:
            began = time.thread_time()
            try:
                make_ready(self.loop, self.k, self.state, 0, 0, 0, 0)
            except NotCompiled as error:
                who = described("broad phase", self.composition.broad_phase)
                said = f"the hooks of {self._phases} do not compile together ({who}): {error}"
                raise PhaseError(said) from error
            self.compile_seconds += time.thread_time() - began
            self._ready = True

    def chunk(self, until: int, contacts: int, most: int = UNLIMITED, quota: int = UNLIMITED) -> int:
        """Run one chunk of the loop, take over its log, and do what it asks for; return its reason.

        ``contacts`` is how many there may have been in all, ``most`` how many events may run now, ``quota``
        how many contacts there may be at tick ``until``; a chunk takes a fraction of a second, whatever they
        are.

        Raises:
            ZenoError, MissedContactError, PhaseError: the loop returned with a fault.
        """
        self.compile()
        self._demand_whole()
        with Unbroken():  # the loop, its log, the recorder: one step
            self.busy = True
            try:
                return self._chunk(until, contacts, most, quota)
            finally:
                self.busy = False

    def _demand_whole(self) -> None:
        """Raise PhaseError where a call has left the tables unfit to go on with."""
        if self.broken is not None:
            raise PhaseError(f"this simulation cannot go on: {self.broken}") from self.broken

    def demand_sound(self) -> None:
        """Raise the fault after which no command can be taken; a jam is none, for a command may end it."""
        self._demand_whole()
        if self.dial.fault[0] not in (0, JAMMED):
            raise failure(self.k, self.composition, self.clock.time(self.now))

    @contextmanager
    def unchanged_if_refused(self) -> Iterator[None]:
        """Within this context Refused leaves the engine as it was. Costs a copy of all tables."""
        tables = (*self.k, *self.state)
        copies = [table.copy() for table in tables]
        before, entries = dict(vars(self)), self.ledger.entries
        try:
            yield
        except Refused:
            vars(self).update(before)
            self.ledger.entries = entries
            for table, copy in zip(tables, copies, strict=True):
                if table.flags.writeable:
                    table[...] = copy
            self._taken = None
            raise

    def has_slot(self, radius: float) -> bool:
        """Whether a body of this radius can come without the phases being prepared anew."""
        dial = self.dial
        vacant = dial.vacant[0] >= 0 or dial.bodies[0] < len(self.k.bodies)
        return bool(vacant and dial.least[0] <= radius <= dial.widest[0])

    def _chunk(self, until: int, contacts: int, most: int, quota: int) -> int:
        if self.dial.fault[0] == JAMMED and is_due(self.k, self.dial):
            self.dial.fault[0] = 0  # what a command changes may end the jam
        self._record(self.ledger.reads)
        if len(self.overlapping):
            begin(self)
            self._take_over(self.now)
            return BUDGET_SPENT
        began = time.thread_time()
        budget, before, heads = min(self._budget, most), self.now, steps(self.count)
        try:
            with np.errstate(all="ignore") if INTERPRETED else nullcontext():  # compiled, nothing warns
                reason = int(self.loop(self.k, self.state, until, budget, contacts, quota))
        except Exception as error:  # a hook that raises, or one that is interpreted and leaves its arrays
            who = described("broad phase", self.composition.broad_phase)
            said = f"a hook of {self._phases} raised {sentence(error)}{place_of(error)} ({who})"
            self.broken = PhaseError(f"at time {self.clock.time(self.now)!r} {said}")
            self._take_over(before)
            raise self.broken from error
        took = time.thread_time() - began
        self.cpu_seconds += took
        self._take_over(before)
        fit(self.k, self.dial, before, steps(self.count) - heads)
        if reason == BUDGET_SPENT and budget == self._budget and took < CHUNK_SECONDS / 2:
            self._budget *= 2
        elif took > 2 * CHUNK_SECONDS:
            self._budget = max(self._budget // 2, FIRST_BUDGET)
        if reason == FAULT:
            raise failure(self.k, self.composition, self.clock.time(self.now))
        if reason == NO_ROOM:
            self._grow()
        elif reason == FASTER:
            quicken(self)
        elif reason == CROWDED:
            make_way(self)
        elif reason == COMMAND_DUE and not self._make_room():
            reason = BUDGET_SPENT
        elif reason == BLOCKED:
            command = self.k.commands.view(np.ndarray)[self.dial.command[0]]
            raise blocked(self.k, self.clock, command, int(self.dial.fault_b[0]))
        if reason in (COMMAND_DUE, CROWDED):
            return COMMAND_DUE  # room has been made, and nothing done yet
        return BUDGET_SPENT if reason in (NO_ROOM, LOG_FULL, FASTER) else reason

    def _take_over(self, before: int) -> None:
        """Take over the log of a chunk that began at a tick."""
        if self.now != before:
            self.asked = None
        self.ledger.take(self.k, self.dial, self.count.logged[0])

    def _record(self, wanted: bool) -> None:
        """Let the loop write long rows where somebody reads them, and only there."""
        if wanted != bool(len(self.k.log)):
            if wanted and not len(self._long_log):
                self._long_log = record_table(ROW, len(self.k.met))
            self.k = self.k._replace(log=self._long_log if wanted else self._no_log)

    def audit(self) -> None:
        """Check everything that must hold between two events.

        Raises:
            AuditError: the first thing that does not hold; an UnawaitedContactError where it would make a
                contact be missed.
        """
        self.build()
        check_all(self.k, self.composition, self.skin.delta, self.clock.time(self.now), self.events)
        self.audits += 1

    @property
    def next_command(self) -> Command | None:
        """The first command still to come, of the scene or by hand."""
        return self.agenda.next(self.k, self.clock)

    @property
    def built(self) -> bool:
        """Whether structure and calendar stand, with all pairs that were asked for."""
        dial = self.dial
        return bool(dial.built[0] and dial.filed[0] and not dial.wanted[0])

    def build(self) -> None:
        """Build the structure, if that is still to be done, and run no event."""
        while not self.built:
            self.chunk(self.now - 1, UNLIMITED)

    def lay_out(self, speed: float) -> None:
        """Fatten the bodies for this speed, put the structure in order as of now; the loop builds it next.

        Raises Refused, with nothing changed, where the broad phase cannot bear the skin.
        """
        if self.k.clock[0].present != self.k.clock[0].bodies:  # some slots are empty
            self.speed = speed
            self.renew()
            return
        k = self.k
        clock = k.clock[0]
        self.extent, self.skin = self.skin_for(speed)
        self.speed = speed
        set_limits(k, self.skin, self.extent, speed, self.composition.prepared)
        if clock.shift == 0:
            clock.shift = first_shift(k, self.extent)
        clear(k)
        if len(k.bodies):  # where there was nobody, the base has moved on alone
            clock.epoch = self.clock.base
        if self.composition.broad.arrange is not None:
            there, only = int(clock.bodies), read_only(k)
            bodies = k._replace(bodies=only.bodies[:there], mass=only.mass[:there])
            try:
                with calling("broad phase", self.composition.broad_phase, "arrange"):
                    self.composition.broad.arrange(bodies, self.state)
            except Exception as error:
                self.broken = error
                raise

    def skin_for(self, speed: float) -> tuple[float, Skin]:
        """Return the scene's extent and the skin for this speed; Refused where the phase cannot bear it."""
        far = self.reach_of_flight(speed, 4) if len(self.k.bodies) else 0.0
        extent = max(self.scene.arena or (0.0,)) if self.walled else max(self.extent, far)
        skin = Skin.of(len(self.k.bodies), extent, speed, float(self.k.clock[0].tick))
        limit = self.composition.broad.skin_limit
        if limit is not None and skin.delta > limit:
            raise Refused(too_thick(self.composition.broad_phase, skin.delta, limit))
        return extent, skin

    def reach_of_flight(self, speed: float, spans: int) -> float:
        """How far from the origin a body can come at this speed within so many spans."""
        return float(np.abs(positions_now(self.k)).max(initial=0.0)) + flown(speed, self.clock.unit, spans)

    def _grow(self) -> None:
        """Make room for more candidate pairs, and build anew."""
        self.skin_for(self.speed)  # what is refused is refused before the tables change
        clock = self.k.clock[0]
        room = max(2 * len(self.k.pairs), int(1.25 * (int(clock.pairs) + int(clock.wanted))))
        self.k = pair_set(self.k, room)
        self.lay_out(self.speed)

    def renew(self) -> None:
        """Prepare the phases for who is there, and lay the tables out for them."""
        self._adopt(renewed(self.k, self.scene, self.composition))

    def _adopt(self, new: Renewed) -> None:
        """Go on with other phases and tables, and lay them out."""
        self.composition, self.k, self.state = new.composition, new.k, new.composition.broad.state
        loop = new.composition.loop(self.commands)
        self._ready = self._ready and loop is self.loop
        self.loop = loop
        self.lay_out(self.speed)

    def _make_room(self) -> bool:
        """A body comes or goes now, and the phases are prepared for that anew; return whether the command is
        still to be carried out."""
        k, composition = self.k, self.composition
        if composition.living:
            self._adopt(renewed(k, self.scene, composition, k.commands[int(k.clock[0].command)]))
        else:
            self._adopt(carried_out(k, self.scene, composition))
        return composition.living

    def number(self, numbers: int) -> None:
        """Make room for so many numbers of bodies in the table of their slots."""
        if numbers > len(self.k.slots):
            more = np.full(numbers + len(self.k.slots) + 64, NOBODY, dtype=np.int32)
            more[: len(self.k.slots)] = self.k.slots
            self.k = self.k._replace(slots=more)
            if len(self.k.watch):
                watch = np.full(len(more), self.k.watch.min())
                watch[: len(self.k.watch)] = self.k.watch
                self.k = self.k._replace(watch=watch)

    def allow(self, commands: Commands) -> None:
        """Compose the loop with such commands in it, where it was composed without."""
        if commands > self.commands:
            self.commands = commands
            self.loop = self.composition.loop(commands)
            self._ready = False
            if commands == Commands.ALL and self.composition.living:
                self._adopt(renewed(self.k, self.scene, self.composition, roomy=True))
