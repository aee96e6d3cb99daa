"""How often the rules of the thesis go wrong as they stand there, on scenes full of exact ties.

``pytest -m long -s`` prints the table of docs/sweep-tiling.md: of 100 scenes of each kind, how many have
other contacts than ``naive`` or an error, and in how many an audit after some event fails. The audit leaves
out failure times, so that it counts only what came of them.
"""

import importlib
from pathlib import Path

import pytest

import kinetile as kt
import mutants
from kinetile.errors import AuditError, KinetileError, ZenoError
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from tilings import Steps, columns, lattice

KINDS = {
    "lattices": lambda seed: lattice(seed, False),
    "jittered": lambda seed: lattice(seed, True),
    "columns": columns,
}
RULES = (
    "the-meeting-of-the-thesis",
    "no-corner-rule",
    "past-events-are-dropped",
    "an-epsilon-is-subtracted-from-times",
    "times-decide-with-an-epsilon",
    "deep-inversions-are-not-repaired",
    "bounds-without-the-skin",
)
UNTIL, CONTACTS, EVENTS = 20.0, 60, 1500
"""Where a run ends; after that many events an audited one, since some go in circles."""

CRASHES = (KinetileError, IndexError, OverflowError)


def contacts(scene: kt.Scene, phase: str) -> tuple[bytes, str]:
    sim = kt.Simulation(scene, phase)
    try:
        sim.run(until=UNTIL, max_contacts=CONTACTS)
    except CRASHES as error:
        return sim.contacts.tobytes(), type(error).__name__
    return sim.contacts.tobytes(), ""


def audit_fails(scene: kt.Scene, phase: str) -> bool:
    """Whether an audit after some event of a run fails, or the run does."""
    steps = Steps(scene, phase)
    end = steps.engine.clock.ticks(UNTIL)
    try:
        while steps.engine.contacts < CONTACTS and steps.events < EVENTS and steps.step(until=end):
            steps.audit()
    except ZenoError:
        return False
    except (AuditError, *CRASHES):
        return True
    return False


def counted(phase: str, number: int) -> dict[str, tuple[int, int]]:
    found = {}
    for kind, make in KINDS.items():
        scenes = [make(seed) for seed in range(number)]
        other = sum(contacts(scene, phase) != contacts(scene, "naive") for scene in scenes)
        found[kind] = other, sum(audit_fails(scene, phase) for scene in scenes)
    return found


@pytest.mark.compiled
@pytest.mark.long
def test_how_often_the_rules_of_the_thesis_go_wrong(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    number = 2 if NOTHING_IS_COMPILED else 100
    for name in ("", *RULES):
        with mutants.loaded(f"sweep-tiling-{name or RULES[0]}", tmp_path) as mutant:
            phase = mutant.name if name else "sweep-tiling"
            package = f"mutant_{mutant.name.replace('-', '_')}" if name else "kinetile_plugins"
            audit = importlib.import_module(f"{package}.sweep_tiling.audit")
            monkeypatch.setattr(audit, "_certificates", lambda *tables: ())
            found = counted(phase, number)
        print(f"{name or 'nothing is changed':40} | {' | '.join(f'{a} / {b}' for a, b in found.values())}")
        wrong = sum(a + b for a, b in found.values())
        assert wrong == 0 if not name else wrong > 0, name
