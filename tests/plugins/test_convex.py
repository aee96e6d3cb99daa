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
import kinetile as kt
from by_the_rules import rows
from convex_questions import Question, drawn_shape
from inside import engine_of
from kinetile.errors import SceneError, ZenoError
from kinetile.kernel.loop.predictions import LEFT_OUT, MARGIN
from kinetile.kernel.tables import NEVER, NOBODY
from kinetile_accuracy.specification.arithmetic import FlightPlan, Frame, Separation, unit_bits
from kinetile_accuracy.specification.shapes import Difference, dot, less
from kinetile_accuracy.specification.touching import touching_tick
from kinetile_plugins.convex import bound_with, meet, soonest
from lanes import GENERAL, first


@pytest.mark.parametrize("block", first(1, range(100)))
def test_ticks_are_those_of_the_rules(block):
    rng, hits, partings = random.Random(block), 0, 0
    for _ in range(40 if block == 0 else 60):
        question = Question(rng, hard=block % 2 == 1)
        met, parted = question.ticks_by_the_rules()
        assert question.ticks_of_kernel() == [met, parted], vars(question)
        partings += 0 < parted < NEVER
        hits += met != NEVER
    assert min(hits, partings) > 6


@pytest.mark.parametrize("seed", first(2, range(80)))
def test_the_answer_is_that_of_rationals(seed):
    scene = (convex_scenes if seed % 3 else box_scenes).drawn(seed)
    most = 40 if seed > 1 else 20
    expected = by_the_rules.answer(scene, most, 20 << 52).contacts
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase, audit=1 if seed % 6 == 0 else None)
        try:
            sim.run(until=20 * scene.time_unit, max_contacts=most)
            assert rows(sim) == expected
        except ZenoError:
            assert rows(sim) == expected[: len(sim.contacts)]


def shifted(scene: kt.Scene, by: float) -> kt.Scene:
    """Returns the same bodies, each with its place as far from where it was as its shape is from that."""
    moved = [kt.Shape(tuple((x + by, y - by) for x, y in each.core), each.radius) for each in scene.shapes]
    place = scene.position - np.array([by, -by])
    return scene.replace(position=place, shapes=moved)


@pytest.mark.parametrize("seed", first(1, range(30)))
def test_shapes_need_not_be_around_their_places(seed):
    """The skin covers the rounding of places that are far outside the arena."""
    scene = shifted((convex_scenes if seed % 3 else box_scenes).drawn(seed), 2.0**30)
    found = []
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase, audit=1)
        with suppress(ZenoError):
            sim.run(until=20.0, max_contacts=40 if seed else 20)
        found.append(rows(sim))
    assert found == [found[0]] * len(GENERAL)


@pytest.mark.parametrize("seed", first(1, range(30)))
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


@pytest.mark.parametrize("seed", first(3, range(60)))
def test_bounds_are_never_late(seed):
    scene = convex_scenes.drawn(seed)
    sim, n, bounds = kt.Simulation(scene, "naive"), len(scene), []
    for contacts in (0, 2, 5):
        sim.run(until=10.0, max_contacts=contacts)
        k, now = engine_of(sim).k, int(engine_of(sim).k.clock[0].now)
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
    for _ in range(30):
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
    """Returns the loop's result for a bound (``predictions.not_before``)."""
    return int(max(ticks - MARGIN, 0.0)) if ticks < LEFT_OUT else NEVER


def overlaps(m: Difference, flight: Separation) -> bool:
    """Returns True if two bodies overlap at the later of their anchors."""
    bits = max(m.bits, flight.bits)
    m, d = m.finer(bits), tuple(x << (bits - flight.bits) for x in flight.ways[0])
    ways = [(face, less(d, face.start)) for face in m.faces]
    gaps = [(dot(face.normal, away), dot(face.way, away), dot(face.way, face.way)) for face, away in ways]
    over = any(g >= 0 and 0 <= u <= tt and g * g < m.radius**2 * tt for g, u, tt in gaps)
    beside = any(dot(away, away) < m.radius**2 for away in (less(d, corner) for corner in m.corners))
    return over or beside or (len(gaps) > 2 and all(g < 0 for g, _, _ in gaps))


@pytest.mark.parametrize("seed", first(2, range(40)))
def test_a_cast_shape_meets_what_rationals_say(seed):
    rng = random.Random(seed)
    shaped = rng.random() < 0.7
    scene = convex_scenes.drawn(seed) if shaped else kt.make_scene("lattice", bodies=9, seed=seed)
    sim = kt.Simulation(scene, "naive")
    sim.run(until=5.0 * scene.time_unit, max_contacts=rng.randrange(4))
    k = engine_of(sim).k
    now, frame = int(k.clock[0].now), Frame(None, unit_bits(scene))
    discs = [kt.disc(radius) for radius in scene.radius.tolist()]
    shapes = [scene.shapes[each] for each in scene.shape.tolist()] if scene.shapes else discs
    for _ in range(6):
        shape = convex_scenes.scaled(drawn_shape(rng, rng.choice((4, 0))), 0.25)
        place = rng.randrange(24) / 4, rng.randrange(24) / 4
        velocity = rng.choice((-1.0, 0.0, 0.5, rng.gauss(0, 1))), rng.choice((-1.0, 0.25, rng.gauss(0, 1)))
        expected = []
        moving = FlightPlan(*place, *velocity, now, 0.0, frame)
        for body, (other, row) in enumerate(zip(shapes, k.bodies, strict=True)):
            plan = FlightPlan(*map(float, (row.x, row.y, row.vx, row.vy)), int(row.anchor), 0.0, frame)
            m, flight = Difference(other, shape), Separation(plan, moving)
            found = now if overlaps(m, flight) else touching_tick(m, flight)
            if found is not None:
                expected.append((found, body))
        hit = sim.cast((*place, shape), velocity)
        assert (hit and ((hit.epoch << 52) + hit.tick, hit.body)) == min(expected, default=None)


SCENES = Path(__file__).parents[1] / "scenes"
IMPACTS = {
    "ball-above-a-wide-box": [(Fraction(7.25) - Fraction(0.5166), 0, 1)],
    "ball-and-an-upright-segment": [(0.5, 0, 1)],
    "ball-slides-along-a-floor": 1,
    "boxes-of-other-heights": [(4, 2, 3), (8, 0, 1)],
    "boxes-pass-corner-to-corner": 0,
    "corner-meets-a-ball": 1,
    "impacts-without-an-overlap": 3,
    "touching-at-the-start": [(0, 0, 1), (0, 8, 9), (0, 16, 17)],
}
"""Times of impact that other engines had wrong, and contacts, or how many there are."""


@pytest.mark.parametrize(
    "path", [*SCENES.glob("convex/*.toml"), *SCENES.glob("impacts/*.toml")], ids=lambda p: p.stem
)
def test_what_broke_here_and_what_other_engines_had_wrong(path):
    """A quotient too large for a whole number, for boxes that hardly move apart; after a contact, the face
    that was met and comes nearer by less than a rounding of its rate; and ``IMPACTS``."""
    scene = kt.load_scene(path)
    q = Fraction(scene.time_unit) / 2**52
    until = scene.settings.until or 30.0 * scene.time_unit
    expected = by_the_rules.answer(scene, 40, int(Fraction(until) / q)).contacts
    wanted = IMPACTS.get(path.stem, len(expected))
    if isinstance(wanted, list):
        assert expected == [(math.floor(Fraction(time) / q), a, b) for time, a, b in wanted]
    else:
        assert len(expected) == wanted
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase)
        sim.run(until=until, max_contacts=40)
        assert rows(sim) == expected
