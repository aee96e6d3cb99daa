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

from kinetile.kernel.compiled.composer import NotCompiled as NotCompiled
from kinetile.kernel.compiled.composer import bound as bound
from kinetile.kernel.compiled.composer import compiling_seconds as compiling_seconds
from kinetile.kernel.compiled.composer import compose as compose
from kinetile.kernel.compiled.composer import is_cached as is_cached
from kinetile.kernel.compiled.composer import make_ready as make_ready
from kinetile.kernel.compiled.composer import packed as packed
from kinetile.kernel.compiled.composer import replaced as replaced
from kinetile.kernel.compiled.composer import while_compiling as while_compiling
from kinetile.kernel.compiled.composer import with_numpy as with_numpy
from kinetile.kernel.compiled.hooks import INTERPRETED as INTERPRETED
from kinetile.kernel.compiled.hooks import Hook as Hook
from kinetile.kernel.compiled.hooks import Numbers as Numbers
from kinetile.kernel.compiled.hooks import apart as apart
from kinetile.kernel.compiled.hooks import hook as hook
from kinetile.kernel.compiled.hooks import is_checked as is_checked
from kinetile.kernel.compiled.hooks import is_hook as is_hook
from kinetile.kernel.compiled.hooks import larger as larger
from kinetile.kernel.compiled.hooks import python_of as python_of
from kinetile.kernel.compiled.hooks import smaller as smaller
from kinetile.kernel.compiled.hooks import subroutine as subroutine
from kinetile.kernel.compiled.hooks import template as template
from kinetile.kernel.compiled.hooks import to_be_filled_in as to_be_filled_in
from kinetile.kernel.compiled.hooks import unchecked as unchecked
from kinetile.kernel.compiled.hooks import with_field as with_field
from kinetile.kernel.compiled.hooks import with_shapes as with_shapes
from kinetile.kernel.compiled.views import disowned as disowned
from kinetile.kernel.compiled.views import numbers_from as numbers_from
from kinetile.kernel.compiled.views import pointer as pointer
from kinetile.kernel.compiled.views import with_shadows as with_shadows
from kinetile.kernel.compiled.views import wrapping as wrapping
from kinetile.kernel.compiled.views import zeros as zeros
