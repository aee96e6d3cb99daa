"""The one place that knows Numba.

Phases and kernel are plain Python functions marked with ``hook``. What makes them as fast as C lives here:

* ``hooks``: every hook is forced inline, and arrays are viewed without their owners; what is long, and
  called from few places, is compiled by itself and known to the loop by name (``apart``);
* ``views``: the tables as a loop sees them, and as hooks do that are not marked ``unchecked``;
* ``composer``: the loop is composed once for a choice of phases (``compose``), and what the compiler says of
  a hook is made short;
* ``fingerprint`` and ``cache``: machine code is kept on disk, under a name that carries a fingerprint of
  everything compiled into it;
* ``limits``: what a process may take, kept by the system, since no compiled loop can be interrupted.

With ``NUMBA_DISABLE_JIT=1`` the same source runs interpreted, for a debugger and for coverage.
"""

from __future__ import annotations

from kinetile.kernel.compiled.composer import (
    NotCompiled,
    compiling_seconds,
    compose,
    is_cached,
    make_ready,
    while_compiling,
    with_numpy,
)
from kinetile.kernel.compiled.hooks import (
    INTERPRETED,
    Numbers,
    apart,
    hook,
    is_checked,
    is_hook,
    larger,
    python_of,
    smaller,
    subroutine,
    template,
    to_be_filled_in,
    unchecked,
    with_shapes,
)
from kinetile.kernel.compiled.views import disowned, numbers_from, pointer, wrapping

__all__ = [
    "INTERPRETED",
    "NotCompiled",
    "Numbers",
    "apart",
    "compiling_seconds",
    "compose",
    "disowned",
    "hook",
    "is_cached",
    "is_checked",
    "is_hook",
    "larger",
    "make_ready",
    "numbers_from",
    "pointer",
    "python_of",
    "smaller",
    "subroutine",
    "template",
    "to_be_filled_in",
    "unchecked",
    "while_compiling",
    "with_numpy",
    "with_shapes",
    "wrapping",
]
