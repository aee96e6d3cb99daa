"""Scene: bodies with positions and velocities, the arena around them, and the commands of the run. A scene is
a value: its arrays are its own read-only copies, its constructor checks all of it, and two scenes are equal
if they hold the same bits. Arrays (here), ``make_scene`` and ``load_scene`` make scenes."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Floats, Integers
from kinetile.errors import BadOption, Mistake, SceneError, answering, constructed, key_of, no_attribute
from kinetile.kernel.clock import Clock
from kinetile.kernel.log import ANSWER
from kinetile.plugin.choices import called
from kinetile.scene.bodies import Coordinates
from kinetile.scene.checks import Extent, shown
from kinetile.scene.commands import Command, Insert, SetKind, Turn
from kinetile.scene.frame import check_frame
from kinetile.scene.reader import NO_FILE, FilePlaces, Given, fill
from kinetile.scene.responses import Kind, Kinds, Pair, Response, Responses, kinds_that_follow, table
from kinetile.scene.settings import Settings, check_end, check_settings
from kinetile.scene.shapes import Obstacle, Shape, check_obstacle

Radii: TypeAlias = "npt.ArrayLike | None"
Accelerations: TypeAlias = "npt.ArrayLike | None"
ShapeOfEach: TypeAlias = "npt.ArrayLike | Shape | None"


@constructed
@dataclass(frozen=True, eq=False, init=False, repr=False)
class Scene:
    """Discs, or bodies of other convex shapes, in the plane, with or without walls around them.

    ``position`` and ``velocity`` are (n, 2); ``radius`` and ``mass`` are (n,), or one number for all; all are
    kept as read-only arrays of float64. Bodies of other shapes, which do not rotate, have ``shapes``, a list,
    and ``shape`` instead of ``radius``: (n,) the index of each body's shape, or one for all, or one ``Shape``
    for all. Then ``radius`` is the radius of the circle around a body's position that holds it. The list also
    has the shapes of inserted bodies; a scene of discs may have it beside ``radius``, for such insertions. If
    all are discs, the scene is the one that ``radius`` makes: ``shapes`` is empty, and ``shape`` is -1.

    ``arena`` is (width, height), for walls around [0, width] x [0, height], or None for no walls.
    ``periodic`` names the axes, "x", "y" or "xy", along which the arena has no walls but repeats itself: the
    width or the height is a period, wider than each disc, and places may be anywhere. ``commands`` (``Turn``,
    ``Insert``, ``Remove``) hold absolute times, and are kept sorted by time; commands of one tick keep the
    given order. If ``turns`` are given separately, turns of one time are sorted by body and precede other
    commands. ``unit`` is the power of two in which the clock counts; None: it follows from the speeds.
    ``time_unit`` is the unit in use (``kinetile.kernel.clock``). ``acceleration`` is (n, 2), or one for all
    bodies of finite mass; ``gravity``, (gx, gy), is the acceleration of bodies without one of their own
    (NaN). Both need discs, with walls at the ends of the axes along which they pull, or without an arena up
    to the end of the scene; bodies of infinite mass are not accelerated. ``pull`` has the largest
    accelerations of all bodies, along x and y. ``uniform`` is True if all bodies have one acceleration and
    keep it; they do not keep it if supports may hold them (``resting``). ``start`` is the time of the given
    positions. ``kind`` is the kind of each body, or one for all, and ``responses`` are the responses of pairs
    of kinds, or one for bodies and walls (``kinetile.scene.responses``). ``kinds`` are all kinds of bodies,
    present or inserted later; by default they follow from the bodies and from the insertions.
    ``kind_numbers`` is (n,) the place of each body's kind in ``kinds``. ``settings`` are defaults of a run;
    ``origin``, not compared, is the source of the scene and the contacts of a recording. ``names`` has a
    name, or None, of each body, which commands can use, as the names of insertions; ``numbers`` has the
    number of each name.

    Raises SceneError, with every mistake, unless all numbers are finite, radii and masses are greater than 0,
    each body is inside the arena and no two overlap, except two that pass through each other (touching is
    allowed; the tolerance is 1e-12 of the radius, or of the sum of the two radii). A body whose mass is
    ``math.inf`` is *immovable*: walls reflect it, and bodies of finite mass do not change its motion. Two
    immovable bodies bounce like two equal masses, but never meet in a scene with shapes. Radii, other masses
    and the arena's sides are from 2**-200 to 2**200, coordinates and speeds at most 2**200, so that no
    product of them over- or underflows.
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
    shape: Integers
    shapes: tuple[Shape, ...]
    gravity: tuple[float, float]
    acceleration: Floats
    names: tuple[str | None, ...]

    kinds: ClassVar[tuple[Kind, ...]]
    kind_numbers: ClassVar[Integers]
    time_unit: ClassVar[float]
    pull: ClassVar[tuple[float, float]]
    uniform: ClassVar[bool]
    resting: ClassVar[bool]

    def __init__(
        self,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike,
        radius: Radii = None,
        mass: npt.ArrayLike = 1.0,
        arena: Coordinates | None = None,
        turns: Sequence[Turn | tuple[int, float, Coordinates]] = (),
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
        gravity: Coordinates | None = None,
        acceleration: Accelerations = None,
        names: Sequence[str | None] | None = None,
    ) -> None:
        columns = (position, velocity, radius, mass)
        more = (commands, unit, kind, responses, kinds, periodic, shape, shapes, gravity, acceleration)
        fill(self, Given(*columns, arena, turns, start, settings, origin, *more, names), NO_FILE)

    if not TYPE_CHECKING:  # mypy finds attributes that are not there

        def __getattr__(self, name: str) -> Any:
            raise no_attribute(self, name)

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
        around += f", gravity {list(self.gravity)!r}" if any(self.gravity) else ""
        count = len(self.commands)
        what = "turn" if count == len(self.turns) else "command"
        turns = f", {count} {what}{'' if count == 1 else 's'}" if count else ""
        recipe = f", from {self.origin['recipe']!r}" if "recipe" in self.origin else ""
        return f"<Scene: {bodies}, {around}{turns}{recipe}>"

    def replace(self, **changes: Any) -> Scene:
        """Returns a scene with other values for some arguments of the constructor, checked as any scene is,
        and without ``origin``. Raises SceneError as the constructor does, and TypeError for an unknown
        argument.

        ``turns`` replace the turns alone, ``commands`` replace all commands, and ``shape`` or ``shapes``
        replace radii; radii replace shapes only beside ``shape=None, shapes=()``. Kinds that followed from
        bodies and commands follow again; declared kinds stay, unless ``kinds`` are given.
        """
        given = arguments_of(self)
        known = [each for each in given._fields if each not in ("obstacles", "until")]
        for name in changes:
            if name not in known:
                raise BadOption(
                    f"a scene has no {name!r}; expected {key_of(name, known, call=Scene.__init__)}"
                )
        if changes.get("shape") is not None:
            given = given._replace(radius=None)
        if "turns" in changes and "commands" not in changes:
            given = given._replace(commands=[each for each in self.commands if not isinstance(each, Turn)])
        return scene_of(given._replace(origin=None)._replace(**changes))

    @property
    def periods(self) -> tuple[float, float]:
        """The periods of the two axes; 0 for an axis that is not periodic."""
        return (0.0, 0.0) if self.arena is None else Extent(self.arena, self.periodic).periods

    @property
    def accelerated(self) -> bool:
        """True if some bodies are accelerated: their plans are parabolas."""
        return any(self.pull)

    @property
    def own_acceleration(self) -> Floats | None:
        """(n, 2) the own accelerations of bodies, NaN for a body without one; None without any."""
        usual = np.where(np.isinf(self.mass)[:, None], 0.0, self.gravity)
        own = (self.acceleration != usual).any(axis=1)
        return np.where(own[:, None], self.acceleration, math.nan) if own.any() else None

    @property
    def movable_shapes(self) -> frozenset[int]:
        """The numbers of the shapes that bodies of finite mass have, or may have when they are inserted: all
        shapes except those that only bodies of infinite mass have at the start."""
        coming = {each.shape for each in self.commands if isinstance(each, Insert) and each.mass < math.inf}
        moving, there = set(self.shape[np.isfinite(self.mass)].tolist()), set(self.shape.tolist())
        return frozenset(
            number
            for number, shape in enumerate(self.shapes)
            if number in moving or shape in coming or (shape.is_solid and number not in there)
        )

    @property
    def shape_of(self) -> dict[int, int]:
        """The index in ``shapes`` of each body's shape, by number, inserted ones too; {} for discs."""
        coming = (each for each in self.commands if isinstance(each, Insert) and self.shapes)
        own = dict(enumerate(self.shape.tolist())) if self.shapes else {}
        return own | {each.body: self.shapes.index(each.shape) for each in coming}

    @property
    def numbers(self) -> dict[str, int]:
        """The numbers of all bodies with a name, by their names, also of bodies that commands insert."""
        own = {name: body for body, name in enumerate(self.names) if name is not None}
        coming = (each for each in self.commands if isinstance(each, Insert))
        return own | {each.name: each.body for each in coming if each.name is not None}

    @property
    def changing(self) -> bool:
        """True if commands give bodies another kind."""
        return any(isinstance(each, SetKind) for each in self.commands)

    @property
    def answer(self) -> int:
        """The number of the specification that its contacts follow."""
        return ANSWER

    @property
    def turns(self) -> tuple[Turn, ...]:
        """The turns among the commands."""
        return tuple(command for command in self.commands if isinstance(command, Turn))

    @property
    def _ruled(self) -> bool:
        """True if the scene has kinds, or contacts other than elastic ones of movable bodies."""
        coming = [command.mass for command in self.commands if isinstance(command, Insert)]
        static = math.inf in coming or bool(np.isinf(self.mass).any())
        return static or bool(self.responses) or self.kinds != (0,)

    @property
    def meets(self) -> list[list[Response]]:
        """The response of each pair of ``kinds``, and of a kind and a wall (the last column)."""
        return table(self.kinds, self.responses)

    @property
    def capacity(self) -> int:
        """The number of bodies for which a phase allocates room in ``prepare``; present ones, or more."""
        return len(self)

    def __reduce__(self) -> tuple[Any, ...]:
        # Through the constructor: unpickled arrays would otherwise be writable.
        given = arguments_of(self)._replace(responses=dict(self.responses))
        return Scene, given[: given._fields.index("obstacles")]

    def _bits(self) -> tuple[bytes, ...]:
        """Returns all simulated values as bytes: -0.0 is not 0.0."""
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
            repr(self.gravity).encode() + self.acceleration.tobytes() if self.accelerated else b"",
            repr(self.names).encode() if self.names else b"",
        )


def are_alike(scene: Scene) -> bool:
    """Returns True if at least two bodies, all of one mass and radius, meet elastically; no insertions."""
    single = all(bool((column == column[:1]).all()) for column in (scene.mass, scene.radius))
    return single and 1 < len(scene) == scene.capacity and not scene._ruled and not scene.shapes


def in_words(scene: Scene, count: int) -> str:
    """Returns a number of bodies of a scene in words: "discs", or "bodies" if some have other shapes."""
    one, several = ("body", "bodies") if scene.shapes else ("disc", "discs")
    return f"{count:,} {one if count == 1 else several}"


def declared_kinds(scene: Scene) -> tuple[Kind, ...] | None:
    """Returns the kinds of a scene if they do not follow, in this order, from bodies, commands and rules."""
    changes = (each for each in scene.commands if isinstance(each, Insert | SetKind))
    coming = ((each.kind, isinstance(each, Insert)) for each in changes if each.kind is not None)
    following = kinds_that_follow(scene.kind, coming, scene.responses)
    return None if scene.kinds == following else scene.kinds


def arguments_of(scene: Scene) -> Given:
    """Returns arguments that make the same scene; kinds that follow from bodies and commands follow again."""
    values = {each.name: getattr(scene, each.name) for each in fields(Scene)}
    values["acceleration"] = scene.own_acceleration
    values["names"] = scene.names or None
    if scene.shapes:
        values["radius"] = None
    return Given(**values, kinds=declared_kinds(scene))


def scene_of(given: Given, places: FilePlaces = NO_FILE) -> Scene:
    """Returns the scene of these arguments, which may come from a file; raises SceneError."""
    scene = object.__new__(Scene)
    fill(scene, given, places)
    return scene


def relabelled(
    scene: Scene, *, settings: Settings | None = None, origin: Mapping[str, Any] | None = None
) -> Scene:
    """Returns the same scene with other settings or another origin; SceneError for impossible settings."""
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


def kind_of_each(scene: Scene) -> dict[int, int]:
    """Returns the place in ``kinds`` of each body's kind, by the body's number, inserted ones too."""
    return dict(enumerate(scene.kind_numbers.tolist())) | kinds_inserted(scene)


def kinds_inserted(scene: Scene) -> dict[int, int]:
    """Returns the same for inserted bodies alone; an insertion that names no kind has the only one."""
    coming = (each for each in scene.commands if isinstance(each, Insert))
    return {each.body: 0 if each.kind is None else scene.kinds.index(each.kind) for each in coming}


def source_of(scene: Scene) -> str:
    """Returns the source of a scene in words: its file, its recipe with parameters, or nothing."""
    origin = scene.origin
    if "file" in origin:
        return str(origin["file"])
    return called(str(origin["recipe"]), origin.get("parameters", {})) if "recipe" in origin else ""


def around(scene: Scene) -> str:
    """Returns the surroundings of a scene's bodies in words: walls, periods, gravity."""
    walls = "without walls" if scene.arena is None else f"in {scene.arena[0]:g} x {scene.arena[1]:g}"
    walls += f", periodic along {' and '.join(scene.periodic)}" if scene.periodic else ""
    return walls + (f", gravity ({scene.gravity[0]:g}, {scene.gravity[1]:g})" if any(scene.gravity) else "")


@answering
def with_obstacles(scene: Scene, obstacles: Iterable[Obstacle]) -> Scene:
    """Returns a scene with obstacles after its bodies, in their order: bodies keep the numbers 0 to n - 1,
    then follow obstacles, then inserted bodies. Raises SceneError if the obstacles do not fit."""
    added = list(obstacles)
    many, own = len(added), len(scene)
    mistakes = [wrong for at, each in enumerate(added) for wrong in check_obstacle(each, f"obstacles[{at}]")]
    if mistakes:
        raise SceneError(mistakes)
    later = [each._replace(body=each.body + many) if each.body >= own else each for each in scene.commands]
    return scene_of(arguments_of(scene)._replace(obstacles=added, commands=later)) if added else scene


def with_commands(
    scene: Scene,
    commands: Sequence[Command],
    responses: Mapping[Pair, Response] | None = None,
    kinds: Iterable[Kind] | None = None,
) -> Scene:
    """Returns the same scene, on the same clock, with these commands, and with more responses. Its kinds are
    the given ones, or as in ``Scene.replace``. Raises SceneError if they do not fit."""
    more = {} if kinds is None else {"kinds": kinds}
    rules = {**dict(scene.responses), **(responses or {})}
    unit, origin = scene.time_unit, scene.origin
    return scene.replace(commands=commands, responses=rules, unit=unit, origin=origin, **more)
