"""What responses ask for between two chunks: room for those who pass through each other, a wider skin for
bodies that a response has made faster, and the passings that there are from the start."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from kinetile.errors import PhaseError
from kinetile.kernel.compiled import compose
from kinetile.kernel.loop.passing import begin_at_start
from kinetile.kernel.tables import Kernel
from kinetile.run.engine.layout import more_passings
from kinetile.scene import Scene
from kinetile.scene.checks import TOLERANCE
from kinetile.scene.overlaps import overlapping_pairs

if TYPE_CHECKING:
    from kinetile.run.engine.engine import Engine

__all__ = ["begin", "make_way", "overlapping", "quicken"]

Pairs = npt.NDArray[np.int64]


def overlapping(scene: Scene) -> Pairs:
    """Return (m, 2) the bodies that overlap at the start, the elder first, in their order."""
    if not scene.responses:
        return np.zeros((0, 2), dtype=np.int64)
    found = [*overlapping_pairs(scene.position, scene.radius, TOLERANCE), np.zeros((0, 2), dtype=np.int64)]
    pairs = np.concatenate(found)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def begin(engine: Engine) -> None:
    """Let begin what passes from the start, as much as the log has room for."""
    rows = min(len(engine.k.met), len(engine.k.log) or len(engine.k.met))
    now, engine.overlapping = engine.overlapping[:rows], engine.overlapping[rows:]
    pair = engine.composition.pair
    if pair is None:
        return
    engine.k = more_passings(engine.k, int(engine.k.clock[0].passings) + len(now) + len(engine.k.bodies))
    compose(begin_at_start, {"part": pair.part}, f"begin_{engine.composition.label}", Kernel)(engine.k, now)
    engine.k.clock[0].stopped = 0  # what is so from the start is no event


def make_way(engine: Engine) -> None:
    """Make room for more pairs that pass through each other."""
    passings = int(engine.k.clock[0].passings)
    engine.k = more_passings(engine.k, 2 * passings + len(engine.k.bodies) + 64)


def quicken(engine: Engine) -> None:
    """Lay the tables out for bodies that are faster than they were thought to become.

    Raises PhaseError where a response left a velocity that cannot be flown, Refused where the broad phase
    cannot bear the skin.
    """
    k = engine.k
    there = np.flatnonzero(k.queue.number >= 0)
    speed = np.hypot(k.bodies.vx[there], k.bodies.vy[there])
    fastest = float(speed.max(initial=0.0))
    if not fastest * float(k.clock[0].tick) <= 2.0**-20 * engine.smallest:
        body = int(k.queue.number[there[int(np.argmax(np.where(np.isnan(speed), math.inf, speed)))]])
        raise PhaseError(
            f"at time {engine.time!r} a response left body {body} with a speed of {fastest:.3g}, at which it "
            "would fly too far in one tick of this scene's clock: give the scene a smaller unit"
        )
    engine.lay_out(2.0 * max(fastest, engine.speed))
