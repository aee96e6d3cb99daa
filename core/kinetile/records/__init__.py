"""What is left of a run: event files, and where every body was at any time."""

from __future__ import annotations

from kinetile.records.events import EventFile, EventRecorder, read_events
from kinetile.records.trajectory import Trajectory, positions_at

__all__ = ["EventFile", "EventRecorder", "Trajectory", "positions_at", "read_events"]
