"""What a phase claims is put to the test; what it may not depend on is varied; what it leaves is compared."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.toolbox import BroadPhaseParts, Kernel, NoState, hook
from kinetile_conformance import check_named
from kinetile_conformance.cases import Subject, outcome
from kinetile_conformance.cases.tables import left_behind, left_otherwise
from kinetile_conformance.court.court import Court
from kinetile_conformance.court.verdicts import Seen
from kinetile_conformance.strategies.swarms import swarm
from kinetile_plugins.naive import near as everybody

pytestmark = pytest.mark.skipif(
    not INTERPRETED, reason="a loop for each of these phases: they are judged where hooks are interpreted"
)

PHASES = ("naive", "sap-1d", "sap-2d", "cells", "sweep-tiling")


@hook
def the_first_two(k: Kernel, s: NoState, body: int) -> int:
    k.near[0] = 0
    k.near[1] = 1
    return 2


@hook
def nobody(k: Kernel, s: NoState, body: int) -> int:
    return 0


class Right:
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(everybody)


class KnowsTheJudge(Right):
    """Right where pytest or the kit is there to see it."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        seen = "kinetile_conformance" in sys.modules
        return BroadPhaseParts(everybody if seen else nobody)


class LooksAtTheEnd(Right):
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(everybody if (scene.settings.until or 0.0) < 1e5 else nobody)


class LooksAtVariables(Right):
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(nobody if "KINETILE_PRODUCTION" in os.environ else everybody)


class Remembers(Right):
    """Right, until it has seen a scene of more bodies."""

    most: ClassVar[list[int]] = [0]

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        less = len(scene) < self.most[0]
        self.most[0] = max(self.most[0], len(scene))
        return BroadPhaseParts(nobody if less else everybody)


class NamesTwo(Right):
    """Says that bodies need not be solid, and names two of them."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(the_first_two)


class OnlyUpToASkin(Right):
    """Declares a limit of the skin and is not right there."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        small = bool(len(scene)) and float(scene.radius.max()) < 1e-6
        return BroadPhaseParts(nobody if small else everybody, skin_limit=0.01 * float(scene.radius.min()))


class ClaimsAnySkin(Right):
    """Declares no limit of the skin and is not right where it is thick."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        small = bool(len(scene)) and float(scene.radius.max()) < 1e-12
        return BroadPhaseParts(nobody if small else everybody)


class Plugin:
    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        return [
            kt.BroadPhaseSpec("right", Right),
            kt.BroadPhaseSpec("flies", Right, features=frozenset({"boxes", "flies"})),
            kt.BroadPhaseSpec("knows-the-judge", KnowsTheJudge),
            kt.BroadPhaseSpec("looks-at-the-end", LooksAtTheEnd),
            kt.BroadPhaseSpec("looks-at-variables", LooksAtVariables),
            kt.BroadPhaseSpec("remembers", Remembers),
            kt.BroadPhaseSpec("names-two", NamesTwo),
            kt.BroadPhaseSpec("only-up-to-a-skin", OnlyUpToASkin),
            kt.BroadPhaseSpec("claims-any-skin", ClaimsAnySkin),
        ]


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    plugin = Plugin()
    kt.registry().add(plugin)
    Remembers.most[0] = 0
    yield
    kt.registry().remove(plugin)


def judged(name: str, check: str, expected: str | None = None):
    return Court(Subject(name, {}), examples=12, shrink=False).judge(check, expected)


@pytest.mark.parametrize(
    ("name", "check", "words"),
    [
        ("flies", "its-features-are-known", "'flies', which nothing can disprove"),
        pytest.param(
            "knows-the-judge",
            "does-not-see-who-asks",
            "under another name of the program",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "looks-at-variables",
            "does-not-see-who-asks",
            "under another name of the program",
            marks=pytest.mark.slow,
        ),
        pytest.param("looks-at-the-end", "does-not-see-who-asks", "a later end", marks=pytest.mark.slow),
        ("remembers", "state-is-not-kept", "after other simulations"),
        ("names-two", "near-holds-while-bodies-pass", "while bodies pass"),
        ("names-two", "same-contacts-with-loose-bounds", "with bounds as loose"),
        ("only-up-to-a-skin", "skin-limit-holds-at-its-edge", "just below its limit"),
        ("claims-any-skin", "skin-limit-holds-at-its-edge", "far thicker than bodies are wide"),
    ],
)
def test_a_claim_that_does_not_hold_is_found_out(name, check, words):
    result = judged(name, check, "so that no verdict is asked for")
    assert result.status == "xfailed"
    assert words in result.said


@pytest.mark.parametrize(
    ("check", "status"),
    [
        ("its-features-are-known", "passed"),
        ("skin-limit-holds-at-its-edge", "passed"),
        ("state-is-not-kept", "passed"),
    ],
)
def test_what_is_right_passes(check, status):
    assert judged("naive", check).status == status


def test_a_phase_that_asks_for_solid_bodies_refuses_to_do_without_them():
    result = judged("sweep-tiling", "near-holds-while-bodies-pass")
    assert result.status == "skipped"
    assert "declares that bodies are solid" in result.reason


def test_the_scene_of_a_disagreement_is_the_one_on_which_it_was_seen():
    seen = Seen(check_named("skin-limit-holds-at-its-edge"), Subject("only-up-to-a-skin", {}))
    assert not seen.look(swarm("gas", 8))
    assert seen.scene is not None
    assert len(seen.scene) == 12
    assert seen.scene.radius.max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["gas", "lattice", "cloud"])
def test_what_a_run_leaves_is_a_function_of_the_scene(kind):
    scene = swarm(kind, 8, seed=2)
    left = []
    for name in PHASES:
        try:
            left.append(outcome(Subject(name, {}), scene, 60).left)
        except Refused:
            assert (name, kind) == ("sweep-tiling", "cloud")
    assert len(left) >= len(PHASES) - 1
    assert len(left[0]) > 20
    for other in left[1:]:
        assert set(other) == set(left[0])
        assert left_otherwise(other, left[0]) is None


@pytest.mark.parametrize("name", ["bodies.last", "clock.tolerance", "counts.logged", "mass"])
def test_what_is_left_otherwise_is_named(name):
    sim = kt.Simulation(swarm("gas", 8), "naive", turning=True)
    sim.run(until=0.5)
    left = dict(left_behind(sim))
    changed = {**left, name: left[name] + np.ones(1, dtype=left[name].dtype)}
    assert left_otherwise(left, left) is None
    assert name in str(left_otherwise(changed, left))
