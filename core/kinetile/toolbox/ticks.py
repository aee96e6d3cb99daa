"""Exact ticks, for narrow phases: when two bodies touch and part, or reach a wall, also through images.

The flight plans of two bodies are one value, which ``plans_of`` makes, and ``plans_through`` of an image. It
is what discs (``first_touch``, ``last_touch``) and convex bodies (``enters``) take; walls take coordinates
(``reaches``). The difference of two convex shapes is a row of a table (``difference_table``,
``comes_nearer``), whose columns are named here. Along periodic axes ``first_image`` is the first contact
through any image.
"""

from __future__ import annotations

from kinetile.kernel.certificates.contact import first_touch, last_touch
from kinetile.kernel.certificates.convex import enters
from kinetile.kernel.certificates.convex_integers import (
    COUNT,
    CX,
    CY,
    HEAD,
    NX,
    NY,
    OUT,
    PLAIN,
    RADIUS,
    RANK,
    WIDE,
    comes_nearer,
)
from kinetile.kernel.certificates.plans import Axis, Plans, plans_of, plans_through
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.certificates.wall import reaches
from kinetile.kernel.compiled import Numbers, pointer, with_shapes
from kinetile.kernel.images import HALVES, first_image, near_zero, nearest_whole, turns_between
from kinetile.toolbox.differences import difference_table

__all__ = [
    "COUNT",
    "CX",
    "CY",
    "FAR",
    "HALVES",
    "HEAD",
    "NX",
    "NY",
    "OUT",
    "PLAIN",
    "RADIUS",
    "RANK",
    "WIDE",
    "Axis",
    "Numbers",
    "Plans",
    "comes_nearer",
    "difference_table",
    "enters",
    "first_image",
    "first_touch",
    "last_touch",
    "near_zero",
    "nearest_whole",
    "plans_of",
    "plans_through",
    "pointer",
    "reaches",
    "turns_between",
    "with_shapes",
]
