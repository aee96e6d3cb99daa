"""A wrong broad phase is named: each defect ends in its own typed error with a sentence."""

import math
from dataclasses import fields
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest

import broken_phases
import kinetile as kt
from kinetile.errors import MissedContactError, PhaseError
from kinetile.kernel.compiled import python_of
from kinetile.plugin.protocols import arguments_of
from kinetile.run.compose import accepting, compose_phases
from kinetile.run.simulation import composition_of
from kinetile.toolbox import (
    MY_FAULT,
    NEVER,
    BroadPhaseParts,
    Kernel,
    PairParts,
    Records,
    ResponseParts,
    WallParts,
    blame,
    closing_speed,
    hook,
    schedule,
    shared,
    unchecked,
)
from kinetile_plugins.naive import near as everyone
from lanes import BUILT_IN
from messages import table
from registering import registered

TWO = kt.make_scene("two-discs")


def head_on(partner: bool = False) -> kt.Scene:
    position = [[1.0, 1.0], [2.0, 1.0]]
    velocity = [[1.0, 0.0], [-1.0, 0.0]]
    if partner:
        position.append([1.25, 1.8125])
        velocity.append([0.0, -1.0])
    return kt.Scene(position, velocity, 0.25, arena=(4.0, 4.0))


@pytest.mark.interpreted
def test_a_pair_that_is_reported_when_deep_in_each_other_was_missed():
    sim = kt.Simulation(head_on(partner=True), "adds-when-deep")
    with pytest.raises(MissedContactError, match="overlap more than rounding explains") as caught:
        sim.run(until=4.0)
    assert "'adds-when-deep'" in str(caught.value)
    assert caught.value.time > 0.25


@pytest.mark.interpreted
def test_a_pair_that_is_reported_late_is_named_with_its_time():
    sim = kt.Simulation(head_on(), "adds-too-late")
    with pytest.raises(MissedContactError, match="reported the pair too late") as caught:
        sim.run(until=4.0)
    assert caught.value.bodies == (0, 1)
    assert caught.value.time == 0.5


@pytest.mark.interpreted
def test_a_newcomer_that_repair_does_not_name_is_told_by_the_next_audit():
    sim = kt.Simulation(head_on(), "keeps-a-newcomer-to-itself")
    sim.run(until=0.2)
    said = "bodies 0 and 1 is awaited never at the earliest, but by their plans they meet at tick"
    with pytest.raises(MissedContactError, match=said) as caught:
        sim.audit()
    assert caught.value.bodies == (0, 1)


@pytest.mark.own_loop
@pytest.mark.parametrize(
    ("phase", "why"),
    [("does-not-compile", "temperature"), ("prints", "near_printed calls print.*broken_phases")],
)
def test_a_hook_that_does_not_compile_is_a_phase_error(phase, why):
    """One that prints did compile, kept the lock of the interpreter, and its run never returned."""
    sim = kt.Simulation(head_on(), phase)
    with pytest.raises(PhaseError, match=rf"broad phase '{phase}' .* do not compile.*{why}"):
        sim.run(until=4.0)


@pytest.mark.interpreted
@pytest.mark.parametrize("phase", ["naive", "sap-1d", "cells"])
@pytest.mark.parametrize(
    "more", [{}, {"mass": [1.0, 2.0]}, {"responses": "stop"}, {"arena": (2.0**21, 1.0), "periodic": "xy"}]
)
def test_discs_that_met_on_one_place_went_on_at_no_place(phase, more):
    """Their velocities, and with them their positions and the energy, were no numbers after the error."""
    velocity = [[1.0, 0.0], [-1.0, 0.0]]
    scene = kt.Scene([[1048577.0, 0.5], [1048577.75, 0.5]], velocity, 1e-20, **more)
    sim = kt.Simulation(scene, phase)
    with pytest.raises(PhaseError, match="bodies 0 and 1 has no outcome in finite numbers"):
        sim.run(until=1.0)
    assert len(sim.contacts) == 0
    assert sim.velocities().tolist() == velocity
    assert sim.positions().tolist() == [[1048577.375, 0.5]] * 2
    assert sim.readings.unaccounted_energy == 0.0


class State(NamedTuple):
    """Which of its faults it blames."""

    which: Records  # (1,)


@hook
def soon(k: Kernel, s: State) -> None:
    schedule(k, 0, k.clock[0].now + (1 << 50))


@hook
def give_up(k: Kernel, s: State, body: int) -> int:
    schedule(k, body, NEVER)
    blame(k, MY_FAULT + s.which[0], body, 17)
    blame(k, MY_FAULT, 5, 5)
    return 0


class GivesUp:
    def __init__(self, *, which: int = 0) -> None:
        self.which = which

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        said = ("the table of {a} is full: it has {b} places", "nothing is left of {b}")
        return BroadPhaseParts(everyone, State(np.array([self.which])), soon, give_up, faults=said)


class Faulty:
    def __init__(self, *, faults: object = ()) -> None:
        self.faults = faults

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(everyone, State(np.zeros(1, int)), faults=self.faults)  # type: ignore[arg-type]


@pytest.fixture(autouse=True)
def _registered():
    lax = kt.ResponseSpec("lax", Lax)
    phases = (kt.BroadPhaseSpec("gives-up", GivesUp), kt.BroadPhaseSpec("faulty", Faulty))
    with registered(*broken_phases.SPECS, *phases, lax):
        yield


@pytest.mark.interpreted
@pytest.mark.parametrize("given", [(), ("all is over",), ("{a} and {b:>4}", "{b}")])
def test_sentences_are_taken(given):
    sim = kt.Simulation(kt.make_scene("two-discs"), "faulty", options={"faults": given})
    assert composition_of(sim).broad.faults == given


@hook
def nothing(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    pass


@unchecked
@hook
def slows(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    for body in (a, b):
        if body >= 0 and k.mass[body] < math.inf:
            k.bodies[body].vx *= 0.5
            k.bodies[body].vy *= 0.5


@hook
def no_rebound(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    one, two = k.bodies[a], k.bodies[b]
    speed = 0.5 * closing_speed(one, two, nx, ny)
    mine, theirs = shared(k.mass[a], k.mass[b], speed), shared(k.mass[b], k.mass[a], speed)
    one.vx += mine * nx
    one.vy += mine * ny
    two.vx -= theirs * nx
    two.vy -= theirs * ny


@hook
def takes_five(k, a, b, nx, ny):
    k.bodies[a].vx = -k.bodies[a].vx


@hook
def misspells(k, a, b, nx, ny, rule):
    k.bodies[a].vx = -closing  # noqa: F821


@hook
def explodes(k, a, b, nx, ny, rule):
    one, two = k.bodies[a], k.bodies[b]
    one.vx, one.vy = -1e30 * nx, -1e30 * ny
    two.vx, two.vy = 1e30 * nx, 1e30 * ny


class Lax:
    def __init__(self, how: str = "nothing") -> None:
        self.how = how

    def prepare(self, scene: kt.Scene) -> ResponseParts:
        return ResponseParts(globals()[self.how])


def lax(*columns, how: str = "nothing", **more) -> kt.Scene:
    rules = {("p", "ball"): kt.Response("lax", how=how), ("ball", "wall"): kt.Response("lax", how=how)}
    return kt.Scene(*columns, **{"arena": (10.0, 6.0), "responses": rules, "kind": ["p", "ball"], **more})


RISING = [[5.0, 3.0], [5.125, 1.0]], [[0.0, 0.0], [0.0, 1.0]]
ACROSS = [[9.5, 3.0], [1.5, 3.0]], [[0.0, 0.0], [-1.0, 0.0]]
BARS = {"shapes": [kt.box(2.0, 0.25), kt.disc(0.25)], "shape": [0, 1]}

LETS_CLOSE_IN = {
    "discs": partial(lax, *RISING, 0.25),
    "discs, slowed by a hook without checks": partial(lax, *RISING, 0.25, how="slows"),
    "a disc and one that nothing can move": partial(lax, *RISING, 0.25, [math.inf, 1.0]),
    "a disc that one of infinite mass overtakes": partial(
        lax, [[5.0, 5.0], [5.125, 4.0]], [[0.0, -1.0], [0.0, -0.5]], 0.25, [math.inf, 1.0], how="slows"
    ),
    "a bar and a disc": partial(lax, *RISING, mass=[math.inf, 1.0], **BARS),
    "images of discs": partial(lax, *ACROSS, 0.25, periodic="xy"),
    "images of a bar and a disc": partial(lax, *ACROSS, periodic="xy", **BARS),
    "discs that fall": partial(lax, *RISING, 0.25, gravity=(0.0, -0.0625), responses={("p", "ball"): "lax"}),
    "a disc and a wall": partial(lax, [[2.0, 3.0], [5.0, 1.0]], RISING[1], 0.25),
}


def ended(case: str, phase: str) -> str:
    who, sim = "bodies 0 and 1", kt.Simulation(LETS_CLOSE_IN[case](), phase)
    if "wall" in case:
        who = "body 1 and the top wall"
    with pytest.raises(PhaseError, match=f"response 'lax' of lax .*, lets {who} go on towards") as caught:
        sim.run(until=16.0)
    last = sim.velocities()[1 if "wall" in case else 0 :].tolist()
    assert f"the velocities before it are {last}, and after it [" in str(caught.value)
    assert len(sim.contacts) == 0
    return str(caught.value)


@pytest.mark.parametrize("case", LETS_CLOSE_IN)
def test_what_a_response_left_closing_in_flew_through_each_other(case):
    takes = [phase for phase in BUILT_IN[1::2] if phase in dict(accepting(LETS_CLOSE_IN[case]()))]
    assert len({ended(case, phase) for phase in takes}) == 1
    assert len(takes) > 1


@pytest.mark.slow
@pytest.mark.compiled
def test_a_compiled_loop_ends_before_what_a_response_leaves_closing_in():
    for case in ("images of a bar and a disc", "a disc and a wall"):
        ended(case, "cells")


def test_a_response_is_named_after_commands_and_in_a_run_that_was_saved(tmp_path):
    sim = kt.Simulation(lax(*RISING, 0.25), "cells")
    sim.remove(0)
    assert sim.insert((5.0, 3.0), (0.0, 0.0), 0.25, kind="p") == 2
    sim.run(until=1.0)
    sim.save(tmp_path / "run.kts")
    for each in (sim, kt.resume(tmp_path / "run.kts", "sap-1d")):
        with pytest.raises(
            PhaseError, match=r"for 'ball' and 'p', lets bodies 1 and 2 go on .* \[\[0.0, 1.0\]"
        ):
            each.run(until=8.0)


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("how", "said"),
    [
        (takes_five, r"lax .*: respond takes \(k, a, b, nx, ny\){}; expected \(k, a, b, nx, ny, rule\)$"),
        (misspells, r"^at time 1\.\d+ a hook of response 'lax' of lax .* raised NameError: .*{}$"),
        (explodes, r"response 'lax' of lax .*{} left body \d with a speed of 1e\+30, .* have it add less"),
    ],
)
def test_a_response_was_blamed_on_the_broad_phase_or_on_nobody(how, said):
    """One of five arguments was "broad phase 'cells'", in 1,848 letters, where it was compiled."""
    with pytest.raises(PhaseError, match=said.format(r" \(test_failures\.py, line \d+\)")) as caught:
        kt.Simulation(lax(*RISING, 0.25, how=how.__name__), "cells").run(until=8.0)
    assert len(str(caught.value)) < 400


def test_what_does_not_compile_is_of_the_hook_above_its_line():
    composition = compose_phases(lax(*RISING, 0.25, how="slows"), "cells", None, None)
    line = python_of(slows).__code__.co_firstlineno + 5
    found = composition.author_of(f"No conversion from a to b (tests/core/test_failures.py, line {line}): x")
    assert found.startswith("response 'lax' of lax (")
    assert composition.author_of("no place").startswith("response 'lax' of lax (")
    plain = compose_phases(kt.make_scene("two-discs"), "cells", None, None)
    assert plain.author_of("no place").startswith("broad phase 'cells' of ")


def test_all_hooks_have_their_arguments_in_the_docstring_of_their_parts():
    for parts in (BroadPhaseParts, PairParts, WallParts, ResponseParts):
        hooks = {each.name for each in fields(parts) if str(each.type).startswith("Hook")}
        assert hooks - {*arguments_of(parts)} == set()


def test_what_rounding_leaves_two_bodies_to_close_in_with_is_no_fault():
    """By an exact sign half of the contacts of a response without a rebound would be faults."""
    start = kt.make_scene("random", bodies=12, density=0.2, seed=3, periodic="xy")
    rule = kt.Response("lax", how="no_rebound")
    scene = start.replace(mass=[0.3, 1.0, 7.0] * 4, responses={("*", "*"): rule})
    sim = kt.Simulation(scene, "naive")
    sim.run(max_contacts=20)
    assert len(sim.contacts) == 20


@unchecked
@hook
def returns_more(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    """Returns a share ``rule.first`` of the closing speed, to one before a wall or an immovable body."""
    one = k.bodies[a if b < 0 or k.mass[a] < math.inf else b]
    x, y = (0.0, 0.0) if b < 0 else (k.bodies[b].vx, k.bodies[b].vy)
    if b >= 0 and k.mass[a] == math.inf:
        x, y = k.bodies[a].vx, k.bodies[a].vy
    speed = (1.0 + rule.first) * ((one.vx - x) * nx + (one.vy - y) * ny)
    one.vx -= speed * nx
    one.vy -= speed * ny


class Paddle:
    def __init__(self, e: float) -> None:
        self.e = e

    def prepare(self, scene: kt.Scene) -> ResponseParts:
        return ResponseParts(returns_more, numbers=(self.e,))


@pytest.mark.parametrize("mass", [(math.inf, 1.0), (1.0, math.inf)])
def test_a_dissipative_response_that_gained_energy_went_unremarked(mass):
    """It is the energy that an immovable body sees: a moving one may make the bodies that it meets faster."""
    places, speeds = [[2.0, 3.0], [4.0, 3.0]], [[0.5, 0.0], [-0.25, 0.0]]
    paddle = kt.ResponseSpec("paddle", Paddle, features=frozenset({"dissipative"}))
    with registered(paddle, kt.ResponseSpec("pump", Paddle)):
        for name, e in (("paddle", 1.0), ("pump", 2.0), ("paddle", 1.0 + 2.0**-30)):
            rule = kt.Response(name, e=e)
            scene = kt.Scene(places, speeds, 0.25, mass, (10.0, 6.0), responses={("*", "*"): rule})
            sim = kt.Simulation(scene, "naive")
            if e == 1.0 or name == "pump":
                sim.run(max_contacts=3)
                continue
            with pytest.raises(
                PhaseError, match="is dissipative, and adds energy to bodies 0 and 1: the vel"
            ):
                sim.run(max_contacts=3)
            assert sim.velocities().tolist() == speeds
            assert len(sim.contacts) == 0


def test_only_a_response_of_another_plugin_is_checked():
    def respond(rule):
        made = compose_phases(lax(*RISING, 0.25, responses={("*", "*"): rule}), "cells", None, None)
        return made.parts(), made.rules.hooks

    found, hooks = respond("stop")
    assert (found["FOREIGN"], [found["respond_1"], found["respond_2"]]) == (False, [*hooks])
    found, (*own, _) = respond("lax")
    assert (found["FOREIGN"], [found["respond_1"], found["respond_2"]]) == (True, own)
    assert found["respond_3"] is not nothing


test_message = table(globals())
