"""Narrow phases for pairs. A phase is registered for kinds of shapes (``NarrowPhaseSpec.shapes``) and takes
every two of these; the first named phase that takes two shapes decides their contacts. A phase that decides
no pair is not composed; if one phase decides all pairs, its parts are used unchanged."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from kinetile.errors import BadOption, Refused
from kinetile.kernel.loop.by_shape import all_numbers, by_shape, of_phase, takes, takes_bodies
from kinetile.plugin.calling import described
from kinetile.plugin.protocols import PairParts
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import NarrowPhaseSpec
from kinetile.scene import Scene


class NotTaken(Refused):
    """No named narrow phase takes two shapes of a scene; other phases may."""


def spec_of(name: str) -> NarrowPhaseSpec:
    """Returns the registration of a narrow phase."""
    return cast(NarrowPhaseSpec, registry().spec("narrow phase", name))


def who_takes(scene: Scene, names: Sequence[str]) -> dict[str, list[tuple[int, int]]]:
    """Returns the narrow phases that decide contacts of a scene, each with its pairs of shapes: the first
    that takes both. NotTaken if none takes two shapes of it, BadOption if one could never decide."""
    taken = {each: {*spec_of(each).shapes} for each in names}
    for at, name in enumerate(names):
        if any(taken[name] <= taken[other] for other in names[:at]):
            raise BadOption(
                f"{described('narrow phase', name)} would decide nothing: of {', '.join(names)} the first "
                "that takes two shapes decides their contacts; name the one that takes fewer first"
            )
    kinds = [each.kind for each in scene.shapes] or ["disc"]
    there = range(len(kinds))  # also shapes of bodies that may be inserted
    decides: dict[str, list[tuple[int, int]]] = {}
    for one, other in itertools.product(there, there) if names else ():
        first = next((name for name in names if {kinds[one], kinds[other]} <= taken[name]), None)
        if first is None:
            named = " and ".join(described("narrow phase", name) for name in names)
            raise NotTaken(f"{named} does not take {kinds[one]} against {kinds[other]}, which this scene has")
        decides.setdefault(first, []).append((one, other))
    return {name: decides[name] for name in names if name in decides}


def pair_parts(
    scene: Scene, decides: Mapping[str, list[tuple[int, int]]], given: Mapping[str, Any]
) -> PairParts | None:
    """Returns the parts for pairs: the parts of the one phase that decides, or the joined parts of several.
    Joined parts have the bounds of a phase that takes all shapes: all phases agree on a touch."""
    phases: list[PairParts] = [given[name] for name in decides]
    if len(phases) < 2:
        return phases[0] if phases else None
    taken = np.zeros((len(scene.shapes), len(scene.shapes)), np.int64)
    for at, pairs in enumerate(decides.values()):
        taken[tuple(np.transpose(pairs))] = at
    names = ("meet", "collide", "touch", "part", "gap")
    hooks = {name: tuple(getattr(each, name) for each in phases) for name in names}
    chosen: dict[str, Any] = {
        name: by_shape(each, takes if name == "gap" else takes_bodies)
        for name, each in hooks.items()
        if None not in each
    }
    there = {shape.kind for shape in scene.shapes}
    for at, (name, each) in enumerate(zip(decides, phases, strict=True)):
        if there <= {*spec_of(name).shapes} and each.soonest:
            chosen["soonest"] = of_phase(each.soonest, at)
    return PairParts(**chosen, shapes=True, numbers=all_numbers(taken, [each.numbers for each in phases]))
