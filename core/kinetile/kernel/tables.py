"""The kernel's memory: arrays of records, packed in one named tuple that every hook receives as ``k``.

Records, not separate arrays: a body fits one cache line, and passing many arrays by value costs more than the
work on them. Counts and lengths that change are in the one-record tables ``clock`` and ``counts``, because a
named tuple cannot be changed in place. The clock contains a record for each of its purposes:
``k.clock[0].limits.width``.

The queue has one entry per body, with the first event that the body awaits: the failure of its structural
certificate from the broad phase, its first contact with another body (a *guess*, a lower bound, until it is
at the head of the queue and is computed exactly), or its contact with a wall (``kernel.loop.predictions``).

Bodies are inserted and removed. A body has a *slot*, its index in every table of bodies, and a *number*, its
name outside: in the log, in the order of events of one tick, and to the user. Later bodies reuse the slots of
removed ones; a number is never used twice. Hooks use slots only.
"""

import mmap
from contextlib import suppress
from enum import Enum, auto
from functools import cache
from threading import Lock
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import as_strided

from kinetile.arrays import Floats
from kinetile.kernel.compiled import hook
from kinetile.kernel.log import CONTACT_ROW, WALLS
from kinetile.kernel.plan import FIELDS, FIELDS_OF_TWO

Records: TypeAlias = Any
"""A one-dimensional record array: ``table[i].field`` reads and writes, compiled and as Python."""

Tables = TypeVar("Tables", bound=tuple[Any, ...])

NEVER = 2**63 - 1
"""The failure time of a certificate that will not fail."""

TAKEN_OUT = NEVER - 1
"""The key of a body that has been removed from the calendar, and is filed again when its entry is settled."""

NOT_ASKED = -(2**63)
"""The tick of a wall contact that is not computed yet: by the narrow phase for walls, the body reaches no
wall by the tick of its key, nor within ``calendar.SOON`` ticks after it."""

NOBODY = -1

LONG_AGO = -(1 << 62)
"""The earliest tick that the tables keep as the clock's base moves; and the past tick of no event."""

CHORD, STRUCTURAL, GUESS, COMMANDED, WALL, PAIR, PARTING = -2, *range(6)
"""Kinds of entries of the queue, ordered as events of one tick run."""

BEAT_DUE, PASSING_BEGINS = -1, 6
"""Kinds of the next event that no entry has: a beat, which anchors old plans again (``kernel.images``), after
structural events; and the beginning of a passing, whose entry is a ``PAIR``."""


class Quantity(Enum):
    """The meaning of a field. The first three are ticks, which move with the clock's base."""

    TICK = auto()
    PAST = auto()  # the tick of a past event, or LONG_AGO
    DUE = auto()  # the tick of a future event, or NEVER
    SLOT = auto()  # of a body, or NOBODY; saved as the body's number
    PARTNER = auto()  # the same, or a wall
    NUMBER = auto()  # of a body, or NOBODY, or a wall
    KIND = auto()  # of a body: the place in ``scene.kinds``
    SHAPE = auto()  # of a body: the place in the table of shapes; NOBODY where all are discs
    COUNT = auto()  # a whole number from 0 on
    VALUE = auto()  # any other number


class Role(Enum):
    """The fate of a field when tables are made again, in this run or in one that resumes from a file."""

    CARRIED = auto()  # taken over and saved; equal under all phases
    COST = auto()  # taken over and saved; depends on the structure
    KEPT = auto()  # taken over, and not saved
    DERIVED = auto()  # follows from the scene, the phases and the carried fields


TICK, PAST, DUE, SLOT, PARTNER, NUMBER, KIND, SHAPE, COUNT, VALUE = Quantity
CARRIED, COST, KEPT, DERIVED = Role

_NONE = {PAST: LONG_AGO, DUE: NEVER} | dict.fromkeys((SLOT, PARTNER, NUMBER, SHAPE), NOBODY)
"""The value that stands for nothing; 0 for other quantities."""


class Field(NamedTuple):
    """A declared field; a field of a record within a record has the name "record.field"."""

    name: str
    form: Any
    quantity: Quantity
    role: Role


_DECLARED: dict[np.dtype[Any], tuple[Field, ...]] = {}


def record(*rows: tuple[Any, ...], align: bool = True) -> np.dtype[Any]:
    """Returns the type of records with these fields: names, a form, a quantity and a role, or the name of a
    record within it and its type. These declarations decide which fields are saved and compared, how ticks
    move, and which values a file may have. Raises TypeError for a field without them."""
    named = [(name, *row[1:]) for row in rows for name in row[0].split()]
    dtype, fields = np.dtype([row[:2] for row in named], align=align), list[Field]()
    for name, form, *text in named:
        inner = declared(form) if isinstance(form, np.dtype) else ()
        if len(text) != (0 if inner else 2):
            raise TypeError(f"the field {name!r} does not say what it is and what becomes of it")
        fields += [each._replace(name=f"{name}.{each.name}") for each in inner] or [Field(name, form, *text)]
    if _DECLARED.setdefault(dtype, tuple(fields)) != tuple(fields):
        raise TypeError(f"{dtype.names} are declared in two ways")
    return dtype


@cache
def declared(dtype: np.dtype[Any], *which: Quantity | Role) -> tuple[Field, ...]:
    """Returns the fields of a record, all or only some quantities or roles; () for another array."""
    fields = _DECLARED.get(dtype, ())
    return tuple(each for each in fields if not which or each.quantity in which or each.role in which)


BODY = record(
    (FIELDS, "f8", VALUE, CARRIED),
    ("anchor", "i8", TICK, CARRIED),  # the tick of x and y
    ("reach", "f8", VALUE, DERIVED),  # radius + skin, for broad phases
    ("radius", "f8", VALUE, CARRIED),  # for contact times
    ("last", "i4", SLOT, CARRIED),  # the partner of the contact that made this plan, or NOBODY
    ("spare", "i4", VALUE, DERIVED),  # a record is a cache line
)
SIDES = record(("left right down up", "f8", VALUE, DERIVED), align=False)
"""The reach of a body to each side, unless all bodies are discs (rule 6s)."""

FORM = record(
    *declared(SIDES),
    ("prepared", "i8", VALUE, DERIVED),  # whether the phases are prepared for a body of this shape
    align=False,
)
"""A shape of the table of shapes."""

SHAPED = record(
    *declared(BODY),
    *declared(SIDES),
    ("form", "i8", SHAPE, CARRIED),  # its shape: the place in the table of shapes
)
"""A body, unless all are discs. Its ``radius`` is the radius of the circle around it."""

PULLS = (
    ("ax ay", "f8", VALUE, CARRIED),
    ("end", "i8", DUE, DERIVED),  # of the present chord (``kernel.chords``), or NEVER without one
    ("span", "i8", COUNT, DERIVED),  # how many ticks a chord of this acceleration lasts
)
ACCELERATED_BODY = record(*declared(BODY), *PULLS)
"""A body where some are accelerated."""

ACCELERATED_SHAPED = record(*declared(SHAPED), *PULLS)

RESTS = (
    ("whole_x whole_y", "f8", VALUE, CARRIED),  # the acceleration; ax and ay are the present one
    ("side_x side_y", "f8", VALUE, CARRIED),  # the normal from its first support
    ("was_x was_y", "f8", VALUE, DERIVED),  # the present acceleration until this event
    ("ledge", "i8", DUE, CARRIED),  # when it leaves its support
    ("support second", "i4", PARTNER, CARRIED),  # bodies or walls that hold it,
    ("supports", "i4", COUNT, CARRIED),  # and their number: the wall LEFT has the value of NOBODY
    ("holds", "i4", COUNT, DERIVED),  # how many a response has decided on
    ("may", "i4", VALUE, DERIVED),  # whether it may settle at this contact (``kernel.rest``)
    ("carries", "i4", COUNT, CARRIED),  # the number of bodies that it holds
    ("freed", "i4", SLOT, DERIVED),  # the next one in the list of those that a support has let go
)
RESTING_BODY = record(*declared(ACCELERATED_BODY), *RESTS)
"""A body where some may rest on supports."""

RESTING_SHAPED = record(*declared(ACCELERATED_SHAPED), *RESTS)

ENTRY = record(
    ("key", "i8", DUE, DERIVED),  # the tick that the body is filed under
    ("certificate", "i8", DUE, DERIVED),  # when its structural certificate fails
    ("tick", "i8", DUE, DERIVED),  # its first contact with another body: not before this, or exactly then
    ("wall", "i8", DUE, DERIVED),  # its contact with a wall, or NOT_ASKED
    ("guard", "i8", DUE, DERIVED),  # every other contact of the body is not before this
    ("partner", "i4", SLOT, DERIVED),  # the body that it meets at tick
    ("seen", "i4", COUNT, DERIVED),  # the partner's stamp when this was computed
    ("kind", "i4", VALUE, DERIVED),  # the kind of the key, from CHORD to PARTING
    ("exact", "i4", VALUE, DERIVED),  # whether tick is exact
    ("number", "i4", NUMBER, CARRIED),  # of the body in this slot, or NOBODY: the slot is empty
    ("spare", "i4", VALUE, DERIVED),  # a record is a cache line
)
LINK = record(("next prev", "i4", VALUE, DERIVED), align=False)
PLAN_NUMBERS = record((FIELDS, "f8", VALUE, DERIVED), align=False)
SCOUTED = record(("body partner", "i4", SLOT, DERIVED), align=False)
OFFER = record(("a b", "i4", SLOT, DERIVED), align=False)
HELD_PAIR = record(
    ("a b", "i4", SLOT, DERIVED),  # the bodies of a pair, a < b; a = -1: a free record
    ("next_a prev_a next_b prev_b", "i4", VALUE, DERIVED),  # neighbours in a's and b's lists of pairs
    ("holds", "i4", VALUE, DERIVED),  # how many reasons the broad phase gave for the pair
    align=False,
)
TRAIT = record(
    ("leave", "i8", DUE, DERIVED),  # when the first pair parts with the body as its elder
    ("touched", "i8", PAST, CARRIED),  # the tick of its last contact without passing through the other
    ("kind", "i4", KIND, CARRIED),
    ("inside", "i4", COUNT, DERIVED),  # how many bodies it is passing through
)
RULE = record(
    ("response", "i8", VALUE, DERIVED),  # ELASTIC, PASS, or the number of a composed hook
    ("first second third fourth fifth sixth", "f8", VALUE, DERIVED),  # the response's own numbers
    ("way_x way_y", "f8", VALUE, DERIVED),  # the side from which a body is met that others pass; or 0, 0
    ("contact_time", "f8", VALUE, DERIVED),  # the time between contacts of pressed bodies; 0: the default
    align=False,
)
PASSING = record(
    ("tick", "i8", DUE, CARRIED),  # when they part
    ("begun", "i8", PAST, CARRIED),  # when they began
    ("m n", "i8", VALUE, CARRIED),  # the image through which they pass, seen from the elder
    ("a b", "i4", SLOT, CARRIED),
    *declared(HELD_PAIR)[2:6],
)
COMMAND = record(
    ("tick", "i8", TICK, CARRIED),
    (f"{FIELDS} radius mass", "f8", VALUE, CARRIED),
    ("body", "i4", NUMBER, CARRIED),  # the body's number
    ("code", "i4", VALUE, CARRIED),  # its kind (kinetile.kernel.log)
    ("after", "i8", COUNT, CARRIED),  # after this many contacts of its tick
    ("ax ay", "f8", VALUE, CARRIED),  # of an inserted body, or the new one
    ("kind", "i4", KIND, CARRIED),
    ("overtakes", "i4", COUNT, CARRIED),  # planned ones of its tick that were given later (a history's alone)
    ("form", "i4", VALUE, CARRIED),  # the shape of an inserted body, where not all are discs
    ("has_room", "i4", VALUE, CARRIED),  # whether it is known to have room
    ("lifetime", "f8", VALUE, CARRIED),  # of a body inserted by hand; 0: without one
)
ROW = record(
    ("tick", "i8", VALUE, DERIVED),  # rows are taken over before the clock's base moves
    ("a b", "i4", VALUE, DERIVED),
    (FIELDS_OF_TWO, "f8", VALUE, DERIVED),
)
IMAGE = record(
    ("kx ky", "i8", VALUE, CARRIED),  # periods that were taken off the body's place
    ("m n", "i8", VALUE, DERIVED),  # the image of the contact that its entry awaits, if that is exact
    ("last_m last_n", "i8", VALUE, CARRIED),  # the image of its last contact
)
LIMITS = record(
    ("width height", "f8", VALUE, DERIVED),  # of the arena
    ("skin", "f8", VALUE, DERIVED),  # a body's reach less its radius
    ("margin", "f8", VALUE, DERIVED),  # how much of the skin is for chords (``kernel.chords``)
    ("theta", "f8", VALUE, DERIVED),  # an inversion deeper than this at the end of a tick is repaired at once
    ("tolerance", "f8", VALUE, DERIVED),  # an overlap deeper than this is a missed contact
    ("span", "i8", VALUE, DERIVED),  # how far from the clock's origin the rows of places are used
    ("fat", "f8", VALUE, DERIVED),  # the length that a lower bound fattens two bodies by
    ("least widest", "f8", VALUE, DERIVED),  # the range of radii of the prepared broad phase
    ("speed2", "f8", VALUE, DERIVED),  # the square of the largest allowed speed
    ("faster", "i8", VALUE, DERIVED),  # whether a response has made one faster
)
LISTS = record(
    ("vacant", "i8", SLOT, DERIVED),  # head of the list of slots that bodies have left, or NOBODY
    ("offered", "i8", COUNT, DERIVED),
    ("freed", "i8", SLOT, DERIVED),  # head of the list of bodies that a support has let go, or NOBODY
    ("pairs", "i8", COUNT, DERIVED),  # of the pair set
    ("free_pair", "i8", VALUE, DERIVED),  # head of the free list of its records
    ("wanted", "i8", COUNT, DERIVED),  # pairs without room: grow the tables and build again
    ("passings", "i8", COUNT, DERIVED),  # pairs that are passing through each other
    ("free_passing", "i8", VALUE, DERIVED),  # head of the free list of their records
    ("logged", "i8", COUNT, KEPT),
    ("written", "i8", COUNT, KEPT),  # rows of the long log
    ("rows", "i8", COUNT, KEPT),  # how many it may have; 0: none are written
    ("command", "i8", COUNT, DERIVED),  # the next command
    ("commands", "i8", COUNT, DERIVED),
)
TORUS = record(
    ("x y", "f8", VALUE, DERIVED),  # the period of an axis; 0 without one
    ("per_x per_y", "f8", VALUE, DERIVED),  # and its inverse, or 0
    ("half_x half_y", "f8", VALUE, DERIVED),  # half of it, or infinite
    ("m n", "i8", VALUE, DERIVED),  # the image of the contact that was computed last
    ("foreseen", "i8", VALUE, DERIVED),  # ticks after the later anchor that limit predictions
    ("right up", "f8", VALUE, DERIVED),  # the image's addition to the separation at this contact
    ("beat", "i8", TICK, CARRIED),  # the next tick for anchoring old plans
    ("number", "i8", COUNT, CARRIED),  # of the next body to test, at that tick
)
CALENDAR = record(
    ("shift", "i8", VALUE, DERIVED),  # a slice is 2^shift ticks long
    ("slice", "i8", VALUE, DERIVED),  # the slice of the search for the head: nothing is filed before it
    ("filed", "i8", VALUE, DERIVED),  # whether the bodies are filed
)
JAM = record(
    ("spins", "i8", COUNT, DERIVED),  # structural events since the last progress of time or contact
    ("spin_limit", "i8", COUNT, DERIVED),
    ("window", "i8", COUNT, CARRIED),  # contacts since the last look at the rate
    ("window_size", "i8", COUNT, DERIVED),
    ("window_tick", "i8", PAST, CARRIED),
    ("answered", "f8", VALUE, CARRIED),  # energy that contacts had added before the window
)
STOPS = record(
    ("watching", "i8", VALUE, KEPT),  # whether contacts are watched
    ("before", "i8", VALUE, KEPT),  # whether to stop before a watched contact, not after it
    ("due", "i8", VALUE, KEPT),  # whether to stop now, because of
    ("row", "i8", VALUE, KEPT),  # a contact in this row of ``met``, if it has happened,
    ("tick", "i8", PAST, CARRIED),  # at this tick
    ("a b", "i8", NUMBER, CARRIED),  # of these numbers;
    ("passes", "i8", VALUE, KEPT),  # before it: whether the two will begin to pass each other
)
MEETING = record(
    ("wanted", "i8", VALUE, KEPT),  # whether the loop writes the others
    ("avx avy bvx bvy", "f8", VALUE, KEPT),  # of the last contact: the velocities before it
)

NEXT_EVENT = record(("tick", "i8", TICK, DERIVED), ("kind a b", "i8", VALUE, DERIVED))
"""The next event: a kind as in entries, or a command's code; numbers of bodies, ``b`` or NOBODY."""

FAULT_RECORD = record(("code", "i8", COUNT, CARRIED), ("a b", "i8", PARTNER, CARRIED))
CLOCK = record(
    ("now", "i8", TICK, CARRIED),
    ("per_tick", "f8", VALUE, DERIVED),  # the time of a tick, in the scene's unit
    ("per_time", "f8", VALUE, DERIVED),  # ticks in one unit of the scene's time
    ("epoch", "i8", VALUE, KEPT),  # whole units from the start to tick 0 (records have an attribute "base")
    ("origin", "i8", TICK, DERIVED),  # the tick of the rows of places
    ("bodies", "i8", COUNT, DERIVED),  # slots that have been used: later ones are empty
    ("present", "i8", COUNT, DERIVED),  # bodies in the scene now
    ("kinds", "i8", COUNT, DERIVED),  # of bodies
    ("built", "i8", VALUE, DERIVED),
    ("at_work", "i8", VALUE, DERIVED),  # the body of the hook that runs: it is settled after it
    (
        "contact_guess",
        "i8",
        DUE,
        DERIVED,
    ),  # a bound shortly before the contact that is computed exactly, or NEVER
    ("met_tick", "i8", PAST, CARRIED),  # the tick of the last contact,
    ("met_there", "i8", COUNT, CARRIED),  # and how many there were at it
    ("limits", LIMITS),  # the arena, and what follows from the bodies' bounds
    ("lists", LISTS),  # how far tables are in use, and where their free records are
    ("calendar", CALENDAR),
    ("jam", JAM),  # detects runs without progress
    ("stops", STOPS),  # at contacts that are watched
    ("meeting", MEETING),  # for the impulse of a contact
    ("torus", TORUS),  # where axes are periodic (``kernel.images``)
    ("fault", FAULT_RECORD),  # the first one, of bodies a and b
    ("next", NEXT_EVENT),  # written when the loop stops before an event
)
COUNTS = record(
    ("contacts_disc contacts_wall turns inserted removed", "i8", COUNT, CARRIED),
    ("structural", "i8", COUNT, COST),
    ("asks", "i8", COUNT, COST),  # times that a body's partners were compared
    ("asked", "i8", COUNT, COST),  # partners compared
    ("newcomers", "i8", COUNT, COST),  # bodies that a hook reported as newly near
    ("exact", "i8", COUNT, COST),  # contact times computed exactly
    ("updated", "i8", COUNT, COST),  # structural certificates set again
    ("queued", "i8", COUNT, DERIVED),
    ("queue_max pairs_max", "i8", COUNT, COST),
    ("logged", "i8", COUNT, COST),  # events that changed a plan, except anchorings in skipped time
    ("late", "i8", COUNT, COST),
    ("deepest", "f8", VALUE, CARRIED),
    ("commanded_energy", "f8", VALUE, CARRIED),  # energy that commands and supports have added
    ("answered_energy", "f8", VALUE, CARRIED),  # energy added by contacts that do not conserve it
    ("passings", "i8", COUNT, CARRIED),  # times two bodies began to pass through each other
)

_OF_A_BODY = [each for dtype in (ENTRY, RESTING_SHAPED, TRAIT, IMAGE) for each in declared(dtype, CARRIED)]

CARRIED_ROWS = {
    "plans": record(("mass", "f8", VALUE, CARRIED), *_OF_A_BODY, align=False),
    "passings": record(*declared(PASSING, CARRIED), align=False),
    "commands": COMMAND,
    "counts": COUNTS,
    "clock": record(*declared(CLOCK, CARRIED), align=False),
}
"""The carried tables: the flight plan of each body with its other values, the pairs that pass through each
other, the waiting commands, the counts, the clock. In them slots are numbers of bodies."""

NEGATIVE_PARTNERS = np.array(sorted(WALLS), np.int32)
"""The walls, and NOBODY: appended to the places of slots, an index below 0 finds them."""

OFFERS = 1 << 10
"""Offers that a hook may leave behind; if there are more, every body is refreshed."""

MANY_BODIES = 1 << 15
"""Bodies. For more there are more slices, since the look-ahead fetches in vain for bodies of a later year."""

PAGE = 1 << 21
"""Bytes of a large page."""

ON_LARGE_PAGES = 1 << 17
"""The least bytes of a table on large pages: smaller scenes gain nothing."""

FOUND = 16
"""Bodies that the look-ahead remembers."""

SPARE = 64
"""Places in ``near`` beyond the bodies: hooks that write eight at a time may write past the end."""


class Kernel(NamedTuple):
    """All tables of one simulation, with n slots for bodies; hooks receive it as ``k``."""

    bodies: Records  # (n,) flight plans
    places: Records  # (n,) place and velocity at the common clock ``clock[0].origin``
    mass: Records  # (n,) where bodies are alike, this and the next are one number, n times (``equal``)
    radii: Records  # (n,) the radii again, close together
    sides: Records  # (n,) the sides again, close together; empty where all are discs
    forms: Records  # the shapes that bodies have, or may have; empty where all are discs
    stamps: Records  # (n,) how often each plan has changed
    queue: Records  # (n,) what awaits each body
    links: Records  # (n + 1,) the calendar: which bodies are beside each in its ring (~ring, and n)
    rings: Records  # (2^m,) the first body of each slice, or n
    marks: Records  # a bit for each ring: set if it is not empty
    found: Records  # the last bodies that the look-ahead has found, and their partners
    numbers: Records  # float64, from the narrow phase of two bodies (``PairParts.numbers``)
    near: Records  # the answer of ``near`` and ``repair``: numbers of bodies
    offers: Records  # bodies and pairs that a hook has left to be looked at
    pairs: Records  # the pair set: its records,
    lookup: Records  # its hash table,
    firsts: Records  # (n,) and the head of each body's list; empty where the phase keeps none
    images: Records  # (n,) periods and images; empty unless an axis is periodic
    traits: Records  # (n,) for responses; this and the next three are empty without responses
    rules: Records  # (kinds * (kinds + 1),) the rule for two kinds, or (last) for a kind and a wall
    passings: Records  # the pairs that are passing through each other, a the elder of the two
    passers: Records  # (n,) the head of each body's list of passings
    commands: Records  # commands of the present span of the clock, in their order
    watch: Records  # for each number of a body how to stop at its contacts; this and the next two are
    watched: Records  # empty before the first run that stops at contacts: the pairs, by numbers,
    watched_kinds: Records  # and how to stop where such kinds meet, as in ``rules``
    slots: Records  # for each number of a body its slot, or NOBODY: it has left, or is still to come
    shadows: Records  # (n,) the straight plans for a broad phase, where some are accelerated, and
    shadow_places: Records  # (n,) their places at the common clock (``kernel.chords``), and
    pulls: Records  # (n,) the accelerations, and when chords end, by the common clock; else empty
    met: Records  # the log of contacts, as it is digested
    log: Records  # every event with the plans after it; may be empty if nobody reads it
    clock: Records
    counts: Records


def record_table(dtype: np.dtype[Any], length: int) -> Records:
    """Returns a zeroed table of records, or of plain numbers, that starts on a cache line."""
    raw = _zeroed(length * dtype.itemsize + 64)
    offset = -raw.ctypes.data % 64
    table = raw[offset : offset + length * dtype.itemsize].view(dtype)
    return table.view(np.recarray) if dtype.names else table


def _zeroed(size: int) -> npt.NDArray[np.uint8]:
    """Returns zeroed bytes: on large pages, if the system has them and the table is not small. Events read a
    table at scattered places, and with small pages each one's address has to be looked up, too."""
    global _rest
    if size >= ON_LARGE_PAGES:
        with suppress(AttributeError, OSError, OverflowError), _one_at_a_time:  # no such pages, or no memory
            if size > len(_rest):
                pages = mmap.mmap(-1, size + -size % PAGE, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
                pages.madvise(mmap.MADV_HUGEPAGE)
                table = np.frombuffer(pages, dtype=np.uint8)
                if size > PAGE:
                    return table[:size]
                _rest = table
            table, _rest = _rest[:size], _rest[size:]
            return table
    return np.zeros(size, dtype=np.uint8)


_rest = np.zeros(0, dtype=np.uint8)  # the rest of the last large page, which small tables share
_one_at_a_time = Lock()


def equal(number: float, length: int) -> Floats:
    """Returns a column of equal numbers with the memory of one: all elements are the same eight bytes."""
    return as_strided(np.full(1, number), (length,), (0,))


_EMPTY: dict[str, Any] = {"forms": FORM, "pairs": HELD_PAIR, "images": IMAGE, "traits": TRAIT, "rules": RULE}
_EMPTY |= {"passings": PASSING, "commands": COMMAND, "watched": OFFER, "log": ROW, "numbers": np.float64}
_EMPTY |= {"lookup": np.int32, "firsts": np.int32, "passers": np.int32}
_EMPTY |= {"watch": np.uint8, "watched_kinds": np.uint8}
"""The names of the tables without rows at first, and their types."""


def allocate(
    bodies: int,
    near: int,
    log_rows: int,
    alike: bool = False,
    shaped: bool = False,
    accelerated: bool = False,
    resting: bool = False,
) -> Kernel:
    """Returns tables for ``bodies`` bodies, numbered as their slots are, with room for ``near`` answers of
    ``near`` and for ``log_rows`` rows of the log; ``alike``: their masses and radii are and stay equal;
    ``shaped``: not all are discs; ``accelerated``: some are accelerated, and may rest if ``resting``."""
    seen = SHAPED if shaped else BODY
    own = (ACCELERATED_SHAPED if shaped else ACCELERATED_BODY) if accelerated else seen
    if resting:
        own = RESTING_SHAPED if shaped else RESTING_BODY
    per_body = 4 if bodies < MANY_BODIES else 8
    slices = 1 << max(6, (per_body * bodies - 1).bit_length())
    k = Kernel(
        bodies=begun(record_table(own, bodies)) if accelerated else record_table(own, bodies),
        places=record_table(PLAN_NUMBERS, bodies),
        mass=equal(1.0, bodies) if alike else np.ones(bodies),
        radii=equal(0.0, bodies) if alike else np.zeros(bodies),
        sides=record_table(SIDES, bodies if shaped else 0),
        stamps=record_table(np.dtype(np.int32), bodies),
        queue=record_table(ENTRY, bodies),
        links=record_table(LINK, bodies + 1),
        rings=record_table(np.dtype(np.int32), slices),
        marks=np.zeros(slices >> 6, dtype=np.int64),
        found=record_table(SCOUTED, FOUND),
        near=np.zeros(near + SPARE, dtype=np.int32),
        offers=record_table(OFFER, OFFERS),
        slots=np.arange(bodies, dtype=np.int32),
        shadows=record_table(seen, bodies if accelerated else 0),
        shadow_places=record_table(PLAN_NUMBERS, bodies if accelerated else 0),
        pulls=record_table(PLAN_NUMBERS, bodies if accelerated else 0),
        met=record_table(CONTACT_ROW, log_rows),
        clock=begun(record_table(CLOCK, 1)),
        counts=record_table(COUNTS, 1),
        **{name: record_table(np.dtype(each), 0) for name, each in _EMPTY.items()},
    )
    k.queue.number = k.slots
    k.rings[...] = bodies
    k.clock[0].bodies = k.clock[0].present = bodies
    return k


def pair_set(k: Kernel, room: int) -> Kernel:
    """Returns the tables with an empty pair set that has room for ``room`` pairs."""
    slots = 1 << max(4, (2 * room - 1).bit_length())
    return k._replace(
        pairs=record_table(HELD_PAIR, room),
        lookup=np.full(slots, -1, dtype=np.int32),
        firsts=np.full(len(k.bodies), -1, dtype=np.int32),
    )


def clear(k: Kernel) -> None:
    """Clears the queue, the calendar and the pair set; bodies, clock, counts and log stay."""
    clock = k.clock[0]
    calendar, lists = clock.calendar, clock.lists
    for name in ("key", "certificate", "tick", "guard"):
        k.queue[name] = NEVER
    k.queue.wall = NOT_ASKED
    k.queue.partner = NOBODY
    k.queue.exact = 0
    k.rings[:] = len(k.bodies)
    k.marks[:] = 0
    k.counts[0].queued = 0
    k.pairs.a = NOBODY
    k.pairs.next_a = np.arange(1, len(k.pairs) + 1)
    if len(k.pairs):
        k.pairs.next_a[-1] = -1
    lists.free_pair = 0 if len(k.pairs) else -1
    k.lookup[:] = -1
    k.firsts[:] = -1
    lists.pairs = lists.wanted = lists.offered = 0
    lists.freed = NOBODY
    clock.built = clock.jam.spins = 0
    calendar.filed = 1
    calendar.slice = clock.now >> calendar.shift


def fields_in(dtype: np.dtype[Any]) -> list[str]:
    """Returns the names of a record's fields, "record.field" for one within it; [] for plain numbers."""
    return [each.name for each in declared(dtype)] or [*(dtype.names or ())]


def column(table: Records, name: str) -> np.ndarray[Any, Any]:
    """Returns the column of a field, by its name in ``Field`` and ``fields_in``: a view, not a copy."""
    found: np.ndarray[Any, Any] = table.view(np.ndarray)
    for each in [name] if name in (found.dtype.names or ()) else name.split("."):
        found = found[each]
    return found


def begun(table: Records) -> Records:
    """Returns a zeroed table after writing each field's value for "nothing"."""
    for name, _, quantity, _ in declared(table.dtype, *_NONE):
        column(table, name)[...] = _NONE[quantity]
    return table


def compared(table: Records) -> list[str]:
    """Returns the names of the fields that are equal under all phases; slots are not."""
    return [each.name for each in declared(table.dtype, CARRIED) if each.quantity not in (SLOT, PARTNER)]


def copy_carried(source: Records, target: Records, places: npt.NDArray[np.int32]) -> None:
    """Copies the carried fields that two tables share. ``places`` has the number of the body in each slot, or
    the slot of each number, and then ``NEGATIVE_PARTNERS``."""
    source, target = source.view(np.ndarray), target.view(np.ndarray)
    for name, _, quantity, _ in _in_both(source.dtype, target.dtype) if len(source) and len(target) else ():
        values, slots = column(source, name), quantity in (SLOT, PARTNER)
        column(target, name)[...] = places[values % len(places)] if slots else values


@cache
def _in_both(source: np.dtype[Any], target: np.dtype[Any]) -> list[Field]:
    there = {field.name for field in declared(target)}
    return [field for field in declared(source, CARRIED, COST) if field.name in there]


def read_only(tables: Tables) -> Tables:
    """Returns a named tuple of arrays, each as a read-only view."""
    views = [array.view() for array in tables]
    for view in views:
        view.flags.writeable = False
    return type(tables)(*views)


BAD_PAIR, UNKNOWN_PAIR, LATE_CONTACT, TOO_DEEP, JAMMED, STALLED, NOT_FINITE = range(1, 8)
BAD_CERTIFICATE, BAD_COUNT, BAD_NAME, BAD_PARTNER, BAD_RESPONSE, ADDED_ENERGY, SQUEEZED = range(8, 15)
JAMS = (JAMMED, SQUEEZED)  # a command may end them

MY_FAULT = 1 << 16
"""The first fault of a broad phase's own (``BroadPhaseParts.faults``); the next is ``MY_FAULT + 1``."""


@hook
def blame(k: Kernel, fault: int, a: int, b: int) -> None:
    """Reports a fault of bodies ``a`` and ``b``; the first one counts."""
    first = k.clock[0].fault
    if first.code == 0:
        first.code = fault
        first.a = a
        first.b = b


@hook
def is_there(k: Kernel, body: int) -> bool:
    """Returns True if a slot has a body."""
    return bool(k.queue[body].number >= 0)


@hook
def elder(k: Kernel, a: int, b: int) -> int:
    """Returns the slot, of two, whose body has the smaller number; the other slot is a + b - elder."""
    return a if k.queue[a].number < k.queue[b].number else b


@hook
def slot_of(k: Kernel, number: int) -> int:
    """Returns the slot of the body with a number, or NOBODY if it has no slot."""
    return int(k.slots[number]) if 0 <= number < len(k.slots) else NOBODY


def slots_taken(k: Kernel) -> npt.NDArray[np.intp]:
    """Returns the slots with bodies in them, in the order of the bodies' numbers; not for hooks."""
    number: Any = k.queue.view(np.ndarray)["number"]
    taken = np.flatnonzero(number >= 0)
    return taken[np.argsort(number[taken], kind="stable")]  # in order, except for a few
