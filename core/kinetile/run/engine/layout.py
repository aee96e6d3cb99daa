"""Tables of the kernel, made from their contents: at the start, for a saved run that continues, and for the
bodies of a run whose phases are prepared again.

All of them are new objects, which the engine adopts: if a phase refuses, the old ones stay in use.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Array
from kinetile.errors import PhaseError
from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.compiled import python_of
from kinetile.kernel.images import FORESEEN
from kinetile.kernel.log import INSERTED
from kinetile.kernel.loop.commands import window_of
from kinetile.kernel.passings import MOST_IMAGES
from kinetile.kernel.tables import (
    FORM,
    IMAGE,
    KEPT,
    NEGATIVE_PARTNERS,
    NOBODY,
    PASSING,
    TRAIT,
    Kernel,
    Records,
    allocate,
    begun,
    clear,
    column,
    copy_carried,
    declared,
    pair_set,
    record_table,
)
from kinetile.plugin.calling import described
from kinetile.run.compose import Composition
from kinetile.run.engine.bounds import Bounds
from kinetile.run.engine.fields import Fields
from kinetile.run.engine.state import Contents, contents_of
from kinetile.run.prepared import LEAST_SLOTS, present_scene
from kinetile.scene import Scene
from kinetile.toolbox.reach import margin_of

OF_SIDES = ["left", "right", "down", "up"]
"""The reaches of a shape in the order of ``Shape.reaches``."""

LOG_ROWS = 1 << 14
"""Contacts of a chunk: few enough that the log stays in the processor's cache until it is hashed."""


def tables_of(contents: Contents, numbers: int, composition: Composition, unit: float) -> Kernel:
    """Returns tables with these contents, with slots for body numbers up to ``numbers``, for phases that are
    prepared for these bodies, or for one more that is to be inserted; ``unit`` is the clock's unit.

    Raises PhaseError if there is no memory for the requests of the broad phase.
    """
    plans, n, prepared = contents.plans, len(contents.plans), composition.prepared
    k = _allocated(n, composition)
    slots = np.full(numbers, NOBODY, dtype=np.int32)
    slots[plans["number"]] = np.arange(n)
    places = np.append(slots, NEGATIVE_PARTNERS)
    for table in (k.queue, k.bodies, k.traits, k.images):
        copy_carried(plans, table[:n], places)
    k.radii[:n], k.mass[:n] = plans["radius"], plans["mass"]
    if prepared.shapes:
        forms = record_table(FORM, len(prepared.shapes))
        forms.view(np.ndarray)[OF_SIDES] = [each.reaches for each in prepared.shapes]
        bodies = k.bodies[:n]
        for side in OF_SIDES:
            bodies[side] = k.sides[side][:n] = forms[side][plans["form"]]
        k = k._replace(forms=forms)
    k = k._replace(slots=slots, commands=contents.commands.view(np.recarray))
    if len(contents.passings):
        k = _with_passings(k, contents.passings, places)
    k.counts[0] = contents.counts[0]
    clock = k.clock[0]
    clock.per_tick, clock.per_time = unit / TICKS, TICKS / unit
    if prepared.arena is not None:
        clock.limits.width, clock.limits.height = prepared.arena
    clock.torus.x, clock.torus.y = prepared.periods
    clock.torus.per_x, clock.torus.per_y = (1.0 / each if each else 0.0 for each in prepared.periods)
    clock.torus.foreseen = FORESEEN
    clock.torus.half_x, clock.torus.half_y = (0.5 * each if each else math.inf for each in prepared.periods)
    clock.lists.commands = len(contents.commands)
    copy_carried(contents.clock, k.clock, places)
    return k


def _allocated(bodies: int, composition: Composition) -> Kernel:
    scene = composition.prepared
    slots = scene.capacity if composition.living else len(scene)
    pairs, room = int(composition.broad.pairs), max(int(composition.broad.room), slots)
    rows = LOG_ROWS
    if composition.rules is not None:  # a command may end a passing with every other body
        rows = max(rows, (2 * MOST_IMAGES if scene.periodic else 2) * slots)
    try:
        k = allocate(
            slots, room, rows, composition.alike, bool(scene.shapes), scene.accelerated, scene.resting
        )
        if pairs:
            k = pair_set(k, pairs)
        if composition.pair is not None and composition.pair.numbers is not None:
            k = k._replace(numbers=composition.pair.numbers.copy())
        if scene.periodic:
            k = k._replace(images=record_table(IMAGE, slots))
        if composition.rules is not None:
            k.clock[0].kinds, k.clock[0].lists.free_passing = composition.rules.kinds, NOBODY
            passers = np.full(slots, NOBODY, dtype=np.int32)
            traits = begun(record_table(TRAIT, slots))
            k = k._replace(traits=traits, rules=composition.rules.table.copy(), passers=passers)
    except MemoryError as error:
        who = described("broad phase", composition.broad_phase)
        text = f"there is no memory for its {pairs} pairs and for {room} bodies near one"
        raise PhaseError(f"{who}: {text}") from error
    k.queue.number[bodies:] = k.slots[bodies:] = NOBODY
    clock = k.clock[0]
    clock.bodies = clock.present = bodies
    clock.jam.spin_limit = 2 * (2 * slots + 2) ** 2 + 1000  # without progress: then a run has stalled
    clock.jam.window_size = python_of(window_of)(bodies)
    return k


def with_room(log: Records, rows: int) -> Records:
    """Returns a log, or a longer one with its rows, if it has less room than this."""
    if len(log) >= rows:
        return log
    longer = record_table(log.dtype, rows)
    longer[: len(log)] = log
    return longer


def more_passings(k: Kernel, room: int) -> Kernel:
    """Returns the tables with room for this many passing pairs; present ones stay."""
    old, lists = k.passings, k.clock[0].lists
    new = record_table(PASSING, max(room, len(old)))
    new[: len(old)] = old
    new.a[len(old) :] = NOBODY
    new.next_a[len(old) :] = [*range(len(old) + 1, len(new)), int(lists.free_passing)][: len(new) - len(old)]
    if len(new) > len(old):
        lists.free_passing = len(old)
    return k._replace(passings=new)


def _with_passings(k: Kernel, passings: Array, places: npt.NDArray[np.int32]) -> Kernel:
    """Returns tables with these passings, in the lists of their bodies, and with the bodies' counts."""
    count, traits = len(passings), k.traits
    table = record_table(PASSING, count)
    copy_carried(passings, table, places)
    np.minimum.at(traits.leave, table.a, table.tick)
    body, pair = np.concatenate([table.a, table.b]), np.tile(np.arange(count, dtype=np.int32), 2)
    np.add.at(traits.inside, body, 1)
    order = np.argsort(body, kind="stable")
    body, pair, of_a = body[order], pair[order], order < count
    first = np.append(True, body[1:] != body[:-1])
    before = np.where(first, NOBODY, np.roll(pair, 1))
    after = np.where(np.roll(first, -1), NOBODY, np.roll(pair, -1))
    for side, which in (("a", of_a), ("b", ~of_a)):
        table[f"prev_{side}"][pair[which]], table[f"next_{side}"][pair[which]] = before[which], after[which]
    k.passers[body[first]] = pair[first]
    k.clock[0].lists.passings = count
    return k._replace(passings=table)


def set_limits(k: Kernel, bounds: Bounds, composition: Composition) -> None:
    """Writes the values that follow from the bounds: the bodies' reach, the validity and accuracy of the
    common clock, and the radii that the phases are prepared for."""
    clock, prepared = k.clock[0], composition.prepared
    limits = clock.limits
    skin, extent, speed = bounds.skin, bounds.extent, bounds.speed
    # If the masses are one number, the phases are prepared again before any insertion.
    limits.least = math.inf if k.mass.strides == (0,) else prepared.radius.min(initial=math.inf)
    limits.widest = prepared.radius.max(initial=0.0)
    if len(k.forms):  # the longest reach to a side may belong to a body whose circle is not the widest
        longest = np.max([k.forms[side] for side in OF_SIDES], axis=0)
        widest = longest[prepared.shape].max(initial=0.0)
        k.forms.prepared = (longest <= widest) & (longest >= longest[prepared.shape].min(initial=math.inf))
    k.bodies.reach = k.bodies.radius + skin.delta
    limits.speed2, limits.faster = speed * speed, 0
    limits.margin = margin_of(prepared, composition.broad.skin_limit)
    limits.skin, limits.theta, limits.tolerance = skin.delta, skin.theta, skin.tolerance
    span = SPAN // 2
    if speed > 0.0:
        span = int(min(4.0 * extent / speed * float(clock.per_time), float(span)))
    limits.span = span
    time = span * float(clock.per_tick)
    bend = 0.5 * sum(prepared.pull) * time * time  # of plans that are seen where they are not yet, or no more
    limits.fat = skin.fat(extent + 2.0 * speed * time + bend)


class Renewed(NamedTuple):
    """Phases, and tables for them, for the rest of a run."""

    composition: Composition
    k: Kernel


def renewed(
    k: Kernel, scene: Scene, composition: Composition, coming: Records | None = None, roomy: bool = False
) -> Renewed:
    """Prepares the phases for the present bodies, and for bodies that given commands insert; with twice as
    many slots if all are taken, or if ``roomy``. Raises Refused if a phase does not accept that."""
    contents, slots = contents_of(k), len(k.bodies)
    needed = len(contents.plans) + (0 if coming is None else len(coming))
    capacity = max(2 * slots, needed, LEAST_SLOTS) if roomy or needed > slots else slots
    present = present_scene(contents.plans, contents.clock["now"], scene, capacity, coming)
    new = _renewed(k, contents, scene, composition.prepared_for(present))
    if coming is not None:  # all before it has happened: the stop of a run does not count
        new.k.clock.now = coming.tick[0]
    return new


def carried_out(k: Kernel, scene: Scene, composition: Composition, many: int) -> Renewed:
    """Runs the next commands, one insertion or removal, or ``many`` insertions that have room in the log, and
    prepares the phases for the bodies after them. Raises Refused if a phase does not accept that."""
    first = int(k.clock[0].lists.command)
    commands = k.commands[first : first + many]
    if int(commands[0].code) == INSERTED:
        contents = contents_of(k)
        composition = composition.prepared_for(
            present_scene(contents.plans, contents.clock["now"], scene, 0, commands)
        )
        new = _renewed(k, contents, scene, composition)  # with empty slots
        clear(new.k)  # a passing that begins files its bodies
        carry_out = composition.carrying_out()
        for _ in commands:
            carry_out(new.k, composition.broad.state)
        return new
    aside = Kernel(*(table.copy() for table in k))._replace(met=k.met, log=k.log)
    composition.carrying_out()(aside, composition.broad.state)
    contents = contents_of(aside)
    composition = composition.prepared_for(present_scene(contents.plans, contents.clock["now"], scene, 0))
    return _renewed(aside, contents, scene, composition)


def _renewed(k: Kernel, contents: Contents, scene: Scene, composition: Composition) -> Renewed:
    new = tables_of(contents, len(k.slots), composition, scene.time_unit)
    if len(k.pairs) > len(new.pairs):  # they have outgrown the room that the phase requests
        new = pair_set(new, len(k.pairs))
    watched = {name: getattr(k, name) for name in ("watch", "watched", "watched_kinds")}
    new = new._replace(met=with_room(k.met, len(new.met)), log=k.log, **watched)
    for field in declared(k.clock.dtype, KEPT):
        column(new.clock, field.name)[0] = column(k.clock, field.name)[0]
    return Renewed(composition, more_passings(new, len(k.passings)))


FEW = 256
"""The smallest number of heads in a chunk that sets a length."""


def steps(count: Fields) -> int:
    """Returns the number of entries at the head so far, except right guesses."""
    return int(count.asks[0] + count.structural[0])


def first_shift(k: Kernel, extent: float) -> int:
    """Returns an initial shift: for the number of events in a gas of discs."""
    n = len(k.bodies)
    squares = float(np.sum(k.bodies.vx**2 + k.bodies.vy**2)) if n else 0.0
    events = 8.0 * n * math.sqrt(n) * math.sqrt(squares / n) / extent if squares > 0.0 else 1.0
    return _shift(k, float(k.clock[0].per_time) / events)


def fit(k: Kernel, fields: Fields, ticks: int, heads: int) -> None:
    """Sets the length of slices to the mean distance of heads, by their number in a time of some ticks."""
    if heads > FEW:
        shift = _shift(k, ticks / heads)
        if abs(shift - fields.calendar.shift[0]) > 1:
            fields.calendar.shift[0] = shift
            fields.calendar.filed[0] = 0


def _shift(k: Kernel, ticks: float) -> int:
    """Returns the shift for slices of about this many ticks; a year is no longer than a span of the clock."""
    most = 61 - len(k.rings).bit_length()
    return min(max(round(math.log2(max(ticks, 1.0))), 1), most)


def as_bytes(table: Array) -> Array:
    """Returns a view of records as bytes, padding included, which copies ten times as fast; other arrays as
    they are."""
    plain = np.asarray(table)
    packed = plain.dtype.names is not None and plain.flags.c_contiguous
    return plain.reshape(-1).view(np.uint8) if packed else plain
