"""An interpreted run of a phase in which every hook is watched: each index it uses, and all that it changes.

The phase's parts are taken as they are, and each hook is put into a function that looks before and after
(``barrier``) and that hands it tables which look at every index (``bounds``). The engine then runs as it
always does. So this is for a process in which hooks are plain Python, that is with NUMBA_DISABLE_JIT=1.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import wraps
from inspect import unwrap
from pathlib import Path
from typing import Any

from kinetile.errors import KinetileError, Refused
from kinetile.kernel.log import TURNED
from kinetile.kernel.tables import Kernel
from kinetile.plugin.calling import place_of
from kinetile.plugin.protocols import BroadPhaseParts
from kinetile.run.advance import End, advance
from kinetile.run.arguments import read_turns
from kinetile.run.composition import Commands, Composition, compose_phases
from kinetile.run.engine import Engine, carry_out
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject, horizon
from kinetile_conformance.watch.barrier import Snapshot, breaches, bytes_of
from kinetile_conformance.watch.bounds import Breach, guarded
from kinetile_conformance.watch.comings import exchange

__all__ = ["CONTACTS", "EVENTS", "look"]

CONTACTS, EVENTS = 15, 150
"""A run ends after so many contacts or events, and after so many more when a body has been turned by hand."""

COMPILED = ("build", "repair", "replan", "near")
IF_THERE = ("enter", "leave")
"""Compiled too; a phase may be without."""


class Watch:
    """Watches the hooks of one phase on one scene.

    Attributes:
        said: what was seen first; None: nothing.
    """

    def __init__(self, scene: Scene) -> None:
        self.said: str | None = None
        self._scene = scene
        self._tables: dict[tuple[int, ...], tuple[Kernel, Kernel]] = {}

    def over(self, composition: Composition) -> Composition:
        """Return the phases with every hook of the broad phase watched."""
        fields = {field: getattr(composition, field) for field in Composition.__dataclass_fields__}
        return _Watched(**fields | {"broad": self._parts(composition.broad)}, watch=self)

    def _parts(self, parts: BroadPhaseParts) -> BroadPhaseParts:
        state = guarded(parts.state, "s", strict=False)
        there = [*COMPILED, *(name for name in IF_THERE if getattr(parts, name) is not None)]
        hooks: dict[str, Any] = {name: self._watched(name, getattr(parts, name), state) for name in there}
        if parts.arrange is not None:
            hooks["arrange"] = self._watched("arrange", parts.arrange)
        if parts.audit is not None:
            hooks["audit"] = self._watched("audit", self._all_of(parts.audit))
        return replace(parts, **hooks)

    @staticmethod
    def _all_of(audit: Callable[[Any, Any], Iterator[str]]) -> Callable[[Any, Any], list[str]]:
        return wraps(audit)(lambda k, s: list(audit(k, s)))

    def _watched(self, name: str, hook: Callable[..., Any], state: Any = None) -> Callable[..., Any]:
        """Return a hook that is watched; with a state that looks at every index, if it is given."""

        def watched(k: Kernel, s: Any, *body: int) -> Any:
            before = Snapshot.of(name, k, s, self._scene)
            try:
                found = hook(*(k, s) if state is None else (self._guarded(k), state), *body)
            except Breach as breach:
                raise self._tell(f"{name} {breach}") from breach
            except Exception as error:
                said = f"{name} raised {type(error).__name__}: {error}{place_of(error)}"
                raise self._tell(said) from error
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


@dataclass(frozen=True)
class _Watched(Composition):
    """Phases that are watched, also when they are prepared anew because bodies come and go."""

    watch: Watch | None = None

    def prepared_for(self, scene: Scene) -> Composition:
        anew = super().prepared_for(scene)
        return anew if self.watch is None else self.watch.over(anew)


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
    composition = compose_phases(scene, subject.name, subject.narrow_phases(scene), subject.options)
    for name, was in held.items():
        if bytes_of(scene)[name] != was:
            return f"prepare wrote the scene's {name}"
    watch = Watch(scene)
    try:
        engine = Engine(scene, watch.over(composition), keep_contacts=False, commands=Commands.TURNS)
        _run(engine, scene)
    except Refused:
        if watch.said is None:
            raise
    except KinetileError:
        pass
    except Exception as error:  # in arrange and audit, a breach itself
        if watch.said is None:
            return f"the run ended with {type(error).__name__}: {error}{place_of(error)}"
    return watch.said


def _run(engine: Engine, scene: Scene) -> None:
    """Run a while, turn a body to be fast, so that all is laid out anew, run on, have bodies go and come, run
    on again, and ask the phase's audit after each piece."""
    until = horizon(scene)
    _advance(engine, until)
    if len(scene):
        with contextlib.suppress(Refused):
            turns = read_turns(engine, [len(scene) - 1], [1.5 * engine.speed, 0.25 * engine.speed])
            carry_out(engine, TURNED, turns)
    _advance(engine, until + 1.0)
    for body in range(0, len(scene), 3):
        exchange(engine, body, (0.25 * engine.speed, -0.125 * engine.speed))
    _advance(engine, until + 2.0)


def _advance(engine: Engine, until: float) -> None:
    """Run on to a time, or for so many contacts or events; then ask the phase's own audit, if it has one.
    What it says is for other checks."""
    end = End(until, engine.clock.ticks(until), engine.contacts + CONTACTS, engine.events + EVENTS)
    advance(engine, end, None, lambda: None)
    engine.build()
    audit = engine.composition.broad.audit
    if audit is not None:
        audit(engine.k, engine.state)
