"""Checks of memory: what hooks change that is not theirs, and what they touch outside of their arrays.

They run on fixed scenes. A breach is named with hook, field and line, and often has no effect on any contact:
on another machine, or in a larger scene, it would have.

Two ways, since neither sees everything. ``watched_hooks`` runs a phase interpreted and names hook, field and
line, on small scenes; where the kit's own process has compiled hooks, an interpreter of its own does that.
``canaries`` runs the compiled loop as it is and names the array, on large scenes.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from kinetile.errors import KinetileError, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.compiled.limits import out_of_time
from kinetile.plugin.registry import Provided, registry
from kinetile.plugin.specs import BroadPhaseSpec, NarrowPhaseSpec
from kinetile.scene import Scene
from kinetile.scene.by_name import loads_scene
from kinetile.scene.files import dumps_scene
from kinetile_conformance.canaries import look_for_writes
from kinetile_conformance.cases import PhasePlugin, Subject, provided
from kinetile_conformance.checks.check import Disagreement, DoesNotApply, Reference, check
from kinetile_conformance.deadline import TimeIsUp
from kinetile_conformance.processes import news_apart
from kinetile_conformance.strategies.gallery import MANY, SMALL, titled
from kinetile_conformance.watched_hooks import watch_hooks

PROGRAM = "from kinetile_conformance.checks.memory import main; main()"

SECONDS = 40
"""CPU seconds after which the child ends, whatever it is doing."""

Titled = Iterable[tuple[str, Scene]]


def first_breach(subject: Subject, scenes: Titled) -> str | None:
    """Run a phase interpreted on scenes with all hooks watched; return the first breach and its scene, None
    where there is none.

    Raises Refused where it refuses all the scenes, or cannot be run in another interpreter; TimeIsUp where it
    is not through with them in time.
    """
    if INTERPRETED:
        return _first(partial(watch_hooks, subject), scenes)
    order = {
        "name": subject.name,
        "options": dict(subject.options),
        "narrow": subject.narrow,
        "targets": [_target(each) for each in provided(subject)],
        "scenes": [[title, dumps_scene(scene)] for title, scene in scenes],
    }
    path = [entry or os.getcwd() for entry in sys.path]
    done = subprocess.run(
        [sys.executable, "-P", "-c", PROGRAM],
        input=json.dumps(order),
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path), "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    try:
        found = json.loads(done.stdout.rpartition("\n")[2])
    except ValueError:
        if out_of_time(done.returncode):
            raise TimeIsUp from None
        said = done.stderr.strip().rpartition("\n")[2] or "nothing was said"
        return f"interpreted, with its hooks watched, its process ended with {done.returncode} ({said})"
    if found["refused"] is not None:
        raise Refused(found["refused"])
    return None if found["said"] is None else str(found["said"])


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


def _target(provided: Provided) -> dict[str, str] | None:
    """Return the spec of a phase of this process, so that another can import it; None for a phase that is
    installed."""
    if provided.distribution is not None:
        return None
    target = provided.spec.target
    found = target if isinstance(target, str) else f"{target.__module__}:{target.__qualname__}"
    if "<" in found or found.startswith("__main__:"):
        raise Refused(
            f"its hooks cannot be watched interpreted: {found} cannot be imported by another interpreter; "
            "a class at the top level of a module can, or run the kit with NUMBA_DISABLE_JIT=1"
        )
    role = {"role": provided.spec.role} if isinstance(provided.spec, NarrowPhaseSpec) else {}
    return {"name": provided.spec.name, "target": found, **role}


def carry_out(order: dict[str, Any]) -> dict[str, str | None]:
    """Carry out an order; return the first breach, or why no scene could be run."""
    subject = Subject(order["name"], order["options"], order["narrow"])
    for added in filter(None, order["targets"]):
        kind = NarrowPhaseSpec if "role" in added else BroadPhaseSpec
        registry().add(PhasePlugin(kind(**added)))
    scenes = [(title, loads_scene(text)) for title, text in order["scenes"]]
    try:
        return {"said": _first(partial(watch_hooks, subject), scenes), "refused": None}
    except KinetileError as error:
        return {"said": None, "refused": str(error)}


def main() -> None:
    """Carry out the order on the standard input."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    news = news_apart()
    found = carry_out(json.load(sys.stdin))
    os.write(news, json.dumps(found).encode())


@check(draws=False, compares=False, since="3.0")
def writes_only_where_it_may(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Interpreted, its hooks change nothing that is not theirs, use no index outside of an array, and raise
    nothing."""
    said = first_breach(subject, titled(SMALL))
    if said is not None:
        raise Disagreement(said)


@check(draws=False, compares=False, since="3.0")
def stays_within_its_arrays(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It writes nothing just before or behind an array of its state or of the kernel."""
    if INTERPRETED:
        raise DoesNotApply("hooks are interpreted here: writes-only-where-it-may looks at every index")
    said = _first(partial(look_for_writes, subject), titled(MANY))
    if said is not None:
        raise Disagreement(said)
