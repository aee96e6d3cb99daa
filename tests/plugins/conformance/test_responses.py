"""Responses under the kit: a hook reads the two that meet and gives them new velocities, no more."""

import math
import re

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import BadOption, UnknownName
from kinetile.toolbox import Kernel, Records, ResponseParts, closing_speed, give, hook, shared
from kinetile_conformance import check_broad_phase
from kinetile_conformance.api import replay
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks import check_named
from kinetile_conformance.runner import CheckRun
from lanes import first
from registering import fixture

ALONE = "a-response-depends-on-the-meeting-alone"
ENERGY = "a-response-adds-no-energy-that-says-so"
HOP, PRESSED = "nobody-is-faster-after-a-contact", "-where-bodies-are-pressed"
SETTLES = kt.Response("restitution", e=0.05, contact_time=1e-3, settle=0.5)


@hook
def exchange(k: Kernel, a: int, b: int, nx: float, ny: float, back: float) -> None:
    one = k.bodies[a]
    if b < 0:
        speed = (1.0 + back) * (one.vx * nx + one.vy * ny)
        one.vx -= speed * nx
        one.vy -= speed * ny
        return
    two = k.bodies[b]
    speed = 0.5 * (1.0 + back) * closing_speed(one, two, nx, ny)
    mine, theirs = shared(k.mass[a], k.mass[b], speed), shared(k.mass[b], k.mass[a], speed)
    one.vx += mine * nx
    one.vy += mine * ny
    two.vx -= theirs * nx
    two.vy -= theirs * ny


def mean_speed(k: Kernel) -> float:
    return sum(abs(k.bodies[body].vx) for body in range(len(k.bodies)))


BACK = {
    "right": lambda k, a, b: 1.0,
    "heats": lambda k, a, b: 1.0 + 2.0**-20,
    "favours_a_number": lambda k, a, b: 0.5 if a == 1 else 1.0,
    "favours_the_higher_as_the_first": lambda k, a, b: 0.5 if a > b >= 0 else 1.0,
    "reads_the_clock": lambda k, a, b: 1.0 if k.clock[0].now < 2**43 else 0.5,
    "counts_contacts": lambda k, a, b: 1.0 / (1.0 + k.stamps[a]),
    "reads_others": lambda k, a, b: 1.0 / (1.0 + mean_speed(k)),
    "lets_them_go_on": lambda k, a, b: -1.0,
    "favours_the_first": lambda k, a, b: 1.0,
    "moves": lambda k, a, b: 1.0,
    "parts_what_falls_by_a_fixed_speed": lambda k, a, b: 1.0,
}
"""The parting speed of two bodies, by their closing speed: this hook reads a forbidden value."""


class Trial:
    """A response of one of these kinds; three of them give other velocities or places besides."""

    def __init__(self, how: str = "right") -> None:
        self.how = how

    def prepare(self, scene: kt.Scene) -> ResponseParts:
        how, back = self.how, BACK[self.how]

        @hook
        def respond(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
            exchange(k, a, b, nx, ny, back(k, a, b))
            if how == "favours_the_first":
                k.bodies[a].vx *= 0.5
            if how == "moves":
                k.bodies[a].x += 2.0**-30
            if how == "parts_what_falls_by_a_fixed_speed" and scene.accelerated and b >= 0:
                speed = closing_speed(k.bodies[a], k.bodies[b], nx, ny)
                if speed < 0.5:
                    give(k, a, b, nx, ny, 0.5 * (speed - 0.5))

        return ResponseParts(respond)


_added = fixture(kt.ResponseSpec("trial", Trial, "under test", features=frozenset({"dissipative"})))


def judged(response: kt.Response, *checks: str, broad: str = "naive", examples: int = 8, **more):
    chosen = {"checks": checks or (ALONE, ENERGY), "in_process": True, "shrink": False, "explains": False}
    return check_broad_phase(broad, response=response, examples=examples, **chosen, **more)


@pytest.mark.interpreted
@pytest.mark.parametrize(
    "response",
    first(
        1, [kt.Response("trial"), kt.Response("stop"), kt.Response("restitution", e=0.75, contact_time=1e-3)]
    ),
    ids=lambda each: each.name,
)
def test_a_right_response_is_spared(response):
    report = judged(response)
    assert [result.status for result in report.results] == ["passed", "passed"], str(report)


@pytest.mark.interpreted
def test_what_is_pressed_may_hop_and_settle():
    report = judged(SETTLES, HOP, ALONE + PRESSED, ENERGY + PRESSED)
    assert [result.status for result in report.results] == ["passed"] * 3, str(report)


@pytest.mark.interpreted
def test_what_is_pressed_may_not_part_faster_than_it_has_met():
    report = judged(kt.Response("trial", how="parts_what_falls_by_a_fixed_speed"), HOP)
    assert report.exit_code == 1
    assert "is dissipative, and adds energy to bodies" in report.results[0].said, str(report)


@pytest.mark.small
def test_a_wall_sees_the_energy_of_an_immovable_body():
    scene = kt.Scene([(1, 1), (3, 3)], [(1, 0.5), (0, -1)], 0.25, mass=[math.inf, 1], arena=(4, 4))
    subject = Subject("naive", {}, {}, kt.Response("restitution", e=0.75, contact_time=1e-3))
    run = CheckRun(check_named(ENERGY), subject)
    assert run.holds(subject.dressed(scene)), run.message


@pytest.mark.small
@pytest.mark.parametrize("response", [SETTLES, kt.Response("elastic")], ids=lambda each: each.name)
def test_a_response_all_of_whose_checks_are_skipped_is_not_judged(response):
    """It was said to conform: these scenes have no accelerations that could make a body settle."""
    report = judged(response)
    assert (report.exit_code, report.conforms) == (4, None)
    assert " is not judged: all checks of the response were skipped: " in report.foot


FAULTS = {
    "heats": "a meeting of .* adds .*e-0[678] of energy",
    "moves": "respond wrote bodies.x",
    "favours_the_first": "with the bodies numbered the other way round",
    "favours_the_higher_as_the_first": "with the two exchanged",
    "favours_a_number": "with the (bodies numbered the other way round|two exchanged)",
    "reads_the_clock": "at a later present time",
    "counts_contacts": "with the two exchanged|with nothing in the kernel's other tables",
    "reads_others": "with nobody else there",
    "lets_them_go_on": "0 and .* go on towards each other after it",
}


@pytest.mark.interpreted
@pytest.mark.parametrize("how", first(4, [*FAULTS]))
def test_a_wrong_response_is_found(how, tmp_path):
    report = judged(kt.Response("trial", how=how), examples=16, save_to=tmp_path)
    said = "\n".join(result.said for result in report.results if result.status == "failed")
    assert report.exit_code == 1
    assert re.search(FAULTS[how], said), said
    assert report.foot.endswith(f"naive with trial:how={how} does not conform: {report.failed[0].check}")
    failed = report.failed[0]
    again = replay("naive", failed.case)
    assert (again.check, again.ok) == (failed.check, False)
    assert again.said in failed.said


@pytest.mark.interpreted
def test_broad_phases_agree_under_a_response():
    report = judged(
        kt.Response("trial"),
        "same-contacts",
        "memory-does-not-grow",
        "its-features-are-known",
        broad="cells",
        examples=3,
    )
    assert [result.status for result in report.results] == ["passed", "skipped", "skipped"]
    assert report.results[1].reason == "its scenes have no responses"
    assert report.results[2].reason == "for a broad phase alone: judge it without a response named"


@pytest.mark.small
def test_what_cannot_be_judged_is_an_error():
    with pytest.raises(UnknownName, match="no response is called 'trail'"):
        judged(kt.Response("trail"))
    with pytest.raises(BadOption, match="hwo"):
        judged(kt.Response("trial", hwo="right"))
    (result, *_) = judged(kt.Response("elastic")).results
    assert (result.status, result.reason) == ("skipped", "the kernel itself answers")


@pytest.mark.slow
def test_the_command_judges_a_response():
    line = "conform naive --response restitution:e=0.75,contact_time=0.001 --examples 8 --check"
    done = kinetile(f"{line} {ALONE}", code=0)
    assert done.stdout.splitlines()[-1].startswith(
        "naive with restitution:e=0.75,contact_time=0.001 conforms"
    )
