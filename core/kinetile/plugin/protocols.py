"""The seam: what a broad phase and a narrow phase are told, what they may change, what they must leave true.

A phase is a class. It is made with its options as keyword arguments and asked once, by ``prepare``, for its
parts: hooks (functions marked with ``kinetile.toolbox.hook``) and state. The hooks become part of the
compiled loop; nothing else of the class is used while it runs. A built-in phase has no other means than
these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from kinetile.scene import Scene

__all__ = ["BroadPhase", "BroadPhaseParts", "NarrowPhase", "PairParts", "WallParts"]

Hook = Callable[..., Any]


@dataclass(frozen=True)
class BroadPhaseParts:
    """A broad phase, ready to be composed.

    ``state`` is a NamedTuple of arrays, whose class is defined at a module's top level; every hook receives
    it as ``s``.

    ``certificates`` is the number S of structural certificates. They are numbered from 0 to S-1, and what
    each says is the phase's own business. ``schedule(k, c, tick)`` sets when certificate c fails; ``falls``
    computes that time.

    ``arrange(k, s)`` (plain Python with NumPy, not compiled; may be None) puts the state into the order of
    the present moment, at the start and whenever the kernel builds anew. It may read ``k.bodies`` and
    ``positions_now(k)``.

    ``build(k, s)``: every certificate is unscheduled and there are no candidate pairs. Leave all certificates
    scheduled, and every pair of bodies a candidate whose contact the certificates do not exclude.

    ``pairs`` is how many candidate pairs to make room for at the start; the tables grow when need be.

    ``repair(k, s, c)``: certificate c fails now, at ``k.clock[0].now``. It is still queued: reschedule it.
    Restore the structure, reschedule what changed, add and remove candidate pairs. Never touch a body.

    ``replan(k, s, body)``: the flight plan of a body changed; its position did not. Reschedule the
    certificates that depend on it. The kernel itself asks the narrow phases again.

    ``audit(k, s)`` (plain Python; may be None) yields a sentence for each invariant of the state that does
    not hold between two events; it may be slow.

    ``ticks`` are the arrays of the state that hold ticks, other than in the kernel's queue: when the clock's
    base moves on, all ticks in them that are not NEVER are shifted.

    ``skin_limit`` is the thickest skin, a length, with which the phase is right; None: any. A scene that
    needs a thicker one is refused.

    ``solid`` says that the phase is right only while bodies cannot pass through each other.

    What must hold: whenever all structural failures up to a tick have been repaired, every two bodies that
    touch at that tick, each taken with its ``reach``, are a candidate pair.
    """

    state: Any
    certificates: int
    build: Hook
    repair: Hook
    replan: Hook
    arrange: Callable[[Any, Any], None] | None = None
    audit: Callable[[Any, Any], Iterator[str]] | None = None
    pairs: int = 0
    ticks: tuple[Any, ...] = ()
    solid: bool = False
    skin_limit: float | None = None


@dataclass(frozen=True)
class PairParts:
    """A narrow phase for two bodies, ready to be composed.

    ``meet(k, a, b)``: the tick of the first contact of bodies a < b, or NEVER, from their two flight plans
    and nothing else: computed at the later of the two anchors, never at the present time, with the true
    radii. It must be rounded down, and a pair that touches or overlaps and approaches meets at the later
    anchor. It may not ask for ``now``.

    ``collide(k, a, b)``: both bodies are anchored at the contact; give them new velocities and return how
    deep they overlap (a length, zero or negative when they do not).
    """

    meet: Hook
    collide: Hook


@dataclass(frozen=True)
class WallParts:
    """A narrow phase for a body and the arena's walls, ready to be composed.

    ``reach_wall(k, body)``: (tick, wall) of the first contact of a body record with a wall, from its plan
    alone; wall is ``kinetile.toolbox.LEFT``, ``RIGHT``, ``BOTTOM`` or ``TOP``. The arena reaches from the
    origin to ``k.clock[0].width`` and ``k.clock[0].height``.

    ``bounce(k, body, wall)``: the body is anchored at the contact; give it a new velocity and return how deep
    it is in the wall.
    """

    reach_wall: Hook
    bounce: Hook


class BroadPhase(Protocol):
    """Keeps a set of candidate pairs complete; may never change the answer, only the time it takes."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Return the parts for a scene; raise ``errors.Refused`` for one that this phase cannot do."""
        ...


class NarrowPhase(Protocol):
    """A narrow phase says when two bodies, or a body and a wall, touch, and what happens then."""

    def prepare(self, scene: Scene) -> PairParts | WallParts:
        """Return the parts for a scene; raise ``errors.Refused`` for one that this phase cannot do."""
        ...
