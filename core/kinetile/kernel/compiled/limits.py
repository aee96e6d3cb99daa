"""Limits of a process, enforced by the system: a compiled loop cannot be interrupted from within."""

import math
import signal
import time
from contextlib import suppress
from pathlib import Path


def end_after(seconds: float) -> None:
    """Makes the system end this process after ``seconds`` more CPU seconds, rounded up, where it can."""
    with suppress(ImportError, OSError, ValueError):
        limit = time.process_time() + seconds
        _limit("RLIMIT_CPU", math.ceil(limit) if math.isfinite(limit) else None)


def limit_memory(more: int) -> None:
    """Limits the memory of this process to ``more`` bytes beyond its present memory, where the system can."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        _limit("RLIMIT_AS", pages * resource.getpagesize() + more)


def _limit(name: str, limit: int | None) -> None:
    """Sets a soft limit of the system, at most the hard limit; None: the hard limit."""
    import resource

    kind = getattr(resource, name)
    _, most = resource.getrlimit(kind)
    if limit is None or limit > most != resource.RLIM_INFINITY:
        limit = most
    resource.setrlimit(kind, (limit, most))


def out_of_time(code: int | None) -> bool:
    """Returns True if a process with this exit code was ended by ``end_after``."""
    return code == -getattr(signal, "SIGXCPU", 0)
