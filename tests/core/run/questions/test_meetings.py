"""Who will meet whom: as the run has it then, by the definition in integers, and under every phase."""

from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from agreement import ALL
from encounters import true_touch
from kinetile.errors import KinetileError, Refused
from kinetile.kernel.tables import NEVER
from kinetile.run.questions.meetings import NextContact
from kinetile_conformance.strategies import scenes
from lanes import examples

EVENTS = 5


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
    """And the first of a body is the first of its pairs, unless a wall or a command is before it."""
    for sim in stages(scene):
        bodies, everybody = sim.tables.bodies, range(len(scene))
        pairs = {}
        for a, b in combinations(everybody, 2):
            tick = by_definition(sim, a, b)
            if bodies[a].last == b and bodies[b].last == a:
                tick = NEVER
            found = sim.next_contact(a, b)
            assert found == sim.next_contact(b, a)
            if tick == NEVER:
                assert found is None
            else:
                pairs[a, b] = (*sim._engine.clock.moment(sim._engine.clock.total(tick)), a, b)
                assert found == pairs[a, b]
        for body in everybody:
            first = sim.next_contact_of(body)
            own = [NextContact(*each) for pair, each in pairs.items() if body in pair]
            if first is not None and first.b < 0:
                assert all(in_order(first) < in_order(pair) for pair in own)
            else:
                assert first == min(own, key=in_order, default=None)


@settings(max_examples=examples(20), deadline=None)
@given(scene=scenes(), until=st.sampled_from([0.25, 1.0]))
def test_answers_are_the_same_under_every_phase(scene, until):
    seen = set()
    for phase, options in ALL:
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


@pytest.mark.parametrize(("tick", "stands"), [(0, False), (2**51, False), (2**51 + 1, True)])
def test_a_command_up_to_and_at_the_tick_precedes_it(tick, stands):
    """At one tick plans change before anybody meets."""
    for body in (0, 1):
        turn = kt.Turn(body, tick * 2.0**-52, (0.0, 0.5))
        sim = kt.Simulation(row(1.0, 0.0, commands=[turn]), "naive")
        assert (sim.next_contact(0, 1, scheduled=True) is not None) == stands
        assert (sim.next_contact_of(1, scheduled=True) is not None) == stands
        assert sim.next_contact(0, 1) is not None


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
