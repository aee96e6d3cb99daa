"""Faults that take more bodies than a drawn scene has: numbers too narrow, lists too short, hashes that
collide."""

from __future__ import annotations

from functools import partial

from mutants.scenes import corner, gas, numbered, overlapping, stack
from mutants.witnesses import Audited, Differs
from phase_mutant_table import NO_AUDIT, RANKS, but
from phase_mutants import Mutant, instead

__all__ = ["MUTANTS"]

NAMED = "        k.near[other] = other\n"
LIST = "    body = s.lists[cell]\n    while body >= 0:\n        k.near[count] = body\n"
THIRD = "            for right in range(-1, 2):\n                count = append_list("
CELLS = [instead("            audit=audit,\n", "", "__init__")]

MUTANTS = [
    Mutant(
        "body numbers of five bits",
        "naive",
        [instead(NAMED, "        k.near[other] = other & 31\n")],
        "bodies from the 33rd on are never named",
        family="many bodies",
        witness=Differs(partial(numbered, 40, 38, 39), 3.0),
    ),
    Mutant(
        "body numbers of seven bits",
        "naive",
        [but("(other < 128 and body < 128) or other & 127 != body & 127")],
        "bodies 128 apart are taken for one",
        family="many bodies",
        witness=Differs(partial(numbered, 130, 1, 129), 3.0),
    ),
    Mutant(
        "a hash that collides at 64",
        "naive",
        [but("abs(other - body) != 64")],
        "two bodies in one slot, of which the first is lost",
        family="many bodies",
        witness=Differs(partial(numbered, 70, 1, 65), 3.0),
    ),
    Mutant(
        "at most 24 neighbours",
        "naive",
        [but("abs(other - body) <= 24")],
        "a list of neighbours that overflows",
        family="many bodies",
        witness=Differs(partial(numbered, 30, 1, 28), 3.0),
    ),
    Mutant(
        "at most 32 pairs a body",
        "sap-1d",
        [instead("    return pairs_of(k, body)\n", "    return min(pairs_of(k, body), 32)\n")],
        "a list of pairs that overflows, and drops the oldest",
        family="many bodies",
        witness=Audited(partial(stack, 36), 1.0, steps=1),
    ),
    Mutant(
        "at most six pairs a body",
        "sap-2d",
        [instead("    return pairs_of(k, body)\n", "    return min(pairs_of(k, body), 6)\n")],
        "six, as in a dense packing of equal discs: boxes overlap more",
        family="many bodies",
        witness=Audited(overlapping, 1.0, steps=1),
    ),
    Mutant(
        "bounds numbered in eight bits",
        "sap-1d",
        [instead("END, dtype=np.int32)", "END, dtype=np.int8)"), NO_AUDIT],
        "4 n + 1 is beyond 127 from the 33rd body on",
        family="many bodies",
        witness=Differs(partial(gas, 36), 1.0, 60),
    ),
    Mutant(
        "places in the order of seven bits",
        "sap-1d",
        [
            instead(
                RANKS, RANKS.replace("= place\n", "= place & 127\n").replace("place + 1", "(place + 1) & 127")
            ),
            NO_AUDIT,
        ],
        "the list of bounds is longer than 127 from the 65th body on",
        family="many bodies",
        witness=Differs(partial(gas, 72), 1.0, 200),
    ),
    Mutant(
        "a list ends after four",
        "cells",
        [
            instead(
                LIST,
                "    body = s.lists[cell]\n    most = count + 4\n    while body >= 0 and count < most:\n"
                "        k.near[count] = body\n",
                "layout",
            )
        ],
        "more than eleven bodies in a cell",
        family="many bodies",
        witness=Audited(partial(corner, 40), 8.0, steps=8, options={"side": 4.0}),
    ),
    Mutant(
        "the third cell has no list",
        "cells",
        [instead(THIRD, THIRD.replace("2", "1"), "layout")],
        "more than seven bodies in a cell, on the right",
        family="many bodies",
        witness=Audited(partial(corner, 40), 8.0, steps=8, options={"side": 4.0}),
    ),
    Mutant(
        "one who leaves a list leaves it unread",
        "cells",
        [
            instead(
                "    if s.lists[cell] < 0:\n        s.blocks[at + FULL] = FULL\n",
                "    s.blocks[at + FULL] = FULL\n",
                "layout",
            ),
            *CELLS,
        ],
        "nine bodies in a cell, of which one leaves",
        family="many bodies",
        witness=Audited(partial(corner, 40), 8.0, steps=8, options={"side": 4.0}),
    ),
    Mutant(
        "takes the last of a block for who leaves",
        "cells",
        [instead("    while place <= last and s", "    while place < last and s", "layout"), *CELLS],
        "eight bodies in a cell, of which the eighth leaves: it stays, and the seventh is gone",
        family="many bodies",
        witness=Audited(partial(corner, 40), 8.0, steps=8, options={"side": 4.0}),
    ),
    Mutant(
        "a web of 64 bodies",
        "sweep-tiling",
        [
            instead(
                "        offer(k, one, other)\n",
                "        if n <= 64:\n            offer(k, one, other)\n",
                "__init__",
            )
        ],
        "offers that are left out in large scenes",
        family="many bodies",
        witness=Audited(partial(gas, 100), 0.1, steps=2),
    ),
]
