"""The answer on a torus, by rationals alone: rules 2p to 11p of docs/specification.md, written from them.

Slow and short: every pair, every image that can be reached before both plans are anchored anew. Discs of any
mass, elastic or passing through each other, and turns; axes that are not periodic have walls.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations

import kinetile as kt

BEAT = 1 << 53
WALLS = ((-1, -2), (-3, -4))


@dataclass
class Plan:
    """A flight plan: place, periods taken off it, velocity, anchor, and the last partner and image."""

    place: list[float]
    turns: list[int]
    velocity: list[float]
    anchor: int
    last: tuple[int, int, int] | None = None


def product_error(a: float, b: float) -> float:
    """Return a * b less its rounded product."""
    return float(Fraction(a) * Fraction(b) - Fraction(a * b))


def share(mass: float, other: float, speed: float) -> float:
    """Return the part of the exchange that a body of a mass takes (rule 9)."""
    both = mass + other
    part = both - mass
    low = (mass - (both - part)) + (other - part)
    f = 2 * other / both
    back = f * both
    rest = ((2 * other - back) - product_error(f, both) - low * f) / both
    taken = f * speed
    return taken + (product_error(f, speed) + rest * speed)


class Torus:
    """A run of a scene, event by event."""

    def __init__(self, scene: kt.Scene) -> None:
        self.scene = scene
        self.periods = scene.periods
        self.q = Fraction(scene.time_unit) / (1 << 52)
        self.radius, self.mass = scene.radius.tolist(), scene.mass.tolist()
        self.equal = len(set(self.mass)) <= 1
        self.plans = []
        for place, velocity in zip(scene.position.tolist(), scene.velocity.tolist(), strict=True):
            plan = Plan(list(place), [0, 0], list(velocity), 0)
            self.wrap(plan)
            self.plans.append(plan)
        self.contacts: list[tuple[int, int, int]] = []
        self.images: list[tuple[int, int]] = []
        self.now, self.beat = 0, BEAT
        self.turns = [(Fraction(turn.time) // self.q, turn.body, turn.velocity) for turn in scene.turns]
        self.passings: dict[tuple[int, int, int, int], int] = {}  # and when each has begun
        for a, b in combinations(range(len(self.plans)), 2):
            if self.passes(a, b):
                self.begin_at_start(a, b)

    def passes(self, a: int, b: int) -> bool:
        """Return whether two bodies pass through each other; rules name kinds, none "*" here."""
        pair = {self.scene.kind[a], self.scene.kind[b]}
        return any(set(kinds) == pair and said.name == "pass" for kinds, said in self.scene.responses)

    def begin_at_start(self, a: int, b: int) -> None:
        """Begin the passings of two bodies that overlap at the start (rule 11p)."""
        one, two = self.plans[a], self.plans[b]
        reach = (self.radius[a] + self.radius[b]) * (1 - 1e-12)
        for m in range(-8, 9) if self.periods[0] else (0,):
            for n in range(-8, 9) if self.periods[1] else (0,):
                dx, dy = self.between(one, two, (m, n))
                if dx * dx + dy * dy < reach * reach:
                    self.begin(0, a, b, m, n)

    def between(self, one: Plan, two: Plan, image: tuple[int, int]) -> list[float]:
        """Return the separation of two plans anchored at one tick, through an image (rule 9p)."""
        return [
            (two.place[axis] - one.place[axis])
            + float(number + two.turns[axis] - one.turns[axis]) * self.periods[axis]
            for axis, number in enumerate(image)
        ]

    def begin(self, tick: int, a: int, b: int, m: int, n: int) -> None:
        """Begin a passing."""
        self.passings[a, b, m, n] = tick
        self.contacts.append((tick, a, b))
        self.images.append((m, n))

    def wrap(self, plan: Plan) -> None:
        """Take periods off a place."""
        for axis, period in enumerate(self.periods):
            if period:
                before = plan.place[axis]
                plan.place[axis] = math.remainder(before, period)
                plan.turns[axis] += int((Fraction(before) - Fraction(plan.place[axis])) / Fraction(period))

    def anchor(self, plan: Plan, tick: int) -> None:
        """Anchor a plan at a tick."""
        d = float(tick - plan.anchor) * float(self.q)
        for axis in range(2):
            plan.place[axis] += plan.velocity[axis] * d
        plan.anchor = tick
        self.wrap(plan)

    def approach(self, a: int, b: int, image: tuple[int, int]) -> tuple[int, Fraction, Fraction, Fraction]:
        """Return the later anchor s and the rational numbers of Q there: Q(s), B(s) and the square of v."""
        one, two = self.plans[a], self.plans[b]
        s = max(one.anchor, two.anchor)
        d, v = [], []
        for axis in range(2):
            at = []
            for plan in (one, two):
                place = Fraction(plan.place[axis]) + plan.turns[axis] * Fraction(self.periods[axis])
                at.append(place + Fraction(plan.velocity[axis]) * (s - plan.anchor) * self.q)
            d.append(at[1] - at[0] + image[axis] * Fraction(self.periods[axis]))
            v.append((Fraction(two.velocity[axis]) - Fraction(one.velocity[axis])) * self.q)  # a tick
        reach = Fraction(self.radius[a]) + Fraction(self.radius[b])
        gap = d[0] ** 2 + d[1] ** 2 - reach**2
        return s, gap, d[0] * v[0] + d[1] * v[1], v[0] ** 2 + v[1] ** 2

    def tick_through(self, a: int, b: int, image: tuple[int, int]) -> int | None:
        """Return the tick of contact of two discs through an image (rule 5)."""
        s, gap, bend, square = self.approach(a, b, image)
        if bend >= 0:
            return None
        if gap <= 0:
            return s
        inside = bend**2 - square * gap
        if inside <= 0:
            return None
        unit = math.lcm(inside.denominator, bend.denominator, square.denominator)
        w, p, c = int(inside * unit**2), int(-bend * unit), int(square * unit)
        tick = (p - math.isqrt(w) - 1) // c  # the root is (p - sqrt w) / c, and this is not after its floor
        while (p - (tick + 1) * c) >= 0 and (p - (tick + 1) * c) ** 2 >= w:
            tick += 1
        return s + tick

    def part(self, a: int, b: int, m: int, n: int) -> int | None:
        """Return the tick at which a passing ends (rule 11)."""
        s, gap, bend, square = self.approach(a, b, (m, n))
        inside, tick = bend**2 - square * gap, s
        if gap > 0 and (bend >= 0 or inside <= 0):
            pass
        elif square == 0:
            return None
        else:  # the root is (sqrt w - p) / c
            unit = math.lcm(inside.denominator, bend.denominator, square.denominator)
            w, p, c = int(inside * unit**2), int(bend * unit), int(square * unit)
            delay = (math.isqrt(w) - p) // c
            tick = s + delay
            if delay >= 1 << 62:
                return None
        return max(tick, self.passings[a, b, m, n] + 1)

    def first(self, a: int, b: int) -> tuple[int, int, int] | None:
        """Return the first contact of two discs: the tick, and the image."""
        one, two = self.plans[a], self.plans[b]
        s = max(one.anchor, two.anchor)
        horizon = (1 << 54) + (1 << 53)
        ranges = []
        for axis, period in enumerate(self.periods):
            if not period:
                ranges.append(range(1))
                continue
            ends = []
            for tick in (s, s + horizon):
                at = [
                    plan.place[axis]
                    + plan.turns[axis] * period
                    + plan.velocity[axis] * float((tick - plan.anchor) * self.q)
                    for plan in (one, two)
                ]
                ends.append(at[1] - at[0])
            reach = self.radius[a] + self.radius[b]
            low = math.floor((-max(ends) - reach) / period) - 1
            high = math.ceil((-min(ends) + reach) / period) + 1
            ranges.append(range(low, high + 1))
        barred = one.last is not None and two.last is not None
        barred = barred and one.last[0] == b and two.last[0] == a
        passes = self.passes(a, b)
        found = None
        for m in ranges[0]:
            for n in ranges[1]:
                if (barred and one.last[1:] == (m, n)) or (a, b, m, n) in self.passings:
                    continue
                tick = self.tick_through(a, b, (m, n))
                if tick is not None and passes and tick < self.now:
                    continue
                if tick is not None and (found is None or (tick, m, n) < found):
                    found = (tick, m, n)
        return found

    def wall(self, a: int) -> tuple[int, int] | None:
        """Return the first contact of a disc with a wall (rule 6)."""
        plan, found = self.plans[a], None
        for axis, period in enumerate(self.periods):
            speed = plan.velocity[axis]
            if period or speed == 0:
                continue
            place, radius = Fraction(plan.place[axis]), Fraction(self.radius[a])
            gap = (place if speed < 0 else Fraction(self.scene.arena[axis]) - place) - radius
            delay = 0 if gap <= 0 else math.floor(gap / (abs(Fraction(speed)) * self.q))
            if found is None or plan.anchor + delay < found[0]:
                found = (plan.anchor + delay, WALLS[axis][speed > 0])
        return found

    def run(self, contacts: int, until: int) -> None:
        """Run up to a number of contacts, or up to and at a tick."""
        n = len(self.plans)
        while len(self.contacts) < contacts:
            events: list[tuple[int, ...]] = [(self.beat, 1, 0, 0, 0, 0)]
            if self.turns:
                events.append((int(self.turns[0][0]), 2, self.turns[0][1], 0, 0, 0))
            for a in range(n):
                wall = self.wall(a)
                if wall:
                    events.append((wall[0], 3, a, wall[1], 0, 0))
            for a, b in combinations(range(n), 2):
                met = self.first(a, b)
                if met:
                    events.append((met[0], 4, a, b, *met[1:]))
            for passing in self.passings:
                tick = self.part(*passing)
                if tick is not None:
                    events.append((tick, 5, *passing))
            if min(events)[0] > until:
                return
            self.happen(*min(events))

    def happen(self, tick: int, kind: int, a: int, b: int, m: int, n: int) -> None:
        """Run an event of a class (rule 8)."""
        self.now = tick
        one, two = self.plans[a], self.plans[max(b, 0)]
        if kind == 1:
            for plan in self.plans:
                if plan.anchor < tick - BEAT:
                    self.anchor(plan, tick)
                    plan.last = None
            self.beat += BEAT
        elif kind == 2:
            self.anchor(one, tick)
            one.velocity, one.last = list(self.turns.pop(0)[2]), None
        elif kind == 3:
            self.anchor(one, tick)
            axis = int(b < -2)
            one.velocity[axis] = -one.velocity[axis]
            one.last = None
            self.contacts.append((tick, a, b))
            self.images.append((0, 0))
        elif kind == 4 and self.passes(a, b):
            self.begin(tick, a, b, m, n)
        elif kind == 4:
            self.anchor(one, tick)
            self.anchor(two, tick)
            self.exchange(one, two, a, b, *self.between(one, two, (m, n)))
            one.last, two.last = (b, m, n), (a, m, n)
            self.contacts.append((tick, a, b))
            self.images.append((m, n))
        else:
            del self.passings[a, b, m, n]
            self.contacts.append((tick, b, a))
            self.images.append((m, n))

    def exchange(self, one: Plan, two: Plan, a: int, b: int, dx: float, dy: float) -> None:
        """Exchange momentum (rule 9)."""
        length = math.sqrt(dx * dx + dy * dy)
        nx, ny = dx / length, dy / length
        ux, uy = two.velocity[0] - one.velocity[0], two.velocity[1] - one.velocity[1]
        xx, yy = nx * nx, ny * ny
        excess = ((xx - 0.5) + (yy - 0.5)) + (product_error(nx, nx) + product_error(ny, ny))
        px, py = ux * nx, uy * ny
        total = px + py
        part = total - px
        low = ((px - (total - part)) + (py - part)) + (product_error(ux, nx) + product_error(uy, ny))
        speed = total + (low - total * excess)
        ga = gb = speed
        if not self.equal:
            ga, gb = share(self.mass[a], self.mass[b], speed), share(self.mass[b], self.mass[a], speed)
        one.velocity = [one.velocity[0] + ga * nx, one.velocity[1] + ga * ny]
        two.velocity = [two.velocity[0] - gb * nx, two.velocity[1] - gb * ny]
