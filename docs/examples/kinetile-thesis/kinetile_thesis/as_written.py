"""Sweep-tiling with the meeting as the thesis writes it, to show its fault. Not for use.

Bounds a and b meet, and the body of a is above. By section 4.3 the outer neighbour of b becomes the former
*upper* neighbour of a. It has to be the *lower* one: the line of b goes up to the body of a and ends there,
so the tile under that body lies beyond it. With the upper one, two right bounds, a and b, claim the tile over
the body of a, and the right bound has no link to the tile under it.

Everything but the meeting is imported from kinetile's own sweep-tiling.
"""

from __future__ import annotations

from dataclasses import replace

import kinetile as kt
from kinetile.errors import BadOption
from kinetile.toolbox import BroadPhaseParts, Kernel, hook
from kinetile_plugins.sweep_tiling import SweepTiling
from kinetile_plugins.sweep_tiling import repair as repair_right
from kinetile_plugins.sweep_tiling.certificates import first_to_fail, watch_tiles
from kinetile_plugins.sweep_tiling.events import is_above
from kinetile_plugins.sweep_tiling.web import (
    LOWER,
    OUTER,
    UPPER,
    State,
    Tile,
    Tiles,
    body_of,
    bound_of,
    facing,
    is_inner,
    link,
    opposite,
    port,
    set_end,
)

__all__ = ["TilingAsWritten"]


@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A meeting goes by the thesis's words; whatever else happens is repaired as it should be."""
    p, q = first_to_fail(s, body)
    if is_inner(p) or is_inner(q):
        return int(repair_right(k, s, body))
    a = bound_of(p)
    b = bound_of(q)
    side = LOWER if is_above(k, s, body_of(a), body_of(b)) else UPPER
    other = opposite(side)
    beyond_a = facing(s, port(a, other))  # it has to be: port(a, side)
    beyond_b = facing(s, port(b, other))
    link(s, port(b, OUTER), beyond_a, 0)
    link(s, port(a, OUTER), beyond_b, 0)
    link(s, port(b, other), port(a, side), 0)
    set_end(s, a, side, body_of(b))
    set_end(s, b, other, body_of(a))
    first = Tile(beyond_a, port(b, OUTER))
    watch_tiles(k, s, Tiles(first, Tile(port(a, OUTER), beyond_b), Tile(port(b, other), port(a, side))))
    k.near[0] = body_of(b)
    return 1


class TilingAsWritten:
    """Sweep-tiling, with a choice of the rule for meetings.

    Args:
        rule: "thesis" for the meeting as the thesis writes it, "right" for kinetile's.
    """

    def __init__(self, *, rule: str = "thesis") -> None:
        if rule not in ("thesis", "right"):
            raise BadOption(f"tiling-as-written: rule must be 'thesis' or 'right', not {rule!r}")
        self.rule = rule

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        """Returns the parts of sweep-tiling, with another repair for the rule of the thesis."""
        parts = SweepTiling().prepare(scene)
        return parts if self.rule == "right" else replace(parts, repair=repair)
