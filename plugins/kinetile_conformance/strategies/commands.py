"""Scenes with commands and responses: bodies come, go and turn, pass through others, stop, and lose energy.

Whether there is room for a new body depends on where the others are by then. So drawn commands are carried
out as they are drawn, under the reference: a command that is refused is left out, and the others are kept
with their exact times. So the scene can be run to its end.

In scenes with responses three kinds of bodies meet by drawn rules. Every such scene also names the same
responses for kinds that it declares and that no body has, so that one loop serves all of them.
"""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

from hypothesis import strategies as st

from kinetile.errors import KinetileError
from kinetile.run.simulation import Simulation
from kinetile.scene import Remove, Response, Scene, Settings, relabelled
from kinetile_conformance.cases import REFERENCE
from kinetile_conformance.strategies.small import box_scenes, plane_scenes, speeds

MOMENTS = 24
UNWALLED = (4.0, 4.0)
"""Width and height of where bodies come that have no arena."""

CONTACTS = 40
"""Contacts in each piece of a run between two commands."""


@st.composite
def _command(draw: st.DrawFn, kinds: tuple[str, ...]) -> dict[str, Any]:
    """A command: its time in eighths, its kind, its place in the arena, and the index of its body among those
    present."""
    return {
        "kind": draw(st.sampled_from(kinds)) if kinds else None,
        "moment": draw(st.integers(0, MOMENTS)) / 8,
        "what": draw(st.sampled_from(["insert", "insert", "remove", "turn"])),
        "place": (draw(st.integers(1, 15)) / 16, draw(st.integers(1, 15)) / 16),
        "velocity": (draw(speeds), draw(speeds)),
        "radius": draw(st.sampled_from([0.25, 0.125, 0.5])),
        "who": draw(st.integers(0, 7)),
    }


def drawn_commands(kinds: tuple[str, ...] = ()) -> st.SearchStrategy[list[dict[str, Any]]]:
    """Return up to ten commands, in the order of their moments; a new body has one of these kinds."""
    several = st.lists(_command(kinds), min_size=0 if kinds else 1, max_size=10)
    return several.map(lambda found: sorted(found, key=_moment))


def _moment(command: dict[str, Any]) -> float:
    return float(command["moment"])


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
    comes = draw(_command(())) | {
        "what": "insert",
        "place": ((gap + 1.0) / width, 1.0 / height),
        "radius": draw(st.sampled_from([0.75, 0.5, 0.96875])),
    }
    if upright:
        width, height = height, width
        places, comes["place"] = [(y, x) for x, y in places], comes["place"][::-1]
    scene = Scene(places, flights, 0.125, arena=(width, height), settings=Settings(until=8.0))
    return carried_out(scene, sorted([comes, *draw(drawn_commands())], key=_moment))


@st.composite
def living_scenes(draw: st.DrawFn) -> Scene:
    """Up to six bodies, in a box mostly, and up to ten commands; or one goes between two, or a wide one
    comes."""
    kind = draw(st.integers(0, 7))
    if kind >= 6:
        return draw(one_between() if kind == 7 else a_wide_one_comes())
    boxed = box_scenes(turns=False)
    scene = draw(st.one_of(boxed, boxed, plane_scenes(turns=False)))
    return carried_out(scene, draw(drawn_commands()))


def carried_out(scene: Scene, commands: list[dict[str, Any]]) -> Scene:
    """Return a scene with those of the commands that can be carried out, in this order."""
    sim = Simulation(scene, REFERENCE, live=True)
    try:
        for command in commands:
            sim.run(until=max(scene.start + command["moment"], sim.time), max_contacts=CONTACTS)
            _try(sim, command)
    except KinetileError:
        pass  # the run ends here, under every phase: what came before is a scene as well
    return relabelled(sim.recorded(), settings=scene.settings)


def _try(sim: Simulation, command: dict[str, Any]) -> None:
    """Carry a command out where that is possible."""
    there = sim.bodies.tolist()
    if command["what"] == "insert":
        _insert(sim, command)
    elif there and command["what"] == "remove":
        sim.remove(there[command["who"] % len(there)])
    elif there:
        sim.set_velocity(there[command["who"] % len(there)], command["velocity"])


def _insert(sim: Simulation, command: dict[str, Any]) -> None:
    """Insert a body, or one as near to it in size and place as there is room for."""
    width, height = sim.scene.arena or UNWALLED
    x, y = command["place"][0] * width, command["place"][1] * height
    for smaller in (1, 2, 4):
        radius = command["radius"] / smaller
        for place in ((x, y), (width - x, y), (x, height - y), (width - x, height - y)):
            with suppress(KinetileError, ValueError):  # no room, or too fast for the scene's clock
                sim.insert(place, command["velocity"], radius, kind=command["kind"])
                return


KINDS = ("ball", "wisp", "block")
ABSENT = ("nobody", "no one")
_LOSSY = Response("restitution", e=0.5, contact_time=2.0**-10)
_COLUMNS = ("position", "velocity", "radius", "mass", "kind")
SAME_LOOP: dict[Any, Any] = {("nobody", "nobody"): "stop", ("nobody", "no one"): _LOSSY}
"""Rules for kinds that no body has: with them, scenes of any rules have one loop."""

_answers = st.sampled_from(
    ["elastic", "stop", _LOSSY, Response("restitution", e=0.875, contact_time=2.0**-20)]
)


@st.composite
def _body(draw: st.DrawFn, passing: bool) -> dict[str, Any]:
    """A body on a lattice of halves, where others may be."""
    x, y = draw(st.integers(0, 3)), draw(st.integers(0, 3))
    kind = draw(st.sampled_from(KINDS))
    aside = draw(st.sampled_from([0.0, 0.25])) if passing and kind == "wisp" else 0.0
    return {
        "place": (x, y, kind == "wisp" and passing),
        "position": (x + 0.5 + aside, y + 0.5),
        "velocity": (draw(speeds), draw(speeds)),
        "radius": draw(st.sampled_from([0.5, 0.25, 0.125])) if not aside else 0.25,
        "mass": math.inf if kind == "block" else 1.0,
        "kind": kind,
    }


@st.composite
def _scenes(draw: st.DrawFn, passing: bool) -> Scene:
    bodies = draw(st.lists(_body(passing), min_size=2, max_size=7, unique_by=lambda one: one["place"]))
    rules: dict[Any, Any] = {("*", "*"): draw(_answers), ("*", "wall"): draw(_answers), **SAME_LOOP}
    if passing:
        rules |= {("wisp", other): "pass" for other in KINDS}
    columns: dict[str, Any] = {name: [body[name] for body in bodies] for name in _COLUMNS}
    scene = Scene(
        **columns,
        arena=(4.0, 4.0),
        settings=Settings(until=draw(st.sampled_from([1.0, 2.0, 4.0]))),
        responses=rules,
        kinds=(*KINDS, *ABSENT),
    )
    return carried_out(scene, draw(drawn_commands(KINDS)))


def ruled_scenes() -> st.SearchStrategy[Scene]:
    """Up to seven bodies in a box, some of which pass through all others, and up to ten commands."""
    return _scenes(True)


def solid_scenes() -> st.SearchStrategy[Scene]:
    """Return the same for a phase that is right only while no body passes through another."""
    return _scenes(False)
