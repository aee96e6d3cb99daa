"""Records of a run: event files and trajectories."""

from typing import TYPE_CHECKING

from kinetile.lazy import lazy_names

if TYPE_CHECKING:
    from kinetile.records.finishing import Recovered as Recovered
    from kinetile.records.finishing import recover as recover
    from kinetile.records.reading import EventFile as EventFile
    from kinetile.records.reading import read_events as read_events
    from kinetile.records.recorder import EventRecorder as EventRecorder
    from kinetile.records.trajectory import Trajectory as Trajectory
    from kinetile.records.trajectory import positions_at as positions_at

__all__, __getattr__ = lazy_names(__name__)
