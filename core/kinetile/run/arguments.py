"""Arguments of a simulation's methods, checked before any action: each reader returns a value of the right
type, or raises an error that names the value found and the allowed ones. Limits are a scene's."""

import logging
import math
import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Array, Floats, Rows
from kinetile.errors import Mistake, constructed
from kinetile.kernel.compiled import python_of
from kinetile.kernel.log import ACCELERATED, INSERTED, MOVED, OF_KIND, TURNED, WALLS
from kinetile.kernel.loop.bookkeeping import ANY_BEGIN, ENDS, SOME, flag_of
from kinetile.kernel.tables import NOBODY
from kinetile.run.advance import End
from kinetile.run.engine.bounds import MOST_FLOWN, unfit_pull
from kinetile.run.engine.by_hand import command_rows
from kinetile.run.engine.commands import COMMAND_ROWS, row_of
from kinetile.run.engine.engine import UNLIMITED, Engine, WatchedContacts
from kinetile.run.prepared import widened
from kinetile.run.questions.places import MOST_PERIODS, Box, Point
from kinetile.scene import Insert, Scene
from kinetile.scene.checks import ANY_KIND as EVERY
from kinetile.scene.checks import (
    FARTHEST,
    LARGEST,
    SMALLEST,
    WALL_KIND,
    Extent,
    is_finite,
    is_number,
    read_count,
    shown,
)
from kinetile.scene.commands import check_command, check_move, numbered, shape_of, with_shape
from kinetile.scene.frame import check_pull
from kinetile.scene.reader import pull_of
from kinetile.scene.responses import Kind, find_kind
from kinetile.scene.shapes import Shape
from kinetile.scene.values import VALUES
from kinetile.toolbox.differences import DISC, Outline, circle_around

_NO_NUMBERS = bool, np.bool_, float, np.floating
"""Types that are refused as numbers of bodies, as NumPy refuses them as an index."""

_FLOATS = {float, np.float64}

_SIZE = "at most 2**200 in size"


def read_point(value: object, name: str) -> Point:
    """Returns a point, or a velocity; ValueError for anything else."""
    x, y = _read_numbers(value, 2, f"{name} is two finite numbers, {_SIZE}")
    return x, y


def read_direction(value: object) -> Point:
    """Returns a direction; ValueError for anything else, or for a zero vector."""
    x, y = read_point(value, "a direction")
    if x == 0.0 and y == 0.0:
        raise ValueError("a direction is two finite numbers that are not both 0; found (0.0, 0.0)")
    return x, y


def read_area(value: Any) -> tuple[Box, Outline | None]:
    """Returns a box, or a placed outline and the box around it; ValueError for anything else."""
    value = (0.0, 0.0, value) if isinstance(value, Shape) else value
    if isinstance(value, tuple | list) and len(value) == 3:
        (x, y), (core, r) = read_outline(value, "an area")
        corners = tuple((x + right, y + up) for right, up in core)
        across, along = zip(*corners, strict=True)
        return (min(across) - r, min(along) - r, max(across) + r, max(along) + r), (corners, r)
    what = "a box is (left, bottom, right, top), four finite numbers"
    left, bottom, right, top = _read_numbers(value, 4, f"{what}, {_SIZE}")
    if left > right or bottom > top:
        raise ValueError(f"{what}, left <= right and bottom <= top; found {shown(value)}")
    return (left, bottom, right, top), None


def read_outline(value: Any, what: str) -> tuple[Point, Outline]:
    """Returns the position, and core and radius, of a disc or a shape; ValueError for anything else."""
    what = f"{what} is (x, y, radius), three finite numbers, {_SIZE}, or (x, y, shape)"
    shaped = isinstance(value, tuple | list) and len(value) == 3 and isinstance(value[2], Shape)
    x, y, *size = _read_numbers(value[:2] if shaped else value, 2 if shaped else 3, what)
    if size and size[0] < 0.0:
        raise ValueError(f"{what}, with a radius of at least 0; found {shown(value)}")
    return (x, y), (value[2].core, value[2].radius) if shaped else (DISC, size[0])


def read_length(value: Any, name: str) -> float:
    """Returns a length; ValueError for anything else."""
    if not is_finite(value) or not 0.0 <= value <= LARGEST:
        raise ValueError(f"{name} is a finite number, from 0 to 2**200; found {shown(value)}")
    return float(value)


def read_within(value: Any, scene: Scene, direction: Point) -> float | None:
    """Returns the length of a ray; ValueError for anything else, or without one if the ray had no end."""
    if value is None:
        if not scene.periodic:
            return None
        raise ValueError(
            f"a ray goes round for ever in a scene that is periodic along {scene.periodic}: say how far it "
            "is to go, within="
        )
    length = read_length(value, "within")
    if not length:
        raise ValueError("within is a length above 0; found 0.0")
    full = math.hypot(*direction)
    flight = length * (direction[0] / full), length * (direction[1] / full)
    _demand_few_periods(flight, scene, "a ray", "a smaller within")
    return length


def read_cast(
    body: Any, velocity: object, acceleration: object, scene: Scene, horizon: float
) -> tuple[Point, Outline, Point, Point]:
    """Returns place, core and radius, velocity, and acceleration of a cast body, for ``horizon`` of the
    scene's time if axes are periodic; ValueError for anything else."""
    place, outline = read_outline(body, "a cast body")
    vx, vy = read_point(velocity, "a velocity")
    if any(period and 2.0 * circle_around(outline) >= period for period in scene.periods):
        raise ValueError(f"a body is narrower than the period, {scene.periods}; found {shown(body)}")
    _demand_few_periods((horizon * vx, horizon * vy), scene, "this body", "a lower velocity")
    pull = scene.gravity if acceleration is None else read_point(acceleration, "an acceleration")
    for mistake in check_pull("", pull, scene.periodic):
        raise ValueError(f"the acceleration of a cast body is {mistake.found}; expected {mistake.expected}")
    return place, outline, (vx, vy), pull


def _demand_few_periods(flight: Point, scene: Scene, what: str, right: str) -> None:
    for axis, way, period in zip("xy", flight, scene.periods, strict=True):
        if period and abs(way) > MOST_PERIODS * period:
            raise ValueError(
                f"{what} would cross {abs(way) / period:.6g} periods along {axis}, and may cross "
                f"{MOST_PERIODS}: choose {right}"
            )


def read_kinds(value: Kind | Iterable[Kind], known: Sequence[Kind], where: str) -> list[Kind]:
    """Returns one kind or several as a list; ValueError for an unknown one."""
    try:
        several: list[Any] = [value] if isinstance(value, str | bytes) else [*value]  # type: ignore[misc]
    except TypeError:
        several = [value]
    return [find_kind(kind, known, where) for kind in several]


def _read_numbers(value: Any, count: int, what: str) -> list[float]:
    parts = value.tolist() if isinstance(value, np.ndarray) else value
    fit = isinstance(parts, Sequence) and not isinstance(parts, str) and len(parts) == count
    if not fit or not all(is_finite(part) and abs(part) <= LARGEST for part in parts):
        raise ValueError(f"{what}; found {shown(value)}")
    return [float(part) for part in parts]


def read_until(engine: Engine, until: float | None, duration: float | None) -> float | None:
    """Returns ``until``, or the time after a duration; ValueError for both, or for an invalid duration."""
    if duration is None:
        return until
    if until is None and is_finite(duration) and duration >= 0.0:
        return engine.time + float(duration)
    found = shown(duration) if until is None else f"{shown(duration)} and until={shown(until)}"
    raise ValueError(f"duration must be a finite time of at least 0, without until; found {found}")


def read_end(
    engine: Engine, until: float | None, max_contacts: int | None = None, max_events: int | None = None
) -> End:
    """Returns the requested end, exact if it is the scene's own; ValueError for an invalid or past one."""
    scene, settings, given = engine.scene, engine.scene.settings, until
    until = settings.until if given is None else given
    if until is None and max_contacts is None and max_events is None:
        raise ValueError("run needs an end: until=, max_contacts=, max_events= or an until in the scene")
    contacts = UNLIMITED if max_contacts is None else _last(engine.contacts, max_contacts, "max_contacts")
    events = UNLIMITED if max_events is None else _last(engine.events, max_events, "max_events")
    if until is None:
        return End(contacts=contacts, events=events)
    if not is_finite(until):
        raise ValueError(f"until must be a finite time; found {shown(until)}")
    until = float(until)
    last = settings.until if scene.arena is None and scene.accelerated else None
    if last is not None and until > math.nextafter(last, math.inf):  # the exact end may be a rounding later
        raise ValueError(
            f"until={until} is after the scene's end, {last}: expected at most that, since without walls "
            "accelerated bodies become ever faster; or give the scene a later one"
        )
    clock, now = engine.clock, engine.now
    exact, quota = settings.end if until == settings.until else None, UNLIMITED
    if exact is not None:
        quota, ticks = exact[2], clock.tick_of(until, exact)
    else:
        ticks = clock.total(now) if until == engine.time else clock.ticks(until)
    if clock.relative(ticks) < now:
        own = "" if given is not None else ", and is the scene's own end: give another by until="
        raise ValueError(f"until={until} lies in the past{own}; the time is {engine.time}")
    return End(until, ticks, quota, contacts, events)


def tell_of_late_commands(engine: Engine, end: End) -> None:
    """Logs that a run ends with its scene, before a planned command; a recording may end there."""
    scene, until = engine.scene, end.until
    of_scene = until is not None and until == scene.settings.until and scene.settings.end is None
    if of_scene and scene.commands and end.contacts == end.events == UNLIMITED:
        planned = scene.commands[-1].time
        if engine.time < cast("float", until) < planned:
            what = "kinetile: this run goes to %r, the scene's end, and its command at %r is later"
            logging.getLogger("kinetile").warning(what + ". Expected a later until", until, planned)


def read_body(engine: Engine, body: object, or_coming: bool = False) -> int:
    """Returns the number of a present body, or of one that the scene will insert. IndexError, with the known
    facts, for any other number, TypeError for a value that is no number."""
    if isinstance(body, _NO_NUMBERS):
        raise IndexError(f"a body goes by its number, a whole one; found {shown(body)}")
    try:
        number = operator.index(body)  # type: ignore[arg-type]  # anything may be given
    except TypeError:
        named = f": sim.number({shown(body)}) is the number of a name" if isinstance(body, str) else ""
        raise TypeError(f"a body goes by its number; found {shown(body)}{named}") from None
    # The table of slots also has room for numbers that are not in use yet: they are ignored.
    is_there = 0 <= number < engine.numbers and engine.k.slots[number] >= 0
    if is_there or (or_coming and engine.agenda.brings(engine.k, engine.clock, number)):
        return number
    there = len(engine.taken)
    if not 0 <= number < engine.numbers:
        given = f"numbers up to {engine.numbers - 1}" if engine.numbers else "no numbers"
        why = f"that is the {WALLS[number]} wall" if number in WALLS else f"{given} have been given"
        raise IndexError(f"there is no body {shown(number)}: {why}")
    raise IndexError(f"there is no body {number} now: it has gone, or is still to come; {there} are there")


def read_turns(engine: Engine, bodies: object, velocities: object) -> Rows:
    """Returns turns of bodies, (n, 2) velocities or one for all; IndexError and ValueError for wrong ones."""
    rows, pairs, no_faster = _rows_and_pairs(engine, TURNED, bodies, velocities, "velocity")
    smallest = engine.bounds.smallest
    rows["vx"], rows["vy"] = pairs[:, 0], pairs[:, 1]
    if _is_too_fast(engine, no_faster, smallest):
        _check_speed(engine, float(np.hypot(*pairs.T).max(initial=0.0)), smallest)
    return rows


def read_accelerations(
    engine: Engine, bodies: object, accelerations: object, until: float
) -> tuple[Rows, Scene]:
    """Returns the commands for (n, 2) accelerations of bodies, or one for all, in a run to a time; and the
    scene, or a wider one, that allows them. IndexError and ValueError for wrong ones."""
    rows, pairs, _ = _rows_and_pairs(engine, ACCELERATED, bodies, accelerations, "acceleration")
    rows["ax"], rows["ay"] = (pairs + 0.0).T
    prepared = engine.composition.prepared
    columns = (rows["body"], rows["mass"], pairs)
    for body, mass, pull in zip(*(each.tolist() for each in columns), strict=True):
        wrong = VALUES["acceleration"].expected(pull) or unfit_pull(prepared, (pull[0], pull[1]), until)
        if wrong or (mass == math.inf and any(pull)):
            wrong = wrong or "none: nothing moves a body of infinite mass"
            raise ValueError(f"the acceleration of body {body} is {shown(pull)}; expected {wrong}")
    return rows, _with_pull(engine.scene, np.abs(pairs).max(axis=0, initial=0.0).tolist())


def _pairs(given: object, count: int) -> Floats:
    """Returns (count, 2) numbers, given as such or as one pair; TypeError or ValueError for anything else."""
    pairs = np.asarray(given)
    if pairs.shape[-1:] != (2,) or pairs.dtype.kind == "c":
        raise ValueError("neither pairs nor one of real numbers")
    if pairs.dtype != np.float64:
        with np.errstate(over="ignore"):  # wider floats become infinite
            pairs = pairs.astype(np.float64)
    return pairs if pairs.shape == (count, 2) else np.broadcast_to(pairs, (count, 2))


def _rows_and_pairs(
    engine: Engine, code: int, bodies: object, given: object, what: str
) -> tuple[Rows, Floats, float]:
    """Returns commands of a code for n bodies; (n, 2) finite numbers, given as such or as one pair for all;
    and a length that no pair exceeds."""
    try:
        numbers = np.array(bodies, ndmin=1)
    except ValueError:  # rows of different lengths
        numbers = np.zeros((0, 0))
    if numbers.ndim != 1:
        raise ValueError(f"bodies are given by a list of their numbers; found {shown(bodies)}")
    if isinstance(bodies, Sequence) and not {bool, np.bool_}.isdisjoint(map(type, bodies)):
        numbers = np.array(bodies, dtype=object)  # among numbers, NumPy converts True to 1
    if len(numbers) and numbers.dtype.kind not in "iu":
        for body in numbers.tolist():
            read_body(engine, body)
    try:
        pairs = _pairs(given, len(numbers))
    except (TypeError, ValueError, OverflowError):
        pairs = np.full((len(numbers), 2), np.nan)
    squares = float(np.vdot(pairs, pairs))  # a quarter of the time of isfinite, and also a bound
    if not math.isfinite(squares) and not np.isfinite(pairs).all():
        article = "an" if what == "acceleration" else "a"
        if isinstance(given, Sequence) and len(given) == 1 == len(numbers):
            raise ValueError(f"{article} {what} is two finite numbers; found {shown(given[0])}")
        expected = f"expected one, or one for each of the {len(numbers)} bodies, (n, 2)"
        raise ValueError(f"{article} {what} is two finite numbers; {expected}; found {shown(given)}")
    rows = command_rows(engine, code, len(numbers))
    rows["mass"], rows["body"] = engine.k.mass.take(_slots_of(engine, numbers)), numbers
    return rows, pairs, 2.0 * math.sqrt(squares)


def _slots_of(engine: Engine, numbers: Array) -> npt.NDArray[np.int32]:
    """Returns the slots of bodies; IndexError for a body that is not present."""
    whole: Array = numbers if numbers.dtype.kind == "i" else numbers.astype(np.int64)
    try:
        found: npt.NDArray[np.int32] = engine.k.slots.take(whole)
    except IndexError:  # beyond the table
        found = whole = np.array([NOBODY], dtype=np.int32)
    if np.bitwise_or.reduce(found | whole) < 0:
        for number in numbers.tolist():
            read_body(engine, number)
    return found


def read_insertion(engine: Engine, insertion: Insert, until: float = -math.inf) -> tuple[Rows, Scene]:
    """Returns the command that inserts a body now, in a run to a time; and the scene, or one that is widened
    for its shape and acceleration. ValueError for values that a scene would refuse. It does not check that
    the body is inside the walls."""
    rows = _plain_insertion(engine, insertion)
    if rows is not None:
        return rows, engine.scene
    kind, mass, shape = insertion.kind, insertion.mass, insertion.shape
    scene, composition, mistakes = engine.scene, engine.composition, list[Mistake]()
    kind = scene.kinds[0] if kind is None else find_kind(kind, scene.kinds, "this body cannot come")
    immovable = is_number(mass) and mass == math.inf
    if scene.shapes and composition.gapless:
        raise _cannot_come(composition.gapless)
    if immovable and composition.rules is None:
        raise _cannot_come(
            "its mass is infinite, and this run is not made for bodies that nothing can move; give the scene "
            "responses='elastic', and it is"
        )
    if immovable and scene.shapes and composition.broad.solid:
        why = f"it may overlap another, and {composition.broad_phase} is right only while bodies cannot"
        raise _cannot_come(f"it is immovable, so {why}")
    size: float | None = insertion.radius  # in ``insert_many`` some have a shape instead
    insertion = insertion._replace(radius=0.0 if size is None else size, kind=kind, body=engine.numbers)
    extent = None if scene.arena is None else Extent(scene.arena, scene.periodic, False)
    has = shape_of(insertion, "", scene.shapes, mistakes) if scene.shapes or shape is not None else None
    if has is not None and not scene.shapes and not has.is_disc:
        raise _cannot_come(
            f"it is a {has.kind}, and this run is made for discs alone; list the shape in the scene, "
            "shapes=[...], and it is made for such bodies as well"
        )
    insertion = with_shape(insertion, has, bool(scene.shapes))
    mistakes += check_command(insertion, "", None, extent)
    if mistakes:
        found = (f"{where.removeprefix('.')} is {what}, expected {right}" for where, what, right in mistakes)
        raise _cannot_come("; ".join(found))
    (insertion,) = cast("list[Insert]", numbered([insertion]))
    wider = _scene_of(engine, insertion, until)
    _check_speed(engine, math.hypot(*insertion.velocity), min(engine.bounds.smallest, insertion.radius))
    rows = np.array([row_of(insertion, scene, tick=engine.now, after=engine.met_now)], COMMAND_ROWS)
    own = insertion.shape
    new = isinstance(own, Shape) and rows["form"][0] == len(scene.shapes)
    return rows, widened(wider, (cast("Shape", own),)) if new else wider


def _plain_insertion(engine: Engine, new: Insert) -> Rows | None:
    """Returns the command for a disc of the usual values, of the first kind, in a scene of discs that fly
    straight and without periodic axes; None for others, which may be valid as well: reading them value by
    value takes eight times as long."""
    scene, apart = engine.scene, (new.kind, new.shape, new.acceleration)
    if scene.shapes or scene.periodic or scene.accelerated or not all(each is None for each in apart):
        return None
    both = new.position, new.velocity
    position, velocity = (two.tolist() if isinstance(two, np.ndarray) else two for two in both)
    if not (isinstance(position, tuple | list) and isinstance(velocity, tuple | list)):
        return None
    lasts = 1.0 if new.lifetime is None else new.lifetime
    numbers = [*position, *velocity, new.radius, new.mass, lasts]
    if len(position) != 2 or len(numbers) != 7 or not _FLOATS.issuperset(map(type, numbers)):
        return None
    far, speed = math.hypot(*position), math.hypot(*velocity)
    if not (far <= LARGEST and speed <= LARGEST and all(SMALLEST <= each <= LARGEST for each in numbers[4:])):
        return None
    _check_speed(engine, speed, min(engine.bounds.smallest, new.radius))
    rows = command_rows(engine, INSERTED, body=engine.numbers, disc=numbers[:6])
    rows["lifetime"] = new.lifetime or 0.0
    return rows


def check_name(name: str, known: Mapping[str, int]) -> None:
    """Raises ValueError for an invalid name, or another body's name."""
    if wrong := VALUES["name"].expected(name):
        raise _cannot_come(f"its name is {shown(name)}, expected {wrong}")
    if name in known:
        raise _cannot_come(f"its name is {name!r}, the name of body {known[name]}; expected another name")


def _cannot_come(why: str) -> ValueError:
    return ValueError(f"this body cannot come: {why}")


def _with_pull(scene: Scene, largest: Sequence[float]) -> Scene:
    """Returns a scene whose accelerations differ and may be as large as this along x and y."""
    ax, ay = map(abs, largest)
    same = ax <= scene.pull[0] and ay <= scene.pull[1] and not (scene.accelerated and scene.uniform)
    return scene if same else widened(scene, pull=(ax, ay))


def _scene_of(engine: Engine, new: Insert, until: float) -> Scene:
    """Returns the scene, or a wider one, that allows an inserted body's acceleration; ValueError for an
    impossible one."""
    scene, pull = engine.scene, pull_of(new, engine.scene.gravity)
    if wrong := unfit_pull(engine.composition.prepared, pull, until):
        raise _cannot_come(f"its acceleration is {shown(list(pull))}, expected {wrong}")
    usual = tuple(scene.acceleration[0].tolist()) if len(scene) else scene.gravity
    return scene if pull == usual and scene.uniform else _with_pull(scene, pull)


def read_insertions(
    engine: Engine, positions: object, velocities: object, each: Mapping[str, Any], until: float
) -> tuple[Rows, bool]:
    """Returns the commands that insert bodies now, in a run to a time, and True if they need a wider scene.
    ``each`` has the other fields of an insertion: one for all, or a sequence of one for each. ValueError,
    with the body, for values that a scene would refuse. It does not check that walls contain bodies."""
    try:
        given = np.asarray(positions)
        if given.dtype.kind not in "iufO":  # NumPy converts text and complex numbers
            raise TypeError
        places = given.astype(np.float64).reshape(-1, 2)
        flies = _pairs(velocities, len(places))
    except (TypeError, ValueError, OverflowError):
        raise ValueError(
            "insert_many takes positions, (n, 2), and velocities, (n, 2) or one for all; found "
            f"{shown(positions)} and {shown(velocities)}"
        ) from None
    many = len(places)
    columns = {name: column(name, given, many) for name, given in each.items()}
    rows, scenes = command_rows(engine, INSERTED, many), [engine.scene]
    if not many:
        return rows, False
    alike = [*zip(*columns.values(), strict=True)]
    alike_at = dict[tuple[Any, ...], list[int]]()

    def read(at: int) -> Rows:
        """Returns the row of one body; the error names it."""
        insertion = Insert(0.0, places[at], flies[at], **dict(zip(columns, alike[at], strict=True)))
        try:
            row, scene = read_insertion(engine, insertion, until)
        except ValueError as error:
            raise ValueError(f"body {at} of {many}: {error}") from None
        scenes.append(scene)
        return row

    for at, values in enumerate(alike):
        alike_at.setdefault(values, []).append(at)
    for those in alike_at.values():  # equal values are read once; then numbers are checked
        rows[those] = read(those[0])
    rows["x"], rows["y"] = places.T
    rows["vx"], rows["vy"] = flies.T
    for at in _odd(engine.scene, places, flies, any(scene.accelerated for scene in scenes)):
        read(at)
    fastest = int(np.hypot(rows["vx"], rows["vy"]).argmax())
    smallest = min(engine.bounds.smallest, float(rows["radius"].min()))
    _check_speed(engine, math.hypot(*flies[fastest].tolist()), smallest)
    return rows, any(scene is not engine.scene for scene in scenes)


def _odd(scene: Scene, places: Floats, flies: Floats, accelerated: bool) -> list[int]:
    """Returns the bodies to read one by one: their numbers may be wrong, or need a wider scene."""
    periods = np.array(scene.periods)
    size = np.where(periods > 0.0, FARTHEST * periods, LARGEST)
    odd = ~((np.abs(places) <= size).all(axis=1) & (np.abs(flies) <= LARGEST).all(axis=1))
    if accelerated:
        odd |= (flies == 0.0).any(axis=1)
    return np.flatnonzero(odd).tolist()


def column(name: str, given: Any, many: int) -> list[Any]:
    """Returns one value for each of ``many`` bodies; ValueError for another number of them."""
    given = given.tolist() if isinstance(given, np.ndarray) else given
    if name == "acceleration" or not isinstance(given, list | tuple):
        values = [tuple(given) if isinstance(given, list) else given] * many
    else:
        values = list(given)
    if len(values) != many:
        raise ValueError(f"{name} has {len(values)} values; expected one, or one for each of {many} bodies")
    try:
        set(values)
    except TypeError:
        raise ValueError(f"{name} is {shown(given)}; expected one value, or one for each body") from None
    return values


def read_kind(engine: Engine, body: object, kind: object) -> Rows:
    """Returns the command that gives a body another kind now; IndexError for a body that is not present, and
    ValueError for a kind that the scene does not have."""
    rows, kinds = command_rows(engine, OF_KIND, body=read_body(engine, body)), engine.scene.kinds
    rows["kind"] = kinds.index(find_kind(kind, kinds, "set_kind"))
    return rows


def read_move(engine: Engine, body: object, position: object) -> Rows:
    """Returns the command that moves a body now; IndexError for a body that is not present, ValueError for an
    invalid place. It does not check that the body is inside the walls."""
    number, field = read_body(engine, body), VALUES["position"]
    rows = command_rows(engine, MOVED, body=number)
    rows["mass"] = engine.k.mass[engine.k.slots[number]]
    if wrong := field.expected(position):
        raise ValueError(f"the position of body {number} is {shown(position)}; expected {wrong}")
    rows["x"], rows["y"] = place = field.plain(position)
    scene = engine.scene
    extent = None if scene.arena is None else Extent(scene.arena, scene.periodic, False)
    for mistake in check_move(place, "", extent) if extent is not None else ():
        raise ValueError(f"the position of body {number} is {mistake.found}; expected {mistake.expected}")
    return rows


def _is_too_fast(engine: Engine, speed: float, smallest: float) -> bool:
    return bool(speed * engine.fields.per_tick[0] > MOST_FLOWN * smallest)


def _check_speed(engine: Engine, speed: float, smallest: float) -> None:
    if _is_too_fast(engine, speed, smallest):
        raise ValueError(
            f"at the speed {speed:.3g} a body would fly too far in one tick of this scene's clock: schedule "
            "the command in the scene, which chooses its clock by its speeds, or give the scene a unit"
        )


def _last(so_far: int, more: Any, name: str) -> int:
    """Returns the total number of contacts or events after which to stop."""
    return min(so_far + read_count(more, name, name.removeprefix("max_")), UNLIMITED)


@constructed
@dataclass(frozen=True)
class StopAt:
    """Contacts that stop a run at their exact time; by default every contact. For two bodies that pass
    through each other, the contact is the begin of the passing.

    Attributes:
        bodies: numbers of bodies: all of their contacts, with others or walls.
        pairs: two numbers each, or a number and "wall"; or two kinds as for ``on_contact``, with at least one
            name.
        kinds: one kind of bodies or several, by the kinds that bodies have at the contact.
        parts: stop at ends of passings, too.
        before: stop before the contact, which then comes next unless a command changes that. No run stops
            before a passing that begins at the start, or begins or ends together with a command.
    """

    bodies: Iterable[int] = ()
    pairs: Iterable[tuple[int | str, int | str]] = ()
    kinds: Kind | Iterable[Kind] = ()
    parts: bool = False
    before: bool = False


FLAG_OF_SIDE = {side: int(python_of(flag_of)(0, wall)) for wall, side in WALLS.items()}
EVERY_SIDE = sum(FLAG_OF_SIDE.values())


def kinds_between(key: Any, known: tuple[Kind, ...], where: str) -> tuple[Kind, ...]:
    """Returns the kinds of a key for contacts: one of a scene's, or two; one of the two may be "wall" or a
    side of the arena; "*" is every kind. ValueError for another key, or an unknown kind."""
    two = key if isinstance(key, tuple) else (key,)
    named = tuple([find_kind(each, _names(known), where, known) for each in two])
    if not 0 < len(named) <= 2 or all(is_wall(each, known) for each in named):
        expected = f"a kind, two, or a kind and {WALL_KIND!r} or a side of the arena"
        raise ValueError(f"{where}: expected {expected}; found {shown(key)}")
    return named


@lru_cache(256)
def _names(known: tuple[Kind, ...]) -> tuple[Kind, ...]:
    return *known, *(each for each in (EVERY, WALL_KIND, *FLAG_OF_SIDE) if each not in known)


def is_wall(kind: Kind, known: tuple[Kind, ...]) -> bool:
    """Returns True if a kind of a key is "wall" or a side of the arena."""
    return kind not in known and kind != EVERY


@lru_cache(256)
def flags_between(named: tuple[Kind, ...], known: tuple[Kind, ...]) -> npt.NDArray[np.uint8]:
    """Returns the flags (kinds, kinds + 1) of contacts of the kinds of ``kinds_between``, read-only."""
    flags, many = np.zeros((len(known), len(known) + 1), np.uint8), len(known)
    walls = [each for each in named if is_wall(each, known)]
    bodies = [slice(many) if each == EVERY else known.index(each) for each in named if each not in walls]
    if walls or len(named) == 1:
        flags[bodies[0], many] = FLAG_OF_SIDE.get(str(walls[0]), EVERY_SIDE) if walls else EVERY_SIDE
    if not walls:
        one, other = bodies[0], bodies[1] if len(bodies) == 2 else slice(many)
        flags[one, other] = ANY_BEGIN
        flags[other, one] = ANY_BEGIN
    flags.flags.writeable = False
    return flags


def read_stop(engine: Engine, scene: Scene, stop: StopAt | None) -> WatchedContacts | None:
    """Returns the contacts to stop at, in the loop's form, if any. TypeError for a wrong type, IndexError for
    bodies neither present nor to be inserted, ValueError for unknown kinds."""
    if stop is None:
        return None
    for name in ("parts", "before"):
        if not isinstance(given := getattr(stop, name), bool | np.bool_):
            raise TypeError(f"stop_at: {name} is True or False; found {shown(given)}")
    known, where, ends = scene.kinds, "stop_at", ENDS if stop.parts else 0
    between: list[tuple[Kind, ...]] = [(kind,) for kind in read_kinds(stop.kinds, known, where)]
    bodies = _several(stop.bodies, where, "bodies", "their numbers")
    flags, pairs = {read_body(engine, body, or_coming=True): ANY_BEGIN | ends for body in bodies}, []
    for pair in _several(stop.pairs, where, "pairs", "two numbers each, or two kinds"):
        two = isinstance(pair, tuple | list) and len(pair) == 2
        if two and any(isinstance(each, str) and each != WALL_KIND for each in pair):
            between.append(kinds_between(tuple(pair), known, where))
        else:
            a, b = _pair(engine, pair)
            pairs.append((a, b))
            for each in {a, b} - {NOBODY}:
                flags[each] = flags.get(each, 0) | SOME | ends
    if not (between or flags):
        between = [(EVERY,)]
    kinds = np.zeros((len(known), len(known) + 1), np.uint8)
    for named in between:
        kinds |= flags_between(named, known)
    if ends:
        kinds[:, :-1] *= ANY_BEGIN | ENDS
    return WatchedContacts(kinds, flags, pairs, bool(stop.before))


def _several(given: Any, where: str, name: str, of: str) -> list[Any]:
    try:
        return list(given)
    except TypeError:
        raise TypeError(f"{where}: {name} are given by a list of {of}; found {shown(given)}") from None


def _pair(engine: Engine, pair: Any) -> tuple[int, int]:
    two = tuple(pair) if isinstance(pair, tuple | list) else ()
    two = two[::-1] if two[:1] == (WALL_KIND,) else two
    if len(two) != 2:
        raise ValueError(
            f"stop_at: a pair is two numbers of bodies, one and {WALL_KIND!r}, or two kinds; "
            f"found {shown(pair)}"
        )
    one = read_body(engine, two[0], or_coming=True)
    return one, NOBODY if two[1] == WALL_KIND else read_body(engine, two[1], or_coming=True)
