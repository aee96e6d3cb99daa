"""The mutants, phase by phase, and the table of what the kit makes of them.

As a program it prints the table, or the rows of those mutants whose labels have one of its arguments in them.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from kinetile.conformance import Result
from phase_mutants import CONFORMS, EQUIVALENT, Change, Mutant, after, before, instead, judge

# naive

PREPARE = "        return BroadPhaseParts(near=near)"
COUNT = "    count = len(k.bodies)\n"
NAMES = "    for other in range(count):\n        k.near[other] = other\n    return count\n"
NUMPY = before("from kinetile.errors", "import numpy as np\n\n")


def _but(condition: str) -> Change:
    """Return the change by which only those are named for which a condition holds."""
    return instead(
        NAMES,
        "    named = 0\n"
        "    for other in range(count):\n"
        f"        if {condition}:\n"
        "            k.near[named] = other\n"
        "            named += 1\n"
        "    return named\n",
    )


def _replanning(*lines: str) -> list[Change]:
    """Return the changes by which naive has a hook that is told of new plans."""
    body = "".join(f"    {line}\n" for line in lines)
    return [
        before(
            "\n\nclass Naive", f"\n\n@hook\ndef replan(k: Kernel, s: NoState, body: int) -> None:\n{body}"
        ),
        instead("BroadPhaseParts(near=near)", "BroadPhaseParts(near=near, replan=replan)"),
    ]


NAIVE_MUTANTS = [
    Mutant(
        "only one pair a body",
        "naive",
        [_but("abs(other - body) == 1")],
        "bodies that are never named",
    ),
    Mutant(
        "forgets the last body",
        "naive",
        [_but("max(other, body) < count - 1")],
        "off by one in a loop",
    ),
    Mutant(
        "names the later ones only",
        "naive",
        [_but("other > body")],
        "who is near whom is not mutual",
    ),
    Mutant(
        "loses a pair that has collided",
        "naive",
        [_but("k.bodies[body].last != other and k.bodies[other].last != body")],
        "a pair that is over too early",
    ),
    Mutant(
        "tires of a late clock",
        "naive",
        [
            _but("s.nothing[0] < 1e9"),
            instead("near=near)", "near=near, state=NoState(np.full(1, scene.start)))"),
            NUMPY,
        ],
        "a phase that sees when the clock starts",
    ),
    Mutant(
        "writes into the scene",
        "naive",
        [
            before(
                PREPARE,
                "        scene.velocity.flags.writeable = True\n        scene.velocity[:] *= 0.5\n",
            )
        ],
        "a scene that is changed, not copied",
    ),
    Mutant(
        "brakes a body that has a new plan",
        "naive",
        _replanning("k.bodies[body].vx *= 0.5"),
        "a hook that writes into the bodies",
    ),
    Mutant(
        "takes any option",
        "naive",
        [before("    def prepare", "    def __init__(self, **options: object) -> None:\n        pass\n\n")],
        "options are read off the constructor's parameters, and kinetile refuses before it is asked",
        EQUIVALENT,
    ),
    Mutant(
        "cannot do without bodies",
        "naive",
        [before(PREPARE, "        assert scene.radius[0] > 0.0\n")],
        "the empty scene forgotten",
    ),
    Mutant(
        "crashes with three bodies",
        "naive",
        [
            before("from kinetile.errors", "import ctypes\n\n"),
            before(PREPARE, "        if len(scene) > 2:\n            ctypes.string_at(0)\n"),
        ],
        "a crash",
    ),
    Mutant(
        "counts one too many",
        "naive",
        [instead("    return count\n", "    return count + 1\n")],
        "a count that is not that of what is named",
    ),
    Mutant(
        "names each body twice",
        "naive",
        [
            instead(
                NAMES,
                NAMES.replace("k.near[other]", "k.near[2 * other] = k.near[2 * other + 1]").replace(
                    "return count", "return 2 * count"
                ),
            ),
            instead("near=near)", "near=near, room=2 * len(scene))"),
        ],
        "it costs time",
        CONFORMS,
    ),
]

# sap-1d

RIGHT_EDGE = "q_reach = q.reach if right & 1 else -q.reach"
LEFT_EDGE = "p_reach = p.reach if left & 1 else -p.reach"
EDGES = "k.bodies.reach[body], -k.bodies.reach[body]"
WATCH = "    schedule(k, certificate, falls(k, since, gap, rate))\n"
FIRST_WATCH = "range(len(s.order) - 1):\n        watch(k, s, certificate)"
EXCHANGE = "    s.order[certificate] = right\n"
TAKE = "    left = s.order[certificate]\n    right = s.order[certificate + 1]\n    s.order"
PASS = """    if left & 1 and not right & 1:
        add_pair(k, left >> 1, right >> 1)
    elif right & 1 and not left & 1:
        remove_pair(k, left >> 1, right >> 1)
"""
SIDES = "    for side in range(4):\n"
STATE = """State(
            order=np.zeros(2 * n, dtype=np.int32),
            rank=np.zeros(2 * n, dtype=np.int32),
            axis=np.array([0 if self.axis == "x" else 1]),
        )
"""
NEVER = before("    BroadPhaseParts,\n", "    NEVER,\n")
NO_AUDIT = instead("            audit=audit,\n", "")
"""For what changes no answer: the phase's own audit knows its structure, and would see it."""
FLAG = instead('"x" else 1])', '"x" else 1, 0])')


def _instead_of_reach(factor: str = "") -> list[Change]:
    """Return the changes by which sap-1d takes the radius, or part of it, for the reach."""
    radius = f"k.bodies.radius[body]{factor}"
    return [
        instead(LEFT_EDGE, LEFT_EDGE.replace("p.reach", f"p.radius{factor}")),
        instead(RIGHT_EDGE, RIGHT_EDGE.replace("q.reach", f"q.radius{factor}")),
        instead(EDGES, f"{radius}, -{radius}"),
    ]


SAP_1D_MUTANTS = [
    Mutant(
        "does not watch the middle at the start",
        "sap-1d",
        [
            instead(
                FIRST_WATCH,
                FIRST_WATCH.replace("watch", "if 2 * certificate + 2 != len(s.order):\n            watch"),
            )
        ],
        "a certificate dropped",
    ),
    Mutant(
        "watches one neighbour after an exchange",
        "sap-1d",
        [instead("min(certificate + 2, len(s.order) - 1)", "min(certificate + 1, len(s.order) - 1)")],
        "a certificate dropped",
    ),
    Mutant(
        "takes the other end of the right body",
        "sap-1d",
        [instead(RIGHT_EDGE, "q_reach = -q.reach if right & 1 else q.reach")],
        "swapped ends",
    ),
    Mutant(
        "adds where it should remove",
        "sap-1d",
        [
            instead(
                PASS, PASS.replace("left & 1", "x").replace("right & 1", "left & 1").replace("x", "right & 1")
            )
        ],
        "swapped ends",
    ),
    Mutant("ignores new plans", "sap-1d", [instead(SIDES, SIDES.replace("4", "0"))], "a missed re-plan"),
    Mutant(
        "misses one gap of a new plan",
        "sap-1d",
        [instead(SIDES, SIDES.replace("4", "3"))],
        "a missed re-plan, for one certificate of four",
    ),
    Mutant(
        "ignores turns",
        "sap-1d",
        [instead(SIDES, SIDES.replace("4", "4 if k.bodies[body].last >= 0 else 0"))],
        "a missed re-plan: only a contact of two bodies is one to it",
    ),
    Mutant(
        "one state for all instances",
        "sap-1d",
        [
            before("\n\ndef arrange", "\n\nSHARED: dict[int, State] = {}\n"),
            instead(STATE, f"SHARED.setdefault(n, {STATE.strip()})\n"),
        ],
        "state shared between instances",
    ),
    Mutant(
        "the true radius", "sap-1d", _instead_of_reach(), "a wrong radius, by the skin: only ties can show it"
    ),
    Mutant(
        "a billionth less than the radius",
        "sap-1d",
        _instead_of_reach(" * (1.0 - 2.0**-30)"),
        "a wrong radius",
    ),
    Mutant(
        "nine tenths of the radius",
        "sap-1d",
        _instead_of_reach(" * 0.9"),
        "a wrong radius",
    ),
    Mutant(
        "drops failures in the past",
        "sap-1d",
        [
            NEVER,
            instead(
                WATCH,
                "    tick = falls(k, since, gap, rate)\n"
                "    schedule(k, certificate, tick if tick > k.clock[0].now else NEVER)\n",
            ),
        ],
        "an event in the past taken for an error",
    ),
    Mutant(
        "stops after time 6",
        "sap-1d",
        [
            NEVER,
            instead(
                WATCH,
                "    due = falls(k, since, gap, rate)\n"
                "    schedule(k, certificate, due if due * k.clock[0].tick < 6.0 else NEVER)\n",
            ),
        ],
        "certificates dropped after a while",
    ),
    Mutant(
        "two bounds pass once only",
        "sap-1d",
        [
            NEVER,
            before("    axis: Records", "    passed: Records\n"),
            instead(STATE, STATE.replace("order=", "passed=np.zeros((2 * n, 2 * n)),\n            order=")),
            before(
                WATCH,
                "    if s.passed[left, right] > 0.0:\n"
                "        schedule(k, certificate, NEVER)\n"
                "        return\n",
            ),
            before(EXCHANGE, "    s.passed[right, left] = 1.0\n"),
        ],
        "a history that is kept too long",
    ),
    Mutant(
        "an exchange that is none",
        "sap-1d",
        [
            instead(f"{EXCHANGE}    s.order[certificate + 1] = left\n", ""),
            instead("    s.rank[right] = certificate\n    s.rank[left] = certificate + 1\n", ""),
            instead(PASS, ""),
        ],
        "a certificate that fails again and again at one moment",
    ),
    Mutant(
        "an endless loop",
        "sap-1d",
        [before(TAKE, "    while s.order[certificate] >= 0:\n        s.rank[0] ^= 1\n")],
        "a loop that never ends, in a compiled hook",
        seconds=45.0,
    ),
    Mutant(
        "anchors a body anew when its bound passes",
        "sap-1d",
        [
            before(
                EXCHANGE,
                "    body = k.bodies[left >> 1]\n"
                "    elapsed = (k.clock[0].now - body.anchor) * k.clock[0].tick\n"
                "    body.x += body.vx * elapsed\n"
                "    body.y += body.vy * elapsed\n"
                "    body.anchor = k.clock[0].now\n",
            )
        ],
        "a hook that writes into the bodies, and moves them by no more than rounding",
    ),
    Mutant(
        "compares places before an exchange",
        "sap-1d",
        [
            NEVER,
            before(
                EXCHANGE,
                "    one, two = k.bodies[left >> 1], k.bodies[right >> 1]\n"
                "    now, tick = k.clock[0].now, k.clock[0].tick\n"
                "    x = one.x + one.vx * ((now - one.anchor) * tick)\n"
                "    x += one.reach if left & 1 else -one.reach\n"
                "    z = two.x + two.vx * ((now - two.anchor) * tick)\n"
                "    z += two.reach if right & 1 else -two.reach\n"
                "    if x < z:\n"
                "        schedule(k, certificate, NEVER)\n"
                "        return\n",
            ),
        ],
        "recomputed places trusted rather than certificates",
    ),
    Mutant(
        "makes its pairs at the first building only",
        "sap-1d",
        [
            FLAG,
            instead(
                "        if bound & 1 == 0:\n            in",
                "        if bound & 1 == 0 and s.axis[1] == 0:\n            in",
            ),
            after("                inside += 1\n", "    s.axis[1] = 1\n"),
        ],
        "built once, and not anew",
    ),
    Mutant(
        "no two runs alike",
        "sap-1d",
        [
            NEVER,
            FLAG,
            before("from typing import NamedTuple\n", "import itertools\n"),
            before("\n\ndef arrange", "\n\nCOUNT = itertools.count()\n"),
            after("    s.rank[s.order] = bound\n", "    s.axis[1] = next(COUNT) % 2\n"),
            after("certificates=max(2 * n - 1, 0)", " + 1"),
            before(
                f"    for certificate in {FIRST_WATCH}",
                "    if s.axis[1] > 0:\n        schedule(k, max(len(s.order) - 1, 0), k.clock[0].now)\n",
            ),
            before(
                TAKE,
                "    if certificate == max(len(s.order) - 1, 0):\n"
                "        schedule(k, certificate, NEVER)\n"
                "        return\n",
            ),
        ],
        "state outside of the state: an idle certificate in every other instance",
    ),
    Mutant("says that its pairs are boxes", "sap-1d", [], "a lie about a feature", features=["boxes"]),
    Mutant(
        "never removes a pair",
        "sap-1d",
        [
            instead("        remove_pair(k, left >> 1, right >> 1)\n", "        pass\n"),
            NO_AUDIT,
        ],
        "over-reporting is allowed",
        CONFORMS,
    ),
    Mutant(
        "leaves what begins at one place as it was entered",
        "sap-1d",
        [
            NEVER,
            instead("np.lexsort((body, 1 - upper, speed[body], edge))", "np.lexsort((bound, edge))"),
            instead(
                WATCH, "    schedule(k, certificate, falls(k, since, gap, rate) if gap != 0.0 else NEVER)\n"
            ),
        ],
        "ties broken by insertion",
    ),
    Mutant(
        "ties by number alone",
        "sap-1d",
        [instead("np.lexsort((body, 1 - upper, speed[body], edge))", "np.lexsort((bound, edge))")],
        "ties broken by insertion, but bounds of one place in the wrong order fail at once",
        EQUIVALENT,
    ),
    Mutant(
        "does not watch the last two at the start",
        "sap-1d",
        [instead(FIRST_WATCH, FIRST_WATCH.replace("- 1", "- 2")), NO_AUDIT],
        "the last bound is some R, and what passes it is another R, which makes no pair",
        EQUIVALENT,
    ),
]

# sap-2d

SAP_2D_MUTANTS = [
    Mutant(
        "looks at the axis of the exchange",
        "sap-2d",
        [instead("overlap(s, 1 - axis, left", "overlap(s, axis, left"), NO_AUDIT],
        "a lie about a feature: it finds more pairs than those",
        features=["boxes"],
    ),
    Mutant(
        "new plans count in x only",
        "sap-2d",
        [instead("in range(8):", "in range(4):")],
        "a missed re-plan, on one axis",
    ),
    Mutant(
        "starts without its pairs",
        "sap-2d",
        [instead("& 1 == 0 and overlap(s, 1,", "& 1 == 2 and overlap(s, 1,")],
        "pairs missing at the start",
    ),
    Mutant(
        "sorts ties the wrong way round",
        "sap-2d",
        [instead("(body, 1 - upper, speed[body],", "(body, upper, -speed[body],")],
        "ties broken the wrong way, but bounds of one place in the wrong order fail at once",
        EQUIVALENT,
    ),
]

# sweep-tiling; tests/tiling_mutant_table.py has one for each of its rules

SWEEP_TILING_MUTANTS = [
    Mutant(
        "links are noted on one side",
        "sweep-tiling",
        [instead("    s.web[q] = p\n", "", "web")],
        "one half of a link forgotten",
    ),
    Mutant(
        "no corner rule",
        "sweep-tiling",
        [instead("                    if level < tick:", "                    if False:", "__init__")],
        "a case forgotten, as in the thesis: two bodies that graze at a corner",
    ),
    Mutant(
        "the wrong one above",
        "sweep-tiling",
        [instead("bool(rise > 0.0)", "bool(rise < 0.0)", "events")],
        "swapped ends",
    ),
    Mutant(
        "a passing leaves an end behind",
        "sweep-tiling",
        [
            instead(
                "    link(s, port(a, p), beyond_b)\n    set_end(s, b, o, end(s, a, o))\n",
                "    link(s, port(a, p), beyond_b)\n",
                "events",
            )
        ],
        "one half of a link forgotten",
    ),
    Mutant(
        "arranged once only",
        "sweep-tiling",
        [
            instead(
                "    bodies = k.bodies\n    n = len(bodies)\n",
                "    bodies = k.bodies\n    n = len(bodies)\n    if s.limits[1] > 0.0:\n        return\n",
                "construction",
            )
        ],
        "built once, and not anew",
    ),
    Mutant(
        "does not say where it keeps ticks",
        "sweep-tiling",
        [instead("            ticks=(state.due,),\n", "", "__init__")],
        "ticks kept in the state: when the clock's base moves on, they stay behind",
    ),
    Mutant(
        "ties at a meeting by number",
        "sweep-tiling",
        [
            instead(
                "    if one.vy != two.vy:\n        return bool(one.vy > two.vy)\n",
                "",
                "events",
            )
        ],
        "ties broken by insertion, but a wrong order at a meeting is a corner that flips at the same moment",
        EQUIVALENT,
    ),
]

MUTANTS = (*NAIVE_MUTANTS, *SAP_1D_MUTANTS, *SAP_2D_MUTANTS, *SWEEP_TILING_MUTANTS)


HEAD = """| phase | mutant | what it stands for | killed by | bodies |
|---|---|---|---|---|"""


def row(mutant: Mutant, found: Result | None) -> str:
    """Return a mutant's row of the table in docs/conformance.md."""
    if found is None:
        by, bodies = f"nothing: {mutant.fate}", ""
    else:
        by, bodies = f"`{found.check}`", "" if found.bodies is None else str(found.bodies)
    return f"| `{mutant.base}` | {mutant.name} | {mutant.why} | {by} | {bodies} |"


def main() -> None:
    """Judge the mutants whose labels have one of the words given in them, or all, and print the table."""
    print(HEAD)
    with tempfile.TemporaryDirectory() as folder:
        for mutant in MUTANTS:
            if any(word in mutant.label for word in sys.argv[1:] or [""]):
                print(row(mutant, judge(mutant, Path(folder))), flush=True)


if __name__ == "__main__":
    main()
