"""Living scenes: bodies are inserted, removed and turned; some pass through others, stop, or lose energy.

The room for a new body depends on the places of the others at that time. So each scene is played under the
reference, and refused commands are omitted (``Simulation.recorded``). Rare states of a structure need many
insertions: a free list that wraps, a cell with twenty bodies, a slot that is used for the fourth time. So
most rules give several commands at once, a quarter of the scenes has four times as many steps, and each scene
uses a random part of the rules, which makes runs of one kind of command.
"""

import math
from collections.abc import Iterator
from contextlib import suppress
from itertools import count, islice
from typing import Any

import numpy as np
from hypothesis import strategies as st

from kinetile import Scene, Settings, Shape
from kinetile.errors import KinetileError
from kinetile.instruments import as_python, relabelled, with_commands
from kinetile_conformance.cases import REFERENCE, Subject, is_living
from kinetile_conformance.strategies.kinds import ABSENT, KINDS, SAME_LOOP, of_kinds, with_kinds
from kinetile_conformance.strategies.shapes import SHAPES, of_all_shapes, scaled, shape_swarm
from kinetile_conformance.strategies.small import box_scenes, plane_scenes
from kinetile_conformance.strategies.strategy import Draw, drawn, numbered
from kinetile_conformance.strategies.swarms import KINDS as SWARMS
from kinetile_conformance.strategies.swarms import slots, swarm
from kinetile_conformance.strategies.torus import torus

STEPS, MANY_STEPS = 50, 200
"""The number of steps of most scenes, and of a quarter of the scenes; each step applies one rule."""

BATCH, RARE = 10, 5
"""The number of starts that are drawn together; one scene in the second number is rare."""

BURSTS = {True: (8, 12), False: (64, 200)}
"""The two numbers of bodies of a burst, if hooks run as Python (True) or are compiled (False)."""

CONTACTS = 40
"""The most contacts in each piece of a run between two commands."""

FEWEST, MOST = 3, 300
"""The least and the largest number of bodies at the start of a large scene."""

SIZES = ("crowd", "giants")
"""Kinds of swarms that make a grid use levels; they are drawn more often."""

LEVELS = {True: 12, False: 48}
"""The least number of bodies of these kinds, as Python (True) and compiled: a grid then has levels."""


def _of_kinds(number: int) -> Scene:
    """Returns up to seven bodies in a box, of three kinds; a passing body may begin within another."""
    random, passing = np.random.default_rng(number), bool(number & 1)
    bodies = int(random.integers(2, 8))
    kinds, place = random.integers(0, len(KINDS), bodies), slots(random, bodies, 4, 4)
    radius = random.choice([0.5, 0.25, 0.125], bodies)
    if passing:
        wisps = np.flatnonzero((kinds == KINDS.index("wisp")) & (random.random(bodies) < 0.5))
        place[wisps], radius[wisps] = place[kinds.argmin()] + [0.25, 0.0], 0.25
    velocity = random.integers(-4, 5, (bodies, 2)) / 2.0
    fields = of_kinds(kinds.tolist(), np.ones(bodies), random, passing)
    return Scene(place, velocity, radius, arena=(4.0, 4.0), **fields)


def _of_many(number: int) -> Scene:
    random = np.random.default_rng(number)
    bodies = 12 if as_python() else int(FEWEST * (MOST / FEWEST) ** random.random())
    kind = str(random.choice([*SWARMS, *3 * SIZES]))
    lowest, least = (4, LEVELS[as_python()]) if kind in SIZES else (0, 8)
    variation = random.integers(lowest, 8)
    return swarm(kind, max(bodies, least), number, int(variation)).replace(turns=())


def _of_any_size() -> st.SearchStrategy[Scene]:
    few = st.one_of(box_scenes(turns=False), plane_scenes(turns=False))
    return st.one_of(few, st.builds(_of_many, st.integers(0, 2**24 - 1)))


STARTS: dict[str, Draw] = {
    "living": drawn(_of_any_size),
    "ruled": numbered(_of_kinds),
    "torus": numbered(lambda number: torus(number).replace(turns=())),
    "shapes": drawn(
        lambda: st.one_of(
            of_all_shapes().map(lambda scene: with_kinds(scene.replace(turns=()))),
            st.builds(shape_swarm, st.integers(0, 2**24 - 1)),
        )
    ),
}


def _falling(scene: Scene, number: int) -> Scene:
    """Returns a scene that falls, with the loop of falling scenes: one body falls faster, one not at all."""
    fall = ((0.0, -0.25), (0.5, 0.0))[number % 4 // 2]
    own = np.full((len(scene), 2), math.nan)
    own[0] = 2.0 * np.array(fall)
    mass = np.append(scene.mass[:-1], math.inf)
    return scene.replace(gravity=fall, acceleration=own, mass=mass)


class _Play:
    """A living scene in the making: the rules give commands to a run under the reference. Every fifth scene
    is ``rare``, with changes that are too large for all scenes."""

    def __init__(self, scene: Scene, number: int) -> None:
        self.random = np.random.default_rng(number)
        self.rare = number % RARE == RARE - 1
        if self.rare and scene.kinds == (0,) and not scene.shapes:  # half fall, half have no arena
            scene = _falling(scene, number) if number % 2 else scene.replace(arena=None)
        self.scene = scene
        self.sim = Subject(REFERENCE, {}).reference.simulation(scene, room=None)
        self.ended = False
        self.widest = float(scene.radius.max(initial=0.25))
        if scene.arena is not None:
            self.corner, self.size = np.zeros(2), np.array(scene.arena)
        else:
            self.corner = scene.position.min(axis=0) - self.widest
            self.size = scene.position.max(axis=0) + self.widest - self.corner
        speed = np.abs(scene.velocity).max(initial=0.0) or 1.0
        self.unit = 2.0 ** np.round(np.log2(max(2.0 * self.widest, self.size.min() / 8.0) / speed))

    def run(self, eighths: int) -> None:
        """Runs for a number of eighths of the time that the fastest body needs to cross a cell."""
        if not eighths or self.ended:
            return
        try:
            self.sim.run(until=self.sim.time + self.unit * eighths / 8.0, max_contacts=CONTACTS)
        except KinetileError:
            self.ended = True  # under every phase: the run until then is a scene as well

    def place(self) -> Any:
        """Returns a place in 64ths of the scene, or anywhere in it."""
        part = self.random.integers(1, 64, 2) / 64.0 if self.random.random() < 0.75 else self.random.random(2)
        for at, axis in enumerate("xy"):  # on a periodic axis also on the border, and some periods away
            if axis in self.scene.periodic and self.random.random() < 0.5:
                part[at] = self.random.choice([part[at], 0.0, 1.0]) + self.random.integers(-2, 3)
        return self.corner + part * self.size

    def insert(self, place: Any, velocity: Any, radius: float, sizes: int = 3) -> bool:
        """Inserts a body, or a smaller one of up to ``sizes`` sizes; returns True if there was room."""
        kind = None if self.scene.kinds == (0,) else KINDS[int(self.random.integers(len(KINDS)))]
        for smaller in (1.0, 2.0, 4.0)[:sizes]:
            size: dict[str, Any] = {"radius": radius / smaller}
            if kind == "block":
                size["mass"] = math.inf
            if self.scene.shapes:
                size |= {"radius": None, "shape": self.shape(radius / smaller)}
            try:
                self.sim.insert(place, velocity, **size, kind=kind)
            except (KinetileError, ValueError):  # no room, or too fast for the scene's clock
                continue
            return True
        return False

    def shape(self, radius: float) -> Shape:
        """Returns a shape inside a circle of a radius: mostly a shape of the scene."""
        there = [each for each in self.scene.shapes if each.reach <= radius]
        if there and self.random.random() < 0.9:
            return there[int(self.random.integers(len(there)))]
        shape = SHAPES[int(self.random.integers(len(SHAPES)))]
        return scaled(shape, 2.0 ** math.floor(math.log2(radius / shape.reach)))

    def chosen(self, most: int) -> list[int]:
        there = self.sim.bodies
        some: list[int] = self.random.permutation(there)[: self.random.integers(1, most + 1)].tolist()
        return some

    def exchange(self, bodies: list[int]) -> None:
        """Removes bodies, and inserts as many at the same places, in another order."""
        rows = [int(np.flatnonzero(self.sim.bodies == body)[0]) for body in bodies]
        places, radii = self.sim.positions()[rows], self.sim.radii()[rows]
        velocities = self.sim.velocities()[rows]
        for body in bodies:
            self.sim.remove(body)
        for at, by in enumerate(self.random.permutation(len(bodies))):
            self.insert(places[by], velocities[at], float(min(radii[at], radii[by])))

    def open_a_way(self) -> None:
        """Makes the nearest bodies on both sides of one fly at each other, removes it, runs until they meet.
        If it ``leaves``, it flies out of their way before: so neither has a scheduled contact with it."""
        axis, leaves = int(self.random.integers(2)), bool(self.random.integers(2))
        places, radii = self.sim.positions(), self.sim.radii()
        for row in self.random.permutation(len(radii))[:16]:
            aside, along = places[:, 1 - axis] - places[row, 1 - axis], places[:, axis] - places[row, axis]
            beside = np.flatnonzero((np.abs(aside) < radii + radii[row]) & (along != 0.0))
            nearest = beside[np.argsort(np.abs(along[beside]))]
            two = [next(iter(nearest[np.sign(along[nearest]) == side]), row) for side in (-1.0, 1.0)]
            apart = abs(along[two[1]] - along[two[0]]) - radii[two].sum()
            if row in two or apart <= 0.0 or abs(aside[two[1]] - aside[two[0]]) >= radii[two].sum():
                continue
            low, high = (aside - radii)[two].max(), (aside + radii)[two].min()
            if leaves and not -radii[row] <= low < high <= radii[row]:  # they see each other beside it
                continue
            velocities = np.zeros((3, 2))
            velocities[:2, axis] = 0.5 * apart / self.unit * np.array([1.0, -1.0])
            velocities[2, 1 - axis] = 8.0 * (radii[row] + radii[two].max()) / self.unit
            there, turned = self.sim.bodies, [*two, row] if leaves else two
            with suppress(KinetileError):  # too fast for the scene's clock
                self.sim.set_velocities(there[turned], velocities[: len(turned)])
                self.sim.remove(int(there[row]))
                self.run(9)
            return

    def insert_one(self) -> None:
        """Inserts a body as wide as the widest at the start, or narrower, or slightly wider."""
        radius = self.widest * float(self.random.choice([1.0, 0.5, 0.25, 0.125, 1.5]))
        for _ in range(4):
            if self.insert(self.place(), self.random.integers(-4, 5, 2) / 4.0, radius):
                return

    def crowd(self) -> None:
        """Inserts up to eight small bodies at one place."""
        radius = self.widest / 16.0
        place, aside = self.place(), self.random.integers(-1, 2, 2) / 8.0
        for at in range(int(self.random.integers(2, 9))):
            step = 2.25 * radius * np.array([at % 3, at // 3])
            self.insert(place + step, aside, radius, sizes=1)

    def burst(self) -> None:
        """Inserts many bodies by one call, each at its own place, one or two of them at occupied places."""
        count, radius = int(self.random.choice(BURSTS[as_python()])), self.widest / 64.0
        at = np.arange(count)
        place = self.place() + 2.25 * radius * np.column_stack([at % 16, at // 16])
        velocity = self.random.integers(-4, 5, (1 + int(self.random.integers(2)) * (count - 1), 2)) / 8.0
        size: dict[str, Any] = {"shape": self.shape(radius)} if self.scene.shapes else {"radius": radius}
        kind = None if self.scene.kinds == (0,) else KINDS[0]
        with suppress(ValueError):
            self.sim.insert_many(place, np.broadcast_to(velocity, (count, 2)), **size, kind=kind)

    def arrive(self) -> None:
        """Inserts a body far outside of the starting box, if no wall prevents it, flying towards another."""
        goal = self.sim.positions()[self.random.integers(len(self.sim.bodies))]
        away = self.random.choice([-1.0, 0.0, 1.0], 2) * self.size * 2.0 ** self.random.integers(0, 4)
        time = 8.0 * self.unit
        self.insert(goal + away, -away / time, self.widest * float(self.random.choice([1.0, 0.25])))
        self.run(int(self.random.choice([0, 80])))

    def wake(self) -> None:
        """Gives velocities to some bodies at rest, or immovable ones."""
        still = (self.sim.velocities() == 0.0).all(axis=1)
        for body in self.sim.bodies[still][:3].tolist():
            self.sim.set_velocity(body, self.random.integers(-4, 5, 2) / 4.0)

    def move_some(self) -> None:
        """Moves up to three bodies to other places."""
        for body in self.chosen(3):
            with suppress(KinetileError):
                self.sim.set_position(body, self.place())

    def change_some(self) -> None:
        """Gives up to three bodies another kind, if the scene has kinds."""
        for body in self.chosen(3) if self.scene.kinds != (0,) else ():
            with suppress(KinetileError):
                self.sim.set_kind(body, KINDS[int(self.random.integers(len(KINDS)))])

    def remove_some(self) -> None:
        for body in self.chosen(3):
            self.sim.remove(body)

    def exchange_some(self) -> None:
        """Removes up to eight bodies, and inserts as many at their places."""
        self.exchange(self.chosen(8))

    def exchange_the_ends(self) -> None:
        """Removes the first and the last body, and inserts two: the low slot gets a far place."""
        there = self.sim.bodies
        ends = [int(there[-1]), int(there[0])][: len(there)]
        self.exchange(ends[:: int(self.random.choice([-1, 1]))])

    def start_over(self) -> None:
        """Removes all of a few bodies, or all but one, and inserts one that may be four times as wide as any
        before: too wide for a structure that was built for the present bodies, or for no body."""
        if len(self.sim.bodies) <= 8:
            for body in self.sim.bodies[int(self.random.integers(2)) :].tolist():
                self.sim.remove(body)
            self.insert(self.place(), self.random.integers(-4, 5, 2) / 4.0, 4.0 * self.widest)

    def turn(self) -> None:
        """Gives a body the velocity of another, or its opposite, or 0."""
        body, other = self.random.choice(self.sim.bodies), self.random.integers(len(self.sim.bodies))
        self.sim.set_velocity(int(body), self.sim.velocities()[other] * float(self.random.integers(-1, 2)))

    def many_turn(self) -> None:
        """Reverses up to 24 velocities, or exchanges them, or makes them equal."""
        rows = self.random.permutation(len(self.sim.bodies))[:24]
        there = self.sim.velocities()[rows]
        turned = (-there, self.random.permutation(there), np.tile(there[:1], (len(there), 1)))
        self.sim.set_velocities(self.sim.bodies[rows], turned[int(self.random.integers(3))])

    def recorded(self) -> Scene:
        length = 0.25 * (self.sim.time - self.scene.start) + 2.0 * self.unit
        return relabelled(self.sim.recorded(), settings=Settings(until=self.sim.time + float(length)))


RULES = (
    _Play.insert_one,
    _Play.insert_one,
    _Play.crowd,
    _Play.remove_some,
    _Play.exchange_some,
    _Play.exchange_the_ends,
    _Play.open_a_way,
    _Play.start_over,
    _Play.turn,
    _Play.many_turn,
)
"""The rules of a step of a scene; most give several commands at once."""

RARE_RULES = (
    *(_Play.burst, _Play.arrive, _Play.arrive, _Play.wake, _Play.wake),
    *(_Play.move_some, _Play.move_some, _Play.change_some),
)
"""Further rules of rare scenes."""


def _play(scene: Scene, number: int) -> Scene:
    play = _Play(scene, number)
    random = play.random
    rules = [each for each in RULES if random.random() < 0.7] or [_Play.insert_one]
    rules += RARE_RULES if play.rare else ()
    many = random.random() < 0.25 and not as_python()
    for _ in range(MANY_STEPS if many else STEPS):
        play.run(int(random.choice([0, 0, 0, 1, 1, 2, 4])))
        if play.ended:
            break
        rule = rules[int(random.integers(len(rules)))] if len(play.sim.bodies) else _Play.insert_one
        with suppress(KinetileError):  # refused commands, such as a velocity too fast for the scene's clock
            rule(play)
    return play.recorded()


def played(kind: str, start: int = 0) -> Iterator[Scene]:
    """Yields living scenes of a kind without end; the same ``start`` gives the same scenes."""
    for batch in count(start * 1_000):
        scenes = (_play(scene, batch * BATCH + at) for at, scene in enumerate(STARTS[kind](BATCH, batch)))
        yield from filter(is_living, scenes)  # the others have loops of their own, and other checks


def _drawing(kind: str) -> Draw:
    """Returns a function that plays scenes of a kind; few if interpreted, at over a second each."""
    return lambda count, start: islice(played(kind, start), max(1, count // (10 if as_python() else 1)))


def _all_pass() -> st.SearchStrategy[Scene]:
    kinds = st.sampled_from(["gas", "lattice", "giants", "plough"])
    swarms = st.builds(swarm, kinds, st.integers(8, 120), st.integers(0, 1000), st.integers(0, 7))
    rules: dict[Any, Any] = {("*", "*"): "pass", **SAME_LOOP}
    return st.one_of(box_scenes(turns=False), box_scenes(turns=False), swarms).map(
        lambda scene: with_commands(scene, scene.commands, rules, (*scene.kinds, *ABSENT))
    )


DRAWS = {
    "living scenes": _drawing("living"),
    "living scenes with responses": _drawing("ruled"),
    "living scenes on a torus": _drawing("torus"),
    "living scenes of shapes": _drawing("shapes"),
    "swarms in which all pass": drawn(_all_pass),
}
