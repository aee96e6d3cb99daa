"""What a phase claims is put to the test; what it may not depend on is varied; what it leaves is compared."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest

import kinetile as kt
from hostile_phases import nobody
from kinetile.comparison import find_divergence
from kinetile.toolbox import BroadPhaseParts, Kernel, NoState, hook
from kinetile_conformance import check_named
from kinetile_conformance.cases import RunOutcome, Subject, difference, table_difference, tables_after
from kinetile_conformance.checks import claims
from kinetile_conformance.runner import CheckRun, JudgingPlan, Runner
from kinetile_conformance.strategies.swarms import swarm
from kinetile_plugins.naive import near as everybody
from registering import registered

pytestmark = pytest.mark.interpreted


@hook
def the_first_two(k: Kernel, s: NoState, body: int) -> int:
    k.near[0] = 0
    k.near[1] = 1
    return 2


def phase(right, skin=None):
    """Returns a phase that is right for the scenes, and the hash of a string; a function claims it."""

    class Chosen:
        def __init__(self, hashed: int = 0) -> None:
            self.hashed = hashed

        def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
            limit = None if skin is None else skin * float(scene.radius.min())
            return BroadPhaseParts(everybody if right(scene, self.hashed) else nobody, skin_limit=limit)

    return Chosen


class NamesTwo:
    """Says that bodies need not be solid, and names two of them."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(the_first_two)


SEEN: list[int] = []


def sees_no_less(scene: kt.Scene, hashed: int) -> bool:
    SEEN.append(len(scene))
    return len(scene) == max(SEEN)


def is_main(scene: kt.Scene, hashed: int) -> bool:
    return threading.current_thread() is threading.main_thread()


def widest(scene: kt.Scene) -> float:
    return float(scene.radius.max()) if len(scene) else 1.0


PHASES = {
    "right": phase(lambda scene, hashed: True),
    "looks-at-the-end": phase(lambda scene, hashed: (scene.settings.until or 0.0) < 1e5),
    "looks-at-the-thread": phase(is_main),
    "looks-at-a-hash": phase(lambda scene, hashed: hash("a body") == hashed),
    "remembers": phase(sees_no_less),
    "names-two": NamesTwo,
    "only-up-to-a-skin": phase(lambda scene, hashed: widest(scene) >= 1e-6, skin=0.01),
    "claims-any-skin": phase(lambda scene, hashed: widest(scene) >= 1e-12),
}
FLIES = kt.BroadPhaseSpec("flies", PHASES["right"], features=frozenset({"boxes", "flies"}))


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    SEEN.clear()
    with registered(FLIES, *(kt.BroadPhaseSpec(name, each) for name, each in PHASES.items())):
        yield


def judged(name: str, check: str, **options):
    return Runner(JudgingPlan(Subject(name, options), examples=50, shrink=False, explains=False)).run(check)


@pytest.mark.parametrize(
    ("name", "check", "words"),
    [
        ("flies", "its-features-are-known", "'flies', which nothing can disprove"),
        ("remembers", "state-is-not-kept", "after half radii, "),
        pytest.param(
            "names-two", "its-structure-is-true-while-all-pass", "is not near", marks=pytest.mark.slow
        ),
        ("names-two", "its-structure-is-true", "is not near"),
        pytest.param(
            "only-up-to-a-skin",
            "skin-limit-holds-at-its-edge",
            "just below its limit",
            marks=pytest.mark.slow,
        ),
        ("claims-any-skin", "skin-limit-holds-at-its-edge", "far thicker than bodies are wide"),
    ],
)
def test_a_claim_that_does_not_hold_is_found_out(name, check, words):
    result = judged(name, check)
    assert result.status == "failed"
    assert words in result.said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        pytest.param("right", "", marks=pytest.mark.slow),
        pytest.param("looks-at-the-end", "with another origin and a later end, the ", marks=pytest.mark.slow),
        pytest.param("looks-at-the-thread", "in another thread, the ", marks=pytest.mark.slow),
        ("looks-at-a-hash", "in another process, the "),
    ],
)
def test_who_asks_is_found_out(name, words, monkeypatch):
    monkeypatch.setattr(claims, "_scenes", lambda: [swarm("gas", 8)])
    options = {"hashed": hash("a body")} if name == "looks-at-a-hash" else {}
    result = judged(name, "does-not-see-who-asks", **options)
    assert result.ok is not bool(words)
    assert result.said.startswith(words)


def test_a_phase_that_asks_for_solid_bodies_refuses_to_do_without_them():
    result = judged("sweep-tiling", "its-structure-is-true-while-all-pass")
    assert result.status == "skipped"
    assert "it refuses all scenes of this check: " in result.reason


def test_the_scene_of_a_disagreement_is_the_one_on_which_it_was_seen():
    seen = CheckRun(check_named("skin-limit-holds-at-its-edge"), Subject("only-up-to-a-skin", {}))
    assert not seen.holds(swarm("gas", 8))
    assert seen.scene is not None
    assert len(seen.scene) == 12
    assert seen.scene.radius.max() < 1e-6


def test_another_end_was_told_as_with_ran_at_time():
    sim = kt.Simulation(swarm("gas", 8), "naive", turning=True)
    expected, found = RunOutcome.of(sim), RunOutcome.of(sim, "LateContact: it is late")
    text = "sap-1d ended at time 0.0 with LateContact: it is late; naive ran to time 0.0"
    assert difference(found, expected, "sap-1d") == text
    assert "ran to time 0.0" in str(find_divergence("naive", "sap-1d", expected, found))


@pytest.mark.parametrize("name", ["bodies.last", "clock.limits.tolerance", "counts.turns", "mass"])
def test_what_is_left_otherwise_is_named(name):
    sim = kt.Simulation(swarm("gas", 8), "naive", turning=True)
    sim.run(until=0.5)
    left = dict(tables_after(sim))
    changed = {**left, name: left[name] + np.ones(1, dtype=left[name].dtype)}
    assert table_difference(left, left) is None
    assert name in str(table_difference(changed, left))
