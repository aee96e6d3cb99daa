"""Where a benchmark was measured: versions and machine."""

from __future__ import annotations

import os
import platform
from typing import Any

__all__ = ["environment", "processor"]


def environment() -> dict[str, Any]:
    """Return what every benchmark's figures depend on: versions and machine."""
    from kinetile.records.versions import versions

    return {
        "versions": versions(),
        "machine": platform.machine(),
        "processor": processor(),
        "processors": os.cpu_count(),
        "system": platform.platform(terse=True),
    }


def processor() -> str:
    """Return the processor's name, as well as the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as lines:
            for line in lines:
                if line.startswith("model name"):
                    return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"
