"""Time limits of judged phases, in processor time without compiling: wall time would judge the machine. A
check that needs more is *not judged*. One scene has a separate limit, far beyond the need of any scene: a
phase that exceeds it is in an endless loop, which the system ends, with the process, by a signal."""

import contextlib
import math
import os
import time
from collections.abc import Iterator

from kinetile.instruments import (
    NOTHING_IS_COMPILED,
    compiling_seconds,
    end_after,
    limit_memory,
    while_compiling,
)

SECONDS = 600.0 if NOTHING_IS_COMPILED else 60.0
"""CPU seconds that a check of a hundred scenes may take, without compiling."""

SCENE_SECONDS = 300.0 if NOTHING_IS_COMPILED else 20.0
"""CPU seconds that a check may take for one simulation of a scene; most take a hundredth."""

LONGER = 4.0
"""The factor of this limit at a second try: a slow phase then ends, a loop does not."""


class TimeIsUp(BaseException):
    """A check has taken all its time; no error of the phase, and no code on the way may catch it."""


def spent() -> float:
    """Returns the CPU seconds of this process and of ended child processes, without compiling."""
    times = os.times()
    children = times.children_user + times.children_system
    return time.process_time() + children - compiling_seconds()


_limit = 0.0
"""The CPU seconds of a scene in this process; 0 for no limit."""


def keep_limits(scene: float, memory: int = 0) -> None:
    """Ends this process after some CPU seconds from ``begin_scene``, or bytes beyond now; 0: no limit."""
    global _limit
    _limit = scene
    while_compiling(uncounted)
    if memory:
        limit_memory(memory)


def begin_scene() -> None:
    """Starts the time of a scene now, if it is limited."""
    if _limit:
        end_after(_limit)


@contextlib.contextmanager
def uncounted() -> Iterator[None]:
    """Suspends the time limit: for compiling, for drawing, and to start processes that inherit it."""
    if _limit:
        end_after(math.inf)
    try:
        yield
    finally:
        begin_scene()
