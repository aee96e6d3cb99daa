"""Upright boxes, and discs among them: exact ticks, and one answer, the same as by rationals."""

from __future__ import annotations

import math
import random
from fractions import Fraction

import pytest

import box_reference
import box_scenes
import kinetile as kt
from kinetile.errors import Refused, ZenoError
from kinetile.kernel.certificates.boxes import boxes_touch, disc_touches_box
from kinetile.kernel.loop.predictions import FAR, MARGIN
from kinetile.kernel.tables import NEVER, NOBODY
from kinetile.toolbox import hook
from kinetile_accuracy.specification.shapes import Difference, entry
from kinetile_plugins.box import MEET, soonest
from lanes import first

PHASES = ("naive", "cells", "sap-1d", "sap-2d")


def rows(sim: kt.Simulation) -> list[tuple[int, int, int]]:
    return [((int(c["epoch"]) << 52) + int(c["tick"]), int(c["a"]), int(c["b"])) for c in sim.contacts]


@hook
def ask_boxes(*numbers):
    return boxes_touch(*numbers)


@hook
def ask_disc(*numbers):
    return disc_touches_box(*numbers)


class Question:
    """Two paths, of two boxes or of a disc and a box: on a lattice, most of them, with many ties."""

    def __init__(self, rng: random.Random) -> None:
        lattice = rng.choice((1, 2, 16, 1 << 20, 0, 0))

        def number(size: float) -> float:
            return (
                rng.randint(-int(size * lattice), int(size * lattice)) / lattice
                if lattice
                else (rng.uniform(-size, size))
            )

        def half() -> float:
            return rng.randint(1, 2 * lattice) / lattice if lattice else rng.uniform(0.1, 2.0)

        self.tick = rng.choice((2.0**-52, 2.0**-30, 2.0**-10, 2.0**-3))
        self.elapsed = rng.choice((0, 0, rng.randrange(20), rng.randrange(int(4 / self.tick))))
        self.one, self.two = (number(4.0), number(4.0)), (number(4.0), number(4.0))
        self.v, self.v2 = (number(1.0), number(1.0)), (number(1.0), number(1.0))
        axis = rng.randrange(6)  # so that some slide
        self.v = tuple(self.v2[i] if i == axis else self.v[i] for i in range(2))
        boxes = rng.random() < 0.5
        self.halves = [half() for _ in range(4)]
        wide, wide2, high, high2 = self.halves
        if not boxes:
            self.halves[1] = self.halves[3] = 0.0
        if rng.random() < 0.3:  # they touch, or overlap a little
            side = wide + wide2 * rng.choice((1.0, 1.0, 0.6))
            up = rng.choice((high + high2, high + 0.8 * high2, high / 2))
            self.two, self.elapsed = (self.one[0] + side, self.one[1] + up), 0
        self.radius = 0.0 if boxes else wide2
        self.shapes = kt.box(2 * wide, 2 * high), kt.box(2 * wide2, 2 * high2) if boxes else kt.disc(wide2)

    def tick_of_touch(self) -> int:
        """Return the answer of the kernel."""
        paths = (*self.one, *self.v, self.elapsed, *self.two, *self.v2)
        if self.radius == 0.0:
            return int(ask_boxes(*paths, *self.halves, self.tick, 1.0 / self.tick))
        wide, _, high, _ = self.halves
        return int(ask_disc(*paths, wide, high, self.radius, self.tick, 1.0 / self.tick))

    def tick_by_rationals(self) -> int:
        """Return the answer of rule 5s."""
        q = Fraction(self.tick)
        there = [Fraction(x) + Fraction(v) * self.elapsed * q for x, v in zip(self.one, self.v, strict=True)]
        d = tuple(Fraction(at) - place for at, place in zip(self.two, there, strict=True))
        v = tuple((Fraction(w) - Fraction(v)) * q for v, w in zip(self.v, self.v2, strict=True))
        found = entry(Difference(*self.shapes), d, v)
        return NEVER if found is None else found.tick


@pytest.mark.parametrize("block", first(1, range(50)))
def test_ticks_are_those_of_rationals(block):
    rng, hits = random.Random(block), 0
    for _ in range(400):
        question = Question(rng)
        expected = question.tick_by_rationals()
        assert question.tick_of_touch() == expected, vars(question)
        hits += expected != NEVER
    assert hits > 40


@pytest.mark.small
@pytest.mark.parametrize("seed", first(6, range(600)))
def test_the_answer_is_that_of_rationals(seed):
    scene = box_scenes.drawn(seed)
    expected = box_reference.contacts_of(scene, 40, 20 << 52)
    for phase in PHASES:
        sim = kt.Simulation(scene, phase, audit=1 if seed % 6 == 0 else None)
        try:
            sim.run(until=20 * scene.time_unit, max_contacts=40)
            assert rows(sim) == expected
        except ZenoError:
            assert rows(sim) == expected[: len(sim.contacts)]


@pytest.mark.small
@pytest.mark.parametrize("seed", first(20, range(400)))
def test_bounds_are_never_late(seed):
    scene = box_scenes.drawn(seed)
    k = kt.Simulation(scene, "naive")._engine.k
    meet, n = MEET[True, True], len(scene)
    k.near[:n] = range(n)
    for body in range(n):
        soon, rest, who = soonest(k, body, n, NOBODY, NOBODY, 0)
        for other in set(range(n)) - {body}:
            bound = soon if other == who else rest
            tick = meet(k, min(body, other), max(body, other))
            assert not_before_tick(bound * k.clock[0].per_time) <= tick


def not_before_tick(ticks: float) -> float:
    """Return what the loop makes of a bound (``predictions.not_before``)."""
    return max(ticks - MARGIN, 0.0) if ticks < FAR else NEVER


def wall_of_bricks(**more) -> kt.Scene:
    """Return bricks that touch each other, none of which can move, and a disc in front of them."""
    places = [(0.5 + (row % 2) * 0.5 + column, 0.25 + 0.5 * row) for row in range(4) for column in range(5)]
    return kt.Scene(
        [*places, (2.75, 4.0)],
        [*[(0, 0)] * len(places), (0.25, -1.0)],
        mass=[*[math.inf] * len(places), 1.0],
        shape=[*[0] * len(places), 1],
        shapes=[kt.box(1.0, 0.5), kt.disc(0.25)],
        arena=(6.0, 5.0),
        **more,
    )


@pytest.mark.small
def test_a_disc_comes_back_from_bricks_that_touch():
    """It meets two of them at one tick where they touch, and its speed is kept."""
    for phase in PHASES:
        sim = kt.Simulation(wall_of_bricks(), phase, audit=1)
        sim.run(max_contacts=40)
        assert math.hypot(*sim.velocities()[20]) == pytest.approx(math.hypot(0.25, 1.0), rel=1e-14)
        assert sim.positions()[20, 1] > 2.0
        assert (sim.velocities()[:20] == 0).all()


@pytest.mark.small
def test_boxes_slide_along_each_other_without_a_contact():
    sliding = kt.Scene(
        [(1.0, 1.0), (3.0, 2.0)], [(1.0, 0.0), (-1.0, 0.0)], shape=kt.box(1.0, 1.0), arena=None
    )
    sim = kt.Simulation(sliding, "cells")
    sim.run(until=10.0)
    assert len(sim.contacts) == 0
    lower = sliding.replace(position=[(1.0, 1.0), (3.0, 2.0 - 2.0**-40)])
    sim = kt.Simulation(lower, "cells")
    sim.run(until=10.0)
    assert rows(sim) == [(1 << 51, 0, 1)]
    assert sim.velocities().tolist() == [[-1.0, 0.0], [1.0, 0.0]]  # one component alone, exactly


@pytest.mark.small
def test_a_run_of_boxes_is_saved_and_goes_on(tmp_path):
    scene = box_scenes.drawn(4, (8,))
    sim = kt.Simulation(scene, "cells")
    sim.run(max_contacts=10)
    sim.save(tmp_path / "boxes.kt")
    again = kt.resume(tmp_path / "boxes.kt")
    for each in (sim, again):
        each.run(max_contacts=20)
    assert again.fingerprint == sim.fingerprint
    kt.save_scene(scene, tmp_path / "boxes.toml")
    played = kt.Simulation(kt.load_scene(tmp_path / "boxes.toml"), "naive")
    played.run(max_contacts=len(sim.contacts))
    assert played.fingerprint == sim.fingerprint


@pytest.mark.small
def test_what_boxes_do_not_take_is_refused_by_name():
    capsules = kt.Scene([(1, 1)], [(0, 0)], shape=kt.capsule((0, 0), (1, 0), 0.25))
    with pytest.raises(Refused, match=r"another shape \(capsule\)"):
        kt.Simulation(capsules, "cells")
    bricks = wall_of_bricks()
    with pytest.raises(Refused, match="closer"):
        kt.Simulation(bricks, "sweep-tiling")
    with pytest.raises(Refused, match="takes discs alone"):
        kt.Simulation(bricks, "cells", narrow_phases=("disc", "wall"))
    with pytest.raises(Refused, match="choose disc"):
        kt.Simulation(kt.make_scene("two-discs"), "cells", narrow_phases=("box",))
    sim = kt.Simulation(bricks, "cells")
    with pytest.raises(Refused, match="knows discs alone"):
        sim.cast((1, 1, 0.5), (1, 0))
    assert sim.next_contact_of(20) is not None
