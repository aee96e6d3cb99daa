"""Everything that can be wrong with a scene, found all at once.

Each check looks at whole arrays and returns the mistakes it found, with their places written as in a scene
file (``bodies[3].radius``). A value that has been reported already, because it is missing or of the wrong
type, is passed as NaN and marked as unknown: the checks that need it leave that body out, and judge all the
others.
"""

from __future__ import annotations

import math
import operator
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import Mistake
from kinetile.scene.overlaps import overlapping_pairs

__all__ = [
    "ANY",
    "FARTHEST_START",
    "HEAVIEST",
    "LARGEST",
    "LIMIT",
    "SMALLEST",
    "TOLERANCE",
    "WALL",
    "abridged",
    "as_kind",
    "check_bodies",
    "check_frame",
    "check_pace",
    "check_turn",
    "is_finite",
    "is_kind",
    "is_number",
    "plain",
    "shown",
]

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

TOLERANCE = 1e-12
"""By how much a disc may reach into a wall (in radii) or into another disc (in the sum of the two radii)."""

LIMIT = 20
"""How many mistakes of one kind are spelled out; of the others only the number is told."""

MOST_TOLD = 100
"""How many mistakes are told of all kinds together."""

SMALLEST, LARGEST = 2.0**-200, 2.0**200
"""Radii, masses and the sides of the arena lie between; no coordinate and no speed is beyond the larger one.

So every product of up to four of them is a normal number, as contact times need, whatever the units.
"""

HEAVIEST = 2.0**100
"""How many times as heavy as the lightest body the heaviest may be."""

WALL, ANY = "wall", "*"
"""What no kind of body is called: the walls of an arena, and any kind."""

FARTHEST_START = 2.0**52
"""How many time units from 0 a clock may start: there it still resolves one."""

_RANGE = f"from 2**-200 ({SMALLEST:.1e}) to 2**200 ({LARGEST:.1e})"
_REACH = f"at most 2**200 ({LARGEST:.1e})"

_NUMBER = re.compile(r"\[\d+\]")
_ENOUGH_CHUNKS = 8  # how long overlaps are counted on once there are more than LIMIT


def is_number(value: object) -> bool:
    """Say whether ``value`` is a real number; True and False are none."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def abridged(mistakes: Iterable[Mistake]) -> list[Mistake]:
    """Keep the first LIMIT mistakes of each kind of place, MOST_TOLD in all, and tell how many more."""
    kept: list[Mistake] = []
    seen: Counter[str] = Counter()
    last: dict[str, Mistake] = {}
    for mistake in mistakes:
        kind = _NUMBER.sub("[...]", mistake.where)
        seen[kind] += kind != mistake.where
        if seen[kind] <= LIMIT:
            kept.append(mistake)
        last[kind] = mistake
    for kind, count in seen.items():
        if count > LIMIT:
            kept.append(Mistake(kind, f"{count - LIMIT:,} more mistakes like these", last[kind].expected))
    if len(kept) > MOST_TOLD:
        more = Mistake("the scene", f"{len(kept) - MOST_TOLD:,} more mistakes of other kinds", "none")
        kept = [*kept[:MOST_TOLD], more]
    return kept


def is_kind(value: object) -> bool:
    """Say whether a value can be a kind."""
    if isinstance(value, bool):
        return False
    if isinstance(value, str):
        return bool(value) and value not in (WALL, ANY) and _is_text(value)
    return isinstance(value, int | np.integer) and 0 <= int(value) < 2**31


def as_kind(value: Any) -> str | int:
    """Return a kind as scenes keep it: plain text or a plain number, whatever class it came in."""
    return str.__str__(value) if isinstance(value, str) else int(value)


def plain(value: Any) -> Any:
    """Return an option's value as a scene file would give it back: no types of NumPy, lists for tuples.

    So an option is the same before and after a file. What no file can hold is copied.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and math.isnan(value):
        return math.nan  # the same object, so that two equal tables with it are equal
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    return deepcopy(value)


def _is_text(value: str) -> bool:
    """Say whether a file can hold this text: half of a surrogate pair has no form in UTF-8."""
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def is_finite(value: Any) -> bool:
    """Say whether ``value`` is a real number and finite; an integer too large for a float is not."""
    try:
        return is_number(value) and math.isfinite(value)
    except OverflowError:
        return False


def shown(value: object, width: int = 60) -> str:
    """Return ``value`` as it is quoted in a message: numbers without their NumPy type, and not too long."""
    if isinstance(value, np.generic):
        value = value.item()
    try:
        text = repr(value)
    except ValueError:
        text = "a whole number of too many digits to be shown"
    return text if len(text) <= width else f"{text[: width - 3]}..."


def check_frame(arena: object, start: Any, until: Any, unknown: Collection[str] = ()) -> list[Mistake]:
    """Check the arena (None, or width and height), the start and the end, except those that are unknown."""
    mistakes = []
    if arena is not None and "arena" not in unknown:
        sides = list(arena) if isinstance(arena, (Sequence, np.ndarray)) else []
        if len(sides) != 2 or not all(is_finite(side) and side > 0 for side in sides):
            found = shown(sides or arena)
            mistakes.append(Mistake("arena", found, "[width, height], two finite numbers greater than 0"))
        elif not all(SMALLEST <= side <= LARGEST for side in sides):
            mistakes.append(Mistake("arena", shown(sides), f"[width, height], each {_RANGE}"))
    if "start" not in unknown:
        if not is_finite(start):
            mistakes.append(Mistake("start", shown(start), "a finite number"))
        elif abs(start) > FARTHEST_START:
            mistakes.append(_too_late(start, 1.0))
    if until is not None and "until" not in unknown:
        if not is_finite(until):
            mistakes.append(Mistake("until", shown(until), "a finite number"))
        elif is_finite(start) and "start" not in unknown and until < start:
            mistakes.append(Mistake("until", shown(until), f"a time not before the start, {shown(start)}"))
    return mistakes


def check_pace(start: float, unit: float) -> list[Mistake]:
    """Check a scene's start against its time unit, which is less than 1 where bodies are fast."""
    return [_too_late(start, unit)] if abs(start) > FARTHEST_START * unit else []


def check_unit(unit: Any) -> list[Mistake]:
    """Check the unit of a scene's clock, where it is given."""
    if unit is None:
        return []
    if is_finite(unit) and 2.0**-900 <= unit <= 1.0 and math.frexp(unit)[0] == 0.5:
        return []
    return [Mistake("unit", shown(unit), "a power of two from 2**-900 to 1, or None")]


def _too_late(start: Any, unit: float) -> Mistake:
    least = f"a start at most {FARTHEST_START * unit:.6g} from 0"
    return Mistake(
        "start", shown(start), f"{least}, beyond which a time unit, {unit:.3g}, is lost in rounding"
    )


def check_turn(
    turn: Any, where: str, bodies: int, start: float | None, unknown: Collection[str] = ()
) -> list[Mistake]:
    """Check one turn, (body, time, (vx, vy)), except "time" or "velocity" if they are unknown.

    ``start`` is None where it is not known.
    """
    try:
        body, time, velocity = turn[:3]
        pair = list(velocity)
    except (TypeError, ValueError):
        return [Mistake(where, shown(turn), "a turn: (body, time, (vx, vy))")]
    mistakes = []
    try:
        known = not isinstance(body, bool) and 0 <= operator.index(body) < bodies
    except TypeError:
        known = False
    if not known:
        there = f"the number of a body, 0 to {bodies - 1}" if bodies else "no turns in a scene without bodies"
        mistakes.append(Mistake(f"{where}.body", shown(body), there))
    if "time" in unknown:
        pass
    elif not is_finite(time):
        mistakes.append(Mistake(f"{where}.time", shown(time), "a finite number"))
    elif start is not None and time < start:
        mistakes.append(Mistake(f"{where}.time", shown(time), f"a time not before the start, {start!r}"))
    if "velocity" in unknown:
        pass
    elif len(pair) != 2 or not all(is_finite(part) for part in pair):
        mistakes.append(Mistake(f"{where}.velocity", shown(pair), "[vx, vy], two finite numbers"))
    elif max(map(abs, pair)) > LARGEST:
        mistakes.append(Mistake(f"{where}.velocity", shown(pair), f"[vx, vy], each {_REACH} in size"))
    return mistakes


def check_bodies(
    position: Floats,
    velocity: Floats,
    radius: Floats,
    mass: Floats,
    arena: tuple[float, float] | None,
    unknown: Mapping[str, Bools] | None = None,
    passing: tuple[npt.NDArray[np.int64], Bools] | None = None,
) -> list[Mistake]:
    """Check n bodies: position and velocity (n, 2), radius and mass (n,).

    Pass None as the arena where there is none, or none that can be judged by. ``unknown`` maps a field's name
    to an (n,) mask of the bodies of which that field is not to be judged. ``passing`` are (n,) the kinds of
    the bodies and (kinds, kinds) which pass through each other, and so may overlap; None: no one does.
    """
    nothing = np.zeros(len(position), dtype=np.bool_)
    unknown = unknown or {}
    mistakes: list[Mistake] = []
    right: dict[str, Bools] = {}
    for name, vectors in (("position", position), ("velocity", velocity)):
        finite = np.asarray(np.isfinite(vectors).all(axis=1))
        right[name] = np.asarray((np.abs(vectors) <= LARGEST).all(axis=1))
        told = ~unknown.get(name, nothing)
        mistakes += _spell_out(~finite & told, name, vectors, "[x, y], two finite numbers")
        mistakes += _spell_out(finite & ~right[name] & told, name, vectors, f"[x, y], each {_REACH} in size")
    for name, numbers in (("radius", radius), ("mass", mass)):
        still = np.asarray(np.isinf(numbers) if name == "mass" else nothing)
        positive = np.asarray((np.isfinite(numbers) | still) & (numbers > 0.0))
        right[name] = np.asarray((numbers >= SMALLEST) & ((numbers <= LARGEST) | still))
        told = ~unknown.get(name, nothing)
        what = "a number greater than 0, or inf" if name == "mass" else "a finite number greater than 0"
        mistakes += _spell_out(~positive & told, name, numbers, what)
        mistakes += _spell_out(positive & ~right[name] & told, name, numbers, f"a number {_RANGE}")
    movable = np.asarray(right["mass"] & np.isfinite(mass))
    mistakes += _check_masses(mass, np.flatnonzero(movable & ~unknown.get("mass", nothing)))
    placed = right["position"] & right["radius"]
    placed &= ~unknown.get("position", nothing) & ~unknown.get("radius", nothing)
    if arena is not None:
        mistakes += _check_inside(position, radius, arena, placed)
    return mistakes + _check_apart(position, radius, np.flatnonzero(placed), passing)


def _check_masses(mass: Floats, bodies: npt.NDArray[np.intp]) -> list[Mistake]:
    """Check that the heaviest of these bodies is not beyond all measure heavier than the lightest."""
    if not len(bodies):
        return []
    light = int(bodies[np.argmin(mass[bodies])])
    heavy = int(bodies[np.argmax(mass[bodies])])
    if mass[heavy] / mass[light] <= HEAVIEST:
        return []
    found = f"{mass[light]:.6g} and {mass[heavy]:.6g}"
    expected = f"no body more than 2**100 ({HEAVIEST:.1e}) times as heavy as another"
    return [Mistake(f"bodies[{light}].mass and bodies[{heavy}].mass", found, expected)]


def _spell_out(
    wrong: Bools, field: str, found: Floats | Callable[[int], str], expected: str
) -> list[Mistake]:
    """Turn a mask of wrong bodies into mistakes, LIMIT of them and a last one that counts the others."""
    bodies = np.flatnonzero(wrong)
    mistakes = []
    for i in bodies[:LIMIT].tolist():
        what = found(i) if callable(found) else shown(found[i].tolist())
        mistakes.append(Mistake(f"bodies[{i}].{field}", what, expected))
    if len(bodies) > LIMIT:
        more = f"the same in {len(bodies) - LIMIT:,} more bodies"
        mistakes.append(Mistake(f"bodies[...].{field}", more, expected))
    return mistakes


def _check_inside(
    position: Floats, radius: Floats, arena: tuple[float, float], placed: Bools
) -> list[Mistake]:
    allowed = TOLERANCE * radius
    with np.errstate(invalid="ignore", over="ignore"):
        beyond = {
            "left": radius - position[:, 0],
            "right": (position[:, 0] - arena[0]) + radius,
            "bottom": radius - position[:, 1],
            "top": (position[:, 1] - arena[1]) + radius,
        }
        outside = {wall: placed & (depth > allowed) for wall, depth in beyond.items()}

    def found(i: int) -> str:
        walls = [f"{beyond[wall][i]:.6g} beyond the {wall} wall" for wall in beyond if outside[wall][i]]
        return (
            f"{shown(position[i].tolist())} with radius {radius[i]:.6g}, which reaches {' and '.join(walls)}"
        )

    expected = f"the whole disc inside the arena, [0, {arena[0]!r}] x [0, {arena[1]!r}]"
    return _spell_out(np.logical_or.reduce(list(outside.values())), "position", found, expected)


def _check_apart(
    position: Floats,
    radius: Floats,
    bodies: npt.NDArray[np.intp],
    passing: tuple[npt.NDArray[np.int64], Bools] | None,
) -> list[Mistake]:
    """Report the first LIMIT overlapping pairs among ``bodies``, and how many more there are."""
    first: list[tuple[int, int]] = []
    count, counted_all = 0, True
    for chunk, found in enumerate(overlapping_pairs(position[bodies], radius[bodies], TOLERANCE)):
        if passing is not None:
            kind, passes = passing
            one, two = kind[bodies[found]].T
            found = found[~passes[one, two]]
        count += len(found)
        if len(found):
            order = np.lexsort((found[:, 1], found[:, 0]))[:LIMIT]
            first = sorted([*first, *((int(a), int(b)) for a, b in bodies[found[order]])])[:LIMIT]
        if count > LIMIT and chunk >= _ENOUGH_CHUNKS:
            counted_all = False
            break
    expected = "discs that touch at most"
    mistakes = [
        Mistake(f"bodies[{a}] and bodies[{b}]", _overlap(position, radius, a, b), expected) for a, b in first
    ]
    if count > LIMIT:
        more = f"{'' if counted_all else 'at least '}{count - LIMIT:,} more pairs that overlap"
        mistakes.append(Mistake("bodies", more, expected))
    return mistakes


def _overlap(position: Floats, radius: Floats, a: int, b: int) -> str:
    apart = math.dist(position[a].tolist(), position[b].tolist())
    together = radius[a].item() + radius[b].item()
    return f"an overlap of {together - apart:.6g} (distance {apart:.6g}, sum of the radii {together:.6g})"
