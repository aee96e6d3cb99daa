"""The rows of the matrix: capabilities, each a change of one small scene, so that any two of them can meet.

Seven bodies fly on dyadic plans for four units of time. A capability changes them (``Draft``), and its
``seen`` tests that contacts show it: a crossing without an effect of its capability would prove nothing.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import kinetile as kt
from kinetile.toolbox import Kernel, PairParts, ResponseParts, hook

ARENA = (6.0, 6.0)
LASTS = 4.0

PLACES = ((1.0, 1.5), (3.0, 1.5), (5.25, 1.25), (1.25, 3.0), (3.0, 3.5), (5.0, 3.25), (2.5, 5.25))
PACES = ((2.0, 0.25), (-1.0, 0.5), (-2.0, 0.5), (1.0, -0.25), (0.0, 1.0), (-2.0, -0.5), (0.5, -2.0))
TURNED = (-1.0, 2.0)


class Commands(NamedTuple):
    """The time of an insertion, the body that is turned, and the body that is removed."""

    insert: tuple[float, tuple[float, float], tuple[float, float]]
    turn: tuple[float, int]
    remove: tuple[float, int]


PLANNED = Commands((0.5, (0.5, 5.5), (2.0, -2.0)), (1.5, 0), (2.75, 6))
BY_HAND = Commands((0.5, (5.25, 4.75), (-2.75, -1.25)), (1.75, 1), (3.0, 5))

CHANGED = ((1.0, 2, "c"), (1.25, 4, "c"), (2.5, 2, "a"), (1.125, 0, "c"))
"""The bodies of another kind from a time on: by the scene's commands, and by hand."""

MOVED = ((1.125, 4, (0.5, 0.875)), (1.375, 6, (0.5, 3.875)), (1.625, 5, (4.375, 4.5)))
"""The bodies that are moved at a time: the last of them by hand."""

FORMS = (
    kt.box(0.5, 0.375),
    kt.disc(0.25),
    kt.polygon([(-0.25, -0.25), (0.25, -0.25), (0.0, 0.25)]),
    kt.capsule((-0.25, 0.0), (0.25, 0.125), 0.125),
    kt.polygon([(-0.125, -0.125), (0.25, -0.125), (0.125, 0.25)], radius=0.0625),
)


@dataclass(frozen=True)
class Draft:
    """The parts of a scene, before it is made.

    Attributes:
        scale: the factor of each body's size.
        mass: the mass of each body.
        shaped: True if bodies have the shapes of ``FORMS``, else they are discs.
        frame: further arguments of the scene.
        rules: responses by kinds; with any, bodies are of the kinds "a" and "b" in turn.
        planned: True if the scene has commands.
        by_hand: True if commands are given by hand.
        changing: True if bodies get another kind, "c", by commands of the scene and by hand.
        moving: True if bodies are moved, by commands of the scene and by hand.
        narrow: the narrow phase for pairs; None: the usual one.
    """

    scale: tuple[float, ...] = (1.0,) * 7
    mass: tuple[float, ...] = (1.0,) * 7
    shaped: bool = False
    frame: dict[str, Any] = field(default_factory=dict)
    rules: dict[Any, Any] = field(default_factory=dict)
    planned: bool = False
    by_hand: bool = False
    changing: bool = False
    moving: bool = False
    narrow: str | None = None

    def framed(self, **more: Any) -> "Draft":
        return replace(self, frame={**self.frame, **more})

    def ruled(self, rules: dict[Any, Any]) -> "Draft":
        """Returns this draft with further responses; existing ones stay."""
        return replace(self, rules={**rules, **self.rules})

    def form(self, body: int) -> kt.Shape:
        """Returns the shape of a body; the inserted one comes after the seven."""
        shape = FORMS[body % len(FORMS)] if self.shaped else kt.disc(0.25)
        by = self.scale[body] if body < len(self.scale) else 0.75
        return kt.Shape(tuple((x * by, y * by) for x, y in shape.core), shape.radius * by)

    def newcomer(self) -> dict[str, Any]:
        """Returns the arguments of the inserted body, without its place and velocity."""
        form = self.form(7)
        return {"shape": form} if self.shaped else {"radius": form.reach}

    def scene(self) -> kt.Scene:
        """Returns the scene."""
        frame: dict[str, Any] = {"arena": ARENA, **self.frame}
        bodies = range(len(PLACES))
        forms = [self.form(body) for body in bodies]
        if self.shaped:
            table = [*dict.fromkeys([*forms, self.form(7)])]
            frame |= {"shapes": table, "shape": [table.index(form) for form in forms]}
        else:
            frame["radius"] = [form.radius for form in forms]
        if self.rules:
            frame |= {"kind": ["ab"[body % 2] for body in bodies], "responses": self.rules}
        if self.planned:
            insert, turn, remove = PLANNED
            frame["commands"] = [
                kt.Turn(turn[1], turn[0], TURNED),
                kt.Insert(*insert, **self.newcomer()),
                kt.Remove(remove[1], remove[0]),
            ]
        if self.changing:
            changes = [kt.SetKind(body, time, kind) for time, body, kind in CHANGED[:-1]]
            frame["commands"] = [*frame.get("commands", ()), *changes]
        if self.moving:
            moves = [kt.Move(body, time, place) for time, body, place in MOVED[:-1]]
            frame["commands"] = [*frame.get("commands", ()), *moves]
        if self.narrow is not None:
            walls = () if frame["arena"] is None or frame.get("periodic") == "xy" else ("wall",)
            frame["settings"] = kt.Settings(narrow_phases=(self.narrow, *walls))
        if "gravity" in frame and frame["arena"] is None:
            frame["settings"] = kt.Settings(until=LASTS)
        obstacles = frame.pop("obstacles", [])
        scene = kt.Scene(PLACES, PACES, mass=list(self.mass), **frame)
        return kt.with_obstacles(scene, obstacles) if obstacles else scene


Rows = list[tuple[int, int, int, int]]
"""Contacts: epoch, tick, and two bodies, or a body and a wall."""


@dataclass(frozen=True)
class Capability:
    """A row of the matrix: its name, its change of a draft, and a test that two bodies that met show it, by
    their numbers, the lower first; or a test that a run at its end does."""

    name: str
    change: Callable[[Draft], Draft]
    shows: "Callable[[Game, int, int], bool]" = lambda game, a, b: True
    ended: Callable[[kt.Simulation], bool] = lambda sim: True

    def seen(self, game: "Game", sim: kt.Simulation) -> bool:
        met = any(self.shows(game, a, b) for _, _, a, b in rows_of(sim) if b >= 0)
        return met and self.ended(sim)


def _of(game: "Game", kinds: str, *bodies: int) -> bool:
    start = len(game.scene)
    return all(body < start for body in bodies) and sorted(kinds) == sorted(
        game.kinds[body] for body in bodies
    )


def _stopping(draft: Draft) -> Draft:
    return draft.ruled({("b", "b"): "stop"})


def _passing(draft: Draft) -> Draft:
    return replace(draft, rules={**draft.rules, ("a", "b"): "pass"})


def _immovable(draft: Draft) -> Draft:
    return replace(draft, mass=(*draft.mass[:4], math.inf, *draft.mass[5:]))


def _sizes(draft: Draft) -> Draft:
    scale, mass = (0.25, 2.0, 1.0, 0.5, 1.5, 1.0, 0.125), (1.0, 8.0, 4.0, 2.0, 4.0, 1.0, 1.0)
    both = (max(one, other) for one, other in zip(mass, draft.mass, strict=True))
    return replace(draft, scale=scale, mass=tuple(both))


def _obstacles(draft: Draft) -> Draft:
    rail = kt.polyline([(4.25, 5.25), (4.75, 5.5), (5.5, 5.25)])
    return draft.framed(obstacles=[kt.Obstacle(kt.box(1.0, 0.25), (2.0, 2.25)), *rail])


def _rest(draft: Draft) -> Draft:
    """Adds gravity, and bodies that settle: at the end some lie on the floor."""
    return draft.framed(gravity=(0.0, -0.5)).ruled({("*", "*"): SETTLING, ("*", "wall"): SETTLING})


def _rests(sim: kt.Simulation) -> bool:
    return bool((sim.velocities()[:, 1] == 0.0).any())


def _lifts(draft: Draft) -> Draft:
    """Adds an immovable body with faces, which moves, and gravity: bodies settle there, and on the floor."""
    settle = {("*", "*"): CARRYING, ("*", "wall"): CARRYING}
    return _immovable(replace(draft, shaped=True)).framed(gravity=(0.0, -0.5)).ruled(settle)


def _periodic(axes: str) -> Capability:
    return Capability(f"periodic {axes}", lambda draft: draft.framed(periodic=axes))


RESTITUTION = kt.Response("restitution", e=0.5, contact_time=2.0**-6)
SETTLING = kt.Response("restitution", e=0.25, contact_time=2.0**-3, settle=2.0)
GRIPPING = kt.Response("restitution", e=0.5, contact_time=2.0**-6, grip=0.5, surface=(0.5, 0.25))
LEDGE = kt.Response("restitution", e=0.5, contact_time=2.0**-6, one_way=(0.5, 1.0))
CARRYING = kt.Response("restitution", e=0.5, contact_time=2.0**-3, settle=2.0, grip=1.0)
CAPABILITIES = (
    Capability("discs", lambda draft: draft),
    Capability("radii of many sizes", _sizes),
    Capability("restitution", lambda draft: draft.ruled({("*", "*"): RESTITUTION})),
    Capability("grip", lambda draft: draft.ruled({("b", "b"): GRIPPING, ("b", "wall"): GRIPPING})),
    Capability("stop", _stopping, lambda game, a, b: _of(game, "bb", a, b)),
    Capability("pass", _passing, lambda game, a, b: a > b),
    Capability("one way", lambda draft: draft.ruled({("a", "b"): LEDGE}), lambda game, a, b: a > b),
    Capability("immovable", _immovable, lambda game, a, b: 4 in (a, b)),
    Capability(
        "commands, planned",
        lambda draft: replace(draft, planned=True),
        lambda game, a, b: len(game.scene) in (a, b),
    ),
    Capability(
        "commands, by hand",
        lambda draft: replace(draft, by_hand=True),
        lambda game, a, b: len(game.scene) + game.draft.planned in (a, b),
    ),
    Capability(
        "kinds that change",
        lambda draft: replace(draft, changing=True).ruled({("c", "*"): RESTITUTION}),
        lambda game, a, b: a in (0, 2, 4) and b % 2 == 1,
    ),
    Capability("moves", lambda draft: replace(draft, moving=True), lambda game, a, b: 4 in (a, b)),
    *map(_periodic, ("x", "y", "xy")),
    Capability("gravity", lambda draft: draft.framed(gravity=(0.0, -0.5))),
    Capability("rest", _rest, ended=_rests),
    Capability("lifts", _lifts, lambda game, a, b: 4 in (a, b), _rests),
    Capability("no arena", lambda draft: draft.framed(arena=None)),
    Capability("shapes", lambda draft: replace(draft, shaped=True)),
    Capability("obstacles", _obstacles, lambda game, a, b: not {7, 8, 9}.isdisjoint((a, b))),
    Capability("foreign narrow phase", lambda draft: replace(draft, narrow="matrix-narrow")),
    Capability(
        "foreign response",
        lambda draft: draft.ruled({("a", "a"): "matrix-swap"}),
        lambda game, a, b: _of(game, "aa", a, b),
    ),
)
BY_NAME = {each.name: each for each in CAPABILITIES}


class Narrow:
    """A foreign narrow phase for all shapes: the parts of the usual ones, under its own name."""

    def prepare(self, scene: kt.Scene) -> PairParts:
        usual = kt.registry().target("narrow phase", "convex" if scene.shapes else "disc")
        parts: PairParts = usual().prepare(scene)
        return parts


@hook
def swap(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Any) -> None:
    """Reverses both velocities: any velocity will do, if no other body has it."""
    for body in (a, b):
        if body >= 0 and k.mass[body] < math.inf:
            k.bodies[body].vx = -k.bodies[body].vx
            k.bodies[body].vy = -k.bodies[body].vy


class Swap:
    """Somebody else's response."""

    def prepare(self, scene: kt.Scene) -> ResponseParts:
        return ResponseParts(swap)


FOREIGN = (
    kt.NarrowPhaseSpec(
        "matrix-narrow",
        f"{__name__}:Narrow",
        role="pair",
        shapes=("disc", "box", "capsule", "segment", "polygon"),
    ),
    kt.ResponseSpec("matrix-swap", f"{__name__}:Swap"),
)


class Game:
    """A scene of some capabilities, which is played under any broad phase, with its commands by hand."""

    def __init__(self, *names: str) -> None:
        self.names = names
        draft = Draft()
        for name in names:
            draft = BY_NAME[name].change(draft)
        self.draft = draft
        self.by_hand = draft.by_hand or draft.changing or draft.moving
        self.scene = draft.scene()
        self.kinds = ["ab"[body % 2] if body < len(PLACES) else "-" for body in range(len(self.scene))]

    def simulation(self, phase: str = "naive", **more: Any) -> kt.Simulation:
        return kt.Simulation(self.scene, phase, live=self.draft.by_hand or self.draft.moving, **more)

    def play(self, sim: kt.Simulation, until: float = LASTS, **more: Any) -> kt.Simulation:
        """Continues a simulation up to a time, with the commands before it."""
        insert, turn, remove = BY_HAND
        change, body, kind = CHANGED[-1]
        move, moved, place = MOVED[-1]
        for given, time, command in (  # in the order of their times
            (self.draft.by_hand, insert[0], lambda: sim.insert(*insert[1:], **self.draft.newcomer())),
            (self.draft.changing, change, lambda: sim.set_kind(body, kind)),
            (self.draft.moving, move, lambda: sim.set_position(moved, place)),
            (self.draft.by_hand, turn[0], lambda: sim.set_velocity(turn[1], TURNED)),
            (self.draft.by_hand, remove[0], lambda: sim.remove(remove[1])),
        ):
            if given and sim.time < time <= until:
                sim.run(until=time, **more)
                command()
        sim.run(until=until, **more)
        return sim

    def played(self, phase: str = "naive", **more: Any) -> kt.Simulation:
        return self.play(self.simulation(phase, **more))


def rows_of(sim: kt.Simulation) -> Rows:
    return [tuple(row) for row in sim.contacts[["epoch", "tick", "a", "b"]].tolist()]


def moments_of(met: kt.Simulation | list[kt.Event]) -> list[tuple[int, int, set[int]]]:
    """Returns the tick and the bodies of each contact of a run, or of given events."""
    if isinstance(met, list):
        return [(each.epoch, each.tick, {*each.bodies}) for each in met]
    return [(epoch, tick, {a, *([b] if b >= 0 else [])}) for epoch, tick, a, b in rows_of(met)]


def outcome(sim: kt.Simulation) -> tuple[Any, ...]:
    """Returns all that must be the same, bit for bit, however a game was played."""
    return rows_of(sim), sim.bodies.tolist(), sim.positions().tobytes(), sim.velocities().tobytes()


def differs(sim: kt.Simulation, wanted: kt.Simulation) -> str:
    """Returns the first difference of two runs in words; "" without one."""
    found, right = outcome(sim), outcome(wanted)
    if found == right:
        return ""
    both = min(len(found[0]), len(right[0]))
    at = next((at for at in range(both) if found[0][at] != right[0][at]), both)
    said = f"{len(found[0])} contacts and {len(right[0])}; the first that differs is number {at}"
    return f"{said}: {found[0][at : at + 1]} instead of {right[0][at : at + 1]}"
