"""Bounds that hold for every body of a run: from masses and energy to a speed, to the skin.

The skin, which enlarges bodies for a broad phase, has to cover rounding, which grows with the greatest speed
and the distance from the origin. No body exceeds the speed that the lightest one would have with all the
energy. If a body would exceed it, the engine lays its tables out again.
"""

import math
from typing import NamedTuple

import numpy as np

from kinetile.kernel.clock import TICKS
from kinetile.kernel.flight import plans_now
from kinetile.kernel.plan import LEAST_SPAN, SHARE, shortest, velocities_after
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import Kernel
from kinetile.run.prepared import widened
from kinetile.scene import Insert, Scene
from kinetile.scene.frame import check_pull
from kinetile.toolbox.reach import drop_of, margin_of, speed_bound

MOST_FLOWN = 2.0**-20
"""The greatest flight in one tick, in smallest radii; beyond it a tick is too coarse for contacts."""

NO_SKIN = Skin(*[0.0] * len(Skin._fields))


class Bounds(NamedTuple):
    """Bounds over all bodies of a run, those still to come included.

    Attributes:
        lightest, smallest: the smallest mass, and the smallest radius.
        squares: at least the sum of mass * speed^2 over all bodies and commands to come, twice the largest
            possible energy: removals do not reduce it; infinite until it is needed.
        speed, extent: a speed that no body exceeds, and the largest distance of a body from the origin.
        skin: the skin that follows from speed and extent.
    """

    lightest: float
    smallest: float
    squares: float
    speed: float
    extent: float
    skin: Skin

    @classmethod
    def at_start(cls, scene: Scene) -> "Bounds":
        """Returns the bounds of a scene; extent and skin follow when its tables are laid out."""
        coming = [command for command in scene.commands if isinstance(command, Insert)]
        masses = [*scene.mass.tolist(), *(command.mass for command in coming)]
        radii = [*scene.radius.tolist(), *(command.radius for command in coming)]
        lightest, smallest = min(masses, default=math.inf), min(radii, default=math.inf)
        return cls(lightest, smallest, math.inf, speed_bound(scene), 0.0, NO_SKIN)


def squares_of_bodies(k: Kernel) -> float:
    """Returns the sum of mass * speed^2 of all bodies, rounded once: the order of slots does not matter."""
    there = np.flatnonzero(k.queue.number >= 0)
    vx, vy = velocities_after(*plans_now(k, there)).T
    mass = np.where(np.isinf(k.mass), 0.0, k.mass)[there]
    return math.fsum((mass * (vx * vx + vy * vy)).tolist())


def unfit_pull(scene: Scene, pull: tuple[float, float], until: float = -math.inf) -> str:
    """Returns the expected text for an acceleration that a run of a scene to a time cannot have; "" for a
    possible one."""
    for mistake in check_pull("", pull, scene.periodic):
        return mistake.expected
    largest, last = (abs(pull[0]), abs(pull[1])), scene.settings.until
    if all(each <= most for each, most in zip(largest, scene.pull, strict=True)):
        return ""
    if scene.arena is None and (last is None or until > last):
        end = "which this one lacks" if last is None else f"{last}, and this run goes to {until}"
        return f"none: without an arena bodies are accelerated up to the scene's end, {end}"
    wide = widened(scene, pull=largest)
    margin, fallen = margin_of(wide), math.sqrt(drop_of(wide)) * scene.time_unit / TICKS
    short = shortest(wide.pull, margin, scene.time_unit) < LEAST_SPAN
    if short or fallen > MOST_FLOWN * (margin / SHARE):
        return (
            "less: by that a body falls far in a tick of this scene's clock; plan it in the scene, which "
            "chooses its clock by it, or give the scene a unit"
        )
    return ""
