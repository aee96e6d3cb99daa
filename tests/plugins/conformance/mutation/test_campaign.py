"""A toy phase with mutants of every fate: killed, endless, dead, unloadable, and one that nobody sees."""

from __future__ import annotations

import sys

import pytest

import kinetile as kt
from kinetile.errors import BadOption
from kinetile_conformance import CHECKS
from kinetile_conformance.mutation.campaign import FEW, Round, campaign, rounds_of
from kinetile_conformance.mutation.findings import Finding, Findings
from kinetile_conformance.mutation.judging import FIRST, LONG, order_of_checks
from kinetile_conformance.mutation.mutants import mutants_of, sample
from kinetile_conformance.mutation.processes import CAN_FORK
from kinetile_conformance.mutation.sources import source_of
from kinetile_conformance.mutation.writing import passes
from registering import registered

pytestmark = pytest.mark.skipif(not CAN_FORK, reason="mutants are judged in forks")

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
QUICK = Round(("same-contacts",), FEW, compiled=False, at_least=1.0)


@pytest.fixture
def toy(tmp_path, monkeypatch):
    (tmp_path / "toy_phase.py").write_text(TOY, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)

    with registered(kt.BroadPhaseSpec("toy", "toy_phase:Toy")):
        yield source_of("toy")
    sys.modules.pop("toy_phase", None)


def judged(phase, *labels, how=QUICK, jobs=1) -> dict[str, Finding]:
    """Judge the mutants of these labels; return what came of each."""
    found: dict[str, Finding] = {}
    chosen = [mutant for mutant in mutants_of(phase) if mutant.label in labels]
    assert len(chosen) == len(labels)
    campaign(phase, (), {}, chosen, how, jobs=jobs, on_finding=lambda f: found.update({f.mutant.label: f}))
    return found


@pytest.mark.slow
def test_every_fate(toy):
    fates = {
        "toy_phase.py:6 constant 1 -> 0": ("crashed", ""),
        "toy_phase.py:13 comparison < -> <=": ("killed", "same-contacts"),
        "toy_phase.py:14 condition always true": ("survived", ""),
        "toy_phase.py:14 condition always false": ("killed", "same-contacts"),
        "toy_phase.py:17 constant 1 -> 0": ("hangs", "same-contacts"),
        "toy_phase.py:18 condition always true": ("crashed", "same-contacts"),
    }
    found = judged(toy, *fates, jobs=2)
    assert {label: (each.fate, each.check) for label, each in found.items()} == fates
    assert "ZeroDivisionError" in found["toy_phase.py:6 constant 1 -> 0"].said
    assert found["toy_phase.py:18 condition always true"].said == "its process ended with 3"
    findings = Findings("toy", [{}], 9, tuple(found.values()), ())
    assert findings.counts() == {
        "killed by same-contacts": 2, "hangs": 1, "crashed": 2, "survived": 1,
    }  # fmt: skip
    assert findings.lines()[1:] == ["    -         if other != body:", "    +         if True:"]


def test_a_phase_that_does_not_pass_has_no_mutants(tmp_path, toy):
    (tmp_path / "toy_phase.py").write_text(TOY.replace("return count", "return count - 1"), encoding="utf-8")
    broken = source_of("toy")
    with pytest.raises(BadOption, match=r"the phase as it is does not pass.*same-contacts"):
        campaign(broken, (), {}, mutants_of(broken), QUICK)


def test_a_phase_that_ends_its_process_has_none_either(tmp_path, toy):
    (tmp_path / "toy_phase.py").write_text(TOY.replace("count > 1000", "True"), encoding="utf-8")
    broken = source_of("toy")
    with pytest.raises(BadOption, match="it ended with 3"):
        campaign(broken, (), {}, mutants_of(broken), QUICK)


def test_the_authors_own_tests(toy, tmp_path):
    (tmp_path / "own.py").write_text("import toy_phase\nassert toy_phase.WHOLE == 10\n", encoding="utf-8")
    one, other = (
        next(each for each in mutants_of(toy) if each.label == label)
        for label in ("toy_phase.py:6 constant 10 -> 9", "toy_phase.py:11 constant 0 -> 1")
    )
    command = f"cd {tmp_path} && {sys.executable} {tmp_path / 'own.py'}"
    assert not passes(toy, one, command)
    assert passes(toy, other, command)
    assert not passes(toy, other, "sleep 60", seconds=0.2)


def test_the_rounds_have_every_check_and_the_last_one_those_that_kill_most_again():
    first, second, third = (how.checks for how in rounds_of(100))
    assert (first, third) == (FIRST, (*FIRST, *LONG))
    assert (*first, *second, *LONG) == order_of_checks()
    assert sorted(order_of_checks()) == sorted(each.name for each in CHECKS)
    assert [how.compiled for how in rounds_of(100)] == [False, False, True]
    assert [how.whole for how in rounds_of(0)] == [False, True]
    assert order_of_checks()[: len(FIRST)] == FIRST
    assert sample([], 3) == []
