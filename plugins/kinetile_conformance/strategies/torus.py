"""Scenes on periodic axes, from one body to forty: on borders and in corners, written some periods away, in
boxes up to twenty times as long as wide, with flights over thousands of periods. All have kinds."""

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

from kinetile import Scene, Settings, Turn
from kinetile.arrays import Floats
from kinetile.instruments import as_python
from kinetile_conformance.strategies.kinds import KINDS, of_kinds, with_kinds
from kinetile_conformance.strategies.small import MOST as FEW
from kinetile_conformance.strategies.small import body_in_cell, scene_of, several, speeds
from kinetile_conformance.strategies.strategy import drawn, numbered
from kinetile_conformance.strategies.swarms import anyhow, jitter, radii, slots

MOST = 40


@st.composite
def _few(draw: st.DrawFn) -> Scene:
    """Up to six bodies in a box with periodic axes, perhaps hardly wider than a body: in corners and on
    borders, some of them written periods away, some flights many boxes long, some bodies minute."""
    periodic = draw(st.sampled_from(["xy", "xy", "x", "y"]))
    sides = draw(st.sampled_from([(1, 1), (1, 3), (2, 2), (3, 2), (2, 4), (4, 4), (1, 20)]))
    bodies = draw(several(body_in_cell(*sides, False), FEW, 1))
    pace, small = draw(st.sampled_from([1.0, 1.0, 32.0])), draw(st.sampled_from([1.0, 1.0, 0.01]))
    aside = draw(st.sampled_from([0.0, -0.5]))
    away = st.sampled_from([0, 0, 0, -3, 2])
    for body in bodies:
        body["radius"] = min(body["radius"], 1.0 / 2.1) * draw(st.sampled_from([1.0, small]))
        body["velocity"] = tuple(pace * speed for speed in (body["velocity"][0], draw(speeds)))
        body["position"] = tuple(
            place + (aside + draw(away) * side if axis in periodic else 0.0)
            for place, side, axis in zip(body["position"], sides, "xy", strict=True)
        )
    return with_kinds(scene_of(bodies, (float(sides[0]), float(sides[1])), 8.0, periodic))


def _shift(random: np.random.Generator, place: Floats, velocity: Floats) -> Floats:
    """Returns the displacement of all bodies: 0, so that bodies touch borders, or so that two bodies that fly
    at each other obliquely meet in a corner; these get such velocities."""
    apart = np.abs(place - place[-1])
    beside = np.flatnonzero((apart > 0.5).all(axis=1) & (apart < 1.5).all(axis=1))
    if not len(beside) or random.random() < 0.5:
        return np.full(2, random.choice([0.0, 0.5]))
    aslant = place[beside[-1]] - place[-1]
    velocity[-1], velocity[beside[-1]] = 0.5 * aslant, -0.5 * aslant
    middle: Floats = 0.5 * (place[-1] + place[beside[-1]])
    return -middle


def torus(number: int) -> Scene:
    """Returns the swarm on a torus of a number: half are dyadic, with turns where bodies touch a border."""
    random = np.random.default_rng(number)
    bodies = int(random.integers(MOST // 2, MOST + 1) if number & 4 else 2 * (MOST / 2) ** random.random())
    long = int(random.choice([1, 1, 1, 2, 5, 20]))
    room = random.choice([1.3, 1.3, 3.0, 12.0])  # a grid needs three columns and rows to have corners
    rows = max(1, math.ceil(math.sqrt(room * bodies / long)))
    sides = np.array([long * rows, rows])[:: 1 if number & 1 else -1]
    periodic = ("xy", "xy", "xy", "x", "y")[int(random.integers(5))]
    is_dyadic = random.random() < 0.5
    radius = radii(random, bodies, int(random.integers(8)))
    if is_dyadic:
        radius = np.where(radius > 0.2, random.choice([0.25, 0.5 - 2.0**-20, 0.375]), 0.125)
    place = slots(random, bodies, int(sides[0]), int(sides[1]))
    velocity = random.integers(-4, 5, (bodies, 2)) / 2.0 if is_dyadic else anyhow(random, bodies)
    if not is_dyadic:
        place = place + jitter(random, radius)
    until = 64.0
    match int(random.integers(6)):
        case 0:  # one flies thousands of periods, and hardly meets another
            radius = radius * 2.0**-14
            velocity[0] += 24.0 * sides * random.choice([-1.0, 1.0], 2)
        case 1:  # all drift together
            velocity = velocity + 2.0 ** random.integers(4, 9) * random.integers(-1, 2, 2)
            until = 16.0
        case 2:
            velocity[random.random(bodies) < 0.7] = 0.0
    along = np.array([axis in periodic for axis in "xy"])
    away = sides * random.integers(-3, 4, (bodies, 2))
    place = place + along * (_shift(random, place, velocity) + away)
    moments = random.integers(0, 64, bodies // 3) / 4.0
    turns = [
        Turn(int(random.integers(bodies)), float(each), tuple((random.integers(-4, 5, 2) / 2.0).tolist()))
        for each in np.sort(moments)
    ]
    kinds = random.choice(len(KINDS), bodies, p=[0.7, 0.15, 0.15]) if number & 2 else np.zeros(bodies, int)
    return Scene(
        place,
        velocity,
        radius,
        arena=(float(sides[0]), float(sides[1])),
        periodic=periodic,
        turns=turns,
        settings=Settings(until=until),
        **of_kinds(kinds.tolist(), np.ones(bodies), random),
    )


ROUNDS = {True: 64, False: 34_000}
"""Periods of a long flight, for all bodies together: compiled, numbers of 16 bits overflow."""


def flight(number: int) -> Scene:
    """Returns a crowd that flies many periods, with contacts all the time; a grid has several rows."""
    random, along = np.random.default_rng(number), number % 2
    sides, until = ((5, 3), (3, 5))[along], 8.0
    velocity = anyhow(random, 15)
    velocity[:, along] += ROUNDS[as_python()] / until * 5.0 * random.choice([-1.0, 1.0])
    more: Any = {"arena": sides, "periodic": "xy", "settings": Settings(until=until)}
    return with_kinds(Scene(slots(random, 15, *sides), velocity, 0.4375, **more))


DRAWS = {
    "small scenes on a torus": drawn(_few),
    "swarms on a torus": numbered(torus),
    "long flights": numbered(flight),
}
