"""Hypothesis strategies for scenes: small ones, living ones, swarms, marathons, lattices by the hundred."""

from __future__ import annotations

from kinetile_conformance.strategies.small import MOST, scenes

__all__ = ["MOST", "scenes"]
