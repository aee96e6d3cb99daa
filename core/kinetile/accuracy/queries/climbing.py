"""Climbing: the deepest overlap at a computed contact, looked for instead of waited for.

The maximum of a sample says what the sample holds. Here the deepest queries found so far are changed, in all
their numbers and at all scales down to the last bit, and the deepest of what comes of it are changed again.
It finds more than a sample of the same size, and proves nothing either: the bound that is proved is eta
(``truth.Encounter.proved``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.accuracy.queries.families import FAMILIES
from kinetile.accuracy.queries.forms import KERNEL, ask, forms
from kinetile.accuracy.queries.questions import Queries
from kinetile.accuracy.queries.truth import Encounter
from kinetile.accuracy.queries.verdicts import Verdict, judge

__all__ = ["Climb", "climb"]

Floats = npt.NDArray[np.float64]
Ticks = npt.NDArray[np.int64]

KEPT, CHILDREN = 10, 50
"""How many queries are kept from round to round, and how often each of them is changed."""

STARTS = ("generic", "mass ratio to 1e12", "far apart")
"""The families climbed from; both discs of a query are anchored at one tick."""


class Climb(NamedTuple):
    """The deepest overlap that was found.

    Attributes:
        queries: how many were asked.
        depth_separation: it, in units of 2^-53 times the separation at the anchor.
        depth_proved: the deepest in units of eta, the proved bound of the query.
    """

    queries: int
    depth_separation: float
    depth_proved: float


def climb(rounds: int) -> Climb:
    """Climb for so many rounds from each family, once by either measure of the overlap."""
    asked = 0
    found = {"depth_separation": 0.0, "depth_proved": 0.0}
    for family in (family for family in FAMILIES if family.name in STARTS):
        for measure in found:
            draws = np.random.default_rng(5)
            queries = family.draw(KEPT * CHILDREN)
            for _ in range(rounds):
                verdicts = _judged(queries)
                asked += len(verdicts)
                for name in found:
                    found[name] = max(found[name], *(getattr(each, name) for each in verdicts))
                best = np.argsort([-getattr(each, measure) for each in verdicts])[:KEPT]
                queries = _changed(draws, queries, best)
    return Climb(asked, **found)


def _judged(queries: Queries) -> list[Verdict]:
    ticks = ask(forms()[KERNEL], queries).tolist()
    return [judge(Encounter(*plans), tick) for plans, tick in zip(queries.plans(), ticks, strict=True)]


def _changed(draws: np.random.Generator, queries: Queries, best: Ticks) -> Queries:
    """Return the best queries and changed copies of each, a scale for each copy; none begins overlapping."""
    each = np.repeat(best, CHILDREN)
    scale = 10.0 ** draws.uniform(-16.0, 0.0, (len(each), 1, 1))
    scale[::CHILDREN] = 0.0

    def near(values: Floats) -> Floats:
        return values[each] * (1.0 + scale * draws.normal(size=values[each].shape))

    position, radius = near(queries.position), np.abs(near(queries.radius[..., None])[..., 0])
    apart = np.hypot(*(position[:, 1] - position[:, 0]).T) > radius.sum(axis=1)
    return Queries(
        np.where(apart[:, None, None], position, queries.position[each]),
        near(queries.velocity),
        np.where(apart[:, None], radius, queries.radius[each]),
        queries.anchor[each],
    )
