"""One answer: runs of a scene under all broad phases, and the comparison of their results bit for bit,
without any tolerance."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import kinetile as kt
import lanes
from kinetile.errors import KinetileError
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.plugin.choices import read_phase

PHASES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("naive", {}),
    ("sap-1d", {"axis": "x"}),
    ("sap-1d", {"axis": "y"}),
    ("sap-2d", {}),
    ("cells", {}),
)
LINES: tuple[tuple[str, dict[str, Any]], ...] = (("sap-k", {"directions": 3}),)
TILING: tuple[tuple[str, dict[str, Any]], ...] = (("sweep-tiling", {}),)
POWER: tuple[tuple[str, dict[str, Any]], ...] = (("power", {}),)
ALL = PHASES + LINES + TILING + POWER


def choices(scene: kt.Scene) -> tuple[tuple[str, dict[str, Any]], ...]:
    """Returns the choices that accept a scene, if its skin is not too thick for them."""
    apart = not any(response.passes for _, response in scene.responses)
    level = all(
        shape.radius > 0.0 and len(shape.core) < 3 and not any(y for _, y in shape.core)
        for shape in scene.shapes
    )
    masses = [*scene.mass.tolist(), *(each.mass for each in scene.commands if isinstance(each, kt.Insert))]
    level &= not scene.shapes or masses.count(np.inf) < 2
    walled = scene.arena is not None and not scene.periodic
    large = walled and bool(scene.radius.min(initial=1.0) >= 2.0**-14 * max(scene.arena or ()))
    return (
        PHASES
        + (() if scene.periodic else LINES)
        + (TILING if apart and level and "y" not in scene.periodic else ())
        + (POWER if apart and large and not scene.shapes else ())
    )


def compared(scene: kt.Scene) -> tuple[tuple[str, dict[str, Any]], ...]:
    """Returns the same, but in the default lane only the choices of ``COMPILED``, along x, if loops are
    compiled: plain hooks run under all choices there, and a loop costs as much as a hundred tests."""
    all_of_them = NOTHING_IS_COMPILED or lanes.slow_ones
    return tuple(
        (phase, options)
        for phase, options in choices(scene)
        if all_of_them or (phase in lanes.COMPILED and options.get("axis") != "y")
    )


class Outcome(NamedTuple):
    """All results of a run, bit for bit."""

    contacts: bytes
    ended: str
    time: float
    positions: bytes
    velocities: bytes

    @classmethod
    def of(cls, sim: kt.Simulation, ended: str = "ran") -> "Outcome":
        return cls(
            sim.contacts.tobytes(), ended, sim.time, sim.positions().tobytes(), sim.velocities().tobytes()
        )


def outcome(
    scene: kt.Scene, phase: str, options: dict[str, Any], until: float | None, max_contacts: int | None
) -> tuple[kt.Simulation, Outcome]:
    """Runs a scene under one phase; an error of the simulation is part of the outcome."""
    sim = kt.Simulation(scene, phase, narrow_phases=_narrow(scene, phase), options=options)
    ended = "ran"
    try:
        sim.run(until=until, max_contacts=max_contacts)
    except KinetileError as error:
        ended = type(error).__name__
    return sim, Outcome.of(sim, ended)


def _narrow(scene: kt.Scene, phase: str) -> dict[str, dict[str, Any]] | None:
    """Returns narrow phases that have one loop for bodies that are alike and for others, to be compiled once.
    Phases of ``ALIKE`` have both loops, so these are compared."""
    if NOTHING_IS_COMPILED or scene.shapes or scene.settings.narrow_phases or phase in lanes.ALIKE:
        return None
    walls = {"wall": {}} if scene.arena is not None and scene.periodic != "xy" else {}
    return {"disc": {"general": True}, **walls}


def agree(
    scene: kt.Scene,
    *phases: str,
    until: float | None = None,
    contacts: int | None = None,
    audit: int | None = None,
    play: Callable[[kt.Simulation], object] | None = None,
    **more: Any,
) -> list[kt.Simulation]:
    """Runs a scene, or plays with it, under phases such as ``sap-1d:axis=y``, all but the first audited;
    asserts that each has the outcome of the first, and returns their simulations."""
    sims: list[kt.Simulation] = []
    for phase in phases:
        name, options = read_phase(phase)
        sims.append(kt.Simulation(scene, name, options=options, audit=audit if sims else None, **more))
        if play is None:
            sims[-1].run(until=until, max_contacts=contacts)
        else:
            play(sims[-1])
        one, other = Outcome.of(sims[0]), Outcome.of(sims[-1])
        assert one == other, difference(sims[0], sims[-1], phase, one, other)
    return sims


def assert_one_answer(
    scene: kt.Scene, *, until: float | None = None, max_contacts: int | None = None, ends: str = "ran"
) -> kt.Simulation:
    """Asserts that every phase gives the same contacts, end, time and final state; returns the reference's
    simulation."""
    reference: tuple[kt.Simulation, Outcome] | None = None
    for phase, options in compared(scene):
        if phase == "sweep-tiling" and scene.arena is None:
            continue  # it may be refused once bodies are far away: sweep_tiling/test_events.py
        sim, found = outcome(scene, phase, options, until, max_contacts)
        if reference is None:
            reference = (sim, found)
            assert found.ended == ends, f"{phase} ended with {found.ended}"
        elif found != reference[1]:
            raise AssertionError(difference(reference[0], sim, f"{phase} {options}", reference[1], found))
    assert reference is not None
    return reference[0]


def difference(one: kt.Simulation, two: kt.Simulation, name: str, a: Outcome, b: Outcome) -> str:
    """Returns the first difference of two outcomes, in words."""
    rows = min(len(one.contacts), len(two.contacts))
    parted = np.flatnonzero(one.contacts[:rows] != two.contacts[:rows])
    if len(parted):
        at = int(parted[0])
        found, wanted = two.contacts[at], one.contacts[at]
        return f"{name} parts from the first phase at contact {at}: {found} instead of {wanted}"
    if len(one.contacts) != len(two.contacts):
        return f"{name} has {len(two.contacts)} contacts and not {len(one.contacts)}; {rows} are equal"
    parts = [field for field, x, y in zip(Outcome._fields, a, b, strict=True) if x != y]
    return f"{name} has the same contacts, but not the same {', '.join(parts)}"


def lattice(seed: int, jitter: bool, most_turns: int) -> kt.Scene:
    """Returns a lattice with exact ties and touching starts, or jittered by 1e-16 to 1e-9; with turns at tie
    instants unless ``most_turns`` is 0."""
    rng = np.random.default_rng(seed)
    return kt.make_scene(
        "lattice",
        bodies=int(rng.integers(2, 26)),
        kind=("dyadic", "non-dyadic")[seed % 2],
        touching=0.4,
        jitter=float(10.0 ** rng.uniform(-16, -9)) if jitter else 0.0,
        turns=int(rng.integers(3, most_turns)) if most_turns else 0,
        seed=seed,
    )


def lattice_scene(seed: int) -> kt.Scene:
    """Returns a lattice with jitter, turns, both or neither: the seed decides."""
    return lattice(seed, seed % 4 >= 2, 76 if seed % 8 >= 4 else 0)
