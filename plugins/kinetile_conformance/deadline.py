"""Time limits of what is judged, in processor time, without that of the compiler: wall time would judge the
machine. A check that needs more is *not judged*. One scene has a limit of its own, far beyond what any needs:
a phase that exceeds it is in an endless loop, which the system ends, with the process, by a signal."""

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
"""CPU seconds that a check may take for one simulation of a scene, of which most take a hundredth."""

LONGER = 4.0
"""How much longer it may take when it is tried again: a slow phase then comes to an end, a loop does not."""


class TimeIsUp(BaseException):
    """A check has taken all its time; no error of the phase, and no code on the way may catch it."""


def spent() -> float:
    """Returns the CPU seconds of this process, and of those it has waited for, without those of compiling."""
    times = os.times()
    children = times.children_user + times.children_system
    return time.process_time() + children - compiling_seconds()


_limit = 0.0
"""The CPU seconds of a scene in this process; 0: no limit is kept."""


def keep_limits(scene: float, memory: int = 0) -> None:
    """Has this process ended some CPU seconds after ``begin_scene``, or bytes beyond now; 0: no limit."""
    global _limit
    _limit = scene
    while_compiling(uncounted)
    if memory:
        limit_memory(memory)


def begin_scene() -> None:
    """Lets the time of a scene begin now, where it is limited."""
    if _limit:
        end_after(_limit)


@contextlib.contextmanager
def uncounted() -> Iterator[None]:
    """Within this no time is limited: for compiling, for drawing, and to start processes that inherit it."""
    if _limit:
        end_after(math.inf)
    try:
        yield
    finally:
        begin_scene()
