"""Faults that an earlier kit let pass: in rare states of coming and going, at extreme scales, in bursts, in
what a phase draws and saves, and in what it does to its process."""

from __future__ import annotations

from collections.abc import Sequence

from phase_mutants import KILLED, Change, Mutant, after, before, instead

__all__ = ["MUTANTS"]

SAP_STATE = [
    after("    axis: Records  # (1,) 0 for x, 1 for y\n", "    told: Records  # what has happened\n"),
    after(
        '            axis=np.array([0 if self.axis == "x" else 1]),\n',
        "            told=np.zeros(4 + n, dtype=np.int64),\n",
    ),
]
"""``sap-1d`` with numbers to count in."""

PAIRED = "        if overlaps and other != body and is_there(k, other):\n"
"""Whether one who comes is paired with another."""


def _pairs_but(name: str, condition: str, why: str, *more: Change) -> Mutant:
    """Return ``sap-1d`` that pairs one who comes with others only while a condition holds."""
    paired = instead(PAIRED, PAIRED.replace("overlaps", f"overlaps and ({condition})"))
    return _mutant(name, "sap-1d", [*SAP_STATE, paired, *more], why)


def _mutant(name: str, base: str, changes: Sequence[Change], why: str, fate: str = KILLED) -> Mutant:
    return Mutant(name, base, changes, why, fate, family="found later")


LEAVE = '    """A body goes, and its pairs with it; the gaps that close behind its bounds are watched."""\n'
ENTER = (
    '    """A body comes: its bounds find their places, and whose intervals overlap its own '
    'are its pairs."""\n'
)
DRAW = (
    '    """Draws a link between every two bodies."""\n'
    "    return pair_links(combinations(np.flatnonzero(k.queue.number >= 0).tolist(), 2))\n"
)
NAIVE_PARTS = "        return BroadPhaseParts(draw=draw, periodic=True, near=near)"

MUTANTS = [
    _pairs_but(
        "pairs nobody to the left after twelve have gone",
        "s.told[0] < 12 or other > body",
        "a count of departures that runs over",
        after(LEAVE, "    s.told[0] += 1\n"),
    ),
    _pairs_but(
        "pairs nobody below at every fourth use of a slot",
        "s.told[4 + body] % 4 != 3 or other > body",
        "a slot's generation in two bits",
        after(ENTER, "    s.told[4 + body] += 1\n"),
    ),
    _pairs_but(
        "does not pair two who come at one tick",
        "s.told[4 + other] != k.clock[0].now + 1",
        "who came at this tick is taken to be dealt with",
        after(ENTER, "    s.told[4 + body] = k.clock[0].now + 1\n"),
    ),
    _mutant(
        "takes in sixteen a cell",
        "cells",
        [
            instead(
                "    come_home(k, s, body, 0)\n    watch(k, s, body)\n",
                "    come_home(k, s, body, 0)\n"
                "    home = s.homes[body]\n"
                "    if list_around(k, s, 0, home.cell, 0) > 16:\n"
                "        move_out(s, body, home.cell)\n"
                "        move_in(s, body, wrapped(s.levels[0], home.cell + 1))\n"
                "    watch(k, s, body)\n",
                "uniform",
            )
        ],
        "a crowded place is full, and who comes is put beside it",
    ),
    _pairs_but(
        "pairs at most seven of those who come",
        "s.told[1] < 7",
        "a list of newcomers with seven places",
        after(ENTER, "    s.told[1] = 0\n"),
        instead(
            "            add_pair(k, body, other)\n\n\n@unchecked\n@hook\ndef leave",
            "            add_pair(k, body, other)\n            s.told[1] += 1\n"
            "\n\n@unchecked\n@hook\ndef leave",
        ),
    ),
    _pairs_but(
        "forgets the first slot once the last has been left",
        "other > 0 or s.told[2] == 0",
        "an end that is set by who goes",
        after(LEAVE, "    if body >= 7:\n        s.told[2] = 1\n"),
    ),
    _mutant(
        "pools the state of large simulations",
        "cells",
        [
            before("\n\nclass Cells", "\n_POOL = {}\n", "__init__"),
            instead(
                "            state=empty(scene, sides),\n",
                "            state=_POOL.setdefault((scene.capacity, len(sides)), empty(scene, sides))\n"
                "            if scene.capacity > 50\n"
                "            else empty(scene, sides),\n",
                "__init__",
            ),
        ],
        "two simulations of over 50 bodies share their arrays",
    ),
    _mutant(
        "counts the bodies that cross at one tick up to 24",
        "cells",
        [
            after(
                "    hosts: Records  # (cells,) the first guest of a cell, or NOBODY; empty where there "
                "is one level\n",
                "    told: Records  # the tick, and how many crossed at it\n",
                "layout",
            ),
            after(
                "        hosts=np.zeros(cells if coarser else 0, np.int32),\n",
                "        told=np.zeros(2, np.int64),\n",
                "layout",
            ),
            instead(
                "    return list_ahead(k, s, 0, home.cell, right, up, 0)\n",
                "    if s.told[0] != k.clock[0].now:\n"
                "        s.told[0] = k.clock[0].now\n"
                "        s.told[1] = 0\n"
                "    s.told[1] += 1\n"
                "    if s.told[1] > 24:\n"
                "        return 0\n"
                "    return list_ahead(k, s, 0, home.cell, right, up, 0)\n",
                "uniform",
            ),
        ],
        "a list of those who cross at one tick with 24 places",
    ),
    _mutant(
        "rests where speeds are large",
        "cells",
        [
            instead(
                "    across = edge(grid, home.x, plan.vx) - plan.x\n",
                "    if s.homes.shape[0] > 20 and abs(plan.vx) > 1e10:\n"
                "        schedule(k, body, NEVER)\n"
                "        return\n"
                "    across = edge(grid, home.x, plan.vx) - plan.x\n",
                "uniform",
            )
        ],
        "a speed beyond 10^10 is taken for a mistake",
    ),
    _mutant(
        "keeps a lane in 40 bits",
        "cells",
        [
            instead(
                "    home.x += right\n    home.y += up\n",
                "    home.x += right\n    home.y += up\n"
                "    home.x = float((int(home.x) + 2**39) % 2**40 - 2**39)\n",
                "uniform",
            )
        ],
        "far from the origin a lane has another number",
    ),
    _mutant(
        "looks for edges with single precision far away",
        "cells",
        [
            instead(
                "    across = edge(grid, home.x, plan.vx) - plan.x\n",
                "    across = edge(grid, home.x, plan.vx) - plan.x\n"
                "    if abs(plan.x) > 1e13:\n"
                "        across = across + 64.0 * grid.side\n",
                "uniform",
            )
        ],
        "at coordinates of 10^14 an edge is found too late",
    ),
    _mutant(
        "takes nearly vertical for vertical",
        "cells",
        [
            instead(
                "    across = across / plan.vx if plan.vx != 0.0 else math.inf\n",
                "    across = across / plan.vx if abs(plan.vx) > 1e-3 * abs(plan.vy) else math.inf\n",
                "uniform",
            )
        ],
        "a slow drift across is not watched",
    ),
    _mutant(
        "cannot be drawn with four bodies",
        "naive",
        [instead(DRAW, "    assert len(k.bodies) < 4\n" + DRAW.split("\n", 1)[1])],
        "draw raises",
    ),
    _mutant(
        "draws into its tables",
        "naive",
        [instead(DRAW, "    k.near[0] = 0\n" + DRAW.split("\n", 1)[1])],
        "draw writes to the kernel's tables",
    ),
    _mutant(
        "has a state as long as its process",
        "sap-1d",
        [
            instead("import numpy as np\n", "import os\n\nimport numpy as np\n"),
            instead(
                '            axis=np.array([0 if self.axis == "x" else 1]),\n',
                '            axis=np.array([0 if self.axis == "x" else 1] * (1 + os.getpid() % 89)),\n',
            ),
        ],
        "the shape of an array depends on the process: resume fails",
    ),
    _mutant(
        "prints what it prepares",
        "naive",
        [before(NAIVE_PARTS, "        print(len(scene), 'bodies')\n")],
        "its words stand in the output of --json",
    ),
    _mutant(
        "seeds the random numbers of everybody",
        "naive",
        [before(NAIVE_PARTS, "        np.random.seed(0)\n")],
        "a study draws the same numbers over and over",
    ),
    _mutant(
        "keeps half a MiB of each simulation",
        "naive",
        [
            before("\n\nclass Naive", "\n\n_KEPT = []\n"),
            before(NAIVE_PARTS, "        _KEPT.append(np.ones(65_536))\n"),
        ],
        "memory ends with the thousandth simulation",
    ),
    _mutant(
        "sorts a line where there is a circle",
        "sap-1d",
        [
            instead(
                "        if self.axis in scene.periodic:\n", "        if self.axis in scene.periodic[9:]:\n"
            )
        ],
        "it says that it knows images, and knows none",
    ),
]
