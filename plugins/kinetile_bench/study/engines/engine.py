"""What an engine is: an executor, how many tasks it does at one time, and what can be done when it breaks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from typing import Protocol

from kinetile.errors import KinetileError

__all__ = ["Brought", "Engine", "EngineError"]


class EngineError(KinetileError, RuntimeError):
    """What does the tasks cannot go on; all rows that have come are there."""


class Engine(Protocol):
    """Does tasks.

    Attributes:
        width: how many tasks it does at one time.
        limit: CPU seconds after which it ends a worker that is at one task, or None.
    """

    width: int
    limit: float | None

    def start(self) -> Executor:
        """Return an executor that works: the first, or another one after one broke.

        Raises EngineError where there is none.
        """
        ...

    def check(self, versions: Iterable[Mapping[str, str]]) -> None:
        """Raise VersionsDiffer where a worker has not the versions that the tasks were made with."""
        ...

    def beside(self, under_way: int) -> int:
        """Return how many other tasks ran on one machine at the same time, at most, when so many were under
        way."""
        ...

    def end(self, *, at_once: bool) -> None:
        """Let all workers go; ``at_once``: in the middle of their tasks."""
        ...


class Brought:
    """An executor that the user brings, with everything in it. It is not shut down."""

    limit: float | None = None

    def __init__(self, executor: Executor, width: int) -> None:
        self._executor = executor
        self._started = False
        self.width = width

    def start(self) -> Executor:
        """Return the executor, once: nobody but who made it can make another."""
        if self._started:
            raise EngineError(
                "the executor that was given has broken: bring another one, and go on with that"
            )
        self._started = True
        return self._executor

    def check(self, versions: Iterable[Mapping[str, str]]) -> None:
        """Each task looks for itself: an executor says nothing of its workers."""

    def beside(self, under_way: int) -> int:
        """Return how many other tasks were under way: an executor does not say where."""
        return min(under_way, self.width) - 1

    def end(self, *, at_once: bool) -> None:
        """Leave the executor to who made it."""
