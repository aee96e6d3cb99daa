"""What a simulation is asked for, checked before anything is done: an end, a turn."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence

import numpy as np

from kinetile.run.advance import End
from kinetile.run.engine import UNLIMITED, Engine
from kinetile.scene import Scene
from kinetile.scene.checks import is_finite, shown

__all__ = ["read_end", "read_turn"]


def read_end(
    engine: Engine,
    scene: Scene,
    until: float | None,
    max_contacts: int | None = None,
    max_events: int | None = None,
) -> End:
    """Return the end that was asked for; ValueError where it is none, or lies in the past."""
    if until is None:
        until = scene.settings.until
    if until is None and max_contacts is None and max_events is None:
        raise ValueError("run needs an end: until=, max_contacts=, max_events= or an until in the scene")
    end = End(
        contacts=_last(engine.contacts, max_contacts, "max_contacts"),
        events=_last(engine.events, max_events, "max_events"),
    )
    if until is None:
        return end
    if not is_finite(until):
        raise ValueError(f"until must be a finite time; found {shown(until)}")
    until = float(until)
    ticks = engine.clock.total(engine.now) if until == engine.time else engine.clock.ticks(until)
    if engine.clock.relative(ticks) < engine.now:
        raise ValueError(f"until={until} lies in the past: the time is {engine.time}")
    return end._replace(until=until, ticks=ticks)


def read_turn(engine: Engine, scene: Scene, body: int, velocity: object) -> tuple[int, float, float]:
    """Return a body and its new velocity; IndexError, or ValueError where it is not such as can be flown."""
    body = operator.index(body)
    if not 0 <= body < len(scene):
        raise IndexError(f"there is no body {body}: this scene has {len(scene)}, numbered from 0")
    parts = velocity.tolist() if isinstance(velocity, np.ndarray) else velocity
    if not isinstance(parts, Sequence) or len(parts) != 2 or not all(map(is_finite, parts)):
        raise ValueError(f"a velocity is two finite numbers; found {shown(velocity)}")
    vx, vy = float(parts[0]), float(parts[1])
    speed = math.hypot(vx, vy)
    if speed * float(engine.k.clock[0].tick) > 2.0**-20 * float(scene.radius.min()):
        raise ValueError(
            f"at the speed {speed:.3g} body {body} would fly too far in one tick of this scene's clock: "
            "schedule the turn in the scene, which chooses its clock by its speeds"
        )
    return body, vx, vy


def _last(so_far: int, more: int | None, name: str) -> int:
    """Return the number of contacts or events, in all, after which to stop."""
    if more is None:
        return UNLIMITED
    if operator.index(more) < 0:
        raise ValueError(f"{name} must not be negative; found {more}")
    return min(so_far + operator.index(more), UNLIMITED)
