"""Observations of memory: what hooks change that is not theirs, and what they touch outside of their arrays.

They run on fixed scenes. A breach is named with hook, field and line, and often has no effect on any contact:
on another machine, or in a larger scene, it would have.

Two ways, since neither sees everything. ``watched_hooks`` runs a phase interpreted and names hook, field and
line, on small scenes; where the kit's own process has compiled hooks, an interpreter of its own does that.
``canaries`` runs the compiled loop as it is and names the array, on large scenes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from kinetile.errors import KinetileError, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.scene import Scene
from kinetile_conformance.canaries import look_for_writes
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks.check import Case, Disagreement, DoesNotApply, observation
from kinetile_conformance.processes import Died, in_a_child
from kinetile_conformance.strategies.gallery import MANY, SMALL
from kinetile_conformance.watched_hooks import watch_hooks

SECONDS = 40.0
"""CPU seconds for the child."""

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
    """Return the first breach of a phase whose hooks are watched; raise Refused where there is no other
    end."""
    try:
        return _first(partial(watch_hooks, subject), scenes)
    except KinetileError as error:
        raise Refused(str(error)) from error


def _first(look: Callable[[Scene], str | None], scenes: Titled) -> str | None:
    """Return the first breach that ``look`` finds, and its scene; None where there is none.

    Scenes that the phase refuses are left out; raises Refused where it refuses all.
    """
    refusal: Refused | None = None
    run = 0
    for title, scene in scenes:
        try:
            said = look(scene)
        except Refused as error:
            refusal = error
            continue
        run += 1
        if said is not None:
            return f"{said}, on {title}"
    if refusal is not None and not run:
        raise refusal
    return None


@observation(compares=False)
def writes_only_where_it_may(case: Case) -> None:
    """Interpreted, its hooks change nothing that is not theirs, use no index outside of an array, and raise
    nothing"""
    said = first_breach(case.subject, SMALL)
    if said is not None:
        raise Disagreement(said)


@observation(compares=False)
def stays_within_its_arrays(case: Case) -> None:
    """It writes nothing just before or behind an array of its state or of the kernel"""
    if INTERPRETED:
        raise DoesNotApply("hooks are interpreted here: writes-only-where-it-may looks at every index")
    said = _first(partial(look_for_writes, case.subject), MANY)
    if said is not None:
        raise Disagreement(said)
