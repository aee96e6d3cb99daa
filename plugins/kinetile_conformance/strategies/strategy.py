"""A strategy: scenes that Hypothesis draws, or of one number each, or fixed; a seed always gives the same."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from unittest.mock import patch

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded
from hypothesis import strategies as st

from kinetile import Scene
from kinetile_conformance.cases import CONTACTS

Draw = Callable[[int, int], Iterable[Scene]]
"""Called with a number of scenes and a seed: returns that number, more, or all scenes."""


@dataclass(frozen=True)
class Strategy:
    """A row of the table: scenes of one kind. ``suffix`` and ``where`` end the name and the sentence of a
    check on them; ``contacts`` is the limit of a run; ``broad`` scenes judge only broad phases; ``fixed``
    is the number of scenes that are always the same, or 0."""

    name: str
    draw: Draw
    suffix: str
    where: str
    contacts: int = CONTACTS
    broad: bool = False
    fixed: int = 0


@contextmanager
def _no_constants() -> Iterator[None]:
    """Lets Hypothesis draw no constants of loaded modules: else a seed has other scenes in each project."""
    try:
        from hypothesis.internal.conjecture.providers import HypothesisProvider
    except ImportError:  # a version without them
        yield
        return
    with patch.object(HypothesisProvider, "_maybe_draw_constant", lambda *_, **__: None, create=True):
        yield


def drawn(make: Callable[[], st.SearchStrategy[Scene]]) -> Draw:
    """Returns a function that draws from a Hypothesis strategy, which is made at its first use."""

    def draw(count: int, seed: int) -> list[Scene]:
        found: list[Scene] = []

        @seeded(seed)
        @settings(
            max_examples=count,
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(make())
        def keep(scene: Scene) -> None:
            found.append(scene)

        with _no_constants():
            keep()
        return found

    return draw


def numbered(make: Callable[[int], Scene]) -> Draw:
    """Returns a function that draws scenes from one number each. Hypothesis would draw the first and the last
    numbers repeatedly, and omit three or four of twelve kinds in fifty scenes."""

    def draw(count: int, seed: int) -> Iterator[Scene]:
        return map(make, np.random.default_rng(seed).integers(0, 2**24, count).tolist())

    return draw
