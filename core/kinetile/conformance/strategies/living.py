"""Scenes in which bodies come and go, and turn: at moments at which much else happens as well.

Whether there is room for who comes depends on where the others are by then. So what is drawn is carried out
as it is drawn, under the reference: a command that is refused is left out, and the others are written down
with their exact times. A scene of those can be run to its end.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from hypothesis import strategies as st

from kinetile.conformance.cases import REFERENCE
from kinetile.conformance.strategies.small import box_scenes, plane_scenes, speeds
from kinetile.errors import KinetileError
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene, relabelled

__all__ = ["living_scenes"]

MOMENTS = 24
CONTACTS = 40
"""Contacts in each piece of a run between two commands."""


@st.composite
def _wish(draw: st.DrawFn) -> dict[str, Any]:
    """A command: at which eighth, what, where, and to whom, counted among those who are there."""
    return {
        "moment": draw(st.integers(0, MOMENTS)) / 8,
        "what": draw(st.sampled_from(["insert", "insert", "remove", "turn"])),
        "place": (draw(st.integers(1, 15)) / 4, draw(st.integers(1, 15)) / 4),
        "velocity": (draw(speeds), draw(speeds)),
        "radius": draw(st.sampled_from([0.25, 0.125, 0.5])),
        "who": draw(st.integers(0, 7)),
    }


@st.composite
def living_scenes(draw: st.DrawFn) -> Scene:
    """Up to six bodies, in a box mostly, and up to ten commands."""
    scene = draw(st.one_of(box_scenes(turns=False), plane_scenes(turns=False)))
    wishes = draw(st.lists(_wish(), min_size=1, max_size=10))
    return carried_out(scene, sorted(wishes, key=lambda wish: wish["moment"]))


def carried_out(scene: Scene, wishes: list[dict[str, Any]]) -> Scene:
    """Return a scene with those of the commands that can be carried out, in this order."""
    sim = Simulation(scene, REFERENCE, live=True)
    try:
        for wish in wishes:
            sim.run(until=max(scene.start + wish["moment"], sim.time), max_contacts=CONTACTS)
            _try(sim, wish)
    except KinetileError:
        pass  # the run ends here, under every phase: what came before is a scene as well
    return relabelled(sim.recorded(), settings=scene.settings)


def _try(sim: Simulation, wish: dict[str, Any]) -> None:
    """Carry a command out where that is possible."""
    there = sim.bodies.tolist()
    if wish["what"] == "insert":
        with suppress(KinetileError, ValueError):  # no room, or too fast for the scene's clock
            sim.insert(wish["place"], wish["velocity"], wish["radius"])
    elif there and wish["what"] == "remove":
        sim.remove(there[wish["who"] % len(there)])
    elif there:
        sim.set_velocity(there[wish["who"] % len(there)], wish["velocity"])
