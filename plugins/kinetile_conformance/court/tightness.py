"""How much a broad phase over-reports: what it costs, and no fault."""

from __future__ import annotations

import numpy as np

from kinetile.errors import KinetileError
from kinetile.plugin.by_name import make_scene
from kinetile_conformance.cases import Subject

__all__ = ["tightness"]


def tightness(subject: Subject) -> float | None:
    """Return candidate pairs for each pair whose bounding boxes overlap, in a dense gas; None where it
    refuses that gas, or fails there."""
    try:
        return _measured(subject)
    except KinetileError:  # no check asks for so many bodies
        return None


def _measured(subject: Subject) -> float | None:
    """Return the ratio; None where no boxes overlap."""
    sim = subject.simulation(make_scene("grid", bodies=100, density=0.5))
    held = needed = 0
    for step in range(1, 11):
        sim.run(until=0.1 * step)
        place = sim.positions()
        gap = np.abs(place[:, None] - place[None]).max(axis=2) - 2.0 * float(sim.scene.radius[0])
        needed += int(np.triu(gap <= 0.0, 1).sum())
        held += len(sim.candidate_pairs())
    return held / needed if needed else None
