"""The one place, with ``kernel/vectors``, that knows Numba.

Phases and kernel are plain Python functions marked with ``hook``. Four things make them as fast as C, and all
of them live here:

* every hook and every function it calls is forced inline (``hooks``), so that no array is ever passed by
  value between them;
* at the kernel's entry each array is re-viewed without its owner (``disowned``): Numba counts references
  atomically on every pass of an array that has one, and that count is most of the cost of a small function;
* the loop is composed once for a choice of phases (``composed``) and cached on disk under a name that
  carries a ``fingerprint`` of everything compiled into it;
* what is long and takes numbers only is compiled ``apart``, once for all loops.

With ``NUMBA_DISABLE_JIT=1`` the same source runs interpreted, for a debugger and for coverage.
"""

from __future__ import annotations

from kinetile.kernel.compiled.apart import apart, subroutine
from kinetile.kernel.compiled.composed import (
    NotCompiled,
    compose,
    is_cached,
    make_ready,
    template,
    to_be_filled_in,
)
from kinetile.kernel.compiled.hooks import (
    INTERPRETED,
    disowned,
    hook,
    is_hook,
    larger,
    nobody_compiles,
    smaller,
)

__all__ = [
    "INTERPRETED",
    "NotCompiled",
    "apart",
    "compose",
    "disowned",
    "hook",
    "is_cached",
    "is_hook",
    "larger",
    "make_ready",
    "nobody_compiles",
    "smaller",
    "subroutine",
    "template",
    "to_be_filled_in",
]
