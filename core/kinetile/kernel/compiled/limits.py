"""Limits of a process, enforced by the system: a compiled loop cannot be interrupted from within."""

from __future__ import annotations

import math
import signal
import time
from contextlib import suppress
from pathlib import Path


def end_after(seconds: float) -> None:
    """Has the system end this process after ``seconds`` more CPU seconds, rounded up, where it can."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_CPU)
        limit = math.ceil(time.process_time() + seconds) if math.isfinite(seconds) else most
        if most != resource.RLIM_INFINITY:
            limit = min(limit, most)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, most))


def limit_memory(more: int) -> None:
    """Limits the memory of this process to ``more`` bytes beyond what it has now, where the system can."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limit = pages * resource.getpagesize() + more
        _, most = resource.getrlimit(resource.RLIMIT_AS)
        if most != resource.RLIM_INFINITY:
            limit = min(limit, most)
        resource.setrlimit(resource.RLIMIT_AS, (limit, most))


def out_of_time(code: int | None) -> bool:
    """Whether a process with this exit code was ended by ``end_after``."""
    return code == -getattr(signal, "SIGXCPU", 0)
