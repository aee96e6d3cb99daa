"""What is simulated: discs, where they are and how they move, the arena around them, and what is done to
them.

A scene is a value. Its arrays are its own read-only copies, it is checked in full when it is made (all
mistakes are reported at once), and two scenes are equal when they hold the same bits. Scenes come from arrays
(here), from a recipe by name (``make_scene``) or from a file (``load_scene``).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

import kinetile
from kinetile.errors import Mistake, SceneError, UnknownName, one_of
from kinetile.kernel.clock import Clock, time_unit
from kinetile.scene.arrays import Numbers, read_arrays
from kinetile.scene.checks import (
    abridged,
    check_bodies,
    check_frame,
    check_pace,
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
    is_exact,
    numbered,
    speeds,
)
from kinetile.scene.responses import (
    ELASTIC,
    PASS,
    Kind,
    Kinds,
    Pair,
    Response,
    Responses,
    kinds_that_follow,
    read_rules,
    table,
)

__all__ = ["Scene", "Settings", "check_end", "check_settings"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Settings:
    """How a scene wants to be run, where it says so: its phases by name, their options, and until when.

    ``broad_phase`` and ``narrow_phases`` are None where the scene leaves the choice open; ``options`` maps a
    phase's name to its options; ``until`` is a time, not a length of time. ``end`` is the same exactly, as
    (epoch, tick, contacts): the run ends after so many contacts of that tick, as recordings do, and ``until``
    is that time rounded. None: after all events up to and at ``until``.
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
    """Discs in the plane, with or without walls around them.

    ``position`` and ``velocity`` are (n, 2); ``radius`` and ``mass`` are (n,), or one number for all; all are
    kept as read-only arrays of float64. ``arena`` is (width, height), for walls around [0, width] x [0,
    height], or None for no walls. ``commands`` (``Turn``, ``Insert``, ``Remove``) hold absolute times, and
    are kept sorted by time, those of one tick as they are given; ``turns`` may be given apart, then those of
    one time are sorted by body and come before other commands. ``unit`` is the power of two in which the
    clock counts; None: it follows from the speeds. ``start`` is the time at which the bodies are where
    ``position`` says. ``kind`` is the kind of each body, or one for all, and ``responses`` say what happens
    where kinds meet (``kinetile.scene.responses``). ``kinds`` are all kinds of bodies that there are, or may
    come; where they are not given, they follow from the bodies and from those that commands insert.
    ``kind_numbers`` is (n,) which of ``kinds`` each body is of. ``settings`` say how the scene wants to be
    run; ``origin`` is where it came from, and takes no part in comparisons.

    Raises SceneError, with every mistake, unless all numbers are finite, radii and masses greater than 0,
    each disc is inside the arena and no two overlap, but for those that pass through each other (touching is
    allowed; the tolerance is 1e-12 of the radius, or of the sum of the two radii). A body whose mass is
    ``math.inf`` is *immovable*: walls turn it around, bodies of finite mass do not change how it moves, and
    two immovable ones part as two equals do. Radii, other masses and the arena's sides are from 2**-200 to
    2**200, coordinates and speeds at most 2**200, so that no product of them over- or underflows.
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

    kinds: ClassVar[tuple[Kind, ...]]
    kind_numbers: ClassVar[npt.NDArray[np.int64]]

    def __init__(
        self,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike,
        radius: npt.ArrayLike,
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
    ) -> None:
        mistakes: list[Mistake] = []
        if settings is not None and not isinstance(settings, Settings):
            mistakes.append(Mistake("settings", shown(settings), "kinetile.Settings(...), or None"))
        settings = settings if isinstance(settings, Settings) else Settings()
        if origin is not None and not isinstance(origin, Mapping):
            mistakes.append(Mistake("origin", shown(origin), "a mapping that says where the scene is from"))
        arrays, unknown = read_arrays(position, velocity, radius, mass, mistakes)
        framed = check_frame(arena, start, settings.until)
        amiss = {mistake.where for mistake in framed}
        sides = None if arena is None or "arena" in amiss else (float(arena[0]), float(arena[1]))
        mistakes += framed
        try:
            given = list(commands)
        except TypeError:
            mistakes.append(Mistake("commands", shown(commands), "a sequence of commands"))
            given = []
        rules = read_rules(kind, responses, len(arrays[0]), kinds_of_inserted(given), mistakes, kinds)
        mistakes += _unregistered(rules.responses)
        mistakes += check_bodies(*arrays, sides, unknown, (rules.kind, rules.passing))
        begin = None if "start" in amiss else float(start)
        try:
            turns = list(turns)
        except TypeError:
            mistakes.append(Mistake("turns", shown(turns), "a sequence of turns: (body, time, (vx, vy))"))
            turns = []
        for k, turn in enumerate(turns):
            mistakes += check_turn(turn, f"turns[{k}]", len(arrays[0]), begin)
        mistakes += check_commands(given, begin, sides)
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
        count = len(self.commands)
        what = "turn" if count == len(self.turns) else "command"
        turns = f", {count} {what}{'' if count == 1 else 's'}" if count else ""
        recipe = f", from {self.origin['recipe']!r}" if "recipe" in self.origin else ""
        return f"<Scene: {bodies}, {around}{turns}{recipe}>"

    def _repr_html_(self) -> str:
        return kinetile.as_html(self)  # made above this room: by its public name

    def _repr_svg_(self) -> str | None:
        return kinetile.as_svg(self)

    def replace(self, **changes: Any) -> Scene:
        """Return a scene with other values for some arguments of the constructor, checked as any scene is.

        ``turns`` take the place of the turns alone, ``commands`` that of all commands. Kinds that followed
        from bodies and commands follow anew, those that were declared stay, unless ``kinds`` are given. The
        new scene has no ``origin``, since no recipe and no file makes it.

        Raises SceneError as the constructor does, and TypeError for an argument that it does not have.
        """
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        values |= {"origin": None, "turns": (), "kinds": self.kinds if self.declares_kinds else None}
        for name in changes:
            if name not in values:
                raise TypeError(f"a scene has no {name!r}; expected {one_of(name, values)}")
        if "turns" in changes and "commands" not in changes:
            values["commands"] = [each for each in self.commands if not isinstance(each, Turn)]
        return Scene(**(values | changes))

    @property
    def time_unit(self) -> float:
        """The power of two, at most 1, in which the clock of a run counts (see ``kinetile.kernel.clock``)."""
        return self._unit_for(self.commands)

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
        """Whether bodies are of kinds, or contacts anything but elastic contacts of bodies that can be
        moved."""
        coming = [command.mass for command in self.commands if isinstance(command, Insert)]
        static = math.inf in coming or bool(np.isinf(self.mass).any())
        kinds = bool(self.responses) or self.kinds != (0,)
        return kinds or static or bool(self.__dict__.get("_ruled"))

    @property
    def meets(self) -> list[list[Response]]:
        """What happens where each of ``kinds`` meets each, and a wall (the last column)."""
        return table(self.kinds, self.responses)

    @property
    def capacity(self) -> int:
        """For how many bodies at once a phase is to make room where bodies come and go: at least as many as
        there are."""
        return int(self.__dict__.get("_capacity", len(self)))

    def _unit_for(self, commands: Sequence[Command]) -> float:
        """Return the time unit of this scene with these commands."""
        if self.unit is not None:
            return self.unit
        if len(self) == 0 and (self.arena is None or not commands):
            return 1.0
        extent = max(self.arena) if self.arena else float(np.abs(self.position).max() + self.radius.max())
        squares = [float((self.velocity**2).sum(axis=1).max())] if len(self) else []
        return time_unit(extent, math.sqrt(max([*squares, *speeds(commands)], default=0.0)))

    def _in_order(self, commands: list[Command]) -> tuple[Command, ...]:
        """Return commands in the order of the ticks at which they are carried out."""
        if all(command.at is None for command in commands):
            return tuple(sorted(commands, key=lambda command: command.time))
        clock = Clock(self.start, self._unit_for(commands))

        def when(command: Command) -> tuple[int, int]:
            return clock.tick_of(command.time, command.at), command.at[2] if command.at else 0

        return tuple(sorted(commands, key=when))

    def __reduce__(self) -> tuple[Any, ...]:
        # Through the constructor: unpickled arrays would otherwise be writable.
        arrays = (self.position, self.velocity, self.radius, self.mass)
        more: tuple[Any, ...] = (self.start, self.settings, dict(self.origin), self.commands, self.unit)
        more += (self.kind, dict(self.responses), self.kinds)
        return (Scene, (*arrays, self.arena, (), *more))

    def _bits(self) -> tuple[bytes, ...]:
        """Return everything that is simulated as bytes: -0.0 is not 0.0."""
        frame = (self.start, *(self.arena or ()))
        return (
            *(array.tobytes() for array in (self.position, self.velocity, self.radius, self.mass)),
            struct.pack(f"<{len(frame)}d", *frame),
            repr(self.commands).encode(),
            repr(self.unit).encode(),
            repr((self.kinds, self.kind)).encode() if self.kinds != (0,) else b"",
            repr(self.responses).encode(),
        )


def kinds_of_inserted(commands: Iterable[Any]) -> list[tuple[str, Any]]:
    """Return where it is said, and the kind, of each body that commands insert."""
    return [
        (f"commands[{number}].kind", each.kind)
        for number, each in enumerate(commands)
        if isinstance(each, Insert)
    ]


def _unregistered(responses: Iterable[tuple[Pair, Response]]) -> list[Mistake]:
    """Return the responses that nobody has registered; note of the others that they have been found.

    A scene of elastic bodies looks nothing up. What is registered is known above this package, so it is found
    by its public name. A response is looked up once: a scene can be read where its plugin is not installed.
    """
    mistakes = []
    for pair, response in responses:
        if not (response.found or response.name in (ELASTIC, PASS)):
            try:
                kinetile.registry().spec("response", response.name)
            except UnknownName as error:
                failed = "".join(f"; not loaded: {failure}" for failure in error.failures)
                found = f"{shown(response.name)}, which is the name of no response"
                wanted = one_of(response.name, error.available) + failed
                mistakes.append(Mistake(f"responses[{pair!r}]", found, wanted))
            else:
                response.found = True
    return mistakes


def check_settings(settings: Settings) -> list[Mistake]:
    """Check the types of the settings; whether the phases exist is for those to say who select them."""
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
    """Check the exact end of a scene with this clock: it has to be ``until``, but for its rounding."""
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
