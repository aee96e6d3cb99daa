"""Convex bodies: exact ticks, and one answer, the same as by rationals."""

import math
import random
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import box_scenes
import by_the_rules
import convex_scenes
import convex_stages
import kinetile as kt
from by_the_rules import rows
from convex_questions import Question, drawn_shape
from kinetile.errors import SceneError, ZenoError
from kinetile.kernel.loop.predictions import FAR, MARGIN
from kinetile.kernel.tables import NEVER, NOBODY
from kinetile_accuracy.specification.shapes import Difference, entry
from kinetile_plugins.convex import bound_with, meet, soonest
from lanes import GENERAL, first


@pytest.mark.parametrize("block", first(1, range(100)))
def test_ticks_are_those_of_rationals(block):
    rng, hits, partings = random.Random(block), 0, 0
    for _ in range(60):
        question = Question(rng, hard=block % 2 == 1)
        parting = question.tick_by_rationals(parting=True)
        assert question.tick_of_kernel(parting=True) == parting, vars(question)
        partings += 0 < parting < NEVER
        expected = question.tick_by_rationals()
        assert question.tick_of_kernel() == expected, vars(question)
        hits += expected != NEVER
    assert hits > 12
    assert partings > 12


@pytest.mark.parametrize("seed", first(3, range(80)))
def test_the_answer_is_that_of_rationals(seed):
    scene = (convex_scenes if seed % 3 else box_scenes).drawn(seed)
    expected = by_the_rules.answer(scene, 40, 20 << 52).contacts
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase, audit=1 if seed % 6 == 0 else None)
        try:
            sim.run(until=20 * scene.time_unit, max_contacts=40)
            assert rows(sim) == expected
        except ZenoError:
            assert rows(sim) == expected[: len(sim.contacts)]


def shifted(scene: kt.Scene, by: float) -> kt.Scene:
    """Return the same bodies, each with its place as far from where it was as its shape is from that."""
    moved = [kt.Shape(tuple((x + by, y - by) for x, y in each.core), each.radius) for each in scene.shapes]
    place = scene.position - np.array([by, -by])
    return scene.replace(position=place, shapes=moved)


@pytest.mark.parametrize("seed", first(2, range(30)))
def test_shapes_need_not_be_around_their_places(seed):
    """The skin covers the rounding of places that are far outside the arena."""
    scene = shifted((convex_scenes if seed % 3 else box_scenes).drawn(seed), 2.0**30)
    found = []
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase, audit=1)
        with suppress(ZenoError):
            sim.run(until=20.0, max_contacts=40)
        found.append(rows(sim))
    assert found == [found[0]] * len(GENERAL)


@pytest.mark.parametrize("seed", first(2, range(30)))
def test_candidate_pairs_of_sap_2d_are_the_boxes_that_overlap(seed):
    """The boxes around two shapes, each with its skin, and not the circles."""
    scene = (convex_scenes if seed % 2 else box_scenes).drawn(seed, (8,))
    scene = shifted(scene, 0.25) if seed % 4 > 1 else scene
    left, right, down, up = np.array([scene.shapes[each].reaches for each in scene.shape]).T
    sim = kt.Simulation(scene, "sap-2d", audit=1)
    for moment in range(1, 8):
        with suppress(ZenoError):  # one of the drawn scenes is jammed from the start
            sim.run(until=0.4 * moment)
        skin, (x, y) = sim.explain()["numbers"]["skin"], sim.positions().T
        held = np.zeros((len(scene), len(scene)), dtype=bool)
        held[tuple(sim.candidate_pairs().T)] = True
        gap = np.maximum((x - left) - (x + right)[:, None], (y - down) - (y + up)[:, None])
        gap = np.triu(np.maximum(gap, gap.T) - 2.0 * skin, 1)
        assert (held[gap < -0.25 * skin]).all()
        assert not held[gap >= 0.25 * skin].any()
        assert not np.tril(held).any()


@pytest.mark.parametrize("seed", first(6, range(60)))
def test_bounds_are_never_late(seed):
    scene = convex_scenes.drawn(seed)
    sim, n, bounds = kt.Simulation(scene, "naive"), len(scene), []
    for contacts in (0, 2, 5):
        sim.run(until=10.0, max_contacts=contacts)
        k, now = sim._engine.k, int(sim._engine.k.clock[0].now)
        k.near[:n] = range(n)
        for body in range(n):
            soon, rest, who = soonest(k, body, n, NOBODY, now)
            for other in set(range(n)) - {body}:
                bound = min(
                    now + not_before_tick((soon if other == who else rest) * k.clock[0].per_time), NEVER
                )
                tick = meet(k, min(body, other), max(body, other))
                assert bound <= max(tick, now)
                bounds.append(tick - bound)
    assert n == 2 or min(bounds) < 1 << 45  # some are close


def test_of_two_sides_in_one_line_the_corner_between_them_was_awaited():
    """The difference of parallel capsules has such sides, and the bound was late."""
    random = np.random.default_rng(5)
    for _ in range(80):
        core = random.integers(-4, 5, (2, 2)) / 7.0
        if (core[0] == core[1]).all():
            continue
        shapes = [kt.capsule(*(by * core).tolist(), by / 5.0) for by in (1.0, 1.0 / 17.0)]
        place = random.uniform(-3.0, 3.0, 2)
        velocity = random.uniform(-0.5, 0.5, 2) - place
        with suppress(SceneError):  # they overlap
            scene = kt.Scene([[0.0, 0.0], place], [[0.0, 0.0], velocity], shape=[0, 1], shapes=shapes)
            k = kt.Simulation(scene, "naive").tables
            bound = bound_with(k, 0, 1, 0, float(k.clock[0].limits.fat), False)
            assert not_before_tick(bound * k.clock[0].per_time) <= meet(k, 0, 1)


def not_before_tick(ticks: float) -> float:
    """Return what the loop makes of a bound (``predictions.not_before``)."""
    return int(max(ticks - MARGIN, 0.0)) if ticks < FAR else NEVER


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


@pytest.mark.compiled
@pytest.mark.parametrize("count", [500, pytest.param(100_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kinds", convex_stages.PAIRS, ids=" ".join)
def test_all_stages_and_whole_numbers_alone_give_one_tick(kinds, count):
    contacts, wrong = convex_stages.disagreements(kinds, count, 1)
    assert contacts > count // 20
    assert wrong == 0


@pytest.mark.parametrize("seed", first(4, range(40)))
def test_a_cast_shape_meets_what_rationals_say(seed):
    rng = random.Random(seed)
    shaped = rng.random() < 0.7
    scene = convex_scenes.drawn(seed) if shaped else kt.make_scene("lattice", bodies=9, seed=seed)
    sim = kt.Simulation(scene, "naive")
    sim.run(until=5.0 * scene.time_unit, max_contacts=rng.randrange(4))
    k = sim._engine.k
    now, tick = int(k.clock[0].now), float(k.clock[0].tick)
    discs = [kt.disc(radius) for radius in scene.radius.tolist()]
    shapes = [scene.shapes[each] for each in scene.shape.tolist()] if scene.shapes else discs
    for _ in range(6):
        shape = convex_scenes.scaled(drawn_shape(rng, rng.choice((4, 0))), 0.25)
        place = rng.randrange(24) / 4, rng.randrange(24) / 4
        velocity = rng.choice((-1.0, 0.0, 0.5, rng.gauss(0, 1))), rng.choice((-1.0, 0.25, rng.gauss(0, 1)))
        expected = []
        for body, (other, row) in enumerate(zip(shapes, k.bodies, strict=True)):
            flown = (now - int(row.anchor)) * Fraction(tick)
            plan = ((row.x, row.vx), (row.y, row.vy))
            there = [Fraction(float(at)) + Fraction(float(v)) * flown for at, v in plan]
            d = tuple(Fraction(a) - b for a, b in zip(place, there, strict=True))
            v = tuple(
                Fraction(tick) * (Fraction(w) - Fraction(float(u)))
                for w, (_, u) in zip(velocity, plan, strict=True)
            )
            found = entry(Difference(other, shape), d, v)
            if found is not None:
                expected.append((now + found.tick, body))
        hit = sim.cast((*place, shape), velocity)
        assert (hit and ((hit.epoch << 52) + hit.tick, hit.body)) == min(expected, default=None)


@pytest.mark.parametrize(
    "path", sorted(Path(__file__).parents[1].glob("scenes/convex/*.toml")), ids=lambda p: p.stem
)
def test_what_broke(path):
    """A quotient too large for a whole number, for boxes that hardly move apart; and, after a contact, the
    face that was met and comes nearer by less than a rounding of its rate."""
    scene = kt.load_scene(path)
    expected = by_the_rules.answer(scene, 40, 30 << 52).contacts
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase)
        sim.run(max_contacts=40)
        assert rows(sim) == expected
