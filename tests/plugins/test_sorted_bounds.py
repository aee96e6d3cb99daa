"""Sorted bounds, on a line and on a circle: faults made by hand are reported, and a circle is drawn."""

import numpy as np
import pytest

import kinetile as kt
import torus_scenes
from inside import engine_of
from kinetile.errors import AuditError
from kinetile.kernel.pairs import add_pair, remove_pair
from kinetile.kernel.tables import NEVER, STRUCTURAL
from kinetile.plugin.drawing import Entry, Segment
from kinetile_plugins.sweep_and_prune import PLACE, TURN

PHASES = ("sap-1d", "sap-2d")


def on_a_line(phase: str) -> kt.Simulation:
    sim = kt.Simulation(kt.make_scene("grid", bodies=25, density=0.3, seed=3), phase, audit=1)
    sim.run(max_contacts=6)
    return sim


def on_a_circle(phase: str) -> kt.Simulation:
    """Returns a simulation between two events, with two bodies that overlap through several images."""
    position = [[0.5, 0.5], [0.0, 0.05], [0.02, 0.5], [0.6, 0.97]]
    velocity = [[0.0, 0.0], [0.0, 0.1], [0.1, 0.2], [0.3, -0.1]]
    sim = kt.Simulation(box(position, velocity, [0.4, 0.2, 0.03, 0.03]), phase, audit=1)
    sim.run(max_contacts=2)
    return sim


def box(position, velocity, radius) -> kt.Scene:
    return kt.Scene(position, velocity, radius, arena=(1.0, 1.0), periodic="xy")


def lists(sim: kt.Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Returns the bounds on x from left to right, and the ticks and places of all, to be changed in place."""
    return engine_of(sim).state.order[1 : 1 + 2 * len(sim.scene)], engine_of(sim).state.bounds


def bound_twice(sim):
    order, _ = lists(sim)
    order[0] = order[1]


def wrong_rank(sim):
    order, bounds = lists(sim)
    bounds[order[:2] + PLACE] = bounds[order[1::-1] + PLACE]


def wrong_order(sim):
    """Two neighbours exchanged: their certificates do not fit the plans any more."""
    order, bounds = lists(sim)
    body = order // 8
    place = next(i for i in range(10, 40) if body[i] != body[i + 1])
    order[[place, place + 1]] = order[[place + 1, place]]
    bounds[order + PLACE] = 1 + np.arange(len(order))


def gap_unwatched(sim):
    order, bounds = lists(sim)
    bounds[next(bound for bound in order if bounds[bound] != NEVER)] = NEVER


def last_watched(sim):
    order, bounds = lists(sim)
    bounds[order[-1]] = 2**60


def certificate_dropped(sim):
    queue = engine_of(sim).k.queue
    queue[
        int(np.flatnonzero((queue.certificate != NEVER) & (queue.kind != STRUCTURAL))[0])
    ].certificate = NEVER


def pair_too_few(sim):
    apart = np.hypot(*np.diff(sim.positions()[sim.candidate_pairs()], axis=1)[:, 0].T)
    remove_pair(engine_of(sim).k, *map(int, sim.candidate_pairs()[int(np.argmax(apart))]))


def pair_twice(sim):
    add_pair(engine_of(sim).k, *map(int, sim.candidate_pairs()[0]))


def pair_too_many(sim):
    held = set(map(tuple, sim.candidate_pairs().tolist()))
    add_pair(engine_of(sim).k, *min({(a, b) for a in range(25) for b in range(a + 1, 25)} - held))


def link_unwatched(sim):
    order, bounds = lists(sim)
    bounds[order[-1]] -= 1


def a_turn_away(sim):
    order, bounds = lists(sim)
    bounds[order[order & 1 == 1][0] + PLACE] += TURN


def begun_elsewhere(sim):
    """The order begins one bound later, and its first one has not been moved by a turn."""
    order, bounds = lists(sim)
    order[:] = np.roll(order, -1)
    bounds[order + PLACE] = (bounds[order + PLACE] & -TURN) + 1 + np.arange(len(order))


def held_too_little(sim):
    remove_pair(engine_of(sim).k, 0, 1)


def held_too_much(sim):
    add_pair(engine_of(sim).k, 0, 1)


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize(
    ("running", "change", "sentence"),
    [
        (on_a_line, bound_twice, "the list of x does not have each bound once"),
        (on_a_line, wrong_rank, "the ranks of x are not those of its list"),
        (on_a_line, wrong_order, r"bounds [LR]\(\d+\) and [LR]\(\d+\) on x pass .*, but are watched"),
        (on_a_line, gap_unwatched, r"pass at tick .*, but are watched never"),
        (on_a_line, last_watched, "the last bound on x has no neighbour, but is watched at tick"),
        (on_a_line, certificate_dropped, r"body \d+ is scheduled never, but its bounds pass at tick"),
        (on_a_line, pair_too_few, r"intervals of bodies \d+ and \d+ overlap, and they are not a candidate"),
        (on_a_line, pair_twice, "is held 2 times, and overlaps 1 times"),
        (on_a_line, pair_too_many, "are a candidate pair, and their intervals do not overlap"),
        (on_a_circle, link_unwatched, r"bounds [LR]\(\d\) and [LR]\(\d\) on x pass .*, but are watched at"),
        (on_a_circle, a_turn_away, "pass at tick .*, but are watched|are in the wrong order"),
        (on_a_circle, begun_elsewhere, "body 0 has its right bound left of its left one on x"),
        (on_a_circle, held_too_little, r"the pair \(0, 1\) is held (1|3) times, and overlaps (2|4) times"),
        (on_a_circle, held_too_much, r"the pair \(0, 1\) is held (3|5) times, and overlaps (2|4) times"),
    ],
)
def test_a_list_that_is_broken_by_hand(running, change, sentence, phase):
    sim = running(phase)
    change(sim)
    with pytest.raises(AuditError, match=sentence):
        sim.run(max_contacts=0)


def test_places_may_overflow():
    """Periods are counted modulo 2^36: a body that has flown 2^35 is where one is that has flown none."""
    scene = torus_scenes.drawn(8, (8,), ("xy",))
    sims = [kt.Simulation(scene, "sap-2d") for _ in range(2)]
    engine = engine_of(sims[1])
    engine.k.images.kx[:3] = 2**35 - 1, -(2**35), 2**40
    engine.lay_out(engine.speed)
    with np.errstate(over="ignore"):
        for sim in sims:
            sim.run(max_contacts=15)
    engine.audit()
    assert len(sims[0].contacts) == 15
    assert sims[0].fingerprint == sims[1].fingerprint


def test_a_certificate_over_the_border_is_drawn_to_the_image_beyond():
    scene = box([[0.9, 0.5], [0.1, 0.5]], [[0.1, 0.0], [-0.1, 0.0]], 0.05)
    (line,) = [item for item in kt.Simulation(scene, "sap-1d").drawing() if item.role == "certificate"]
    assert isinstance(line, Segment)
    assert (line.a[0].body, line.b[0].body) == (0, 1)
    assert (line.a[0].turns, line.b[0].turns) == (0, 1)
    assert (0.9 + line.a[0].offset, 0.1 + line.b[0].offset) == pytest.approx((0.95, 0.05))


def test_the_matrix_shows_which_bodies_overlap_through_an_image():
    scene = box([[0.96, 0.5], [0.04, 0.9], [0.5, 0.03], [0.585, 0.95]], np.zeros((4, 2)), 0.05)
    items = kt.Simulation(scene, "sap-2d").drawing()
    found = [(item.a, item.b, item.label) for item in items if isinstance(item, Entry)]
    assert found == [(0, 1, "x"), (1, 3, "y"), (2, 3, "both")]


def test_a_box_of_sap_2d_is_drawn_around_the_sides_of_its_shape():
    scene = kt.Scene(
        [(2.0, 2.0)], [(0, 0)], shape=kt.polygon([(0.0, 0.0), (1.0, 0.0), (1.0, 0.25)]), arena=(4, 4)
    )
    (drawn,) = [item for item in kt.Simulation(scene, "sap-2d").drawing() if item.role == "bound"]
    offsets = [at.offset for at in (*drawn.low, *drawn.high)]
    assert offsets == pytest.approx([0.0, 0.0, 1.0, 0.25], abs=1e-9)
