"""Memory watched: what hooks change that is not theirs, and what they touch outside of their arrays.

Two ways, since neither sees everything. ``interpreted`` runs a phase with NUMBA_DISABLE_JIT=1 and every hook
in a ``barrier`` of comparisons, on tables that look at each index (``bounds``): it names hook, field and
line, on small scenes. ``canaries`` runs the compiled loop, as it is, with every array between zones that
nobody may write to: it names the array, on large scenes. ``scenes`` are those that both look at, ``child`` is
the interpreter of its own that the first one needs.
"""

from __future__ import annotations
