"""Recording of a run for a page: all rows of a window of time, and structural events if it was stepped.

A run is made twice. The first run is free, and its rows are recorded. The second run is stepped event by
event, which costs a hundred times as much, to record the structure between the rows; so only for
``MOST_STEPS`` events.

A page begins with the flight plans at the start of its window and continues from row to row, as a run does.
Most of a row follows from the plans before it: a body is at the position of its plan, mostly to the last
bit. So a page holds only the differences, as bits (exclusive or), most of them zero: this halves the page.
The same prediction is in ``script/run/rows.mjs``, operation by operation.

A shape of the structure moves with its bodies, so it is recorded once for its whole life. A new certificate
with another failure time ends this life.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Array, Floats, Integers
from kinetile.errors import KinetileError
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.log import HELD, REANCHORED
from kinetile.kernel.plan import AcceleratedPlan, Plan, accelerated_position_after, accelerated_velocity_after
from kinetile.kernel.tables import NEVER
from kinetile.plugin.drawing import At, Box, Entry, Item, Link, Polygon, Segment, points_of
from kinetile.records.bounded import BoundedRows, TooManyRows, ticks_of
from kinetile.records.trajectory import first_accelerations
from kinetile.run.engine.state import passings_of
from kinetile.run.flights import COLUMNS_OF, Flights
from kinetile.run.simulation import Simulation, composition_of
from kinetile.scene import Insert, Scene
from kinetile.scene.bodies import nearest_image, whole_periods
from kinetile.scene.commands import COMMAND_KINDS
from kinetile.show.picture import ORDER, PAIRS_DRAWN, wants_pairs

MOST_ROWS = 200_000
"""The most rows of a page, some 30 bytes each; a longer run is shown up to there."""

MOST_STEPS = 5_000
"""The most events of a stepped run; beyond, a page has only rows."""


_PAIRED = ("tiling", "boxes")
"""The structures that a page computes with pairs."""


@dataclass(frozen=True)
class Steps:
    """Results of stepping: structural events, (m,) each: exact time, the body whose certificate failed, and
    the number of rows of the window before it; the number of queued bodies after each number of events, (k,);
    and the structure that the phase draws."""

    epoch: Integers
    tick: Integers
    body: Integers
    after: Integers
    queue: Integers
    structure: "StructureLog"


@dataclass(frozen=True)
class Recording:
    """A window of a run: plans at its beginning, rows (dtype LOG) in it, and its beginning and end, in ticks
    since the scene's start.

    ``notes`` describe its end and the omitted parts; ``drawn_as`` is the broad phase's; ``skin`` is the
    enlargement of the bodies that it saw at the end; ``pairs`` is True if lines between bodies are drawn;
    ``whole`` is False if the rows after the end were left out; ``passing`` are the passings that last at the
    beginning: bodies a < b, and the image (m, n) of b.
    """

    label: str
    plans: "PlayedPlans"
    rows: Array
    begin: int
    end: int
    stepped: Steps | None = None
    notes: tuple[str, ...] = ()
    drawn_as: str = ""
    skin: float = 0.0
    pairs: bool = True
    whole: bool = True
    passing: Sequence[tuple[int, ...]] = ()


def record(
    scene: Scene,
    simulation: Simulation,
    again: Simulation | None,
    label: str,
    begin: float,
    until: float,
    max_contacts: int | None = None,
    pairs: bool | None = None,
    progress: Callable[[float, str], None] = lambda share, text: None,
) -> Recording:
    """Runs a new simulation, and returns its window from ``begin`` to ``until``, or to a number of contacts;
    None: as many as fit. ``again`` is a second simulation, to be stepped; None: no stepping. A fault ends the
    recording with a note. ``progress`` is called with the finished share of the steps, and a text. Lines
    between ``pairs`` are drawn if True; None: if there are at most ``PAIRS_DRAWN`` at the beginning, or
    without steps, if there are at most as many bodies."""
    rows = BoundedRows(MOST_ROWS, scene)
    clock = rows.clock
    notes: list[str] = []
    plans, passing = PlayedPlans.of(scene, rows.rows), list[tuple[int, ...]]()
    first = clock.ticks(begin)
    last, whole = first, True
    try:
        if begin > scene.start:
            try:
                simulation.run(begin)
            finally:
                plans = plans.of_run(simulation)
                passing = passings_of(simulation.tables)[["a", "b", "m", "n"]].tolist()
        # Each contact has a row. Without this limit a far end would be refused, because of the clock's rows.
        most = MOST_ROWS + 1 if max_contacts is None else max_contacts
        simulation.run(until, max_contacts=most, recorder=rows)
        epoch, tick = simulation.exact_time
        last = max(epoch * TICKS + tick, clock.ticks(simulation.time))
        if simulation.time < until:
            many = f"{most:,} contacts are as many as were to be shown"
            notes.append(f"Shown up to {simulation.time!r} of {begin!r} to {until!r}: {many}.")
    except TooManyRows:
        last, whole = clock.ticks(rows.end), False
        notes.append(f"{shown_up_to(rows, f' of {begin!r} to {until!r}')} {next_window(rows.end)}")
    except KinetileError as error:
        notes.append(f"The run ended with a fault, {type(error).__name__}: {error}")
    last = max(ticks_of(rows.rows[-1:]).max(initial=first), last)
    drawn_as = composition_of(simulation).broad.drawn_as
    paired = len(plans.x) <= PAIRS_DRAWN if pairs is None else pairs
    if scene.accelerated:  # its broad phase does not see the positions of the bodies
        drawn_as = ""
    skin = float(simulation.tables.clock[0].limits.skin)
    run = label, plans, rows.rows, first, int(last), None, tuple(notes)
    recording = Recording(*run, drawn_as, skin, paired, whole, passing)
    if again is not None:
        recording = _with_steps(recording, again, clock, begin, pairs, progress)
    notes = []
    if pairs is None and not recording.pairs and (recording.stepped or drawn_as in _PAIRED):
        notes += [f"Pairs are left out, they are more than {PAIRS_DRAWN}; --pairs (pairs=True) draws them."]
    return replace(recording, notes=(*recording.notes, *notes))


def next_window(begin: float) -> str:
    """Returns the sentence that names the next window, from a time on."""
    return f"The next window: --from {begin!r}, in Python begin={begin!r}"


def shown_up_to(rows: BoundedRows, of: str) -> str:
    """Returns the sentence of a page that does not show all rows ``of`` a window."""
    kept, end = rows.rows, rows.end
    part = " (where more happens)" if len(kept) == rows.limit and kept["time"][0] == end else ""
    return f"Shown up to {end!r}{part}{of}: {rows.limit:,} events are as many as a page takes."


def _with_steps(
    recording: Recording,
    again: Simulation,
    clock: Clock,
    begin: float,
    pairs: bool | None,
    progress: Callable[[float, str], None],
) -> Recording:
    """Steps a simulation through a window, and returns the recording with its steps."""
    events = np.append(-1, np.flatnonzero(~np.isin(recording.rows["b"], (REANCHORED, HELD)))) + 1
    seen: list[tuple[int, int, int, int]] = []
    met = 0
    log, queue, notes = StructureLog(recording.pairs), [], recording.notes
    until = math.nextafter(clock.moment(recording.end)[0], math.inf)
    try:
        if begin > again.time:
            again.run(begin)
        drawing = again.drawing()
        log.pairs = wants_pairs(pairs, drawing)
        log.see(0, drawing)
        queue.append(_queued(again))
        margin = float(again.tables.clock[0].limits.margin)
        if margin and drawing:
            notes += (
                "The broad phase sees accelerated bodies on straight chords, and its structure is drawn on "
                f"the bodies, which are off their chords by {margin:.3g} at most; the end of a chord is a "
                "structural event.",
            )
        for number, event in enumerate(again.steps(until), 1):
            if event.epoch * TICKS + event.tick > recording.end:
                break
            progress(number / MOST_STEPS, f"{recording.label}: {number:,} of at most {MOST_STEPS:,} steps")
            if number > MOST_STEPS:
                before = clock.before(event.epoch * TICKS + event.tick)
                most = f"a page has those of {MOST_STEPS:,} steps"
                notes += (f"Structural events are shown up to {before!r}: {most}. {next_window(before)}",)
                break
            if event.kind == "structural":
                seen.append((event.epoch, event.tick, int(event.certificate or 0), int(events[met])))
            else:
                met = min(met + 1, len(events) - 1)
            queue.append(_queued(again))
            leaves = event.kind == "part" and not set(event.bodies) <= set(again.bodies.tolist())
            if not (log.full or leaves):  # its removal, which ended the passing, follows
                log.see(number, again.drawing())
    except KinetileError as error:
        if not recording.notes:  # the free run has noted the fault
            notes += (f"Stepping ended with a fault, {type(error).__name__}: {error}",)
    if log.full:
        rest = "it is computed from the positions"
        if not recording.drawn_as:
            rest = "there is too much of it for a page"
        notes += (f"The structure is recorded up to event {log.seen}; after it, {rest}.",)
    epoch, tick, body, after = np.array(seen, np.int64).reshape(-1, 4).T
    stepped = Steps(epoch, tick, body, after, np.array(queue, np.int64), log)
    return replace(recording, stepped=stepped, notes=notes, pairs=log.pairs)


def _queued(simulation: Simulation) -> int:
    return int(np.count_nonzero(np.asarray(simulation.tables.queue["key"]) != NEVER))


PLAYED_KINDS = (
    *("structural", "disc", "wall", "turn", "insert", "remove"),
    *("pass", "part", "anchor", "accelerate", "hold", "kind", "move"),
)
"""Kinds of events by their number in a page; "anchor" is a plan that the clock has anchored again, "hold" a
plan with another present acceleration."""


_COMMANDS = {each.code: PLAYED_KINDS.index(each.event) for each in COMMAND_KINDS}
_COMMANDS |= {REANCHORED: PLAYED_KINDS.index("anchor"), HELD: PLAYED_KINDS.index("hold")}
"""The same numbers by the codes of the log."""


@dataclass(frozen=True)
class PlayedPlans:
    """The bodies by number, (n,) each: radius (NaN if unknown) and mass; 1 for present bodies; the plan of
    each: (epoch, tick) of its anchor, its position there, its velocity, and its acceleration, the present
    and the whole one; and the number of periods that were taken off its position since its first one, along x
    and y, or will be when it is inserted."""

    radius: Floats
    mass: Floats
    there: Floats
    epoch: Floats
    tick: Floats
    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    ax: Floats
    ay: Floats
    wx: Floats
    wy: Floats
    kx: Floats
    ky: Floats

    @classmethod
    def of(cls, scene: Scene, rows: Array) -> Self:
        """Returns the plans at a scene's start, with room for all bodies of the scene and of the rows."""
        comers = [each for each in scene.commands if isinstance(each, Insert)]
        named = [int(rows[name].max(initial=-1)) for name in "ab"]
        n, last = len(scene), max([*named, *(each.body for each in comers), len(scene) - 1])
        columns = {name: np.zeros(last + 1) for name in cls.__dataclass_fields__}
        columns["radius"][n:] = np.nan
        columns["mass"][n:] = 1.0
        columns["radius"][:n], columns["mass"][:n], columns["there"][:n] = scene.radius, scene.mass, 1.0
        columns["x"][:n], columns["y"][:n] = nearest_image(scene.position, scene.periods).T
        columns["vx"][:n], columns["vy"][:n] = scene.velocity.T
        columns["ax"], columns["ay"] = first_accelerations(scene, last + 1).T.copy()
        columns["wx"], columns["wy"] = columns["ax"].copy(), columns["ay"].copy()
        for each in comers:
            columns["radius"][each.body], columns["mass"][each.body] = each.radius, each.mass
        if scene.periodic:
            first = np.concatenate([scene.position, np.reshape([each.position for each in comers], (-1, 2))])
            off = whole_periods(first - nearest_image(first, scene.periods), scene.periods)
            numbers = [*range(n), *(each.body for each in comers)]
            columns["kx"][numbers], columns["ky"][numbers] = off.T
        return cls(**columns)

    def of_run(self, simulation: Simulation) -> "PlayedPlans":
        """Returns the plans of a run of the scene as they are now."""
        columns = {name: array.copy() for name, array in vars(self).items()}
        tables = simulation.tables
        clock = Clock(0.0, 1.0, int(tables.clock[0].epoch))
        taken = np.flatnonzero(tables.queue["number"] >= 0)
        bodies, numbers = np.asarray(tables.bodies)[taken], np.asarray(tables.queue["number"])[taken]
        columns["there"][:] = 0.0
        columns["there"][numbers] = 1.0
        _, columns["epoch"][numbers], columns["tick"][numbers] = clock.split(bodies["anchor"])
        for name in (*(AcceleratedPlan if simulation.scene.accelerated else Plan)._fields, "radius"):
            columns[name][numbers] = bodies[name]
        columns["wx"][numbers], columns["wy"][numbers] = simulation.whole_accelerations().T
        if len(tables.images):
            for name in ("kx", "ky"):
                columns[name][numbers] = np.asarray(tables.images[name])[taken]
        return PlayedPlans(**columns)


def kinds_of(rows: Array) -> npt.NDArray[np.uint8]:
    """Returns the kind of each row as its place in ``PLAYED_KINDS``."""
    a, b = rows["a"], rows["b"]
    kinds = np.where(b >= 0, np.where(np.isnan(rows["ax"]), np.where(a < b, 6, 7), 1), 2)
    for code, kind in _COMMANDS.items():
        kinds[b == code] = kind
    return kinds.astype(np.uint8)


def residuals(plans: PlayedPlans, rows: Array, scene: Scene) -> dict[str, npt.NDArray[np.uint64]]:
    """Returns columns ax .. bvy, (rows,) each: the bits that differ between a row and its prediction.

    A body is at the position of its plan, with the velocity of its plan; but if two bodies of one mass meet,
    b gets the momentum that a has lost. Columns without a plan (b of a wall, for example) are 0; but in a row
    that gives a its acceleration, bx and by are the bits of its difference from the acceleration before.
    """
    flights = Flights.of(rows)

    def before(of_plan: Floats, of_flight: Floats) -> Floats:
        """Returns the value before each flight: the value of the body's flight before it."""
        return np.where(flights.before >= 0, of_flight[flights.before], of_plan[flights.body])

    epoch, tick = (rows[name][flights.row].astype(np.float64) for name in ("epoch", "tick"))
    ticks = (epoch - before(plans.epoch, epoch)) * float(TICKS) + (tick - before(plans.tick, tick))
    elapsed = ticks * (scene.time_unit / TICKS)
    columns = {name: np.zeros(len(rows), np.uint64) for pair in COLUMNS_OF.values() for name in pair}
    found = {name: flights.value(name) for name in COLUMNS_OF}
    given = flights.accelerations(np.stack([plans.ax, plans.ay], axis=1))
    found |= {"ax": given[:, 0], "ay": given[:, 1]}
    was = AcceleratedPlan(*(before(getattr(plans, name), flies) for name, flies in found.items()))
    for name, begins in (("ax", was.ax), ("ay", was.ay)):
        changes = _bits(found[name]) ^ _bits(begins)
        columns[f"b{name[1]}"][flights.row[changes != 0]] = changes[changes != 0]
    places, speeds = accelerated_position_after(was, elapsed), accelerated_velocity_after(was, elapsed)
    for axis, flown, ends in zip("xy", places, speeds, strict=True):
        flies = found[f"v{axis}"]
        keeps = ends.copy()
        second = np.flatnonzero(flights.is_b)  # the a of its row is right before it
        same = second[plans.mass[flights.body[second]] == plans.mass[flights.body[second - 1]]]
        keeps[same] = ends[same] + (ends[same - 1] - flies[same - 1])
        for name, bits in (
            (axis, _bits(found[axis]) ^ _bits(flown)),
            (f"v{axis}", _bits(flies) ^ _bits(keeps)),
        ):
            for side, column in enumerate(COLUMNS_OF[name]):
                mine = flights.is_b == bool(side)
                columns[column][flights.row[mine]] = bits[mine]
    return columns


def _bits(numbers: Floats) -> npt.NDArray[np.uint64]:
    return np.ascontiguousarray(numbers, np.float64).view(np.uint64)


DRAWN = (Segment, Box, Polygon, Link, Entry)
"""Shapes by their number in a page; roles are numbered by their place in ``ORDER``."""

MOST_LOOKS = 4_000_000
"""The limit of checks, one for each shape after each event: some twenty seconds."""


class StructureLog:
    """Log of the present shapes after each number of events: ``full`` if the limit of checks is reached,
    after ``seen`` events."""

    def __init__(self, pairs: bool = True) -> None:
        """Makes a log, without links between bodies unless there are ``pairs``."""
        self.full = False
        self.pairs = pairs
        self.seen = 0
        self._looks = 0
        self._open: dict[Item, int] = {}
        self._closed: list[tuple[int, int, Item]] = []
        self._again: set[tuple[int, Item]] = set()

    def see(self, done: int, items: Iterable[Item]) -> None:
        """Adds the present shapes after this many events."""
        self.seen = done
        before, now, new = self._open, {}, []
        for item in items:
            if not self.pairs and isinstance(item, Link):
                continue
            first = before.pop(item, None)
            if first is not None:
                now[item] = first
            elif item not in now:  # listed twice, it is there once
                now[item] = done
                new.append(item)
        self._looks += len(now)
        self.full = self._looks > MOST_LOOKS
        self._closed += [(first, done, item) for item, first in before.items()]
        existing = set(map(_without_certificate, before))
        self._again.update((done, item) for item in new if _without_certificate(item) in existing)
        self._open = now

    def columns(self) -> dict[str, Array] | None:
        """Returns the log: for each shape its number in ``DRAWN``, role, label (a place in ``labels``), the
        numbers of events at its creation and its removal (``first``, ``last``), (epoch, tick) of its
        certificate's failure (NaN: never), ``fresh`` (1: it is new, 0: it existed before with another
        certificate), and its coordinates, x before y: ``size`` entries of the columns ``body`` (-1: fixed),
        ``offset`` and ``turns``. Returns None without shapes."""
        spans = [*self._closed, *((first, self.seen + 1, item) for item, first in self._open.items())]
        if not spans:
            return None
        spans.sort(key=lambda span: (ORDER.index(span[2].role), span[0], span[1]))
        begin, end, items = zip(*spans, strict=True)
        labels, points = self.labels, [[*_coordinates(item)] for item in items]
        body, offset, turns = zip(*chain.from_iterable(points), strict=True)
        fails = [(np.nan, np.nan) if item.fails is None else divmod(item.fails, TICKS) for item in items]
        whole: dict[str, Sequence[int]] = {
            "first": begin,
            "last": end,
            "shape": [DRAWN.index(type(item)) for item in items],
            "role": [ORDER.index(item.role) for item in items],
            "label": [labels.index(item.label) for item in items],
            "size": [*map(len, points)],
            "body": body,
            "turns": turns,
        }
        columns: dict[str, Array] = {name: np.array(values, np.int32) for name, values in whole.items()}
        columns["fresh"] = np.array([(first, item) not in self._again for first, _, item in spans], np.uint8)
        columns["epoch"], columns["tick"] = np.array(fails, np.float64).T
        return columns | {"offset": np.array(offset, np.float64)}

    @property
    def labels(self) -> list[str]:
        """The labels of shapes, in the order of their numbers in ``columns``."""
        return sorted({item.label for item in [*(item for *_, item in self._closed), *self._open]})


def _without_certificate(item: Item) -> tuple[Any, ...]:
    """Returns the identity of a shape: without its failure time, and outside a matrix without its label."""
    return type(item), item.label if isinstance(item, Entry) else "", *_coordinates(item)


def _coordinates(item: Item) -> Iterator[tuple[int, float, int]]:
    """Yields the coordinates of a shape, x before y: the body (-1: fixed), the offset, the periods."""
    for each in chain.from_iterable(points_of(item)):
        yield each if isinstance(each, At) else (-1, each, 0)
