"""Next contacts: as the run has it then, by the definition in integers, and under every phase."""

from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from agreement import ALL
from kinetile.errors import KinetileError, Refused
from kinetile_conformance.strategies import scenes
from lanes import examples

EVENTS = 5


@settings(max_examples=examples(10), deadline=None)
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
    assert sim.cast((3.0, 1.0, 0.0), (0.0, 0.0)) == (1.75, 1, 3 << 50, 0, 0.0), "a point"
    assert sim.cast((3.0, 1.0, 0.25), (0.0, -1.0), kinds="wall") == (0.75, 0, 3 << 50, -3, 0.75)
    with pytest.raises(Refused, match="of disc none is for walls, and bodies would leave"):
        kt.Simulation(scene, "naive", narrow_phases=("disc",))  # discs flew out through the walls


def test_late_on_the_clock_the_contact_is_the_row_of_the_log():
    """Beyond many shifts of the clock's base, and from a start that is not 0."""
    scene = row(0.0, -(2.0**-8), arena=(4.0, 4.0), start=3.5)
    sim = kt.Simulation(scene, "naive")
    for _ in range(12):
        awaited = min(filter(None, map(sim.next_contact_of, range(2))), key=lambda each: each[1:3])
        sim.run(max_contacts=1)
        assert sim.contacts[-1].item() == awaited
    assert sim.time > 2048.0
