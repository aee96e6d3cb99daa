"""What a broad phase may do: variations that must never be condemned, whatever the kit looks at."""

from __future__ import annotations

from phase_mutant_table import FLAG, NAMES, NO_AUDIT, NUMPY
from phase_mutants import CONFORMS, Change, Mutant, before, instead

__all__ = ["HARMLESS"]

NO_CELLS_AUDIT = instead("            audit=audit,\n", "", "__init__")
ORDER = "np.lexsort((body, 1 - upper, speed[body], edge))"
AHEAD = "    return list_ahead(k, s, 0, home.cell, right, up, 0)"


def _harmless(name: str, base: str, why: str, *changes: Change) -> Mutant:
    return Mutant(name, base, changes, why, CONFORMS, family="harmless")


HARMLESS = [
    _harmless(
        "names everybody backwards",
        "naive",
        "the order of names does not matter",
        instead("        k.near[other] = other\n", "        k.near[count - 1 - other] = other\n"),
    ),
    _harmless(
        "names itself twice",
        "naive",
        "a body may be named for itself, and twice, within the room there is",
        instead(
            NAMES, NAMES.replace("    return count\n", "    k.near[count] = body\n    return count + 1\n")
        ),
        instead("near=near)", "near=near, room=len(scene) + 1)"),
    ),
    _harmless(
        "writes eight more that do not count",
        "naive",
        "up to eight numbers beyond those that count, whatever they are",
        instead(
            NAMES,
            NAMES.replace(
                "    return count\n",
                "    for i in range(8):\n        k.near[count + i] = -7 - i\n    return count\n",
            ),
        ),
    ),
    _harmless(
        "names all around as newcomers",
        "cells",
        "over-reporting",
        instead(AHEAD, "    return near(k, s, body)", "uniform"),
    ),
    _harmless(
        "goes over early",
        "cells",
        "a certificate that fails before it must: a quarter of the room is not used",
        instead(
            "levels.slack = 0.5 * (levels.side - least)",
            "levels.slack = 0.25 * (levels.side - least)",
            "layout",
        ),
    ),
    _harmless(
        "wider cells",
        "cells",
        "another side",
        instead("SPACING = 1.25, 1.65", "SPACING = 2.5, 3.0", "layout"),
    ),
    _harmless(
        "a column and a row less",
        "cells",
        "opposite edges of an arena adjoin: far pairs are named",
        instead("math.floor(length / side) + 2, 3)", "math.floor(length / side) + 1, 3)", "layout"),
    ),
    _harmless(
        "a table of nine places",
        "cells",
        "everybody shares a place with many that are far away",
        instead("MOST = 8\n", "MOST = 0\n", "layout"),
        instead("math.isqrt(3 * len(scene) // 2) | 3", "3", "layout"),
    ),
    _harmless(
        "an array that nobody uses",
        "sap-1d",
        "a state array too many",
        before("    axis: Records", "    idle: Records\n"),
        before("            axis=np.array(", "            idle=np.full(17, np.nan),\n"),
    ),
    _harmless(
        "sorts backwards what it then turns round",
        "sap-1d",
        "another way to the same order",
        instead(ORDER, "np.lexsort((-body, upper - 1, -speed[body], -edge))[::-1]"),
        NO_AUDIT,
    ),
    _harmless(
        "an idle event now and then",
        "sap-1d",
        "a certificate that fails for nothing, once after each new plan of body 0",
        FLAG,
        NO_AUDIT,
        before(
            "\n\n@unchecked\n@hook\ndef near",
            "    if body == 0:\n        s.axis[1] = 1\n        schedule(k, 0, k.clock[0].now)\n",
        ),
        before(
            "    left = 4 * body if",
            "    if body == 0 and s.axis[1] > 0:\n        s.axis[1] = 0\n"
            "        schedule(k, body, min(s.bounds[0], s.bounds[1]))\n        return 0\n",
        ),
    ),
    _harmless(
        "counts its exchanges, and does nothing with it",
        "sap-2d",
        "a state that grows old without effect",
        before("    bounds: Records", "    count: Records\n"),
        before("            bounds=np.full(", "            count=np.zeros(1, dtype=np.int64),\n"),
        before("    place = s.bounds[left + PLACE]\n    before", "    s.count[0] += 1\n"),
    ),
    _harmless(
        "offers a pair twice",
        "sweep-tiling",
        "a newcomer of whom two things are said",
        instead(
            "        offer(k, one, other)\n",
            "        offer(k, one, other)\n        offer(k, other, one)\n",
            "__init__",
        ),
    ),
    _harmless(
        "slower",
        "naive",
        "it takes its time, and gives the same",
        NUMPY,
        before(
            "    count = len(k.bodies)\n",
            "    total = 0.0\n    for i in range(200):\n        total += np.sqrt(i)\n",
        ),
    ),
]
