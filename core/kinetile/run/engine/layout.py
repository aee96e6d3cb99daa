"""Tables of the kernel, made and filled: for a scene at its start, for the bodies of a run whose phases are
prepared anew, and for the contents of a snapshot.

All of them are new objects, which the engine adopts: if a phase refuses, the old ones stay in use.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.errors import PhaseError
from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.compiled import python_of
from kinetile.kernel.flight import positions_now
from kinetile.kernel.images import BEAT
from kinetile.kernel.log import INSERTED
from kinetile.kernel.loop.commands import LONG_AGO, window_of
from kinetile.kernel.passings import MOST_IMAGES
from kinetile.kernel.tables import (
    IMAGE,
    NEVER,
    NOBODY,
    PASSING,
    TRAIT,
    Kernel,
    Records,
    allocate,
    column,
    equal,
    pair_set,
    record_table,
    slots_taken,
)
from kinetile.plugin.calling import described
from kinetile.run.compose import Composition, Rules
from kinetile.run.engine.bounds import Bounds
from kinetile.run.engine.fields import Fields
from kinetile.run.prepared import LEAST, Prepared, standing
from kinetile.scene import Scene
from kinetile.scene.bodies import nearest_image, overlapping_images
from kinetile.scene.checks import TOLERANCE

LOG_ROWS = 1 << 14
"""Contacts of a chunk: few enough that the log stays in the processor's cache until it is hashed."""

OF_SLOTS = ("bodies", "present", "lists.vacant", "jam.spin_limit", "jam.window_size")
"""Fields of the clock that depend on how many slots there are, and who stands in them."""


def tables_of(scene: Scene, composition: Composition, unit: float) -> Kernel:
    """Returns tables for a scene under its phases; ``unit`` is that of the clock.

    Raises PhaseError if there is no memory for the requests of the broad phase.
    """
    n = len(scene)
    k = _allocated(n, scene, composition)
    bodies = k.bodies[:n]
    bodies.x, bodies.y = scene.position.T
    bodies.vx, bodies.vy = scene.velocity.T
    bodies.radius = k.radii[:n] = scene.radius
    bodies.last = NOBODY
    if scene.shapes:
        bodies.form = scene.shape
        reaches = np.array([each.reaches for each in scene.shapes])[scene.shape]
        for side, column_of_side in zip(("left", "right", "down", "up"), reaches.T, strict=True):
            bodies[side] = k.sides[side][:n] = column_of_side
    k.mass[:n] = scene.mass
    if len(k.rules):
        k.traits.kind[:n] = scene.kind_numbers
    clock = k.clock[0]
    clock.tick = unit / TICKS
    clock.per_time = TICKS / unit
    if scene.arena is not None:
        clock.limits.width, clock.limits.height = scene.arena
    if scene.periodic:
        _wind_up(k, scene)
    clock.jam.window_tick = clock.met_tick = clock.stops.tick = LONG_AGO
    return k


def _wind_up(k: Kernel, scene: Scene) -> None:
    """Writes the periods of a scene, and takes them off the places of its bodies."""
    torus, n = k.clock[0].torus, len(scene)
    torus.x, torus.y = scene.periods
    torus.per_x, torus.per_y = (1.0 / period if period else 0.0 for period in scene.periods)
    torus.half_x, torus.half_y = (0.5 * period if period else math.inf for period in scene.periods)
    torus.beat = BEAT
    k.bodies.x[:n], k.bodies.y[:n] = nearest_image(scene.position, scene.periods).T
    for name, at, place, period in zip(
        ("kx", "ky"), (k.bodies.x, k.bodies.y), scene.position.T, scene.periods, strict=True
    ):
        if period:
            k.images[name][:n] = np.rint((place - at[:n]) / period)


def moved(old: Kernel, taken: Any, scene: Scene, composition: Composition) -> Kernel:
    """Returns tables for the bodies in some slots of others, in this order and without a gap between them;
    clock, counts, commands and log are kept. ``scene`` has these bodies, or one more to be inserted.

    Raises PhaseError as ``tables_of`` does.
    """
    n = len(taken)
    k = _allocated(n, scene, composition)
    k = k._replace(
        slots=np.full_like(old.slots, NOBODY),
        commands=old.commands,
        met=with_room(old.met, len(k.met)),
        log=old.log,
        watch=old.watch,
        watched=old.watched,
    )
    new_slot = np.full(len(old.bodies) + 1, NOBODY)  # with one more, for NOBODY
    new_slot[taken] = np.arange(n)
    k.bodies[:n] = old.bodies[taken]
    k.bodies[:n].last = new_slot[old.bodies.last[taken]]
    k.radii[:n], k.mass[:n] = old.radii[taken], old.mass[taken]
    if len(k.sides):
        k.sides[:n] = old.sides[taken]
    if len(k.images):
        k.images[:n] = old.images[taken]
    if len(k.rules):
        k.traits[:n] = old.traits[taken]
        k = _with_passings(k, old, new_slot)
    k.queue.number[:n] = old.queue.number[taken]
    k.slots[old.queue.number[taken]] = np.arange(n)
    k.counts[0] = old.counts[0]
    own = k.clock.copy()
    k.clock[0] = old.clock[0]
    for name in OF_SLOTS:
        column(k.clock, name)[0] = column(own, name)[0]
    return k


def _allocated(bodies: int, scene: Scene, composition: Composition) -> Kernel:
    """Returns tables for a number of bodies in the first slots, and the free slots that the phases allow
    for."""
    slots = scene.capacity if composition.living else len(scene)
    pairs, room = int(composition.broad.pairs), max(int(composition.broad.room), slots)
    rows = LOG_ROWS
    if composition.rules is not None:  # a command may end a passing with every other body
        rows = max(rows, (2 * MOST_IMAGES if scene.periodic else 2) * slots)
    try:
        k = allocate(slots, room, rows, composition.alike, bool(scene.shapes))
        if pairs:
            k = pair_set(k, pairs)
        if composition.pair is not None and composition.pair.numbers is not None:
            k = k._replace(numbers=composition.pair.numbers.copy())
        if scene.periodic:
            k = k._replace(images=record_table(IMAGE, slots))
        if composition.rules is not None:
            k = _with_rules(k, composition.rules)
    except MemoryError as error:
        who = described("broad phase", composition.broad_phase)
        said = f"there is no memory for its {pairs} pairs and for {room} bodies near one"
        raise PhaseError(f"{who}: {said}") from error
    k.queue.number[bodies:] = k.slots[bodies:] = NOBODY
    clock = k.clock[0]
    clock.bodies = clock.present = bodies
    clock.jam.spin_limit = spin_limit(slots)
    clock.jam.window_size = python_of(window_of)(bodies)
    return k


def spin_limit(slots: int) -> int:
    """Returns the number of structural events without progress after which a run has stalled."""
    return 2 * (2 * slots + 2) ** 2 + 1000


def with_room(log: Records, rows: int) -> Records:
    """Returns a log, or a longer one with its rows, if it has less room than this."""
    if len(log) >= rows:
        return log
    longer = record_table(log.dtype, rows)
    longer[: len(log)] = log
    return longer


def _with_rules(k: Kernel, rules: Rules) -> Kernel:
    """Returns the tables with what responses need."""
    slots = len(k.bodies)
    traits = record_table(TRAIT, slots)
    traits.leave, traits.touched = NEVER, LONG_AGO
    k.clock[0].kinds = rules.kinds
    k.clock[0].lists.passable = NOBODY
    return k._replace(traits=traits, rules=rules.table, passers=np.full(slots, -1, dtype=np.int32))


def more_passings(k: Kernel, room: int) -> Kernel:
    """Returns the tables with room for this many passing pairs; present ones stay."""
    old, lists = k.passings, k.clock[0].lists
    new = record_table(PASSING, max(room, len(old)))
    new[: len(old)] = old
    new.a[len(old) :] = NOBODY
    new.next_a[len(old) :] = [*range(len(old) + 1, len(new)), int(lists.passable)][: len(new) - len(old)]
    if len(new) > len(old):
        lists.passable = len(old)
    return k._replace(passings=new)


def overlapping(scene: Scene) -> npt.NDArray[np.int64]:
    """Returns (m, 2) the bodies that overlap at the start, the elder first, in their order; where an axis is
    periodic those that may: ``responses.begin_through_images`` decides that for each image."""
    if not scene.responses or scene.shapes:  # no narrow phase for shapes lets bodies pass, so none overlap
        return np.zeros((0, 2), dtype=np.int64)
    tolerance = 0.0 if scene.periodic else TOLERANCE
    overlaps = overlapping_images(scene.position, scene.radius, scene.periods, tolerance)
    found = [*overlaps, np.zeros((0, 2), dtype=np.int64)]
    pairs = np.concatenate(found)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def _with_passings(k: Kernel, old: Kernel, new_slot: Any) -> Kernel:
    """Returns tables with the passing pairs of other tables, by their new slots."""
    passings = record_table(PASSING, len(old.passings))
    passings[:] = old.passings
    live = passings.a >= 0
    passings.a[live], passings.b[live] = new_slot[old.passings.a[live]], new_slot[old.passings.b[live]]
    k.passers[: len(new_slot)] = -1
    heads = new_slot[:-1]
    k.passers[heads[heads >= 0]] = old.passers[heads >= 0]
    return k._replace(passings=passings)


def set_limits(k: Kernel, bounds: Bounds, prepared: Scene) -> None:
    """Writes the values that follow from the bounds: the bodies' reach, the validity and accuracy of the
    common clock, and the radii for which the phases have been ``prepared``."""
    clock = k.clock[0]
    limits = clock.limits
    skin, extent, speed = bounds.skin, bounds.extent, bounds.speed
    # Where masses are one number, no insertion finds a place before the phases are prepared for it.
    limits.least = math.inf if k.mass.strides == (0,) else prepared.radius.min(initial=math.inf)
    limits.widest = prepared.radius.max(initial=0.0)
    k.bodies.reach = k.bodies.radius + skin.delta
    limits.speed2, limits.faster = speed * speed, 0
    limits.skin, limits.theta, limits.tolerance = skin.delta, skin.theta, skin.tolerance
    span = SPAN // 2
    if speed > 0.0:
        span = int(min(4.0 * extent / speed * float(clock.per_time), float(span)))
    limits.span = span
    limits.fat = skin.fat(extent + 2.0 * speed * (span * float(clock.tick)))


class Renewed(NamedTuple):
    """Phases, and tables for them, with which a run continues."""

    composition: Composition
    k: Kernel


def renewed(
    k: Kernel, scene: Scene, composition: Composition, coming: Records | None = None, roomy: bool = False
) -> Renewed:
    """Prepares the phases for the present bodies, and for one that a command inserts, if given;
    with twice as many slots if they are all taken, or if ``roomy``.

    Raises Refused if a phase does not accept that.
    """
    taken, slots = slots_taken(k), len(k.bodies)
    full = coming is not None and len(taken) == slots
    capacity = max(2 * slots, LEAST) if roomy or full else slots
    stands = _standing(k, scene, taken, capacity, coming)
    composition = composition.prepared_for(stands)
    return Renewed(composition, moved(k, taken, stands, composition))


def carried_out(k: Kernel, scene: Scene, composition: Composition) -> Renewed:
    """Runs the next command, an insertion or removal, and prepares the phases for the bodies
    after it.

    Raises Refused if a phase does not accept that.
    """
    command = k.commands[int(k.clock[0].lists.command)]
    taken = slots_taken(k)
    if int(command.code) == INSERTED:
        stands = _standing(k, scene, taken, 0, command)
        composition = composition.prepared_for(stands)
        new = moved(k, taken, stands, composition)  # with an empty slot
        composition.obeying()(new, composition.broad.state)
        return Renewed(composition, new)
    obeying, state = composition.obeying(), composition.broad.state
    stays = taken[taken != int(k.slots[command.body])]
    stands = _standing(k, scene, stays, 0, None)
    composition = composition.prepared_for(stands)
    aside = Kernel(*(table.copy() for table in k))._replace(met=k.met, log=k.log)
    obeying(aside, state)
    return Renewed(composition, moved(aside, stays, stands, composition))


def _standing(k: Kernel, scene: Scene, taken: Any, capacity: int, coming: Records | None) -> Prepared:
    """Returns the present scene, with the bodies in these slots and perhaps one more."""
    bodies = k.bodies[taken]
    columns = {
        "position": positions_now(k, taken),
        "velocity": np.column_stack([bodies.vx, bodies.vy]),
        "radius": k.radii[taken],
        "mass": k.mass[taken],
        "kind_numbers": k.traits.kind[taken].astype(np.int64)
        if len(k.rules)
        else np.zeros(len(taken), np.int64),
    }
    if scene.shapes:  # nobody comes into such a scene: numbers are those of the start
        columns["shape"] = scene.shape[k.queue.number[taken]]
    if coming is not None:
        new = {
            "position": (coming.x, coming.y),
            "velocity": (coming.vx, coming.vy),
            "radius": coming.radius,
            "mass": coming.mass,
            "kind_numbers": coming.kind,
        }
        columns = {name: np.concatenate([column, [new[name]]]) for name, column in columns.items()}
    return standing(scene, columns, max(capacity, len(columns["radius"])))


FEW = 256
"""Heads in a chunk; from fewer no length is taken."""


def steps(count: Fields) -> int:
    """Returns how many entries came to the head so far, except guesses that were right."""
    return int(count.asks[0] + count.structural[0])


def first_shift(k: Kernel, extent: float) -> int:
    """Returns an initial shift: for the number of events in a gas of discs."""
    n = len(k.bodies)
    squares = float(np.sum(k.bodies.vx**2 + k.bodies.vy**2)) if n else 0.0
    events = 8.0 * n * math.sqrt(n) * math.sqrt(squares / n) / extent if squares > 0.0 else 1.0
    return _shift(k, float(k.clock[0].per_time) / events)


def fit(k: Kernel, fields: Fields, since: int, heads: int) -> None:
    """Sets the length of slices to the mean distance of heads since a tick, by their number."""
    if heads > FEW and fields.now[0] > since:
        shift = _shift(k, (fields.now[0] - since) / heads)
        if abs(shift - fields.calendar.shift[0]) > 1:
            fields.calendar.shift[0] = shift
            fields.calendar.filed[0] = 0


def _shift(k: Kernel, ticks: float) -> int:
    """Returns the shift for slices of about this many ticks; a year is no longer than a span of the clock."""
    most = 61 - (len(k.marks).bit_length() + 6)
    return min(max(round(math.log2(max(ticks, 1.0))), 1), most)


def copied(table: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Returns a plain copy of an array, in C order; TypeError for one of Python objects, which a copy of
    bytes cannot restore."""
    if table.dtype.hasobject:
        raise TypeError(f"arrays of Python objects ({table.dtype}) cannot be held: their bytes mean nothing")
    if table.dtype.names is None or not table.flags.c_contiguous:
        return np.array(table, order="C")
    # As bytes: numpy copies records field by field, which takes ten times as long.
    return as_bytes(table).copy().view(table.dtype).reshape(table.shape)


def as_bytes(array: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Returns the bytes of an array in C order, padding included."""
    return array.reshape(-1).view(np.uint8)


def fill(array: npt.NDArray[Any], content: npt.NDArray[Any]) -> None:
    """Restores the contents of an array, bit for bit. Read-only arrays have not changed."""
    flags = array.flags
    if not flags.writeable or not array.size:
        return
    if flags.c_contiguous:
        as_bytes(array)[:] = as_bytes(content)
    else:
        array[...] = content.view(array.dtype).reshape(array.shape)


def refilled(k: Kernel, content: Mapping[str, npt.NDArray[Any]], alike: bool) -> Kernel:
    """Returns tables with the copied contents of some of them: in place if the length is the same. Equal
    masses and radii are one number each if the phases are prepared for bodies that are ``alike``."""
    found = {}
    for name, saved in content.items():
        table = getattr(k, name)
        plain = np.asarray(table)  # the attributes of a record array are slow
        if alike and name in ("mass", "radii") and len(saved) and bool((saved == saved[0]).all()):
            if plain.strides != (0,) or plain.shape != saved.shape:
                table = plain = equal(saved[0], len(saved))
        elif plain.shape != saved.shape or plain.strides == (0,):
            if isinstance(table, np.recarray):
                table = record_table(np.dtype(plain.dtype), saved.shape[0])
            else:
                table = np.zeros(saved.shape, plain.dtype)
            plain = np.asarray(table)
        fill(plain, saved)
        found[name] = table
    return k._replace(**found)
