"""The skin: the length that bodies are enlarged by for the broad phase, so that rounding cannot change a
contact.

Two roundings move an event: of positions, and of times, down to a tick. A structure is in order at the end of
each tick, whatever the speeds, except for the rounding of positions. A chain of neighbours in a sorted list
can add that rounding up 2n times. The rounding of time counts once: the distance that two bodies fly in a
tick. The skin covers both with room: a pair is a candidate from a gap of 2 delta on (docs/one-answer.md).
Contact times never use the skin.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from kinetile.arrays import Floats
from kinetile.errors import TooThick
from kinetile.kernel.compiled import hook, with_shapes
from kinetile.kernel.tables import SIDES, Kernel, Records, fields_in

ULP = 2.0**-53


class Skin(NamedTuple):
    """Lengths, all in the scene's unit.

    Attributes:
        eta: the distance of a gap from zero at the tick of its event: by rounding, and by a tick of flight.
        delta: the skin itself; a body's reach is its radius plus this.
        theta: an inversion deeper than this at the end of a tick is repaired whatever its rate.
        tolerance: an overlap deeper than this (and 1e-9 of the radii) is a missed contact.
    """

    eta: float
    delta: float
    theta: float
    tolerance: float

    def fat(self, length: float) -> float:
        """Returns the length that a lower bound fattens two bodies by, whose places on the common clock are
        less than ``length`` from the origin: more than rounding can move them (docs/one-answer.md)."""
        return 64.0 * (ULP * length + self.eta)

    @classmethod
    def of(cls, bodies: int, extent: float, speed: float, per_tick: float, margin: float = 0.0) -> "Skin":
        """Returns the skin of n bodies within ``extent`` of the origin, never faster than ``speed``, whose
        shadows are wrong by ``margin`` at most (``kernel.chords``)."""
        rounding = 16.0 * ULP * extent
        flight = 2.0 * speed * per_tick
        return cls(
            eta=rounding + flight,
            delta=4.0 * (bodies + 4) * rounding + 2.0 * flight + margin,
            theta=2.0 * rounding,
            tolerance=64.0 * (rounding + flight),
        )


def too_thick(broad_phase: str, delta: float, limit: float) -> TooThick:
    """Returns the error of a broad phase that is only correct with a thinner skin."""
    return TooThick(
        f"{broad_phase} is right only while the skin around bodies is thin, at most {limit:.3g} here, and "
        f"rounding requires {delta:.3g}: choose another broad phase, or a scene with less range in size, "
        "mass or speed"
    )


@hook
def _reach_of_shape(body: Records, side: int, skin: float) -> float:
    if side & 2 == 0:
        return float((body.left if side & 1 == 0 else body.right) + skin)
    return float((body.down if side & 1 == 0 else body.up) + skin)


@with_shapes(_reach_of_shape)
@hook
def reach_to(body: Records, side: int, skin: float) -> float:
    """Returns the reach of a body to a side, the skin included: 0 to the left, 1 right, 2 down, 3 up.

    If all bodies are discs, this is ``body.reach``, and a loop is compiled with this alone. ``skin`` is
    ``k.clock[0].limits.skin``.
    """
    return float(body.reach)


def reaches_of(k: Kernel) -> Floats:
    """Returns (n, 4) ``reach_to`` of all bodies: left, right, down, up; not for hooks."""
    bodies = k.bodies.view(np.ndarray)
    if "left" not in bodies.dtype.names:
        return np.asarray(np.repeat(bodies["reach"][:, None], 4, axis=1))
    return np.asarray(np.stack([bodies[side] for side in fields_in(SIDES)], axis=1) + k.clock[0].limits.skin)


def box_gaps(between: Iterable[Floats], one: Floats, other: Floats) -> Floats:
    """Returns (m, n) gaps between m upright boxes and n others, along x or y, whichever gap is larger; below
    0 where they overlap.

    ``between`` are two (m, n) tables of differences of places, one less the other; ``one`` and ``other`` are
    (m, 4) and (n, 4) reaches.
    """
    x, y = (
        np.maximum(apart - (a[:, 0, None] + b[:, 1]), -apart - (a[:, 1, None] + b[:, 0]))
        for apart, a, b in zip(between, (one[:, :2], one[:, 2:]), (other[:, :2], other[:, 2:]), strict=True)
    )
    return np.maximum(x, y)
