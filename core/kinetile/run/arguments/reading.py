"""What a simulation is asked for, checked before anything is done: an end, a command."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.log import INSERTED, REMOVED, TURNED
from kinetile.run.advance import End
from kinetile.run.engine import UNLIMITED, Engine, Rows, command_rows
from kinetile.scene import Insert, Scene
from kinetile.scene.checks import is_finite, shown
from kinetile.scene.commands import check_commands
from kinetile.scene.responses import Kind, no_kind

__all__ = ["read_body", "read_end", "read_insertion", "read_removal", "read_turns"]


def read_end(
    engine: Engine,
    scene: Scene,
    until: float | None,
    max_contacts: int | None = None,
    max_events: int | None = None,
) -> End:
    """Return the end that was asked for; ValueError where it is none, or lies in the past.

    The scene's own ``until`` is its exact end, where it has one.
    """
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
    exact = scene.settings.end if until == scene.settings.until else None
    if exact is not None:
        end = end._replace(quota=exact[2])
        ticks = engine.clock.tick_of(until, exact)
    else:
        ticks = engine.clock.total(engine.now) if until == engine.time else engine.clock.ticks(until)
    if engine.clock.relative(ticks) < engine.now:
        raise ValueError(f"until={until} lies in the past: the time is {engine.time}")
    return end._replace(until=until, ticks=ticks)


def read_body(engine: Engine, body: object, or_coming: bool = False) -> int:
    """Return the number of a body that is there, or that is still to come; IndexError for any other number,
    with what is known of it, TypeError for what is no number.

    As for an index of NumPy, a float and a bool are no numbers of bodies.
    """
    if isinstance(body, bool | np.bool_ | float | np.floating):
        raise IndexError(f"a body goes by its number, a whole one; found {shown(body)}")
    try:
        number = operator.index(body)  # type: ignore[arg-type]  # anything may be given
    except TypeError:
        raise TypeError(f"a body goes by its number; found {shown(body)}") from None
    # The table of slots has room for numbers that are still to be given: they count for nothing.
    if 0 <= number < engine.numbers and engine.k.slots[number] >= 0:
        return number
    if or_coming and engine.agenda.brings(engine.k, engine.clock, number):
        return number
    there = int(engine.dial.present[0])
    if not 0 <= number < engine.numbers:
        raise IndexError(f"there is no body {number}: numbers up to {engine.numbers - 1} have been given")
    raise IndexError(f"there is no body {number} now: it has gone, or is still to come; {there} are there")


def read_turns(engine: Engine, bodies: object, velocities: object) -> Rows:
    """Return the turns of bodies, each to its velocity; velocities are (n, 2), or one for all.

    IndexError for a body that is not there, ValueError where a velocity is not such as can be flown.
    """
    try:
        numbers = np.atleast_1d(np.asarray(bodies))
    except ValueError:  # rows of different lengths
        numbers = np.zeros((0, 0))
    if numbers.ndim != 1:
        raise ValueError(f"bodies are given by a list of their numbers; found {shown(bodies)}")
    if isinstance(bodies, list | tuple) and any(isinstance(body, bool | np.bool_) for body in bodies):
        numbers = np.array(bodies, dtype=object)  # beside numbers, NumPy makes 1 of True
    if len(numbers) and numbers.dtype.kind not in "iu":
        for body in numbers.tolist():
            read_body(engine, body)
    try:
        pairs = np.asarray(velocities, dtype=np.float64)
        if pairs.shape != (len(numbers), 2):
            pairs = np.broadcast_to(pairs, (len(numbers), 2))
    except (TypeError, ValueError, OverflowError):
        pairs = np.full((len(numbers), 2), np.nan)
    if not np.isfinite(pairs).all():
        if isinstance(velocities, Sequence) and len(velocities) == 1 == len(numbers):
            raise ValueError(f"a velocity is two finite numbers; found {shown(velocities[0])}")
        expected = f"expected one, or one for each of the {len(numbers)} bodies, (n, 2)"
        raise ValueError(f"a velocity is two finite numbers; {expected}; found {shown(velocities)}")
    rows = command_rows(engine, TURNED, len(numbers))
    rows["mass"] = engine.k.mass[_slots_of(engine, numbers)]
    rows["body"] = numbers
    rows["vx"], rows["vy"] = pairs[:, 0], pairs[:, 1]
    _check_speed(engine, float(np.hypot(pairs[:, 0], pairs[:, 1]).max(initial=0.0)), engine.smallest)
    return rows


def _slots_of(engine: Engine, numbers: npt.NDArray[Any]) -> npt.NDArray[np.int32]:
    """Return the slots of bodies; IndexError where one is not there."""
    slots: npt.NDArray[np.int32] = engine.k.slots
    known = (numbers >= 0) & (numbers < engine.numbers)
    if known.all():
        found = slots[numbers.astype(np.int64)]
        if (found >= 0).all():
            return found
    for number in numbers.tolist():
        read_body(engine, number)
    raise AssertionError("one of these bodies is not there")


def read_insertion(
    engine: Engine, position: object, velocity: object, radius: float, mass: float, kind: Kind | None
) -> Rows:
    """Return the command by which a body comes now; ValueError where it is none that could be in a scene."""
    kinds = engine.scene.kinds
    kind = kinds[0] if kind is None else kind
    if kind not in kinds:
        raise ValueError(f"this body cannot come: {no_kind(kind, kinds)}")
    if mass == math.inf and engine.composition.rules is None:
        raise ValueError(
            "this body cannot come: its mass is infinite, and this run is not made for bodies that nothing "
            "can move; give the scene responses='elastic', and it is"
        )
    asked = Insert(0.0, position, velocity, radius, mass, engine.numbers, None, kind)  # type: ignore[arg-type]
    mistakes = check_commands([asked], None, engine.scene.arena)
    if mistakes:
        said = "; ".join(
            f"{mistake.where.partition('.')[2]} is {mistake.found}, expected {mistake.expected}"
            for mistake in mistakes
        )
        raise ValueError(f"this body cannot come: {said}")
    rows = command_rows(engine, INSERTED)
    x, y = map(float, asked.position)
    vx, vy = map(float, asked.velocity)
    _check_speed(engine, math.hypot(vx, vy), min(engine.smallest, radius))
    new = (x, y, vx, vy, float(radius), float(mass), engine.numbers)
    for name, value in zip(("x", "y", "vx", "vy", "radius", "mass", "body"), new, strict=True):
        rows[name] = value
    rows["kind"] = kinds.index(kind)
    return rows


def read_removal(engine: Engine, body: object) -> Rows:
    """Return the command by which a body goes now; IndexError where it is not there."""
    rows = command_rows(engine, REMOVED)
    rows["body"] = read_body(engine, body)
    return rows


def _check_speed(engine: Engine, speed: float, smallest: float) -> None:
    if speed * engine.dial.tick[0] > 2.0**-20 * smallest:
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
