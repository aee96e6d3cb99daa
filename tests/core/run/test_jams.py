"""Bodies that cannot move on: jams and squeezes, and a program's ways out."""

import math
import random
from collections import Counter

import pytest

import kinetile as kt
from agreement import agree
from kinetile.errors import ZenoError

INF, PHASES = math.inf, ("naive", "cells", "sap-1d", "sap-2d")
PADDLES = {"mass": [1.0, INF, INF], "arena": (2.0, 2.0)}


def between_paddles(response="elastic", by=1.0):
    """A ball on a wall, between two paddles that close in."""
    places = [(1.0, 0.04), (0.93, 0.13), (1.07, 0.13)]
    velocities = [(0.0, 0.0), (0.6 * by, -1.3 * by), (-0.6 * by, -1.3 * by)]
    rules = None if response == "elastic" else response
    return kt.Scene(places, velocities, [0.03, 0.06, 0.06], responses=rules, **PADDLES)


def to_a_wall(speed=-1.0, balls=1):
    """Balls in a row between a wall and a paddle that moves towards it."""
    places = [(0.2 + 0.25 * i, 0.5) for i in range(balls)] + [(2.0, 0.5)]
    velocities = [(1.0, 0.0)] + [(0.0, 0.0)] * (balls - 1) + [(speed, 0.0)]
    return kt.Scene(places, velocities, [0.1] * balls + [0.2], mass=[1.0] * balls + [INF], arena=(3.0, 1.0))


def until_jammed(sim):
    with pytest.raises(ZenoError, match="is squeezed by immovable bodies"):
        sim.run(until=9.0, max_contacts=100_000)


@pytest.mark.parametrize(
    ("scene", "most"),
    [
        (between_paddles(), 10_000),
        (between_paddles(kt.Response("restitution", e=0.5, contact_time=1e-6)), 10_000),
        (between_paddles(kt.Response("restitution", e=0.5, contact_time=1e-3)), 10_000),
        (to_a_wall(), 10_000),
        (to_a_wall(balls=5), 20_000),
    ],
)
@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.own_loop
def test_a_squeeze_had_twenty_million_contacts_or_no_end(scene, most):
    sims = agree(scene, *PHASES, play=until_jammed)
    assert len(sims[0].contacts) <= most


@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.own_loop
def test_what_is_no_squeeze_was_not_taken_for_one():
    """A light disc between a heavy one and a wall has as many contacts as pi has digits; a slow wall, moving
    elsewhere, changes nothing of that."""
    scene = kt.Scene(
        [(2.0, 0.5), (1.0, 0.5), (5.0, 2.5)], [(-1.0, 0.0), (0.0, 0.0), (-1e-3, 0.0)], 0.1,
        mass=[1e8, 1.0, INF], arena=(30.0, 3.0),
    )  # fmt: skip
    sims = agree(scene, *PHASES, until=10.0)
    assert len(sims[0].contacts) == 31415


@pytest.mark.compiled
@pytest.mark.own_loop
@pytest.mark.slow
def test_a_program_had_to_catch_the_error_of_a_squeeze_and_run_again():
    told = []

    def release(sim, jam):
        told.append(jam.bodies)
        sim.set_velocities([1, 2], [(0.0, 0.0)])

    sim = kt.Simulation(between_paddles(), "cells")
    sim.run(until=0.1, max_contacts=100_000, on_jam=lambda jam: release(sim, jam))
    assert len(told) == 1
    again = kt.Simulation(sim.recorded(), "naive")  # which jammed before the command that ends the jam
    again.run(until=0.1, max_contacts=100_000)
    assert again.fingerprint == sim.fingerprint
    with pytest.raises(ZenoError):  # a function that changes nothing
        kt.Simulation(between_paddles(), "cells").run(until=0.1, on_jam=lambda jam: told.append(jam.bodies))
    assert len(told) == 2


@pytest.mark.compiled
@pytest.mark.own_loop
@pytest.mark.slow
def test_a_paddle_that_backs_off_was_told_as_a_squeeze():
    """Gap times speed is constant: so many contacts are left until the ball is as slow as the paddle."""
    scene = kt.Scene(
        [(1, 1), (3, 1)], [(1, 0), (0, 0)], [0.5, 0.25], mass=[INF, 1], arena=(4, 2),
        kind=["paddle", "ball"], responses={("paddle", "wall"): "stop"},
    )  # fmt: skip
    sim = kt.Simulation(scene, "cells", live=True)
    with pytest.raises(ZenoError, match="squeezed"):
        sim.run(until=6.0)
    sim.set_velocity(0, (-1.0, 0.0))
    assert sim.run(until=6.0)
    assert len(sim.contacts) == 9600


SHAPES = [
    *(kt.disc(0.125), kt.box(0.25, 0.125), kt.capsule((-0.125, 0.0), (0.125, 0.0), 0.0625)),
    *(kt.disc(0.375), kt.box(0.75, 0.25), kt.capsule((0.0, -0.25), (0.0, 0.25), 0.125)),
]
FRAMES, WINDOWS = 240, 20


def court(rng, sort, balls):
    """Balls and after them up to three paddles in free cells of an arena; with gravity balls settle."""
    many, cells = balls + rng.randint(1, 3), [(0.5 + x, 0.5 + y) for x in range(4) for y in range(3)]
    loses = {"e": rng.choice((0.1, 0.5, 0.9, 0.99, 0.999)), "contact_time": rng.choice((1e-6, 1e-4, 1e-3))}
    more = {
        "radius": [rng.uniform(0.03, 0.2) if at < balls else rng.uniform(0.1, 0.45) for at in range(many)]
    }
    if sort == "shapes":
        more = {"shapes": SHAPES, "shape": [rng.randrange(3) + 3 * (at >= balls) for at in range(many)]}
    if sort == "heaps":
        loses |= {"contact_time": 1e-3, "settle": rng.choice((0.05, 0.25))}
        more["gravity"] = 0.0, -rng.choice((1.0, 4.0, 9.8))
    soft = kt.Response("restitution", **loses)
    among = [soft if sort == "heaps" else rng.choice(("elastic", soft)) for _ in "ab"]
    rules = {("ball", "soft"): soft, ("ball", "dead"): "stop", ("ball", "wall"): among[0]}
    return kt.Scene(
        position=rng.sample(cells, many),
        velocity=[(rng.gauss(0, 1), rng.gauss(0, 1)) if at < balls else (0.0, 0.0) for at in range(many)],
        mass=[rng.choice((1.0, 1.0, 0.01, 10.0)) if at < balls else INF for at in range(many)],
        kind=["ball" if at < balls else rng.choice(("hard", "soft", "dead")) for at in range(many)],
        kinds=["ball", "hard", "soft", "dead"],
        responses={**rules, ("ball", "ball"): among[1]},
        arena=(4.0, 3.0),
        **more,
    )


def steered(seed, sort, aimed):
    """Plays with paddles that go to a ball, or at random. Returns the most contacts of a run to its answer,
    and the number of windows that reported each jam without an action; then a ball goes."""
    rng = random.Random(f"{sort} {seed}")
    balls = rng.randint(1, 5) if aimed else rng.randint(4, 9)
    sim = kt.Simulation(court(rng, sort, balls), "cells", live=True)
    paces, most, jams = [10 ** rng.uniform(-1.3, 1.3) for _ in sim.bodies[balls:]], 0, []
    for frame in range(1, FRAMES + 1):
        there = [body for body in sim.bodies.tolist() if body < balls]
        if not there or (aimed and jams):
            break
        for paddle, pace in enumerate(paces, balls):
            x, y = sim.positions()[0] - sim.positions()[sim.bodies == paddle][0]
            if aimed:
                sim.set_velocity(paddle, (pace * x / math.hypot(x, y), pace * y / math.hypot(x, y)))
            elif rng.random() < 0.1:
                sim.set_velocity(paddle, (rng.gauss(0, pace), rng.gauss(0, pace)))
        before, answers = len(sim.contacts), []

        def note(jam, sim=sim, answers=answers):
            answers.append(len(sim.contacts))
            if len(answers) < WINDOWS:  # a command that changes nothing
                sim.set_kind(balls, sim.kinds[sim.bodies == balls][0])
            else:
                sim.remove(next(body for body in jam.bodies if 0 <= body < balls))

        try:
            sim.run(until=frame / 60, max_contacts=100_000, on_jam=note)
        except ZenoError:  # all is at one tick
            answers += [0] * WINDOWS
        most = max(most, [*answers, len(sim.contacts)][0] - before)
        jams += [len(answers)] if answers else []
        if sim.time < frame / 60:
            break
    return most, jams


@pytest.mark.parametrize(
    ("sort", "aimed", "count"),
    [
        *(("discs", True, 150), ("shapes", True, 150), ("discs", False, 250), ("shapes", False, 250)),
        *(("heaps", True, 60), ("heaps", False, 60)),
    ],
)
@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.own_loop
def test_a_frame_with_a_squeeze_had_half_a_million_contacts(sort, aimed, count):
    """A run has its answer in some 10^4 contacts. A jam is right if it goes on for more than a window; of a
    hundred one may end after it, by rounding."""
    found = [steered(seed, sort, aimed) for seed in range(count)]
    jams = Counter(windows for _, each in found for windows in each)
    print(sort, aimed, max(most for most, _ in found), dict(jams))
    assert max(most for most, _ in found) < 50_000
    assert jams.total() > count // 10
    assert jams[1] <= 1 + jams.total() // 100
