"""A toy phase with mutants of every fate: killed, endless, dead, unloadable, and one that nobody sees."""

from __future__ import annotations

import os
import sys

import pytest

import kinetile as kt
from kinetile.errors import BadOption
from kinetile_conformance.mutation.judging import Campaign, passes
from kinetile_conformance.mutation.mutants import mutants_of, source_of
from registering import registered

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="mutants are judged in forks")

TOY = """
import os

from kinetile.toolbox import BroadPhaseParts, hook

WHOLE = 10 // 1


@hook
def near(k, s, body):
    count = 0
    other = 0
    while other < k.clock[0].bodies:
        if other != body:
            k.near[count] = other
            count += 1
        other += 1
    if count > 1000:
        os._exit(3)
    return count


class Toy:
    def prepare(self, scene):
        return BroadPhaseParts(near, room=len(scene) + WHOLE)
"""


@pytest.fixture
def toy(tmp_path, monkeypatch):
    (tmp_path / "toy_phase.py").write_text(TOY, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)

    with registered(kt.BroadPhaseSpec("toy", "toy_phase:Toy")):
        yield source_of("toy")
    sys.modules.pop("toy_phase", None)


def judged(phase, *labels, jobs=1):
    """Judge the mutants of these labels; return what came of each."""
    chosen = [mutant for mutant in mutants_of(phase) if mutant.label in labels]
    assert len(chosen) == len(labels)
    named = {mutant.number: mutant.label for mutant in chosen}
    campaign = Campaign(phase, checks=("same-contacts",), jobs=jobs)
    return {named[row["number"]]: row for row in campaign.judge(chosen)}


@pytest.mark.slow
@pytest.mark.interpreted
def test_every_fate(toy, monkeypatch):
    monkeypatch.setattr("kinetile_conformance.mutation.judging.SECONDS", 2.0)
    fates = {
        "toy_phase.py:6 constant 1 -> 0": ("crashed", ""),
        "toy_phase.py:13 comparison < -> <=": ("killed", "same-contacts"),
        "toy_phase.py:14 condition always true": ("survived", ""),
        "toy_phase.py:14 condition always false": ("killed", "same-contacts"),
        "toy_phase.py:17 constant 1 -> 0": ("hangs", "same-contacts"),
        "toy_phase.py:18 condition always true": ("crashed", "same-contacts"),
    }
    found = judged(toy, *fates, jobs=2)
    assert {label: (each["fate"], each["check"]) for label, each in found.items()} == fates
    assert "ZeroDivisionError" in found["toy_phase.py:6 constant 1 -> 0"]["said"]
    assert found["toy_phase.py:18 condition always true"]["said"] == "its process ended with 3"


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("return count", "return count - 1", "same-contacts: .*"),
        ("count > 1000", "True", "it.* ended with 3"),
    ],
)
def test_a_phase_that_does_not_pass_has_no_mutants(tmp_path, toy, old, new, said):
    (tmp_path / "toy_phase.py").write_text(TOY.replace(old, new), encoding="utf-8")
    with pytest.raises(BadOption, match=f"the phase as it is does not pass.*: {said}"):
        judged(source_of("toy"))


def test_the_authors_own_tests(toy, tmp_path):
    (tmp_path / "own.py").write_text("import toy_phase\nassert toy_phase.WHOLE == 10\n", encoding="utf-8")
    one, other = (
        next(each for each in mutants_of(toy) if each.label == label)
        for label in ("toy_phase.py:6 constant 10 -> 9", "toy_phase.py:11 constant 0 -> 1")
    )
    command = f"cd {tmp_path} && {sys.executable} {tmp_path / 'own.py'}"
    assert passes(None, command)
    assert not passes(one, command)
    assert passes(other, command)
    assert not passes(other, "sleep 60", seconds=0.2)
