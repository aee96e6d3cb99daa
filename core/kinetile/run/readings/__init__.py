"""What a simulation says of itself: what a run cost and how true it stayed, and what is modelled at all."""

from __future__ import annotations

from kinetile.run.readings.explanation import explanation
from kinetile.run.readings.readings import Readings, energy

__all__ = ["Readings", "energy", "explanation"]
