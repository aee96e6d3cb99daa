"""Sweep-and-prune where axes are periodic: the answer of the rules and of ``naive``, with audits on
the way, and audits that see what is broken on a circle."""

from __future__ import annotations

import numpy as np
import pytest

import by_the_rules
import kinetile as kt
from kinetile.errors import AuditError
from kinetile.kernel.pairs import add_pair, remove_pair
from kinetile.plugin.drawing import Entry, Segment
from kinetile_plugins.sweep_and_prune import PLACE, TURN
from lanes import first

PHASES = (("sap-1d", {"axis": "x"}), ("sap-1d", {"axis": "y"}), ("sap-2d", {}))


def box(position, velocity, radius, periodic="xy", arena=(1.0, 1.0), mass=1.0) -> kt.Scene:
    return kt.Scene(position, velocity, radius, mass, arena=arena, periodic=periodic)


def at_border(seed: int, periodic: str = "xy", side: int = 4, filled: float = 0.4) -> kt.Scene:
    """Return a lattice with bodies on the borders and the corner, at dyadic speeds: ties without end."""
    rng = np.random.default_rng(seed)
    shift = [0.0 if axis in periodic else 0.5 for axis in "xy"]
    sites = (np.argwhere(np.ones((side, side))) + shift) / side
    sites = sites[rng.random(len(sites)) < filled]
    velocity = rng.integers(-2, 3, sites.shape) / 2
    radius = rng.choice([0.5, 0.25], len(sites)) / side
    mass = rng.choice([1.0, 2.0], len(sites)) if seed % 2 else 1.0
    return box(sites, velocity, radius, periodic, mass=mass)


def drawn(seed: int) -> kt.Scene:
    """Return a scene of up to 40 bodies with radii a hundred apart, some of them fast, some far from 0."""
    rng = np.random.default_rng(seed)
    periodic, least = ("x", "y", "xy", "xy")[seed % 4], (0.1, 0.01)[seed % 2]
    room = np.array([axis in periodic for axis in "xy"])
    position, radius = [], []
    for _ in range(400):
        r = 0.2 * least ** rng.random()
        p = np.where(room, rng.random(2), rng.uniform(r, 1 - r, 2))
        apart = [p - q - room * np.rint(p - q) for q in position]
        if len(position) < 40 and all(np.hypot(*d) > r + s for d, s in zip(apart, radius, strict=True)):
            position.append(p)
            radius.append(r)
    velocity = rng.normal(size=(len(radius), 2))
    velocity[: len(radius) // 4] *= 50.0
    away = room * rng.integers(-3, 4, (len(radius), 2)) * 1000.0
    return box(np.array(position) + away, velocity, radius, periodic)


SCENES = {
    "alone": (0, box([[0.9, 0.5]], [[30.0, 1.0]], 1 / 2.1)),
    "two images at one tick": (5, box([[0.5, 0.5], [0.0, 0.1]], [[0, 0], [0, 1.0]], [0.4, 0.2])),
    "no wider than a body": (9, box([[0.5, 0.5], [0, 0]], [[1.0, 0.5], [-3.0, 1.0]], [1 / 2.1, 0.01])),
    "a reach of more than half the box": (
        5,
        box([[0.3, 0.6], [0.3, 1.7]], [[1, 0], [0.25, -1]], [0.5 - 2**-54, 0.05], arena=(1.0, 3.0)),
    ),
    "fifty boxes": (5, box([[0.1, 0.2], [0.6, 0.7], [0.3, 0.9]], [[50, 3], [-41, 9], [0.1, 0]], 0.1)),
    "other periods": (5, box([[0.1, 0.2], [2.6, 0.1]], [[1, 2], [-4, 9]], 0.06, arena=(4.0, 0.25))),
    "corners": (8, at_border(1)),
    "a wall above": (8, at_border(3, "x")),
    "a wall beside": (8, at_border(4, "y")),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_answer_is_that_of_the_rules(name):
    contacts, scene = SCENES[name]
    wanted = by_the_rules.answer(scene, contacts, 20 << 52).contacts
    assert len(wanted) == contacts
    for phase, options in PHASES:
        sim = kt.Simulation(scene, phase, options=options, audit=1)
        sim.run(until=20.0 * scene.time_unit, max_contacts=contacts or None)
        assert by_the_rules.rows(sim) == wanted, options


def assert_naive(scene: kt.Scene, **end) -> None:
    """Assert that every phase leaves what naive does, bit for bit, with audits on the way."""
    sims = [kt.Simulation(scene, "naive")]
    sims += [kt.Simulation(scene, phase, options=options, audit=25) for phase, options in PHASES]
    for sim in sims:
        sim.run(**end)
    one, *rest = [(sim.fingerprint, sim.positions().tobytes(), sim.velocities().tobytes()) for sim in sims]
    assert all(each == one for each in rest)
    assert len(sims[0].contacts) >= 12


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("seed", range(100))
def test_naive_gives_the_same(seed):
    assert_naive(drawn(seed) if seed % 3 else at_border(seed, side=8), max_contacts=300, until=20.0)


@pytest.mark.parametrize("seed", first(2, range(20)))
def test_bodies_come_go_and_turn(seed):
    rng = np.random.default_rng(seed)
    scene = at_border(seed, ("xy", "x")[seed % 2], filled=0.3)
    sim = kt.Simulation(scene, ("sap-2d", "sap-1d")[seed % 2], audit=1)
    places = np.array([[x, y] for x in (0.03, 0.3, 0.5, 0.7, 0.97) for y in (0.2, 0.35, 0.6, 0.8)])
    for _ in range(4):
        sim.run(max_contacts=len(sim.contacts) + 3)
        if len(sim.bodies) > 2:
            sim.remove(int(rng.choice(sim.bodies)))
            sim.run(max_contacts=0)  # audits
        sim.set_velocity(int(rng.choice(sim.bodies)), rng.normal(size=2))
        apart = places[:, None] - sim.positions()
        apart -= np.rint(apart) * [axis in scene.periodic for axis in "xy"]
        free = (np.hypot(*apart.transpose(2, 0, 1)) > 0.04 + sim.radii()).all(axis=1)
        for place in places[free][:1]:
            sim.insert(place, rng.normal(size=2), 0.03)
            sim.run(max_contacts=0)
    assert_naive(sim.recorded())


def test_places_may_overflow():
    """Periods are counted modulo 2^36: a body that has flown 2^35 is where one is that has flown none."""
    scene = at_border(1)
    sims = [kt.Simulation(scene, "sap-2d") for _ in range(2)]
    engine = sims[1]._engine
    engine.k.images.kx[:3] = 2**35 - 1, -(2**35), 2**40
    engine.lay_out(engine.speed)
    with np.errstate(over="ignore"):
        for sim in sims:
            sim.run(max_contacts=15)
    engine.audit()
    assert sims[0].fingerprint == sims[1].fingerprint


def running(phase: str) -> kt.Simulation:
    """Return a simulation between two events, in which two bodies overlap through several images."""
    position = [[0.5, 0.5], [0.0, 0.05], [0.02, 0.5], [0.6, 0.97]]
    velocity = [[0.0, 0.0], [0.0, 0.1], [0.1, 0.2], [0.3, -0.1]]
    sim = kt.Simulation(box(position, velocity, [0.4, 0.2, 0.03, 0.03]), phase, audit=1)
    sim.run(max_contacts=2)
    return sim


def order_of(sim):
    """Return the bounds on x from left to right, to be changed in place."""
    return sim._engine.state.order[1 : 1 + 2 * len(sim.scene)]


def link_unwatched(sim):
    sim._engine.state.bounds[order_of(sim)[-1]] -= 1


def a_turn_away(sim):
    sim._engine.state.bounds[order_of(sim)[order_of(sim) & 1 == 1][0] + PLACE] += TURN


def begun_elsewhere(sim):
    """The order begins one bound later, and its first one has not been moved by a turn."""
    order, bounds = order_of(sim), sim._engine.state.bounds
    order[:] = np.roll(order, -1)
    bounds[order + PLACE] = (bounds[order + PLACE] & -TURN) + 1 + np.arange(len(order))


def held_too_little(sim):
    remove_pair(sim._engine.k, 0, 1)


def held_too_much(sim):
    add_pair(sim._engine.k, 0, 1)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (link_unwatched, r"bounds [LR]\(\d\) and [LR]\(\d\) on x pass .*, but are watched at tick"),
        (a_turn_away, "pass at tick .*, but are watched|are in the wrong order"),
        (begun_elsewhere, "body 0 has its right bound left of its left one on x"),
        (held_too_little, r"the pair \(0, 1\) is held (1|3) times, and overlaps (2|4) times"),
        (held_too_much, r"the pair \(0, 1\) is held (3|5) times, and overlaps (2|4) times"),
    ],
)
def test_what_is_broken_on_a_circle(change, said):
    for phase in ("sap-1d", "sap-2d"):
        sim = running(phase)
        change(sim)
        with pytest.raises(AuditError, match=said):
            sim.run(max_contacts=0)


def test_a_certificate_over_the_border_is_drawn_to_the_image_beyond():
    scene = box([[0.9, 0.5], [0.1, 0.5]], [[0.1, 0.0], [-0.1, 0.0]], 0.05)
    (line,) = [item for item in kt.Simulation(scene, "sap-1d").drawing() if item.role == "certificate"]
    assert isinstance(line, Segment)
    begin, end = (0.9 + line.a[0].offset, 0.1 + line.b[0].offset)
    assert (line.a[0].body, line.b[0].body) == (0, 1)
    assert (begin, end) == pytest.approx((0.95, 1.05))


def test_the_matrix_shows_who_overlaps_through_an_image():
    scene = box([[0.96, 0.5], [0.04, 0.9], [0.5, 0.03], [0.585, 0.95]], np.zeros((4, 2)), 0.05)
    items = kt.Simulation(scene, "sap-2d").drawing()
    assert [(item.a, item.b, item.label) for item in items if isinstance(item, Entry)] == [
        (0, 1, "x"),
        (1, 3, "y"),
        (2, 3, "both"),
    ]
