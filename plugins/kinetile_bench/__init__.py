"""Benchmarks and studies: how fast broad phases are, on scenes of the thesis and on the user's own.

A study is a table of scenes, phases and seeds that is run task by task, on one machine or on many, and that
continues where it was stopped.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinetile_bench.study import Study as Study

__all__ = ["Study"]


def __getattr__(name: str) -> Any:
    """Imports the class at its first use: every command of kinetile imports this package."""
    if name != "Study":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from kinetile_bench.study import Study

    return Study
