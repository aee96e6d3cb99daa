"""A million queries of each hard family: the kernel's ticks are exact.

``tests/core/kernel/certificates/test_contacts.py`` does the same with families of its own, grazes of all
depths among them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kinetile.kernel.compiled import INTERPRETED
from kinetile.toolbox import NEVER
from kinetile_accuracy.contact_times.families import FAMILIES, Family, Queries
from kinetile_accuracy.contact_times.forms import KERNEL, forms, ticks_by
from kinetile_accuracy.specification import arithmetic

SLICE = 50_000
ARRAYS = ("position", "velocity", "radius", "anchor")

each_family = pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)


def wrong(queries: Queries) -> int:
    """Return how many answers are not the exact ticks, or not the same with the bodies in the other order."""
    meet = forms()[KERNEL]
    swapped = replace(queries, **{name: getattr(queries, name)[:, ::-1] for name in ARRAYS})
    exact = [arithmetic.pair_tick(*plans) for plans in queries.plans()]
    ticks = np.array([NEVER if tick is None else tick for tick in exact], dtype=np.int64)
    return int(((ticks_by(meet, queries) != ticks) | (ticks_by(meet, swapped) != ticks)).sum())


@each_family
def test_some_queries_have_the_exact_tick_in_both_orders(family: Family) -> None:
    assert wrong(family.draw(100 if INTERPRETED else 2_000)) == 0


def test_a_tick_that_is_one_off_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    right = arithmetic.pair_tick
    monkeypatch.setattr(arithmetic, "pair_tick", lambda *plans: (right(*plans) or 0) + 1)
    assert wrong(FAMILIES[0].draw(100)) == 100


@pytest.mark.long
@pytest.mark.compiled
@each_family
def test_a_million_queries_have_the_exact_tick_in_both_orders(family: Family) -> None:
    queries = family.draw(1_000_000)
    for first in range(0, len(queries), SLICE):
        some = {name: getattr(queries, name)[first : first + SLICE] for name in ARRAYS}
        assert wrong(replace(queries, **some)) == 0, f"after {first:,} queries"
