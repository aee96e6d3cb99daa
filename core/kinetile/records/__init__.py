"""Records of a run: event files and trajectories.

A name is imported at its first use: a run without records imports no recorder.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinetile.records.events import EventRecorder as EventRecorder
    from kinetile.records.finishing import Recovered as Recovered
    from kinetile.records.finishing import recover as recover
    from kinetile.records.reading import EventFile as EventFile
    from kinetile.records.reading import read_events as read_events
    from kinetile.records.trajectory import Trajectory as Trajectory
    from kinetile.records.trajectory import positions_at as positions_at

_HOME = {
    "EventFile": "reading",
    "EventRecorder": "events",
    "Recovered": "finishing",
    "Trajectory": "trajectory",
    "positions_at": "trajectory",
    "read_events": "reading",
    "recover": "finishing",
}

__all__ = [
    "EventFile",
    "EventRecorder",
    "Recovered",
    "Trajectory",
    "positions_at",
    "read_events",
    "recover",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
