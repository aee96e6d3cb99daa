"""A simulation stopped, saved and taken up: as a snapshot in memory, as a copy, as a file.

There is one form for all of it, the ``Snapshot``: every table of the kernel and every array of the broad
phase's state as they lie in memory, and a few numbers. A file is a snapshot written down. What is put back
goes on to the same bits, structure and all (``restoring.as_it_was``), where the same phases of the same
version take it up. Any other broad phase takes up what a run *is*, its plans, clock, commands and contacts so
far, and builds its structure at the present moment (``restoring.built_anew``), by the law under which the
kernel does so itself: that cannot change an answer, only take time.
"""

from __future__ import annotations

from kinetile.run.saving.saves import CanBeSaved
from kinetile.run.saving.snapshot import Snapshot

__all__ = ["CanBeSaved", "Snapshot"]
