"""The one place that knows Numba.

Phases and kernel are plain Python functions marked with ``hook``. What makes them as fast as C lives here:

* ``hooks``: every hook is forced inline, and arrays are viewed without their owners;
* ``composed``: the loop is composed once for a choice of phases (``compose``) and cached on disk, under a
  name that carries a fingerprint of everything compiled into it (``fingerprint``);
* ``complaints``: what the compiler says of a hook, made short;
* ``apart``: what is long, and called from few places, is compiled by itself and known to the loop by name;
* ``limits``: what a process may take, kept by the system, since no compiled loop can be interrupted.

With ``NUMBA_DISABLE_JIT=1`` the same source runs interpreted, for a debugger and for coverage.
"""

from __future__ import annotations

from kinetile.kernel.compiled.apart import apart
from kinetile.kernel.compiled.composed import (
    NotCompiled,
    compiling_seconds,
    compose,
    is_cached,
    make_ready,
    nobody_compiles,
    while_compiling,
)
from kinetile.kernel.compiled.hooks import (
    INTERPRETED,
    disowned,
    hook,
    is_hook,
    larger,
    smaller,
    subroutine,
    template,
    to_be_filled_in,
)

__all__ = [
    "INTERPRETED",
    "NotCompiled",
    "apart",
    "compiling_seconds",
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
    "while_compiling",
]
