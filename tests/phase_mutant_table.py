"""The first mutants, phase by phase; those made to fool the kit stand in ``mutants``."""

from __future__ import annotations

from phase_mutants import CONFORMS, EQUIVALENT, Change, Mutant, after, before, instead

# naive

PREPARE = "        return BroadPhaseParts(draw=draw, periodic=True, near=near)"
COUNT = "    count = len(k.bodies)\n"
NAMES = "    for other in range(count):\n        k.near[other] = other\n    return count\n"
NUMPY = before("from kinetile.errors", "import numpy as np\n\n")


def but(condition: str) -> Change:
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


def replanning(*lines: str) -> list[Change]:
    """Return the changes by which naive has a hook that is told of new plans."""
    body = "".join(f"    {line}\n" for line in lines)
    return [
        before(
            "\n\nclass Naive", f"\n\n@hook\ndef replan(k: Kernel, s: NoState, body: int) -> None:\n{body}"
        ),
        instead("near=near)", "near=near, replan=replan)"),
    ]


NAIVE_MUTANTS = [
    Mutant(
        "only one pair a body",
        "naive",
        [but("abs(other - body) == 1")],
        "bodies that are never named",
    ),
    Mutant(
        "forgets the last body",
        "naive",
        [but("max(other, body) < count - 1")],
        "off by one in a loop",
    ),
    Mutant(
        "names the later ones only",
        "naive",
        [but("other > body")],
        "who is near whom is not mutual",
    ),
    Mutant(
        "loses a pair that has collided",
        "naive",
        [but("k.bodies[body].last != other and k.bodies[other].last != body")],
        "a pair that is over too early",
    ),
    Mutant(
        "tires of a late clock",
        "naive",
        [
            but("s.nothing[0] < 1e9"),
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
        replanning("k.bodies[body].vx *= 0.5"),
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

RIGHT_EDGE = "q_away = offset(k, q, 2 * s.axis[0] + (right & 1))"
LEFT_EDGE = "p_away = offset(k, p, 2 * s.axis[0] + (left & 1))"
EDGES = "offsets(k)[body, 2 * axis + upper]"
GAP = "        due = falls(k, since, gap, rate)\n"
NOTE = "    s.bounds[left] = due\n"
FIRST_WATCH = "        watch(k, s, bound, s.order[place + 1])\n        if bound"
EXCHANGE = "    s.order[place] = right\n    s.order[place + 1] = left\n"
RANKS = "    s.bounds[right + PLACE] = place\n    s.bounds[left + PLACE] = place + 1\n"
TAKE = "    before = s.order[place - 1]\n"
PASS = """    if left & 1 and not right & 1:
        add_pair(k, body, right >> 2)
    elif right & 1 and not left & 1:
        remove_pair(k, body, right >> 2)
"""
LEFT_GAP = "    if before != END:\n        watch(k, s, before, right)\n"
GAPS = LEFT_GAP + "    watch(k, s, right, left)\n    watch(k, s, left, after)\n"
BOTH = "range(4 * body, 4 * body + 2)"
STATE = """State(
            order=np.full(2 * n + 2, END, dtype=np.int32),
            bounds=np.full(4 * n, NEVER),
            axis=np.array([0 if self.axis == "x" else 1]),
        )
"""
LEAVE = "        s.bounds[left] = NEVER\n        schedule(k, body, s.bounds[left ^ 1])\n        return 0\n"
NO_AUDIT = instead("            audit=audit,\n", "")
"""For what changes no answer: the phase's own audit knows its structure, and would see it."""
FLAG = instead('"x" else 1])', '"x" else 1, 0])')


def _instead_of_reach(factor: str = "") -> list[Change]:
    """Return the changes by which sap-1d takes the radius, or part of it, for the reach."""
    radius = f"k.bodies.radius[body]{factor}"
    return [
        instead(LEFT_EDGE, f"p_away = (p.radius if left & 1 else -p.radius){factor}"),
        instead(RIGHT_EDGE, f"q_away = (q.radius if right & 1 else -q.radius){factor}"),
        instead(EDGES, f"np.where(upper == 1, {radius}, -{radius})"),
    ]


SAP_1D_MUTANTS = [
    Mutant(
        "does not watch the middle at the start",
        "sap-1d",
        [instead(FIRST_WATCH, f"        if 2 * place + 2 != len(s.order):\n    {FIRST_WATCH}")],
        "a certificate dropped",
    ),
    Mutant(
        "does not watch what is left of an exchange",
        "sap-1d",
        [instead(LEFT_GAP, "")],
        "a certificate dropped",
    ),
    Mutant(
        "takes the other end of the right body",
        "sap-1d",
        [instead(RIGHT_EDGE, RIGHT_EDGE.replace("(right & 1)", "(1 - (right & 1))"))],
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
    Mutant(
        "ignores new plans",
        "sap-1d",
        [instead(BOTH, "range(4 * body, 4 * body)")],
        "a missed re-plan",
    ),
    Mutant(
        "misses one gap of a new plan",
        "sap-1d",
        [
            instead(
                "        if s.order[place - 1] != END:",
                "        if bound & 1 == 0 and s.order[place - 1] != END:",
            )
        ],
        "a missed re-plan, for one gap of four",
    ),
    Mutant(
        "ignores turns",
        "sap-1d",
        [instead(BOTH, "range(4 * body, 4 * body + (2 if k.bodies[body].last >= 0 else 0))")],
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
        [before(NOTE, "    if due <= k.clock[0].now:\n        due = NEVER\n")],
        "an event in the past taken for an error",
    ),
    Mutant(
        "stops after time 6",
        "sap-1d",
        [before(NOTE, "    if due * k.clock[0].tick >= 6.0:\n        due = NEVER\n")],
        "certificates dropped after a while",
    ),
    Mutant(
        "two bounds pass once only",
        "sap-1d",
        [
            before("    axis: Records", "    passed: Records\n"),
            instead(STATE, STATE.replace("order=", "passed=np.zeros((4 * n, 4 * n)),\n            order=")),
            before(NOTE, "    if right != END and s.passed[left, right] > 0.0:\n        due = NEVER\n"),
            before(EXCHANGE, "    s.passed[right, left] = 1.0\n"),
        ],
        "a history that is kept too long",
    ),
    Mutant(
        "an exchange that is none",
        "sap-1d",
        [
            instead(EXCHANGE + RANKS, ""),
            instead(PASS, ""),
            instead(GAPS, "    watch(k, s, left, right)\n"),
        ],
        "a certificate that fails again and again at one moment",
    ),
    Mutant(
        "an endless loop",
        "sap-1d",
        [before(TAKE, "    while s.order[place] >= 0:\n        s.axis[0] ^= 1\n")],
        "a loop that never ends, in a compiled hook",
    ),
    Mutant(
        "anchors a body anew when its bound passes",
        "sap-1d",
        [
            before(
                EXCHANGE,
                "    mover = k.bodies[body]\n"
                "    elapsed = (k.clock[0].now - mover.anchor) * k.clock[0].tick\n"
                "    mover.x += mover.vx * elapsed\n"
                "    mover.y += mover.vy * elapsed\n"
                "    mover.anchor = k.clock[0].now\n",
            )
        ],
        "a hook that writes into the bodies, and moves them by no more than rounding",
    ),
    Mutant(
        "compares places before an exchange",
        "sap-1d",
        [
            before(
                EXCHANGE,
                "    one, two = k.bodies[left >> 2], k.bodies[right >> 2]\n"
                "    now, tick = k.clock[0].now, k.clock[0].tick\n"
                "    x = one.x + one.vx * ((now - one.anchor) * tick)\n"
                "    x += one.reach if left & 1 else -one.reach\n"
                "    z = two.x + two.vx * ((now - two.anchor) * tick)\n"
                "    z += two.reach if right & 1 else -two.reach\n"
                f"    if x < z:\n{LEAVE}",
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
            FLAG,
            NO_AUDIT,
            before("from typing import NamedTuple\n", "import itertools\n"),
            before("\n\ndef arrange", "\n\nCOUNT = itertools.count()\n"),
            after("+ PLACE] = 1 + np.arange(len(order))\n", "    s.axis[1] = next(COUNT) % 2\n"),
            after(
                "                inside += 1\n",
                "    if s.axis[1] > 0 and k.clock[0].bodies > 0:\n        schedule(k, 0, k.clock[0].now)\n",
            ),
            before(
                "    left = 4 * body if",
                "    if s.axis[1] > 0:\n"
                "        s.axis[1] = 0\n"
                "        schedule(k, body, min(s.bounds[4 * body], s.bounds[4 * body + 1]))\n"
                "        return 0\n",
            ),
        ],
        "state outside of the state: an idle event in every other instance",
    ),
    Mutant("says that its pairs are boxes", "sap-1d", [], "a lie about a feature", features=["boxes"]),
    Mutant(
        "never removes a pair",
        "sap-1d",
        [
            instead("        remove_pair(k, body, right >> 2)\n", "        pass\n"),
            NO_AUDIT,
        ],
        "a pair is held once more whenever the two come near, and outlives a body that goes",
    ),
    Mutant(
        "leaves what begins at one place as it was entered",
        "sap-1d",
        [
            instead("np.lexsort((body, 1 - upper, speed[body], edge))", "np.lexsort((upper, body, edge))"),
            instead(GAP, f"{GAP.rstrip()} if gap != 0.0 else NEVER\n"),
        ],
        "ties broken by insertion",
    ),
    Mutant(
        "ties by number alone",
        "sap-1d",
        [instead("np.lexsort((body, 1 - upper, speed[body], edge))", "np.lexsort((upper, body, edge))")],
        "ties broken by insertion, but bounds of one place in the wrong order fail at once",
        EQUIVALENT,
    ),
    Mutant(
        "does not watch the last two at the start",
        "sap-1d",
        [instead(FIRST_WATCH, f"        if place + 3 != len(s.order):\n    {FIRST_WATCH}"), NO_AUDIT],
        "the last bound is some R, and what passes it is another R, which makes no pair",
        EQUIVALENT,
    ),
]

# sap-2d

SAP_2D_MUTANTS = [
    Mutant(
        "looks at the axis of the exchange",
        "sap-2d",
        [instead("(left ^ 2) & -2, (right ^ 2) & -2", "left & -2, right & -2"), NO_AUDIT],
        "a lie about a feature: it finds more pairs than those",
        features=["boxes"],
    ),
    Mutant(
        "new plans count in x only",
        "sap-2d",
        [instead("8 * body + 4):\n        place", "8 * body + 2):\n        place")],
        "a missed re-plan, on one axis",
    ),
    Mutant(
        "starts without its pairs",
        "sap-2d",
        [instead("other & 1 == 0 and overlap", "other & 1 == 2 and overlap")],
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
        [instead("    if some(corner):", "    if False:", "certificates")],
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
                "    link(s, port(a, p), beyond_b, to_b + across)\n    set_end(s, b, o, end(s, a, o))\n",
                "    link(s, port(a, p), beyond_b, to_b + across)\n",
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
