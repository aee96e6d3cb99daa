"""Swarms: scenes of many bodies, each of a kind that puts places, lists and counters of a phase to use.

What a phase keeps in a list overflows in a crowd, what it keeps in a table collides when there are many, a
number of 8 bits ends at 256 bodies, and truncation is not floor left of the origin. None of that shows with
six bodies. A swarm is made with NumPy from its kind, how many bodies, a seed, and a variation of its kind;
one drawn number says all four. What fails is made smaller body by body (``reduction``).

Every body begins in a slot of its own, so that none overlap. All masses are equal, since each case of the
loop is compiled; kinds without an arena keep together by turns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
from hypothesis import strategies as st

from kinetile.scene import Scene
from kinetile_conformance.strategies.swarms.great_and_small import crowd, giants, lanes, plough
from kinetile_conformance.strategies.swarms.in_an_arena import (
    burst,
    corridor,
    crossings,
    gas,
    lattice,
    resting,
    shear,
)
from kinetile_conformance.strategies.swarms.in_the_plane import cloud, far, returning
from kinetile_conformance.strategies.swarms.pieces import Swarm

__all__ = ["CONTACTS", "GIANTS", "KINDS", "giant_scenes", "swarm", "swarm_scenes"]

CONTACTS = 1500
"""After so many contacts a swarm has shown what it can show."""

FEWEST, MOST = 8, 400

KINDS: dict[str, Callable[[np.random.Generator, int, int], Swarm]] = {
    "gas": gas,
    "cloud": cloud,
    "crowd": crowd,
    "far": far,
    "lattice": lattice,
    "shear": shear,
    "corridor": corridor,
    "giants": giants,
    "resting": resting,
    "burst": burst,
    "crossings": crossings,
    "returning": returning,
}
"""The kinds of swarms, the simplest first."""

GIANTS: dict[str, Callable[[np.random.Generator, int, int], Swarm]] = {"plough": plough, "lanes": lanes}
"""Kinds with few large bodies of which one scene in four or five shows what there is: they have a check of
their own."""


def swarm(kind: str, bodies: int = 100, seed: int = 0, variation: int = 0) -> Scene:
    """Return a swarm of a kind, of so many bodies (at least 8); ``variation``, from 0 to 7, is of its sizes,
    speeds or proportions."""
    return (KINDS | GIANTS)[kind](np.random.default_rng(seed), bodies, variation).scene


def _numbered(kinds: Iterable[str], number: int) -> Scene:
    """Return the swarm of a number: its kind is the remainder, the rest is drawn from the quotient."""
    names = tuple(kinds)
    seed, kind = divmod(number, len(names))
    random = np.random.default_rng(seed)
    bodies, variation = random.integers(FEWEST, MOST + 1), random.integers(8)
    return swarm(names[kind], int(bodies), seed, int(variation))


def swarm_scenes() -> st.SearchStrategy[Scene]:
    """Return the swarms.

    They are drawn by one number: of several, Hypothesis draws the first and the last values over and over,
    and of twelve kinds leaves out three or four in fifty scenes.
    """
    return st.integers(0, 2**24 - 1).map(partial(_numbered, KINDS))


def giant_scenes() -> st.SearchStrategy[Scene]:
    """Return those with giants, drawn likewise."""
    return st.integers(0, 2**24 - 1).map(partial(_numbered, GIANTS))
