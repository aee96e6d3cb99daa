"""Responses at contacts: passing to the tick, losses, stops, bodies that nothing can move."""

import math

import pytest

import kinetile as kt
from kinetile.errors import PhaseError, SceneError, ZenoError
from kinetile.plugin.protocols import check_parts
from kinetile.run.compose import CommandSupport, compose_phases
from kinetile.toolbox import ResponseParts, hook
from kinetile_conformance.strategies.kinds import ABSENT, SAME_LOOP
from lanes import BUILT_IN, GENERAL
from registering import registered

LOSSY = kt.Response("restitution", e=0.5, contact_time=1e-6)


def ruled(*columns, responses=None, **more) -> kt.Scene:
    """Returns a scene with the same loop as all others here."""
    rules = responses if isinstance(responses, dict) else {("*", "*"): responses or "elastic"}
    kinds = dict.fromkeys([*more.get("kind", [0]), *ABSENT])
    return kt.Scene(*columns, responses={**SAME_LOOP, **rules}, kinds=kinds, **more)


def played(scene: kt.Scene, phase: str, **more) -> kt.Simulation:
    return kt.Simulation(scene, phase, live=True, **more)


def balanced(sim: kt.Simulation) -> bool:
    """Whether every passing that has begun has ended, but for those that are under way."""
    met = [(int(a), int(b)) for a, b in sim.contacts[["a", "b"]].tolist() if b >= 0]
    begun = sim.readings.passings
    ended = sum(b < a for a, b in met)
    return begun - ended == int(sim.tables.clock[0].lists.passings)


@pytest.mark.parametrize("phase", BUILT_IN)
@pytest.mark.parametrize(
    ("response", "velocities", "mass", "expected"),
    [
        (LOSSY, [[1.0, 0.0], [0.0, 0.0]], [1.0, 3.0], [[-0.125, 0.0], [0.375, 0.0]]),
        ("stop", [[1.0, 0.25], [-0.5, 0.25]], [1.0, 3.0], [[0.0, 0.0], [0.0, 0.0]]),
        ("elastic", [[1.0, 0.0], [-0.5, 0.0]], [1.0, math.inf], [[-2.0, 0.0], [-0.5, 0.0]]),
    ],
    ids=["restitution gives back a share", "stop ends both", "infinite mass is moved by nobody"],
)
def test_a_contact_of_two(response, velocities, mass, expected, phase):
    scene = ruled([[1.0, 1.0], [3.0, 1.0]], velocities, 0.5, mass, (6.0, 2.0), responses=response)
    sim = played(scene, phase)
    sim.run(max_contacts=1)
    assert sim.velocities().tolist() == expected
    assert response == "stop" or sim.readings.unaccounted_energy == 0.0
    if response == "stop":
        sim.run(until=5.0)
        assert len(sim.contacts) == 1


def test_one_that_stops_at_what_nothing_can_move_is_at_rest_beside_it():
    for mass, speed in (([1.0, math.inf], -0.5), ([math.inf, 1.0], 1.0)):
        scene = ruled([[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [-0.5, 0.0]], 0.5, mass, responses="stop")
        sim = played(scene, "naive")
        sim.run(max_contacts=1)
        assert sim.velocities().tolist() == [[speed, 0.0]] * 2


def test_a_wall_gives_back_a_share_and_contacts_close_together_lose_nothing():
    ball = {"position": [[1.0, 1.0]], "velocity": [[0.0, -1.0]], "radius": 0.5, "arena": (2.0, 2.0)}
    for contact_time, speeds in ((1e-6, [0.5, 0.25]), (10.0, [0.5, 0.5])):
        rule = kt.Response("restitution", e=0.5, contact_time=contact_time)
        sim = played(ruled(**ball, responses={("*", "wall"): rule}), "cells")
        found = []
        for _ in speeds:
            sim.run(max_contacts=1)
            found.append(abs(float(sim.velocities()[0][1])))
        assert found == speeds


@pytest.mark.parametrize("first", [True, False])
def test_a_contact_soon_after_another_of_either_body_loses_nothing(first):
    """One meets a wall at time 1 and the other at time 2: that is within a contact time of 1."""
    for contact_time, speeds in ((0.75, [0.25, 0.75]), (1.0, [0.0, 1.0])):
        rule = kt.Response("restitution", e=0.5, contact_time=contact_time)
        bodies = [([1.5, 1.0], [-1.0, 0.0]), ([2.5, 1.0], [0.0, 0.0])][:: 1 if first else -1]
        columns = (list(each) for each in zip(*bodies, strict=True))
        scene = ruled(*columns, 0.5, arena=(8.0, 2.0), responses={(0, 0): rule})
        sim = played(scene, "cells")
        sim.run(max_contacts=2)
        assert sorted(sim.velocities()[:, 0].tolist()) == speeds


def test_restitution_of_1_needs_no_contact_time():
    kt.make_scene("two-discs").replace(responses=kt.Response("restitution", e=1.0))


def test_one_in_the_slot_of_another_has_had_no_contact():
    rule = kt.Response("restitution", e=0.5, contact_time=10.0)
    sim = played(
        ruled([[1.0, 1.0]], [[0.0, -1.0]], 0.5, arena=(2.0, 2.0), responses={(0, "wall"): rule}), "cells"
    )
    sim.run(max_contacts=1)
    sim.remove(0)
    sim.insert((1.0, 1.0), (0.0, -1.0), 0.5)
    sim.run(max_contacts=1)
    assert sim.velocities().tolist() == [[0.0, 0.5]]


def test_a_contact_time_that_the_kernel_forgot_gave_another_answer_than_the_rule():
    """A body's last contact is kept for 2^62 ticks, 1,024 units of the run's clock, whoever comes later."""
    ball = {"position": [[1.0, 1.0]], "velocity": [[0.0, -1.0]], "radius": 0.5, "arena": (2.0, 2.0)}
    for unit in (None, 2.0**-10):
        longest = 1024.0 * (unit or 1.0)
        rule = kt.Response("restitution", e=0.5, contact_time=longest)
        with pytest.raises(SceneError, match=rf"contact_time is {longest}; expected less than {longest}"):
            ruled(**ball, unit=unit, responses={("*", "wall"): rule})
        rule = kt.Response("restitution", e=0.5, contact_time=math.nextafter(longest, 0.0))
        sim = played(ruled(**ball, unit=unit, responses={("*", "wall"): rule}), "cells")
        sim.run(until=0.25)
        sim.insert((1.5, 1.75), (1e3, 0.0), 0.125)  # alone it would have a unit of 2^-10
        assert sim.time_unit == longest / 1024.0


def test_walls_turn_an_immovable_body_and_bodies_of_finite_mass_do_not():
    """Under all phases it meets the walls that it meets alone, and its velocity is the same to the bit."""
    heavy = ([1.0, 1.0], [0.75, 0.5], 0.5, math.inf)
    light = [([3.0, 1.0], [-0.3, 0.1], 0.25, 1.0), ([2.0, 3.0], [0.2, -0.6], 0.25, 3.0)]
    alone = played(ruled(*([each] for each in heavy), (4.0, 4.0)), "naive")
    alone.run(until=20.0)
    walls = alone.contacts["b"].tolist()
    assert set(walls) == {-1, -2, -3, -4}
    found = set()
    for phase in BUILT_IN[::2]:
        sim = played(ruled(*(list(each) for each in zip(heavy, *light, strict=True)), (4.0, 4.0)), phase)
        sim.run(until=20.0)
        met = [b for a, b in sim.contacts[["a", "b"]].tolist() if a == 0]
        assert sum(b > 0 for b in met) > 10
        assert [b for b in met if b < 0] == walls
        assert sim.velocities()[0].tolist() == alone.velocities()[0].tolist()
        found.add(sim.fingerprint)
    assert len(found) == 1


@pytest.mark.parametrize("phase", BUILT_IN)
def test_one_that_is_pushed_faster_than_anybody_was_is_still_met(phase):
    """Two that nothing can move close on a ball between them: its speed has no bound known before the run."""
    scene = ruled(
        [[1.0, 1.0], [2.5, 1.0], [9.0, 1.0]],
        [[2.0, 0.0], [0.0, 0.0], [-2.0, 0.0]],
        0.5,
        [math.inf, 1.0, math.inf],
        (10.0, 2.0),
    )
    sim = played(scene, phase, audit=1)
    sim.run(max_contacts=6)
    expected = played(scene, "naive")
    expected.run(max_contacts=6)
    assert sim.fingerprint == expected.fingerprint
    assert abs(sim.velocities()[1]).max() > 20.0


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("phase", BUILT_IN)
def test_a_narrowing_corridor_ends_with_the_typed_error(phase):
    """A ball between a wall and a piston: the corridor is as wide as the ball at time 7, after infinitely
    many contacts. Each loses a share, but those within the contact time."""
    rule = kt.Response("restitution", e=0.5, contact_time=1e-12)
    scene = ruled(
        [[1.0, 1.0], [5.0, 1.0]],
        [[-1.0, 0.0], [-0.5, 0.0]],
        0.5,
        [1.0, math.inf],
        (6.0, 2.0),
        responses={("*", "*"): rule, ("*", "wall"): rule},
    )
    sim = played(scene, phase)
    with pytest.raises(ZenoError, match="body 0 is squeezed"):
        sim.run(until=100.0)
    assert sim.time == pytest.approx(7.0, abs=1e-9)


@pytest.mark.parametrize("phase", GENERAL)
def test_who_is_inside_at_the_start_or_comes_inside_begins_there_and_ends_when_one_goes(phase):
    scene = ruled(
        [[1.5, 5.0], [1.2, 5.0], [8.0, 8.0]],
        [[0.0, 0.0], [0.2, 0.0], [0.0, 0.0]],
        [0.5, 0.1, 0.3],
        arena=(10.0, 10.0),
        kind=["sensor", "ball", "ball"],
        responses={("ball", "sensor"): "pass"},
        commands=[kt.Insert(1.0, (1.6, 5.2), (0.0, 0.0), 0.05, kind="ball"), kt.Remove(0, 2.0)],
        settings=kt.Settings(until=3.0),
    )
    sim = played(scene, phase)
    kinds = [(event.time, event.kind, event.bodies) for event in sim.steps() if event.kind != "structural"]
    assert sim.contacts[["time", "a", "b"]].tolist() == [(0.0, 0, 1), (1.0, 0, 3), (2.0, 1, 0), (2.0, 3, 0)]
    assert kinds == [
        *[(0.0, "pass", (0, 1)), (1.0, "insert", (3,)), (1.0, "pass", (0, 3))],
        *[(2.0, "part", (0, 1)), (2.0, "part", (0, 3)), (2.0, "remove", (0,))],
    ]
    assert balanced(sim)


def test_a_foreign_response_is_a_plugin_with_one_hook():
    with registered(kt.ResponseSpec("bumper", Bumper)):
        scene = kt.Scene(
            [[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]], 0.5, 1.0, (6.0, 2.0),
            responses=kt.Response("bumper", kick=2.0),
        )  # fmt: skip
        runs = {phase: kt.Simulation(scene, phase, audit=1) for phase in BUILT_IN}
        for sim in runs.values():
            sim.run(until=3.0)
        assert len({sim.fingerprint for sim in runs.values()}) == 1
        assert runs["naive"].velocities().tolist() != [[0.0, 0.0], [1.0, 0.0]]
        assert "bumper" in str(runs["naive"].explain())


@hook
def kick(k, a, b, nx, ny, rule):
    k.bodies[a].vx -= rule.first * nx
    k.bodies[a].vy -= rule.first * ny
    if b >= 0:
        k.bodies[b].vx += rule.first * nx
        k.bodies[b].vy += rule.first * ny


class Bumper:
    def __init__(self, kick: float) -> None:
        self.kick = kick

    def prepare(self, scene):
        return ResponseParts(kick, (self.kick,))


@hook
def tire(k, a, b, nx, ny, rule):
    kick(k, a, b, nx, ny, rule)
    rule.first += 1.0


class Tired(Bumper):
    def prepare(self, scene):
        return ResponseParts(tire, (self.kick,))


@pytest.mark.interpreted
def test_a_response_that_counted_in_its_rule_went_on_otherwise_from_a_file():
    with registered(kt.ResponseSpec("tired", Tired)):
        rules = {("ball", "ball"): "elastic", ("ball", "wall"): kt.Response("tired", kick=2.0)}
        scene = kt.Scene([[1.0, 1.0]], [[1.0, 0.0]], 0.5, arena=(4.0, 2.0), kind="ball", responses=rules)
        for _ in range(2):  # a second run begins with the numbers of the scene
            sim = kt.Simulation(scene, "naive")
            said = r"'tired' of .* \(test_responses.py, line \d+\) has written into its rule: expected a hook"
            with pytest.raises(PhaseError, match=said):
                sim.run(max_contacts=1)
            assert sim.velocities().tolist() == [[-1.0, 0.0]]
            with pytest.raises(PhaseError, match="cannot go on"):
                sim.step()


SEEN: list[tuple[object, ...]] = []


@hook
def look(k, a, b, nx, ny, rule):
    limits, torus, trait = k.clock[0].limits, k.clock[0].torus, k.traits[a]
    SEEN.append((a, k.mass[a], k.bodies[a].radius, trait.kind, k.clock[0].now - trait.touched, rule.first))
    SEEN.append((limits.width, limits.height, torus.x, torus.y))
    kick(k, a, b, nx, ny, rule)


class Looker(Bumper):
    def prepare(self, scene):
        return ResponseParts(look, (self.kick,))


@pytest.mark.interpreted
def test_a_response_finds_what_the_table_of_plugins_says():
    """The mass of a body was in no page."""
    SEEN.clear()
    with registered(kt.ResponseSpec("looker", Looker)):
        scene = kt.Scene(
            [[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]], [0.25, 0.5], [2.0, 3.0], (4.0, 2.0),
            kind=["a", "b"], responses={("*", "*"): kt.Response("looker", kick=4.0)},
        )  # fmt: skip
        kt.Simulation(scene, "naive").run(max_contacts=4)
    (a, *first, _, kicked), arena, (*_, since, _), _ = SEEN
    assert (a, first, kicked) == (0, [2.0, 0.25, 0], 4.0)
    assert arena == (4.0, 2.0, 0.0, 0.0)
    assert 0 < since < 2**53


def test_another_response_of_the_same_family_needs_no_other_loop():
    columns = [[1.0, 1.0], [4.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]], 0.5
    rules = [LOSSY, kt.Response("restitution", e=0.75, contact_time=1e-6), "stop", "elastic"]
    scenes = [kt.Scene(*columns, responses={("*", "*"): each}, kind=["a", "b"]) for each in rules]
    loops = {
        compose_phases(scene, "cells", None, None).loop(CommandSupport.NONE).__qualname__ for scene in scenes
    }
    assert len(loops) == 1


@hook
def nothing(k, a, b, nx, ny, rule):
    """Leaves the two as they are."""


@pytest.mark.parametrize("beside", [(), (nothing,), nothing, (1,)])
def test_what_is_compiled_beside_is_checked(beside):
    parts = ResponseParts(nothing, beside=beside)
    if beside in ((), (nothing,)):
        check_parts("it", parts)
        return
    with pytest.raises(PhaseError, match=r"beside is .*; expected a tuple of functions"):
        check_parts("it", parts)
