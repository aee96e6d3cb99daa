"""An interpreted run of a phase in which every hook is watched: each index it uses, and all that it changes.

The phase's parts are taken as they are, and each hook is put into a function that looks before and after
(``barrier``) and that hands it tables which look at every index (``bounds``). The engine then runs as it
always does. So this is for a process in which hooks are plain Python, that is with NUMBA_DISABLE_JIT=1.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import wraps
from inspect import unwrap
from pathlib import Path
from typing import Any

from kinetile.conformance.cases import Subject, horizon
from kinetile.conformance.watch.barrier import Snapshot, breaches, bytes_of
from kinetile.conformance.watch.bounds import Breach, frames_of, guarded, line_of_author
from kinetile.errors import KinetileError, Refused
from kinetile.kernel.tables import Kernel
from kinetile.plugin.protocols import BroadPhaseParts
from kinetile.run.advance import End, advance
from kinetile.run.arguments import read_turns
from kinetile.run.composition import Commands, compose_phases
from kinetile.run.engine import Engine, carry_out
from kinetile.scene import Scene

__all__ = ["CONTACTS", "EVENTS", "look"]

CONTACTS, EVENTS = 15, 150
"""A run ends after so many contacts or events, and after so many more when a body has been turned by hand."""

COMPILED = ("build", "repair", "replan", "near")


class Watch:
    """Watches the hooks of one phase on one scene.

    Attributes:
        said: what was seen first; None: nothing.
    """

    def __init__(self, scene: Scene, parts: BroadPhaseParts) -> None:
        self.said: str | None = None
        self._scene = scene
        self._parts = parts
        self._state = guarded(parts.state, "s", strict=False)
        self._tables: dict[tuple[int, ...], tuple[Kernel, Kernel]] = {}

    def parts(self) -> BroadPhaseParts:
        """Return the parts with every hook watched."""
        parts = self._parts
        hooks: dict[str, Any] = {name: self._watched(name, getattr(parts, name)) for name in COMPILED}
        if parts.arrange is not None:
            hooks["arrange"] = self._watched("arrange", parts.arrange)
        if parts.audit is not None:
            hooks["audit"] = self._watched("audit", self._all_of(parts.audit))
        return replace(parts, **hooks)

    @staticmethod
    def _all_of(audit: Callable[[Any, Any], Iterator[str]]) -> Callable[[Any, Any], list[str]]:
        return wraps(audit)(lambda k, s: list(audit(k, s)))

    def _watched(self, name: str, hook: Callable[..., Any]) -> Callable[..., Any]:
        """Return a hook that is watched."""
        looks_at_indices = name in COMPILED

        def watched(k: Kernel, s: Any, *body: int) -> Any:
            before = Snapshot.of(name, k, s, self._scene)
            try:
                found = hook(*(self._guarded(k), self._state) if looks_at_indices else (k, s), *body)
            except Breach as breach:
                raise self._tell(f"{name} {breach}") from breach
            except Exception as error:
                where = line_of_author(frames_of(error.__traceback__))
                raise self._tell(f"{name} raised {type(error).__name__}: {error}{where}") from error
            for field in breaches(name, before, k, s, self._scene):
                raise self._tell(f"{name} wrote {field}{_place(hook)}")
            return found

        return watched

    def _tell(self, said: str) -> Breach:
        self.said = self.said or said
        return Breach(said)

    def _guarded(self, k: Kernel) -> Kernel:
        """Return tables that look at every index; made once for each tables that there are."""
        key = tuple(map(id, k))
        if key not in self._tables:
            self._tables[key] = k, guarded(k, "k", strict=True)
        return self._tables[key][1]


def _place(hook: Callable[..., Any]) -> str:
    """Return where a hook stands, to be put behind a sentence."""
    code = getattr(unwrap(hook), "__code__", None)
    return f" (it begins in {Path(code.co_filename).name}, line {code.co_firstlineno})" if code else ""


def look(subject: Subject, scene: Scene) -> str | None:
    """Run a phase on a scene with every hook watched; return what was seen first, None where nothing was.

    Whether the run gives the right answer, or comes to its end at all, is for other checks to say. Raises
    Refused where the phase cannot do the scene.
    """
    held = bytes_of(scene)
    composition = compose_phases(scene, subject.name, None, subject.options)
    for name, was in held.items():
        if bytes_of(scene)[name] != was:
            return f"prepare wrote the scene's {name}"
    watch = Watch(scene, composition.broad)
    try:
        engine = Engine(
            scene, replace(composition, broad=watch.parts()), keep_contacts=False, commands=Commands.TURNS
        )
        _run(engine, scene)
    except Refused:
        if watch.said is None:
            raise
    except KinetileError:
        pass
    except Exception as error:  # in arrange and audit, a breach itself
        if watch.said is None:
            where = line_of_author(frames_of(error.__traceback__))
            return f"the run ended with {type(error).__name__}: {error}{where}"
    return watch.said


def _run(engine: Engine, scene: Scene) -> None:
    """Run a while, turn a body to be fast, so that all is laid out anew, run on, and ask the phase's
    audit."""
    until = horizon(scene)
    _advance(engine, until)
    if len(scene):
        with contextlib.suppress(Refused):
            carry_out(
                engine, *read_turns(engine, [len(scene) - 1], [1.5 * engine.speed, 0.25 * engine.speed])
            )
    _advance(engine, until + 1.0)


def _advance(engine: Engine, until: float) -> None:
    """Run on to a time, or for so many contacts or events; then ask the phase's own audit, if it has one.
    What it says is for other checks."""
    end = End(until, engine.clock.ticks(until), engine.contacts + CONTACTS, engine.events + EVENTS)
    advance(engine, end, None, lambda: None)
    engine.build()
    audit = engine.composition.broad.audit
    if audit is not None:
        audit(engine.k, engine.state)
