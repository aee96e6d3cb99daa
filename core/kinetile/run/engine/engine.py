"""The Python side of the kernel: what has to be done between two chunks of the compiled loop.

It lays the tables out and fattens the bodies, makes room for more pairs, hands the loop its turns a span at a
time, moves the clock's base, and takes over the log. Inside a chunk none of that costs anything.

There is one way to change the structure from outside: build it anew at the present moment (``lay_out``).
Whether pairs outgrow their table, a turn brings in more energy than the skin allows for, or bodies without
walls fly far: the same static construction that began the run begins again. That cannot change an answer,
only take time (docs/one-answer.md).
"""

from __future__ import annotations

import math
import time

import numpy as np

from kinetile.errors import PhaseError, Refused
from kinetile.kernel.clock import SPAN, TICKS, Clock
from kinetile.kernel.compiled import INTERPRETED, NotCompiled, make_ready
from kinetile.kernel.flight import positions_now
from kinetile.kernel.log import REANCHORED, TURNED
from kinetile.kernel.loop import BUDGET_SPENT, FAULT, LOG_FULL, NO_ROOM, TIME_REACHED
from kinetile.kernel.skin import Skin, too_thick
from kinetile.kernel.tables import NEVER, NOT_ASKED, ROW, clear, pair_set, read_only, record_table
from kinetile.plugin.calling import calling, described, place_of
from kinetile.plugin.discovery import sentence
from kinetile.run.audit import check_all
from kinetile.run.composition import Composition
from kinetile.run.engine.agenda import Agenda, Planned
from kinetile.run.engine.failures import failure
from kinetile.run.engine.layout import set_limits, tables_of
from kinetile.run.engine.ledger import Ledger
from kinetile.run.engine.pace import first_shift, fit, steps
from kinetile.run.interrupts import Unbroken
from kinetile.run.readings import energy
from kinetile.scene import Scene
from kinetile.scene.reach import flown, speed_bound

__all__ = ["UNLIMITED", "Engine"]

CHUNK_SECONDS = 0.2
FIRST_BUDGET = 1 << (8 if INTERPRETED else 12)
UNLIMITED = 2**62


class Engine:
    """Tables, clock, agenda and loop of one simulation.

    Attributes:
        k: the kernel's tables; replaced when they grow.
        state: the broad phase's state.
        clock: conversions between time and ticks.
        ledger: what was logged.
        skin: the skin in force.
        speed: a speed that no body can exceed.
        turning: whether the loop is composed with turns.
        loop: the composed loop.
        cpu_seconds: processor time spent in the loop.
        compile_seconds: time spent compiling or loading it.
        audits: times an audit found nothing.
        asked: the time that was asked for, while the run stands there: ``time`` says it as it was said.
        busy: a chunk is under way, the taking over of its log included.
        broken: what went wrong in a call that left the tables unfit to go on with; None: nothing.
    """

    def __init__(
        self, scene: Scene, composition: Composition, keep_contacts: bool, turning: bool = False
    ) -> None:
        self.scene = scene
        self.composition = composition
        self.state = composition.broad.state
        self.clock = Clock(scene.start, scene.time_unit)
        self.ledger = Ledger(self.clock, keep_contacts)
        self.agenda = Agenda(scene.turns, self.clock)
        self.turning = turning or bool(scene.turns)
        self.loop = composition.loop(turns=self.turning)
        self.speed = speed_bound(scene)
        self.cpu_seconds = 0.0
        self.compile_seconds = 0.0
        self.busy = False
        self.broken: Exception | None = None
        self.asked: float | None = None
        self._turns_wait = False
        self._ready = False
        self._budget = FIRST_BUDGET
        self._extent = 0.0
        self.audits = 0
        self._walled = scene.arena is not None and composition.wall is not None
        self.k = tables_of(scene, composition, self.clock.unit)
        self.lay_out(self.speed)

    @property
    def now(self) -> int:
        """The present tick, counted from the clock's base."""
        return int(self.k.clock[0].now)

    @property
    def time(self) -> float:
        """The present time, in the scene's time."""
        return self.asked if self.asked is not None else self.clock.time(self.now)

    @property
    def contacts(self) -> int:
        """Contacts of both kinds so far."""
        counts = self.k.counts[0]
        return int(counts.contacts_disc) + int(counts.contacts_wall)

    @property
    def events(self) -> int:
        """Events of all kinds so far."""
        counts = self.k.counts[0]
        return self.contacts + int(counts.turns) + int(counts.structural)

    @property
    def _phases(self) -> str:
        return ", ".join([self.composition.broad_phase, *self.composition.narrow_phases])

    def compile(self) -> None:
        """Compile the loop, or load it from the disk cache, where that has not been done."""
        if not self._ready:
            began = time.perf_counter()
            try:
                make_ready(self.loop, self.k, self.state, 0, 0, 0)
            except NotCompiled as error:
                who = described("broad phase", self.composition.broad_phase)
                said = f"the hooks of {self._phases} do not compile together ({who}): {error}"
                raise PhaseError(said) from error
            self.compile_seconds += time.perf_counter() - began
            self._ready = True

    def chunk(self, until: int, contacts: int, most: int = UNLIMITED) -> int:
        """Run one chunk of the loop, take over its log, and do what it asks for; return its reason.

        ``contacts`` is how many there may have been in all, ``most`` how many events may run now; a chunk
        takes a fraction of a second, whatever they are.

        Raises:
            ZenoError, MissedContactError, PhaseError: the loop returned with a fault.
        """
        self.compile()
        if self.broken is not None:
            raise PhaseError(f"this simulation cannot go on: {self.broken}") from self.broken
        with Unbroken():  # the loop, its log, the recorder: one step
            self.busy = True
            try:
                return self._chunk(until, contacts, most)
            finally:
                self.busy = False

    def _chunk(self, until: int, contacts: int, most: int) -> int:
        self._record(self.ledger.recorder is not None)
        began = time.thread_time()
        budget, before, heads = min(self._budget, most), self.now, steps(self.k)
        try:
            with np.errstate(all="ignore"):  # where it is interpreted: compiled, nothing warns
                reason = int(self.loop(self.k, self.state, until, budget, contacts))
        except Exception as error:  # a hook that raises, or one that is interpreted and leaves its arrays
            who = described("broad phase", self.composition.broad_phase)
            said = f"a hook of {self._phases} raised {sentence(error)}{place_of(error)} ({who})"
            self.broken = PhaseError(f"at time {self.clock.time(self.now)!r} {said}")
            self._take_over(before)
            raise self.broken from error
        self._turns_wait = False
        took = time.thread_time() - began
        self.cpu_seconds += took
        self._take_over(before)
        fit(self.k, before, steps(self.k) - heads)
        if reason == BUDGET_SPENT and budget == self._budget and took < CHUNK_SECONDS / 2:
            self._budget *= 2
        elif took > 2 * CHUNK_SECONDS:
            self._budget = max(self._budget // 2, FIRST_BUDGET)
        if reason == FAULT:
            raise failure(self.k, self.composition, self.clock.time(self.now))
        if reason == NO_ROOM:
            self._grow()
        return BUDGET_SPENT if reason in (NO_ROOM, LOG_FULL) else reason

    def _take_over(self, before: int) -> None:
        """Take over the log of a chunk that began at a tick."""
        if self.now != before:
            self.asked = None
        self.ledger.take(self.k)

    def _record(self, wanted: bool) -> None:
        """Let the loop write long rows where somebody reads them, and only there."""
        if wanted != bool(len(self.k.log)):
            self.k = self.k._replace(log=record_table(ROW, len(self.k.met) if wanted else 0))

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
    def next_turn(self) -> Planned | None:
        """The first turn still to come, of the scene or by hand."""
        return self.agenda.next_turn(int(self.k.clock[0].turn))

    @property
    def built(self) -> bool:
        """Whether the structure stands, holds all pairs that were asked for, and awaits the turns, and the
        calendar is filed."""
        clock = self.k.clock[0]
        return bool(clock.built and clock.filed) and not clock.wanted and not self._turns_wait

    def build(self) -> None:
        """Build the structure, if that is still to be done, and run no event."""
        while not self.built:
            self.chunk(self.now - 1, UNLIMITED)

    def turn(self, body: int, vx: float, vy: float) -> None:
        """Change a body's velocity now; events of this very tick run as well.

        Raises Refused, with nothing changed, where the broad phase cannot bear the skin that this asks for.
        """
        k = self.k
        squares = 2.0 * energy(k) + float(k.mass[body]) * (vx * vx + vy * vy) + self.agenda.squares(k.mass)
        needed = math.sqrt(squares / float(k.mass.min()))
        if needed > self.speed:
            self._skin(2.0 * needed)  # refused here, if at all: nothing has changed yet
        self._allow_turns()
        self.compile()
        with Unbroken():
            if needed > self.speed:
                self.lay_out(2.0 * needed)
            self._forget_turns()
            self.agenda.put(Planned(self.clock.base * TICKS + self.now, body, vx, vy, TURNED))
            self._load_turns()
            recorder = self.ledger.recorder
            self.ledger.recorder = recorder or self.ledger.unrecorded.append
            try:
                while self.chunk(self.now, UNLIMITED) != TIME_REACHED:
                    pass
            finally:
                self.ledger.recorder = recorder

    def move_base(self, end: int | None) -> None:
        """Move the clock's base on by a span and anchor anew what has flown for two: so under every phase.

        Where there is no body it moves on at once to the span of ``end``, in ticks since the start.
        """
        k = self.k
        if not len(k.bodies) and end is not None:
            self.clock.base += max(self.clock.relative(end) // SPAN, 1) * (SPAN // TICKS)
            k.clock[0].now = -1  # its epoch, which may be beyond 64 bits, is asked for by no contact
            return
        clock = k.clock[0]
        if not self._walled and len(k.bodies) and self._reach_of_flight(self.speed, 2) > self._extent:
            self.lay_out(self.speed)
        self._forget_turns()
        k.bodies.anchor -= SPAN
        for ticks in (k.queue.key, k.queue.own, k.queue.tick, k.queue.guard, *self.composition.broad.ticks):
            ticks[ticks != NEVER] -= SPAN
        k.queue.wall[(k.queue.wall != NEVER) & (k.queue.wall != NOT_ASKED)] -= SPAN
        clock.now -= SPAN
        clock.origin -= SPAN
        clock.filed = 0
        clock.window_tick = max(int(clock.window_tick) - SPAN, -(2**62))
        self.clock.base += SPAN // TICKS
        if len(k.bodies):
            clock.epoch = self.clock.base
        old = np.flatnonzero(k.bodies.anchor < -SPAN)
        if len(old):
            self._allow_turns()
            begin = self.clock.base * TICKS
            vx, vy = k.bodies.vx[old].tolist(), k.bodies.vy[old].tolist()
            self.agenda.put(
                *(Planned(begin, *plan, REANCHORED) for plan in zip(old.tolist(), vx, vy, strict=True))
            )
        self._load_turns()

    def lay_out(self, speed: float) -> None:
        """Fatten the bodies for this speed, put the structure in order as of now; the loop builds it next.

        Raises Refused, with nothing changed, where the broad phase cannot bear the skin.
        """
        k = self.k
        clock = k.clock[0]
        self._extent, self.skin = self._skin(speed)
        self.speed = speed
        set_limits(k, self.skin, self._extent, speed)
        if clock.shift == 0:
            clock.shift = first_shift(k, self._extent)
        clear(k)
        self._load_turns()
        if self.composition.broad.arrange is not None:
            bodies = k._replace(bodies=read_only(k).bodies, mass=read_only(k).mass)
            try:
                with calling("broad phase", self.composition.broad_phase, "arrange"):
                    self.composition.broad.arrange(bodies, self.state)
            except Exception as error:
                self.broken = error
                raise

    def _skin(self, speed: float) -> tuple[float, Skin]:
        """Return the scene's extent and the skin for this speed; Refused where the phase cannot bear it."""
        far = self._reach_of_flight(speed, 4) if len(self.scene) else 0.0
        extent = max(self.scene.arena or (0.0,)) if self._walled else max(self._extent, far)
        skin = Skin.of(len(self.scene), extent, speed, float(self.k.clock[0].tick))
        limit = self.composition.broad.skin_limit
        if limit is not None and skin.delta > limit:
            raise Refused(too_thick(self.composition.broad_phase, skin.delta, limit))
        return extent, skin

    def _reach_of_flight(self, speed: float, spans: int) -> float:
        """How far from the origin a body can come at this speed within so many spans."""
        return float(np.abs(positions_now(self.k)).max()) + flown(speed, self.clock.unit, spans)

    def _grow(self) -> None:
        """Make room for more candidate pairs, and build anew."""
        self._skin(self.speed)  # what is refused is refused before the tables change
        clock = self.k.clock[0]
        room = max(2 * len(self.k.pairs), int(1.25 * (int(clock.pairs) + int(clock.wanted))))
        self.k = pair_set(self.k, room)
        self.lay_out(self.speed)

    def _allow_turns(self) -> None:
        """Compose the loop with turns in it, where it was composed without."""
        if not self.turning:
            self.turning = True
            self.loop = self.composition.loop(turns=True)
            self._ready = False

    def _forget_turns(self) -> None:
        """Strike the turns that the loop has made off the agenda."""
        clock = self.k.clock[0]
        self.agenda.done(int(clock.turn))
        clock.turn = 0

    def _load_turns(self) -> None:
        """Hand the loop the turns of the present span."""
        self._forget_turns()
        due = self.agenda.due(self.clock)
        turns = record_table(self.k.turns.dtype, len(due))
        for row, turn in zip(turns, due, strict=True):
            row.tick = self.clock.relative(turn.ticks)
            row.vx, row.vy, row.body, row.code = turn.vx, turn.vy, turn.body, turn.code
        self.k.clock[0].turns = len(due)
        self._turns_wait = len(due) > 0
        self.k = self.k._replace(turns=turns)
