"""Commands that say how right a run is: accuracy, oracle, certify-log."""

from __future__ import annotations

__all__: list[str] = []
