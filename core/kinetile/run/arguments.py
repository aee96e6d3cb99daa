"""What a simulation is asked for, checked before anything is done: an end, a command."""

from __future__ import annotations

import operator
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from kinetile.kernel.log import INSERTED, TURNED
from kinetile.run.advance import End
from kinetile.run.engine import UNLIMITED, Command, Engine
from kinetile.scene import Insert, Scene
from kinetile.scene.checks import is_finite, shown
from kinetile.scene.commands import check_commands, numbered

__all__ = ["read_body", "read_end", "read_insertion", "read_turns"]


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


def read_body(engine: Engine, body: object) -> int:
    """Return the number of a body that is there; IndexError where there is none, with what is known of it."""
    try:
        number = operator.index(body)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"a body goes by its number; found {shown(body)}") from None
    slots = engine.k.slots
    if 0 <= number < len(slots) and slots[number] >= 0:
        return number
    there = int(engine.k.clock[0].present)
    if not 0 <= number < engine.numbers:
        raise IndexError(f"there is no body {number}: numbers up to {engine.numbers - 1} have been given")
    raise IndexError(f"there is no body {number} now: it has gone, or is still to come; {there} are there")


def read_turns(engine: Engine, bodies: object, velocities: object) -> list[Command]:
    """Return the turns of bodies, each to its velocity; velocities are (n, 2), or one for all.

    IndexError for a body that is not there, ValueError where a velocity is not such as can be flown.
    """
    numbers = np.atleast_1d(np.asarray(bodies))
    if numbers.ndim != 1 or (numbers.dtype.kind not in "iu" and len(numbers)):
        raise ValueError(f"bodies are given by a list of their numbers; found {shown(bodies)}")
    try:
        given = np.asarray(velocities, dtype=np.float64)
        pairs = np.broadcast_to(given, (len(numbers), 2))
    except (TypeError, ValueError, OverflowError):
        pairs = np.full((len(numbers), 2), np.nan)
    if not np.isfinite(pairs).all():
        if isinstance(velocities, Sequence) and len(velocities) == 1 == len(numbers):
            raise ValueError(f"a velocity is two finite numbers; found {shown(velocities[0])}")
        expected = f"expected one, or one for each of the {len(numbers)} bodies, (n, 2)"
        raise ValueError(f"a velocity is two finite numbers; {expected}; found {shown(velocities)}")
    known = [read_body(engine, number) for number in numbers.tolist()]
    _check_speed(engine, pairs, engine.smallest)
    ticks, after = engine.moment
    mass = engine.k.mass[engine.k.slots[known]].tolist()
    rows = zip(known, pairs.tolist(), mass, strict=True)
    return [Command(ticks, body, TURNED, vx=v[0], vy=v[1], mass=m, after=after) for body, v, m in rows]


def read_insertion(engine: Engine, position: object, velocity: object, radius: float, mass: float) -> Command:
    """Return the command by which a body comes now; ValueError where it is none that could be in a scene."""
    asked = Insert(engine.time, position, velocity, radius, mass, engine.numbers)  # type: ignore[arg-type]
    mistakes = check_commands([asked], None, engine.scene.arena)
    if mistakes:
        said = "; ".join(
            f"{mistake.where.partition('.')[2]} is {mistake.found}, expected {mistake.expected}"
            for mistake in mistakes
        )
        raise ValueError(f"this body cannot come: {said}")
    (new,) = numbered([asked], 0)
    assert isinstance(new, Insert)
    _check_speed(engine, np.asarray([new.velocity]), min(engine.smallest, new.radius))
    ticks, after = engine.moment
    return Command(ticks, new.body, INSERTED, *new.position, *new.velocity, new.radius, new.mass, after)


def _check_speed(engine: Engine, velocities: npt.NDArray[np.float64], smallest: float) -> None:
    speed = float(np.hypot(velocities[:, 0], velocities[:, 1]).max(initial=0.0))
    if speed * float(engine.k.clock[0].tick) > 2.0**-20 * smallest:
        raise ValueError(
            f"at the speed {speed:.3g} a body would fly too far in one tick of this scene's clock: schedule "
            "the command in the scene, which chooses its clock by its speeds, or give the scene a unit"
        )


def _last(so_far: int, more: int | None, name: str) -> int:
    """Return the number of contacts or events, in all, after which to stop."""
    if more is None:
        return UNLIMITED
    if operator.index(more) < 0:
        raise ValueError(f"{name} must not be negative; found {more}")
    return min(so_far + operator.index(more), UNLIMITED)
