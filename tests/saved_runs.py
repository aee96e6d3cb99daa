"""Runs in pieces, with commands between them, that are stopped, saved and taken up in another process.

A plan is a list of steps, each of which JSON can say. As a program this reads lines of JSON, each a file, a
broad phase or null, and the rest of a plan, and prints what the run has come to.
"""

import hashlib
import json
import sys
from typing import Any

import numpy as np
from hypothesis import strategies as st

import kinetile as kt
from kinetile.errors import KinetileError, Refused
from kinetile_conformance.strategies import scenes
from lanes import BUILT_IN

MOST = 60
"""Contacts in a piece."""

SLOW = 512.0
"""Of slow scenes all takes so many times as long: the clock's base moves on."""

Plan = list[list[Any]]


def slowed(scene: kt.Scene) -> kt.Scene:
    turns = [
        kt.Turn(turn.body, turn.time * SLOW, tuple(v / SLOW for v in turn.velocity)) for turn in scene.turns
    ]
    return kt.Scene(scene.position, scene.velocity / SLOW, scene.radius, scene.mass, scene.arena, turns)


@st.composite
def plans(draw: st.DrawFn, slow: bool, stepping: bool) -> Plan:
    """Up to six pieces and commands. Where a piece ends by events of all kinds it ends elsewhere under each
    phase: only with ``stepping``."""
    times, speed = (SLOW, 1.0 / SLOW) if slow else (1.0, 1.0)
    eighths = st.integers(0, 16).map(lambda i: i / 8)
    speeds = st.integers(-4, 4).map(lambda i: i / 2 * speed)
    places = st.integers(1, 15).map(lambda i: i / 4)
    kinds = [
        st.tuples(st.just("until"), eighths.map(lambda each: each * times)),
        st.tuples(st.just("contacts"), st.integers(1, 5)),
        st.tuples(st.just("turn"), st.integers(0, 7), speeds, speeds),
        st.tuples(st.just("insert"), places, places, speeds, speeds, st.sampled_from([0.25, 0.125])),
        st.tuples(st.just("remove"), st.integers(0, 7)),
        st.tuples(st.just("rebuild")),
    ]
    if stepping:
        kinds += [
            st.tuples(st.just("events"), st.integers(1, 20)),
            st.tuples(st.just("steps"), st.integers(1, 4)),
        ]
    return [list(step) for step in draw(st.lists(st.one_of(kinds), min_size=1, max_size=6))]


@st.composite
def cases(draw: st.DrawFn) -> dict[str, Any]:
    """A scene, a phase, what is done before it is saved and after it, and another phase to go on."""
    slow = draw(st.sampled_from([False, False, True]))
    scene = draw(scenes())
    return {
        "scene": slowed(scene) if slow else scene,
        "phase": draw(st.sampled_from(BUILT_IN)),
        "live": draw(st.booleans()),
        "keep": draw(st.booleans()),
        "before": draw(plans(slow, True)),
        "after": [["until", SLOW if slow else 0.5], *draw(plans(slow, False)), ["contacts", 20]],
        "other": draw(st.sampled_from(BUILT_IN)),
    }


def carry_out(sim: kt.Simulation, plan: Plan, rows: Any) -> str:
    """Carry a plan out; return how it ended: "" or the error. Bodies for whom there is no room stay out."""
    try:
        for what, *how in plan:
            there = sim.bodies.tolist()
            if what == "until":
                sim.run(sim.time + how[0], max_contacts=MOST, recorder=rows)
            elif what in ("contacts", "events"):
                sim.run(sim.time + 4 * SLOW, **{f"max_{what}": how[0]}, recorder=rows)
            elif what == "steps":
                for _ in range(how[0]):
                    sim.step()
            elif what == "rebuild":
                sim.rebuild()
            elif what == "turn" and there:
                sim.set_velocity(there[how[0] % len(there)], (how[1], how[2]))
            elif what == "remove" and there:
                sim.remove(there[how[0] % len(there)])
            elif what == "insert":
                try:
                    sim.insert((how[0], how[1]), (how[2], how[3]), how[4])
                except ValueError as error:  # no room, or too fast for the scene's clock
                    if isinstance(error, Refused) and "no room" not in str(error):
                        raise
    except KinetileError as error:
        return type(error).__name__
    return ""


def outcome(sim: kt.Simulation, plan: Plan) -> dict[str, Any]:
    """Carry out the rest of a plan; return what can be told of the run then, in plain types."""
    parts: list[np.ndarray] = []
    ended = carry_out(sim, plan, lambda rows: parts.append(rows.copy()))
    read = sim.readings
    return {
        "ended": ended,
        "fingerprint": sim.fingerprint,
        "contacts": digest(sim.contacts) if sim.keeps_contacts else "",
        "rows": [sum(map(len, parts)), *map(digest, [np.concatenate(parts)] if parts else [])],
        "all rows": sim.rows,
        "bodies": sim.bodies.tolist(),
        "plans": [digest(sim.positions()), digest(sim.velocities())],
        "time": [sim.time.hex(), *sim.exact_time],
        "commands": hashlib.sha256(repr(sim._engine.history.content).encode()).hexdigest(),
        "counts": [read.contacts_disc, read.contacts_wall, read.turns, read.inserted, read.removed],
        "energy": [read.energy_drift.hex(), read.deepest_overlap.hex()],
    }


def digest(array: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()


if __name__ == "__main__":
    for line in sys.stdin:
        asked = json.loads(line)
        taken_up = kt.resume(asked["file"], asked["broad_phase"])
        taken_up.audit()
        print(json.dumps(outcome(taken_up, asked["plan"])), flush=True)
