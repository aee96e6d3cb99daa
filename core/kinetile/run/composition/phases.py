"""What a simulation is made of: phases found by name, and the loop that contains them and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, cast

from kinetile.errors import BadOption, PhaseError, Refused, nearest
from kinetile.kernel.skin import too_thick
from kinetile.plugin.calling import calling, described
from kinetile.plugin.discovery import Kind
from kinetile.plugin.parts import check_parts
from kinetile.plugin.protocols import BroadPhaseParts, PairParts, WallParts
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import NarrowPhaseSpec
from kinetile.run.composition.rules import Rules, read_rules
from kinetile.scene import Scene, Turn
from kinetile.scene.reach import skin_at_start

__all__ = ["DEFAULT_BROAD_PHASE", "Commands", "Composition", "compose_phases", "read_narrow_phases"]

DEFAULT_BROAD_PHASE = "cells"
"""Taken without a name: it does any scene, and is the fastest of the built-in ones (docs/benchmark.md)."""


class Commands(IntEnum):
    """Which commands are compiled into a loop."""

    NONE = 0
    TURNS = 1
    ALL = 2

    @classmethod
    def of(cls, scene: Scene) -> Commands:
        """Return which commands a scene has."""
        if all(isinstance(command, Turn) for command in scene.commands):
            return cls.TURNS if scene.commands else cls.NONE
        return cls.ALL


@dataclass(frozen=True)
class Composition:
    """The phases of a simulation by name, with options, and their parts.

    Attributes:
        broad_phase: name of the broad phase.
        options: its options.
        narrow_phases: names of the narrow phases and their options.
        broad: the broad phase's parts.
        pair: the parts of the narrow phase for two bodies; None: bodies pass through each other.
        wall: the parts of the narrow phase for walls; None: there are no walls.
        prepared: the scene for which all of them were prepared.
        rules: what happens at contacts; None: all are elastic.
    """

    broad_phase: str
    options: Mapping[str, Any]
    narrow_phases: Mapping[str, Mapping[str, Any]]
    broad: BroadPhaseParts
    pair: PairParts | None
    wall: WallParts | None
    prepared: Scene
    rules: Rules | None = None

    @property
    def living(self) -> bool:
        """Whether the broad phase takes bodies in and lets them go; where not, it is built anew for each."""
        return self.broad.enter is not None

    def loop(self, commands: Commands) -> Callable[..., Any]:
        """Return the loop for these phases, compiled when it is first called or made ready."""
        from kinetile.kernel.compiled import compose
        from kinetile.kernel.loop import advance

        return compose(advance, self._parts(commands), self.label, type(self.broad.state))

    def obeying(self) -> Callable[..., Any]:
        """Return what carries out one command by itself, for a broad phase that takes nobody in and lets
        nobody go."""
        from kinetile.kernel.compiled import compose
        from kinetile.kernel.loop import idle
        from kinetile.kernel.loop.commands import obey_alone

        parts = self._parts(Commands.ALL) | {"LIVING": True, "enter": idle.enter, "leave": idle.leave}
        return compose(obey_alone, parts, f"obey_{self.label}", type(self.broad.state))

    def _parts(self, commands: Commands) -> dict[str, Any]:
        """Return what is filled into the loop's templates."""
        parts: dict[str, Any] = {
            "build": self.broad.build,
            "repair": self.broad.repair,
            "replan": self.broad.replan,
            "near": self.broad.near,
            "PAIRS": self.pair is not None,
            "BOUNDS": self.pair is not None and self.pair.soonest is not None,
            "WALLS": self.wall is not None,
            "COMMANDS": commands > Commands.NONE,
            "LIVING": commands > Commands.TURNS and self.living,
            "RULES": self.rules is not None,
            "PASSING": self.rules is not None and self.rules.passing and self.pair is not None,
        }
        if self.rules is not None:
            parts |= self.rules.parts(self.pair, self.wall)
        if parts["LIVING"]:
            parts |= {"enter": self.broad.enter, "leave": self.broad.leave}
        if self.pair is not None:
            parts |= {"meet": self.pair.meet, "collide": self.pair.collide}
            if self.pair.soonest is not None:
                parts["soonest"] = self.pair.soonest
        if self.wall is not None:
            parts |= {"reach_wall": self.wall.reach_wall, "bounce": self.wall.bounce}
        return parts

    def prepared_for(self, scene: Scene) -> Composition:
        """Return the same phases, prepared for another scene; Refused where one cannot do it."""
        return _compose(scene, self.broad_phase, self.narrow_phases, self.options)

    @property
    def label(self) -> str:
        """The names of the phases, for the cache of compiled code."""
        label = "_".join([self.broad_phase, *self.narrow_phases])
        return "".join(c if c.isalnum() else "_" for c in label)[:60]


def compose_phases(
    scene: Scene,
    broad_phase: str | None,
    narrow_phases: Sequence[str] | Mapping[str, Mapping[str, Any]] | None,
    options: Mapping[str, Any] | None,
) -> Composition:
    """Find the phases by name and prepare them for a scene.

    An argument that is None follows the scene's settings, then the default:
    ``DEFAULT_BROAD_PHASE``, ``disc``, and ``wall`` where the scene has an arena.
    Options given here go over those of the settings.

    Raises:
        UnknownName: no phase has this name.
        BadOption: a phase has no such option, or not such a value.
        Refused: a phase cannot do this scene.
    """
    settings = scene.settings
    narrow = narrow_phases if narrow_phases is not None else settings.narrow_phases
    if narrow is None:
        narrow = ("disc", "wall") if scene.arena is not None else ("disc",)
    named = read_narrow_phases(narrow)
    name = broad_phase if broad_phase is not None else settings.broad_phase
    return _compose(scene, name if name is not None else DEFAULT_BROAD_PHASE, named, options)


def read_narrow_phases(
    narrow: Sequence[str] | Mapping[str, Mapping[str, Any]],
) -> Mapping[str, Mapping[str, Any]]:
    """Return narrow phases with their options; raise BadOption for a string."""
    if isinstance(narrow, str):
        raise BadOption(f"narrow_phases is a sequence of names, such as [{narrow!r}], not a string")
    return narrow if isinstance(narrow, Mapping) else {each: {} for each in narrow}


def _compose(
    scene: Scene, name: str, narrow: Mapping[str, Mapping[str, Any]], options: Mapping[str, Any] | None
) -> Composition:
    """Prepare the phases of these names for a scene."""
    settings = scene.settings
    broad_options = {**settings.options.get(name, {}), **(options or {})}
    broad = _prepare("broad phase", name, broad_options, scene)
    if not isinstance(broad, BroadPhaseParts):
        raise PhaseError(
            f"{described('broad phase', name)}: prepare returned {type(broad).__name__}, not BroadPhaseParts"
        )
    check_parts(described("broad phase", name), broad)

    pair: PairParts | None = None
    wall: WallParts | None = None
    narrow_options: dict[str, Mapping[str, Any]] = {}
    given: dict[str, PairParts | WallParts] = {}
    for each, extra in narrow.items():
        narrow_options[each] = {**settings.options.get(each, {}), **extra}
        parts = _prepare("narrow phase", each, narrow_options[each], scene)
        role = cast(NarrowPhaseSpec, registry().spec("narrow phase", each)).role
        if not isinstance(parts, PairParts if role == "pair" else WallParts):
            raise PhaseError(
                f"{described('narrow phase', each)}: prepare returned {type(parts).__name__}, "
                f"not {'PairParts' if role == 'pair' else 'WallParts'}, as its role {role!r} has it"
            )
        if (pair if role == "pair" else wall) is not None:
            raise BadOption(
                f"two narrow phases for {role}s are named, and there can be one: {', '.join(narrow)}"
            )
        check_parts(described("narrow phase", each), parts)
        given[each] = parts
        if isinstance(parts, PairParts):
            pair = parts
        elif isinstance(parts, WallParts):
            wall = parts
    if broad.skin_limit is not None and scene.arena is not None:
        skin = skin_at_start(scene, walls=True)
        if skin.delta > broad.skin_limit:
            raise Refused(too_thick(name, skin.delta, broad.skin_limit))
    if broad.solid and pair is None:
        raise Refused(
            f"{name} is right only while bodies cannot pass through each other, and no narrow phase for "
            "pairs is named: name one, such as disc, or choose cells, sap-1d, sap-2d or naive"
        )
    if broad.solid and pair is not None and pair.contact_distance != "sum of radii":
        closer = next(described("narrow phase", each) for each, parts in given.items() if parts is pair)
        raise Refused(
            f"{name} is right only while bodies touch at the sum of their radii, and those of {closer} may "
            "come closer (its parts say contact_distance='closer', the default): choose cells, sap-1d, "
            "sap-2d or naive"
        )
    rules = read_rules(scene, (name, broad), given, _prepare)
    return Composition(name, broad_options, narrow_options, broad, pair, wall, scene, rules)


def _prepare(kind: Kind, name: str, options: Mapping[str, Any], scene: Scene) -> Any:
    """Make a phase with its options and ask it for its parts."""
    found = registry()
    find = {"broad phase": found.broad_phase, "narrow phase": found.narrow_phase, "response": found.response}
    phase = find[kind](name)
    check_options(kind, name, phase, options)
    with calling(kind, name, "its constructor"):
        made = phase(**options)
    with calling(kind, name, "prepare"):
        return made.prepare(scene)


def check_options(kind: str, name: str, phase: Callable[..., Any], options: Mapping[str, Any]) -> None:
    """Refuse an option that the phase's constructor does not have, with what was meant and what there is."""
    if not options:
        return
    import inspect

    known = [p for p in inspect.signature(phase).parameters if p != "self"]
    for option in options:
        if option not in known:
            close = nearest(str(option), known)
            meant = f"; did you mean {close!r}?" if close else "."
            has = f"its options are: {', '.join(known)}" if known else "it has no options"
            raise BadOption(f"{kind} {name!r} has no option {option!r}{meant} {has}")
