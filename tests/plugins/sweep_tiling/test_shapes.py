"""Why sweep-tiling takes discs alone: contacts of boxes that have no tile, shown by plain geometry, and that
looking through narrow tiles does not find them (docs/sweep-tiling.md, Other shapes)."""

from __future__ import annotations

from itertools import pairwise

import pytest

import kinetile as kt
from kinetile.errors import Refused

Sides = tuple[float, float, float, float]  # left, right, bottom, top of a box
Pairs = set[tuple[int, int]]


def tiles(boxes: list[Sides], skin: float) -> dict[tuple[int, int], float]:
    """Return the pairs of boxes in sight of each other, fattened along x, with the width of the narrowest
    tile of each; boxes are in the order of their middles, as discs are in that of their centres."""
    found: dict[tuple[int, int], float] = {}
    began: dict[tuple[int, int], float] = {}
    lines = sorted({x for left, right, *_ in boxes for x in (left - skin, right + skin)})
    for line in lines:
        column = [body for body, (left, right, *_) in enumerate(boxes) if left - skin <= line < right + skin]
        column.sort(key=lambda body: sum(boxes[body][2:]))
        seen = {(min(pair), max(pair)) for pair in pairwise(column)}
        for pair in began.keys() - seen:
            width = line - began.pop(pair)
            found[pair] = min(found.get(pair, width), width)
        began |= {pair: began.get(pair, line) for pair in seen}
    return found


def named(boxes: list[Sides], skin: float, steps: int) -> Pairs:
    """Return the pairs in sight, and those of a box and all who are in sight of one that it reaches by so
    many steps through tiles narrower than four skins."""
    width = tiles(boxes, skin)
    sight = {body: {a + b - body for a, b in width if body in (a, b)} for body in range(len(boxes))}
    pairs = set(width)
    for body in sight:
        reached = {body}
        for _ in range(steps):
            reached |= {b for a in reached for b in sight[a] if width[min(a, b), max(a, b)] < 4.0 * skin}
        pairs |= {(min(body, b), max(body, b)) for a in reached for b in sight[a] if b != body}
    return pairs


def scene_of(boxes: list[Sides], velocity: list[tuple[float, float]]) -> kt.Scene:
    return kt.Scene(
        [((left + right) / 2.0, (bottom + top) / 2.0) for left, right, bottom, top in boxes],
        velocity,
        shape=range(len(boxes)),
        shapes=[kt.box(right - left, top - bottom) for left, right, bottom, top in boxes],
        arena=(10.0, 10.0),
    )


def first_contact(scene: kt.Scene) -> tuple[int, int]:
    sim = kt.Simulation(scene, "cells")
    sim.run(until=10.0, max_contacts=1)
    (contact,) = sim.contacts
    return int(contact["a"]), int(contact["b"])


def bricks(overlap: float, height: float) -> list[Sides]:
    """Return box 0 over box 1, which share an overlap along x; 2 is beside 1, and 3 beside 0."""
    return [
        (4.0, 5.0, 3.0 + height, 4.0 + height),
        (3.0 + overlap, 4.0 + overlap, 2.0, 3.0),
        (4.0 + overlap, 5.0 + overlap, 2.5, 2.875),
        (3.0, 4.0, 3.125, 3.5),
    ]


def column(away: float, steps: int) -> list[Sides]:
    """Return a tall box, 0; boxes one upon the other, each of which overlaps its right side by rounding, the
    highest deepest; and last one that slides along under them, so far away from the tall one."""
    beside = [
        (4.0 - (steps - at) * 2.0**-46, 5.0 - (steps - at) * 2.0**-46, 3.5 - at, 4.5 - at)
        for at in range(steps)
    ]
    return [(3.0, 4.0, 0.5, 9.5), *beside, (4.0 + away, 5.0 + away, 3.5 - steps, 4.5 - steps)]


def skin_of(scene: kt.Scene) -> float:
    return float(kt.Simulation(scene, "cells").explain()["numbers"]["skin"])


def test_four_bricks_of_which_two_touch_without_a_tile():
    falling = [(0.0, -1.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
    for overlap in (2.0**-43, 2.0**-42, 2.0**-40):
        scene = scene_of(bricks(overlap, 0.25), falling)
        skin = skin_of(scene)
        assert first_contact(scene) == (0, 1)
        touching = bricks(overlap, 0.0)
        assert (0, 1) in tiles(touching, 0.0)
        assert ((0, 1) in tiles(touching, skin)) == (overlap > 2.0 * skin)
        assert (0, 1) in named(touching, skin, 1)


@pytest.mark.parametrize("stacked", [2, 3])
def test_a_column_hides_who_slides_under_it_however_far_one_looks(stacked):
    """All that the tiling could go by is the same, from the start to the contact."""
    last = stacked + 1
    scene = scene_of(column(0.5, stacked), [*[(0.0, 0.0)] * last, (-1.0, 0.0)])
    skin = skin_of(scene)
    assert first_contact(scene) == (0, last)
    start = tiles(column(0.5, stacked), skin)
    for away in (0.25, 4.0 * skin, skin, 0.0):
        assert set(tiles(column(away, stacked), skin)) == set(start)
    assert (0, last) not in named(column(0.5, stacked), skin, last)


def test_shapes_are_refused_with_the_reason_and_who_takes_them():
    still = [(0.0, 0.0)] * 4
    with pytest.raises(Refused) as caught:
        kt.Simulation(scene_of(bricks(0.5, 0.25), still), "sweep-tiling")
    sentence = str(caught.value)
    assert sentence.startswith("sweep-tiling is for discs, and this scene has other shapes")
    assert "docs/sweep-tiling.md, Other shapes" in sentence
    for name in ("cells", "naive", "sap-1d", "sap-2d"):
        assert name in sentence
