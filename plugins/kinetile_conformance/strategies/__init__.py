"""Hypothesis strategies for scenes: small ones full of ties, swarms, marathons, and lattices by the
hundred."""

from __future__ import annotations

from kinetile_conformance.strategies.bulk import lattice_scenes, marathon_scenes
from kinetile_conformance.strategies.small import (
    MOST,
    box_scenes,
    grazing_scenes,
    line_scenes,
    plane_scenes,
    scenes,
    sized_scenes,
    sliding_scenes,
    wide_scenes,
)
from kinetile_conformance.strategies.swarms import giant_scenes, swarm_scenes

__all__ = [
    "MOST",
    "box_scenes",
    "giant_scenes",
    "grazing_scenes",
    "lattice_scenes",
    "line_scenes",
    "marathon_scenes",
    "plane_scenes",
    "scenes",
    "sized_scenes",
    "sliding_scenes",
    "swarm_scenes",
    "wide_scenes",
]
