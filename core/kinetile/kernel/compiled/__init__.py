"""The one place that uses Numba.

Phases and kernel are plain Python functions marked with ``hook``. The code that makes them as fast as C is
here:

* ``hooks``: every hook is forced inline, and arrays are viewed without their owners; a long function that is
  called from few places is compiled separately, and the loop calls it by name (``apart``);
* ``views``: the tables for a loop, and for hooks that are not marked ``unchecked``; ``plain``: for Python;
* ``composer``: composes the loop once for a choice of phases (``compose``), and shortens the compiler's
  message on a hook;
* ``fingerprint`` and ``cache``: machine code is kept on disk, under a name that carries a fingerprint of
  everything compiled into it;
* ``limits``: limits of a process, enforced by the system, since no compiled loop can be interrupted.

Called from Python a hook is its Python function, so the same source runs without a compiler: at the start of
a run, in a debugger, for coverage, and throughout a process with ``NUMBA_DISABLE_JIT=1``.
"""

import os

if not os.path.isdir(__path__[0]):  # fingerprints of loops are made from files beside the code
    raise ImportError(f"kinetile cannot run from within an archive ({__path__[0]}): unpack the wheel")

from kinetile.kernel.compiled.composer import NOTHING_IS_COMPILED as NOTHING_IS_COMPILED
from kinetile.kernel.compiled.composer import NotCompiled as NotCompiled
from kinetile.kernel.compiled.composer import Packed as Packed
from kinetile.kernel.compiled.composer import as_python as as_python
from kinetile.kernel.compiled.composer import bound as bound
from kinetile.kernel.compiled.composer import compiled_by_default as compiled_by_default
from kinetile.kernel.compiled.composer import compiling_seconds as compiling_seconds
from kinetile.kernel.compiled.composer import compose as compose
from kinetile.kernel.compiled.composer import default as default
from kinetile.kernel.compiled.composer import is_cached as is_cached
from kinetile.kernel.compiled.composer import make_ready as make_ready
from kinetile.kernel.compiled.composer import while_compiling as while_compiling
from kinetile.kernel.compiled.composer import with_numpy as with_numpy
from kinetile.kernel.compiled.hooks import NOTHING as NOTHING
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
from kinetile.kernel.compiled.hooks import with_accelerations as with_accelerations
from kinetile.kernel.compiled.hooks import with_constants as with_constants
from kinetile.kernel.compiled.hooks import with_field as with_field
from kinetile.kernel.compiled.hooks import with_shapes as with_shapes
from kinetile.kernel.compiled.views import disowned as disowned
from kinetile.kernel.compiled.views import numbers_from as numbers_from
from kinetile.kernel.compiled.views import pointer as pointer
from kinetile.kernel.compiled.views import with_shadows as with_shadows
from kinetile.kernel.compiled.views import wrapping as wrapping
from kinetile.kernel.compiled.views import zeros as zeros
