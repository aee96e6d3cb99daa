"""Scenes in which bodies come and go, and turn: at moments at which much else happens as well.

Whether there is room for who comes depends on where the others are by then. So what is drawn is carried out
as it is drawn, under the reference: a command that is refused is left out, and the others are written down
with their exact times. A scene of those can be run to its end.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from hypothesis import strategies as st

from kinetile.errors import KinetileError
from kinetile.run.simulation import Simulation
from kinetile.scene import Remove, Scene, Settings, relabelled
from kinetile_conformance.cases import REFERENCE
from kinetile_conformance.strategies.small import box_scenes, plane_scenes, speeds

__all__ = ["carried_out", "living_scenes", "wishes"]

MOMENTS = 24
UNWALLED = (4.0, 4.0)
"""Width and height of where bodies come that have no arena."""

CONTACTS = 40
"""Contacts in each piece of a run between two commands."""


@st.composite
def _wish(draw: st.DrawFn, kinds: tuple[str, ...]) -> dict[str, Any]:
    """A command: at which eighth, what, where in the arena, to whom, counted among those who are there."""
    return {
        "kind": draw(st.sampled_from(kinds)) if kinds else None,
        "moment": draw(st.integers(0, MOMENTS)) / 8,
        "what": draw(st.sampled_from(["insert", "insert", "remove", "turn"])),
        "place": (draw(st.integers(1, 15)) / 16, draw(st.integers(1, 15)) / 16),
        "velocity": (draw(speeds), draw(speeds)),
        "radius": draw(st.sampled_from([0.25, 0.125, 0.5])),
        "who": draw(st.integers(0, 7)),
    }


def wishes(kinds: tuple[str, ...] = ()) -> st.SearchStrategy[list[dict[str, Any]]]:
    """Return up to ten commands, in the order of their moments; who comes is of one of these kinds."""
    several = st.lists(_wish(kinds), min_size=0 if kinds else 1, max_size=10)
    return several.map(lambda found: sorted(found, key=_moment))


def _moment(wish: dict[str, Any]) -> float:
    return float(wish["moment"])


@st.composite
def one_between(draw: st.DrawFn) -> Scene:
    """Two bodies on their way to each other, and one between them that flies aside and goes before it is out
    of the way: then nobody has awaited it, and the two have to hear of each other by its going."""
    upright = draw(st.booleans())
    aside, toward = draw(st.sampled_from([2.0, 4.0, -4.0])), draw(st.sampled_from([1.0, 0.5]))
    places, flights = [(2.0, 0.5), (2.0, 2.0), (2.0, 3.5)], [(0.0, toward), (aside, 0.0), (0.0, -1.0)]
    if not upright:
        places, flights = [(y, x) for x, y in places], [(v, u) for u, v in flights]
    moment = draw(st.sampled_from([0.0, 2.0**-6, 2.0**-5, 0.125]))
    return Scene(
        places,
        flights,
        [draw(st.sampled_from([0.25, 0.125])), 0.5, 0.25],
        arena=(4.0, 4.0) if draw(st.booleans()) else (4.0, 8.0),
        commands=[Remove(1, moment)],
        settings=Settings(until=4.0),
    )


@st.composite
def a_wide_one_comes(draw: st.DrawFn) -> Scene:
    """Small bodies in a corridor, and one that is much wider than any of them comes to a place that is free:
    what a phase has measured by those that were there is too small for it."""
    gap, upright = draw(st.integers(0, 6)), draw(st.booleans())
    free = [square for square in range(16) if square % 8 not in (gap, gap + 1)]
    squares = draw(st.lists(st.sampled_from(free), min_size=4, max_size=8, unique=True))
    places = [(square % 8 + 0.5, square // 8 + 0.5) for square in squares]
    flights = [(draw(speeds), draw(speeds)) for _ in squares]
    width, height = draw(st.sampled_from([(8.0, 2.0), (8.0, 2.0), (8.0, 4.0)]))
    comes = draw(_wish(())) | {
        "what": "insert",
        "place": ((gap + 1.0) / width, 1.0 / height),
        "radius": draw(st.sampled_from([0.75, 0.5, 0.96875])),
    }
    if upright:
        width, height = height, width
        places, comes["place"] = [(y, x) for x, y in places], comes["place"][::-1]
    scene = Scene(places, flights, 0.125, arena=(width, height), settings=Settings(until=8.0))
    return carried_out(scene, sorted([comes, *draw(wishes())], key=_moment))


@st.composite
def living_scenes(draw: st.DrawFn) -> Scene:
    """Up to six bodies, in a box mostly, and up to ten commands; or one goes between two, or a wide one
    comes."""
    kind = draw(st.integers(0, 7))
    if kind >= 6:
        return draw(one_between() if kind == 7 else a_wide_one_comes())
    boxed = box_scenes(turns=False)
    scene = draw(st.one_of(boxed, boxed, plane_scenes(turns=False)))
    return carried_out(scene, draw(wishes()))


def carried_out(scene: Scene, wished: list[dict[str, Any]]) -> Scene:
    """Return a scene with those of the commands that can be carried out, in this order."""
    sim = Simulation(scene, REFERENCE, live=True)
    try:
        for wish in wished:
            sim.run(until=max(scene.start + wish["moment"], sim.time), max_contacts=CONTACTS)
            _try(sim, wish)
    except KinetileError:
        pass  # the run ends here, under every phase: what came before is a scene as well
    return relabelled(sim.recorded(), settings=scene.settings)


def _try(sim: Simulation, wish: dict[str, Any]) -> None:
    """Carry a command out where that is possible."""
    there = sim.bodies.tolist()
    if wish["what"] == "insert":
        _insert(sim, wish)
    elif there and wish["what"] == "remove":
        sim.remove(there[wish["who"] % len(there)])
    elif there:
        sim.set_velocity(there[wish["who"] % len(there)], wish["velocity"])


def _insert(sim: Simulation, wish: dict[str, Any]) -> None:
    """Insert a body where it was wished, or as near to there in size and place as there is room for it."""
    width, height = sim.scene.arena or UNWALLED
    x, y = wish["place"][0] * width, wish["place"][1] * height
    for smaller in (1, 2, 4):
        radius = wish["radius"] / smaller
        for place in ((x, y), (width - x, y), (x, height - y), (width - x, height - y)):
            with suppress(KinetileError, ValueError):  # no room, or too fast for the scene's clock
                sim.insert(place, wish["velocity"], radius, kind=wish["kind"])
                return
