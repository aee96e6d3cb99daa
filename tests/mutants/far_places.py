"""Faults of places that are hardly drawn: negative coordinates, long arenas, far away, small, slow."""

from __future__ import annotations

from functools import partial

import kinetile as kt
from mutants.scenes import meeting, row
from mutants.witnesses import Differs
from phase_mutant_table import but
from phase_mutants import Mutant, instead

__all__ = ["MUTANTS"]

CELLS = [instead("            audit=audit,\n", "", "__init__")]


def below_the_origin() -> kt.Scene:
    """Return a body that stands still and one that meets it from below, both at small negative places."""
    return kt.Scene([[0.0, -2.375], [0.0, -4.375]], [[0.0, 0.0], [0.0, 0.5]], 0.5)


def fine(far: float) -> kt.Scene:
    """Return two bodies that are small and far away."""
    return kt.Scene([[far, far], [far, far + 2.0**-8]], [[0.0, 2.0**-8], [0.0, 0.0]], 2.0**-12)


MUTANTS = [
    Mutant(
        "truncates where it should round down",
        "cells",
        [instead("np.floor(positions_now(k) /", "np.trunc(positions_now(k) /", "layout"), *CELLS],
        "cells below the origin are one too high",
        family="places",
        witness=Differs(below_the_origin, 8.0, options={"side": 1.25}),
    ),
    Mutant(
        "columns of five bits",
        "cells",
        [
            instead(
                "home.cell + right + up * grid.columns)\n    move_in",
                "home.cell + right + up * grid.columns) & 31\n    move_in",
                "uniform",
            ),
            *CELLS,
        ],
        "an arena of more than 32 cells across",
        family="places",
        witness=Differs(partial(row, 80), 120.0, 100, {"side": 1.0625}),
    ),
    Mutant(
        "cells of 32 bits",
        "cells",
        [
            instead('        ("y", "f8"),\n', '        ("y", "i4"),\n', "layout"),
            *CELLS,
        ],
        "cells beyond 2^31, where bodies are small and far away",
        family="places",
        witness=Differs(partial(fine, 2.0**26), 4.0),
    ),
    Mutant(
        "the end of the world",
        "naive",
        [but("abs(k.bodies[other].x) < 2.0**33 and abs(k.bodies[body].x) < 2.0**33")],
        "far away everything is nowhere",
        family="places",
        witness=Differs(partial(meeting, 2.0**34), 8.0),
    ),
    Mutant(
        "too small to see",
        "naive",
        [but("k.bodies[other].radius > 2.0**-30 and k.bodies[body].radius > 2.0**-30")],
        "an absolute length where there is none",
        family="places",
        witness=Differs(partial(meeting, 0.0, 2.0**-32, 2.0**-32), 8.0),
    ),
    Mutant(
        "too slow to matter",
        "cells",
        [
            instead("if plan.vx != 0.0 else", "if abs(plan.vx) > 2.0**-30 else", "uniform"),
            instead("if plan.vy != 0.0 else", "if abs(plan.vy) > 2.0**-30 else", "uniform"),
            *CELLS,
        ],
        "an absolute speed where there is none",
        family="places",
        witness=Differs(partial(meeting, 0.0, 2.0**-32, 2.0**-32, 12.0), 16.0, options={"side": 2.0**-30}),
    ),
]
