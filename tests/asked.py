"""Discs to ask about, laid out bare: none of a scene's rules applies, they overlap and lie about as they
like."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from hypothesis import strategies as st

import kinetile as kt
from kinetile.kernel.clock import Clock
from kinetile.kernel.tables import allocate
from kinetile.run.compose import Composition
from kinetile.run.questions.places import Moment

Disc = tuple[float, float, float]
"""x, y, radius."""


def laid_out(discs: list[Disc], slots: list[int] | None = None) -> Moment:
    """Return a moment at which resting discs are where they are, in the slots of their order."""
    k = allocate(len(discs), len(discs), 1)
    table = np.array(discs, dtype=float).reshape(-1, 3)
    k.bodies.x, k.bodies.y, k.bodies.radius = table.T
    k.radii[:] = table[:, 2]
    k.clock[0].tick = 2.0**-52
    asked = np.arange(len(discs)) if slots is None else np.array(slots, dtype=np.int64)
    return Moment(k, asked, Clock(0.0, 1.0), cast(Composition, None))


class Asked(kt.Simulation):
    """A simulation that is asked; its bodies have their slots for numbers."""

    planned: Mapping[int, int] = {}

    def _moment(self) -> Moment:
        engine = self._engine
        return Moment(engine.k, np.arange(len(engine.k.bodies)), engine.clock, self.composition)

    def _slot_of(self, body: int) -> int:
        if not 0 <= body < len(self.scene):
            raise ValueError(f"there is no body {body}")
        return body

    def _bodies_of(self, slots: Any) -> Any:
        return slots

    def _planned(self) -> Mapping[int, int]:
        return self.planned


class Renumbered(Asked):
    """The same, but its bodies are numbered from 100 down the slots, and that in slot 0 is dead."""

    def _moment(self) -> Moment:
        living = np.arange(len(self.scene))[:0:-1].copy()
        engine = self._engine
        return Moment(engine.k, living, engine.clock, self.composition)

    def _slot_of(self, body: int) -> int:
        slot = len(self.scene) - 1 - (body - 100)
        if not 1 <= slot < len(self.scene):
            raise ValueError(f"there is no body {body}")
        return slot

    def _bodies_of(self, slots: Any) -> Any:
        return 100 + len(self.scene) - 1 - slots


quarters = st.integers(-12, 12).map(lambda i: i / 4)
"""Coordinates of a lattice: whatever can tie, does."""

nudges = st.sampled_from([0.0, 0.0, 0.0, 1.0, -1.0])


@st.composite
def lengths(draw: st.DrawFn, some: st.SearchStrategy[float]) -> float:
    """A number of the lattice, or the double next to it."""
    value = draw(some)
    nudge = draw(nudges)
    return float(np.nextafter(value, value + nudge)) if nudge and value else value


coordinates = lengths(quarters)
radii = lengths(st.sampled_from([0.25, 0.5, 0.75, 1.25, 2.5]))
wide = st.floats(-(2.0**200), 2.0**200).filter(lambda x: x == 0.0 or abs(x) >= 2.0**-200)
wide_radii = st.floats(2.0**-200, 2.0**200)

small_discs = st.lists(st.tuples(coordinates, coordinates, radii), max_size=12)
discs = st.one_of(
    small_discs,
    small_discs,
    st.lists(st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(0.01, 2.0)), max_size=12),
    st.lists(st.tuples(wide, wide, wide_radii), max_size=6),
)
points = st.one_of(
    st.tuples(coordinates, coordinates),
    st.tuples(coordinates, coordinates),
    st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)),
    st.tuples(wide, wide),
)
