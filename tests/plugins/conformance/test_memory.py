"""Checks of memory: each trespass is named with hook and field, and what is allowed passes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import kinetile as kt
import trespassing_phases
from kinetile.kernel.compiled import INTERPRETED
from kinetile.toolbox import BroadPhaseParts
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks import memory
from kinetile_conformance.checks.check import Check, Observation
from kinetile_conformance.checks.memory import first_breach
from kinetile_conformance.runner import CheckRun
from kinetile_conformance.strategies.gallery import SMALL, smallest
from kinetile_conformance.watched_hooks import Breach, guarded
from lanes import BUILT_IN

TESTS = Path(__file__).parents[2]

SEEN = {
    "uncounts": "repair wrote counts.structural (0, where 1 stood)",
    "tolerates": "repair wrote clock.limits.tolerance (1.0, where ",
    "brakes-another": "near used k.bodies[3], and it has 1 (",
    "brakes-the-fourth": "near wrote bodies[3].vx (0.0625, where ",
    "sets-its-own": "repair wrote queue[0].own, the certificate of body 0, other than by schedule",
    "sets-anothers": "repair wrote queue[1].own, the certificate of body 1, other than by schedule",
    "answers-for-near": "replan wrote near[1] (0, where 1 stood)",
    "drops-offers": "repair wrote queue[1].own, the certificate of body 1, other than by schedule",
    "schedules-in-near": "near wrote queue[0].own (",
    "arranges-the-scene": "arrange wrote the scene's radius",
    "moves-who-comes-soon": "soon wrote places[",
    "mends-in-audit": "audit wrote s.failed",
    "strays": "near used s.failed[1], and it has 1 (trespassing_phases.py, line ",
    "strays-before": "near used s.failed[-2], which is before its beginning (trespassing_phases.py, line ",
    "asks-the-last": "near used k.bodies[-1], which is before its beginning (trespassing_phases.py, line ",
    "asks-one-too-many": "repair used k.bodies[1], and it has 1 (trespassing_phases.py, line ",
    "takes-in-uncounted": "enter wrote counts.structural (",
    "lets-go-one-further": "leave used s.failed[",
    "misspells": "replan raised AttributeError: 'record' object has no attribute 'vz' (trespassing_",
}
ALLOWED = ("strays-where-told", "strays-in-the-kernel", "uses-the-toolbox", "takes-in-and-lets-go")


@pytest.fixture(autouse=True)
def _registered(monkeypatch) -> Iterator[None]:
    kt.registry().add(trespassing_phases)
    if "stripes" not in kt.registry().names("broad phase"):
        monkeypatch.syspath_prepend(TESTS / "foreign" / "kinetile-stripes")
        import kinetile_stripes

        kt.registry().add(kinetile_stripes)
    had = [each.plugin for each in kt.registry() if each.distribution is None]
    yield
    for plugin in dict.fromkeys(had):
        kt.registry().remove(plugin)


def said_by(observation: Observation, name: str, **options) -> str | None:
    """Return what an observation says of a phase, None where its sentence holds."""
    looked = CheckRun(Check(observation), Subject(name, options))
    looked.holds(smallest())
    assert not looked.refused, looked.refusal
    return looked.said


# Interpreted


@pytest.mark.interpreted
@pytest.mark.parametrize("name", SEEN)
def test_a_trespass_is_named_with_hook_and_field(name):
    said = first_breach(Subject(name, {}), SMALL[:5])
    assert said is not None
    assert said.startswith(SEEN[name])
    if name == "uncounts":
        line = trespassing_phases.uncount.__code__.co_firstlineno
        assert f"(it begins in trespassing_phases.py, line {line}), on one body" in said


@pytest.mark.interpreted
@pytest.mark.parametrize("name", ALLOWED)
def test_what_is_allowed_passes(name):
    assert first_breach(Subject(name, {}), SMALL[:5]) is None


def test_every_trespassing_phase_is_tested():
    assert set(trespassing_phases.ALL) == SEEN.keys() | set(ALLOWED)


def test_the_check_sees_a_phase_of_this_process():
    said = said_by(memory.writes_only_where_it_may, "uncounts")
    assert said is not None
    assert said.startswith(SEEN["uncounts"])


@pytest.mark.skipif(INTERPRETED, reason="then there is no need of another interpreter")
def test_a_class_that_cannot_be_imported_goes_by_value():
    class Local:
        def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
            scene.radius.flags.writeable = True
            scene.radius[:] = 0.125
            return BroadPhaseParts(trespassing_phases.everyone)

    class Plugin:
        @kt.hookimpl
        def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
            return [kt.BroadPhaseSpec("local", Local)]

    kt.registry().add(Plugin())
    said = first_breach(Subject("local", {}), SMALL)
    assert said is not None
    assert said.startswith("prepare wrote the scene's radius")


@pytest.mark.long
@pytest.mark.parametrize("name", [*BUILT_IN, "stripes"])
def test_the_phases_that_there_are_touch_nothing_else(name):
    assert said_by(memory.writes_only_where_it_may, name) is None


class Arrays(NamedTuple):
    """Some arrays."""

    line: np.ndarray
    square: np.ndarray


def test_rows_of_rows_and_single_numbers_are_looked_at():
    arrays = guarded(Arrays(np.arange(3), np.zeros((2, 4))), "s", strict=False)
    assert (arrays.line[-1], arrays.square[1][3], arrays.square[-2, -4]) == (2, 0.0, 0.0)
    assert [int(each) for each in arrays.line] == [0, 1, 2]
    assert arrays.line[1:7].tolist() == [1, 2]
    for use, said in (
        (lambda: arrays.line[3], r"s\.line\[3\], and it has 3"),
        (lambda: arrays.line[-4], r"s\.line\[-4\], which is before"),
        (lambda: arrays.square[1][4], r"s\.square\[1\]\[4\], and it has 4"),
        (lambda: arrays.square[0, 4], r"s\.square\[4\], and it has 4"),
    ):
        with pytest.raises(Breach, match=said):
            use()
