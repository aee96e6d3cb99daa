"""Bodies that get another kind, by hand and by commands of a scene (rule 11k)."""

import math

import pytest

import games
import kinetile as kt
from capabilities import outcome
from kinetile.errors import NoRoom, SceneError
from kinetile.scene.files import dumps_scene, loads_scene
from kinetile_accuracy import certify_log
from lanes import GENERAL, first

PASSES = {("wisp", "gate"): "pass"}


def corridor(*commands: kt.SetKind) -> kt.Scene:
    """A body that flies through one gate from 0.6 to 1.4 and through another from 1.6 to 2.4."""
    return kt.Scene(
        [[0.5, 0.5], [1.5, 0.5], [2.5, 0.5]],
        [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
        0.2,
        [1.0, math.inf, math.inf],
        arena=(4.0, 1.0),
        kind=["wisp", "gate", "gate"],
        kinds=["wisp", "gate", "ball"],
        responses=PASSES,
        commands=commands,
    )


def met(sim: kt.Simulation) -> list[tuple[float, int, int]]:
    return [(round(float(time), 6), a, b) for time, _, _, a, b in sim.contacts.tolist()]


@pytest.mark.parametrize("phase", GENERAL)
def test_what_it_passed_it_meets_from_then_on(phase: str) -> None:
    sim = kt.Simulation(corridor(), phase)
    sim.run(1.5)
    sim.set_kind(0, "ball")
    assert sim.kinds.tolist() == ["ball", "gate", "gate"]
    sim.run(2.0)
    assert met(sim) == [(0.6, 0, 1), (1.4, 1, 0), (1.6, 0, 2), (1.8, 0, 1), (2.0, 0, 2)]
    again = kt.Simulation(sim.recorded(), "naive")
    again.run()
    assert outcome(again) == outcome(sim)
    assert certify_log(sim.recorded(), sim.contacts, until=2.0, fingerprint=sim.fingerprint).wrong is None


def test_it_is_an_event_and_a_command_of_scenes_and_files() -> None:
    scene = corridor(kt.SetKind(0, 1.5, "ball"))
    assert loads_scene(dumps_scene(scene)) == scene
    sim = kt.Simulation(scene)
    assert [event.kind for event in sim.steps(until=1.7)] == ["pass", "part", "kind", "disc"]
    assert sim.readings.turns == 1


@pytest.mark.parametrize("live", [False, True])
def test_in_a_passing_it_cannot_become_one_that_does_not_pass_and_goes_on(live: bool) -> None:
    """In a live run a refused command waited, and was refused again by each run from then on."""
    sim = kt.Simulation(corridor(), live=live)
    sim.run(2.0)
    before = outcome(sim)
    with pytest.raises(NoRoom, match=r"at time 2\.0 the kind stays: body 0 is passing through body 2"):
        sim.set_kind(0, "ball")
    assert outcome(sim) == before
    assert sim.recorded().commands == ()
    sim.set_kind(0, "wisp")
    sim.run(2.5)
    assert met(sim)[-1] == (2.4, 2, 0)
    planned = kt.Simulation(corridor(kt.SetKind(0, 1.0, "ball")))
    with pytest.raises(NoRoom, match=r"passing through body 1, which it would meet then"):
        planned.run(3.0)
    assert planned.time == 1.0
    assert met(planned) == [(0.6, 0, 1)]


def test_wrong_kinds_and_bodies_are_named() -> None:
    sim = kt.Simulation(corridor())
    with pytest.raises(ValueError, match=r"'bal' is no kind of this scene.*did you mean 'ball'"):
        sim.set_kind(0, "bal")
    with pytest.raises(IndexError, match="there is no body 3"):
        sim.set_kind(3, "ball")
    with pytest.raises(SceneError) as caught:
        corridor(kt.SetKind(0, 1.0, "bal"), kt.SetKind(1, 1.0, -1))
    assert "commands[0].kind: found 'bal', which is none of the kinds" in str(caught.value)
    assert "commands[1].kind: found -1; expected the name of a kind" in str(caught.value)


def test_runs_stop_and_call_by_the_kinds_of_the_moment() -> None:
    scene = corridor(kt.SetKind(0, 1.5, "ball"))
    sim = kt.Simulation(scene)
    _, event = sim.run(3.0, stop_at=kt.StopAt(kinds=["ball"]))
    assert event is not None
    assert (event.kinds, round(event.time, 6)) == (("ball", "gate"), 1.6)
    sim = kt.Simulation(scene)  # kinds that can be gone through once
    assert sim.run(3.0, stop_at=kt.StopAt(kinds=iter(["ball"]))).event == event
    sim = kt.Simulation(scene)  # beside bodies as well
    assert sim.run(1.7, stop_at=kt.StopAt(bodies=[2], kinds=["ball"])).event == event
    assert kt.Simulation(scene).run(1.55, stop_at=kt.StopAt(bodies=[2], kinds=["ball"]))
    called: list[tuple[str, float]] = []

    def changed(event: kt.Event) -> None:
        called.append((event.kind, round(event.time, 6)))
        if event.kind == "part":
            by_hand.set_kind(0, "ball")

    by_hand = kt.Simulation(corridor())
    calls = {("wisp", "gate"): changed, "ball": changed}
    by_hand.run(2.0, on_contact=calls, on_part=calls)
    assert called == [("pass", 0.6), ("part", 1.4), ("disc", 1.6), ("disc", 1.8), ("disc", 2.0)]
    again = kt.Simulation(by_hand.recorded(), "sap-1d")
    again.run()
    assert outcome(again) == outcome(by_hand)


def test_what_a_support_held_falls_through_it() -> None:
    land = kt.Response("restitution", e=0.1, contact_time=1e-3, settle=0.5)
    scene = kt.Scene(
        [[2.0, 1.0], [2.0, 1.5]],
        [[0.0, 0.0]] * 2,
        mass=[math.inf, 1.0],
        shapes=[kt.box(1.0, 0.2), kt.box(0.2, 0.2)],
        shape=[0, 1],
        arena=(4.0, 4.0),
        gravity=(0.0, -1.0),
        kind=["ledge", "ball"],
        kinds=["ledge", "ball", "fog"],
        responses={("*", "*"): land, ("*", "wall"): land, ("fog", "ball"): "pass"},
    )
    sim = kt.Simulation(scene)
    sim.run(4.0)
    assert list(map(bool, sim.supports())) == [False, True]
    sim.set_kind(0, "fog")
    assert not any(sim.supports())
    sim.run(8.0)
    assert sim.positions()[1].tolist() == pytest.approx([2.0, 0.1])


@pytest.mark.parametrize("seed", first(2, range(300)))
def test_a_drawn_game_has_one_list_under_every_phase(seed: int) -> None:
    game = games.draw_changing_game(seed)
    one = games.play(game)
    for phase in GENERAL[1:]:
        assert games.play(game, phase) == one, phase


def test_a_kind_that_a_rule_alone_names_is_one_and_a_recording_declares_others() -> None:
    by_a_rule = kt.Scene([(1, 1)], [(0, 0)], 0.25, kind="ball", responses={("ghost", "*"): "pass"},
                         commands=[kt.SetKind(0, 1.0, "ghost")])  # fmt: skip
    assert by_a_rule.kinds == ("ball", "ghost")
    sim = kt.Simulation(kt.Scene([(1, 1)], [(0, 0)], 0.25, kinds=["ball", "mark"]), live=True)
    sim.set_kind(0, "mark")
    again = loads_scene(dumps_scene(sim.recorded()))
    assert (again.kinds, again) == (("ball", "mark"), sim.recorded())
