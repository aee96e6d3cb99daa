"""Checks of memory: each trespass is named with hook and field, and allowed access passes."""

import pytest

import kinetile as kt
import trespassing_phases
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.toolbox import BroadPhaseParts
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks import side_effects
from kinetile_conformance.checks.check import Check
from kinetile_conformance.checks.side_effects import first_breach
from kinetile_conformance.runner import CheckRun
from kinetile_conformance.strategies.gallery import small_ones, smallest
from lanes import first
from registering import fixture, registered

OUTSIDE = "raised IndexError: index {} is out of bounds for axis 0 with size 1 (trespassing_phases.py, line "

SEEN = {
    "uncounts": "repair wrote counts.structural (0, where 1 stood)",
    "brakes-the-fourth": "near wrote bodies[3].vx (0.0625, where ",
    "sets-its-own": "repair wrote queue[0].certificate, the certificate of body 0, other than by schedule",
    "sets-anothers": "repair wrote queue[1].certificate, the certificate of body 1, other than by schedule",
    "answers-for-near": "replan wrote near[1] (0, where 1 stood)",
    "drops-offers": "repair wrote queue[1].certificate, the certificate of body 1, other than by schedule",
    "schedules-in-near": "near wrote queue[0].certificate (",
    "arranges-the-scene": "arrange wrote the scene's radius",
    "moves-who-comes-soon": "soon wrote places[",
    "mends-in-audit": "audit wrote s.failed",
    "strays": "near " + OUTSIDE.format(1),
    "asks-the-last": "near raised IndexError: index -1 is below 0, in one of the kernel's tables (",
    "asks-one-too-many": "repair " + OUTSIDE.format(1),
    "takes-in-uncounted": "enter wrote counts.structural (",
    "lets-go-one-further": "leave raised IndexError: index ",
    "misspells": "replan raised AttributeError: 'record' object has no attribute 'vz' (trespassing_",
}
ALLOWED = ("strays-where-told", "strays-in-the-kernel", "uses-the-toolbox", "takes-in-and-lets-go")


_registered = fixture(trespassing_phases)


@pytest.mark.interpreted
@pytest.mark.parametrize("name", first(9, [*SEEN]))
def test_a_trespass_is_named_with_hook_and_field(name):
    said = first_breach(Subject(name, {}), small_ones()[:5])
    assert said is not None
    assert said.startswith(SEEN[name])
    if name == "uncounts":
        line = trespassing_phases.uncount.__code__.co_firstlineno
        assert f"(it begins in trespassing_phases.py, line {line}), on one body" in said


@pytest.mark.interpreted
@pytest.mark.parametrize("name", first(1, ALLOWED))
def test_what_is_allowed_passes(name):
    assert first_breach(Subject(name, {}), small_ones()[:2]) is None


@pytest.mark.interpreted
def test_a_phase_passes_on_shapes():
    assert first_breach(Subject("naive", {}), small_ones()[-1:]) is None


def test_every_trespassing_phase_is_tested():
    assert set(trespassing_phases.ALL) == SEEN.keys() | set(ALLOWED)


@pytest.mark.interpreted
def test_the_check_sees_a_phase_of_this_process():
    looked = CheckRun(Check(side_effects.writes_only_where_it_may), Subject("uncounts", {}))
    assert not looked.holds(smallest())
    assert looked.message.startswith(SEEN["uncounts"])


@pytest.mark.skipif(NOTHING_IS_COMPILED, reason="then there is no need of another interpreter")
def test_a_class_that_cannot_be_imported_goes_by_value():
    class Local:
        def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
            scene.radius.flags.writeable = True
            scene.radius[:] = 0.125
            return BroadPhaseParts(trespassing_phases.everyone)

    with registered(kt.BroadPhaseSpec("local", Local)):
        said = first_breach(Subject("local", {}), small_ones())
    assert said is not None
    assert said.startswith("prepare wrote the scene's radius")
