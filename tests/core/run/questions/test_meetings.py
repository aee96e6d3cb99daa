"""Who will meet whom: as the run has it then, by the definition in integers, and under every phase."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from agreement import PHASES, TILING
from encounters import true_touch
from kinetile.errors import KinetileError, Refused
from kinetile.kernel.log import WALLS
from kinetile.kernel.tables import NEVER
from kinetile.run.questions.meetings import CastHit, NextContact, next_contact_of
from kinetile_conformance.strategies import scenes

EVENTS = 5


def row_of(event: kt.Event) -> NextContact:
    """Return an event as the contact that it is, without its wall, which nobody knows before."""
    return NextContact(*event[:3], event.bodies[0], event.bodies[1] if len(event.bodies) > 1 else -1)


def in_order(contact: NextContact) -> tuple:
    """Return where a contact stands in the order of events."""
    return contact.epoch, contact.tick, contact.b >= 0, contact.a, contact.b


def stages(scene: kt.Scene):
    """Yield a simulation after each of its first contacts and turns."""
    try:
        sim = kt.Simulation(scene, "naive")
    except Refused:
        return
    yield sim
    try:
        for event in sim.steps(until=8.0):
            if event.kind != "structural":
                yield sim
            if sim.readings.events - sim.readings.structural_events >= EVENTS:
                return
    except KinetileError:
        return


def by_definition(sim: kt.Simulation, a: int, b: int) -> int:
    """Return the kernel's tick at which two bodies meet by their plans."""
    bodies = sim.tables.bodies
    one, two = sorted((bodies[a], bodies[b]), key=lambda body: int(body.anchor))
    elapsed, tick = int(two.anchor - one.anchor), float(sim.tables.clock[0].tick)
    plans = (
        [float(v) for v in (one.x, one.y, one.vx, one.vy)],
        [float(v) for v in (two.x, two.y, two.vx, two.vy)],
    )
    delay = true_touch(*plans[0], elapsed, *plans[1], float(one.radius), float(two.radius), tick)
    return NEVER if delay == NEVER else int(two.anchor) + delay


@settings(max_examples=10, deadline=None)
@given(scene=scenes())
def test_two_bodies_meet_when_their_plans_say(scene):
    for sim in stages(scene):
        bodies = sim.tables.bodies
        for a, b in combinations(range(len(scene)), 2):
            tick = by_definition(sim, a, b)
            if bodies[a].last == b and bodies[b].last == a:
                tick = NEVER
            found = sim.next_contact(a, b)
            assert found == sim.next_contact(b, a)
            if tick == NEVER:
                assert found is None
            else:
                clock = sim._engine.clock
                assert found == (*clock.moment(clock.total(tick)), a, b)


@settings(max_examples=10, deadline=None)
@given(scene=scenes())
def test_the_next_contact_of_the_run_is_the_first_that_is_scheduled(scene):
    for sim in stages(scene):
        firsts = [sim.next_contact_of(body, scheduled=True) for body in range(len(scene))]
        firsts = [contact for contact in firsts if contact is not None]
        ahead = sim.next_event
        if ahead is None:
            assert firsts == []
        elif ahead.kind in ("disc", "wall"):
            first = min(firsts, key=in_order)
            assert row_of(ahead) == first._replace(b=max(first.b, -1))
            if ahead.kind == "wall":  # and which wall it is
                step = sim.step()
                assert first == sim.contacts[-1].item()
                assert WALLS[first.b] == step.wall


@pytest.mark.small
@settings(max_examples=10, deadline=None)
@given(scene=scenes(turns=False))
def test_the_first_of_a_body_is_the_first_of_its_pairs(scene):
    for sim in stages(scene):
        for body in range(len(scene)):
            pairs = [sim.next_contact(body, other) for other in range(len(scene)) if other != body]
            pairs = [pair for pair in pairs if pair is not None]
            first = sim.next_contact_of(body)
            if first is not None and first.b < 0:
                assert all(in_order(first) < in_order(pair) for pair in pairs)
            else:
                assert first == min(pairs, key=in_order, default=None)
            scheduled = sim.next_contact_of(body, scheduled=True)
            assert scheduled in (None, first)
            if first is not None and first.b >= 0:
                mutual = sim.next_contact_of(first.a) == first == sim.next_contact_of(first.b)
                assert (scheduled == first) == mutual
                assert sim.next_contact(first.b, first.a, scheduled=True) == scheduled


@pytest.mark.small
@settings(max_examples=8, deadline=None)
@given(scene=scenes(), until=st.sampled_from([0.25, 1.0]))
def test_answers_are_the_same_under_every_phase(scene, until):
    seen = set()
    for phase, options in PHASES + TILING:
        try:
            sim = kt.Simulation(scene, phase, options=options)
            sim.run(until=until, max_contacts=EVENTS)
        except KinetileError:
            continue
        bodies = range(len(scene))
        seen.add(
            repr(
                [
                    *(sim.next_contact_of(body, scheduled=said) for body in bodies for said in (False, True)),
                    *(sim.next_contact(a, b) for a, b in combinations(bodies, 2)),
                    sim.cast((1.0, 1.0, 0.25), (0.5, 1.0)),
                    sim.bodies_in((0.0, 0.0, 2.0, 1.0)).tolist(),
                    sim.bodies_near((1.0, 1.0), k=4).tolist(),
                    sim.ray((0.5, 0.5), (1.0, 0.5)),
                ]
            )
        )
    assert len(seen) <= 1


@settings(max_examples=10, deadline=None)
@given(scene=scenes(turns=False), data=st.data())
def test_a_cast_disc_meets_whom_a_body_would(scene, data):
    """The last body of a scene, and a disc that starts where it does when it is not there."""
    *others, last = range(len(scene))
    kept = [scene.position[:-1], scene.velocity[:-1], scene.radius[:-1], scene.mass[:-1]]
    full, less = kt.Simulation(scene, "naive"), kt.Simulation(kt.Scene(*kept, arena=scene.arena), "naive")
    if full.time_unit != less.time_unit:
        return
    met = [full.next_contact(last, other) for other in others]
    first = min((contact for contact in met if contact is not None), key=in_order, default=None)
    disc = (*scene.position[last].tolist(), float(scene.radius[last]))
    hit = less.cast(disc, scene.velocity[last])
    assert hit == (None if first is None else CastHit(*first[:4]))


cast_numbers = st.integers(-8, 40).map(lambda i: i / 8)


@settings(max_examples=10, deadline=None)
@given(
    scene=scenes(),
    x=cast_numbers,
    y=cast_numbers,
    radius=st.sampled_from([0.0, 0.125, 0.5]),
    velocity=st.tuples(cast_numbers, cast_numbers),
)
def test_a_cast_disc_meets_whom_the_definition_says(scene, x, y, radius, velocity):
    for sim in stages(scene):
        k, clock = sim.tables, sim._engine.clock
        now, ticks = int(k.clock[0].now), []
        for number, body in enumerate(k.bodies):
            plan = [float(v) for v in (body.x, body.y, body.vx, body.vy)]
            elapsed, tick = now - int(body.anchor), float(k.clock[0].tick)
            delay = true_touch(*plan, elapsed, x, y, *velocity, float(body.radius), radius, tick)
            ticks += [(now + delay, number)] if delay != NEVER else []
        hit = sim.cast((x, y, radius), velocity)
        if not ticks:
            assert hit is None
        else:
            tick, number = min(ticks)
            assert hit == (*clock.moment(clock.total(tick)), number)


def row(*velocities: float, **more) -> kt.Scene:
    """Bodies of radius 1/4 on a line, one apart."""
    n = len(velocities)
    return kt.Scene([[1.0 + i, 1.0] for i in range(n)], [[v, 0.0] for v in velocities], 0.25, **more)


def test_a_contact_that_somebody_precedes_is_not_scheduled():
    sim = kt.Simulation(row(0.5, 0.0, -1.0), "naive")
    assert sim.next_contact(0, 1) == (1.0, 1, 0, 0, 1)
    assert sim.next_contact(0, 1, scheduled=True) is None
    assert sim.next_contact(1, 2) == sim.next_contact(2, 1, scheduled=True) == (0.5, 0, 2**51, 1, 2)
    assert sim.next_contact_of(0) == (1.0, 1, 0, 0, 1)
    assert sim.next_contact_of(0, scheduled=True) is None
    assert sim.next_contact(0, 2) == (1.0, 1, 0, 0, 2)  # the one between them is nobody's business here


def test_a_wall_that_comes_first_precedes_a_contact():
    sim = kt.Simulation(row(-0.75, -1.0, arena=(4.0, 4.0)), "naive")
    assert sim.next_contact(0, 1) == (2.0, 2, 0, 0, 1)
    assert sim.next_contact_of(0, scheduled=True) == (1.0, 1, 0, 0, -1)
    assert sim.next_contact(0, 1, scheduled=True) is None


def test_of_three_at_one_tick_the_first_by_number_is_scheduled():
    sim = kt.Simulation(row(1.0, 0.0, -1.0), "naive")
    assert sim.next_contact_of(1) == sim.next_contact(0, 1, scheduled=True) == (0.5, 0, 2**51, 0, 1)
    assert sim.next_contact_of(2) == (0.5, 0, 2**51, 1, 2)
    assert sim.next_contact_of(2, scheduled=True) is None


@pytest.mark.parametrize(("tick", "stands"), [(0, False), (2**51, False), (2**51 + 1, True)])
def test_a_command_up_to_and_at_the_tick_precedes_it(tick, stands):
    """At one tick plans change before anybody meets."""
    for body in (0, 1):
        turn = kt.Turn(body, tick * 2.0**-52, (0.0, 0.5))
        sim = kt.Simulation(row(1.0, 0.0, commands=[turn]), "naive")
        assert (sim.next_contact(0, 1, scheduled=True) is not None) == stands
        assert (sim.next_contact_of(1, scheduled=True) is not None) == stands
        assert sim.next_contact(0, 1) is not None


def test_who_has_just_met_does_not_meet_again():
    sim = kt.Simulation(row(1.0, -1.0), "naive")
    sim.run(max_contacts=1)
    assert sim.next_contact(0, 1) is None
    assert sim.next_contact_of(0) is None
    sim.set_velocity(1, (-2.0, 0.0))  # at once they are to meet again: the contact is pending
    assert len(sim.contacts) == 1
    assert sim.next_contact(0, 1)[1:] == (*sim.exact_time, 0, 1)
    sim.run(sim.time)
    assert len(sim.contacts) == 2
    assert sim.next_contact(0, 1) is None


def test_a_disc_that_is_cast_from_a_body_leaves_it_and_meets_it_the_other_way():
    sim = kt.Simulation(row(0.0, 0.0), "naive")
    assert sim.cast((1.5, 1.0, 0.25), (1.0, 0.0)) == (0.0, 0, 0, 1)  # touches both, approaches one
    assert sim.cast((1.5, 1.0, 0.25), (-1.0, 0.0)) == (0.0, 0, 0, 0)
    assert sim.cast((1.5, 1.0, 0.0), (-1.0, 0.0)) == (0.25, 0, 2**50, 0)
    assert sim.cast((1.5, 1.0, 0.25), (0.0, 1.0)) is None
    assert sim.cast((1.0, 1.0, 0.5), (0.0, 0.0)) is None


@pytest.mark.small
def test_where_bodies_pass_through_each_other_they_never_meet():
    scene = row(1.0, -1.0, arena=(4.0, 4.0))
    sim = kt.Simulation(scene, "naive", narrow_phases=("wall",))
    assert sim.next_contact(0, 1) is None
    assert sim.next_contact_of(0).b == -2
    assert kt.Simulation(scene, "naive", narrow_phases=("disc",)).next_contact_of(0) == (0.25, 0, 2**50, 0, 1)


def test_late_on_the_clock_the_contact_is_the_row_of_the_log():
    """Beyond many shifts of the clock's base, and from a start that is not 0."""
    scene = row(0.0, -(2.0**-8), arena=(4.0, 4.0), start=3.5)
    sim = kt.Simulation(scene, "naive")
    for _ in range(12):
        awaited = min(filter(None, map(sim.next_contact_of, range(2))), key=in_order)
        sim.run(max_contacts=1)
        assert sim.contacts[-1].item() == awaited
    assert sim.time > 2048.0


def question_all(sim: kt.Simulation, bodies: list[int]) -> list:
    """Return what a simulation answers about bodies, each named by its place in a list."""

    def place(number: int) -> int:
        return bodies.index(number) if number >= 0 else number

    contacts = [sim.next_contact(a, b) for a, b in product(bodies, repeat=2) if a != b]
    contacts += [sim.next_contact_of(body) for body in bodies]
    named = [found and (*found[:3], *sorted((place(found.a), place(found.b)))) for found in contacts]
    hits = [(place(hit.body), hit.distance) for hit in sim.ray((0.0, 0.0), (1.0, 1.0))]
    near = [place(body) for body in sim.bodies_near((1.0, 1.0), k=len(bodies)).tolist()]
    inside = [place(body) for body in sim.bodies_in((0.0, 0.0, 2.0, 2.0)).tolist()]
    return [named, hits, near, inside]


@pytest.mark.small
@settings(max_examples=20, deadline=None)
@given(scene=scenes(turns=False))
def test_bodies_have_their_numbers_and_who_has_gone_is_not_asked(scene):
    """The first body goes and comes again, with the next number, into the slot that it has left."""
    n = len(scene)
    last = np.roll(np.arange(n), -1)
    bodies = {name: getattr(scene, name)[last] for name in ("position", "velocity", "radius", "mass")}
    plain = kt.Simulation(scene.replace(**bodies, unit=scene.time_unit), "naive", live=True)
    sim = kt.Simulation(scene, "naive", live=True)
    sim.remove(0)
    with pytest.raises(IndexError, match="it has gone"):
        sim.next_contact_of(0)
    again = (scene.position[0], scene.velocity[0], float(scene.radius[0]), float(scene.mass[0]))
    assert sim.insert(*again) == n
    assert question_all(sim, [*range(1, n + 1)]) == question_all(plain, [*range(n)])


def test_somebody_who_is_not_asked_about_is_not_met():
    sim = kt.Simulation(row(1.0, 0.0, 0.0), "naive")
    moment = sim._query()
    some = type(moment)(moment.k, moment.slots[[0, 2]], moment.clock, moment.composition)
    assert next_contact_of(some, 0) == (1.5, 1, 2**51, 0, 2)
    assert next_contact_of(moment, 0) == (0.5, 0, 2**51, 0, 1)
