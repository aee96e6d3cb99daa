"""The environment of a measurement: versions and machine."""

import os
import platform
from contextlib import suppress
from typing import Any

from kinetile.instruments import versions


def environment() -> dict[str, Any]:
    """Returns the versions and the machine, which every measured figure depends on."""
    return {
        "versions": versions(),
        "machine": platform.machine(),
        "processor": processor(),
        "processors": os.cpu_count(),
        "system": platform.platform(terse=True),
    }


def processor() -> str:
    """Returns the processor's name, as far as the system gives it."""
    with suppress(OSError, StopIteration), open("/proc/cpuinfo", encoding="utf-8", errors="replace") as lines:
        return next(line for line in lines if line.startswith("model name")).partition(":")[2].strip()
    return platform.processor() or "unknown"
