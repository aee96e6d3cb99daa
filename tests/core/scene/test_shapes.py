"""Shapes in scenes: which are shapes, which scenes they make, and that nothing of them is lost."""

import copy
import math
import pickle
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import kinetile as kt
from kinetile.errors import Mistake, SceneError
from kinetile.scene.differences import core_difference, is_closer
from kinetile.scene.files import dumps_scene, loads_scene
from kinetile.scene.shapes import overlap
from kinetile.show.picture import picture_of_scene
from kinetile_conformance.strategies.changes import only_bodies

TRIANGLE = kt.polygon([(-0.5, -0.5), (0.5, -0.5), (0.0, 0.5)], 0.125)
SHAPES = (
    kt.box(1.0, 2.0),
    kt.capsule((-0.5, 0.0), (0.5, 0.25), 0.25),
    TRIANGLE,
    kt.disc(0.5),
    kt.segment((0.0, 0.0), (1.0, 1.0)),
    kt.polygon([(2.0, 3.0)], 0.1),
)
PLACES = [(1.0, 1.0), (3.0, 1.0), (5.0, 3.0), (2.0, 4.0)]
REST = np.zeros((4, 2))


def scene(**more: Any) -> kt.Scene:
    values: dict[str, Any] = {"shape": [0, 1, 2, 3], "shapes": SHAPES, "arena": (8.0, 8.0)}
    return kt.Scene(PLACES, REST, **(values | more))


numbers = st.floats(-4.0, 4.0).map(lambda x: x if abs(x) > 2.0**-40 else 0.0)
short = st.integers(-8, 8).map(lambda n: n / 4)


@st.composite
def shapes(draw: st.DrawFn, coordinates: st.SearchStrategy[float] = numbers) -> kt.Shape:
    places = draw(st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=7, unique=True))
    hull = core_difference(tuple(places), ((0.0, 0.0),))
    radius = draw(st.sampled_from([0.0, 0.25, 0.1, 3.0]))
    return kt.polygon([(float(x), float(y)) for x, y in hull], radius or 0.25 * (len(hull) == 1))


def test_a_corner_off_a_line_by_a_last_bit_is_a_corner() -> None:
    line = [(0.0, 0.0), (0.3, 0.1), (0.6, 0.2), (0.0, 1.0)]
    assert kt.polygon([*line[:1], (math.nextafter(0.3, 1.0), 0.1), *line[2:]]).kind == "polygon"


@given(shapes(), st.integers(0, 7), st.booleans())
def test_a_hull_is_a_shape_from_any_corner_on_and_no_other_order_is(
    shape: kt.Shape, by: int, mirrored: bool
) -> None:
    by %= len(shape.core)
    turned = kt.polygon(shape.core[by:] + shape.core[:by], shape.radius)
    assert turned.reach == shape.reach
    assert turned.reaches == shape.reaches
    if len(shape.core) > 2:
        with pytest.raises(SceneError, match="clockwise"):
            kt.polygon(shape.core[::-1])


@given(shapes())
def test_reach_is_the_smallest_double_that_holds_a_shape(shape: kt.Shape) -> None:
    farthest = max(Fraction(x) ** 2 + Fraction(y) ** 2 for x, y in shape.core)

    def holds(radius: float) -> bool:
        beyond = Fraction(radius) - Fraction(shape.radius)
        return beyond >= 0 and beyond**2 >= farthest

    assert holds(shape.reach)
    assert not holds(math.nextafter(shape.reach, 0.0))


def test_kinds_and_sizes() -> None:
    assert [shape.kind for shape in SHAPES] == ["box", "capsule", "polygon", "disc", "segment", "polygon"]
    assert kt.disc(0.3).reach == 0.3
    assert kt.capsule((0, 0), (3, 4), 1).reach == 6.0
    assert kt.box(1, 2).reaches == (0.5, 0.5, 1.0, 1.0)
    assert kt.polygon([(2.0, 3.0)], 0.5).reaches == (-1.5, 2.5, -2.5, 3.5)
    assert "do not rotate" in (kt.Shape.__doc__ or "").splitlines()[0]
    assert kt.polygon([(-0.0, 0.0)], 1.0) == kt.disc(1.0)
    with pytest.raises(AttributeError):
        kt.disc(1.0).radius = 2.0  # type: ignore[misc]


def test_a_scene_of_shapes() -> None:
    made = scene()
    assert made.shapes == SHAPES
    assert made.shape.tolist() == [0, 1, 2, 3]
    assert made.shape.dtype == np.int64
    assert made.radius.tolist() == [SHAPES[k].reach for k in range(4)]
    for array in (made.shape, made.radius):
        assert not array.flags.writeable
    assert scene(shape=1).shape.tolist() == [1] * 4
    assert scene(shape=kt.box(1, 1), shapes=()).shapes == (kt.box(1, 1),)
    assert scene(shape=np.array([0, 1, 2, 3], dtype=np.uint8)) == made


def test_a_scene_of_discs_is_the_ordinary_scene() -> None:
    plain = kt.Scene(PLACES, REST, 0.5, arena=(8.0, 8.0))
    assert plain.shapes == ()
    assert plain.shape.tolist() == [-1] * 4
    two = (kt.polygon([(0.0, 0.0)], 0.5), kt.disc(0.5))
    for made in (scene(shape=kt.disc(0.5), shapes=()), scene(shape=[0, 1, 0, 1], shapes=two)):
        assert made == plain
        assert made.shapes == ()
        assert hash(made) == hash(plain)
        assert dumps_scene(made) == dumps_scene(plain)
        assert pickle.dumps(made) == pickle.dumps(plain)
    assert kt.Scene([], [], shape=[], shapes=[kt.disc(1.0)]) == kt.Scene([], [], 1.0)


def test_shapes_that_no_body_has_yet_are_kept() -> None:
    listed, box = (kt.disc(0.5), kt.box(1.0, 1.0)), kt.box(0.5, 2.0)
    plain = kt.Scene(PLACES, REST, 0.5, arena=(8.0, 8.0))
    coming = [kt.Insert(1.0, (7.0, 7.0), (0.0, 0.0), shape=box), kt.Insert(2.0, (4.0, 7.0), (0.0, 0.0), 0.25)]
    among = kt.Scene(PLACES, REST, 0.5, arena=(8.0, 8.0), shapes=listed, commands=coming)
    assert among == scene(shape=0, shapes=listed, commands=coming)
    assert among == plain.replace(shapes=listed, commands=coming)
    assert among.shapes == (*listed, box, kt.disc(0.25))
    assert [each.shape for each in among.commands] == [box, kt.disc(0.25)]
    assert [each.radius for each in among.commands] == [box.reach, 0.25]
    by_number = coming[0]._replace(shape=1)
    assert among.replace(commands=[by_number]).commands[0].shape == kt.box(1.0, 1.0)
    assert loads_scene(dumps_scene(among)) == pickle.loads(pickle.dumps(among)) == among
    discs = [each._replace(shape=kt.disc(0.25)) for each in coming]
    assert plain.replace(commands=discs).commands[0].radius == 0.25
    assert plain.replace(commands=discs).shapes == ()
    walls = kt.with_obstacles(plain.replace(shapes=listed), kt.polyline([(1.0, 5.0), (3.0, 5.0)]))
    assert walls.shapes == (*listed, kt.segment((-1.0, 0.0), (1.0, 0.0)))
    assert walls.movable_shapes == {0, 1}


def test_scenes_differ_by_their_shapes() -> None:
    made = scene()
    others = [scene(shape=[0, 1, 2, 2]), scene(shapes=(*SHAPES, kt.disc(1.0))), made.replace(mass=2.0)]
    round_too = scene(shapes=(SHAPES[0], replace(SHAPES[1], radius=0.25 + 2.0**-50), *SHAPES[2:]))
    for other in (*others, round_too):
        assert made != other
    circles = kt.Scene([(0.0, 0.0)], [(0.0, 0.0)], SHAPES[0].reach)
    assert kt.Scene([(0.0, 0.0)], [(0.0, 0.0)], shape=SHAPES[0]) != circles


def test_each_side_has_its_own_reach_to_the_walls() -> None:
    high = kt.box(1.0, 2.0)
    kt.Scene([(0.5, 1.0)], [(0, 0)], shape=high, arena=(1.0, 2.0))
    aside = kt.polygon([(2.0, 3.0)], 0.5)
    kt.Scene([(-1.5, -2.5)], [(0, 0)], shape=aside, arena=(1.0, 1.0))
    with pytest.raises(SceneError, match="left wall"):
        kt.Scene([(-1.5 - 1e-9, -2.5)], [(0, 0)], shape=aside, arena=(1.0, 1.0))


def apart(one: kt.Shape, other: kt.Shape, at: tuple[float, float]) -> bool:
    mistakes: tuple[Mistake, ...] = ()
    try:
        kt.Scene([(0.0, 0.0), at], [(0, 0), (0, 0)], shape=[0, 1], shapes=[one, other])
    except SceneError as error:
        mistakes = error.mistakes
    assert [mistake.where for mistake in mistakes] in ([], ["bodies[0] and bodies[1]"])
    return not mistakes


@pytest.mark.parametrize("by", [0.0, 1e-13, 1e-9, -1e-9])
def test_touching_is_allowed_and_no_more(by: float) -> None:
    fits = by < 1e-12
    assert apart(kt.box(1, 2), kt.box(3, 2), (2.0 - by, 1.5)) is fits
    assert apart(kt.box(1, 2), kt.box(3, 2), (2.0 - by, 2.0)), "corner at corner"
    assert apart(kt.box(2, 2), kt.disc(0.5), (0.5, 1.5 - by)) is fits
    assert apart(kt.box(2, 2), kt.disc(5.0), (1.0 + 3.0 - by, 1.0 + 4.0)) is fits, "at a corner"
    assert apart(kt.capsule((-1, 0), (1, 0), 0.5), kt.capsule((0, -1), (0, 1), 0.25), (1.75 - by, 0)) is fits
    slope = kt.polygon([(0, 0), (3, 0), (0, 4)])
    assert apart(slope, kt.disc(1.0), (1.5 + 0.8 - by, 2.0 + 0.6)) is fits
    assert not apart(kt.box(2, 2), kt.disc(0.5), (0.25, 0.25)), "one inside the other"


@given(shapes(short), shapes(short), st.tuples(short, short))
@example(kt.box(2, 2), kt.box(2, 2), (2.0, 1.0))
def test_overlap_is_that_of_places_in_both(one: kt.Shape, other: kt.Shape, at: tuple[float, float]) -> None:
    """By another formula: separating lines for sharp shapes, distances of all sides for round ones."""
    if not one.is_solid or not other.is_solid:
        return
    within = Fraction(one.radius) + Fraction(other.radius)
    corners = core_difference(one.core, other.core)
    place = Fraction(at[0]), Fraction(at[1])
    assert apart(one, other, at) is not _overlap(one, other, at)
    negated = [(-x, -y) for x, y in core_difference(other.core, one.core)]
    assert sorted(negated) == sorted(corners)
    assert is_closer(negated, place, within) is is_closer(corners, place, within)


def _overlap(one: kt.Shape, other: kt.Shape, at: tuple[float, float]) -> bool:
    a = [(Fraction(x), Fraction(y)) for x, y in one.core]
    b = [(Fraction(x) + Fraction(at[0]), Fraction(y) + Fraction(at[1])) for x, y in other.core]
    sides = [(c[k], c[(k + 1) % len(c)]) for c in (a, b) if len(c) > 1 for k in range(len(c))]
    normals = [(q[1] - p[1], p[0] - q[0]) for p, q in sides] + [(q[0] - p[0], q[1] - p[1]) for p, q in sides]
    normals += [(q[0] - p[0], q[1] - p[1]) for p in a for q in b if p != q]

    def span(of: list[tuple[Fraction, Fraction]], n: tuple[Fraction, Fraction]) -> tuple[Fraction, Fraction]:
        along = [x * n[0] + y * n[1] for x, y in of]
        return min(along), max(along)

    reach = Fraction(one.radius) + Fraction(other.radius)
    for n in [*normals, *((-x, -y) for x, y in normals)]:
        gap = span(b, n)[0] - span(a, n)[1]
        if gap >= 0 and gap * gap >= reach * reach * (n[0] ** 2 + n[1] ** 2):
            return False
    return True


def test_bodies_that_pass_may_overlap() -> None:
    kt.Scene([(0, 0), (0.1, 0)], [(0, 0), (0, 0)], shape=kt.box(1, 1), responses={("*", "*"): "pass"})


def test_touching_neighbours_are_not_compared_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []
    decide = overlap
    monkeypatch.setattr("kinetile.scene.shapes.overlap", lambda *pair: compared.append(pair) or decide(*pair))
    grid = np.stack(np.meshgrid(np.arange(100), np.arange(100)), -1).reshape(-1, 2)
    rest = np.zeros((len(grid), 2))
    kt.Scene((grid + 0.5) / 128, rest, shape=kt.box(1 / 128, 1 / 128), arena=(1.0, 1.0))
    assert not compared
    kt.Scene((grid + 0.5) / 100, rest, shape=kt.box(0.01, 0.01), arena=(1.0, 1.0))
    assert not compared, "rounded places"
    diamond = kt.polygon([(1, 0), (0, 1), (-1, 0), (0, -1)])
    kt.Scene([(0.0, 0.0), (1.0, 1.0)], rest[:2], shape=diamond)
    assert len(compared) == 1


@given(st.lists(shapes(), min_size=1, max_size=4), st.randoms(use_true_random=False))
def test_a_scene_survives_files_and_copies_to_the_bit(table: list[kt.Shape], random: Any) -> None:
    solid = [k for k, shape in enumerate(table) if shape.is_solid]
    if not solid:
        return
    shape = [random.choice(solid) for _ in range(3)]
    made = kt.Scene([(0, 0), (40, 0), (80, 0)], [(0, 0)] * 3, shape=shape, shapes=table)
    read = loads_scene(dumps_scene(made))
    for again in (read, pickle.loads(pickle.dumps(made)), copy.deepcopy(made), made.replace()):
        assert again == made
        assert repr(again.shapes) == repr(made.shapes)
        assert again.shape.tobytes() == made.shape.tobytes()
        assert not again.shape.flags.writeable


def test_files_by_hand(tmp_path: Path) -> None:
    kt.save_scene(scene(), tmp_path / "shapes.toml")
    text = (tmp_path / "shapes.toml").read_text()
    for line in ('kind = "box"', "width = 1.0", "from = [-0.5, 0.0]", "corners = [[2.0, 3.0]]", "shape = 3"):
        assert f"\n{line}\n" in text
    assert "radius = 1.1" not in text
    assert kt.load_scene(tmp_path / "shapes.toml") == scene()


def test_replace_keeps_shapes_and_never_makes_discs_of_them() -> None:
    made, plain = scene(), kt.Scene(PLACES, REST, 0.25, arena=(8.0, 8.0))
    assert made.replace(mass=2.0).shapes == SHAPES
    assert made.replace(shape=0).radius.tolist() == [SHAPES[0].reach] * 4
    assert made.replace(radius=0.25, shape=None, shapes=()) == plain
    assert plain.replace(shape=[0, 1, 2, 3], shapes=SHAPES) == made
    assert plain.replace(shape=kt.disc(0.25)) == plain
    assert plain.replace(mass=2.0).radius.tolist() == [0.25] * 4


def test_a_scene_without_a_body_keeps_the_shapes_of_the_others() -> None:
    fewer = only_bodies(scene(), np.array([0, 2, 3]))
    assert fewer.shapes == SHAPES
    assert fewer.shape.tolist() == [0, 2, 3]


def test_pictures_show_shapes() -> None:
    made = scene()
    box, capsule, triangle, disc = (body.outline for body in picture_of_scene(made).discs)
    assert box == [(0.5, 0.0), (1.5, 0.0), (1.5, 2.0), (0.5, 2.0)]
    for outline, at, shape in zip((capsule, triangle, disc), PLACES[1:], SHAPES[1:], strict=False):
        x, y = (np.array(column) for column in zip(*outline, strict=True))
        left, right, down, up = shape.reaches
        close = pytest.approx((at[0] - left, at[0] + right, at[1] - down, at[1] + up), abs=1e-3)
        assert (x.min(), x.max(), y.min(), y.max()) == close
        corners = core_difference(shape.core, ((0.0, 0.0),))
        for px, py in outline:
            place = Fraction(px) - Fraction(at[0]), Fraction(py) - Fraction(at[1])
            assert is_closer(corners, place, Fraction(shape.radius + 1e-9))
            assert not is_closer(corners, place, Fraction(shape.radius - 1e-9))
    svg = kt.as_svg(made) or ""
    assert len(re.findall("<polygon", svg)) == 4
    assert "4 bodies" in svg
    html = kt.as_html(made)
    assert "box (1), capsule (1), polygon (1), disc (1)" in html


BOX = '[[shapes]]\nkind = "box"\nwidth = 0.5\nheight = 0.25\n'


@pytest.mark.parametrize(
    "make",
    [
        lambda: loads_scene("bodies = []\n" + BOX),
        lambda: kt.Scene([], [], [], shapes=[kt.box(0.5, 0.25)]),
        lambda: kt.Scene([], [], shape=np.zeros(0, dtype=np.int64), shapes=[kt.box(0.5, 0.25)]),
        lambda: kt.Scene(
            [], [], [], commands=[kt.Insert(1.0, (1.0, 1.0), (0.0, 0.0), shape=kt.box(0.5, 0.25))]
        ),
    ],
)
def test_shapes_without_bodies_were_an_index_error(make):
    scene = make()
    assert (len(scene), scene.shapes) == (0, (kt.box(0.5, 0.25),))
    assert scene == loads_scene(dumps_scene(scene)) == pickle.loads(pickle.dumps(scene)) == scene.replace()
    assert len(kt.with_obstacles(scene, kt.polyline([(0.0, 0.0), (1.0, 0.0)]))) == 1
