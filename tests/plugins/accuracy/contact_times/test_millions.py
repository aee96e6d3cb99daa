"""A million queries of each hard family, and of grazes of all depths: the kernel's ticks are exact."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from encounters import FAMILIES as ENCOUNTERS
from kinetile.kernel.compiled import INTERPRETED
from kinetile.toolbox import NEVER
from kinetile_accuracy.contact_times.families import FAMILIES, Queries
from kinetile_accuracy.contact_times.forms import KERNEL, forms, ticks_by
from kinetile_accuracy.specification import arithmetic

NAMES = [*(family.name for family in FAMILIES), "grazes of all depths"]
SLICE = 50_000


def grazes(count: int) -> Queries:
    """Grazes of 1e-17 to 1e-3 of the reach, and of a few ulps, the first disc under way for a while."""
    kinds = [draw for name, draw in ENCOUNTERS.items() if "graze" in name]
    assert len(kinds) == 4
    rng = np.random.default_rng(6)
    rows = np.concatenate([draw(rng, count // len(kinds)) for draw in kinds])

    def pairs(*names: str) -> np.ndarray:
        return np.column_stack([rows[name] for name in names]).reshape(len(rows), 2, -1)

    return Queries(
        pairs("x", "y", "x2", "y2"),
        pairs("vx", "vy", "vx2", "vy2"),
        pairs("radius", "radius2")[..., 0],
        np.column_stack([np.zeros_like(rows["elapsed"]), rows["elapsed"]]),
    )


def sliced(name: str, count: int) -> Iterator[Queries]:
    drawn = {family.name: family.draw for family in FAMILIES}.get(name, grazes)(count)
    for first in range(0, count, SLICE):
        yield drawn.some(slice(first, first + SLICE))


def wrong(queries: Queries) -> int:
    """Return how many answers are not the exact ticks, or not the same with the bodies in the other order."""
    meet = forms()[KERNEL]
    exact = [arithmetic.pair_tick(*plans) for plans in queries.plans()]
    ticks = np.array([NEVER if tick is None else tick for tick in exact], dtype=np.int64)
    return int(((ticks_by(meet, queries) != ticks) | (ticks_by(meet, queries.swapped()) != ticks)).sum())


@pytest.mark.parametrize("name", NAMES)
def test_some_queries_have_the_exact_tick_in_both_orders(name: str) -> None:
    (queries,) = sliced(name, 100 if INTERPRETED else 2_000)
    assert wrong(queries) == 0


def test_a_tick_that_is_one_off_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    (queries,) = sliced("generic", 100)
    right = arithmetic.pair_tick
    monkeypatch.setattr(arithmetic, "pair_tick", lambda *plans: (right(*plans) or 0) + 1)
    assert wrong(queries) == 100


@pytest.mark.long
@pytest.mark.compiled
@pytest.mark.parametrize("name", NAMES)
def test_a_million_queries_have_the_exact_tick_in_both_orders(name: str) -> None:
    asked = 0
    for queries in sliced(name, 1_000_000):
        assert wrong(queries) == 0, f"after {asked:,} queries"
        asked += len(queries)
    assert asked == 1_000_000
