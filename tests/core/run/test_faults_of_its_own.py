"""A broad phase ends a run with a sentence of its own, and kinetile says who said it and when."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import PhaseError
from kinetile.kernel import faults
from kinetile.toolbox import MY_FAULT, NEVER, BroadPhaseParts, Kernel, Records, blame, hook, schedule


class State(NamedTuple):
    """Which of its faults it blames."""

    which: Records  # (1,)


@hook
def everyone(k: Kernel, s: State, body: int) -> int:
    for other in range(len(k.bodies)):
        k.near[other] = other
    return len(k.bodies)


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
    """A phase that gives up at time 0.125, with the fault that it is told."""

    def __init__(self, *, which: int = 0) -> None:
        self.which = which

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        said = ("the table of {a} is full: it has {b} places", "nothing is left of {b}")
        return BroadPhaseParts(everyone, State(np.array([self.which])), soon, give_up, faults=said)


class Faulty:
    """A phase whose parts have what was given for its faults."""

    def __init__(self, *, faults: object = ()) -> None:
        self.faults = faults

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(everyone, State(np.zeros(1, int)), faults=self.faults)  # type: ignore[arg-type]


class Plugin:
    """Brings both."""

    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        return [kt.BroadPhaseSpec("gives-up", GivesUp), kt.BroadPhaseSpec("faulty", Faulty)]


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    plugin = Plugin()
    kt.registry().add(plugin)
    yield
    kt.registry().remove(plugin)


@pytest.mark.parametrize(
    ("which", "said"),
    [
        (0, "cannot go on: the table of 0 is full: it has 17 places"),
        (1, "cannot go on: nothing is left of 17"),
        (2, "left its fault MY_FAULT + 2 (0, 17), and its parts have 2 sentences for faults of its own"),
    ],
)
def test_a_fault_of_its_own_is_told_in_its_own_words(which, said):
    sim = kt.Simulation(kt.make_scene("two-discs"), "gives-up", options={"which": which})
    who = "at time 0.125 broad phase 'gives-up' of Plugin (added in this process)"
    with pytest.raises(PhaseError, match=f"^{re.escape(f'{who} {said}')}$"):
        sim.run(until=1.0)


def test_its_faults_are_not_the_kernels():
    own = [value for name, value in vars(faults).items() if name in faults.__all__ and isinstance(value, int)]
    assert sorted(own) == [*range(1, len(own)), MY_FAULT]


@pytest.mark.parametrize(
    "given", ["one sentence", None, 7, ("all is well", 7), ("{c}",), ("{",), ("{a.b}",), ("",)]
)
def test_what_is_no_sentence_is_refused(given):
    with pytest.raises(
        PhaseError, match=r"faults (is|has) .*; expected a tuple of sentences, in which \{a\} and"
    ):
        kt.Simulation(kt.make_scene("two-discs"), "faulty", options={"faults": given})


@pytest.mark.parametrize("given", [(), ("all is over",), ("{a} and {b:>4}", "{b}")])
def test_sentences_are_taken(given):
    sim = kt.Simulation(kt.make_scene("two-discs"), "faulty", options={"faults": given})
    assert sim.composition.broad.faults == given
