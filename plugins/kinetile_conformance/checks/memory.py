"""The observation of memory: what hooks change that is not theirs, and what they use outside of their arrays.

It runs on fixed scenes. A breach is named with hook, field and line, and often has no effect on any contact:
on another machine, or in a larger scene, it would have. ``watched_hooks`` runs a phase interpreted; where the
kit's own process has compiled hooks, an interpreter of its own does that.
"""

from __future__ import annotations

from collections.abc import Sequence

from kinetile.errors import Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks.check import Case, Disagreement, observation
from kinetile_conformance.processes import Died, in_a_child
from kinetile_conformance.strategies.gallery import SMALL
from kinetile_conformance.watched_hooks import watch_hooks

SECONDS = 60.0
"""CPU seconds for a simulation in the child."""

Titled = Sequence[tuple[str, Scene]]


def first_breach(subject: Subject, scenes: Titled) -> str | None:
    """Run a phase interpreted on scenes with all hooks watched; return the first breach and its scene, None
    where there is none.

    Raises Refused where it refuses all the scenes, or cannot be sent to another interpreter; TimeIsUp where
    it is not through with them in time.
    """
    if INTERPRETED:
        return _watched(subject, scenes)
    try:
        found: str | None = in_a_child(
            _watched, subject, scenes, environment={"NUMBA_DISABLE_JIT": "1"}, seconds=SECONDS
        )
    except Died as died:
        return f"interpreted, with its hooks watched, its process ended ({died})"
    return found


def _watched(subject: Subject, scenes: Titled) -> str | None:
    """Return the first breach of a phase whose hooks are watched, and its scene; None where there is none.
    Scenes that the phase refuses are left out; raises Refused where it refuses all."""
    refused = []
    for title, scene in scenes:
        try:
            said = watch_hooks(subject, scene)
        except Refused as refusal:
            refused.append(refusal)
            continue
        if said is not None:
            return f"{said}, on {title}"
    if len(refused) == len(scenes):
        raise refused[0]
    return None


@observation(compares=False)
def writes_only_where_it_may(case: Case) -> None:
    """Interpreted, its hooks change nothing that is not theirs, use no index outside of an array, and raise
    nothing"""
    said = first_breach(case.subject, SMALL)
    if said is not None:
        raise Disagreement(said)
