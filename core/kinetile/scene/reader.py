"""The reader of scenes: from arguments, or the corresponding values of a file, to the fields of a scene. Each
check runs here, once for each scene. Values of a wrong form in a file are not reported again."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from kinetile.arrays import Flags, Floats
from kinetile.errors import Mistake, SceneError
from kinetile.kernel.clock import Clock, time_unit
from kinetile.kernel.plan import LEAST_SPAN, SHARE, shortest
from kinetile.scene.bodies import BODY_COLUMNS, FIXED, Bodies, check_bodies, read_accelerations, read_arrays
from kinetile.scene.checks import LARGEST, Extent, abridged, is_number, shown
from kinetile.scene.commands import (
    Accelerate,
    Command,
    Insert,
    SetKind,
    Turn,
    called,
    check_command,
    check_presence,
    check_turn,
    numbered,
    shape_of,
    speeds,
    with_ends,
    with_shape,
)
from kinetile.scene.frame import check_frame, check_pace, check_periodic, check_pull
from kinetile.scene.responses import SceneRules, read_rules, refusals, settles
from kinetile.scene.settings import Settings, check_end, check_settings
from kinetile.scene.shapes import Obstacle, Shape, ShapeTable, are_given, beside, read_table
from kinetile.scene.values import VALUES


class Given(NamedTuple):
    """The inputs of a scene: arguments of ``Scene``, obstacles, and ``until`` as a file has it."""

    position: Any
    velocity: Any
    radius: Any = None
    mass: Any = 1.0
    arena: Any = None
    turns: Any = ()
    start: Any = 0.0
    settings: Any = None
    origin: Any = None
    commands: Any = ()
    unit: Any = None
    kind: Any = None
    responses: Any = None
    kinds: Any = None
    periodic: Any = ""
    shape: Any = None
    shapes: Any = ()
    gravity: Any = None
    acceleration: Any = None
    names: Any = None
    obstacles: Sequence[Obstacle] = ()
    until: Any = None


class FilePlaces(NamedTuple):
    """The places of values in a file, ``source``, and the faults found there before they are read.

    ``mistakes`` were found before; ``faults`` are places of missing values and of wrong types, which have
    been reported; ``unread`` has, by the name of a column, (n,), True for bodies without such a value in the
    right form; ``complete`` is True if all bodies, commands and kinds could be read; ``turns`` and
    ``commands`` are the places of these, the latter with the word of each action.
    """

    source: str | None = None
    mistakes: Sequence[Mistake] = ()
    faults: Collection[str] = ()
    unread: Mapping[str, Flags] = {}
    complete: bool = True
    turns: Sequence[str] | None = None
    commands: Mapping[str, str] | None = None

    def written(self, mistake: Mistake) -> Mistake:
        """Returns a mistake with its place in the file, with the word of the action instead of "body"."""
        where, (command, _, field) = mistake.where, mistake.where.rpartition(".")
        action = (self.commands or {}).get(command, "")
        if action == "insert" and field not in ("time", "at"):
            where = f"{command}.insert.{field}"
        elif action and field == "body":
            where = f"{command}.{action}"
        elif self.commands is not None and where.startswith("names["):
            where = f"bodies{where.removeprefix('names')}.name"
        return mistake._replace(where=where)


NO_FILE = FilePlaces()
"""The places of arguments that are not from a file."""


def fill(scene: Any, given: Given, places: FilePlaces) -> None:
    """Gives a scene its values; SceneError with every mistake, and for refusals of its responses."""
    vars(scene).update(read_scene(given, places))
    _raise(refusals(scene), places)


def read_scene(given: Given, places: FilePlaces) -> dict[str, Any]:
    """Returns the values of a scene's fields; raises SceneError with every mistake, also of the file."""
    mistakes: list[Mistake] = []
    settings = _read_settings(given, mistakes)
    commands = _listed("commands", given.commands, "a sequence of commands", places.commands, mistakes)
    listed = _listed_shapes(given)
    coming = [shape_of(command, where, listed, mistakes) for where, command in commands]
    bodies = _read_bodies(given, places.unread, [each for each in coming if each is not None], mistakes)
    commands = [
        (where, with_shape(command, shape, bodies.table is not None))
        for (where, command), shape in zip(commands, coming, strict=True)
    ]
    names = _read_names(given, len(bodies), mistakes)
    commands = called(commands, names, len(bodies), mistakes)
    until = settings.until if given.until is None else given.until
    around = _read_around(given, until, mistakes)
    pulls = _read_pulls(given, places, bodies, commands, around, mistakes)
    if given.arena is None and until is None and any(pulls.most):
        right = "an end, or an arena: without either accelerated bodies fall for ever"
        mistakes.append(Mistake("until", "nothing", right))
    rules = _read_rules(given, bodies, commands, places.complete, mistakes)
    mistakes += check_bodies(bodies, around.extent, (rules.kind, rules.passing))
    turns = _read_turns(given, places, len(bodies), around, mistakes)
    for where, command in commands:
        mistakes += check_command(command, where, around.start, around.extent)
    mistakes += VALUES["unit"].mistakes(given.unit, "unit") if given.unit is not None else []
    mistakes += check_settings(settings)
    _raise(mistakes, places)

    # Each value is right by itself. The rest needs the clock, and so all of them.
    start = float(given.start)
    unit = None if given.unit is None else float(given.unit)
    first = rules.kinds[0] if rules.kinds != (0,) else None
    every = with_ends([*sorted(turns, key=lambda pair: (pair[1].time, pair[1].body)), *commands])
    known = numbered([command for _, command in every], first)
    clock = Clock(start, unit or unit_of(bodies, around.sides, known, pulls.most))
    order = _order(known, clock)
    kept = tuple(known[k] for k in order)
    mistakes = check_pace(start, clock.unit)
    resting = any(pulls.most) and any(settles(each) for _, each in rules.responses)
    if any(pulls.most):
        mistakes += _check_flights(bodies, commands, pulls.most, clock, around, until)
    mistakes += check_presence(kept, [every[k][0] for k in order], len(bodies))
    _raise(mistakes + check_end(settings, clock), places)
    return _arrays_of(bodies, pulls.each, rules) | {
        "arena": around.sides,
        "commands": kept,
        "start": start,
        "unit": unit,
        "time_unit": clock.unit,
        "settings": settings,
        "origin": dict(given.origin or {}),
        "periodic": given.periodic,
        "gravity": pulls.gravity,
        "pull": pulls.most,
        "uniform": not any(pulls.most) or (not resting and _is_uniform(pulls.each, kept, pulls.gravity)),
        "resting": resting,
        "names": names,
    }


class _Around(NamedTuple):
    """The surroundings of bodies, as far as they are right: the ``sides`` of the arena, its ``periodic``
    axes, both together; the start of the scene; and True if the positions of walls are known."""

    sides: tuple[float, float] | None
    periodic: str
    extent: Extent | None
    start: float | None
    walls_known: bool


def _read_around(given: Given, until: Any, mistakes: list[Mistake]) -> _Around:
    framed = check_frame(given.arena, given.start, until)
    amiss = {mistake.where for mistake in framed}
    wrong = check_periodic(given.periodic, given.arena is not None)
    mistakes += framed + wrong
    known = given.arena is not None and "arena" not in amiss
    sides = (float(given.arena[0]), float(given.arena[1])) if known else None
    periodic = "" if wrong or sides is None else given.periodic
    extent = None if sides is None else Extent(sides, periodic)
    start = None if "start" in amiss else float(given.start)
    return _Around(sides, periodic, extent, start, not (wrong or "arena" in amiss))


class _Pulls(NamedTuple):
    """Accelerations: (n, 2) of each body; gravity; and the largest along x and y, also of commands."""

    each: Floats
    gravity: tuple[float, float]
    most: tuple[float, float]


def _read_pulls(
    given: Given,
    places: FilePlaces,
    bodies: Bodies,
    commands: Sequence[tuple[str, Any]],
    around: _Around,
    mistakes: list[Mistake],
) -> _Pulls:
    gravity = _read_gravity(given, around.periodic, around.walls_known, mistakes)
    pulls = np.where(np.isinf(bodies.mass)[:, None], 0.0, gravity)
    if given.acceleration is not None:
        own = read_accelerations(given.acceleration, bodies, places.unread.get("acceleration"), mistakes)
        pulls = np.where(np.isnan(own), pulls, own + 0.0)
    pulling = _pulling(commands)
    if around.walls_known:
        mistakes += _check_pulls(bodies, pulls, commands, pulling, around.periodic)
    return _Pulls(pulls, gravity, _largest(pulls, pulling, gravity))


def _read_turns(
    given: Given, places: FilePlaces, bodies: int, around: _Around, mistakes: list[Mistake]
) -> list[tuple[str, Turn]]:
    right = "a sequence of turns: (body, time, (vx, vy))"
    turns = _listed("turns", given.turns, right, places.turns, mistakes)
    wrong = [mistake for where, turn in turns for mistake in check_turn(turn, where, bodies, around.start)]
    mistakes += wrong
    return [] if wrong else [(where, Turn(*turn)) for where, turn in turns]


def _check_flights(
    bodies: Bodies,
    commands: Sequence[tuple[str, Any]],
    pull: tuple[float, float],
    clock: Clock,
    around: _Around,
    until: Any,
) -> list[Mistake]:
    """Returns mistakes of accelerated bodies: values that the clock, or doubles, cannot hold."""
    mistakes = _check_chords(bodies, commands, pull, clock.unit)
    if around.sides is None and until is not None and max(pull) * (until - clock.start) > LARGEST:
        right = f"an end by which bodies are no faster than {LARGEST:.1e}"
        mistakes.append(Mistake("until", shown(until), right))
    return mistakes


def _arrays_of(bodies: Bodies, pulls: Floats, rules: SceneRules) -> dict[str, Any]:
    """Returns the fields with a value of each body, as read-only arrays, with the tables that they index."""
    table = bodies.table or ShapeTable((), np.full(len(bodies), -1), np.zeros(len(bodies), dtype=np.bool_))
    arrays = {name: getattr(bodies, name) for name in BODY_COLUMNS}
    arrays |= {"shape": table.index, "acceleration": pulls}
    for array in (*arrays.values(), rules.kind):
        array.flags.writeable = False
    return arrays | {
        "shapes": table.shapes,
        "kind": tuple(rules.kinds[each] for each in rules.kind.tolist()),
        "responses": rules.responses,
        "kinds": rules.kinds,
        "kind_numbers": rules.kind,
    }


def _raise(mistakes: Sequence[Mistake], places: FilePlaces) -> None:
    written = map(places.written, mistakes)
    found = [*places.mistakes, *(each for each in written if each.where not in places.faults)]
    if found:
        raise SceneError(abridged(found), places.source)


def _read_settings(given: Given, mistakes: list[Mistake]) -> Settings:
    if given.settings is not None and not isinstance(given.settings, Settings):
        mistakes.append(Mistake("settings", shown(given.settings), "kinetile.Settings(...), or None"))
    if given.origin is not None and not isinstance(given.origin, Mapping):
        text = "a mapping that says where the scene is from"
        mistakes.append(Mistake("origin", shown(given.origin), text))
    return given.settings if isinstance(given.settings, Settings) else Settings()


def _listed_shapes(given: Given) -> tuple[Shape, ...]:
    if isinstance(given.shape, Shape):
        return (given.shape,)
    listed = isinstance(given.shapes, tuple | list) and all(isinstance(each, Shape) for each in given.shapes)
    return tuple(given.shapes) if listed else ()


def _read_bodies(
    given: Given, unread: Mapping[str, Flags], coming: Sequence[Shape], mistakes: list[Mistake]
) -> Bodies:
    """Returns the bodies, and the obstacles after them; appends mistakes of unreadable columns. The table of
    shapes has the shapes of bodies that are still to be inserted as well."""
    listed = _listed_shapes(given)
    radii = given.radius is not None and not are_given(given.shape, ())
    shaped = are_given(given.shape, given.shapes) and not (radii and listed)
    if (given.radius is not None) == shaped:
        both = ("radii beside shapes", "one of the two: a shape has its own radius")
        mistakes.append(Mistake("radius", *(both if shaped else ("nothing", "radii, or shapes"))))
    columns = {name: getattr(given, name) for name in BODY_COLUMNS}
    if shaped or given.radius is None:
        columns["radius"] = 1.0
    bodies = read_arrays(columns, unread, mistakes)
    if shaped:
        table = read_table(given.shape, given.shapes, len(bodies), mistakes, unread.get("shape"))
        unknown = {**bodies.unknown, "radius": table.unknown}
        bodies = replace(bodies, radius=table.radius, unknown=unknown, table=table)
    if given.obstacles:
        bodies = _with_obstacles(bodies, given.obstacles, listed)
    if bodies.table is not None or not all(each.is_disc for each in (*listed, *coming)):
        table = bodies.table or beside(None, bodies.radius, bodies.unknown["radius"], (), listed)
        more = [each for each in dict.fromkeys((*listed, *coming)) if each not in table.shapes]
        bodies = replace(bodies, table=replace(table, shapes=(*table.shapes, *more)))
    return replace(bodies, table=None) if bodies.table is not None and bodies.table.discs else bodies


def _with_obstacles(bodies: Bodies, obstacles: Sequence[Obstacle], listed: Sequence[Shape]) -> Bodies:
    table = beside(bodies.table, bodies.radius, bodies.unknown["radius"], obstacles, listed)
    known = np.zeros(len(obstacles), dtype=np.bool_)
    return Bodies(
        position=np.concatenate([bodies.position, [each.position for each in obstacles]]),
        velocity=np.concatenate([bodies.velocity, [each.velocity for each in obstacles]]),
        radius=np.append(bodies.radius, [each.shape.reach for each in obstacles]),
        mass=np.append(bodies.mass, np.full(len(obstacles), math.inf)),
        unknown={name: np.append(which, known) for name, which in bodies.unknown.items()},
        table=table,
    )


def _listed(
    name: str, given: Any, right: str, places: Iterable[str] | None, mistakes: list[Mistake]
) -> list[tuple[str, Any]]:
    """Returns the values of a sequence, each with its place; for anything else [], and a mistake."""
    try:
        values = list(given)
    except TypeError:
        mistakes.append(Mistake(name, shown(given), right))
        values = []
    return [*zip(places or [f"{name}[{k}]" for k in range(len(values))], values, strict=True)]


def _read_names(given: Given, bodies: int, mistakes: list[Mistake]) -> tuple[str | None, ...]:
    """Returns the name of each body, or () without names; obstacles follow the named bodies."""
    several = isinstance(given.names, Sequence) and not isinstance(given.names, str)
    names = list(given.names) if several else []
    unnamed = given.names is None or (several and not names)
    if not unnamed and len(names) + len(given.obstacles) != bodies:
        mistakes.append(Mistake("names", shown(given.names), f"one for each of the {bodies} bodies, or None"))
        return ()
    some = any(name is not None for name in names)
    return (*names, *[None] * len(given.obstacles)) if some else ()


def _read_rules(
    given: Given, bodies: Bodies, commands: Sequence[tuple[str, Any]], complete: bool, mistakes: list[Mistake]
) -> SceneRules:
    kind, kinds = given.kind, given.kinds
    if given.obstacles:
        own = [each.kind for each in given.obstacles]
        kind = [*kind, *own]
        kinds = [*kinds, *own] if isinstance(kinds, list | tuple) else kinds
    newer = [(where, each) for where, each in commands if isinstance(each, Insert | SetKind)]
    coming = [(f"{where}.kind", each.kind, isinstance(each, Insert)) for where, each in newer]
    insertions = [isinstance(each, Insert) and each.mass == math.inf for _, each in newer]
    fixed = [*np.isinf(bodies.mass).tolist(), *insertions] if bodies.table is not None else ()
    return read_rules(kind, given.responses, len(bodies), coming, mistakes, kinds, complete, fixed)


def _read_gravity(
    given: Given, periodic: str, walls_known: bool, mistakes: list[Mistake]
) -> tuple[float, float]:
    """Returns the acceleration of all bodies of finite mass without one of their own."""
    if given.gravity is None:
        return (0.0, 0.0)
    wrong = VALUES["gravity"].mistakes(given.gravity, "gravity")
    if not wrong and walls_known:
        wrong = check_pull("gravity", given.gravity, periodic)
    mistakes += wrong
    return (0.0, 0.0) if wrong else (float(given.gravity[0]) + 0.0, float(given.gravity[1]) + 0.0)


def pull_of(command: Insert | Accelerate, gravity: tuple[float, float]) -> tuple[float, float]:
    """Returns the acceleration that a command gives to a body."""
    if isinstance(command, Insert) and command.acceleration is None:
        return gravity if command.mass < math.inf else (0.0, 0.0)
    assert command.acceleration is not None
    return float(command.acceleration[0]), float(command.acceleration[1])


def _pulling(commands: Sequence[tuple[str, Any]]) -> list[tuple[str, Any]]:
    """Returns the commands with an acceleration that is right by itself."""
    wrong = VALUES["acceleration"].expected
    said = (pair for pair in commands if isinstance(pair[1], Insert | Accelerate))
    return [pair for pair in said if pair[1].acceleration is not None and not wrong(pair[1].acceleration)]


def _check_pulls(
    bodies: Bodies,
    pulls: Floats,
    commands: Sequence[tuple[str, Any]],
    pulling: Sequence[tuple[str, Any]],
    periodic: str,
) -> list[Mistake]:
    mistakes = []
    for k in np.flatnonzero(pulls.any(axis=1)).tolist()[:1]:
        mistakes = check_pull(f"bodies[{k}].acceleration", pulls[k].tolist(), periodic)
    mass = dict(enumerate(bodies.mass.tolist()))
    inserted = [each for _, each in commands if isinstance(each, Insert) and is_number(each.body)]
    mass |= {each.body: each.mass for each in inserted}
    for where, each in pulling:
        known = mass.get(each.body) if is_number(each.body) else None
        own = each.mass if isinstance(each, Insert) else known
        if any(each.acceleration) and own == math.inf:
            mistakes.append(Mistake(f"{where}.acceleration", shown(list(each.acceleration)), FIXED))
        mistakes += check_pull(f"{where}.acceleration", each.acceleration, periodic)
    return mistakes


def _largest(
    pulls: Floats, pulling: Sequence[tuple[str, Any]], gravity: tuple[float, float]
) -> tuple[float, float]:
    """Returns the largest accelerations, along x and y, of gravity and of any body (rule 3a)."""
    coming = [pull_of(each, gravity) for _, each in pulling]  # others have gravity, or no acceleration
    x, y = np.abs(np.concatenate([pulls, [gravity, *coming]])).max(axis=0).tolist()
    return x, y


def _is_uniform(pulls: Floats, commands: Sequence[Command], gravity: tuple[float, float]) -> bool:
    coming = [pull_of(each, gravity) for each in commands if isinstance(each, Insert)]
    each = np.concatenate([pulls, np.reshape(coming, (-1, 2))])
    keep = not any(isinstance(each, Accelerate) for each in commands)
    return keep and bool((each == each[:1]).all())


def _check_chords(
    bodies: Bodies, commands: Sequence[tuple[str, Any]], pull: tuple[float, float], unit: float
) -> list[Mistake]:
    radii = [each.radius for _, each in commands if isinstance(each, Insert)]
    margin = min([*bodies.radius.tolist(), *radii], default=1.0) * SHARE
    if shortest(pull, margin, unit) >= LEAST_SPAN:
        return []
    found = f"{shown(list(pull))}, by which a body falls far in a tick of the clock"
    return [Mistake("acceleration", found, f"less, or a unit below {unit:.3g}")]


def unit_of(
    bodies: Bodies, sides: tuple[float, float] | None, commands: Sequence[Command], pull: tuple[float, float]
) -> float:
    """Returns the default unit of a scene's clock, a power of two, at most 1."""
    if len(bodies) == 0 and sides is None:
        return 1.0
    squares = [float((bodies.velocity**2).sum(axis=1).max())] if len(bodies) else []
    fastest = max([*squares, *speeds(commands)], default=0.0)
    if sides is None:
        sides = (float(np.abs(bodies.position).max() + bodies.radius.max()),) * 2
    drop = pull[0] * sides[0] + pull[1] * sides[1]
    return time_unit(max(sides), math.sqrt(fastest + 2.0 * drop))


def _order(commands: Sequence[Command], clock: Clock) -> list[int]:
    def when(k: int) -> Any:
        time, at = commands[k].time, commands[k].at
        return (clock.tick_of(time, at), at[2] if at else 0) if exact else time

    exact = any(command.at is not None for command in commands)
    return sorted(range(len(commands)), key=when)
