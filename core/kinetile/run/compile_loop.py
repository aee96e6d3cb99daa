"""The program of the process that compiles a loop while a run begins as Python (``engine.meanwhile``)."""

import fcntl
import os
import pickle
import sys

from kinetile.kernel.compiled import is_cached
from kinetile.kernel.compiled.cache import folder
from kinetile.run.compose import compose_phases
from kinetile.run.engine.engine import Engine

_LATER = 4
"""The increment of the process's niceness."""


def main() -> None:
    """Compiles the loop of the engine that the standard input describes."""
    os.nice(_LATER)
    (kind, values), broad_phase, narrow_phases, options, commands = pickle.load(sys.stdin.buffer)
    scene = object.__new__(kind)
    vars(scene).update(values)
    engine = Engine(scene, compose_phases(scene, broad_phase, narrow_phases, options), False, commands)
    folder().mkdir(parents=True, exist_ok=True)
    fcntl.flock(os.open(folder(), os.O_RDONLY), fcntl.LOCK_EX)
    if not is_cached(engine.loop):
        engine.compile(wholly=True)
