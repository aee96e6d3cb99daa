"""How long a task may take in a worker process of a study's own: CPU seconds, which the system counts.

No compiled loop can be interrupted, so the process ends; whoever waits for it writes the row.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

from kinetile.kernel.compiled.limits import end_after

__all__ = ["limit_tasks", "limited"]

_limit = math.inf


def limit_tasks(seconds: float) -> None:
    """Have this process ended where a task takes more than so many of its CPU seconds."""
    global _limit
    _limit = seconds


@contextmanager
def limited() -> Iterator[None]:
    """A context that may take no longer than a task may."""
    if math.isfinite(_limit):
        end_after(_limit)
    try:
        yield
    finally:
        if math.isfinite(_limit):
            end_after(math.inf)
