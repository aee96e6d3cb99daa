"""What is simulated, as a value: from arrays, or from and to a file."""

from __future__ import annotations

from kinetile.scene.scene import Scene, Settings, Turn, relabelled

__all__ = ["Scene", "Settings", "Turn", "relabelled"]
