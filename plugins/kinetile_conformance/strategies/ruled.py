"""Scenes with kinds of bodies and responses: who passes whom, who stops, who loses what.

The bodies are those of the small scenes, and some lie on top of others that they pass. Three kinds meet by
rules that are drawn; beside them every scene names the same responses, for kinds that it declares and nobody
is of, so that one loop serves all of them.
"""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

from kinetile.scene import Response, Scene, Settings
from kinetile_conformance.strategies.living import carried_out, wishes
from kinetile_conformance.strategies.small import speeds

__all__ = ["ABSENT", "SAME_LOOP", "ruled_scenes", "solid_scenes"]

KINDS = ("ball", "wisp", "block")
ABSENT = ("nobody", "no one")
_LOSSY = Response("restitution", e=0.5, contact_time=2.0**-10)
_COLUMNS = ("position", "velocity", "radius", "mass", "kind")
SAME_LOOP: dict[Any, Any] = {("nobody", "nobody"): "stop", ("nobody", "no one"): _LOSSY}
"""Rules for kinds that nobody is of: with them, scenes of any rules have one loop."""

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
    return carried_out(scene, draw(wishes(KINDS)))


def ruled_scenes() -> st.SearchStrategy[Scene]:
    """Up to seven bodies in a box, some of which pass through all others, and up to ten commands."""
    return _scenes(True)


def solid_scenes() -> st.SearchStrategy[Scene]:
    """The same for a phase that is right only while nobody passes through another."""
    return _scenes(False)
