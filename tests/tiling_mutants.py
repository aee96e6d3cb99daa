"""Sweep-tiling with one rule changed, and whether anybody notices.

Each mutant is the package's own source with a few words replaced, loaded under another name and registered
as a broad phase. It runs a fixed set of small scenes twice: once to compare its contacts with those of
``naive``, once with an audit after every event. If it comes through both, its structural events are counted:
a rule may be there to save work. A mutant that comes through all three is alive.

Run as a program, with the names of mutants or none for all; it prints one line of JSON for each. With
``NUMBA_DISABLE_JIT=1`` no mutant needs to be compiled. With ``--count N`` it runs them, compiled, on N
scenes of each kind with ties, and counts those on which contacts differ, and those on which an audit fails
that does not look at failure times, but only at what came of them.
"""

from __future__ import annotations

import importlib.abc
import importlib.util
import json
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

import kinetile as kt
import kinetile_plugins.sweep_tiling as original
from kinetile.errors import AuditError, KinetileError, ZenoError
from kinetile.plugin.specs import BroadPhaseSpec
from tiling_mutant_table import MUTANTS, Change, Mutant
from tilings import Steps, columns, lattice, random_scene

SOURCES = {
    path.stem: path.read_text(encoding="utf-8") for path in Path(str(original.__file__)).parent.glob("*.py")
}


class Sources(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Loads the package's source, changed, under the name of a mutant."""

    def __init__(self, package: str, changes: Sequence[Change]) -> None:
        self.package = package
        self.changes = changes

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        package, _, module = name.partition(".")
        if package != self.package:
            return None
        return importlib.util.spec_from_loader(name, self, is_package=not module)

    def exec_module(self, module: ModuleType) -> None:
        name = module.__name__.partition(".")[2] or "__init__"
        text = SOURCES[name]
        for change in self.changes:
            where, _, function = change.module.partition(":")
            if where == name:
                text = changed(text, function, change)
        exec(compile(text, f"{module.__name__}.py", "exec"), module.__dict__)


def changed(text: str, function: str, change: Change) -> str:
    """Return a module's source with a change made in one function of it."""
    begin = text.index(f"\ndef {function}(") if function else 0
    end = text.find("\n\n\n", begin) if function else len(text)
    end = end if end >= 0 else len(text)
    part = text[begin:end] + "\n"
    if part.count(change.old) != 1:
        raise LookupError(f"{change.module} has not once, but {part.count(change.old)} times: {change.old!r}")
    return text[:begin] + part.replace(change.old, change.new)[:-1] + text[end:]


def load(mutant: Mutant) -> str:
    """Register a mutant as a broad phase; return its name there."""
    package = f"mutant_{MUTANTS.index(mutant)}"
    if package not in kt.registry().names("broad phase"):
        sys.meta_path.insert(0, Sources(package, mutant.changes))
        module = importlib.import_module(package)
        if mutant.falls is not None:
            sys.modules[f"{package}.certificates"].__dict__["falls_eight"] = mutant.falls
        spec = BroadPhaseSpec(name=package, target=module.SweepTiling)

        class Plugin:
            @kt.hookimpl
            def kinetile_broad_phases(self) -> list[BroadPhaseSpec]:
                return [spec]

        kt.registry().add(Plugin())
    return package


def slide() -> kt.Scene:
    """Two equal discs that slide past each other exactly where they would graze, with a common edge; then
    they turn into each other's columns."""
    position = [[0.375, 0.625], [0.625, 0.375]]
    turns = [(0, 1.5, (0.125, 0.0)), (1, 1.75, (-0.125, 0.125))]
    return kt.Scene(position, [[0.0, -0.25], [0.0, 0.25]], 0.125, arena=(1.0, 1.0), turns=turns)


def head_on(first: float) -> kt.Scene:
    """Two discs that meet head on, exactly level at that moment, the first rising or falling."""
    y = 0.125 * first
    position = [[0.25, 0.5 - y], [0.75, 0.5 + y]]
    return kt.Scene(position, [[1.0, first], [-1.0, -first]], 0.125, arena=(1.0, 1.0))


class Fixed(NamedTuple):
    """A scene of the fixed set: its name, when it ends, and after how many contacts."""

    name: str
    scene: kt.Scene
    until: float = 8.0
    most: int = 30


def fixed_scenes() -> list[Fixed]:
    """The fixed set, small ones first."""
    return [
        Fixed("slide", slide()),
        Fixed("head on, rising", head_on(0.25), most=10),
        Fixed("head on, falling", head_on(-0.25), most=10),
        *(Fixed(f"columns {seed}", columns(seed)) for seed in COLUMNS),
        *(Fixed(f"lattice {seed}", lattice(seed, False)) for seed in LATTICES),
        *(Fixed(f"jittered {seed}", lattice(seed, True)) for seed in JITTERED),
        *(Fixed(f"random {seed}", random_scene(seed, bodies=9)) for seed in (1, 2)),
    ]


COLUMNS = (38, 2, 1)
LATTICES = (1, 4, 12)
JITTERED = (3,)


class Verdict(NamedTuple):
    """What noticed a mutant first: its contacts, an audit after every event, the number of its events."""

    contacts: str = ""
    audit: str = ""
    work: str = ""


class Run(NamedTuple):
    """What a run leaves behind."""

    contacts: bytes
    ended: str
    structural: int


def run(fixed: Fixed, phase: str) -> Run:
    """Run a scene under a phase."""
    sim = kt.Simulation(fixed.scene, phase)
    ended = "ran"
    try:
        sim.run(until=fixed.until, max_contacts=fixed.most)
    except CRASHES as error:
        ended = type(error).__name__
    return Run(sim.contacts.tobytes(), ended, sim.readings.structural_events)


CRASHES = (KinetileError, IndexError, OverflowError)


def contacts_differ(fixed: Fixed, phase: str, known: Run) -> str:
    """Say how a phase's contacts differ from those that are known; nothing if they do not."""
    found = run(fixed, phase)
    if found.ended != known.ended:
        return f"{fixed.name}: {found.ended}"
    return f"{fixed.name}: other contacts" if found.contacts != known.contacts else ""


MOST = 1500
"""Events after which an audited run ends: some mutants go in circles."""


def audit_fails(fixed: Fixed, phase: str) -> str:
    """Run a scene event by event, with audits; return what the first complaint is about."""
    steps = Steps(fixed.scene, phase)
    end = steps.engine.clock.ticks(fixed.until)
    try:
        while steps.engine.contacts < fixed.most and steps.events < MOST and steps.step(until=end):
            steps.audit()
    except AuditError as error:
        return f"{fixed.name}, event {steps.events}: {str(error).partition(': ')[2]}"
    except ZenoError:
        return ""
    except CRASHES as error:
        return f"{fixed.name}, event {steps.events}: {type(error).__name__}"
    return ""


def judge(phase: str, scenes: Sequence[Fixed], known: Mapping[str, Run], usual: Mapping[str, Run]) -> Verdict:
    """Run a phase on scenes until it is noticed; ``known`` is what ``naive`` does, ``usual`` the original."""
    noticed = Verdict()
    for fixed in scenes:
        if not noticed.contacts:
            noticed = noticed._replace(contacts=contacts_differ(fixed, phase, known[fixed.name]))
        if not noticed.audit:
            noticed = noticed._replace(audit=audit_fails(fixed, phase))
        if noticed.contacts and noticed.audit:
            return noticed
    if noticed == Verdict():
        for fixed in scenes:
            events, before = run(fixed, phase).structural, usual[fixed.name].structural
            if events != before:
                return Verdict(work=f"{fixed.name}: {events} structural events, not {before}")
    return noticed


def count(phase: str, scenes: Sequence[Fixed], known: Mapping[str, Run]) -> dict[str, int]:
    """Count the scenes on which a phase's contacts differ, and those on which an audit fails."""
    return {
        "scenes": len(scenes),
        "contacts": sum(bool(contacts_differ(fixed, phase, known[fixed.name])) for fixed in scenes),
        "audit": sum(bool(audit_fails(fixed, phase)) for fixed in scenes),
    }


def main(*words: str) -> None:
    """Judge the mutants of these names, or all."""
    np.seterr(all="ignore")
    number = int(words[1]) if words[:1] == ("--count",) else 0
    names = words[2:] if number else words
    chosen = [mutant for mutant in MUTANTS if not names or mutant.name in names]
    if number:
        kinds = {
            "lattices": [Fixed(f"lattice {seed}", lattice(seed, False), 20.0, 60) for seed in range(number)],
            "jittered": [Fixed(f"jittered {seed}", lattice(seed, True), 20.0, 60) for seed in range(number)],
            "columns": [Fixed(f"columns {seed}", columns(seed), 20.0, 60) for seed in range(number)],
        }
    else:
        kinds = {"fixed": fixed_scenes()}
    every = [fixed for scenes in kinds.values() for fixed in scenes]
    known = {fixed.name: run(fixed, "naive") for fixed in every}
    usual = {} if number else {fixed.name: run(fixed, "sweep-tiling") for fixed in every}
    for mutant in chosen:
        began = time.perf_counter()
        phase = load(mutant)
        if number:
            sys.modules[f"{phase}.audit"].__dict__["_certificates"] = lambda *tables: ()
            found: dict[str, Any] = {kind: count(phase, scenes, known) for kind, scenes in kinds.items()}
        else:
            found = judge(phase, every, known, usual)._asdict()
        took = time.perf_counter() - began
        print(json.dumps({"name": mutant.name, **found, "seconds": took}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
