"""Faults against single sentences of the contract, where that seldom matters: newcomers left out,
certificates that are not set anew, ticks that stay behind, levels of cells."""

from __future__ import annotations

from functools import partial

import numpy as np

import kinetile as kt
from mutants.scenes import crowd, gas
from mutants.witnesses import Accepts, Audited, Differs
from phase_mutant_table import BOTH, NO_AUDIT, but
from phase_mutants import Mutant, instead

__all__ = ["MUTANTS"]

CELLS = [instead("            audit=audit,\n", "", "__init__")]


def through() -> kt.Scene:
    """Return two bodies that fly through each other where no narrow phase is at work."""
    return kt.Scene(
        [[1.0, 2.0], [3.0, 2.1], [2.0, 1.0], [2.0, 3.0], [0.5, 0.5], [3.5, 3.5]],
        [[1.0, 0.25], [-1.0, 0.0], [0.125, 1.0], [0.0, -1.0], [0.75, 0.75], [-0.75, -0.5]],
        0.25,
        arena=(4.0, 4.0),
    )


def thick() -> kt.Scene:
    """Return bodies so small that the skin is thick against them."""
    rng = np.random.default_rng(4)
    n = 12
    position = np.stack(np.divmod(np.arange(n), 4), axis=1) * 0.25 + 0.125
    return kt.Scene(position, rng.uniform(-1.0, 1.0, (n, 2)), 2.0**-42, arena=(1.0, 1.0))


def stopped() -> kt.Scene:
    """Return a body that stops before the border of its cell, and one that meets it there."""
    return kt.Scene(
        [[0.0, 1.0], [0.0, 6.0]], [[0.0, 1.0], [0.0, -1.0]], 0.5, turns=[kt.Turn(0, 0.25, (0.0, 0.0))]
    )


def left_behind() -> kt.Scene:
    """Return a crowd at rest left of the origin, of which one flies to a wide body on the right."""
    places = np.stack(np.divmod(np.arange(49), 7), axis=1) - [7.5, 3.0]
    velocity = np.zeros((50, 2))
    velocity[45, 0] = 1.0
    return kt.Scene(np.vstack([places, [[20.0, 0.0]]]), velocity, [0.25] * 49 + [8.0])


def at_a_stretch() -> kt.Scene:
    """Return two bodies that meet over the middle of the cell between their own, each far outside its own."""
    return kt.Scene([[0.5, 1.0], [0.5, 5.0]], [[0.0, 1.0], [0.0, -1.0]], 0.5)


def far_apart_by_number() -> kt.Scene:
    """Return a light body, the first, that a heavy one, the last, throws back at another."""
    position = [[6.0, 0.5], [2.0, 0.5]] + [[20.0 + 2.0 * i, 0.5] for i in range(6)] + [[9.0, 0.5]]
    velocity = [[1.0, 0.0]] + [[0.0, 0.0]] * 8
    return kt.Scene(position, velocity, 0.5, mass=[1.0] * 8 + [100.0])


def _apart(axis: str) -> str:
    """Return how far apart two bodies are on an axis now, in a hook."""
    one, other = f"k.places[body].{axis}", f"k.places[other].{axis}"
    rate = f"(k.places[body].v{axis} - k.places[other].v{axis})"
    return f"({one} - {other} + {rate} * since_origin(k, k.clock[0].now))"


MUTANTS = [
    Mutant(
        "a corner of newcomers left out",
        "cells",
        [
            instead(
                "append_block(k, s, high, count, found)",
                "append_block(k, s, middle, count, found)",
                "layout",
            )
        ],
        "a newcomer left out of repair: the one in the corner ahead",
        family="contract",
        witness=Differs(partial(gas, 36, 0.25), 4.0, 300),
    ),
    Mutant(
        "guests on the left are overlooked",
        "cells",
        [
            instead(
                "            for right in range(-1, 2):\n",
                "            for right in range(0, 2):\n",
                "hierarchy",
            )
        ],
        "who is near whom is not mutual, where there are levels",
        family="contract",
        witness=Audited(partial(crowd, 49), 0.5, steps=2),
    ),
    Mutant(
        "guests are no newcomers below",
        "cells",
        [
            instead(
                "    if level > 0:\n        for step",
                "    if level > 0 and up >= 0:\n        for step",
                "hierarchy",
            )
        ],
        "a newcomer left out of repair, where there are levels",
        family="contract",
        witness=Differs(partial(crowd, 49, low=5.0), 12.0, 60),
    ),
    Mutant(
        "takes edge 0 for none",
        "cells",
        [
            instead(
                "if edges != math.floor(edges):",
                "if edges != math.floor(edges) or edges == 0.0:",
                "hierarchy",
            ),
            *CELLS,
        ],
        "a body that crosses the axis stays a guest where it was",
        family="contract",
        witness=Differs(left_behind, 20.0),
    ),
    Mutant(
        "a turn that stops a body is ignored",
        "cells",
        [
            instead(
                "    plan = k.bodies[body]\n    home",
                "    plan = k.bodies[body]\n"
                "    if plan.vx == 0.0 and plan.vy == 0.0 and k.queue[body].own < NEVER:\n"
                "        return\n    home",
                "uniform",
            ),
            *CELLS,
        ],
        "its certificate fails when it would have, and its cell is no longer its own",
        family="contract",
        witness=Differs(stopped, 8.0, options={"side": 2.0}),
    ),
    Mutant(
        "forgets the second body of a contact of two far apart by number",
        "sap-1d",
        [instead(BOTH, "range(4 * body, 4 * body + (0 if k.bodies[body].last - body > 6 else 2))"), NO_AUDIT],
        "a replan that is missed, in scenes of eight bodies or more",
        family="contract",
        witness=Differs(far_apart_by_number, 20.0),
    ),
    Mutant(
        "only half of its ticks are known",
        "sap-1d",
        [instead("[:, 0],)", "[:, 0, :1],)"), NO_AUDIT],
        "when the base of the clock moves on, those of the Rs stay behind",
        family="contract",
    ),
    Mutant(
        "leaves out one offer of several",
        "sweep-tiling",
        [
            instead(
                "        offer(k, one, other)\n",
                "        if (one ^ other) & 1 == 1:\n            offer(k, one, other)\n",
                "__init__",
            )
        ],
        "two others that have come into sight of each other, of certain numbers",
        family="contract",
        witness=Audited(partial(gas, 100), 0.1, steps=2),
    ),
    Mutant(
        "says that it needs no solid bodies",
        "sweep-tiling",
        [instead("            solid=True,\n", "", "__init__")],
        "where bodies pass through each other, what was hidden comes out unseen",
        family="contract",
        witness=Audited(through, 3.0, (), steps=60),
    ),
    Mutant(
        "says that it bears any skin",
        "sweep-tiling",
        [
            instead(
                "float(radius.min() / (8.0 * radius.max()) * radius.min()) if n else None", "None", "__init__"
            )
        ],
        "a third body, fattened, hides a contact from sight",
        family="contract",
        witness=Accepts(thick, "sweep-tiling"),
    ),
    Mutant(
        "bodies within each other are no pair",
        "naive",
        [
            but(f"abs({_apart('x')}) + abs({_apart('y')}) > k.bodies[0].radius or other == body"),
            instead("NoState, hook", "NoState, hook, since_origin"),
        ],
        "that cannot be while bodies are solid, and is where they are not",
        family="contract",
        witness=Audited(through, 3.0, (), steps=60),
    ),
    Mutant(
        "gives all room away",
        "cells",
        [
            instead(
                "levels.slack = 0.5 * (levels.side - least)",
                "levels.slack = 0.75 * (levels.side - least)",
                "layout",
            ),
            *CELLS,
        ],
        "two bodies that both stand outside their cells, towards each other",
        family="contract",
        witness=Differs(at_a_stretch, 4.0, options={"side": 2.0}),
    ),
    Mutant(
        "takes two skins for room",
        "cells",
        [
            instead(
                "levels.slack = 0.5 * (levels.side - least)",
                "levels.slack = 0.5 * (levels.side - least) + 4.0 * k.clock[0].limits.skin",
                "layout",
            ),
            *CELLS,
        ],
        "only a contact right over the middle of a cell can show it",
        family="contract",
        witness=Differs(at_a_stretch, 4.0, options={"side": 2.0}),
    ),
]
