"""Games drawn from a seed: small scenes with everything that a scene can contain.

``draw_game`` draws 3 to 12 discs in a small arena, with walls or periodic along some axes, or without one.
Most have kinds with responses (elastic, restitution, stop, pass, for pairs and for walls), many have commands
(turns, insertions, removals), some of these at exact moments (``at``), and some a unit or an exact end. Half
of them are on a lattice, with dyadic numbers and times, so many things happen at one tick. Some are dense:
touching bodies that stop or lose energy between walls and moving bodies of infinite mass; most of these jam.
Some insertions have no room. ``draw_game_of_shapes`` gives boxes and discs the same rules and commands.
``draw_accelerated_game`` gives accelerations to games that may have some, half of them of shapes."""

import math
import random
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import box_scenes
import kinetile as kt
from kinetile.errors import Refused, SceneError, ZenoError

KINDS = ("ball", "wisp", 7)
PACES = (-2.0, -1.0, -0.5, 0.0, 0.0, 0.5, 1.0, 2.0)
LASTS = 8.0
PULLS = (0.25, 0.5, 1.0, 1.0, 2.0, 8.0, 32.0)
"""Strengths of gravity."""

OUTLINES = (
    kt.disc(0.25),
    kt.box(1.0, 0.5),
    kt.box(0.5, 0.5),
    kt.polygon([(-0.5, -0.25), (0.5, -0.25), (0.0, 0.5)]),
    kt.polygon([(-0.25, -0.25), (0.25, -0.25), (0.25, 0.25), (-0.25, 0.25)], radius=0.125),
    kt.capsule((-0.25, 0.0), (0.25, 0.0), 0.125),
    kt.capsule((0.0, -0.2), (0.1, 0.3), 0.1),
    kt.segment((-1.0, 0.0), (1.0, 0.0)),
    kt.segment((-0.5, -0.25), (0.5, 0.25)),
)

PLATFORMS = (
    kt.box(1.0, 0.5),
    kt.box(2.0, 0.5),
    kt.box(3.0, 0.25),
    kt.segment((-1.0, 0.0), (1.0, 0.0)),
    kt.segment((-1.0, -0.5), (1.0, 0.5)),
    kt.segment((-0.75, 0.75), (0.75, -0.75)),
    kt.segment((-1.0, 0.3), (1.0, -0.1)),
    kt.polygon([(-1.0, -0.25), (1.0, -0.25), (1.0, 0.5)]),
    kt.polygon([(-0.75, -0.25), (0.75, -0.25), (0.5, 0.25), (-0.5, 0.25)], radius=0.125),
    kt.capsule((-0.5, 0.0), (0.5, 0.25), 0.125),
)
"""Platforms of infinite mass, on which bodies settle, level or slanted."""

HOLLOW = (kt.segment((-0.5, 0.5), (0.5, -0.5)), kt.segment((-0.5, -0.25), (0.5, 0.25)))

SOLID = ("elastic", "restitution", "restitution", "stop")

Command = kt.Turn | kt.Accelerate | kt.SetKind | kt.Move | kt.Insert | kt.Remove


def draw_game(seed: int) -> kt.Scene:
    """Returns the game of a seed, always the same; its settings have its end."""
    rng = random.Random(f"game {seed}")
    dense, lattice = rng.random() < 0.15, rng.random() < 0.6
    base = _dense(rng) if dense else _discs(rng, lattice)
    return _with_end(rng, _with_commands(rng, base, lattice or dense))


def draw_game_of_shapes(seed: int) -> kt.Scene:
    """Returns a game of boxes and discs, always the same for a seed."""
    rng = random.Random(f"game of shapes {seed}")
    base = box_scenes.drawn(seed, (3, 4, 6, 8), ("", "", "x", "y", "xy"))
    kinds = [rng.choice(KINDS) for _ in range(len(base))]
    passing = random.Random(f"passing {seed}").random() < 0.6  # bullets and sensors
    mass = [math.inf if rng.random() < 0.2 else each for each in base.mass.tolist()]
    base = base.replace(mass=mass, kind=kinds)
    for _ in range(5):
        rules = _responses(rng, [*dict.fromkeys(kinds)], (*SOLID, "pass", "pass") if passing else SOLID)
        try:
            base = _fit(base.replace, rules)
            break
        except SceneError:  # two rules with "*" contradict each other
            continue
    return _with_end(rng, _with_commands(rng, base, lattice=True))


def draw_accelerated_game(seed: int) -> kt.Scene:
    """Returns a game with gravity along axes that are not periodic, or accelerations of some bodies, or both,
    always the same for a seed. Bodies of infinite mass are pegs, or paddles."""
    return _accelerated(random.Random(f"bent game {seed}"), _discs)


def draw_accelerated_game_of_shapes(seed: int) -> kt.Scene:
    """Returns the same with convex shapes and obstacles among them, always the same for a seed."""
    return _accelerated(random.Random(f"bent game of shapes {seed}"), _polygons)


def draw_resting_game(seed: int) -> kt.Scene:
    """Returns a game with bodies that settle, on walls and on platforms, level and slanted, some at the
    start; always the same for a seed."""
    rng = random.Random(f"resting game {seed}")
    if rng.random() < 0.15:
        return _accelerated(rng, _settling_discs)
    while True:
        lattice = rng.random() < 0.6
        base = _platforms(rng, lattice)
        aside = 0.0 if "x" in base.periodic or rng.random() < 0.7 else rng.choice((-1.0, -0.25, 0.25))
        pull = rng.choice((0.5, 1.0, 2.0, 8.0)) if lattice else rng.uniform(0.3, 4.0)
        with suppress(SceneError):
            settings = kt.Settings(until=base.start + LASTS)
            falling = base.replace(gravity=(aside * pull, -pull), settings=settings)
            return _with_end(rng, _shaken(rng, _with_commands(rng, falling, lattice), lattice))


def draw_changing_game(seed: int) -> kt.Scene:
    """Returns a game of any other sort with bodies that change their kinds, always the same for a seed. Some
    pass through bodies that they would meet then: these end."""
    rng = random.Random(f"changing game {seed}")
    falling = draw_accelerated_game, draw_accelerated_game_of_shapes, draw_resting_game
    sorts = draw_game, draw_game_of_shapes, *falling
    while True:
        game = sorts[seed % len(sorts)](rng.randrange(10**6))
        commands, numbers = [*game.commands], len(game) + len(game.commands)
        for _ in range(rng.randrange(1, 9) if len(game.kinds) > 1 else 0):
            time = game.start + (rng.randrange(1, 24) / 4 if rng.random() < 0.6 else rng.uniform(0.0, 6.0))
            at = _moment(rng, game, time) if rng.random() < 0.3 else None
            command = kt.SetKind(rng.randrange(numbers), time, rng.choice(game.kinds), at)
            if _accepts(game, [*commands, command]):
                commands.append(command)
        if len(commands) > len(game.commands):
            with suppress(Refused):  # a body settles without an arena
                return kt.Simulation(game.replace(commands=commands), "naive").scene


def draw_carrying_game(seed: int) -> kt.Scene:
    """Returns a game of any sort so far whose restitutions grip, some of them on surfaces that move or from
    one side only, and whose platforms are lifts mostly; always the same for a seed."""
    rng = random.Random(f"carrying game {seed}")
    sorts = draw_resting_game, draw_game, draw_resting_game, draw_accelerated_game, draw_resting_game
    sorts = (*sorts, draw_accelerated_game_of_shapes)
    while True:
        game = sorts[seed % len(sorts)](rng.randrange(10**6))
        rules, lifts = dict(game.responses), game.velocity.copy()
        for pair, each in game.responses:
            if each.name == "restitution":
                more: dict[str, Any] = {"grip": rng.choice((0.0, 0.25, 1.0, rng.random()))}
                if more["grip"] and rng.random() < 0.4:
                    more["surface"] = _pace(rng, rng.random() < 0.5)
                if "wall" not in pair and rng.random() < 0.4:
                    more["one_way"] = rng.choice(((0.0, 1.0), (0.0, 1.0), (0.5, -1.0), (1.0, 0.0)))
                rules[pair] = kt.Response(each.name, **each.options, **more)
        for body in np.flatnonzero(np.isinf(game.mass)).tolist() if game.accelerated else ():
            if rng.random() < 0.6:
                lifts[body] = rng.choice((-0.25, 0.0, 0.125, 0.5)), rng.choice((-0.5, 0.0, 0.0, 0.125, 0.5))
        if rules != dict(game.responses):
            return game.replace(responses=rules, velocity=lifts)


def draw_moving_game(seed: int) -> kt.Scene:
    """Returns a game of any other sort with bodies that are moved, always the same for a seed. Some are moved
    to a place without room: these end."""
    rng = random.Random(f"moving game {seed}")
    sorts = draw_game, draw_game_of_shapes, draw_accelerated_game, draw_resting_game, draw_changing_game
    while True:
        game = sorts[seed % len(sorts)](5 * rng.randrange(10**5))
        commands, sides, until = [*game.commands], game.arena or (4.0, 4.0), game.settings.until
        lasts = 6.0 if until is None else until - game.start
        for _ in range(rng.randrange(1, 4)):
            time = game.start + (rng.randrange(1, 24) / 24 if rng.random() < 0.6 else rng.random()) * lasts
            lattice, room = rng.random() < 0.5, 1.0 if game.arena else 4.0
            parts = (rng.randrange(1, 16) / 16 if lattice else rng.uniform(0.05, 0.95) for _ in sides)
            x, y = (room * part * side for part, side in zip(parts, sides, strict=True))
            body = rng.randrange(len(game) + sum(isinstance(each, kt.Insert) for each in game.commands))
            command = kt.Move(body, time, (x, y))
            if _accepts(game, [*commands, command]):
                commands.append(command)
        if len(commands) > len(game.commands):
            with suppress(Refused):  # a body settles without an arena
                return kt.Simulation(game.replace(commands=commands), "naive").scene


def _shaken(rng: random.Random, game: kt.Scene, lattice: bool) -> kt.Scene:
    """Returns the game with commands for platforms and for bodies that may rest on them."""
    commands = [*game.commands]
    for _ in range(rng.randrange(4)):
        time = game.start + (rng.randrange(1, 24) / 4 if lattice else rng.uniform(0.5, 6.0))
        body = rng.choice([*range(len(game)), *np.flatnonzero(np.isinf(game.mass)).tolist()])
        fixed = math.isinf(game.mass[body])
        velocity = (0.0, 0.0) if rng.random() < 0.5 else _pace(rng, lattice)
        command: Command = kt.Turn(body, time, velocity)
        if rng.random() < 0.4:
            pull = 0.0, rng.choice((-4.0, -1.0, 0.5))
            command = kt.Remove(body, time) if fixed else kt.Accelerate(body, time, pull)
        if _accepts(game, [*commands, command]):
            commands.append(command)
    return game.replace(commands=commands)


def _accelerated(rng: random.Random, draw: Callable[[random.Random, bool], kt.Scene]) -> kt.Scene:
    while True:
        lattice = rng.random() < 0.6
        base = draw(rng, lattice)
        axes = rng.choice(base.periodic or ("",))
        falls = [axis not in axes and rng.random() < 0.7 for axis in "xy"]
        more = {} if rng.random() < 0.4 else {"acceleration": [_pull(rng, lattice, falls) for _ in base.mass]}
        with suppress(SceneError):  # a body is outside of an axis without periods, or on a wall
            gravity = _pull(rng, lattice, falls) if rng.random() < 0.8 or not more else (0.0, 0.0)
            for body in range(len(base)) if more else ():
                if rng.random() < 0.4 or math.isinf(base.mass[body]):
                    more["acceleration"][body] = (math.nan, math.nan)
            settings = kt.Settings(until=base.start + LASTS)
            falling = base.replace(periodic=axes, gravity=gravity, settings=settings, **more)
            if falling.accelerated:
                return _with_end(rng, _with_commands(rng, falling, lattice))


def _pull(rng: random.Random, lattice: bool, along: list[bool]) -> tuple[float, float]:
    x, y = (rng.choice((-1.0, 1.0)) * (rng.choice(PULLS) if lattice else rng.uniform(0.1, 4.0)) for _ in "xy")
    return (x if along[0] else 0.0, y if along[1] else 0.0)


@dataclass(frozen=True)
class Played:
    """A game that was played: its contacts as (epoch, tick, a, b), and its end: "end", "no room", "jam", or
    "contacts" if it was stopped after a number of contacts."""

    contacts: list[tuple[int, int, int, int]]
    end: str
    fingerprint: str


def play(game: kt.Scene, phase: str = "naive", most: int = 300) -> Played:
    """Plays a game to its end, or for a number of contacts."""
    sim = kt.Simulation(game, phase)
    try:
        sim.run(max_contacts=most)
        end = "contacts" if len(sim.contacts) >= most else "end"
    except Refused:
        end = "no room"
    except ZenoError:
        end = "jam"
    rows = sim.contacts[["epoch", "tick", "a", "b"]].tolist()
    return Played(rows, end, sim.fingerprint)


def _discs(rng: random.Random, lattice: bool) -> kt.Scene:
    """Returns discs in free places, which may overlap if they pass through each other."""
    n = rng.randrange(3, 13)
    sides = (rng.choice((3.0, 4.0, 5.0)), rng.choice((3.0, 4.0, 6.0)))
    if not lattice:
        sides = (sides[0] * rng.uniform(0.9, 1.1), sides[1])
    room = rng.choice(("walls", "walls", "walls", "periodic", "periodic", "none"))
    frame: dict[str, Any] = {"start": rng.choice((0.0, 0.0, 0.5, -2.0))}
    if room != "none":
        frame["arena"] = sides
    if room == "periodic":
        frame["periodic"] = rng.choice(("x", "y", "xy", "xy"))
    kinds = rng.choice((KINDS, KINDS, KINDS[:2], (0,)))
    if rng.random() < 0.85:
        frame["kinds"] = kinds
        frame["responses"] = _responses(rng, kinds, (*SOLID, "pass", "pass"))
    else:
        kinds = (0,)
    masses = rng.choice(((1.0,), (1.0, 2.0, 0.5), (1.0, 3.0, math.inf)))
    bodies: dict[str, Any] = {"position": [], "velocity": [], "radius": [], "mass": [], "kind": []}
    for _ in range(20 * n):
        if len(bodies["mass"]) == n:
            break
        body = {
            "position": _place(rng, sides, lattice, frame.get("periodic", "")),
            "velocity": _pace(rng, lattice),
            "radius": rng.choice((0.25, 0.25, 0.375, 0.5)) if lattice else rng.uniform(0.1, 0.5),
            "mass": rng.choice(masses),
            "kind": rng.choice(kinds),
        }
        more: dict[str, Any] = {key: [*bodies[key], body[key]] for key in bodies}
        try:
            kt.Scene(**more, **frame)
        except SceneError:
            if not bodies["mass"]:  # room is not the reason: two rules with "*" contradict each other
                frame["responses"] = _responses(rng, kinds, (*SOLID, "pass"))
            continue
        bodies = more
    return kt.Scene(**bodies, **frame) if len(bodies["mass"]) >= 3 else _discs(rng, lattice)


def _fit(make: Callable[..., kt.Scene], rules: Any) -> kt.Scene:
    """Returns a scene without the rules for immovable bodies alone, which change no contact."""
    try:
        return make(responses=rules)
    except SceneError as error:
        idle = {each.where for each in error.mistakes if "immovable bodies alone" in each.found}
        if not idle:
            raise
        return make(responses={pair: rules[pair] for pair in rules if f"responses[{pair!r}]" not in idle})


def _polygons(rng: random.Random, lattice: bool) -> kt.Scene:
    """Returns convex shapes in free places, some of infinite mass, with walls or a periodic axis."""
    sides = (rng.choice((3.0, 4.0, 5.0)), rng.choice((3.0, 4.0, 6.0)))
    frame: dict[str, Any] = {"arena": sides, "periodic": rng.choice(("", "", "", "x", "y"))}
    frame["shapes"] = rng.sample(OUTLINES, 3)
    if rng.random() < 0.6:
        names = (*SOLID, "pass", "pass", "pass") if rng.random() < 0.7 else SOLID
        frame |= {"kinds": KINDS[:2], "responses": _responses(rng, KINDS[:2], names)}
    bodies: dict[str, Any] = {"position": [], "velocity": [], "shape": [], "mass": [], "kind": []}
    for _ in range(rng.choice((6, 10, 40))):
        shape = rng.randrange(3)
        fixed = frame["shapes"][shape].kind == "segment" or rng.random() < 0.4
        body = {
            "position": _place(rng, sides, lattice, frame["periodic"]),
            "velocity": (0.0, 0.0) if fixed and rng.random() < 0.8 else _pace(rng, lattice),
            "shape": shape,
            "mass": math.inf if fixed else rng.choice((1.0, 1.0, 2.0)),
            "kind": rng.choice(frame.get("kinds", (0,))),
        }
        more: dict[str, Any] = {key: [*bodies[key], body[key]] for key in bodies}
        with suppress(SceneError):
            _fit(partial(kt.Scene, **more, **frame), frame.get("responses"))
            bodies = more
    return (
        _fit(partial(kt.Scene, **bodies, **frame), frame.get("responses"))
        if len(bodies["mass"]) >= 3
        else _polygons(rng, lattice)
    )


def _settling(rng: random.Random, *, slow: bool = False) -> kt.Response:
    speeds = (0.03125, 0.25) if slow else (0.03125, 0.25, 0.5, 1.0, 4.0)
    shares = rng.choice((0.1, 0.5, 0.9)), rng.choice((2.0**-20, 0.015625))
    return kt.Response("restitution", e=shares[0], contact_time=shares[1], settle=rng.choice(speeds))


def _settling_discs(rng: random.Random, lattice: bool) -> kt.Scene:
    rules = {("*", "*"): _settling(rng, slow=True), ("*", "wall"): _settling(rng)}
    while True:
        with suppress(SceneError):  # some pass through each other
            return _discs(rng, lattice).replace(responses=rules, gravity=(0.0, -1.0))


def _platforms(rng: random.Random, lattice: bool) -> kt.Scene:
    """Returns platforms of infinite mass, alone, in rows and as hollows, and bodies on them and above."""
    sides = (rng.choice((4.0, 6.0)), rng.choice((4.0, 5.0)))
    frame: dict[str, Any] = {
        "arena": sides,
        "periodic": rng.choice(("", "", "", "x")),
        "gravity": (0.0, -1.0),
    }
    platforms = rng.sample(PLATFORMS, 3)
    frame["shapes"] = [*platforms, *HOLLOW, *rng.sample(OUTLINES[:7], 3)]
    rules: dict[Any, Any] = {("*", "*"): _settling(rng), ("*", "wall"): _settling(rng)}
    if rng.random() < 0.3:
        name = rng.choice(("elastic", "restitution", "pass"))
        rules[KINDS[0], KINDS[1]] = _settling(rng) if name == "restitution" else kt.Response(name)
    frame |= {"kinds": KINDS[:2], "responses": rules}
    bodies: dict[str, Any] = {"position": [], "velocity": [], "shape": [], "mass": [], "kind": []}

    def add(place: tuple[float, float], shape: int, velocity: tuple[float, float] = (0.0, 0.0)) -> None:
        mass = math.inf if shape < 5 else rng.choice((1.0, 1.0, 2.0))
        body = dict(zip(bodies, (place, velocity, shape, mass, rng.choice(KINDS[:2])), strict=True))
        more: dict[str, Any] = {key: [*bodies[key], body[key]] for key in bodies}
        with suppress(SceneError):
            _fit(partial(kt.Scene, **more, **frame), frame.get("responses"))
            bodies.update(more)

    for _ in range(rng.randrange(1, 4)):
        (x, y), shape = _place(rng, sides, lattice, ""), rng.randrange(3)
        if rng.random() < 0.3:
            add((x - 0.5, y), 3)
            add((x + 0.5, y), 4)
        else:
            add((x, y), shape, _pace(rng, lattice) if rng.random() < 0.1 else (0.0, 0.0))
            if platforms[shape].kind == "box" and rng.random() < 0.3:
                add((x + 2.0 * platforms[shape].core[1][0], y), shape)
    for _ in range(rng.randrange(5, 12)):
        place, velocity = _place(rng, sides, lattice, ""), (0.0, 0.0)
        if bodies["mass"] and rng.random() < 0.8:
            x, y = rng.choice(bodies["position"])
            place = x + rng.choice((-0.5, -0.25, 0.0, 0.25, 0.5)), y + rng.choice((0.5, 0.5, 0.75, 1.0, 1.5))
        if rng.random() < 0.6:
            velocity = rng.choice((-0.5, 0.25, 0.5, 1.0)), rng.choice((0.0, 0.0, -0.25))
        add(place, rng.randrange(5, 8), velocity)
    return (
        _fit(partial(kt.Scene, **bodies, **frame), frame.get("responses"))
        if len(bodies["mass"]) >= 3
        else _platforms(rng, lattice)
    )


def _dense(rng: random.Random) -> kt.Scene:
    """Returns discs that touch or nearly touch, in rows between walls, with one of infinite mass."""
    columns, rows = rng.randrange(2, 5), rng.randrange(1, 4)
    n = max(3, columns * rows - rng.randrange(2))
    radius = rng.choice((0.5, 0.5, 0.4375))
    mass = [1.0] * n
    mass[rng.randrange(n)] = math.inf
    response = rng.choice(("stop", "restitution", "restitution"))
    walls = rng.choice(("stop", "elastic", "restitution"))
    position = [(0.5 + i % columns, 0.5 + i // columns) for i in range(n)]
    velocity = [(rng.choice(PACES), rng.choice(PACES)) for _ in range(n)]
    arena = (float(columns), float(math.ceil(n / columns)))
    rules = {("*", "*"): _response(rng, response), ("*", "wall"): _response(rng, walls)}
    return kt.Scene(position, velocity, radius, mass, arena=arena, responses=rules)


def _responses(rng: random.Random, kinds: Any, names: Any) -> dict[Any, Any]:
    """Returns a few rules for some kinds, and for walls; rules with "*" may contradict each other."""
    rules: dict[Any, Any] = {}
    for _ in range(rng.randrange(1, 5)):
        pair = (rng.choice(kinds), rng.choice((*kinds, *kinds, "*")))
        rules[pair if (pair[1], pair[0]) not in rules else (pair[1], pair[0])] = _response(
            rng, rng.choice(names)
        )
    if rng.random() < 0.3:
        rules["*", "*"] = _response(rng, rng.choice(names))
    for side in (rng.choice(kinds), "*"):
        if rng.random() < 0.4:
            rules[side, "wall"] = _response(rng, rng.choice(SOLID))
    return rules


def _response(rng: random.Random, name: str) -> kt.Response:
    if name != "restitution":
        return kt.Response(name)
    contact_time = rng.choice((2.0**-20, 0.015625, 0.25, 0.1))
    return kt.Response(name, e=rng.choice((0.1, 0.5, 0.9, 1.0)), contact_time=contact_time)


def _with_commands(rng: random.Random, base: kt.Scene, lattice: bool) -> kt.Scene:
    """Returns the scene with commands for present bodies, and perhaps its own unit."""
    if rng.random() < 0.15:
        base = base.replace(unit=2.0 ** -rng.randrange(8))
    if rng.random() < 0.3:
        return base
    present, following = [*range(len(base))], len(base)
    commands: list[Command] = []
    time = base.start
    exact = rng.random() < 0.5
    numbers_written = rng.random() < 0.2
    for _ in range(rng.randrange(1, 9)):
        time += rng.choice((0.0, 0.25, 0.5, 1.0)) if lattice else rng.uniform(0.0, 1.0)
        at = _moment(rng, base, time) if exact and rng.random() < 0.7 else None
        what = rng.choice(("turn", "turn", "insert", "insert", "remove"))
        command: Command
        if what == "insert":
            place = _place(rng, base.arena or (5.0, 4.0), lattice, base.periodic)
            kind = rng.choice((None, *base.kinds)) if base.responses else None
            number = following + 3 if numbers_written and rng.random() < 0.5 else -1
            radius, mass = rng.choice((0.125, 0.125, 0.25)), rng.choice((1.0, 1.0, 2.0))
            pace, shape = _pace(rng, lattice), None
            if base.shapes:
                rod = kt.capsule((0.0, -0.25), (0.0, 0.25), 0.125)
                shape = rng.choice((*base.shapes, kt.box(0.25, 0.25), rod))
                radius, mass = 0.0, mass if shape.is_solid and rng.random() < 0.8 else math.inf
            pull = None
            if base.accelerated and not base.uniform and rng.random() < 0.5:
                pull = _pull(rng, lattice, [axis not in base.periodic for axis in "xy"])
            command = kt.Insert(time, place, pace, radius, mass, number, at, kind, shape, pull)
        elif what == "turn":
            command = kt.Turn(rng.choice(present), time, _pace(rng, lattice), at)
        else:
            command = kt.Remove(rng.choice(present), time, at)
        if base.accelerated and what == "turn" and rng.random() < 0.4:
            pull = _pull(rng, lattice, [axis not in base.periodic for axis in "xy"])
            command = kt.Accelerate(command.body, time, pull, at)
        if _accepts(base, [*commands, command]):
            commands.append(command)
            if what == "insert":
                following += 1 if number < 0 else 4
                present.append(following - 1)
            elif what == "remove" and len(present) > 1:
                present.remove(command.body)
    return base.replace(commands=commands)


def _accepts(base: kt.Scene, commands: list[Command]) -> bool:
    try:
        base.replace(commands=commands)
    except SceneError:  # a body that is not there then, as commands of one tick come in the order of their k
        return False
    return True


def _moment(rng: random.Random, base: kt.Scene, time: float) -> tuple[int, int, int]:
    """Returns the tick of a time, after some contacts of it."""
    ticks = math.floor((time - base.start) / base.time_unit * 2**52)
    return (ticks >> 52, ticks & (2**52 - 1), rng.choice((0, 0, 1, 2, 5)))


def _with_end(rng: random.Random, game: kt.Scene) -> kt.Scene:
    """Returns the game with its end: a time, or exactly after some contacts of a time's tick."""
    if rng.random() < 0.8:
        return game.replace(settings=kt.Settings(until=game.start + LASTS))
    time = game.start + rng.choice((1.0, 2.0, 2.5, 4.0))
    return game.replace(settings=kt.Settings(until=time, end=_moment(rng, game, time)))


def _place(
    rng: random.Random, sides: tuple[float, float], lattice: bool, periodic: str
) -> tuple[float, float]:
    place = [rng.randrange(1, int(4 * side)) / 4 if lattice else rng.uniform(0.0, side) for side in sides]
    for axis, side in enumerate(sides):
        if "xy"[axis] in periodic and rng.random() < 0.2:
            place[axis] += side * rng.choice((-2, -1, 1))
    return (place[0], place[1])


def _pace(rng: random.Random, lattice: bool) -> tuple[float, float]:
    if lattice:
        return (rng.choice(PACES), rng.choice(PACES))
    return (rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0))
