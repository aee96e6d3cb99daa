"""The cost of a run of tests, in counts that do not depend on the load of a machine: steps of the kernel with
plain hooks, and compiled loops. ``test_cost.py`` compares the counts of the default lane with DEFAULT.
"""

from collections import Counter
from collections.abc import Mapping

import pytest

from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.run.engine import layout
from kinetile.run.engine.engine import Engine

DEFAULT = {"steps with plain hooks": 207_500, "loops": 11}
"""The counts of ``pytest`` without arguments. A change that makes it dearer has to change them. One loop is
made twice, by the tests of a run that goes over to it; two end with an error of the compiler."""

CPU_SECONDS, WALL_SECONDS = 344, 207
"""The measured duration on the processor of CONTRIBUTING: only here, for all that print it."""

counts: Counter[str] = Counter()


def is_judged_by(item: pytest.Item) -> bool:
    """Returns True if a test compares these counts: it has to run after all others."""
    return item.path.name == "test_cost.py"


def add(found: Mapping[str, int]) -> None:
    """Adds the counts of a child."""
    counts.update(found)


def count_steps() -> None:
    """Counts the steps of all engines of this process."""
    run_loop = Engine._run_loop

    def counted(engine: Engine, *given: int) -> int:
        before = layout.steps(engine.count)
        try:
            return run_loop(engine, *given)
        finally:
            counts["steps with plain hooks"] += int(layout.steps(engine.count) - before)

    if NOTHING_IS_COMPILED:
        Engine._run_loop = counted
