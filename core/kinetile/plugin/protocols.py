"""Protocols of phases and responses: the arguments of hooks, their allowed changes, and the invariants.

A phase is a class. It is made with its options as keyword arguments, and its ``prepare`` is called once and
returns its parts: hooks (functions marked with ``kinetile.toolbox.hook``), which become part of the compiled
loop, and state. Nothing else of the class is used during a run. Parts are checked first (``check_parts``).
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias, get_args

import numpy as np

from kinetile.arrays import Floats
from kinetile.errors import PhaseError
from kinetile.kernel.compiled import NOTHING, Hook, is_hook, python_of
from kinetile.kernel.loop import idle
from kinetile.plugin.drawing import Item
from kinetile.plugin.registry import defined_at

if TYPE_CHECKING:
    from kinetile.scene import Scene

ContactDistance: TypeAlias = Literal["sum of radii", "outlines", "closer"]
"""The distance at which two bodies touch: always the sum of their radii, by outlines, or sometimes less."""


@dataclass(frozen=True)
class BroadPhaseParts:
    """The parts of a broad phase. ``near`` is enough; a phase that keeps a structure has the others as well.

    ``near(k, s, body) -> m``: write to ``k.near[:m]`` the numbers of all bodies that may touch a body before
    the structure changes. The body itself may be among them; a number may be there twice, which costs time.
    If a is near b, then b is near a. Eight numbers may be written beyond m. ``room`` is the largest count
    that it may write; at least the number of bodies, which is the default.

    ``state`` is a NamedTuple of arrays, whose class is defined at a module's top level; every hook receives
    it as ``s``. ``ticks`` are its arrays that hold ticks: when the clock's base moves on, the kernel shifts
    all their elements except NEVER. ``arrange(k, s)`` (plain Python with NumPy, not compiled; may be None)
    computes the state of the present moment, at the start and whenever the kernel rebuilds. It may read
    ``k.bodies`` and ``positions_now(k)``.

    ``build(k, s)``: no certificate is scheduled. Complete the structure and schedule every certificate. Each
    body has one structural certificate, whose meaning the phase chooses: ``schedule(k, body, tick)`` sets the
    tick at which it fails; NEVER: it does not. A phase that watches several conditions for a body schedules
    the first failure. ``falls`` computes the tick at which a gap closes.

    ``repair(k, s, body) -> m``: a body's certificate fails now, at ``k.clock[0].now``. Restore the structure
    and reschedule changed certificates, this body's in any case. Write the bodies that have become near it to
    ``k.near[:m]``; ``offer(k, a, b)`` reports a pair of others. A pair that is no longer near need not be
    reported. Never change a flight plan.

    ``replan(k, s, body)``: the flight plan of a body changed; its position did not. Reschedule the
    certificates that depend on it. The kernel itself calls the narrow phases again.

    ``enter(k, s, body)``: a body was inserted now; its plan is in ``k.bodies[body]``. Add it to the structure
    and schedule its certificate. The kernel calls ``near`` for it afterwards; report only pairs of others
    that have become near (``offer``).

    ``leave(k, s, body)``: a body will be removed. Take it out of the structure, reschedule the certificates
    of others that depended on it, and ``offer`` pairs of others that become near. From then on the phase must
    not name it.

    A phase has both ``enter`` and ``leave``, or neither. A phase without them is prepared and built again at
    each insertion or removal. A phase with them allocates room for ``scene.capacity`` bodies in ``prepare``,
    whose scene has fewer: slots, 0 to capacity - 1, identify bodies, and a slot may be empty
    (``toolbox.is_there``). When the kernel calls ``arrange`` and ``build``, the bodies are in the first slots
    without a gap, ``k.clock[0].bodies`` of them, and ``arrange`` receives tables of that length. Radii are in
    the range that ``prepare`` saw; for another radius, or without a free slot, the kernel prepares again.

    ``soon(k, s, body, stage)``: an event of a body is likely to come soon: prefetch (``toolbox.prefetch``)
    the data that ``near`` and ``repair`` will read for it. Stages 0, 1 and 2 come in this order, some events
    apart, so each may read data that the stage before has prefetched; in a small scene there is only stage 0,
    for the two bodies of the next contact. It must change nothing; the body may have another plan by then.
    None: nothing of the phase is prefetched.

    ``periodic``: in a scene with a periodic axis (``scene.periodic``) this phase names a body if any of its
    images may touch. A plan's place is within half a period of 0 when it is anchored, ``k.images`` counts the
    periods that were taken off it, and ``k.clock[0].torus`` has the periods (``kinetile.kernel.images``).
    Without this flag such a scene is refused.

    ``audit(k, s)`` (plain Python; may be None) yields a sentence for each invariant of the state that does
    not hold between two events. ``draw(k, s)`` (plain Python; may be None) returns the present structure as
    shapes of ``kinetile.plugin.drawing``: bounds, tiles, cells, pairs, certificates with their failure times;
    shapes move with bodies, so they are valid until the next event. Both may read everything, must change
    nothing, and may be slow.

    ``drawn_as`` names a structure that follows from the present positions alone, so that a page without a
    recording of ``draw`` can compute it: "tiling" (the lines of the discs and the vertical bounds at their
    ends), "bounds x" and "bounds y" (each body's bounds on an axis), "boxes" (upright boxes, and the pairs
    that overlap); "": no such structure.

    ``pairs`` is the initial room of the pair set, in pairs (``add_pair``, ``remove_pair``, ``pairs_of``); it
    grows when necessary. ``skin_limit`` is the thickest skin, a length, that keeps the phase right; None:
    any. A scene that needs a thicker skin is refused.

    ``walled``: the phase is right only while walls keep all bodies in an arena. ``solid``: it is right only
    while bodies cannot pass through each other, nor come closer than the sum of their radii. With
    ``outlines`` it is also right for the shapes that it accepts, if these touch at their outlines: only
    touching bodies need to be near. Immovable bodies of a scene with shapes may overlap, so it accepts at
    most one.

    ``faults`` are sentences for faults of the phase's own: ``blame(k, MY_FAULT, a, b)`` ends the run with the
    first of them, ``MY_FAULT + 1`` with the second. ``{a}`` and ``{b}`` in them are the two numbers.

    A hook may also read ``k.places``, position and velocity of every body at the tick ``k.clock[0].origin``,
    one row of four doubles each, written before ``replan``.

    Invariants: when all structural failures up to a tick have been repaired, every two bodies that touch at
    that tick, each taken with its ``reach``, are near each other; and every pair that has become near has
    been offered or named by ``repair``. In a scene with shapes ``reach`` is the radius of the circle around a
    body plus the skin. A phase that measures along x or y may use the reaches to the four sides instead
    (``reach_to``, ``reaches_of``), which are less: only bodies whose circles and whose upright boxes both
    touch need to be near.
    """

    near: Hook
    state: Any = field(default_factory=lambda: idle.NoState(np.zeros(1)))
    build: Hook = NOTHING[2]
    repair: Hook = idle.repair
    replan: Hook = NOTHING[3]
    arrange: Callable[[Any, Any], None] | None = None
    audit: Callable[[Any, Any], Iterator[str]] | None = None
    draw: Callable[[Any, Any], Iterable[Item]] | None = None
    drawn_as: str = ""
    pairs: int = 0
    room: int = 0
    ticks: tuple[Any, ...] = ()
    solid: bool = False
    outlines: bool = False
    skin_limit: float | None = None
    faults: tuple[str, ...] = ()
    enter: Hook | None = None
    leave: Hook | None = None
    soon: Hook | None = None
    periodic: bool = False
    walled: bool = False


@dataclass(frozen=True)
class PairParts:
    """The parts of a narrow phase for two bodies.

    ``meet(k, a, b)``: the tick of the first contact of bodies a < b, or NEVER, from their two flight plans
    alone: computed at the later of the two anchors, never at the present time, with the true radii. It must
    be rounded down, and a pair that touches or overlaps and approaches meets at the later anchor. It may read
    ``now`` only through ``counts_from``, for bodies that pass (rule 11), and the tick is the same if the
    numbers of the two are exchanged. ``k.clock[0].contact_guess`` is NEVER or, from a bound, a tick shortly
    before the contact: a search may begin there. Bodies never touch at more than the sum of their radii.

    ``collide(k, a, b)``: both bodies are anchored at the contact; give them new velocities and return the
    depth of their overlap (a length, zero or negative without one). ``touch(k, a, b) -> (nx, ny, depth)``:
    for the same bodies, the normal from a to b, of length 1, and the depth of their overlap. None: the phase
    does not work with responses that need it.

    ``soonest(k, body, count, barred, at) -> (first, second, who)``: bounds for many bodies at once. For the
    bodies in ``k.near[:count]``, except ``body`` and ``barred``: no contact with ``body`` comes earlier than
    ``first`` after tick ``at``, and only the contact of ``who`` may come earlier than ``second``. Both are
    delays in the scene's time, infinite if there is no contact; ``who`` is NOBODY if no body has one. A bound
    may be early and never late: ``meet`` of that pair is not before it, by more than 2^-50 of the delay.
    None: every candidate is computed exactly.

    ``part(k, a, b)``: the tick at which two bodies that pass through each other part, or NEVER, from their
    plans alone, like ``meet``; the later anchor if they are apart there already. None: with this phase bodies
    cannot pass.

    ``gap(k, one, other, dx, dy)``: the distance of two shapes, by their numbers in ``scene.shapes``, if the
    other's place minus the one's is (dx, dy); below 0 if they overlap. It is computed in doubles, by rule 9s
    of the specification, and decides if an inserted body has room. None: no body is inserted into a scene
    with shapes.

    ``ledge(k, body, support, mx, my, new)``: the tick at which a body, just anchored, leaves its support by
    its plan. The support is another body at rest; they touch at a face with the unit normal (mx, my) from the
    support to the body. NEVER if the body does not leave (rule 8r). A tick before the anchor: there is no
    such face, or, if they meet now (``new``), they touch at a corner. None: bodies rest only on walls, not on
    each other.

    ``periodic``: these hooks are for a scene with a periodic axis. ``meet`` returns the tick of the first
    image except the barred one, and writes that image to ``k.clock[0].torus``
    (``kinetile.kernel.images.first_image``); ``soonest`` bounds all images, with ``barred`` NOBODY; at a
    contact b is seen ``torus.right`` and ``torus.up`` from its place; ``part`` is for the image on the clock
    (``images.turns_between``).

    ``contact_distance`` is "sum of radii" if two bodies touch when, and only when, the distance of their
    centres is the sum of their radii; "outlines" if they touch when, and only when, the outlines of their
    shapes touch; and "closer" if they can come closer: bodies that are deformed. A broad phase that is
    ``solid`` is refused with "closer", and with "outlines" unless it has ``outlines``.

    ``shapes``: these hooks are for a scene with shapes (``scene.shapes``): bodies do not rotate, and meet by
    rule 5s of the specification. Without this flag such a scene is refused; a broad phase needs nothing,
    since the circle of a body's reach holds its shape.

    ``accelerated``: these hooks are for a scene with accelerations (``scene.accelerated``): records of bodies
    have ``ax`` and ``ay``, and plans are of degree 2 (rule 4a). Two bodies with different accelerations may
    meet again after a contact, so ``meet`` itself leaves out the barred contact, and ``soonest`` gets NOBODY;
    ``soonest`` may leave out contacts after the end of either body's chord. Without this flag such a scene is
    refused; a broad phase needs nothing, since it sees straight chords (``kinetile.kernel.chords``).

    ``numbers``: (m,) float64 that hooks find in ``k.numbers``: the phase's values for a scene, and options.
    Other numbers need no other machine code. None: no numbers. ``alike``: these are the parts for a scene
    whose bodies are alike (``kinetile.scene.are_alike``); other scenes get other parts. The tables then keep
    one mass and one radius: ``k.mass`` and ``k.radii`` keep their lengths, and are not contiguous.
    """

    meet: Hook
    collide: Hook
    soonest: Hook | None = None
    touch: Hook | None = None
    part: Hook | None = None
    gap: Hook | None = None
    ledge: Hook | None = None
    contact_distance: ContactDistance = "closer"
    alike: bool = False
    periodic: bool = False
    shapes: bool = False
    accelerated: bool = False
    numbers: Floats | None = None


@dataclass(frozen=True)
class WallParts:
    """The parts of a narrow phase for a body and the arena's walls.

    ``reach_wall(k, body)``: (tick, wall) of the first contact of a body record with a wall, from its plan
    alone; wall is ``kinetile.toolbox.LEFT``, ``RIGHT``, ``BOTTOM`` or ``TOP``. The arena reaches from the
    origin to ``k.clock[0].limits.width`` and ``k.clock[0].limits.height``. Walls may be anywhere in the
    arena, and have to keep every body in it: broad phases and the skin rely on that. Bodies of the start and
    inserted bodies are only compared with the arena's edges.

    ``bounce(k, body, wall)``: the body is anchored at the contact; give it a new velocity and return its
    depth in the wall.

    ``touch(k, body, wall) -> (nx, ny, depth)``: the normal into the wall, and the body's depth in it. None:
    the phase does not work with responses that need it.

    ``accelerated``: these hooks are for a scene with accelerations (``scene.accelerated``), as in
    ``PairParts``.

    ``periodic`` and ``shapes``: as in ``PairParts``; each side of a body with a shape has its own reach.

    ``inside(k, body, tick) -> bool``: a shortcut, which saves most calls of ``reach_wall``: True only if the
    body, by its plan, reaches no wall up to and at a tick. ``kinetile.toolbox.inside_arena`` is right if the
    walls are at the arena's edges; with it the kernel also skips empty time in one step. None: no shortcut.
    """

    reach_wall: Hook
    bounce: Hook
    touch: Hook | None = None
    periodic: bool = False
    shapes: bool = False
    inside: Hook | None = None
    accelerated: bool = False


@dataclass(frozen=True)
class ResponseParts:
    """The parts of a response.

    ``respond(k, a, b, nx, ny, rule)``: body a meets body b, or a wall (b is below 0: ``toolbox.LEFT`` and so
    on). The bodies are anchored at the contact; (nx, ny) is the normal from a to b, of length 1. Give them
    new velocities; places, radii and masses stay. A body whose mass is infinite keeps its velocity.
    ``k.traits[a].touched`` is the tick of its last contact before this one. None, for the kernel's own
    ``elastic`` and ``pass``: the narrow phases respond, or nothing does.

    If a response of the scene has an option ``settle``, bodies may rest (rules 9r to 9h): ``toolbox.rest``
    lets a body settle on the body or wall that it meets. With an option ``one_way``, two numbers, ``respond``
    is called for a movable body that meets an immovable one from there, and others pass (rule 11w).

    ``contact_time``: about the shortest flight of accelerated bodies after a contact at which they are
    pressed together (rule 11h), in the scene's time; 0: 2^-14 units of its clock.

    ``numbers`` are up to six numbers of the response, found in ``rule.first``, ``second``, ``third``,
    ``fourth``, ``fifth`` and ``sixth``: other numbers need no other machine code.

    ``beside`` are the hooks of other responses that are compiled into the same loop, if there is room, so
    that a scene with these responses needs no other machine code either.
    """

    respond: Hook | None = None
    numbers: tuple[float, ...] = ()
    beside: tuple[Hook, ...] = ()
    contact_time: float = 0.0


class ContactResponse(Protocol):
    """Defines a contact's outcome; its class is created with its options as keyword arguments."""

    def prepare(self, scene: Scene) -> ResponseParts:
        """Returns the parts for a scene; raises ``errors.Refused`` for one that this response cannot do."""


class BroadPhase(Protocol):
    """Keeps a set of candidate pairs complete; may never change the answer, only the computing time."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts for a scene; raises ``errors.Refused`` for one that this phase cannot do."""


class NarrowPhase(Protocol):
    """Computes the tick at which two bodies, or a body and a wall, touch, and the outcome of the contact."""

    def prepare(self, scene: Scene) -> PairParts | WallParts:
        """Returns the parts for a scene; raises ``errors.Refused`` for one that this phase cannot do."""


MOST_BODIES = 2**31 - 1
"""Pairs and bodies are numbered in 32 bits."""

PYTHON_PARTS = ("arrange", "audit", "draw")

DRAWN_AS = ("", "tiling", "bounds x", "bounds y", "boxes")
"""Structures that a page can compute by itself."""

Parts: TypeAlias = BroadPhaseParts | PairParts | WallParts | ResponseParts


def arguments_of(parts: type[Parts]) -> dict[str, str]:
    """Returns the arguments of hooks and plain functions by name, from the docstring of their parts."""
    return dict(re.findall(r"``(\w+)\((k[\w, ]+)\)", parts.__doc__ or ""))


def check_parts(who: str, parts: Parts) -> None:
    """Raises PhaseError, with all errors, unless the parts can be composed."""
    wrong = list(_mistakes(parts))
    if wrong:
        raise PhaseError(f"{who}: prepare returned parts that do not fit: {'; '.join(wrong)}")


def _mistakes(parts: Parts) -> Iterator[str]:
    if isinstance(parts, PairParts) and parts.contact_distance not in get_args(ContactDistance):
        expected = " or ".join(map(repr, get_args(ContactDistance)))
        yield f"contact_distance is {_shown(parts.contact_distance)}; expected {expected}"
    if isinstance(parts, PairParts) and parts.numbers is not None:
        given: Any = parts.numbers
        array = isinstance(given, np.ndarray) and given.dtype == np.float64 and given.ndim == 1
        if not array or not given.flags.c_contiguous:
            yield f"numbers is {_shown(given)}; expected an array of float64, of one dimension and contiguous"
    if isinstance(parts, BroadPhaseParts):
        yield from _broad_mistakes(parts)
    if isinstance(parts, ResponseParts):
        numbers: Any = parts.numbers
        fine = isinstance(numbers, tuple) and len(numbers) <= 6
        if not fine or not all(isinstance(n, int | float) and math.isfinite(n) for n in numbers):
            yield f"numbers is {_shown(numbers)}; expected a tuple of up to six finite numbers"
        lasting: Any = parts.contact_time
        if not isinstance(lasting, int | float) or not 0.0 <= lasting < math.inf:
            yield f"contact_time is {_shown(lasting)}; expected a length of time"
        beside: Any = parts.beside
        if not isinstance(beside, tuple) or not all(map(is_hook, beside)):
            yield f"beside is {_shown(beside)}; expected a tuple of functions marked with toolbox.hook"
    arguments = arguments_of(type(parts))
    for each in fields(parts):  # hooks are the fields of type Hook, or Hook | None
        given, wanted = getattr(parts, each.name), str(each.type).split(" | ")
        left_out = given is None and "None" in wanted
        if "Hook" in wanted and not left_out and not is_hook(given):
            yield f"{each.name} is {_shown(given)}; expected a function marked with toolbox.hook"
        elif (takes := arguments.get(each.name)) and hasattr(function := python_of(given), "__code__"):
            try:
                inspect.signature(function).bind(*takes.split(", "))
            except TypeError:
                found = f"{inspect.signature(function)}{defined_at(given)}"
                yield f"{each.name} takes {found}; expected ({takes})"


def _broad_mistakes(parts: BroadPhaseParts) -> Iterator[str]:
    if (parts.enter is None) != (parts.leave is None):
        there, missing = ("enter", "leave") if parts.leave is None else ("leave", "enter")
        yield f"there is {there} and no {missing}; expected both or neither"
    for name in ("pairs", "room"):
        number = getattr(parts, name)
        if (
            isinstance(number, bool)
            or not isinstance(number, int | np.integer)
            or not 0 <= number <= MOST_BODIES
        ):
            yield f"{name} is {_shown(number)}; expected a whole number from 0 to {MOST_BODIES}"
    state = parts.state
    if not isinstance(state, tuple) or not hasattr(state, "_fields"):
        yield f"state is {_shown(state)}; expected a NamedTuple of arrays"
    else:
        odd = [f for f, a in zip(state._fields, state, strict=True) if not isinstance(a, np.ndarray)]
        if odd or not state:
            found = f"{odd[0]} is {_shown(getattr(state, odd[0]))}" if odd else "it is empty"
            yield f"state is to be a NamedTuple of arrays, at least one, and {found}"
    if parts.drawn_as not in DRAWN_AS:
        yield f"drawn_as is {_shown(parts.drawn_as)}; expected one of {DRAWN_AS}"
    for name in PYTHON_PARTS:
        function = getattr(parts, name)
        if function is not None and not callable(function):
            yield f"{name} is {_shown(function)}; expected a function or None"
    for ticks in parts.ticks if isinstance(parts.ticks, tuple | list) else (parts.ticks,):
        if not isinstance(ticks, np.ndarray) or ticks.dtype != np.int64:
            yield f"ticks has {_shown(ticks)} in it; expected arrays of int64"
    faults: Any = parts.faults
    wanted = "expected a tuple of sentences, with {a} and {b} for the numbers given to blame"
    if not isinstance(faults, tuple | list):
        yield f"faults is {_shown(faults)}; {wanted}"
        return
    yield from (f"faults has {_shown(each)} in it; {wanted}" for each in faults if not _is_sentence(each))


def _is_sentence(sentence: object) -> bool:
    """Returns True if this is a text with two places for numbers."""
    if not isinstance(sentence, str):
        return False
    try:
        return bool(sentence.format(a=0, b=0))
    except (LookupError, ValueError, AttributeError):
        return False


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"a {type(value).__name__}"
