"""Bounds as loose as they may be: the same contacts, found the other way.

Between a body and its first contact the kernel has lower bounds, and asks for the exact tick only when a
bound has come to the head of the queue. With the bounds of ``disc`` it seldom has to ask all that is near a
body exactly, and so hardly ever asks a phase for them at a moment at which it has no hook of its own at work.
A narrow phase of the kit's own, which is ``disc`` but for bounds that always say "perhaps now", has it do so
at each event.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from kinetile.conformance.cases import Brought, Subject, difference, outcome
from kinetile.conformance.checks.check import Disagreement, Reference, check
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import NarrowPhaseSpec
from kinetile.scene import Scene
from kinetile.toolbox import NOBODY, Kernel, PairParts, hook

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

__all__ = ["LooseDisc", "same_contacts_with_loose_bounds"]

NAME = "conformance-loose-disc"


@hook
def perhaps_now(
    k: Kernel, body: int, count: int, barred: int, known: int, at: int
) -> tuple[float, float, int]:
    """Say of everybody that is asked about that they may touch at once: a bound may be early."""
    for i in range(count):
        other = k.near[i]
        if other != body and other != barred and other != known:
            return 0.0, 0.0, int(other)
    return math.inf, math.inf, NOBODY


class LooseDisc:
    """``disc`` with lower bounds that say nothing."""

    def prepare(self, scene: Scene) -> PairParts:
        """Return the parts."""
        parts: PairParts = registry().narrow_phase("disc")().prepare(scene)
        return replace(parts, soonest=perhaps_now)


@contextmanager
def _registered() -> Iterator[str]:
    """Within this context the narrow phase can be found by the name that it gives."""
    summary = "disc, with bounds as loose as they may be"
    plugin = Brought(NarrowPhaseSpec(NAME, LooseDisc, summary, role="pair"))
    registry().add(plugin)
    try:
        yield NAME
    finally:
        registry().remove(plugin)


def _boxes() -> SearchStrategy[Scene]:
    from kinetile.conformance.strategies.small import box_scenes

    return box_scenes(turns=False)


@check(scenes=_boxes, since="3.0")
def same_contacts_with_loose_bounds(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts with bounds as loose as they may be, so that all are asked exactly."""
    expected = reference(scene)
    with _registered() as name:
        found = outcome(subject, scene, narrow_phases=(name, "wall"))
    said = difference(found, expected, subject.name)
    if said is not None:
        raise Disagreement(f"with bounds as loose as they may be, {said}")
