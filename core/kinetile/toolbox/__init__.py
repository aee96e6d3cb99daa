"""The toolbox of plugin authors: everything a hook may call, in one place.

Built-in phases use this package and nothing else of the kernel (an import contract holds that): what most
phases need is here, exact ticks of contacts are in ``toolbox.ticks``, vectors of eight in ``toolbox.lanes``.

A hook receives the kernel's tables as ``k`` (see ``kinetile.kernel.tables``) and, in a broad phase, its
own state as ``s``.
"""

from __future__ import annotations

from kinetile.kernel.certificates.structural import (
    falls,
    falls_eight,
    falls_many,
    first_rise,
    schedule,
    ticks_after,
)
from kinetile.kernel.certificates.wall import inside_arena, inside_bent
from kinetile.kernel.compiled import hook, larger, smaller, unchecked
from kinetile.kernel.flight import (
    closing_speed,
    position_after,
    position_at,
    positions_now,
    shared,
    since_anchor,
    since_origin,
    velocity_at,
)
from kinetile.kernel.log import BOTTOM, LEFT, RIGHT, TOP
from kinetile.kernel.loop.idle import NoState
from kinetile.kernel.pairs import add_pair, held_pairs, offer, pairs_of, remove_pair
from kinetile.kernel.plan import Plan, positions_after
from kinetile.kernel.rest import presses, rest
from kinetile.kernel.skin import box_gaps, reach_to, reaches_of
from kinetile.kernel.tables import (
    MY_FAULT,
    NEVER,
    NOBODY,
    TOO_DEEP,
    Kernel,
    Records,
    blame,
    is_there,
    record_table,
)
from kinetile.kernel.vectors import prefetch
from kinetile.plugin.drawing import (
    At,
    Box,
    Coordinate,
    Entry,
    Item,
    Link,
    Point,
    Polygon,
    Segment,
    pair_links,
)
from kinetile.plugin.protocols import (
    BroadPhase,
    BroadPhaseParts,
    ContactResponse,
    NarrowPhase,
    PairParts,
    ResponseParts,
    WallParts,
)
from kinetile.toolbox.reach import reach_of

__all__ = [
    "BOTTOM",
    "LEFT",
    "MY_FAULT",
    "NEVER",
    "NOBODY",
    "RIGHT",
    "TOO_DEEP",
    "TOP",
    "At",
    "Box",
    "BroadPhase",
    "BroadPhaseParts",
    "ContactResponse",
    "Coordinate",
    "Entry",
    "Item",
    "Kernel",
    "Link",
    "NarrowPhase",
    "NoState",
    "PairParts",
    "Plan",
    "Point",
    "Polygon",
    "Records",
    "ResponseParts",
    "Segment",
    "WallParts",
    "add_pair",
    "blame",
    "box_gaps",
    "closing_speed",
    "falls",
    "falls_eight",
    "falls_many",
    "first_rise",
    "held_pairs",
    "hook",
    "inside_arena",
    "inside_bent",
    "is_there",
    "larger",
    "offer",
    "pair_links",
    "pairs_of",
    "position_after",
    "position_at",
    "positions_after",
    "positions_now",
    "prefetch",
    "presses",
    "reach_of",
    "reach_to",
    "reaches_of",
    "record_table",
    "remove_pair",
    "rest",
    "schedule",
    "shared",
    "since_anchor",
    "since_origin",
    "smaller",
    "ticks_after",
    "unchecked",
    "velocity_at",
]
