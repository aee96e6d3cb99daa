"""A broad phase with watched hooks, interpreted: it prepares the phase under test, and calls its hooks.

If compiled, an index too large reads other memory; interpreted, NumPy raises. An index below zero, which
counts from the end, is a mistake in the kernel's tables: hooks get views of them that raise. All data that a
hook may not change are compared before and after it, byte for byte. It may change its state, ``k.near``, and
the data that functions of the toolbox change for it. ``schedule`` sets a certificate and counts each call.
Unless the body's own hook is running, it also puts the body among the offers to be settled. So a certificate
that differs without such an offer was not written by ``schedule``.
"""

import linecache
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from dis import get_instructions
from functools import wraps
from inspect import unwrap
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from kinetile import BroadPhaseSpec, Scene, Simulation, registry
from kinetile.errors import KinetileError, Refused
from kinetile.instruments import column, fields_in, line_of_author, place_of
from kinetile.toolbox import NOBODY, BroadPhaseParts, Kernel
from kinetile.toolbox import hook as marked
from kinetile_conformance.cases import PhasePlugin, Subject, horizon

WATCHED = "_watched"


def unmarked(parts: BroadPhaseParts) -> Iterator[str]:
    """Yields functions of an author that are hooks, or are called by hooks, and are not marked as such: the
    compiler refuses them, and the interpreter calls them."""
    left = [getattr(parts, name) for name in STRICT]
    seen: set[Any] = set()
    while left:
        called = left.pop()
        function = unwrap(called) if callable(called) else called
        if not isinstance(function, FunctionType) or function in seen:
            continue
        seen.add(function)
        file, line = function.__code__.co_filename, function.__code__.co_firstlineno
        place = line_of_author([(file, line)])
        if not place:
            continue
        if function is called and not linecache.getline(file, line).lstrip().startswith("@"):
            name = function.__name__
            yield f"{name} is a plain function, and hooks call only hooks: mark it with toolbox.hook{place}"
        names = [each.argval for each in get_instructions(function) if each.opname == "LOAD_GLOBAL"]
        left += [function.__globals__.get(name) for name in names]


class Breach(Exception):
    """A hook breaks a rule; the message names the hook, the data that it touched, and the place."""


class _Strict(np.recarray[Any, Any]):
    """A table that refuses an index below zero; slices of it are not so strict."""

    strict = False

    def __getitem__(self, index: Any) -> Any:
        self._refuse(index)
        return super().__getitem__(index)

    def __setitem__(self, index: Any, value: Any) -> None:
        self._refuse(index)
        super().__setitem__(index, value)

    def _refuse(self, index: Any) -> None:
        if self.strict and isinstance(index, int | np.integer) and index < 0:
            raise IndexError(f"index {index} is below 0, in one of the kernel's tables")


def strict(k: Kernel) -> Kernel:
    """Returns the kernel's tables as views of the same memory that refuse an index below zero."""
    views = [table.view(_Strict) for table in k]
    for view in views:
        view.strict = True
    return Kernel(*views)


FAULT = {"fault.code", "fault.a", "fault.b"}
EVERYTHING: set[str] = set()
"""Stands for all fields of a table."""

TOOLBOX = {
    "queue": {"certificate"},
    **dict.fromkeys(("offers", "pairs", "lookup", "firsts"), EVERYTHING),
    "clock": {"lists.offered", "lists.pairs", "lists.free_pair", "lists.wanted", *FAULT},
    "counts": {"updated", "pairs_max", "late"},
}
BOTH = {**TOOLBOX, "near": EVERYTHING}
ONLY_NAMES = {"near": EVERYTHING, "clock": FAULT, "counts": {"late"}}

HOOKS = {
    **dict.fromkeys(("build", "repair", "enter", "leave"), BOTH),
    "replan": TOOLBOX,
    **dict.fromkeys(("near", "arrange", "audit"), ONLY_NAMES),
    "soon": {},
}
"""The fields of the kernel's tables that each hook may change, beside its state."""

ONLY_GROW = {"clock": ("lists.offered", "lists.wanted"), "counts": ("updated", "pairs_max", "late")}

USED = {"offers": "offered", "met": "logged", "log": "written"}
"""The used part of each list: no hook may change its present entries."""

Before = dict[str, tuple[Any, Any]]
"""Arrays and their copies from before a hook, by name."""


def copies(arrays: Mapping[str, Any]) -> Before:
    """Returns arrays and their copies, made at once: NumPy would copy records with gaps field by field."""
    plain = {name: array.view(np.ndarray) for name, array in arrays.items()}  # attributes are slow
    return {name: (each, np.frombuffer(each.tobytes(), each.dtype)) for name, each in plain.items()}


def of_scene(scene: Scene) -> dict[str, Any]:
    """Returns the arrays of a scene, by name."""
    fields = ("position", "velocity", "radius", "mass")
    return {f"the scene's {name}": getattr(scene, name).reshape(-1) for name in fields}


def before(hook: str, k: Kernel, s: Any, scene: Scene) -> Before:
    """Returns the present data that a hook may not change in whole: used tables, the scene, and its state."""
    lists, may = k.clock[0].lists, HOOKS[hook]
    used = {name: int(getattr(lists, field)) for name, field in USED.items()}
    tables = {name: table[: used.get(name)] for name, table in k._asdict().items()}
    kept = {name: each for name, each in tables.items() if name in used or may.get(name) is not EVERYTHING}
    held = s._asdict() if hook in ("audit", "soon") else {}
    return copies(kept | of_scene(scene) | {f"s.{name}": array.reshape(-1) for name, array in held.items()})


def breaches(hook: str, before: Before, k: Kernel) -> Iterator[str]:
    """Yields the forbidden changes of a hook after its return."""
    may = HOOKS[hook]
    for name, (now, was) in before.items():
        yield from changed(name, now, was, may.get(name, ()))
    for name, fields in ONLY_GROW.items():
        now, was = before[name]
        less = (field for field in fields if column(now, field)[0] < column(was, field)[0])
        yield from (f"{name}.{field} (it has become less)" for field in less)
    if "queue" in may:
        yield from _not_scheduled(before, k)


def changed(name: str, now: Any, was: Any, may: Iterable[str | None] = ()) -> Iterator[str]:
    """Yields the first changed row of each field of an array that changed and must not."""
    if was.tobytes() == now.tobytes():
        return
    for field in fields_in(now.dtype) or (None,):
        if field in may:
            continue
        old, new = (was, now) if field is None else (column(was, field), column(now, field))
        for row in [row for row in range(len(new)) if old[row].tobytes() != new[row].tobytes()][:1]:
            which = name if name in ("clock", "counts") else f"{name}[{row}]"
            which += f".{field}" if field else ""
            yield f"{which} ({new[row].item()!r}, where {old[row].item()!r} stood)"


def _not_scheduled(before: Before, k: Kernel) -> Iterator[str]:
    clock = k.clock[0]
    first, last, at_work = len(before["offers"][1]), int(clock.lists.offered), int(clock.at_work)
    if not first <= last <= len(k.offers):
        return  # the list overflowed: every body is settled again
    left = k.offers[first:last]
    settled = left["a"][left["b"] == NOBODY].tolist()
    set_anew = int(k.counts[0].updated) - int(before["counts"][1]["updated"][0])
    of_hand = set_anew - len(settled)
    now, was = before["queue"]
    stays = now["key"] < np.minimum(
        now["certificate"], was["certificate"]
    )  # filed under something earlier: not settled
    for body in np.flatnonzero((now["certificate"] != was["certificate"]) & ~stays).tolist():
        if body not in settled and (body != at_work or of_hand == 0):
            yield f"queue[{body}].certificate, the certificate of body {body}, other than by schedule"
    if of_hand < 0 or (of_hand > 0 and at_work < 0 and not stays.any()):
        yield f"counts.updated ({set_anew} more, where {len(settled)} certificates were scheduled)"


CONTACTS, EVENTS = 40, 60
STRICT = ("build", "repair", "replan", "near", "enter", "leave", "soon")
"""Compiled elsewhere: they have tables without an index below zero."""


@dataclass
class Watched:
    """The broad phase of a subject, with watched hooks, for one run; ``message`` names the first breach."""

    subject: Subject
    message: str | None = None

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts of the phase under test, with watched hooks."""
        held = copies(of_scene(scene))
        made = registry().target("broad phase", self.subject.name)(**self.subject.options)
        parts: BroadPhaseParts = made.prepare(scene)
        for name, arrays in held.items():
            for field in changed(name, *arrays):
                raise self._breach(f"prepare wrote {field}")
        hooks = {name: hook for name in HOOKS if (hook := getattr(parts, name)) is not None}
        if parts.audit is not None:
            audit = parts.audit
            hooks["audit"] = wraps(audit)(lambda k, s: list(audit(k, s)))
        watched: dict[str, Any] = {name: self._watched(name, hook, scene) for name, hook in hooks.items()}
        if "soon" in watched:  # a loop calls it only in large scenes
            near, soon = watched["near"], watched["soon"]

            def both(k: Kernel, s: Any, body: int) -> Any:
                for stage in range(3):
                    soon(k, s, body, stage)
                return near(k, s, body)

            watched["near"] = both
        watched |= {name: marked(watched[name]) for name in STRICT if name in watched}
        return replace(parts, **watched)

    def _watched(self, name: str, hook: Callable[..., Any], scene: Scene) -> Callable[..., Any]:
        code = getattr(unwrap(hook), "__code__", None)
        begins = f" (it begins in {Path(code.co_filename).name}, line {code.co_firstlineno})" if code else ""

        def watched(k: Kernel, s: Any, *body: int) -> Any:
            held = before(name, k, s, scene)
            try:
                found = hook(strict(k) if name in STRICT else k, s, *body)
            except Exception as error:
                text = f"{name} raised {type(error).__name__}: {error}{place_of(error)}"
                raise self._breach(text) from error
            for field in breaches(name, held, k):
                raise self._breach(f"{name} wrote {field}{begins}")
            return found

        return watched

    def _breach(self, text: str) -> Breach:
        self.message = self.message or text
        return Breach(text)


def watch_hooks(subject: Subject, scene: Scene) -> str | None:
    """Runs a phase on a scene with every hook watched; returns the first breach, or None. Raises Refused if
    the phase refuses the scene."""
    watched = Watched(subject)
    phase = type("Phase", (), {"prepare": staticmethod(watched.prepare)})
    plugin = PhasePlugin(BroadPhaseSpec(WATCHED, phase))
    registry().add(plugin)
    try:
        _run(subject.under(WATCHED).simulation(scene), scene)
    except Refused:
        if watched.message is None:
            raise
    except Exception as error:  # in arrange and audit, a breach itself
        return str(watched.message or f"the run ended with {type(error).__name__}: {error}{place_of(error)}")
    finally:
        registry().remove(plugin)
    return watched.message


def _run(sim: Simulation, scene: Scene) -> None:
    """Runs, turns a body fast, removes and inserts bodies, and audits the phase after each piece."""
    for piece in range(3):
        there, places, radii = sim.bodies, sim.positions(), sim.radii()
        shapes = sim.shapes()
        fast = float(np.abs(sim.velocities()).max(initial=0.0))
        if piece == 1 and len(there):
            with suppress(KinetileError, ValueError):  # too fast
                sim.set_velocity(int(there[-1]), (1.5 * fast, 0.25 * fast))
        for row in range(0, len(there) if piece == 2 else 0, 3 + len(there) // 6):
            size: dict[str, Any] = {"shape": shapes[row]} if scene.shapes else {"radius": float(radii[row])}
            with suppress(KinetileError, ValueError):  # no room
                sim.remove(int(there[row]))
                sim.insert(places[row], (0.25 * fast, -0.125 * fast), **size)
        with suppress(KinetileError):
            sim.run(horizon(scene) + piece, max_contacts=CONTACTS, max_events=EVENTS)
        with suppress(KinetileError):
            sim.audit()
