"""Hard cases of every kind: losses are reported, jams are reported at once, and nothing drifts."""

import numpy as np
import pytest

import kinetile as kt
from inside import engine_of
from kinetile.errors import AuditError, MissedContactError
from kinetile.kernel.loop.calendar import move
from kinetile.kernel.tables import GUESS, NEVER, PAIR, STRUCTURAL, WALL
from kinetile_plugins.wall import WALLS
from lanes import BUILT_IN, COMPILED, GENERAL, first


def next_pair(sim: kt.Simulation) -> tuple[int, int]:
    while True:
        event = sim.next_event
        assert event is not None
        if event.kind == "disc":
            return event.bodies[0], event.bodies[1]
        sim.step()


def drop(sim: kt.Simulation, body: int, **known: int) -> None:
    """Gives a body this data on contacts, and files it again, like a bug of the kernel or a stray write."""
    k = engine_of(sim).k
    entry = k.queue[body]
    for name, value in known.items():
        entry[name] = value
    wall = entry.wall = int(WALLS[""](k, k.bodies[body])[0])
    key = min(int(entry.certificate), int(entry.tick), wall)
    contact = PAIR if entry.exact else GUESS
    entry.kind = (
        STRUCTURAL if key == entry.certificate else contact if key == entry.tick and key < wall else WALL
    )
    move(k, body, key)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("phase", first(1, [*BUILT_IN]))
def test_in_a_crowd_a_plain_run_tells_as_well(phase):
    """Without an audit a missed contact is noticed if a plan changes while the two overlap: in a crowd."""
    told = 0
    for seed in range(4):
        sim = kt.Simulation(kt.make_scene("grid", bodies=100, density=0.5, seed=seed), phase)
        sim.run(max_contacts=200)
        for body in next_pair(sim):
            drop(sim, body, partner=-1, tick=NEVER, guard=NEVER)
        try:
            sim.run(max_contacts=3000)
        except MissedContactError:
            told += 1
    assert told >= 3


@pytest.mark.compiled
@pytest.mark.parametrize("phase", first(1, [*BUILT_IN[1:]]))
def test_a_bound_that_is_dropped_is_told_by_the_audit(phase):
    for seed in range(4):
        sim = kt.Simulation(kt.make_scene("grid", bodies=49, density=0.5, seed=seed), phase, audit=1)
        sim.run(max_contacts=30)
        drop(sim, int(np.argmin(engine_of(sim).k.queue.certificate)), certificate=NEVER)
        with pytest.raises(AuditError):
            sim.run(max_contacts=0)


def decades(seed: int, radii: float, speeds: float, bodies: int = 24) -> kt.Scene:
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(bodies)))
    cell = 1.0 / side
    place = np.array([(i % side, i // side) for i in range(bodies)])
    radius = 0.45 * cell * 10.0 ** -rng.uniform(0.0, radii, bodies)
    shift = (rng.random((bodies, 2)) - 0.5) * 2.0 * (0.49 * cell - radius[:, None])
    angle = rng.uniform(0.0, 2.0 * np.pi, bodies)
    speed = 10.0 ** -rng.uniform(0.0, speeds, bodies)
    velocity = speed[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return kt.Scene((place + 0.5) * cell + shift, velocity, radius, radius**2, arena=(1.0, 1.0))


MOST, LESS = [(10.0, 10.0), (10.0, 0.0)], [(3.0, 10.0), (0.0, 10.0)]


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("radii", "speeds", "phases"),
    first(1, [(3.0, 10.0, COMPILED), *((*e, GENERAL) for e in MOST), *((*e, BUILT_IN) for e in LESS)]),
)
def test_ten_decades_of_speeds_and_radii_have_one_answer(radii, speeds, phases):
    """Radii over ten decades are beyond what sweep-tiling and power accept."""
    for seed in range(2):
        prints = set()
        for phase in phases:
            sim = kt.Simulation(decades(seed, radii, speeds), phase)
            sim.run(max_contacts=120, until=200.0)
            found = sim.readings
            assert found.contacts_disc + found.contacts_wall > 20
            assert found.unaccounted_energy < 1e-13
            prints.add((sim.fingerprint, sim.positions().tobytes()))
        assert len(prints) == 1, f"seed {seed}"
