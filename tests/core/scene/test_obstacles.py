"""Obstacles: polylines, their place after the bodies, files and refusals."""

import math

import pytest

import kinetile as kt
from kinetile.errors import BadOption, SceneError
from kinetile.scene.files import dumps_scene, loads_scene
from lanes import GENERAL

FILE = """
recipe = "grid"
parameters = {bodies = 4, seed = 1}

[[obstacles]]
points = [[0.5, 0.5], [0.51, 0.51]]
kind = "fence"
"""


def test_segments_of_a_polyline_join_exactly_on_a_lattice():
    points = [(0, 0), (4, 0), (5, 2.25), (3, 4), (0, 3)]
    for closed in (False, True):
        found = kt.polyline(points, closed=closed)
        ends = []
        for each in found:
            (x, y), (a, b) = each.position, each.shape.core[0]
            c, d = each.shape.core[1]
            ends.append(((x + a, y + b), (x + c, y + d)))
        round_about = [*points[1:], points[0]]
        assert ends == list(zip(points, round_about, strict=True))[: len(points) - (not closed)]


def test_a_closed_ring_is_an_outline_in_either_direction():
    """As Shapely has them, whose hulls are clockwise."""
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    for ring in ([*square, square[0]], [*square, square[0]][::-1]):
        assert kt.polygon(ring) in [kt.polygon(square[k:] + square[:k]) for k in range(4)]
        assert kt.polyline(ring, closed=True) == kt.polyline(ring)
    with pytest.raises(SceneError, match="clockwise"):
        kt.polygon(square[::-1])


@pytest.mark.small
def test_an_outline_is_cut_into_convex_parts():
    shapely = pytest.importorskip("shapely")
    corner = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)]
    hole = shapely.box(0.0, 0.0, 3.0, 3.0) - shapely.box(1.0, 1.0, 2.0, 2.0)
    for outline, area, parts in ((corner, 7.0, 2), (corner[::-1], 7.0, 2), (hole, 8.0, 4)):
        found = kt.convex_parts(outline, kind="shelf")
        cut = [shapely.Polygon(each.shape.core) for each in found]
        assert sum(each.area for each in cut) == shapely.union_all(cut).area == area
        assert (len(found), {each.kind for each in found}) == (parts, {"shelf"})
    disc = kt.Scene([(2.5, 2.5)], [(-1.0, -1.0)], 0.5, arena=(4.0, 4.0))
    sim = kt.Simulation(kt.with_obstacles(disc, kt.convex_parts(corner)), "naive")
    sim.run(max_contacts=2)
    assert sim.positions()[0] == pytest.approx([1.5, 1.5])
    many = [(math.cos(k * math.pi / 10), math.sin(k * math.pi / 10)) for k in range(20)]
    assert max(len(each.shape.core) for each in kt.convex_parts(many)) <= 8


@pytest.mark.parametrize(
    ("points", "error", "words"),
    [
        ([(0, 0), (1, 1)], SceneError, "points: found no area"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], SceneError, r"points: found Self-intersection\[0.5 0.5\]"),
        ([(0, 0), (1, 0), (math.nan, 1)], SceneError, r"points\[2\]: found"),
        (3, BadOption, "points is 3"),
    ],
)
def test_what_is_no_outline(points, error, words):
    pytest.importorskip("shapely")
    with pytest.raises(error, match=words):
        kt.convex_parts(points)


def test_obstacles_come_after_the_bodies_and_change_nothing_else():
    plain = kt.make_scene("lattice", bodies=9, seed=3)
    radii = plain.radius.tolist()
    far = [kt.Obstacle(kt.segment((0, 0), (0.25, 0)), (90.0 + k, 90.0)) for k in range(2)]
    scene = kt.with_obstacles(plain.replace(arena=None), far)
    assert len(scene) == 11
    assert (scene.position[:9] == plain.position).all()
    assert scene.radius[:9].tolist() == radii
    assert scene.kind == (0,) * 9 + ("obstacle",) * 2
    assert (scene.mass[9:] == math.inf).all()
    assert scene.shape[9] == scene.shape[10]
    assert kt.with_obstacles(plain, []) is plain
    declared = kt.with_obstacles(plain.replace(arena=None, kinds=(0, "other")), far)
    assert declared.kinds == (0, "other", "obstacle")


@pytest.mark.small
def test_overlapping_obstacles_are_one_room_under_every_phase(tmp_path):
    room = kt.polyline([(0, 0), (4, 0), (5, 2), (3, 4), (0, 3)], closed=True)
    cross = [kt.Obstacle(kt.box(*size), (2.0, 1.5), kind="cross") for size in ((1.0, 0.25), (0.25, 1.0))]
    balls = kt.Scene([(1, 1), (3.5, 2)], [(1, 0.5), (-1, 0.25)], radius=[0.2, 0.3])
    scene = kt.with_obstacles(balls, [*room, *cross])
    kt.save_scene(scene, tmp_path / "room.toml")
    assert kt.load_scene(tmp_path / "room.toml") == scene
    found = []
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase)
        sim.run(max_contacts=30)
        found.append(sim.fingerprint)
        assert (sim.velocities()[2:] == 0).all()
    assert len(set(found)) == 1


def test_a_body_that_overlaps_an_obstacle_is_refused():
    with pytest.raises(SceneError, match=r"bodies\[0\] and bodies\[1\]: found an overlap"):
        kt.with_obstacles(
            kt.Scene([(3, 0)], [(0, 0)], radius=0.25), [kt.Obstacle(kt.box(1.0, 1.0), (3.5, 0.0))]
        )


@pytest.mark.small
def test_a_paddle_flies_through_obstacles_and_pushes_bodies():
    paddle = kt.Obstacle(kt.box(0.25, 1.0), (0.5, 0.0), (1.0, 0.0), kind="paddle")
    fence = kt.polyline([(1.0, -4.0), (1.0, -0.25)])
    scene = kt.with_obstacles(kt.Scene([(3, 0)], [(0, 0)], radius=0.25), [paddle, *fence])
    sim = kt.Simulation(scene, "cells")
    sim.run(until=10.0)
    assert sim.contacts[["time", "a", "b"]].tolist() == [(2.125, 0, 1)]
    assert sim.velocities().tolist() == [[2.0, 0.0], [1.0, 0.0], [0.0, 0.0]]


def test_files_have_polylines_beside_recipes(tmp_path):
    (tmp_path / "fence.toml").write_text(FILE)
    assert kt.load_scene(tmp_path / "fence.toml").kind[-1] == "fence"


def test_commands_and_responses_of_a_file_did_not_reach_its_obstacles():
    text = """
        bodies = [{ position = [3, 0], radius = 0.25, kind = "ball" }]
        commands = [{ time = 1.0, turn = 1, velocity = [0, 1] }]
        responses = [{ between = ["ball", "obstacle"], response = "stop" }]
        obstacles = [{ points = [[0, 0], [1, 0]] }]
    """
    made = loads_scene(text)
    assert made.kinds == ("ball", "obstacle")
    assert made.commands == (kt.Turn(1, 1.0, (0.0, 1.0)),)
    assert loads_scene(dumps_scene(made)) == made


def test_a_file_has_obstacles_beside_bodies_of_which_one_has_an_acceleration():
    text = """
arena = [4.0, 4.0]
[[bodies]]
position = [1.0, 1.0]
radius = 0.25
acceleration = [0.0, -1.0]
[[bodies]]
position = [2.0, 1.0]
radius = 0.25
[[obstacles]]
points = [[0.5, 0.5], [3.0, 0.5]]
"""
    assert loads_scene(text).acceleration.tolist() == [[0.0, -1.0], [0.0, 0.0], [0.0, 0.0]]
    with pytest.raises(SceneError, match=r"bodies\[0\]\.acceleration: found \[0.0, nan\]"):
        loads_scene(text.replace("[0.0, -1.0]", "[0.0, nan]"))
