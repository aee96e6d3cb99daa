"""Rules of shapes: where a place is met, and left; faces, corners and sizes."""

import json
from pathlib import Path

import kinetile as kt
from kinetile_accuracy.specification import shapes as rules
from kinetile_accuracy.specification.arithmetic import FlightPlan, Frame, Separation
from kinetile_accuracy.specification.touching import parting_tick, touching_tick


def test_what_has_gone_by_is_not_met_again() -> None:
    m = rules.Difference(kt.capsule((0.0, 0.0), (8.0, 0.0), 0.5), kt.disc(0.5))
    frame, v = Frame(None, -52), (1 / 8, -1 / 64)  # a tick is 1

    def flight(x: float, y: float) -> Separation:
        plans = FlightPlan(0.0, 0.0, 0.0, 0.0, 0, 0.5, frame), FlightPlan(x, y, *v, 0, 0.5, frame)
        return Separation(*plans)

    over, left = flight(7.5, 1.0), flight(7.5 + 24 * v[0], 1.0 + 24 * v[1])
    assert touching_tick(m, over) == 0
    assert touching_tick(m, left) is None  # less than R above the line of the face
    assert parting_tick(m, left, 0) == 0
    assert parting_tick(m, over, 0) == 7


def test_faces_and_corners_have_numbers() -> None:
    m = rules.Difference(kt.box(1.0, 1.0), kt.polygon([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]))
    one = 1 << m.bits
    corners = [(x / one, y / one) for x, y in m.corners]
    assert corners == [(-1.5, -0.5), (-0.5, -1.5), (0.5, -1.5), (0.5, 0.5), (-1.5, 0.5)]
    assert [(x / one, y / one) for _, _, (x, y) in m.faces] == [(2, 0), (-1, 0), (-1, -1), (0, 2), (0, -1)]
    line = rules.Difference(kt.capsule((0, 0), (2, 0), 1.0), kt.capsule((1, 0), (0, 0), 0.5))
    one = 1 << line.bits
    assert line.corners == [(-one, 0), (2 * one, 0)], "parallel faces are one"
    assert [face.normal for face in line.faces] == [(0, 3 * one), (0, -3 * one)]
    assert line.radius == 1.5 * one
    assert rules.Difference(kt.disc(1.0), kt.disc(1.0)).faces == []


def test_sizes_are_those_of_the_vectors() -> None:
    path = Path(__file__).parents[3] / "vectors" / "shape_sizes.json"
    families = json.loads(path.read_text())["families"].values()
    for core, radius, size in (row for family in families for row in family):
        corners = [(float.fromhex(x), float.fromhex(y)) for x, y in core]
        assert kt.polygon(corners, float.fromhex(radius)).reach == float.fromhex(size)


def test_what_does_not_close_is_no_face_of_sharp_bodies() -> None:
    m = rules.Difference(kt.box(1.0, 1.0), kt.box(1.0, 1.0))
    assert rules.normal_and_face(m, (1.0 + 2.0**-52, 1.0), (1, -1))[0] == (0.0, 1.0)
    assert rules.normal_and_face(m, (1.0, 1.0), (-1, -1))[0] == (1.0, 0.0)
    assert rules.normal_and_face(m, (1.0, 1.0), (0, 0))[0] == (1.0, 0.0)
