"""Living scenes of the conformance kit as Hypothesis strategies: each draws one of forty that were played."""

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import islice

from hypothesis import strategies as st

import kinetile as kt
from kinetile.kernel.compiled import INTERPRETED
from kinetile_conformance.strategies.living import played


@cache
def _some(kind: str) -> tuple[kt.Scene, ...]:
    # In a thread of its own: to Hypothesis a machine that runs within a test would be a test within a test.
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(lambda: tuple(islice(played(kind), 4 if INTERPRETED else 40))).result()


def ruled_scenes() -> st.SearchStrategy[kt.Scene]:
    """Return a strategy of up to seven bodies of three kinds in a box at the start; in half of the scenes
    some pass through all others."""
    return st.deferred(lambda: st.sampled_from(_some("ruled")))
