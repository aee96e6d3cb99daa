"""Rules of shapes in rationals, against what they mean: where a place is, and how far from the difference."""

import json
from fractions import Fraction
from pathlib import Path

import kinetile as kt
from kinetile_accuracy.specification import shapes as rules


def test_what_has_gone_by_is_not_met_again() -> None:
    m = rules.Difference(kt.capsule((0.0, 0.0), (8.0, 0.0), 0.5), kt.disc(0.5))
    v = Fraction(1, 8), Fraction(-1, 64)
    over = (Fraction(15, 2), Fraction(1)), v
    assert rules.entry(m, *over) == rules.Contact(0, rules.Feature("face", 0))
    left = tuple(x + 24 * w for x, w in zip(*over, strict=True)), v  # less than R above the line of the face
    assert rules.entry(m, *left) is None
    assert rules.exit_(m, *left) == 0
    assert rules.exit_(m, *over) == 7


def test_faces_and_corners_have_numbers() -> None:
    m = rules.Difference(kt.box(1.0, 1.0), kt.polygon([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]))
    assert m.corners == [(-1.5, -0.5), (-0.5, -1.5), (0.5, -1.5), (0.5, 0.5), (-1.5, 0.5)]
    assert [face.normal for face in m.faces] == [(2, 0), (-1, 0), (-1, -1), (0, 2), (0, -1)]
    line = rules.Difference(kt.capsule((0, 0), (2, 0), 1.0), kt.capsule((1, 0), (0, 0), 0.5))
    assert line.corners == [(-1, 0), (2, 0)], "parallel faces are one"
    assert [face.normal for face in line.faces] == [(0, 3), (0, -3)]
    assert line.radius == 1.5
    assert rules.Difference(kt.disc(1.0), kt.disc(1.0)).faces == []


def test_sizes_are_those_of_the_vectors() -> None:
    path = Path(__file__).parents[3] / "vectors" / "shape_sizes.json"
    families = json.loads(path.read_text())["families"].values()
    for core, radius, size in (row for family in families for row in family):
        corners = [(float.fromhex(x), float.fromhex(y)) for x, y in core]
        assert kt.polygon(corners, float.fromhex(radius)).reach == float.fromhex(size)


def test_what_does_not_close_is_no_face_of_sharp_bodies() -> None:
    m = rules.Difference(kt.box(1.0, 1.0), kt.box(1.0, 1.0))
    assert rules.normal_and_face(m, (1.0 + 2.0**-52, 1.0), (1.0, -1.0))[0] == (0.0, 1.0)
    assert rules.normal_and_face(m, (1.0, 1.0), (-1.0, -1.0))[0] == (1.0, 0.0)
    assert rules.normal_and_face(m, (1.0, 1.0), (0.0, 0.0))[0] == (1.0, 0.0)
