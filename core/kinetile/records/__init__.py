"""Records of a run: event files and trajectories."""

from kinetile.records.events import EventRecorder
from kinetile.records.finishing import Recovered, recover
from kinetile.records.reading import EventFile, read_events
from kinetile.records.trajectory import Trajectory, positions_at

__all__ = [
    "EventFile",
    "EventRecorder",
    "Recovered",
    "Trajectory",
    "positions_at",
    "read_events",
    "recover",
]
