"""The interpreted run in an interpreter of its own, where the kit's own has compiled hooks.

The child gets an order as JSON on its standard input: the phases' names and options, where the class of each
stands that was added in the asking process only, and the scenes as TOML. It says what it has seen as JSON on
its standard output. ``python -m kinetile_conformance.watch`` is such a child.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterable
from typing import Any

from kinetile.errors import KinetileError, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.compiled.limits import out_of_time
from kinetile.plugin.by_name import loads_scene
from kinetile.plugin.registry import Provided, registry
from kinetile.plugin.specs import BroadPhaseSpec, NarrowPhaseSpec
from kinetile.scene import Scene
from kinetile.scene.text.files import dumps_scene
from kinetile_conformance.cases import Brought, Subject, provided
from kinetile_conformance.court.limits import TimeIsUp
from kinetile_conformance.isolation.processes import news_apart
from kinetile_conformance.watch.interpreted import look

__all__ = ["carry_out", "first_breach"]

SECONDS = 40
"""CPU seconds after which the child ends, whatever it is doing."""

Titled = Iterable[tuple[str, Scene]]


def first_breach(subject: Subject, scenes: Titled) -> str | None:
    """Run a phase interpreted on scenes with all hooks watched; return what was seen first and on which
    scene, None where nothing was.

    Raises Refused where it refuses all the scenes, or cannot be run in another interpreter; TimeIsUp where it
    is not through with them in time.
    """
    if INTERPRETED:
        return _first_breach(subject, scenes)
    order = {
        "name": subject.name,
        "options": dict(subject.options),
        "narrow": subject.narrow,
        "targets": [_target(each) for each in provided(subject)],
        "scenes": [[title, dumps_scene(scene)] for title, scene in scenes],
    }
    path = [entry or os.getcwd() for entry in sys.path]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "kinetile_conformance.watch"],
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


def _first_breach(subject: Subject, scenes: Titled) -> str | None:
    refusal: Refused | None = None
    looked_at = 0
    for title, scene in scenes:
        try:
            said = look(subject, scene)
        except Refused as error:
            refusal = error
            continue
        looked_at += 1
        if said is not None:
            return f"{said}, on {title}"
    if refusal is not None and not looked_at:
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
    """Do what an order says; return what was seen, or why nothing could be looked at."""
    subject = Subject(order["name"], order["options"], order["narrow"])
    for added in filter(None, order["targets"]):
        kind = NarrowPhaseSpec if "role" in added else BroadPhaseSpec
        registry().add(Brought(kind(**added)))
    scenes = [(title, loads_scene(text)) for title, text in order["scenes"]]
    try:
        return {"said": _first_breach(subject, scenes), "refused": None}
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
