"""What the kernel's own audit sees: tables broken by hand, and the sentence about it."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import AuditError
from kinetile.kernel.queue import schedule
from kinetile.run.engine import Engine
from kinetile.toolbox import remove_pair

PHASES = ["naive", "sap-1d", "sap-2d", "sweep-tiling"]


def engine(phase: str = "sap-2d") -> Engine:
    """Three discs near each other in an arena, the first two approaching, and one alone."""
    position = [[0.3, 0.5], [0.55, 0.5], [0.425, 0.7], [0.85, 0.15]]
    velocity = [[0.5, 0.0], [-0.5, 0.0], [0.0, -0.5], [0.0, 1.0]]
    sim = kt.Simulation(kt.Scene(position, velocity, 0.1, arena=(1.0, 1.0)), phase)
    sim._engine.build()
    sim._engine.audit()
    return sim._engine


@pytest.mark.parametrize("phase", PHASES)
def test_runs_of_every_phase_pass(phase):
    scene = kt.make_scene("random", bodies=8, density=0.3, radius_ratio=3.0, mass_ratio=4.0, seed=2)
    sim = kt.Simulation(scene, phase, audit=1)
    sim.run(until=20.0, max_contacts=50)
    assert sim.readings.contacts_disc > 10


@pytest.mark.compiled
@pytest.mark.parametrize("phase", PHASES)
def test_runs_with_turns_pass(phase):
    for seed in range(8):
        scene = kt.make_scene("lattice", bodies=12, turns=20, seed=seed)
        kt.Simulation(scene, phase, audit=1).run(until=4.0, max_contacts=100)


def test_a_place_in_the_queue():
    found = engine()
    found.k.certificates[int(found.k.queue[0].certificate)].place = 1
    with pytest.raises(AuditError, match="does not stand in the queue where it says"):
        found.audit()


def test_the_length_of_the_queue():
    found = engine()
    found.k.clock[0].queued -= 1
    with pytest.raises(AuditError, match=r"the queue has \d+ entries, but \d+ certificates say"):
        found.audit()


def test_the_order_of_the_queue():
    found = engine()
    found.k.queue[0].tick = 2**61
    with pytest.raises(AuditError, match="the queue is out of order"):
        found.audit()


def test_the_order_of_the_queue_at_one_tick():
    found = engine()
    for certificate in found.k.queue.certificate[: int(found.k.clock[0].queued)].copy():
        schedule(found.k, int(certificate), 1000)
    one, two = (int(c) for c in found.k.queue.certificate[:2])
    found.k.queue[0].certificate, found.k.queue[1].certificate = two, one
    found.k.certificates[two].place, found.k.certificates[one].place = 0, 1
    with pytest.raises(AuditError, match="the queue is out of order"):
        found.audit()


def test_the_number_of_pairs():
    found = engine()
    found.k.clock[0].pairs += 1
    with pytest.raises(AuditError, match=r"there are \d+ candidate pairs, but the kernel counts \d+"):
        found.audit()


def test_the_lookup():
    found = engine()
    found.k.lookup[:] = -1
    with pytest.raises(AuditError, match="the lookup does not hold each of the"):
        found.audit()


def test_the_lists_of_the_bodies():
    found = engine("naive")
    table = found.k.certificates
    found.k.bodies[3].first = np.flatnonzero((table.a == 0) & (table.b == 1))[0]
    with pytest.raises(AuditError, match=r"the list of body 3 has the pair \(0, 1\) in it"):
        found.audit()
    found = engine("naive")
    found.k.bodies[0].first = -1
    with pytest.raises(AuditError, match=r"the bodies' lists have \d+ entries for 6 candidate pairs"):
        found.audit()


def test_the_lists_read_backwards():
    found = engine("naive")
    live = np.flatnonzero(found.k.certificates.a >= 0)
    found.k.certificates.prev_a[live] = -1
    found.k.certificates.prev_b[live] = -1
    with pytest.raises(AuditError, match=r"the list of body \d cannot be read backwards"):
        found.audit()


def test_the_free_records():
    found = engine()
    found.k.clock[0].free = -1
    with pytest.raises(AuditError, match=r"of \d+ records for pairs \d+ are taken and 0 free"):
        found.audit()


def test_the_time_of_a_contact_of_two_bodies():
    found = engine("naive")
    found.k.bodies[0].vx = 0.25
    with pytest.raises(AuditError, match=r"the contact of (body 0 and a wall|bodies 0 and 1) is awaited"):
        found.audit()


def test_a_contact_that_is_not_queued():
    found = engine("naive")
    pair = np.flatnonzero((found.k.certificates.a == 0) & (found.k.certificates.b == 1))[0]
    schedule(found.k, int(pair), 2**63 - 1)
    with pytest.raises(AuditError, match=r"bodies 0 and 1 is awaited never, but by their plans they meet at"):
        found.audit()


def test_the_time_of_a_contact_with_a_wall():
    found = engine("naive")
    schedule(found.k, int(found.k.clock[0].structural) + 1 + 3, 77)
    with pytest.raises(AuditError, match="body 3 and a wall is awaited at tick 77, but"):
        found.audit()


def test_an_audit_blames_nobody():
    """A narrow phase that reports an overlap while it is asked again leaves no fault behind."""
    found = engine("naive")
    found.k.bodies[0].x += 0.1
    with pytest.raises(AuditError):
        found.audit()
    assert found.k.clock[0].fault == 0


def test_two_bodies_that_touch_and_are_no_candidates():
    position = [[0.25, 0.5], [0.5, 0.5]]
    sim = kt.Simulation(kt.Scene(position, np.zeros((2, 2)), 0.125, arena=(1.0, 1.0)), "naive")
    sim._engine.build()
    remove_pair(sim._engine.k, 0, 1)
    with pytest.raises(AuditError, match=r"bodies 0 and 1 touch \(gap 0\) and are not a candidate pair"):
        sim._engine.audit()
