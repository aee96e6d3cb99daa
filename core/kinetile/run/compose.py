"""Composition of a run: phases found by name, the rules of its scene, and the loop with only these parts."""

import inspect
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

from kinetile.errors import BadOption, KinetileError, PhaseError, Refused, TooThick, key_of
from kinetile.kernel import features
from kinetile.kernel.chords import seeing
from kinetile.kernel.compiled import NOTHING, Hook, compose, is_checked, python_of
from kinetile.kernel.loop import idle
from kinetile.kernel.loop.ahead import LARGE_SCENE
from kinetile.kernel.loop.checked import checked, dissipating, refusing_approach
from kinetile.kernel.loop.commands import find_blockers, run_one_command
from kinetile.kernel.loop.loop import advance
from kinetile.kernel.loop.responses import MOST_RESPONSES
from kinetile.kernel.plan import LEAST_SPAN, shortest
from kinetile.kernel.skin import too_thick
from kinetile.kernel.tables import RULE, Kernel, Records, record_table
from kinetile.plugin.calling import calling, described
from kinetile.plugin.choices import read_phase, write_phase
from kinetile.plugin.parameters import parameters_of
from kinetile.plugin.protocols import BroadPhaseParts, PairParts, Parts, ResponseParts, WallParts, check_parts
from kinetile.plugin.registry import defined_at, registry
from kinetile.plugin.specs import PluginKind
from kinetile.run.pair_phases import NotTaken, pair_parts, spec_of, who_takes
from kinetile.scene import Insert, Response, Scene, are_alike
from kinetile.scene.checks import shown
from kinetile.scene.commands import COME_OR_GO, OF_CLASS
from kinetile.scene.responses import ELASTIC, PASS
from kinetile.scene.values import VALUES
from kinetile.toolbox.reach import margin_of, skin_at_start

_authors: dict[tuple[str, int], str] = {}
"""Phases and responses, as messages name them, by the file and the first line of each of their functions."""

_PLACE = re.compile(r"\(([^()]+), line (\d+)\)")

BUILT_IN = (ELASTIC, PASS)

PHASE_HOOKS = ("build", "repair", "replan", "near", "soon", "enter", "leave")
"""The hooks of a broad phase."""

CALLED_WITH = {
    "enter": ("LIVING",),
    "leave": ("LIVING",),
    "touch": ("RULES", "ACCELERATIONS"),
    "touch_wall": ("RULES", "ACCELERATIONS"),
    "part": ("PASSINGS",),
    "gap": ("SHAPES",),
    "ledge": ("RESTING",),
}
"""Hooks that a loop calls only with one of these features. Without them, a loop and its fingerprint do not
contain the hooks: so a change of a hook never recompiles a loop that does not call it."""

P = TypeVar("P", bound=Parts)
PhaseOptions = Mapping[str, Any]
Named = Mapping[str, PhaseOptions]
"""Narrow phases by name, with their options."""


def _place(function: Any) -> tuple[str, int]:
    code = getattr(python_of(function), "__code__", None)
    return ("", 0) if code is None else (code.co_filename, code.co_firstlineno)


@dataclass(frozen=True)
class Rules:
    """The responses of a scene, composed: the kernel's ``table`` of rules, the ``hooks`` in the order of
    their numbers in it, ``passing``, True if some kinds pass through each other, the ``names`` of the
    responses, and ``foreign``, the hooks that do not come with kinetile, which are checked."""

    table: Records
    kinds: int
    hooks: tuple[Callable[..., Any], ...]
    passing: bool
    names: tuple[str, ...]
    foreign: Mapping[Callable[..., Any], Callable[..., Any]]

    def named(self, *names: str) -> str:
        """Returns responses as messages name them, with the lines of other authors; by default all."""
        lines = {_authors.get(_place(hook)): defined_at(hook) for hook in self.foreign}
        chosen = [described("response", each) for each in names or self.names if each not in BUILT_IN]
        return " or ".join(f"{each}{lines.get(each, '')}" for each in chosen)

    def parts(self) -> dict[str, Any]:
        """Returns the hooks for the templates."""
        return {f"respond_{at}": self.foreign.get(hook, hook) for at, hook in enumerate(self.hooks, 1)}


def read_rules(
    scene: Scene, broad: tuple[str, BroadPhaseParts], narrow: dict[str, PairParts | WallParts]
) -> Rules | None:
    """Returns the rules of a scene, None if all is elastic and movable; Refused if a phase lacks a hook."""
    if not scene._ruled:
        return None
    each_two, kinds = [response for row in scene.meets for response in row], len(scene.kinds)
    meets = list({id(each): each for each in each_two}.values())  # one for all kinds that share it
    place = {id(response): at for at, response in enumerate(meets)}
    parts = [_parts(response, scene) for response in meets]
    needed = {each.respond for each in parts if each.respond is not None}
    if len(needed) > MOST_RESPONSES:
        raise Refused(
            f"a scene can have {MOST_RESPONSES} responses of plugins, and this one has {len(needed)}"
        )
    family = needed.union(*(each.beside for each in parts))
    if len(family) > MOST_RESPONSES or any(each.touch is None for each in narrow.values()):
        family = needed
    origins = {each: (python_of(each).__module__, python_of(each).__qualname__) for each in family}
    hooks = sorted(family, key=lambda each: origins[each])  # the same ones in one order make the same loop
    rows = record_table(RULE, len(meets))
    for row, response, each in zip(rows, meets, parts, strict=True):
        # The kernel runs the two built-in responses itself, as 0 and 1; hooks are numbered after them.
        built_in = response.name in BUILT_IN
        row.response = BUILT_IN.index(response.name) if built_in else 2 + hooks.index(cast(Any, each.respond))
        for name, number in zip(RULE.names[1:], each.numbers, strict=False):  # type: ignore[index]
            row[name] = number
        row.contact_time = each.contact_time
        row.way_x, row.way_y = response.one_way
    passing = any(response.passes for response in meets)
    if passing and broad[1].solid:
        raise _BroadPhaseRefuses(
            f"{broad[0]} is right only while bodies cannot pass through each other, and this scene has kinds "
            "that pass"
        )
    _check_narrow(narrow, passing, bool(needed), bool(scene.shapes))
    names = tuple(dict.fromkeys(response.name for response in meets))
    table = record_table(RULE, len(each_two))
    table[:] = rows[[place[id(response)] for response in each_two]]
    foreign: dict[Callable[..., Any], Callable[..., Any]] = {}
    for response, hook in ((one, each.respond) for one, each in zip(meets, parts, strict=True)):
        provided = registry().provided("response", response.name)
        if hook is not None and not provided.built_in:
            free = "dissipative" not in provided.spec.features or foreign.get(hook) is refusing_approach(hook)
            foreign[hook] = refusing_approach(hook) if free else dissipating(hook)
    return Rules(table, kinds, tuple(hooks), passing, names, foreign)


def _parts(response: Response, scene: Scene) -> ResponseParts:
    parts = _prepare("response", response.name, response.options, scene, ResponseParts)
    if parts.respond is None and response.name not in BUILT_IN:
        label = described("response", response.name)
        raise PhaseError(f"{label}: its parts have no respond; expected a function marked with toolbox.hook")
    return parts


def _check_narrow(narrow: dict[str, PairParts | WallParts], passing: bool, hooks: bool, shapes: bool) -> None:
    for name, parts in narrow.items():
        lacks = ""
        if hooks and parts.touch is None:
            lacks = "along which line bodies touch: it has no touch, as responses need"
        if passing and isinstance(parts, PairParts):
            if shapes and parts.gap is None:
                lacks = "how far apart two shapes are that may pass through each other: it has no gap"
            if parts.part is None:
                lacks = "when two bodies part that pass through each other: it has no part"
        if lacks:
            raise Refused(f"{described('narrow phase', name)} does not say {lacks}")


DEFAULT_BROAD_PHASE = "cells"
"""The default: it accepts every scene, and is usually the fastest (docs/which-broad-phase.md)."""


class CommandSupport(IntEnum):
    """The commands that are compiled into a loop."""

    NONE = 0
    TURNS = 1
    ALL = 2

    @classmethod
    def of(cls, scene: Scene) -> "CommandSupport":
        """Returns the support that a scene's commands need."""
        if any(OF_CLASS[type(command)] in COME_OR_GO for command in scene.commands):
            return cls.ALL
        return cls.TURNS if scene.commands else cls.NONE


@dataclass(frozen=True)
class Composition:
    """The phases of a simulation, with options, and their parts, ``prepared`` for a scene. Without ``pair``
    bodies pass through each other, without ``wall`` there are no walls, without ``rules`` all is elastic."""

    broad_phase: str
    options: PhaseOptions
    narrow_phases: Named
    broad: BroadPhaseParts
    pair: PairParts | None
    wall: WallParts | None
    prepared: Scene
    rules: Rules | None = None
    compiled: bool | None = None  # before the first event, never, or as soon as it pays

    @property
    def living(self) -> bool:
        """True if the broad phase inserts and removes bodies; if not, it is built again for each."""
        return self.broad.enter is not None

    @property
    def alike(self) -> bool:
        """True if the tables keep one mass and one radius for all bodies."""
        return self.pair is not None and self.pair.alike and are_alike(self.prepared)

    @property
    def passing(self) -> bool:
        """True if bodies of some kinds pass through each other, by the rules of the scene."""
        return self.rules is not None and self.rules.passing and self.pair is not None

    @property
    def mixed(self) -> bool:
        """True if bodies have different accelerations, so that two that have met may meet again."""
        return self.prepared.accelerated and not self.prepared.uniform

    @property
    def gap(self) -> Hook | None:
        """The hook for insertions, and passings, of bodies of shapes; None without shapes."""
        return self.pair.gap if self.prepared.shapes and self.pair is not None else None

    @property
    def gapless(self) -> str:
        """The reason why no body can be inserted into a scene with shapes; "" if one can."""
        if self.pair is not None and self.pair.gap is not None:
            return ""
        who = "no narrow phase for pairs is named"
        if self.pair is not None:
            who = f"{' and '.join(self.narrow_phases)} do not say how far apart two shapes are (gap)"
        return f"{who}, which decides whether a body of a shape has room: convex does"

    def author_of(self, message: str) -> str:
        """Returns the phase or response, as messages name it, whose hook is the nearest above the file and
        line in a message; without one, the phases and responses of other plugins, or the broad phase."""
        place, own = _PLACE.search(message), described("broad phase", self.broad_phase)
        theirs = [_authors[_place(each)] for each in self.rules.foreign] if self.rules else []
        narrow = [described("narrow phase", each) for each in self.narrow_phases]
        above = [
            (line, label)
            for (file, line), label in _authors.items()
            if place and Path(file).name == Path(place[1]).name and line <= int(place[2])
            if label in (own, *narrow, *theirs)
        ]
        return max(above)[1] if above else " or ".join(theirs) or own

    def loop(self, commands: CommandSupport) -> Callable[..., Any]:
        """Returns the loop for these phases, compiled at the first call or when it is made ready."""
        return compose(advance, self.parts(commands), self.label, type(self.broad.state))

    def carrying_out(self) -> Callable[..., Any]:
        """Returns the function that runs one command alone, for a broad phase without insertions."""
        parts = self.parts(CommandSupport.ALL) | {"LIVING": True, "enter": NOTHING[3], "leave": NOTHING[3]}
        return compose(run_one_command, parts, f"command_{self.label}", type(self.broad.state))

    @cached_property
    def find_room(self) -> Callable[..., Any]:
        """``find_blockers`` for insertions into this scene. Features that only moves need are left out, since
        it is compiled once for all phases."""
        walls = self.wall is not None and self.prepared.arena is not None
        given: dict[str, Any] = {
            "PASSINGS": self.passing,
            "PERIODIC": bool(self.prepared.periodic),
            "WALLED": walls,
        }
        given |= {"SHAPES": self.gap is not None, "gap": self.gap}
        return compose(find_blockers, {**features.NONE, **given}, "room", Kernel)

    def features(self, commands: CommandSupport) -> dict[str, Any]:
        """Returns the features of a loop with such commands."""
        scene, rules = self.prepared, self.rules
        return features.values(
            PAIRS=self.pair is not None,
            BOUNDS=self.pair is not None and self.pair.soonest is not None,
            WALLED=self.wall is not None,
            PERIODIC=bool(scene.periodic),
            ACCELERATIONS=scene.accelerated,
            UNEQUAL=self.mixed,
            RESTING=scene.resting,
            RULES=rules is not None,
            RESPONSES=0 if rules is None else len(rules.hooks),
            FOREIGN=rules is not None and bool(rules.foreign),
            PASSINGS=self.passing,
            SHAPES=self.gap is not None and (commands == CommandSupport.ALL or self.passing),
            COMMANDS=commands > CommandSupport.NONE,
            LIVING=commands > CommandSupport.TURNS and self.living,
            AHEAD=self.broad.soon is not None and scene.capacity >= LARGE_SCENE,
        )

    def parts(self, commands: CommandSupport = CommandSupport.NONE) -> dict[str, Any]:
        """Returns the features and the hooks of a loop with such commands."""
        given = self.features(commands)
        unused = [name for name, by in CALLED_WITH.items() if not any(given[each] for each in by)]
        parts = {**given, "soon": NOTHING[4], "inside": idle.inside, "ledge": idle.ledge}
        parts |= {} if self.rules is None else self.rules.parts()
        found = {} if self.wall is None else {"touch_wall": self.wall.touch}
        for owner, names in (
            (self.broad, PHASE_HOOKS),
            (self.pair, ("meet", "collide", "soonest", "touch", "part", "gap", "ledge")),
            (self.wall, ("reach_wall", "bounce", "inside")),
        ):
            found |= {name: getattr(owner, name, None) for name in names}
        parts |= {name: part for name, part in found.items() if part is not None and name not in unused}
        parts = {name: checked(name, part) if is_checked(part) else part for name, part in parts.items()}
        if self.prepared.accelerated:
            parts |= {name: seeing(name, parts[name]) for name in PHASE_HOOKS if name in parts}
        return parts

    def prepared_for(self, scene: Scene) -> "Composition":
        """Returns the same phases, prepared for another scene; Refused if one does not accept it."""
        again = _compose(scene, self.broad_phase, self.narrow_phases, self.options)
        return replace(again, compiled=self.compiled)

    @property
    def label(self) -> str:
        """The names of the phases, for the cache of compiled code."""
        label = "_".join([self.broad_phase, *self.narrow_phases])
        return "".join(c if c.isalnum() else "_" for c in label)[:60]


def compose_phases(
    scene: Scene,
    broad_phase: str | None,
    narrow_phases: Sequence[str] | Named | None,
    options: PhaseOptions | None,
) -> Composition:
    """Finds the phases by name and prepares them for a scene. None: the scene's settings, or
    ``DEFAULT_BROAD_PHASE``, ``disc`` or ``convex``, and ``wall`` in an arena; options given here replace
    options of the settings. Raises UnknownName, BadOption for an option that a phase does not have or does
    not accept, and Refused if a phase does not accept this scene."""
    name = scene.settings.broad_phase if broad_phase is None else broad_phase
    name, own = read_phase(DEFAULT_BROAD_PHASE if name is None else name)
    return _compose(scene, name, _named(scene, narrow_phases), own | dict(options or {}))


def _named(scene: Scene, narrow: Sequence[str] | Named | None) -> Named:
    """Returns the narrow phases of a scene with their options: given ones, the settings', or the default."""
    narrow = scene.settings.narrow_phases if narrow is None else narrow
    if narrow is None:
        pairs = "convex" if scene.shapes else "disc"
        narrow = (pairs,) if scene.arena is None or scene.periodic == "xy" else (pairs, "wall")
    return read_narrow_phases(narrow)


def read_narrow_phases(narrow: Sequence[str] | Named) -> Named:
    """Returns narrow phases with their options; raises BadOption for anything else."""
    given = narrow if isinstance(narrow, Mapping | str) else list(narrow)
    right = VALUES["options" if isinstance(given, Mapping) else "narrow-phases"].expected(given)
    if right:
        raise BadOption(f"narrow_phases is {shown(given)}; expected {right}")
    return given if isinstance(given, Mapping) else dict(map(read_phase, given))


class _BroadPhaseRefuses(Refused):
    """A broad phase does not accept a scene, and another one may."""


def _compose(scene: Scene, name: str, narrow: Named, options: PhaseOptions | None) -> Composition:
    """Prepares the phases of these names for a scene. If one refuses, the error names the installed phases
    that accept the scene."""
    try:
        return _prepared(scene, name, narrow, options)
    except (_BroadPhaseRefuses, TooThick) as refused:
        fit = accepting(scene, narrow, {registry().spec("broad phase", name).name: options or {}})
        others = ", ".join(write_phase(*each) for each in fit) or "none that is installed"
        raise Refused(f"{refused}; broad phases that accept this scene: {others}") from refused
    except NotTaken as refused:
        walls = {each: own for each, own in narrow.items() if spec_of(each).role == "wall"}
        pairs = [each for each in registry().names("narrow phase") if spec_of(each).role == "pair"]
        took = [each for each in pairs if _accepts(scene, name, {each: {}, **walls}, options)]
        others = f"choose {' or '.join(took)}" if took else f"none that is installed accepts it under {name}"
        raise Refused(f"{refused}: {others}") from refused


def _accepts(scene: Scene, name: str, narrow: Named, options: PhaseOptions | None) -> bool:
    with suppress(KinetileError):
        _prepared(scene, name, narrow, options)
        return True
    return False


def accepting(
    scene: Scene, narrow_phases: Sequence[str] | Named | None = None, refused: Named | None = None
) -> list[tuple[str, PhaseOptions]]:
    """Returns the names of the installed broad phases that accept a scene with these narrow phases, with the
    options that they need for it. ``refused`` are options of phases in addition to the scene's; if a phase
    does not accept the scene with its options, it is tried with their defaults."""
    found: list[tuple[str, PhaseOptions]] = []
    narrow = _named(scene, narrow_phases)
    for name in registry().names("broad phase"):
        own = (refused or {}).get(name, {})
        if not own and _accepts(scene, name, narrow, None):
            found.append((name, own))
        elif given := {**scene.settings.options.get(name, {}), **own}:
            usual = {each.name: each.default for each in parameters_of("broad phase", name)}
            defaults = {each: usual[each] for each in given if each in usual}
            if _accepts(scene, name, narrow, defaults):
                found.append((name, defaults))
    return found


def _prepared(scene: Scene, name: str, narrow: Named, options: PhaseOptions | None) -> Composition:
    own = scene.settings.options
    broad_options = {**own.get(name, {}), **(options or {})}
    broad = _prepare("broad phase", name, broad_options, scene, BroadPhaseParts)
    narrow_options = {each: {**own.get(each, {}), **extra} for each, extra in narrow.items()}
    decides = who_takes(scene, [each for each in narrow if spec_of(each).role == "pair"])
    given = _narrow_parts(scene, narrow_options, decides)
    pair = pair_parts(scene, decides, given)
    wall = next((parts for parts in given.values() if isinstance(parts, WallParts)), None)
    if scene.periodic:
        _demand_periodic(scene, (name, broad), given)
    if scene.accelerated:
        _demand_accelerations(given)
    walled = scene.arena is not None and wall is not None
    open_walls = scene.arena is not None and wall is None and scene.periodic != "xy"
    if open_walls and (pair is not None or scene.accelerated):
        raise Refused(
            f"of {', '.join(narrow) or 'no narrow phases'} none is for walls, and bodies would leave the "
            "arena: name wall, or leave the arena out of the scene"
        )
    if broad.walled and not walled:
        lacks = "this scene has no arena" if scene.arena is None else "no narrow phase for walls is named"
        raise _BroadPhaseRefuses(f"{name} is right only while walls keep bodies in an arena, and {lacks}")
    if broad.skin_limit is not None:
        slots = scene.capacity if broad.enter is not None else len(scene)
        skin = skin_at_start(scene, walled, slots, broad.skin_limit)
        if skin.delta > broad.skin_limit:
            raise too_thick(name, skin.delta, broad.skin_limit)
        margin = margin_of(scene, broad.skin_limit)
        if scene.accelerated and shortest(scene.pull, margin, scene.time_unit) < LEAST_SPAN:
            raise _BroadPhaseRefuses(
                f"{name} leaves the chords of accelerated bodies a margin of {margin:.3g}, too little for any"
            )
    if broad.solid:
        _demand_solid(name, broad, given, pair, scene)
    rules = read_rules(scene, (name, broad), given)
    found = Composition(name, broad_options, narrow_options, broad, pair, wall, scene, rules)
    if scene.shapes and found.gapless and any(isinstance(each, Insert) for each in scene.commands):
        raise Refused(f"no body is inserted into this scene of shapes: {found.gapless}")
    return found


def _demand_accelerations(narrow: Mapping[str, PairParts | WallParts]) -> None:
    for name, parts in narrow.items():
        if not parts.accelerated or parts.touch is None:
            lacks = "does not support accelerations (accelerated=True)"
            if parts.accelerated:
                lacks = "does not give the normal of a contact (touch)"
            raise Refused(f"{described('narrow phase', name)} {lacks}, and bodies of this scene have some")


def _demand_periodic(
    scene: Scene, broad: tuple[str, BroadPhaseParts], narrow: Mapping[str, PairParts | WallParts]
) -> None:
    message = f"does not support images (periodic=True), and this scene is periodic along {scene.periodic}"
    for name, parts in narrow.items():
        if isinstance(parts, PairParts) and not parts.periodic:
            raise Refused(f"{described('narrow phase', name)} {message}")
    if not broad[1].periodic:
        raise _BroadPhaseRefuses(f"broad phase {broad[0]!r} {message}")


def _narrow_parts(scene: Scene, options: Named, decides: PhaseOptions) -> dict[str, PairParts | WallParts]:
    """Prepares the narrow phases: all phases for pairs that decide contacts, and at most one for walls."""
    found: dict[str, PairParts | WallParts] = {}
    for each, own in options.items():
        role = spec_of(each).role
        if role == "pair" and each not in decides:
            continue
        wanted: type[PairParts | WallParts] = PairParts if role == "pair" else WallParts
        parts = _prepare("narrow phase", each, own, scene, wanted, f", as its role {role!r} has it")
        if role == "wall" and any(isinstance(other, WallParts) for other in found.values()):
            raise BadOption(
                f"two narrow phases for walls are named, and there can be one: {', '.join(options)}"
            )
        if scene.shapes and not parts.shapes:
            raise Refused(f"{described('narrow phase', each)} takes discs alone, and this scene has shapes")
        found[each] = parts
    return found


def _demand_solid(
    name: str,
    broad: BroadPhaseParts,
    given: Mapping[str, PairParts | WallParts],
    pair: PairParts | None,
    scene: Scene,
) -> None:
    """Raises Refused if bodies may pass through each other and the broad phase is then wrong."""
    if pair is None:
        raise _BroadPhaseRefuses(
            f"{name} is right only while bodies cannot pass through each other, and no narrow phase for "
            "pairs is named: name one, or choose another broad phase"
        )
    masses = [*scene.mass.tolist(), *(each.mass for each in scene.commands if isinstance(each, Insert))]
    fixed = masses.count(math.inf)
    if scene.shapes and fixed > 1:
        raise _BroadPhaseRefuses(
            f"{name} is right only while bodies cannot overlap, and where there are shapes immovable ones "
            f"may: one is the most, and this scene has {fixed}"
        )
    right = ("sum of radii", "outlines") if broad.outlines else ("sum of radii",)
    if pair.contact_distance not in right:
        pairs = (each for each, parts in given.items() if isinstance(parts, PairParts))
        closer = " and ".join(described("narrow phase", each) for each in pairs)
        raise _BroadPhaseRefuses(
            f"{name} is right only while bodies touch at the sum of their radii, and those of {closer} may "
            f"come closer (its parts say contact_distance={pair.contact_distance!r})"
        )


def _prepare(
    kind: PluginKind, name: str, options: PhaseOptions, scene: Scene, wanted: type[P], why: str = ""
) -> P:
    """Makes a phase with its options and returns its parts, which have to be of the class ``wanted``."""
    phase = registry().target(kind, name)
    check_options(kind, name, phase, options)
    with calling(kind, name, "its constructor"):
        made = phase(**options)
    with calling(kind, name, "prepare"):
        try:
            parts = made.prepare(scene)
        except Refused as error:
            if kind != "broad phase":
                raise
            raise _BroadPhaseRefuses(*error.args) from error
    label = described(kind, name)
    if not isinstance(parts, wanted):
        raise PhaseError(f"{label}: prepare returned {type(parts).__name__}, not {wanted.__name__}{why}")
    check_parts(label, parts)
    _authors.update({_place(each): label for each in vars(parts).values() if callable(each)})
    return parts


def check_options(
    kind: str, name: str, phase: Callable[..., Any], options: PhaseOptions, common: Iterable[str] = ()
) -> None:
    """Refuses an option that neither the phase's constructor nor all phases of its kind (``common``) have;
    the error names the nearest and all known ones."""
    if not options:
        return
    known = [p for p in inspect.signature(phase).parameters if p != "self"] + [*common]
    wanted = {each: key_of(str(each), known, options[each]) for each in options if each not in known}
    wrong = [f"{kind} {name!r} has no option {each!r}; expected {wanted[each]}" for each in wanted]
    if wrong:
        raise BadOption("\n".join(wrong))
