"""Times of impact that other engines had wrong: here each is exact, to the tick, under every broad phase."""

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import by_the_rules
import kinetile as kt
from lanes import GENERAL

SCENES = Path(__file__).parents[1] / "scenes" / "impacts"

Row = tuple[int, int, int]


def load(name: str) -> kt.Scene:
    return kt.load_scene(SCENES / f"{name}.toml")


def contacts(scene: kt.Scene) -> list[Row]:
    """Return tick, a and b of all contacts until the scene's end, which are those of rationals, and the same
    under every broad phase."""
    until = int(Fraction(scene.settings.until) / Fraction(scene.time_unit) * 2**52)
    expected = by_the_rules.answer(scene, 100, until).contacts
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase)
        sim.run()
        assert by_the_rules.rows(sim) == expected, phase
    return expected


def tick_of(scene: kt.Scene, time: Fraction) -> int:
    return math.floor(time / Fraction(scene.time_unit) * 2**52)


def moved(scene: kt.Scene, body: int, x: float) -> kt.Scene:
    position = scene.position.copy()
    position[body, 0] = x
    return scene.replace(position=position)


def test_an_impact_comes_no_earlier_on_a_wider_box():
    """A cast of a ball on a box came short by an amount that grew with the box: 139 mm at a half-extent of
    500 m."""
    scene = load("ball-above-a-wide-box")
    time = Fraction(7.25) - Fraction(0.5166)
    for x in (-499.75, -0.1, 0.0, 123.456, 499.9999):
        assert contacts(moved(scene, 1, x)) == [(tick_of(scene, time), 0, 1)]
    for width in (10.0, 100.0, 1e6, 2.0**40):
        wider = scene.replace(
            position=[(0.0, -0.5), (1.5, 7.25)], shapes=[kt.box(width, 1.0), scene.shapes[1]]
        )
        assert contacts(wider) == [(tick_of(scene, time), 0, 1)]


def test_an_impact_is_not_missed_at_one_place_between_others():
    """A cast missed at one x, and hit a millionth beside it."""
    scene = load("corner-meets-a-ball")
    there = scene.position[0, 0]
    places = [there - 1e-6, there, there + 1e-6]
    places += [there + step * np.spacing(there) for step in (-3, -2, -1, 1, 2, 3)]
    found = []
    for x in sorted(places):
        ((tick, a, b),) = contacts(moved(scene, 0, x))
        assert (a, b) == (0, 1)
        found.append(tick)
    assert found == sorted(set(found), reverse=True)  # each place is nearer by some ticks


def test_a_ball_that_slides_along_a_floor_meets_it():
    """A character came through walls while it slid along them: a cast said that nothing was ahead."""
    scene = load("ball-slides-along-a-floor")
    (y, speed), top = (Fraction(scene.position[0, 1]), Fraction(636.3961)), Fraction(-1824 + 96)
    assert contacts(scene) == [(tick_of(scene, (y - 96 - top) / speed), 0, 1)]
    sim = kt.Simulation(scene)
    sim.run()
    assert sim.velocities().tolist() == [[-636.3961, 636.3961], [0.0, 0.0]]  # the normal is upright, exactly


def test_boxes_that_pass_corner_to_corner_do_not_meet():
    """A time of impact was found for boxes that pass each other: a false positive."""
    scene = load("boxes-pass-corner-to-corner")
    assert contacts(scene) == []
    x = scene.position[1, 0]
    for beside in (np.nextafter(x, 99.0), np.nextafter(x, 0.0)):
        assert contacts(moved(scene, 1, beside)) == [], "they pass, but for a rounding"
    ((tick, a, b),) = contacts(moved(scene, 1, x - 2.0**-20))
    assert (tick, a, b) == (tick_of(scene, Fraction(2)), 0, 1)


def test_at_an_impact_nothing_overlaps_and_a_tick_later_it_does():
    """At its time of impact two circles overlapped by a slop, and so did all other shapes."""
    scene = load("impacts-without-an-overlap")
    rows = contacts(scene)
    assert [(a, b) for _, a, b in sorted(rows, key=lambda row: row[1])] == [(0, 1), (2, 3), (4, 5)]
    q = Fraction(scene.time_unit) / 2**52
    for tick, a, b in rows:
        gaps = []
        for ticks in (tick, tick + 1):
            dx, dy = (
                abs(
                    Fraction(scene.position[b, axis])
                    - Fraction(scene.position[a, axis])
                    + (Fraction(scene.velocity[b, axis]) - Fraction(scene.velocity[a, axis])) * ticks * q
                )
                for axis in (0, 1)
            )
            one, two = scene.shapes[scene.shape[a]], scene.shapes[scene.shape[b]]
            wide, high = (
                sum(max(Fraction(corner[axis]) for corner in shape.core) for shape in (one, two))
                for axis in (0, 1)
            )
            radius = Fraction(one.radius) + Fraction(two.radius)
            x, y = max(dx - wide, Fraction(0)), max(dy - high, Fraction(0))
            outside = x * x + y * y - radius * radius
            gaps.append(outside if radius else max(dx - wide, dy - high))
        assert gaps[0] >= 0 > gaps[1]


IMPACTS = {
    # Balls and boxes that touched at the start had other answers, overlapping boxes the end of the step, and
    # balls that part a hit at 0: here one each of discs, of boxes, and of a disc and a box approach.
    "touching-at-the-start": [(0, 0, 1), (0, 8, 9), (0, 16, 17)],
    # Where the heights of two boxes differed, none was found.
    "boxes-of-other-heights": [(4, 2, 3), (8, 0, 1)],
    # A line was met as if it had not been turned: by what flew along it, and not by what flew towards it.
    "ball-and-an-upright-segment": [(0.5, 0, 1)],
}


@pytest.mark.parametrize("name", IMPACTS)
def test_who_meets_at_which_time(name):
    scene = load(name)
    assert contacts(scene) == [(tick_of(scene, Fraction(time)), a, b) for time, a, b in IMPACTS[name]]
