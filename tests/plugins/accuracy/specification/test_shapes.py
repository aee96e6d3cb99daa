"""Rules of shapes in rationals, against what they mean: where a place is, and how far from the difference."""

import json
import random
from collections import Counter
from fractions import Fraction
from pathlib import Path

import pytest

import kinetile as kt
from kinetile.scene.differences import Exact, core_difference, cross, dot, is_closer, less
from kinetile_accuracy.specification import shapes as rules
from kinetile_accuracy.specification.arithmetic import (
    HORIZON,
    FlightPlan,
    Frame,
    pair_tick,
)
from lanes import first

LATTICES = (1.0, 0.5, 1 / 16, 2.0**-20)
EDGES = (-1, 0, 1)


class Query:
    """Two shapes, and how the second flies past the first: d + v t."""

    def __init__(self, seed: int) -> None:
        draw = random.Random(seed)
        step = Fraction(draw.choice(LATTICES))
        wide = draw.choice((2, 4, 6))

        def place(size: int) -> tuple[float, float]:
            return float(draw.randint(-size, size) * step), float(draw.randint(-size, size) * step)

        def shape() -> kt.Shape:
            places = tuple(place(wide) for _ in range(draw.choice((1, 1, 2, 2, 3, 4, 5))))
            hull = [(float(x), float(y)) for x, y in core_difference(places, ((0.0, 0.0),))]
            margin = draw.choice((0.0, 0.0, 1.0, 2.0, 2.5, 5.0)) * float(step)
            return kt.polygon(
                [(float(x), float(y)) for x, y in hull], margin or float(step) * (len(hull) == 1)
            )

        self.shapes = shape(), shape()
        self.corners = core_difference(self.shapes[0].core, self.shapes[1].core)
        self.radius = Fraction(self.shapes[0].radius) + Fraction(self.shapes[1].radius)
        self.m = rules.Difference(*self.shapes)
        self.d = tuple(map(Fraction, place(3 * wide)))
        to = tuple(map(Fraction, place(wide + draw.choice((0, 2, 4)))))
        if draw.random() < 0.3:
            x, y = draw.choice(self.corners)
            to = x + draw.choice(EDGES) * self.radius, y + draw.choice(EDGES) * self.radius
        pace = draw.choice((1, 2, 4, 8, 64, Fraction(1, 2), Fraction(1, 8)))
        self.v = tuple((b - a) / pace for a, b in zip(self.d, to, strict=True))
        if draw.random() < 0.4:
            self.v = draw.choice(((self.v[0], Fraction(0)), (Fraction(0), self.v[1]), (step, step)))
        if draw.random() < 0.2:  # it has gone by
            self.d = self.at(draw.choice((1, 2)) * pace)
        if draw.random() < 0.2:  # on the outline, or in it
            x, y = draw.choice(self.corners)
            self.d = x + draw.choice(EDGES) * self.radius, y + draw.choice(EDGES) * self.radius

    def at(self, t: Fraction | int) -> Exact:
        return self.d[0] + self.v[0] * t, self.d[1] + self.v[1] * t

    def inside(self, t: Fraction | int) -> bool:
        """Whether the place is inside the difference and its margin, and not on its outline."""
        return is_closer(self.corners, self.at(t), self.radius)

    def touches(self, t: Fraction | int) -> bool:
        """Whether the place is inside, or on the outline."""
        return self.size(t) <= self.radius**2

    def size(self, t: Fraction | int) -> Fraction:
        """Return the square of the distance from the core; inside the core less the square of the depth."""
        place, sides = self.at(t), []
        for k, p in enumerate(self.corners):
            side, at = less(self.corners[(k + 1) % len(self.corners)], p), less(place, p)
            length, along = dot(side, side), dot(side, at)
            sides.append((cross(side, at), dot(at, at), length, along))
        if len(self.corners) > 2 and all(deep >= 0 for deep, *_ in sides):
            return -min(deep * deep / length for deep, _, length, _ in sides)
        over = [deep * deep / length for deep, _, length, along in sides if 0 <= along <= length != 0]
        return min([square for _, square, _, _ in sides] + over)

    def closest(self) -> list[Fraction]:
        """Return times after 0 at one of which the place is as close to the core, or as deep, as it comes."""
        a = dot(self.v, self.v)
        times = [-dot(less(self.d, corner), self.v) / a for corner in self.corners if a]
        for k, p in enumerate(self.corners):
            for q in self.corners[k + 1 :]:
                side = less(q, p)
                w, g = cross(side, self.v), cross(side, less(self.d, p))
                times += [-g / w] if w else []
        later = sorted(t for t in times if t > 0)
        middles = [(one + other) / 2 for one, other in zip([Fraction(0), *later], later, strict=False)]
        return [*later, *middles]

    def falls(self) -> bool:
        return self.size(Fraction(1, 2**200)) < self.size(0)


def check(query: Query) -> str:
    """Compare the contact of a query with what the place does; return in a word which it was."""
    found = rules.entry(query.m, query.d, query.v)
    solid = len(query.corners) > 2 or query.radius > 0
    if query.touches(0):
        assert (found is not None) is query.falls()
        assert found is None or found.tick == 0
        return "none from inside" if found is None else "at once"
    ever = [t for t in query.closest() if query.inside(t)]
    if found is None:
        assert not (ever and solid)
        return "never"
    tick = found.tick
    assert not any(query.inside(Fraction(tick * k, 4)) for k in range(5))
    if query.inside(tick + 1):
        return "hit"
    assert any(tick < t < tick + 1 for t in ever)
    return "a visit shorter than a tick"


@pytest.mark.parametrize("seeds", first(1, [range(200), range(200, 4000)]))
def test_contacts_are_where_a_place_comes_in(seeds: range) -> None:
    met = Counter(check(Query(seed)) for seed in seeds)
    assert min(met[kind] for kind in ("hit", "never", "at once", "none from inside")) > 6, met
    assert len(seeds) < 1000 or met["a visit shorter than a tick"] > 10


def test_the_other_way_round_it_is_the_same_contact() -> None:
    met = 0
    for query in map(Query, range(200)):
        one = rules.entry(query.m, query.d, query.v)
        back = rules.Difference(*query.shapes[::-1])
        other = rules.entry(back, *(tuple(-x for x in place) for place in (query.d, query.v)))
        assert (one and one.tick) == (other and other.tick)
        if one is None or other is None:
            continue
        assert one.feature.kind == other.feature.kind
        if one.feature.kind == "face":
            normals = query.m.faces[one.feature.number].normal, back.faces[other.feature.number].normal
            assert cross(*normals) == 0
            assert dot(*normals) < 0
            met += 1
    assert met > 30


def test_parting_is_where_a_place_goes_out() -> None:
    met = Counter()
    for seed in range(200):
        query = Query(seed)
        found, entry = (rule(query.m, query.d, query.v) for rule in (rules.exit_, rules.entry))
        ever = [t for t in [Fraction(0), *query.closest()] if query.inside(t)]
        if found is None:
            assert query.v == (0, 0)
            met["never"] += 1
        elif not ever:
            assert found == 0 or (query.touches(found) and not query.touches(found + 1))
            met["outside"] += 1
        else:
            assert entry is None or found >= entry.tick
            assert not query.inside(found + 1)
            assert not query.inside(found + 2)
            assert query.touches(found) or any(found < t < found + 1 for t in ever)
            met["out"] += 1
    assert len(met) == 3


def disc_pair(seed: int) -> tuple[tuple[kt.Shape, kt.Shape], tuple[FlightPlan, FlightPlan]]:
    draw = random.Random(seed)
    frame = Frame(None, 0)
    radii = draw.random(), draw.random()
    numbers = [[draw.uniform(-3, 3) for _ in range(4)] for _ in radii]
    plans = [
        FlightPlan(*each, draw.randrange(1 << 50), r, frame) for each, r in zip(numbers, radii, strict=True)
    ]
    return (kt.disc(radii[0]), kt.disc(radii[1])), (plans[0], plans[1])


def test_discs_meet_as_by_rule_5() -> None:
    met = 0
    for seed in range(300):
        shapes, plans = disc_pair(seed)
        found = rules.contact(rules.Difference(*shapes), *plans)
        assert (found and found.tick) == pair_tick(*plans)
        met += found is not None
    assert 20 < met < 280


def test_boxes_meet_where_division_says() -> None:
    frame, box = Frame(None, 0), kt.box(1.0, 1.0)
    still = FlightPlan(0.0, 0.0, 0.0, 0.0, 0, 1.0, frame)

    def met(x: float, y: float, vx: float, vy: float) -> tuple[int, str, int] | None:
        found = rules.contact(rules.Difference(box, box), still, FlightPlan(x, y, vx, vy, 7, 1.0, frame))
        return found and (found.tick, *found.feature)

    assert met(3.0, 0.0, -1.0, 0.0) == (7 + (2 << 52), "face", 0)
    assert met(-3.0, 0.0, 3.0, 0.0) == (7 + (2 << 52) // 3, "face", 1)
    assert met(0.0, 2.0, 0.0, -1.0) == (7 + (1 << 52), "face", 2)
    assert met(0.0, -2.0, 0.0, 1.0) == (7 + (1 << 52), "face", 3)
    assert met(2.0, 2.0, -1.0, -1.0) == (7 + (1 << 52), "face", 0), "at a corner, exactly"
    assert met(-2.0, -2.0, 1.0, 1.0) == (7 + (1 << 52), "face", 1)
    assert met(3.0, 1.0, -1.0, 0.0) is None, "it slides along"
    assert met(3.0, 1.0 - 2.0**-53, -1.0, 0.0) is None, "it slides along, but for a rounding"
    assert met(3.0, 1.0 - 2.0**-30, -1.0, 0.0) == (7 + (2 << 52), "face", 0)
    assert met(2.0, 0.0, -1.0, 1.0) is None, "it grazes a corner"
    assert met(1.0, 0.0, -1.0, 5.0) == (7, "face", 0), "they touch"
    assert met(1.0, 0.0, 0.0, 1.0) is None
    assert met(1.0, 1.0, -1.0, 0.0) is None
    assert met(1.0 - 2.0**-52, 0.0, -(2.0**-20), 1.0) == (7, "face", 0), "they overlap by a rounding"
    assert met(1.0 - 2.0**-52, 0.0, 2.0**-20, -1.0) is None
    assert met(0.5, 0.5, -1.0, 1.0) is None, "as deep at two faces, and out over one"
    assert met(0.5, 0.5, -1.0, -2.0) == (7, "face", 0)
    late = 2.0**-10  # 2^62 ticks for the length of a box
    assert met(2.0, 0.0, -late, 0.0) is None, "later than any plan"
    assert met(2.0 - 2.0**-52, 0.0, -late, 0.0) == (7 + HORIZON - 1024, "face", 0)


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
    assert rules.normal(m, (1.0 + 2.0**-52, 1.0), (1.0, -1.0)) == (0.0, 1.0)
    assert rules.normal(m, (1.0, 1.0), (-1.0, -1.0)) == (1.0, 0.0)
    assert rules.normal(m, (1.0, 1.0), (0.0, 0.0)) == (1.0, 0.0)
