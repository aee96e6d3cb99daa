"""Who is right, where two phases do not give the same contacts: the specification decides, not a majority."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import Refused
from kinetile.kernel.clock import Clock
from kinetile.scene import only_turns
from kinetile_accuracy.answer.certify import certify_log

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["judged"]

_FARTHEST = 20_000
"""Contacts before the difference up to which somebody waits for a judgement: some seconds."""


def judged(
    scene: Scene, lists: Mapping[str, NDArray[Any]], index: int, narrow_phases: Sequence[str] | None = None
) -> str:
    """Return whose contacts are right where lists of them first differ, in a sentence.

    Args:
        scene: the scene.
        lists: contacts as ``sim.contacts`` has them, by the name of who gave them.
        index: where they first differ, counted from 0.
        narrow_phases: how bodies meet; None: as the scene says.

    Returns:
        The sentence; an empty one where the specification does not say how bodies meet in this scene, or
        where the difference is too far on.
    """
    names = scene.settings.narrow_phases if narrow_phases is None else narrow_phases
    known = {"disc"} if scene.arena is None else {"disc", "wall"}
    try:
        only_turns(scene, "the certifier")
    except Refused:
        return ""
    if index > _FARTHEST or (names is not None and set(names) != known):
        return ""
    there = [contacts[index] for contacts in lists.values() if len(contacts) > index]
    latest = max(((int(each["epoch"]), int(each["tick"])) for each in there), default=None)
    until = None if latest is None else _after(scene, *latest)
    return "by the specification " + "; ".join(
        f"{name} {_verdict(scene, contacts[: index + 1], None if len(contacts) > index else until)}"
        for name, contacts in lists.items()
    )


def _after(scene: Scene, epoch: int, tick: int) -> float:
    """Return a time hardly after a tick, and not before it."""
    return float(np.nextafter(Clock(scene.start, scene.time_unit).rounded(epoch, tick), np.inf))


def _verdict(scene: Scene, contacts: NDArray[Any], until: float | None) -> str:
    """Say whether contacts are right; up to ``until``, where the list has ended before."""
    found = certify_log(scene, contacts, until=until)
    if found.wrong is not None:
        return f"is wrong in contact {found.wrong.index}: {found.wrong.why}"
    return "is right there"
