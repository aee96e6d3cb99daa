"""Checks of a scene: each checks whole arrays and returns all mistakes, with their places written as in a
scene file (``bodies[3].radius``). ``kinetile.scene.reader`` runs all of them, once for each scene."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinetile.errors import KinetileError, Mistake, UnknownName, key_of, one_of
from kinetile.errors import shown as shown

if TYPE_CHECKING:
    from kinetile.plugin.specs import PluginKind

TOLERANCE = 1e-12
"""The allowed depth of a disc in a wall (in radii) or in another disc (in the sum of the two radii)."""

MOST_MISTAKES = 20
"""The number of mistakes of one kind that are spelled out; the others are only counted."""

MOST_REPORTED = 100
"""The number of mistakes of all kinds that are reported."""

SMALLEST: float = np.float64(2.0**-200)  # NumPy's: else a float32 is compared in its own width
LARGEST: float = np.float64(2.0**200)
"""Radii, masses and the arena's sides lie between these; no coordinate or speed is beyond the larger one.

So every product of up to four of them is a normal number, as contact times need, whatever the units.
"""

HEAVIEST = 2.0**100
"""The largest ratio of two masses."""

FARTHEST = 2.0**31
"""The largest distance from 0, in periods, of a place on a periodic axis."""

PERIODIC_BODY = "a disc narrower than the period, within 2**31 periods of 0"
PERIODIC_SHAPE = (
    "a body whose circle is narrower than half a period, within 2**31 periods of 0: cut a longer one into "
    "pieces, an obstacle with kinetile.polyline(...)"
)

WALL_KIND, ANY_KIND = "wall", "*"
"""Names that no kind of body has: they mean the walls of an arena, and any kind."""

FARTHEST_START: float = np.float64(2.0**52)
"""The latest start of a clock, in time units from 0: there it still resolves a unit."""

RANGE = f"from 2**-200 ({SMALLEST:.1e}) to 2**200 ({LARGEST:.1e})"
REACH = f"at most 2**200 ({LARGEST:.1e})"

_NUMBER = re.compile(r"\[\d+\]")


def is_number(value: object) -> bool:
    """Returns True if ``value`` is a real number; True and False are not numbers."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def abridged(mistakes: Iterable[Mistake]) -> list[Mistake]:
    """Keeps the first LIMIT mistakes of each kind of place, MOST_REPORTED in all, and counts the others."""
    kept: list[Mistake] = []
    seen: Counter[str] = Counter()
    last: dict[str, Mistake] = {}
    for mistake in mistakes:
        kind = _NUMBER.sub("[...]", mistake.where)
        seen[kind] += kind != mistake.where
        if seen[kind] <= MOST_MISTAKES:
            kept.append(mistake)
        last[kind] = mistake
    for kind, count in seen.items():
        if count > MOST_MISTAKES:
            kept.append(
                Mistake(kind, f"{count - MOST_MISTAKES:,} more mistakes like these", last[kind].expected)
            )
    if len(kept) > MOST_REPORTED:
        more = Mistake("the scene", f"{len(kept) - MOST_REPORTED:,} more mistakes of other kinds", "none")
        kept = [*kept[:MOST_REPORTED], more]
    return kept


def is_kind(value: object) -> bool:
    """Returns True if a value can be a kind."""
    if isinstance(value, bool):
        return False
    if isinstance(value, str):
        return bool(value) and value not in (WALL_KIND, ANY_KIND) and _is_text(value)
    return isinstance(value, int | np.integer) and 0 <= int(value) < 2**31


def as_kind(value: Any) -> str | int:
    """Returns a kind as scenes keep it: plain text or a plain number, from any class."""
    return str.__str__(value) if isinstance(value, str) else int(value)


def plain(value: Any) -> Any:
    """Returns an option's value as a scene file would return it; a copy if no file can hold it."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and math.isnan(value):
        return math.nan  # the same object, so that equal tables with it are equal
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    return deepcopy(value)


def _is_text(value: str) -> bool:
    """True if a file can hold this text: half of a surrogate pair has no form in UTF-8."""
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def is_finite(value: Any) -> bool:
    """Returns True if ``value`` is a finite real number; an integer too large for a float is not."""
    if type(value) is float:  # most are
        return math.isfinite(value)
    try:
        return is_number(value) and math.isfinite(value)
    except OverflowError:
        return False


def read_count(value: Any, name: str, of: str = "bodies", least: int = 0) -> int:
    """Returns a number of bodies or other things; ValueError for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise ValueError(f"{name} is a whole number of {of}, at least {least}; found {shown(value)}")
    return int(value)


class Extent(NamedTuple):
    """An arena, (width, height), its periodic axes, "", "x", "y" or "xy", and ``walled``, True if bodies have
    to be inside its walls."""

    sides: tuple[float, float]
    periodic: str
    walled: bool = True

    @property
    def periods(self) -> tuple[float, float]:
        """The periods of the two axes; 0 for an axis that is not periodic."""
        width, height = self.sides
        return (width if "x" in self.periodic else 0.0, height if "y" in self.periodic else 0.0)


def name_alone(text: str, table: str) -> str:
    """Returns the text after "expected" for a name with options, which belong into a table."""
    name, _, _ = text.partition(":")
    return f"the name alone, {name!r}: the text after the colon belongs in the table {table}"


def check_name(where: str, name: str, *kinds: PluginKind) -> list[Mistake]:
    """Returns the mistake of a name that none of these kinds has. Imports the registry only then."""
    from kinetile.plugin.registry import registry

    names: list[str] = []
    not_loaded = ""
    for kind in kinds:
        try:
            registry().spec(kind, name)
        except UnknownName as error:
            names += error.available
            not_loaded = "".join(f"; not loaded: {failure}" for failure in error.failures)
        else:
            return []
    found = f"{shown(name)}, which is the name of no {' and no '.join(kinds)}"
    alone = name.partition(":")[0]
    if alone in names:
        table = {"scene": "parameters", "response": "options"}.get(kinds[0], f"options.{alone}")
        return [Mistake(where, shown(name), name_alone(name, table))]
    return [Mistake(where, found, one_of(name, names) + not_loaded)]


def option_mistakes(name: str, options: Mapping[str, Any], where: str, *kinds: PluginKind) -> list[Mistake]:
    """Returns the mistakes in options of the plugin with this name and one of these kinds: unknown options,
    missing ones, and values that it cannot use. ``where`` is the place of the options."""
    from kinetile.plugin.calling import calling
    from kinetile.plugin.parameters import REQUIRED, parameters_of
    from kinetile.plugin.registry import registry

    kind = next(each for each in kinds if not check_name("", name, each))
    mistakes = []
    try:
        known = {each.name: each.default for each in parameters_of(kind, name)}
        for key in (key for key in options if key not in known):
            wanted = key_of(key, known, options[key])
            mistakes.append(Mistake(f"{where}.{key}", "no option of this name", wanted))
        lacking = [key for key in known if known[key] is REQUIRED and key not in options]
        for key in () if mistakes else lacking:  # a misspelt option is reported once
            mistakes.append(Mistake(f"{where}.{key}", "nothing", "a value: it has no default"))
        options = {key: options[key] for key in options if key in known}
        if not lacking:
            with calling(kind, name, "its constructor"):
                registry().target(kind, name)(**options)
    except KinetileError as error:
        what = "response" if kind == "response" else "phase"
        mistakes.append(Mistake(where, shown(options), f"what the {what} can use: {error}"))
    return mistakes
