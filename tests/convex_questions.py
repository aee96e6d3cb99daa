"""Questions to the certificate of convex bodies, drawn from a seed: most on lattices, with many ties."""

import math
import random

import numpy as np

import kinetile as kt
from kinetile.errors import SceneError
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.certificates.shapes import enters, leaves
from kinetile.kernel.compiled import pointer
from kinetile.kernel.tables import NEVER
from kinetile.toolbox import hook
from kinetile.toolbox.differences import difference_row
from kinetile_accuracy.specification.arithmetic import UNIT_BITS, FlightPlan, Frame, Separation
from kinetile_accuracy.specification.shapes import Difference
from kinetile_accuracy.specification.touching import parting_tick, touching_tick
from two_forms import compiled


@compiled
@hook
def ask(numbers, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, tick, per_time, right, up, width, height):
    f = pointer(numbers)
    across = Axis(x, vx, 0.0, x2, vx2, 0.0, right, width, 0.0, 0.0)
    plans = Plans(across, Axis(y, vy, 0.0, y2, vy2, 0.0, up, height, 0.0, 0.0), elapsed, tick, per_time)
    return enters(f, 0, plans, 0, 0), leaves(f, 0, plans, 0)


def drawn_shape(rng: random.Random, lattice: int, sharp: bool = False) -> kt.Shape:
    """Returns a shape of up to eight corners, on a lattice unless that is 0; ``sharp``: without a margin."""
    while True:
        count = rng.choice((1, 2, 2, 3, 4, 4, 5, 6, 8))

        def number() -> float:
            return rng.randint(-2 * lattice, 2 * lattice) / lattice if lattice else rng.uniform(-2.0, 2.0)

        margin = rng.randint(1, 2 * lattice) / lattice if lattice else rng.uniform(0.05, 2.0)
        radius = 0.0 if sharp or (count > 1 and rng.random() < 0.6) else margin
        if rng.random() < 0.2:
            return kt.box(2 * margin, margin)
        if rng.random() < 0.1 and not sharp:
            return kt.disc(margin)
        turns = sorted(rng.uniform(0.0, 2.0 * math.pi) for _ in range(count))
        core = [(2.0 * math.cos(t), 2.0 * math.sin(t)) for t in turns]
        if lattice:
            core = [(round(x * lattice) / lattice, round(y * lattice) / lattice) for x, y in core]
        moved = (number(), number()) if rng.random() < 0.5 else (0.0, 0.0)
        core = [(x + moved[0], y + moved[1]) for x, y in core]
        if count < 3:
            core = [(number(), number()) for _ in range(count)]
        try:
            return kt.Shape(tuple(core), radius)
        except SceneError:
            continue


class Question:
    """Two bodies on their paths; the second is seen some periods away, or without periods."""

    def __init__(self, rng: random.Random, hard: bool = False) -> None:
        """Draws a question. A ``hard`` one may have speeds of 2^-40 to 2^40, a speed of 0, one that makes it
        creep, and sides of 20 to 1."""
        lattice = rng.choice((1, 2, 4, 16, 1 << 20, 0, 0))

        def number(size: float) -> float:
            if not lattice:
                return rng.uniform(-size, size)
            return rng.randint(-int(size * lattice), int(size * lattice)) / lattice

        sharp = rng.random() < 0.4
        self.shapes = drawn_shape(rng, lattice, sharp), drawn_shape(rng, lattice, sharp)
        if hard and rng.random() < 0.5:
            self.shapes = tuple(
                kt.Shape(tuple((20.0 * x, y) for x, y in each.core), each.radius) for each in self.shapes
            )
        self.tick = rng.choice((2.0**-52, 2.0**-52, 2.0**-30, 2.0**-10, 2.0**-3))
        self.elapsed = rng.choice((0, 0, rng.randrange(20), rng.randrange(int(4 / self.tick))))
        self.one, self.two = (number(6.0), number(6.0)), (number(6.0), number(6.0))
        self.v, self.v2 = (number(1.0), number(1.0)), (number(1.0), number(1.0))
        if rng.random() < 0.6:  # it comes near
            time = rng.uniform(0.0, 3.0)
            aim = [rng.uniform(-1.5, 1.5) for _ in range(2)]
            self.two = tuple(
                p + a - (w - v) * time for p, a, v, w in zip(self.one, aim, self.v, self.v2, strict=True)
            )
            if lattice:
                self.two = tuple(round(x * lattice) / lattice for x in self.two)
        axis = rng.randrange(6)  # so that some slide
        self.v = tuple(self.v2[i] if i == axis else self.v[i] for i in range(2))
        if rng.random() < 0.25:  # they touch: a place on a corner, or on a face, of the difference
            m = Difference(*self.shapes)
            corners = [(x / 2**m.bits, y / 2**m.bits) for x, y in m.corners]
            k, part = rng.randrange(len(corners)), rng.choice((0.0, 0.0, 0.5, rng.random()))
            p, q = corners[k], corners[(k + 1) % len(corners)]
            self.elapsed = 0
            self.two = tuple(o + a + part * (b - a) for o, a, b in zip(self.one, p, q, strict=True))
            if sum(shape.radius for shape in self.shapes) and rng.random() < 0.7:
                far = float(sum(shape.radius for shape in self.shapes))
                turn = rng.choice((rng.uniform(0.0, 6.3), 0.5 * math.pi * rng.randrange(4)))
                self.two = self.two[0] + far * math.cos(turn), self.two[1] + far * math.sin(turn)
            if rng.random() < 0.5:  # nearly, and along a face
                flush = rng.choice((1e-16, 1e-13, 3e-12, 1e-10))
                self.two = tuple(x + rng.uniform(-flush, flush) for x in self.two)
                speed = rng.choice((-1.0, 1.0, 0.25, 1e-3))
                self.v2 = tuple(v + speed * (b - a) for v, a, b in zip(self.v, p, q, strict=True))
                back = rng.choice((0.0, 0.5, 2.0))
                self.two = tuple(
                    x - back * (w - v) for x, v, w in zip(self.two, self.v, self.v2, strict=True)
                )
        if hard:
            faster = 2.0 ** rng.choice((0, rng.randint(-40, 40)))
            self.elapsed = int(self.elapsed / max(faster, 1.0))
            self.v, self.v2 = (tuple(faster * v for v in each) for each in (self.v, self.v2))
            self.v2 = self.v if rng.random() < 0.05 else self.v2
            if rng.random() < 0.3:  # they creep: by about the strip in all ticks of the question
                turn, speed = rng.uniform(0.0, 6.3), 2.0 ** (rng.randint(-6, 6) - 101) / self.tick
                self.elapsed, self.v = 0, (0.0, 0.0)
                self.v2 = speed * math.cos(turn), rng.choice((0.0, 1.0)) * speed * math.sin(turn)
        self.periods = self.turns = 0.0, 0.0
        if rng.random() < 0.4:
            self.periods = tuple(rng.choice((0.0, 5.0 + abs(number(3.0)))) for _ in range(2))
            self.turns = tuple(float(rng.randint(-3, 3)) if period else 0.0 for period in self.periods)
            away = zip(self.two, self.turns, self.periods, strict=True)
            self.two = tuple(place - turns * period for place, turns, period in away)

    def ticks_of_kernel(self) -> list[int]:
        """Returns the ticks of contact and of parting, by the kernel."""
        numbers = np.array(difference_row(*((shape.core, shape.radius) for shape in self.shapes)))
        path = (*self.one, *self.v, self.elapsed, *self.two, *self.v2, self.tick, 1.0 / self.tick)
        path += (*self.turns, *self.periods)
        return [*map(int, ask(numbers, *map(float, path[:4]), path[4], *map(float, path[5:])))]

    def ticks_by_the_rules(self) -> list[int]:
        """Returns the answers of rules 5s and 11s, in ticks after the later anchor."""
        frame = Frame(self.periods, 1 - math.frexp(self.tick)[1] - UNIT_BITS, self.periods)
        plans = (
            FlightPlan(*place, *velocity, anchor, 0.0, frame)
            for place, velocity, anchor in ((self.one, self.v, 0), (self.two, self.v2, self.elapsed))
        )
        m, flight = Difference(*self.shapes), Separation(*plans, frame, tuple(map(int, self.turns)))
        found = touching_tick(m, flight), parting_tick(m, flight, self.elapsed)
        return [NEVER if tick is None else tick - self.elapsed for tick in found]
