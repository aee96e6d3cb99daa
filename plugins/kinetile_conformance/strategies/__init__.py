"""Hypothesis strategies for scenes: small ones full of ties, living ones, swarms, marathons, and lattices by
the hundred."""

from __future__ import annotations

from kinetile_conformance.strategies.small import MOST, scenes

__all__ = ["MOST", "scenes"]
