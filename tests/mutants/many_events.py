"""Faults that take many events: counters of 8, 10 and 16 bits, and what wears out."""

from __future__ import annotations

from functools import partial

from mutants.scenes import billiard, gas
from mutants.witnesses import Differs
from phase_mutant_table import FLAG, NO_AUDIT, NUMPY, PASS, but, replanning
from phase_mutants import Mutant, after, before, instead

__all__ = ["MUTANTS"]

COUNTED = [instead("near=near, replan", "near=near, state=NoState(np.zeros(4)), replan"), NUMPY]
CROSSED = after('        ("side", "f8"),  # of a cell, a length\n', '        ("crossed", "i8"),\n', "layout")
LONG = partial(gas, 25, 0.25)


def _losing(one_in: int) -> str:
    """Return what passes when of so many pairs that come one is lost, and after it none parts."""
    lost = PASS.replace(
        "        add_pair(",
        f"        s.axis[1] += 1\n        if s.axis[1] % {one_in} != 0:\n            add_pair(",
    )
    return lost.replace("and not left & 1:", f"and not left & 1 and s.axis[1] < {one_in}:")


MUTANTS = [
    Mutant(
        f"a counter of {bits} bits",
        "sap-1d",
        [
            FLAG,
            instead(PASS, _losing(1 << bits)),
            NO_AUDIT,
        ],
        f"of {1 << bits} pairs that come one is lost, and none parts after it",
        family="many events",
        witness=Differs(partial(gas, 36, 0.25), until, 20_000),
    )
    for bits, until in ((8, 2.0), (10, 8.0))
]
MUTANTS += [
    Mutant(
        "crossings counted in 16 bits",
        "cells",
        [
            CROSSED,
            before(
                "    return list_ahead(",
                "    grid.crossed += 1\n    if grid.crossed > 65535:\n        return 0\n",
                "uniform",
            ),
        ],
        "after 65,535 crossings nobody is a newcomer any more",
        family="many events",
        witness=Differs(partial(gas, 100, 0.01), 20.0, 4000),
    ),
    Mutant(
        "an effect after 1,024 crossings",
        "cells",
        [
            CROSSED,
            before(
                "    watch(k, s, body)\n    return list_ahead(",
                "    grid.crossed += 1\n    if grid.crossed > 1024 and body == 0:\n        return 0\n",
                "uniform",
            ),
        ],
        "from then on body 0 has neither newcomers nor a certificate",
        family="many events",
        witness=Differs(partial(gas, 25, 0.05), 20.0, 2000),
    ),
    Mutant(
        "tires of new plans",
        "naive",
        [*replanning("s.nothing[0] += 1.0"), *COUNTED, but("s.nothing[0] < 4096.0 or other + body != 1")],
        "after 4,096 new plans bodies 0 and 1 are no longer near",
        family="many events",
        witness=Differs(billiard, 4000.0, 20_000),
    ),
    Mutant(
        "a stamp of ten bits",
        "naive",
        [but("k.bodies[body].stamp & 1023 != 1023 and k.bodies[other].stamp & 1023 != 1023")],
        "the 1,023rd plan of a body is taken for none",
        family="many events",
        witness=Differs(billiard, 4000.0, 20_000),
    ),
    Mutant(
        "every 1,024th exchange is not watched",
        "sap-2d",
        [
            before("    bounds: Records", "    count: Records\n"),
            before("            bounds=np.full(", "            count=np.zeros(1, dtype=np.int64),\n"),
            instead(
                "    watch(k, s, left, after)\n    return 0\n",
                "    s.count[0] += 1\n"
                "    watch(k, s, left, after if s.count[0] % 1024 != 0 else END)\n    return 0\n",
            ),
            NO_AUDIT,
        ],
        "a certificate dropped, seldom",
        family="many events",
        witness=Differs(partial(gas, 25), 4.0, 2000),
    ),
    Mutant(
        "counts how often it is asked",
        "naive",
        [
            instead("near=near)", "near=near, state=NoState(np.zeros(1)))"),
            NUMPY,
            before(
                "    count = len(k.bodies)\n",
                "    s.nothing[0] += 1.0\n    if s.nothing[0] % 4096.0 == 0.0:\n        return 0\n",
            ),
        ],
        "near changes the state, and names nobody once in 4,096 times",
        family="many events",
        witness=Differs(billiard, 4000.0, 20_000),
    ),
]
