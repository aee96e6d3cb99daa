"""Scene: bodies with positions and velocities, the arena around them, and the commands of the run.

A scene is a value. Its arrays are its own read-only copies, it is checked in full when it is made (all
mistakes are reported at once), and two scenes are equal when they hold the same bits. Scenes come from arrays
(here), from a recipe by name (``make_scene``) or from a file (``load_scene``).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.errors import Mistake, SceneError, one_of
from kinetile.kernel.clock import Clock, time_unit
from kinetile.kernel.log import ANSWER
from kinetile.scene.bodies import Numbers, check_bodies, read_arrays
from kinetile.scene.checks import (
    Extent,
    abridged,
    check_frame,
    check_pace,
    check_periodic,
    check_turn,
    check_unit,
    is_number,
    plain,
    shown,
)
from kinetile.scene.commands import (
    EXACT,
    Command,
    Insert,
    Turn,
    check_commands,
    check_presence,
    check_shaped,
    is_exact,
    kinds_of_inserted,
    numbered,
    speeds,
)
from kinetile.scene.responses import (
    Kind,
    Kinds,
    Pair,
    Response,
    Responses,
    kinds_that_follow,
    read_rules,
    table,
    unregistered,
)
from kinetile.scene.shape_table import are_given, read_table
from kinetile.scene.shapes import Shape

Floats = npt.NDArray[np.float64]
Radii: TypeAlias = "npt.ArrayLike | None"
ShapeOfEach: TypeAlias = "npt.ArrayLike | Shape | None"


@dataclass(frozen=True)
class Settings:
    """Settings of a run in a scene: its phases by name, their options, and its end.

    ``broad_phase`` and ``narrow_phases`` are None where the scene leaves the choice open; ``options`` maps a
    phase's name to its options; ``until`` is a time, not a length of time. ``end`` is the same exactly, as
    (epoch, tick, contacts): the run ends after this number of contacts of that tick, as recordings do, and
    ``until`` is that time rounded. None: after all events up to and at ``until``.
    """

    broad_phase: str | None = None
    narrow_phases: tuple[str, ...] | None = None
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    until: float | None = None
    end: tuple[int, int, int] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.end, list):
            object.__setattr__(self, "end", tuple(self.end))
        if isinstance(self.narrow_phases, list):
            object.__setattr__(self, "narrow_phases", tuple(self.narrow_phases))
        if self.until is not None and is_number(self.until):
            object.__setattr__(self, "until", float(self.until))
        object.__setattr__(self, "options", plain(self.options))

    def __hash__(self) -> int:
        return hash((self.broad_phase, self.narrow_phases, self.until, self.end))


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Scene:
    """Discs, or bodies of other convex shapes, in the plane, with or without walls around them.

    ``position`` and ``velocity`` are (n, 2); ``radius`` and ``mass`` are (n,), or one number for all; all are
    kept as read-only arrays of float64. Bodies of other shapes, which do not rotate, have ``shapes``, a list,
    and ``shape`` in the place of ``radius``: (n,) the index of each body's shape, or one for all, or one
    ``Shape`` for all. Then ``radius`` is the circle around a body's position that holds it. If all are
    discs, the scene is the one that ``radius`` makes: ``shapes`` is empty, and ``shape`` is -1.

    ``arena`` is (width, height), for walls around [0, width] x [0, height], or None for no walls.
    ``periodic`` names the axes, "x", "y" or "xy", along which the arena has no walls but repeats itself: the
    width or the height is a period, wider than each disc, and places may be anywhere. ``commands`` (``Turn``,
    ``Insert``, ``Remove``) hold absolute times, and are kept sorted by time, those of one tick as they are
    given; ``turns`` may be given apart, then those of one time are sorted by body and come before other
    commands. ``unit`` is the power of two in which the clock counts; None: it follows from the speeds.
    ``start`` is the time of the given positions. ``kind`` is the kind of each body, or one for all, and
    ``responses`` are the responses of pairs of kinds (``kinetile.scene.responses``). ``kinds`` are all kinds
    of bodies, present or inserted later; by default they follow from the bodies and from the insertions.
    ``kind_numbers`` is (n,) the place of each body's kind in ``kinds``. ``settings`` are defaults of a run;
    ``origin`` is the source of the scene, and is not compared.

    Raises SceneError, with every mistake, unless all numbers are finite, radii and masses greater than 0,
    each body is inside the arena and no two overlap, except those that pass through each other (touching is
    allowed; the tolerance is 1e-12 of the radius, or of the sum of the two radii). A body whose mass is
    ``math.inf`` is *immovable*: walls reflect it, bodies of finite mass do not change its motion, and
    two immovable ones bounce like two equal masses. Radii, other masses and the arena's sides are from
    2**-200 to 2**200, coordinates and speeds at most 2**200, so that no product of them over- or underflows.
    """

    position: Floats
    velocity: Floats
    radius: Floats
    mass: Floats
    arena: tuple[float, float] | None
    commands: tuple[Command, ...]
    start: float
    unit: float | None
    kind: tuple[Kind, ...]
    responses: tuple[tuple[Pair, Response], ...]
    settings: Settings
    origin: Mapping[str, Any]
    periodic: str
    shape: npt.NDArray[np.int64]
    shapes: tuple[Shape, ...]

    kinds: ClassVar[tuple[Kind, ...]]
    kind_numbers: ClassVar[npt.NDArray[np.int64]]

    def __init__(
        self,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike,
        radius: Radii = None,
        mass: npt.ArrayLike = 1.0,
        arena: Numbers | None = None,
        turns: Sequence[Turn | tuple[int, float, Numbers]] = (),
        start: float = 0.0,
        settings: Settings | None = None,
        origin: Mapping[str, Any] | None = None,
        commands: Sequence[Command] = (),
        unit: float | None = None,
        kind: Kinds | None = None,
        responses: Responses | None = None,
        kinds: Iterable[Kind] | None = None,
        periodic: str = "",
        shape: ShapeOfEach = None,
        shapes: Sequence[Shape] = (),
    ) -> None:
        mistakes: list[Mistake] = []
        if settings is not None and not isinstance(settings, Settings):
            mistakes.append(Mistake("settings", shown(settings), "kinetile.Settings(...), or None"))
        settings = settings if isinstance(settings, Settings) else Settings()
        if origin is not None and not isinstance(origin, Mapping):
            mistakes.append(Mistake("origin", shown(origin), "a mapping that says where the scene is from"))
        shaped = are_given(shape, shapes)
        if (radius is not None) == shaped:
            both = ("radii beside shapes", "one of the two: a shape has its own radius")
            mistakes.append(Mistake("radius", *(both if shaped else ("nothing", "radii, or shapes"))))
        radius = radius if radius is not None and not shaped else 1.0
        arrays, unknown = read_arrays(position, velocity, radius, mass, mistakes)
        table = read_table(shape, shapes, len(arrays[0]), mistakes) if shaped else None
        if table is not None:
            arrays, unknown["radius"] = (*arrays[:2], table.radius, arrays[3]), table.unknown
            table = None if table.discs else table
        framed = check_frame(arena, start, settings.until)
        amiss = {mistake.where for mistake in framed}
        sides = None if arena is None or "arena" in amiss else (float(arena[0]), float(arena[1]))
        mistakes += framed
        wrong = check_periodic(periodic, arena is not None)
        mistakes += wrong
        extent = None if sides is None else Extent(sides, "" if wrong else periodic)
        try:
            given = list(commands)
        except TypeError:
            mistakes.append(Mistake("commands", shown(commands), "a sequence of commands"))
            given = []
        rules = read_rules(kind, responses, len(arrays[0]), kinds_of_inserted(given), mistakes, kinds)
        mistakes += unregistered(rules.responses)
        mistakes += check_bodies(*arrays, extent, unknown, (rules.kind, rules.passing), table)
        begin = None if "start" in amiss else float(start)
        try:
            turns = list(turns)
        except TypeError:
            mistakes.append(Mistake("turns", shown(turns), "a sequence of turns: (body, time, (vx, vy))"))
            turns = []
        for k, turn in enumerate(turns):
            mistakes += check_turn(turn, f"turns[{k}]", len(arrays[0]), begin)
        mistakes += check_commands(given, begin, extent)
        if table is not None:
            mistakes += check_shaped(periodic, given)
        mistakes += check_unit(unit)
        mistakes += check_settings(settings)
        if mistakes:
            raise SceneError(abridged(mistakes))
        names = ("position", "velocity", "radius", "mass")
        for name, array in zip(names, arrays, strict=True):
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        rules.kind.flags.writeable = False
        object.__setattr__(self, "kind", tuple(rules.kinds[each] for each in rules.kind.tolist()))
        object.__setattr__(self, "responses", rules.responses)
        self.__dict__.update(kinds=rules.kinds, kind_numbers=rules.kind)
        object.__setattr__(self, "arena", sides)
        object.__setattr__(self, "start", float(start))
        object.__setattr__(self, "unit", None if unit is None else float(unit))
        apart = sorted((Turn(*turn) for turn in turns), key=lambda turn: (turn.time, turn.body))
        first = rules.kinds[0] if rules.kinds != (0,) else None
        object.__setattr__(self, "commands", self._in_order(numbered([*apart, *given], len(self), first)))
        object.__setattr__(self, "settings", settings)
        object.__setattr__(self, "origin", dict(origin or {}))
        object.__setattr__(self, "periodic", periodic)
        index = np.full(len(self), -1) if table is None else table.index
        index.flags.writeable = False
        object.__setattr__(self, "shape", index)
        object.__setattr__(self, "shapes", () if table is None else table.shapes)
        mistakes += check_pace(self.start, self.time_unit) + check_presence(self.commands, len(self))
        mistakes += check_end(settings, Clock(self.start, self.time_unit))
        if mistakes:
            raise SceneError(mistakes)

    def __len__(self) -> int:
        return len(self.radius)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Scene):
            return NotImplemented
        return self._bits() == other._bits() and self.settings == other.settings

    def __hash__(self) -> int:
        return hash(self._bits())

    def __repr__(self) -> str:
        bodies = f"{len(self)} {'body' if len(self) == 1 else 'bodies'}"
        around = "no walls" if self.arena is None else f"in {self.arena[0]!r} x {self.arena[1]!r}"
        around += f", periodic along {' and '.join(self.periodic)}" if self.periodic else ""
        count = len(self.commands)
        what = "turn" if count == len(self.turns) else "command"
        turns = f", {count} {what}{'' if count == 1 else 's'}" if count else ""
        recipe = f", from {self.origin['recipe']!r}" if "recipe" in self.origin else ""
        return f"<Scene: {bodies}, {around}{turns}{recipe}>"

    def replace(self, **changes: Any) -> Scene:
        """Returns a scene with other values for some arguments of the constructor, checked as any scene is.

        ``turns`` take the place of the turns alone, ``commands`` that of all commands, and ``shape`` or
        ``shapes`` that of radii; radii take that of shapes only beside ``shape=None, shapes=()``. Kinds that
        followed from bodies and commands follow anew, those that were declared stay, unless ``kinds`` are
        given. The new scene has no ``origin``, since no recipe and no file makes it.

        Raises SceneError as the constructor does, and TypeError for an argument that it does not have.
        """
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        values |= {"origin": None, "turns": (), "kinds": self.kinds if self.declares_kinds else None}
        for name in changes:
            if name not in values:
                raise TypeError(f"a scene has no {name!r}; expected {one_of(name, values)}")
        if self.shapes or changes.get("shape") is not None:
            values["radius"] = None
        if "turns" in changes and "commands" not in changes:
            values["commands"] = [each for each in self.commands if not isinstance(each, Turn)]
        return Scene(**(values | changes))

    def counted(self, count: int) -> str:
        """Returns so many of its bodies in words: discs, or bodies where some have other shapes."""
        one, several = ("body", "bodies") if self.shapes else ("disc", "discs")
        return f"{count:,} {one if count == 1 else several}"

    @property
    def time_unit(self) -> float:
        """The power of two, at most 1, in which the clock of a run counts (see ``kinetile.kernel.clock``)."""
        return self._unit_for(self.commands)

    @property
    def periods(self) -> tuple[float, float]:
        """The periods of the two axes; 0 for one that is not periodic."""
        return (0.0, 0.0) if self.arena is None else Extent(self.arena, self.periodic).periods

    @property
    def answer(self) -> int:
        """The number of the specification that its contacts follow: ``ANSWER`` with shapes, 2 with a periodic
        axis, and otherwise 1; each contains those before."""
        return ANSWER if self.shapes else 2 if self.periodic else 1

    @property
    def turns(self) -> tuple[Turn, ...]:
        """The turns among the commands."""
        return tuple(command for command in self.commands if isinstance(command, Turn))

    @property
    def declares_kinds(self) -> bool:
        """Whether ``kinds`` are others, or in another order, than follow from bodies, commands and rules."""
        coming = (kind for _, kind in kinds_of_inserted(self.commands) if kind is not None)
        return self.kinds != kinds_that_follow(self.kind, coming, self.responses)

    @property
    def ruled(self) -> bool:
        """Whether the scene has kinds, or contacts other than elastic contacts of movable
        bodies."""
        coming = [command.mass for command in self.commands if isinstance(command, Insert)]
        static = math.inf in coming or bool(np.isinf(self.mass).any())
        kinds = bool(self.responses) or self.kinds != (0,)
        return kinds or static or bool(self.__dict__.get("_ruled"))

    @property
    def meets(self) -> list[list[Response]]:
        """The response of each two of ``kinds``, and of a kind and a wall (the last column)."""
        return table(self.kinds, self.responses)

    @property
    def capacity(self) -> int:
        """The number of bodies for which a phase makes room if bodies are inserted: at least the present
        number."""
        return int(self.__dict__.get("_capacity", len(self)))

    @property
    def alike(self) -> bool:
        """Whether there are two bodies or more, with one mass and one radius, whose contacts are all elastic,
        and no phase is to make room for another."""
        single = all(bool((column == column[:1]).all()) for column in (self.mass, self.radius))
        return single and 1 < len(self) == self.capacity and not self.ruled and not self.shapes

    def _unit_for(self, commands: Sequence[Command]) -> float:
        """Returns the time unit of this scene with these commands."""
        if self.unit is not None:
            return self.unit
        if len(self) == 0 and (self.arena is None or not commands):
            return 1.0
        extent = max(self.arena) if self.arena else float(np.abs(self.position).max() + self.radius.max())
        squares = [float((self.velocity**2).sum(axis=1).max())] if len(self) else []
        return time_unit(extent, math.sqrt(max([*squares, *speeds(commands)], default=0.0)))

    def _in_order(self, commands: list[Command]) -> tuple[Command, ...]:
        """Returns commands in the order of the ticks at which they run."""
        if all(command.at is None for command in commands):
            return tuple(sorted(commands, key=lambda command: command.time))
        clock = Clock(self.start, self._unit_for(commands))

        def when(command: Command) -> tuple[int, int]:
            return clock.tick_of(command.time, command.at), command.at[2] if command.at else 0

        return tuple(sorted(commands, key=when))

    def __reduce__(self) -> tuple[Any, ...]:
        # Through the constructor: unpickled arrays would otherwise be writable.
        arrays = (self.position, self.velocity, None if self.shapes else self.radius, self.mass)
        more: tuple[Any, ...] = (self.start, self.settings, dict(self.origin), self.commands, self.unit)
        more += (self.kind, dict(self.responses), self.kinds, self.periodic)
        more += (self.shape, self.shapes) if self.shapes else ()
        return (Scene, (*arrays, self.arena, (), *more))

    def _bits(self) -> tuple[bytes, ...]:
        """Returns everything that is simulated as bytes: -0.0 is not 0.0."""
        frame = (self.start, *(self.arena or ()))
        return (
            *(array.tobytes() for array in (self.position, self.velocity, self.radius, self.mass)),
            struct.pack(f"<{len(frame)}d", *frame),
            repr(self.commands).encode(),
            repr(self.unit).encode(),
            repr((self.kinds, self.kind)).encode() if self.kinds != (0,) else b"",
            repr(self.responses).encode(),
            self.periodic.encode(),
            repr((self.shape.tolist(), self.shapes)).encode() if self.shapes else b"",
        )


def check_settings(settings: Settings) -> list[Mistake]:
    """Checks the types of the settings; the existence of phases is checked when they are selected."""
    mistakes = []
    if not isinstance(settings.broad_phase, (str, type(None))):
        mistakes.append(Mistake("broad-phase", shown(settings.broad_phase), "the name of a broad phase"))
    narrow = settings.narrow_phases
    if narrow is not None and not (
        isinstance(narrow, tuple) and all(isinstance(name, str) for name in narrow)
    ):
        mistakes.append(Mistake("narrow-phases", shown(narrow), "a list of names of narrow phases"))
    options = settings.options
    if not isinstance(options, Mapping) or not all(isinstance(table, Mapping) for table in options.values()):
        mistakes.append(Mistake("options", shown(options), "a table of options for each phase's name"))
    return mistakes


def check_end(settings: Settings, clock: Clock) -> list[Mistake]:
    """Checks the exact end of a scene with this clock: it has to equal ``until``, up to its rounding."""
    if settings.end is None:
        return []
    if not is_exact(settings.end):
        return [Mistake("end", shown(settings.end), EXACT)]
    ticks = clock.tick_of(0.0, settings.end)
    time = clock.time(ticks)
    near = (math.nextafter(time, -math.inf), time, math.nextafter(time, math.inf))
    if settings.until is not None and (settings.until in near or clock.ticks(settings.until) == ticks):
        return []
    return [Mistake("end", f"{settings.end}, which is at {time!r}", f"an end at until = {settings.until!r}")]


LEAST = 64
"""The least number of slots in a scene with insertions."""


def relabelled(
    scene: Scene, *, settings: Settings | None = None, origin: Mapping[str, Any] | None = None
) -> Scene:
    """Returns the same scene with other settings or another origin, without checking its bodies again.

    Raises SceneError for settings that the scene cannot have.
    """
    mistakes = []
    if settings is not None and not isinstance(settings, Settings):
        mistakes = [Mistake("settings", shown(settings), "kinetile.Settings(...), or None")]
    elif settings is not None:
        mistakes = [*check_frame(None, scene.start, settings.until), *check_settings(settings)]
        mistakes += check_end(settings, Clock(scene.start, scene.time_unit))
    if mistakes:
        raise SceneError(mistakes)
    copy = object.__new__(Scene)
    copy.__dict__.update(scene.__dict__)
    if settings is not None:
        copy.__dict__["settings"] = settings
    if origin is not None:
        copy.__dict__["origin"] = dict(origin)
    return copy


def standing(scene: Scene, columns: Mapping[str, npt.NDArray[Any]], capacity: int) -> Scene:
    """Returns the same scene on its clock, with other bodies and no commands: as it stands in the middle of a
    run.

    ``columns`` are position, velocity, radius, mass and kind of the bodies, and their shape where the scene
    has shapes; ``capacity`` is the number of bodies for which a phase makes room. Nothing is checked: the
    values come from a run.
    """
    copy = relabelled(scene)
    if not scene.shapes:
        columns = {**columns, "shape": np.full(len(columns["radius"]), -1)}
    for name, column in columns.items():
        column.flags.writeable = False
        copy.__dict__[name] = column
    copy.__dict__["commands"] = ()
    copy.__dict__["unit"] = scene.time_unit
    copy.__dict__["_capacity"] = capacity
    copy.__dict__["_ruled"] = scene.ruled
    return copy


def spacious(scene: Scene, capacity: int | None = None) -> Scene:
    """Returns the same scene, in which phases make room for this many bodies, or for the present number if
    that is larger."""
    copy = relabelled(scene)
    copy.__dict__["_capacity"] = max(2 * len(scene), LEAST) if capacity is None else capacity
    return copy


def with_commands(
    scene: Scene,
    commands: Sequence[Command],
    responses: Mapping[Pair, Response] | None = None,
    kinds: Iterable[Kind] | None = None,
) -> Scene:
    """Returns the same scene, on the same clock, with these commands, and with more responses. Its kinds are
    these, or as in ``Scene.replace``. Raises SceneError if they do not fit."""
    more = {} if kinds is None else {"kinds": kinds}
    rules = {**dict(scene.responses), **(responses or {})}
    unit, origin = scene.time_unit, scene.origin
    return scene.replace(commands=commands, responses=rules, unit=unit, origin=origin, **more)
