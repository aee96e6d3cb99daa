"""A broad phase whose hooks are watched, interpreted: what each changes, and indices below 0.

It is a phase as any other, which prepares the one under test and calls its hooks, in a process in which these
are plain Python: with NUMBA_DISABLE_JIT=1.

**Indices.** Compiled, an index too large is other memory; interpreted, NumPy raises. One below zero counts
from the end, which in a phase's own state is the author's business, and in the kernel's tables a mistake:
there hooks have views that raise.

**Changes.** Before and after each hook, all that it may not change is compared, byte for byte. It may change
its state, ``k.near``, and what the functions of the toolbox change for it. ``schedule`` sets a certificate:
each time it counts it, and, but for the body whose hook is running, it leaves the body among the offers to be
settled. So a certificate that differs without such an offer was written by something else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import wraps
from inspect import unwrap
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from kinetile.errors import KinetileError, Refused
from kinetile.kernel.tables import column, fields_in
from kinetile.plugin.calling import NOT_AUTHORS, place_of
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import BroadPhaseSpec
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.toolbox import NOBODY, BroadPhaseParts, Kernel
from kinetile_conformance.cases import PhasePlugin, Subject, horizon

NOT_AUTHORS.add(Path(__file__).parent)

WATCHED = "_watched"
"""The name of the phase whose hooks are watched."""


class Breach(Exception):
    """A hook does what it must not; the message names the hook, what it touched, and where."""


class _Strict(np.ndarray[Any, Any]):
    """Numbers, of which none is found by an index below zero; what is cut from them is not so strict."""

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


class _StrictRecords(_Strict, np.recarray):
    """Records."""


def strict(k: Kernel) -> Kernel:
    """Return the kernel's tables as views of the same memory that refuse an index below zero."""
    views = []
    for table in k:
        views.append(table.view(_StrictRecords if isinstance(table, np.recarray) else _Strict))
        views[-1].strict = True
    return Kernel(*views)


FAULT = {"fault.code", "fault.a", "fault.b"}
EVERYTHING: set[str] = set()
"""Stands for all fields of a table."""

TOOLBOX = {
    "queue": {"own"},
    "offers": EVERYTHING,
    "pairs": EVERYTHING,
    "lookup": EVERYTHING,
    "firsts": EVERYTHING,
    "clock": {"lists.offered", "lists.pairs", "lists.free", "lists.wanted", *FAULT},
    "counts": {"updated", "pairs_max", "late"},
}
ONLY_NAMES = {"near": EVERYTHING, "clock": FAULT, "counts": {"late"}}

HOOKS = {
    "build": {**TOOLBOX, "near": EVERYTHING},
    "repair": {**TOOLBOX, "near": EVERYTHING},
    "replan": TOOLBOX,
    "enter": {**TOOLBOX, "near": EVERYTHING},
    "leave": {**TOOLBOX, "near": EVERYTHING},
    "near": ONLY_NAMES,
    "soon": {},
    "arrange": ONLY_NAMES,
    "audit": ONLY_NAMES,
}
"""What each hook may change of the kernel's tables; of none but the state it may change anything else."""

ONLY_GROW = {"clock": ("lists.offered", "lists.wanted"), "counts": ("updated", "pairs_max", "late")}

OF_SCENE = ("position", "velocity", "radius", "mass")


class HookSnapshot(NamedTuple):
    """Copies from before a hook: of the tables that it may not change in whole, as far as they are in use, of
    the scene's arrays, and, where it may not change that either, of its state."""

    tables: dict[str, Any]
    scene: dict[str, bytes]
    state: dict[str, Any]

    @classmethod
    def of(cls, hook: str, k: Kernel, s: Any, scene: Scene) -> HookSnapshot:
        """Take one before a hook is called."""
        may = HOOKS[hook]
        tables = {name: _copy(t) for name, t in k._asdict().items() if may.get(name) is not EVERYTHING}
        for name, used in (("offers", "offered"), ("met", "logged"), ("log", "written")):
            tables[name] = _copy(getattr(k, name)[: int(k.clock[0].lists[used])])
        held = s._asdict() if hook in ("audit", "soon") else {}
        state = {name: array.copy() for name, array in held.items()}
        return cls(tables, bytes_of(scene), state)


def bytes_of(scene: Scene) -> dict[str, bytes]:
    """Return the arrays of a scene as they are now."""
    return {name: getattr(scene, name).tobytes() for name in OF_SCENE}


def breaches(hook: str, before: HookSnapshot, k: Kernel, s: Any, scene: Scene) -> Iterator[str]:
    """Yield what a hook has changed and may not, now that it has returned."""
    may = HOOKS[hook]
    for name, was in before.tables.items():
        table = _plain(getattr(k, name))[: len(was)]
        if was.tobytes() != table.tobytes():
            yield from _changed(name, was, table, may.get(name, set()) if name != "offers" else set())
    for name, fields in ONLY_GROW.items():
        was, is_now = before.tables[name], getattr(k, name)
        less = (field for field in fields if column(is_now, field)[0] < column(was, field)[0])
        yield from (f"{name}.{field} (it has become less)" for field in less)
    if "queue" in may:
        yield from _not_scheduled(before, k)
    for name, held in bytes_of(scene).items():
        if held != before.scene[name]:
            yield f"the scene's {name}"
    for name, was in before.state.items():
        if was.tobytes() != getattr(s, name).tobytes():
            yield f"s.{name}"


def _plain(table: Any) -> Any:
    """Return a table without access to its columns by attribute, which is slow."""
    return table.view(np.ndarray)


def _copy(table: Any) -> Any:
    """Return a copy of a table, at once: NumPy would copy records with gaps field by field."""
    return np.frombuffer(table.tobytes(), table.view(np.ndarray).dtype)


def _changed(name: str, was: Any, table: Any, may: set[str]) -> Iterator[str]:
    """Yield, for each field that may not change and has, the first row in which it did."""
    for field in fields_in(table.dtype) or (None,):
        if field in may:
            continue
        old, new = (was, table) if field is None else (column(was, field), column(table, field))
        if old.tobytes() != new.tobytes():
            row = next(row for row in range(len(new)) if old[row].tobytes() != new[row].tobytes())
            which = name if name in ("clock", "counts") else f"{name}[{row}]"
            which += f".{field}" if field else ""
            yield f"{which} ({new[row].item()!r}, where {old[row].item()!r} stood)"


def _not_scheduled(before: HookSnapshot, k: Kernel) -> Iterator[str]:
    """Yield certificates that have changed, and not by ``schedule``."""
    clock = k.clock[0]
    first, last, hand = len(before.tables["offers"]), int(clock.lists.offered), int(clock.hand)
    if not first <= last <= len(k.offers):
        return  # the list overflowed: every body is settled again
    left = _plain(k.offers)[first:last]
    settled = left["a"][left["b"] == NOBODY].tolist()
    set_anew = int(k.counts[0].updated) - int(before.tables["counts"][0]["updated"])
    of_hand = set_anew - len(settled)
    changed = np.flatnonzero(_plain(k.queue)["own"] != before.tables["queue"]["own"]).tolist()
    for body in changed:
        if body not in settled and (body != hand or of_hand == 0):
            yield f"queue[{body}].own, the certificate of body {body}, other than by schedule"
    if of_hand < 0 or (of_hand > 0 and hand < 0):
        yield f"counts.updated ({set_anew} more, where {len(settled)} certificates were scheduled)"


CONTACTS, EVENTS = 40, 60
"""The limits of each piece of a run."""

STRICT = ("build", "repair", "replan", "near", "enter", "leave", "soon")
"""Compiled elsewhere: they have tables without an index below zero."""


class Watched:
    """The broad phase of a ``subject``, with every hook watched; a phase is a class, so each subject has its
    own. ``said`` is what was seen first; None: nothing."""

    subject: Subject
    said: str | None = None

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Return the parts of the phase under test, with watched hooks."""
        held = bytes_of(scene)
        made = registry().target("broad phase", self.subject.name)(**self.subject.options)
        parts: BroadPhaseParts = made.prepare(scene)
        for name, was in held.items():
            if bytes_of(scene)[name] != was:
                raise self._breach(f"prepare wrote the scene's {name}")
        hooks = {name: hook for name in HOOKS if (hook := getattr(parts, name)) is not None}
        if parts.audit is not None:
            audit = parts.audit
            hooks["audit"] = wraps(audit)(lambda k, s: list(audit(k, s)))
        watched: dict[str, Any] = {name: self._watched(name, hook, scene) for name, hook in hooks.items()}
        if "soon" in watched:  # a loop calls it in large scenes alone
            near, soon = watched["near"], watched["soon"]

            def both(k: Kernel, s: Any, body: int) -> Any:
                for stage in range(3):
                    soon(k, s, body, stage)
                return near(k, s, body)

            watched["near"] = both
        return replace(parts, **watched)

    def _watched(self, name: str, hook: Callable[..., Any], scene: Scene) -> Callable[..., Any]:
        """Return a watched hook."""

        def watched(k: Kernel, s: Any, *body: int) -> Any:
            before = HookSnapshot.of(name, k, s, scene)
            try:
                found = hook(strict(k) if name in STRICT else k, s, *body)
            except Exception as error:
                said = f"{name} raised {type(error).__name__}: {error}{place_of(error)}"
                raise self._breach(said) from error
            for field in breaches(name, before, k, s, scene):
                raise self._breach(f"{name} wrote {field}{_place(hook)}")
            return found

        return watched

    def _breach(self, said: str) -> Breach:
        type(self).said = self.said or said
        return Breach(said)


def _place(hook: Callable[..., Any]) -> str:
    """Return where a hook begins, to be put behind a sentence."""
    code = getattr(unwrap(hook), "__code__", None)
    return f" (it begins in {Path(code.co_filename).name}, line {code.co_firstlineno})" if code else ""


def watch_hooks(subject: Subject, scene: Scene) -> str | None:
    """Run a phase on a scene with every hook watched; return what was seen first, None where nothing was.

    Whether the run gives the right answer, or comes to its end at all, is for other checks to say. Raises
    Refused where the phase cannot do the scene.
    """
    watched: Any = type("Watched", (Watched,), {"subject": subject})
    plugin = PhasePlugin(BroadPhaseSpec(WATCHED, watched))
    registry().add(plugin)
    try:
        _run(subject.under(WATCHED).simulation(scene), scene)
    except Refused:
        if watched.said is None:
            raise
    except Exception as error:  # in arrange and audit, a breach itself
        return str(watched.said or f"the run ended with {type(error).__name__}: {error}{place_of(error)}")
    finally:
        registry().remove(plugin)
    return cast(str | None, watched.said)


def _run(sim: Simulation, scene: Scene) -> None:
    """Run a while, turn a body to be fast, so that all is laid out again, run on, have bodies go and come,
    run on again, and run the phase's audit after each piece. What the audit says is for other checks."""
    for piece in range(3):
        there, places, radii = sim.bodies, sim.positions(), sim.radii()
        shapes = sim.shapes() if scene.shapes else None
        fast = float(np.abs(sim.velocities()).max(initial=0.0))
        if piece == 1 and len(there):
            with suppress(KinetileError, ValueError):  # too fast
                sim.set_velocity(int(there[-1]), (1.5 * fast, 0.25 * fast))
        for row in range(0, len(there) if piece == 2 else 0, 3 + len(there) // 6):
            size: dict[str, Any] = (
                {"shape": shapes[row]} if shapes is not None else {"radius": float(radii[row])}
            )
            with suppress(KinetileError, ValueError):  # no room
                sim.remove(int(there[row]))
                sim.insert(places[row], (0.25 * fast, -0.125 * fast), **size)
        with suppress(KinetileError):
            sim.run(horizon(scene) + piece, max_contacts=CONTACTS, max_events=EVENTS)
        with suppress(KinetileError):
            sim.audit()
