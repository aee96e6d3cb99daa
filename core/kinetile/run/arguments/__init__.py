"""What a simulation is asked for, checked before anything is done: an end, a stop, a command."""

from __future__ import annotations

from kinetile.run.arguments.reading import read_body, read_end, read_insertion, read_removal, read_turns
from kinetile.run.arguments.stopping import StopAt, read_stop, watch, watch_no_more

__all__ = [
    "StopAt",
    "read_body",
    "read_end",
    "read_insertion",
    "read_removal",
    "read_stop",
    "read_turns",
    "watch",
    "watch_no_more",
]
