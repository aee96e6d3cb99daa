"""Hypothesis strategies for scenes: small ones, living ones, swarms, marathons, lattices by the hundred."""

from kinetile_conformance.strategies.small import MOST, scenes

__all__ = ["MOST", "scenes"]
