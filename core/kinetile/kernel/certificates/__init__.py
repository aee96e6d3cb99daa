"""Certificates: the statements that a proof is made of, and when each of them fails.

Two sorts, which differ in what their failure times owe. ``structural``: a broad phase's certificates, linear
gaps between bounds; their times are rounded, and the skin has room for that. ``pair`` and ``wall``: contacts,
the failure of "these two are apart" (``parting``: of "these two overlap"). Their ticks are the answer, so
they are the exact floor of the exact root, whatever the doubles: a filter in double decides nearly all of
them (``pair``, ``wall``), a closer look at what hangs on a tie or a graze most of the rest (``closer``), and
integers all others (``integers``, on the numbers of ``limbs``). docs/specification.md has the definition,
docs/exact-ticks.md the proofs.
"""

from __future__ import annotations

from kinetile.kernel.certificates.pair import first_touch
from kinetile.kernel.certificates.parting import last_touch
from kinetile.kernel.certificates.structural import (
    FAR,
    falls,
    falls_eight,
    falls_many,
    schedule,
    ticks_after,
    to_be_settled,
)
from kinetile.kernel.certificates.wall import reaches

__all__ = [
    "FAR",
    "falls",
    "falls_eight",
    "falls_many",
    "first_touch",
    "last_touch",
    "reaches",
    "schedule",
    "ticks_after",
    "to_be_settled",
]
