"""A simulation: a scene, its phases by name, and the clock; run it, turn bodies, read it out.

This is the Python side of the kernel. Between two chunks of the compiled loop it makes room, keeps the log, moves the clock's
base and shows progress; inside a chunk none of that costs anything.
"""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile._interrupts import Interrupts
from kinetile.agenda import Agenda
from kinetile.clock import SPAN, TICKS, Clock, time_unit
from kinetile.compiled import is_cached, make_ready
from kinetile.composition import Composition, compose_phases
from kinetile.failures import failure
from kinetile.flight import positions_now
from kinetile.kernel import BUDGET_SPENT, CONTACTS_REACHED, FAULT, LOG_FULL, NO_ROOM, TIME_REACHED
from kinetile.log import CONTACT, LOG, REANCHORED, TURNED
from kinetile.measures import Readings, energy
from kinetile.modelled import explanation
from kinetile.scene import Scene
from kinetile.skin import Skin, speed_bound
from kinetile.tables import Kernel, allocate, clear, record_table

__all__ = ["Progress", "Simulation"]

LOG_ROWS = 1 << 15
CHUNK_SECONDS = 0.2
FIRST_BUDGET = 1 << 12
IDLE_SPANS = 1 << 12
UNLIMITED = 2**62


class Progress(NamedTuple):
    """How far a run is: ``time`` of ``until`` (None: no end in time), counts since the start, CPU seconds of this run."""

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
    ) -> None:
        self.scene = scene
        self.composition: Composition = compose_phases(scene, broad_phase, narrow_phases, options)
        self._clock = Clock(scene.start, time_unit(scene))
        self._agenda = Agenda(scene.turns, self._clock)
        self._turning = bool(scene.turns)
        self._loop = self.composition.loop(turns=self._turning)
        self._ready = False
        self._compile_seconds = 0.0
        self._cpu_seconds = 0.0
        self._budget = FIRST_BUDGET
        self._keep = keep_contacts
        self._kept: list[npt.NDArray[np.void]] = []
        self._digest = hashlib.sha256()
        self._recorder: Callable[[npt.NDArray[np.void]], None] | None = None
        self._speed = speed_bound(scene)
        self._extent = 0.0
        self._state = self.composition.broad.state
        self._k = self._tables(pairs=8 * len(scene) + 64)
        self._lay_out()
        self._start_energy = energy(self._k)

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
        return self._clock.unit

    @property
    def cached(self) -> bool | None:
        """Whether the loop's machine code lies on disk; None when it runs interpreted."""
        return is_cached(self._loop)

    @property
    def state(self) -> Any:
        """The broad phase's state (a NamedTuple of arrays): its structure, to be looked at between runs."""
        return self._state

    def explain(self) -> dict[str, Any]:
        """Return what is modelled and what is left out, in sentences, with the numbers behind them."""
        return explanation(self.scene, self.composition, self._turning, self.skin, self._clock, self._speed)

    # Running

    def compile(self) -> float:
        """Compile the loop, or load it from the disk cache; return the seconds this has taken so far."""
        if not self._ready:
            began = time.perf_counter()
            make_ready(self._loop, self._k, self._state, 0, 0, 0)
            self._compile_seconds += time.perf_counter() - began
            self._ready = True
        return self._compile_seconds

    def run(
        self,
        until: float | None = None,
        *,
        max_contacts: int | None = None,
        progress: Callable[[Progress], None] | None = None,
        recorder: Callable[[npt.NDArray[np.void]], None] | None = None,
    ) -> None:
        """Run on until a time, or for so many more contacts, whichever comes first.

        Args:
            until: the time to run to, in the scene's time; all events up to and at it have then happened. None: the
                scene's own ``until`` where neither is given.
            max_contacts: stop after so many further contacts of discs and walls; the time is then that of the last one.
            progress: called after each chunk (a fraction of a second).
            recorder: called with the log rows (``kinetile.log.LOG``) of each chunk, before a fault is raised.

        Raises:
            ZenoError: the bodies are jammed.
            MissedContactError: a contact was missed or found too late.
            PhaseError: a phase broke the protocol.
            ValueError: ``until`` is not a finite time, or lies in the past.
        """
        end, limit = self._targets(until, max_contacts)
        self.compile()
        counts = self._k.counts[0]
        contacts_end = UNLIMITED if limit is None else _contacts(counts) + limit
        began = self._cpu_seconds
        idle = 0
        self._recorder = recorder
        try:
            with Interrupts() as interrupts:
                while True:
                    rest = SPAN if end is None else self._clock.relative(end)
                    reason = self._chunk(min(rest, SPAN - 1), contacts_end)
                    if progress is not None:
                        total = _contacts(counts) + int(counts.turns) + int(counts.structural)
                        progress(Progress(self.time, until, _contacts(counts), total, self._cpu_seconds - began))
                    if reason == CONTACTS_REACHED or (reason == TIME_REACHED and rest < SPAN):
                        break
                    if reason == TIME_REACHED:
                        idle = idle + 1 if self._k.clock[0].queued == 0 and not self._agenda else 0
                        if end is None and idle > IDLE_SPANS:
                            break
                        self._move_base()
                    interrupts.check()
        finally:
            self._recorder = None

    def set_velocity(self, body: int, velocity: tuple[float, float]) -> None:
        """Turn a body now: from here on it flies with this velocity.

        Raises:
            IndexError: there is no such body.
            ValueError: the velocity is not two finite numbers.
        """
        if not 0 <= body < len(self.scene):
            raise IndexError(f"there is no body {body}: this scene has {len(self.scene)}, numbered from 0")
        vx, vy = (float(v) for v in velocity)
        if not (math.isfinite(vx) and math.isfinite(vy)):
            raise ValueError(f"a velocity is two finite numbers; found ({vx}, {vy})")
        self._allow_turns()
        k = self._k
        now = int(k.clock[0].now)
        squares = 2.0 * energy(k) + float(k.mass[body]) * (vx * vx + vy * vy) + self._agenda.squares(k.mass)
        needed = math.sqrt(squares / float(k.mass.min()))
        self._forget_turns()
        self._agenda.put(self._clock.base * TICKS + now, body, vx, vy, TURNED)
        self._load_turns()
        while self._chunk(now, UNLIMITED) != TIME_REACHED:
            pass
        if needed > self._speed:  # the skin must bear the new speed: fatten, and build the structure anew
            self._speed = 2.0 * needed
            self._lay_out()

    # Reading out

    @property
    def time(self) -> float:
        """The present time."""
        return self._clock.time(int(self._k.clock[0].now))

    def positions(self) -> npt.NDArray[np.float64]:
        """Return the positions now, (n, 2)."""
        return positions_now(self._k)

    def velocities(self) -> npt.NDArray[np.float64]:
        """Return the velocities now, (n, 2)."""
        return np.column_stack([self._k.bodies.vx, self._k.bodies.vy])

    def candidate_pairs(self) -> npt.NDArray[np.int32]:
        """Return the candidate pairs now, (k, 2), a < b, sorted."""
        if not self._k.clock[0].built:
            self.compile()
            self._chunk(int(self._k.clock[0].now) - 1, UNLIMITED)
        live = self._k.certificates[self._k.certificates.a >= 0]
        pairs = np.column_stack([live.a, live.b])
        return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]

    @property
    def contacts(self) -> npt.NDArray[np.void]:
        """All contacts so far, in canonical order (``kinetile.log.CONTACT``)."""
        if not self._keep:
            raise ValueError("this simulation keeps no contacts: it was made with keep_contacts=False")
        if len(self._kept) != 1:
            self._kept = [np.concatenate([np.zeros(0, CONTACT), *self._kept])]
        return self._kept[0]

    @property
    def fingerprint(self) -> str:
        """Hex digest of the list of contacts (epoch, tick, a, b): equal under every broad phase."""
        return self._digest.hexdigest()

    @property
    def readings(self) -> Readings:
        """The instruments, now."""
        return Readings.take(
            self._k,
            start_energy=self._start_energy,
            certificates_created=self._own_certificates(),
            cpu_seconds=self._cpu_seconds,
            compile_seconds=self._compile_seconds,
            fingerprint=self.fingerprint,
        )

    # Between chunks

    def _own_certificates(self) -> int:
        """How many certificates there are beside those of pairs."""
        walls = len(self.scene) if self.composition.wall is not None else 0
        return self.composition.broad.certificates + walls

    def _targets(self, until: float | None, max_contacts: int | None) -> tuple[int | None, int | None]:
        """Check and convert the arguments of ``run``: (ticks since the start, contacts)."""
        if until is None and max_contacts is None:
            until = self.scene.settings.until
            if until is None:
                raise ValueError("run needs an end: until=, max_contacts= or an until in the scene")
        if max_contacts is not None and max_contacts < 0:
            raise ValueError(f"max_contacts must not be negative; found {max_contacts}")
        if until is None:
            return None, max_contacts
        if not math.isfinite(until):
            raise ValueError(f"until must be a finite time; found {until}")
        end = self._clock.ticks(until)
        if self._clock.relative(end) < int(self._k.clock[0].now):
            raise ValueError(f"until={until} lies in the past: the time is {self.time}")
        return end, max_contacts

    def _chunk(self, until: int, contacts: int) -> int:
        """Run one chunk of the loop, keep what it logged, and do what it asks for; return its reason."""
        self.compile()
        k = self._k
        began = time.process_time()
        reason = int(self._loop(k, self._state, until, self._budget, contacts))
        took = time.process_time() - began
        self._cpu_seconds += took
        self._drain()
        if reason == BUDGET_SPENT and took < CHUNK_SECONDS / 2:
            self._budget *= 2
        elif took > 2 * CHUNK_SECONDS:
            self._budget = max(self._budget // 2, FIRST_BUDGET)
        if reason == NO_ROOM:
            self._grow()
        if reason == FAULT:
            clock = k.clock[0]
            raise failure(
                int(clock.fault), int(clock.fault_a), int(clock.fault_b), self.time, self.broad_phase, clock.window_size
            )
        return reason if reason not in (NO_ROOM, LOG_FULL) else BUDGET_SPENT

    def _drain(self) -> None:
        """Move the loop's log to the kept contacts, the fingerprint and the recorder."""
        clock = self._k.clock[0]
        if clock.logged == 0:
            return
        raw = self._k.log[: int(clock.logged)]
        moment, epoch, tick = self._clock.split(raw.tick)
        met = raw.b > TURNED
        contacts = np.zeros(int(met.sum()), CONTACT)
        for name, column in (("time", moment), ("epoch", epoch), ("tick", tick), ("a", raw.a), ("b", raw.b)):
            contacts[name] = column[met]
        rows = None
        if self._recorder is not None:
            rows = np.zeros(len(raw), LOG)
            for name, column in (("time", moment), ("epoch", epoch), ("tick", tick)):
                rows[name] = column
            for name in raw.dtype.names[1:]:
                rows[name] = raw[name]
            for name in ("bx", "by", "bvx", "bvy"):
                rows[name][raw.b < 0] = np.nan
        self._digest.update(_digestible(contacts))
        if self._keep:
            self._kept.append(contacts)
        clock.logged = 0
        if rows is not None and self._recorder is not None:
            self._recorder(rows)

    def _tables(self, pairs: int) -> Kernel:
        """Return tables for this scene, its bodies at their start."""
        scene = self.scene
        k = allocate(len(scene), self.composition.broad.certificates, pairs, LOG_ROWS)
        k.bodies.x, k.bodies.y = scene.position.T
        k.bodies.vx, k.bodies.vy = scene.velocity.T
        k.bodies.radius = scene.radius
        k.bodies.last = -1
        k.mass[:] = scene.mass
        clock = k.clock[0]
        clock.tick = self._clock.unit / TICKS
        clock.per_time = TICKS / self._clock.unit
        if scene.arena is not None:
            clock.width, clock.height = scene.arena
        n = len(scene)
        clock.spin_limit = 8 * (2 * n + 2) ** 2 + 1000
        clock.window_size = 200 * n + 2000
        clock.window_ticks = self._jam_ticks(int(clock.window_size))
        clock.window_tick = -(2**62)
        return k

    def _jam_ticks(self, contacts: int) -> int:
        """How little time so many contacts may take before the bodies count as jammed: 1e-13 radii of flight each."""
        if len(self.scene) == 0 or self._speed == 0.0:
            return 0
        ticks = contacts * 1e-13 * float(self.scene.radius.min()) / self._speed * TICKS / self._clock.unit
        return min(int(ticks), SPAN)

    def _lay_out(self) -> None:
        """Fatten the bodies by the skin and put all structure in order as of now; the loop builds it when next called."""
        k = self._k
        clock = k.clock[0]
        if self.scene.arena is not None:
            self._extent = max(self.scene.arena)
        elif len(self.scene):
            ahead = self._speed * self._clock.unit * (4 * SPAN // TICKS)
            self._extent = max(self._extent, float(np.abs(positions_now(k)).max()) + ahead)
        self.skin = Skin.of(len(self.scene), self._extent, self._speed, float(clock.tick))
        k.bodies.reach = k.bodies.radius + self.skin.delta
        clock.theta, clock.tolerance = self.skin.theta, self.skin.tolerance
        clear(k)
        self._load_turns()
        if self.composition.broad.arrange is not None:
            self.composition.broad.arrange(k, self._state)

    def _grow(self) -> None:
        """Make room for more candidate pairs, and build the structure anew: that cannot change an answer."""
        clock = self._k.clock[0]
        room = max(2 * len(self._k.fresh), int(1.25 * (int(clock.pairs) + int(clock.wanted))))
        old = self._k
        new = allocate(len(self.scene), self.composition.broad.certificates, room, 0)
        self._k = old._replace(
            certificates=new.certificates, queue=new.queue, lookup=new.lookup, fresh=new.fresh
        )
        self._lay_out()

    def _forget_turns(self) -> None:
        """Strike the turns that the loop has made off the agenda."""
        clock = self._k.clock[0]
        self._agenda.done(int(clock.turn))
        clock.turn = 0

    def _load_turns(self) -> None:
        """Hand the loop the turns of the present span."""
        self._forget_turns()
        due = self._agenda.due(self._clock)
        turns = record_table(self._k.turns.dtype, len(due))
        for row, turn in zip(turns, due, strict=True):
            row.tick = self._clock.relative(turn.ticks)
            row.vx, row.vy, row.body, row.code = turn.vx, turn.vy, turn.body, turn.code
        clock = self._k.clock[0]
        clock.turns = len(due)
        self._k = self._k._replace(turns=turns)

    def _move_base(self) -> None:
        """Move the clock's base on by a span, and anchor anew what has flown for two: the same under every phase."""
        k = self._k
        clock = k.clock[0]
        self._forget_turns()
        k.bodies.anchor -= SPAN
        k.queue.tick[: int(clock.queued)] -= SPAN
        clock.now -= SPAN
        clock.window_tick = max(int(clock.window_tick) - SPAN, -(2**62))
        self._clock.base += SPAN // TICKS
        old = np.flatnonzero(k.bodies.anchor < -SPAN)
        if len(old):
            self._allow_turns()
            for body in old:
                at = k.bodies[body]
                self._agenda.put(self._clock.base * TICKS, int(body), float(at.vx), float(at.vy), REANCHORED)
        self._load_turns()
        if self.scene.arena is None and len(self.scene):
            ahead = self._speed * self._clock.unit * (2 * SPAN // TICKS)
            if float(np.abs(positions_now(k)).max()) + ahead > self._extent:
                self._lay_out()

    def _allow_turns(self) -> None:
        """Compose the loop with turns in it, where it was composed without."""
        if not self._turning:
            self._turning = True
            self._loop = self.composition.loop(turns=True)
            self._ready = False


def _contacts(counts: Any) -> int:
    """Contacts of both kinds so far."""
    return int(counts.contacts_disc) + int(counts.contacts_wall)


def _digestible(contacts: npt.NDArray[np.void]) -> bytes:
    """What the fingerprint is made from: (epoch, tick, a, b), little-endian, without the start of the clock."""
    exact = np.zeros(len(contacts), [("epoch", "<i8"), ("tick", "<i8"), ("a", "<i4"), ("b", "<i4")])
    for name in ("epoch", "tick", "a", "b"):
        exact[name] = contacts[name]
    return exact.tobytes()
