"""What a simulation is made of: phases found by name, the rules of its scene, and the loop that contains them
and nothing else."""

from __future__ import annotations

from kinetile.run.composition.phases import (
    DEFAULT_BROAD_PHASE,
    Commands,
    Composition,
    check_options,
    compose_phases,
    read_narrow_phases,
)
from kinetile.run.composition.rules import Rules

__all__ = [
    "DEFAULT_BROAD_PHASE",
    "Commands",
    "Composition",
    "Rules",
    "check_options",
    "compose_phases",
    "read_narrow_phases",
]
