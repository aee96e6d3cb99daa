"""Scenes of convex bodies: the small scenes, with other shapes, as wide as the discs, in their places, among
obstacles or not: boxes touch, or slide along each other with a gap of 0, and capsules lie end to end."""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from kinetile import Response, Scene, Settings, Shape, box, capsule, disc, polygon, segment
from kinetile_conformance.strategies.kinds import ABSENT, Rules, of_kinds, with_kinds
from kinetile_conformance.strategies.small import MOST, body_in_cell, scene_of, scenes, several
from kinetile_conformance.strategies.strategy import drawn, numbered
from kinetile_conformance.strategies.swarms import anyhow, slots, square

CAPSULE = capsule((-0.5, 0.0), (0.5, 0.0), 0.5)
UPRIGHT = capsule((0.0, -0.5), (0.0, 0.5), 0.5)
SQUARE = box(2.0, 2.0)

SHAPES = (
    CAPSULE,
    SQUARE,
    disc(1.0),
    box(2.0, 0.5),
    capsule((0.0, -0.75), (0.25, 0.75), 0.25),
    polygon([(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)]),
    polygon([(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)]),
    polygon([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.25)], radius=0.5),
)
"""Shapes as wide as a disc of radius 1, or less."""


def scaled(shape: Shape, by: float) -> Shape:
    """Returns a shape that is larger by a factor."""
    return Shape(tuple((x * by, y * by) for x, y in shape.core), shape.radius * by)


@st.composite
def _shaped(
    draw: st.DrawFn,
    scene: Scene,
    shapes: Sequence[Shape],
    obstacles: Sequence[tuple[float, float, Shape]] = (),
) -> Scene:
    """Returns a scene whose bodies have these shapes, body 0 the first; obstacles are numbered after them.
    Without obstacles, body 1 is immovable, and mostly at rest."""
    chosen = [shapes[0], *(draw(st.sampled_from(shapes)) for _ in range(len(scene) - 1))]
    of_each = [scaled(shape, float(r)) for shape, r in zip(chosen, scene.radius, strict=True)]
    of_each += [shape for _, _, shape in obstacles]
    table = list(dict.fromkeys(of_each))
    velocity, mass = scene.velocity.copy(), scene.mass.copy()
    if not obstacles:
        mass[1] = math.inf
        velocity[1] *= draw(st.sampled_from([0.0, 0.0, 1.0]))
    added = len(obstacles)
    place = [*scene.position.tolist(), *((x, y) for x, y, _ in obstacles)]
    flies, heavy = [*velocity.tolist(), *[(0.0, 0.0)] * added], [*mass.tolist(), *[math.inf] * added]
    of_body = {"shape": [table.index(shape) for shape in of_each], "kind": [0] * len(of_each)}
    return scene.replace(position=place, velocity=flies, mass=heavy, shapes=table, **of_body)


@st.composite
def _among_bricks(draw: st.DrawFn, shapes: Sequence[Shape]) -> Scene:
    """Bodies below a wall of bricks that touch: each row is shifted by half a brick."""
    brick = scaled(draw(st.sampled_from([shape for shape in shapes if shape.kind == "box"])), 0.5)
    _, _, down, up = brick.reaches
    rows = [draw(st.integers(1, 4)) for _ in range(2)]
    wall = [
        (0.5 + column + 0.5 * row, 2.0 + down + row * (down + up), brick)
        for row, count in enumerate(rows)
        for column in range(min(count, 4 - row))
    ]
    bodies = draw(several(body_in_cell(4, 2, True), MOST - 1))
    return draw(_shaped(scene_of(bodies, (4.0, 4.0), 8.0), shapes, wall))


@st.composite
def _at_a_grating(draw: st.DrawFn, shapes: Sequence[Shape]) -> Scene:
    """Bodies on both sides of segments: bars with narrow gaps, or a floor of pieces end to end."""
    upright = draw(st.booleans())
    places = draw(st.lists(st.integers(0, 7), min_size=1, max_size=6, unique=True))
    piece = segment((0.0, -0.5), (0.0, 0.5)) if upright else segment((-0.25, 0.0), (0.25, 0.0))
    bars = [((place if upright else place + 0.5) / 2.0, 1.5, piece) for place in places]
    bodies = draw(several(body_in_cell(4, 2, True), MOST - 1))
    for body in bodies:
        x, y = body["position"]
        body["position"] = x, y + (1.0 if y > 1.0 else 0.0)
    return draw(_shaped(scene_of(bodies, (4.0, 3.0) if draw(st.booleans()) else None, 8.0), shapes, bars))


def _scenes_of(shapes: Sequence[Shape]) -> list[st.SearchStrategy[Scene]]:
    plain = scenes().flatmap(lambda scene: _shaped(scene, shapes))
    return [plain, plain, _among_bricks(shapes)]


def of_all_shapes() -> st.SearchStrategy[Scene]:
    """Returns scenes with a movable capsule and an immovable body each, so that they share one loop:
    ``convex`` and the kernel have other forms if all bodies are upright boxes, or movable."""
    return st.one_of(*_scenes_of(SHAPES), _at_a_grating(SHAPES))


MANY = 40
LISTED, FIRST = 34, 6
"""Different shapes of all such swarms: differences take long; and the number of shapes for body 0."""


@cache
def _listed() -> tuple[Shape, ...]:
    """Returns ``FIRST`` capsules, and shapes of many sizes and proportions, most off their positions."""
    random = np.random.default_rng(0)
    table = [CAPSULE, UPRIGHT] * (FIRST // 2)
    while len(table) < LISTED:
        shape = (*SHAPES, box(2.0, 0.1))[len(table) % (len(SHAPES) + 1)]
        aside = (random.integers(-4, 5, 2) / 4.0 * (random.random() < 0.6)).tolist()
        core = [(x + aside[0], y + aside[1]) for x, y in shape.core]
        turned = 1 if random.random() < 0.5 else -1
        table.append(Shape(tuple(place[::turned] for place in core[::turned]), shape.radius))
    large = [*np.repeat([1.0, 0.5, 0.05], 2), *random.choice([1.0, 1.0, 0.5, 0.05], LISTED - FIRST)]
    return tuple(scaled(each, 0.45 * by / each.reach) for each, by in zip(table, large, strict=True))


def shape_swarm(number: int, periodic: str = "") -> Scene:
    """Returns up to forty bodies of a few shapes or of many; some are immovable, some pass."""
    random = np.random.default_rng(number)
    bodies = int(random.integers(8, MANY + 1))
    side = square(bodies, 1.3)
    others = random.permutation(np.arange(FIRST, LISTED))[: 20 if number & 16 else 6]
    # Body 0 has a capsule: so all scenes have one form of ``convex``.
    table = list(dict.fromkeys(_listed()[at] for at in (random.integers(FIRST), *others)))
    chosen = random.integers(0, len(table), bodies)
    chosen[0] = 0
    velocity = anyhow(random, bodies) if number & 1 else random.integers(-4, 5, (bodies, 2)) / 2.0
    obstacles = np.arange(1, bodies)[: bodies // 4]
    velocity[obstacles] = 0.0
    mass = np.ones(bodies)
    mass[obstacles] = math.inf
    return Scene(
        slots(random, bodies, side, side),
        velocity,
        shape=chosen,
        shapes=table,
        arena=(float(side), float(side)),
        periodic=periodic,
        settings=Settings(until=20.0),
        **of_kinds(random.choice(2, bodies, p=[0.8, 0.2]).tolist(), mass, random),
    )


def shape_torus(number: int) -> Scene:
    """Returns such a swarm on periodic axes."""
    return shape_swarm(number, ("xy", "x", "y")[number % 3])


def falling_shapes(number: int) -> Scene:
    """Returns such a swarm that falls, along one axis in three of four."""
    gravity = ((0.0, -0.5), (0.5, 0.0), (0.0, 0.125), (-0.25, -0.25))[number % 4]
    return shape_swarm(number).replace(gravity=gravity)


SUPPORTS = box(1.5, 0.25), box(1.5, 0.25), disc(0.5), disc(0.125)
MOVABLE = scaled(CAPSULE, 0.25), box(0.5, 0.5), disc(0.25), disc(0.25)


def pressed(number: int) -> Scene:
    """Returns three stacks that touch, or nearly, on supports; some supports move, and bodies that cannot
    rest there hop."""
    random = np.random.default_rng(number)
    stacks = random.integers(4, size=(3, 3))  # supports, and two layers, with one shape each
    shapes = [(MOVABLE if layer else SUPPORTS)[at] for layer in range(3) for at in stacks[layer]]
    high = np.array([each.reaches[2:] for each in shapes]).reshape(3, 3, 2)
    gaps = random.choice([0.0, 2.0**-6, 0.25], (3, 3))
    y = 1.0 + (high.sum(axis=2) + gaps).cumsum(axis=0) - high[:, :, 1] - gaps
    x = 1.5 + 2.5 * np.arange(3) + random.choice([0.0, 0.0, 2.0**-5, -0.125], (3, 3))
    velocity = random.uniform(-0.25, 0.25, (9, 2)) * random.integers(0, 2, (9, 1))
    velocity[:3] = random.choice([0.0, 0.0, 0.5, -0.25], (3, 2)) * [1.0, 0.25]
    shapes[-1] = MOVABLE[0]  # as body 0, and no larger than the others
    table = list(dict.fromkeys(shapes))
    return Scene(
        np.column_stack([x.ravel(), y.ravel()])[::-1],
        velocity[::-1],
        mass=[*random.choice([1.0, 3.0], 6), *[math.inf] * 3],
        shape=[table.index(each) for each in shapes[::-1]],
        shapes=table,
        arena=(8.0, 6.0),
        gravity=(float(random.choice([0.0, 0.125])), -1.0),
        settings=Settings(until=4.0),
    )


def pressed_with_responses(number: int) -> Scene:
    """Returns such a scene, every other with a response, all with the loop for resting bodies."""
    how: dict[str, Any] = {
        "e": (0.0, 0.05, 0.5, 0.9)[number // 2 % 4],
        "contact_time": (2.0**-6, 1e-3)[number // 8 % 2],
    }
    how |= {"settle": (0.05, 0.5)[number // 16 % 2]} if number % 3 else {}
    how |= ({}, {"grip": 0.5}, {}, {"grip": 1.0, "surface": (0.25, 0.0)})[number // 5 % 4]
    rules: Rules = {ABSENT: Response("restitution", e=0.5, contact_time=1e-3, settle=0.5)}
    rules |= Response("restitution", **how).for_all if number & 1 else {}
    scene = pressed(number)
    return scene.replace(kinds=("ball", *ABSENT), kind=["ball"] * len(scene), responses=rules)


DRAWS = {
    "falling shapes": numbered(falling_shapes),
    "pressed scenes": numbered(pressed),
    "pressed scenes with responses": numbered(pressed_with_responses),
    "shapes": drawn(lambda: of_all_shapes().map(with_kinds)),
    "shapes, and squares alone": drawn(lambda: st.one_of(of_all_shapes(), *_scenes_of((SQUARE,)))),
    "swarms of shapes": numbered(shape_swarm),
    "swarms of shapes on a torus": numbered(shape_torus),
}
